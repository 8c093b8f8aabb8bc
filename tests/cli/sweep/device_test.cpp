// SPDX-License-Identifier: GPL-2.0-or-later
// Sweeps on a device, with a driver that has none (fake_cuda.cpp): the device's text is compiled by a C++ compiler, all
// else is as with a GPU. What a GPU computes of that text is not tested here.
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "runtime/build/cuda_compiler.hpp"
#include "tests/cli/sweep/tables.hpp"

using namespace lobatto;
using test::pendulum_file;

namespace {

// Stands in the place of nvcc: reads the same command.
const char* const compiler_of_text = R"(#!/bin/sh
while [ $# -gt 0 ]; do
    case "$1" in
        *.cu) source=$1 ;;
        -o) object=$2 ;;
    esac
    shift
done
exec ${CXX:-g++} -x c++ -std=c++17 -O0 -march=native -ffp-contract=off -fno-math-errno -fPIC -shared -w "$source" -o "$object"
)";

class FakeDevice {
public:
    FakeDevice() {
        test::write_text(folder_ / "nvcc", compiler_of_text);
        std::filesystem::permissions(std::string(folder_ / "nvcc"), std::filesystem::perms::owner_all);
        const test::Finished made = test::run({"g++", "-std=c++17", "-shared", "-fPIC", "-I", LOBATTO_SOURCE_DIR,
                                               LOBATTO_SOURCE_DIR "/tests/cli/sweep/fake_cuda.cpp", "-o",
                                               std::string(folder_ / "libcuda.so.1")});
        REQUIRE_MESSAGE(made.exit_code == 0, made.err);
    }

private:
    test::TemporaryFolder folder_;
    test::EnvironmentVariable driver_{"LD_LIBRARY_PATH", std::string(folder_ / "")},
        nvcc_{"NVCC", std::string(folder_ / "nvcc")};
};

std::string scene_file(const std::string& name) {
    return LOBATTO_SOURCE_DIR "/scenes/" + name + ".toml";
}

// The table of one sweep on the device has the bytes of that on the processor: these. What is said of failures agrees
// too.
std::string check_same_bytes(const std::string& scene, const std::vector<std::string>& words, int exit_code = 0) {
    CAPTURE(scene);
    CAPTURE(fmt::format("{}", fmt::join(words, " ")));
    const test::SweepFolder place;
    std::vector<test::Finished> ends;
    for (const std::string device : {"cpu", "cuda"}) {
        std::vector<std::string> all{"sweep", scene, "--quiet", "--device", device, "-o", place.file(device + ".csv")};
        all.insert(all.end(), words.begin(), words.end());
        ends.push_back(place.lobatto(all));
        CHECK_MESSAGE(ends.back().exit_code == exit_code, ends.back().err);
    }
    CHECK(test::read_file(place.file("cpu.csv")) == test::read_file(place.file("cuda.csv")));
    const auto before_path = [&](const std::string& text) { return text.substr(0, text.find("What was computed")); };
    CHECK(before_path(ends[0].err) == before_path(ends[1].err));
    return test::read_file(place.file("cuda.csv"));
}

// A scene of ours that stops there.
std::string stopped_scene(const test::SweepFolder& place, const std::string& name, const std::string& stop) {
    std::string text = test::read_file(scene_file(name));
    const std::string run = "[run]\n";
    text.insert(text.find(run) + run.size(), "stop = " + stop + "\n");
    test::write_text(place.file(name + ".toml"), text);
    return place.file(name + ".toml");
}

// The tables agree to rounding: in each column to this part of its largest number, and of the energy.
void check_to_rounding(const std::string& scene, const std::vector<std::string>& words, double part, double energy = 0,
                       int exit_code = 0) {
    CAPTURE(scene);
    CAPTURE(fmt::format("{}", fmt::join(words, " ")));
    const test::SweepFolder place;
    std::vector<std::vector<std::vector<double>>> columns;
    for (const std::string device : {"cpu", "cuda"}) {
        std::vector<std::string> all{"sweep", scene, "--quiet", "--device", device, "-o", place.file(device + ".csv")};
        all.insert(all.end(), words.begin(), words.end());
        const test::Finished end = place.lobatto(all);
        REQUIRE_MESSAGE(end.exit_code == exit_code, end.err);
        std::istringstream lines(test::read_file(place.file(device + ".csv")));
        auto& of_device = columns.emplace_back();
        bool is_head = true;
        for (std::string line; std::getline(lines, line);) {
            if (line.empty() || line[0] == '#') continue;
            std::istringstream fields(line);
            std::string field;
            for (std::size_t i = 0; !is_head && std::getline(fields, field, ','); ++i) {
                if (of_device.size() <= i) of_device.emplace_back();
                of_device[i].push_back(std::stod(field));
            }
            is_head = false;
        }
    }
    REQUIRE(columns[0].size() == columns[1].size());
    REQUIRE(columns[0].size() > 4);
    for (std::size_t c = 0; c < columns[0].size(); ++c) {
        const std::vector<double>&a = columns[0][c], &b = columns[1][c];
        REQUIRE(a.size() == b.size());
        double largest = 0, difference = 0;
        for (std::size_t i = 0; i < a.size(); ++i) {
            CHECK(std::isnan(a[i]) == std::isnan(b[i]));
            if (std::isnan(a[i])) continue;
            largest = std::max(largest, std::fabs(a[i]));
            difference = std::max(difference, std::fabs(a[i] - b[i]));
        }
        CAPTURE(c);
        CHECK(difference <= part * std::max(largest, energy));
    }
}

// How many rows have something but 0 in the column `stop`.
int stopped_rows(const std::string& table) {
    std::istringstream lines(table);
    int column = -1, count = 0;
    for (std::string line; std::getline(lines, line);) {
        if (line.empty() || line[0] == '#') continue;
        std::istringstream fields(line);
        std::string field;
        for (int i = 0; std::getline(fields, field, ','); ++i)
            if (column < 0 && field == "stop")
                column = i;
            else if (i == column && field != "0" && field != "stop")
                ++count;
    }
    return count;
}

}  // namespace

TEST_SUITE("slow") {
    TEST_CASE("states of all forms on the device have the bits of the processor's lanes after 200 steps" *
              doctest::test_suite("slowest")) {
        const FakeDevice device;
        check_same_bytes(pendulum_file, {"--vary", "q=0.1:3:300", "--vary", "omega=1,2", "--steps", "200"});
        // Several workers, each with a queue of its own, and groups that are handed over in order.
        check_same_bytes(pendulum_file, {"--vary", "q=0.1:3:4500", "--steps", "40", "--unmeasured", "--threads", "4"});
        check_same_bytes(scene_file("kepler"), {"--vary", "y'=1.5:2.2:70", "--steps", "200", "--unmeasured"});
        check_same_bytes(scene_file("double_pendulum"), {"--vary", "a=0.1:3:70", "--steps", "200", "--unmeasured"});
        check_same_bytes(scene_file("harmonic_oscillator"),
                         {"--vary", "q=0:3:70", "--vary", "omega=1,2", "--steps", "200"});
        check_same_bytes(scene_file("henon_heiles"),
                         {"--splitting", "6", "--random", "70", "--draw", "y ~ uniform(-0.2, 0.2)", "--steps", "200"});
        check_same_bytes(scene_file("driven_damped_pendulum"),
                         {"--vary", "theta=0:3:70", "--steps", "200", "--unmeasured"});
        check_same_bytes(pendulum_file,
                         {"--vary", "q=0.1:3:70", "--steps", "200", "--numbers", "float", "--unmeasured"});
    }

    TEST_CASE("kept states, steps that are varied and steps that fail on the device are those of the processor") {
        const FakeDevice device;
        check_same_bytes(pendulum_file,
                         {"--vary", "q=0.1:2.8:70", "--vary", "step=0.1,0.05", "--until", "20", "--every", "30"});
        // Iterations fail in many of these: the processor takes such steps by Newton's iteration, or says that it
        // cannot.
        check_same_bytes(scene_file("double_pendulum"),
                         {"--vary", "a=0.1:3:70", "--step", "0.3", "--steps", "200", "--unmeasured"}, 3);
        check_same_bytes(scene_file("kepler"),
                         {"--vary", "y'=0.1:2.2:70", "--step", "0.1", "--steps", "200", "--unmeasured"}, 3);
    }

    TEST_CASE("trajectories that end at a stop on the device are those of the processor, in all forms" *
              doctest::test_suite("slowest")) {
        const FakeDevice device;
        const test::SweepFolder place;
        const std::vector<std::string> map{"--vary",  "a=-3:3:12", "--vary",           "b=-3:3:12",
                                           "--until", "40",        "--beyond-horizon", "--unmeasured"};
        CHECK(stopped_rows(check_same_bytes(scene_file("flips"), map)) > 50);
        // With a companion, which does not stop, and parameters that differ.
        const std::string pendulum = stopped_scene(place, "pendulum", R"(["q = -1", "q' = 4"])");
        CHECK(stopped_rows(
                  check_same_bytes(pendulum, {"--vary", "q=0.5:2.9:20", "--vary", "omega=1,2", "--until", "20"})) > 20);
        CHECK(stopped_rows(check_same_bytes(
                  pendulum, {"--vary", "q=0.5:2.9:70", "--until", "8", "--every", "7", "--unmeasured"})) > 20);
        const std::string star = stopped_scene(place, "henon_heiles", R"("x = 0.25")");
        CHECK(stopped_rows(check_same_bytes(star, {"--splitting", "6", "--random", "70", "--draw",
                                                   "y ~ uniform(-0.3, 0.3)", "--steps", "300"})) > 5);
        // Steps that the processor takes by Newton's iteration, some of which fail, between stops.
        const std::string failing = stopped_scene(place, "double_pendulum", R"(["b = pi", "b = -pi"])");
        CHECK(stopped_rows(check_same_bytes(
                  failing, {"--vary", "a=0.1:3:70", "--step", "0.3", "--steps", "200", "--unmeasured"}, 3)) > 5);
    }

    TEST_CASE(
        "what is kept of a trajectory on the device is that of the processor, with events, stops and failed steps" *
        doctest::test_suite("slowest")) {
        const FakeDevice device;
        const std::string kept =
            "max(q), min(p_q), mean(H), last(q'^2), count(q = 0), first(q' = 1 rising), mean(sin(q)*q^3)";
        check_to_rounding(
            pendulum_file,
            {"--vary", "q=0.1:3:70", "--vary", "omega=1,2", "--steps", "200", "--unmeasured", "--keep", kept}, 1e-14);
        check_same_bytes(pendulum_file, {"--vary", "q=0.1:3:70", "--steps", "0", "--unmeasured", "--keep",
                                         "max(q), last(H), first(q = 0), mean(q'), count(q = 0)"});
        // At rest in a rotating frame velocities are the rounding of momenta.
        const test::SweepFolder place;
        test::write_text(place.file("disk.toml"),
                         "lagrangian = \"(x' - y)^2/2 + (y' + x)^2/2 + x'^2*y^2/100 - (x^2 + y^2)/2\"\n"
                         "[coordinates]\nx = { position = 1, velocity = 0 }\ny = { position = 0.5, velocity = 0 }\n"
                         "[method]\npoints = 4\n[run]\nstep = 0.1\nuntil = 1\n");
        check_to_rounding(place.file("disk.toml"),
                          {"--vary", "x=0.1:3:7", "--steps", "200", "--unmeasured", "--keep", "max(H), mean(x'^2 + 1)"},
                          1e-13);
        check_same_bytes(scene_file("harmonic_oscillator"),  // a linear map
                         {"--vary", "q=0.1:3:70", "--steps", "200", "--keep", "max(H), mean(q^2), last(p_q)"});
        check_same_bytes(scene_file("henon_heiles"),
                         {"--splitting", "6", "--random", "70", "--draw", "y ~ uniform(-0.2, 0.2)", "--steps", "200",
                          "--keep", "max(x), count(y = 0), mean(H)"});
        // In the general form velocities follow from momenta by other iterations.
        check_to_rounding(scene_file("double_pendulum"),
                          {"--vary", "a=0.1:2:70", "--step", "0.3", "--steps", "200", "--unmeasured", "--keep",
                           "count(a = 0), max(H), mean(a'), first(b = pi)"},
                          1e-13, 0, 3);  // the energy of some is off
        check_to_rounding(scene_file("flips"),
                          {"--vary", "a=-3:3:12", "--vary", "b=-3:3:12", "--until", "40", "--beyond-horizon",
                           "--unmeasured", "--keep", "max(H), count(a = 0), mean(b^2)"},
                          1e-13);
    }

    TEST_CASE("double-double on the device agrees with the processor's single trajectories, float with stops too" *
              doctest::test_suite("slowest")) {
        const FakeDevice device;
        // Parts below the rounded value are compared as parts of themselves: 1e-9 of 2^-53 is 1e-25.
        check_to_rounding(pendulum_file,
                          {"--vary", "q=0.1:3:20", "--steps", "200", "--unmeasured", "--numbers", "double-double"},
                          1e-9);
        check_to_rounding(
            scene_file("flips"),
            {"--vary", "a=-3:3:6", "--vary", "b=-3:3:6", "--until", "4", "--unmeasured", "--numbers", "double-double"},
            1e-9);
        const std::vector<std::string> map{"--vary", "a=-3:3:12", "--vary", "b=-3:3:12",   "--until",
                                           "4",      "--numbers", "float",  "--unmeasured"};
        check_to_rounding(scene_file("flips"), map, 1e-5, 5);
    }

    TEST_CASE("a device that is lost ends the sweep, its finished rows stay, and --resume goes on to the same bytes") {
        const FakeDevice device;
        const test::SweepFolder place;
        const std::vector<std::string> words{"--vary",  "q=0.1:2.8:70", "--vary",       "step=0.1,0.05", "--until", "2",
                                             "--every", "10",           "--unmeasured", "--threads",     "1"};
        const std::string whole = place.bytes("whole.csv", words);
        std::vector<std::string> on_device = words;
        on_device.insert(on_device.end(), {"--device", "cuda", "--resume"});
        {
            // Eight launches take the first step size to its end: four to each state that is kept.
            const test::EnvironmentVariable lost("FAKE_CUDA_LOST", "9");
            CHECK(place.refusal("lost.csv", on_device, 4) ==
                  "lobatto: the GPU no real GPU does not begin the steps: unspecified launch failure "
                  "(CUDA_ERROR_LAUNCH_FAILED); or compute with --device cpu\n");
        }
        // The last one of a part may lack rows, and is computed again.
        const test::Finished resumed = place.sweep("lost.csv", on_device);
        CHECK(resumed.exit_code == 0);
        CHECK_MESSAGE(resumed.out.find("after 69 trajectories") != std::string::npos, resumed.out);
        CHECK(test::read_file(place.file("lost.csv")) == whole);
    }
}

TEST_CASE("what stands in the way of a sweep on a device is said, with what to do") {
    const test::SweepFolder place;
    const std::vector<std::string> words{"--vary", "q=1,2", "--steps", "10", "--device", "cuda"};
    SUBCASE("no nvcc") {
        const FakeDevice device;
        const test::EnvironmentVariable none("NVCC", "/nowhere/nvcc");
        CHECK(
            place.refusal("t.csv", words, 4) ==
            "lobatto: the environment variable NVCC names '/nowhere/nvcc', which is no program; correct NVCC, or unset "
            "it to look for nvcc in PATH and in /usr/local/cuda/bin\n");
    }
    SUBCASE("no device") {
        const FakeDevice device;
        const test::EnvironmentVariable none("FAKE_CUDA_DEVICES", "0");
        CHECK(place.refusal("t.csv", words, 4) ==
              "lobatto: NVIDIA's driver shows no GPU; see what nvidia-smi says, and whether CUDA_VISIBLE_DEVICES hides "
              "it; or compute with --device cpu\n");
    }
    SUBCASE("no memory") {
        const FakeDevice device;
        const test::EnvironmentVariable none("FAKE_CUDA_BYTES", "100");
        CHECK(
            place.refusal("t.csv", words, 4) ==
            "lobatto: the GPU no real GPU cannot hold the trajectories: its memory is full; wait until other programs "
            "have left it; or compute with --device cpu\n");
    }
    SUBCASE("what the device does not do") {
        std::vector<std::string> quadruple = words;
        quadruple.insert(quadruple.end(), {"--numbers", "quadruple"});
        CHECK(place.refusal("t.csv", quadruple) ==
              pendulum_file +
                  ": --device cuda: a GPU has double, float and double-double, not "
                  "quadruple; compute with --device cpu\n");
    }
}

TEST_CASE("--device auto takes the processor where there is no device") {
    const FakeDevice device;
    const test::EnvironmentVariable none("FAKE_CUDA_DEVICES", "0");
    const test::SweepFolder place;
    const std::vector<std::string> words{"--vary", "q=1,2", "--steps", "10"};
    std::vector<std::string> chosen = words;
    chosen.insert(chosen.end(), {"--device", "auto"});
    CHECK(place.bytes("auto.csv", chosen) == place.bytes("cpu.csv", words));
}
