// SPDX-License-Identifier: GPL-2.0-or-later
// The plain text of an integrator: its bytes, that every compiler takes it, and that it moves as the kernel does.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "runtime/run/trajectory.hpp"
#include "tests/scenes/scenes.hpp"

using namespace lobatto;

namespace {

const std::string tree = LOBATTO_SOURCE_DIR;

Scene scene_file(const std::string& name, const std::string& method) {
    Scene scene = read_scene(tree + "/scenes/" + name + ".toml");
    if (method == "gauss") scene.method = {Family::gauss, 2};
    if (method == "splitting") scene.method = {Family::splitting, 11};
    if (method == "verlet") scene.method = {Family::lobatto, 2};
    return scene;
}

// t, q, p and H after so many steps of the plain text, compiled with every warning.
std::vector<double> plain_end(const Scene& scene, double step, int steps, const std::string& compiler,
                              Precision precision = Precision::double_) {
    const test::TemporaryFolder folder;
    const PlainSource source = emit_plain(scene, precision);
    test::write_text(folder / "plain.hpp", source.header);
    test::write_text(folder / "main.cpp",
                     fmt::format("#include <cstdio>\n#include <ctime>\n#include \"plain.hpp\"\nnamespace motion = "
                                 "lobatto::plain::{0};\nint main() {{\n    const motion::Parameters parameters;\n"
                                 "    motion::State x = motion::start(parameters);\n"
                                 "    for (int i = 0; i < {1}; ++i)\n"
                                 "        if (!motion::step(parameters, {2}, x)) return 1;\n"
                                 "    std::printf(\"%.17g\", double(x.t));\n"
                                 "    for (const auto q : x.q) std::printf(\" %.17g\", double(q));\n"
                                 "    for (const auto p : x.p) std::printf(\" %.17g\", double(p));\n"
                                 "    std::printf(\" %.17g\\n\", double(motion::energy(parameters, x)));\n}}\n",
                                 source.name, steps, fmt::format("motion::real({:.17g})", step)));
    const test::Finished compiled =
        test::run({compiler, "-std=c++17", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow",
                   "-Werror", folder / "main.cpp", "-o", folder / "main"});
    INFO(compiled.err);
    REQUIRE(compiled.exit_code == 0);
    const test::Finished ran = test::run({folder / "main"});
    REQUIRE(ran.exit_code == 0);
    std::istringstream numbers(ran.out);
    std::vector<double> end;
    for (double number; numbers >> number;) end.push_back(number);
    return end;
}

std::vector<double> kernel_end(const Scene& scene, double step, int steps) {
    const Derivation derivation = derive(scene);
    const Kernel kernel = test::kernel_in_own_cache(derivation, Precision::double_);
    const ExactStart exact(scene);
    const StartIn<double> start = start_in<double>(exact, kernel, step);
    LoadedStepper<double> stepper(kernel);
    REQUIRE(stepper.prepare(start.parameters, step) == LOBATTO_OK);
    REQUIRE(stepper.start(0, start.q, start.p) == LOBATTO_OK);
    lobatto_advance call{};
    call.steps = steps;
    REQUIRE(stepper.advance(call) == LOBATTO_OK);
    double time = 0, energy = 0;
    std::vector<double> q, p;
    stepper.state(time, q, p);
    std::vector<double> end{time};
    end.insert(end.end(), q.begin(), q.end());
    end.insert(end.end(), p.begin(), p.end());
    if (stepper.energy(time, q, p, energy) == LOBATTO_OK) end.push_back(energy);
    return end;
}

}  // namespace

TEST_CASE("a fresh process writes the bytes of generated/plain/") {
    const test::TemporaryFolder folder;
    const test::Finished emitted =
        test::run({LOBATTO_PROGRAM, "emit", tree + "/scenes/pendulum.toml", "--plain", "-o", folder.string()});
    INFO(emitted.err);
    REQUIRE(emitted.exit_code == 0);
    const std::string text = test::read_file(folder / "pendulum.hpp");
    CHECK(text == test::read_file(tree + "/generated/plain/pendulum.hpp"));
    CHECK(std::count(text.begin(), text.end(), '\n') <= 400);
    CHECK(text.find("#include \"") == std::string::npos);  // the standard library alone
}

TEST_CASE("the plain text of every form takes the steps of its kernel" * doctest::test_suite("slow")) {
    struct Row {
        const char *scene, *method;
        double step;
    };
    for (const Row& row :
         {Row{"pendulum", "", 0.05}, Row{"henon_heiles", "gauss", 0.1}, Row{"kepler", "splitting", 0.05},
          Row{"duffing", "", 0.02}, Row{"morse", "verlet", 0.01}, Row{"double_pendulum", "", 0.01},
          Row{"driven_damped_pendulum", "gauss", 0.02}, Row{"lagrange_top", "", 0.01},
          Row{"coupled_oscillators", "", 0.05}, Row{"two_pendulums", "", 0.05}}) {
        CAPTURE(row.scene);
        Scene scene = scene_file(row.scene, row.method);
        scene.outputs.energy = true;
        const std::vector<double> plain = plain_end(scene, row.step, 40, "g++"),
                                  kernel = kernel_end(scene, row.step, 40);
        REQUIRE(plain.size() == kernel.size());
        double worst = 0, largest = 0;
        for (std::size_t i = 0; i < plain.size(); ++i) {
            largest = std::max(largest, std::fabs(kernel[i]));
            worst = std::max(worst, std::fabs(plain[i] - kernel[i]));
        }
        CHECK(worst <= 1e-13 * largest);  // measured: at most 1.4e-15
    }
}

TEST_CASE("in float the plain text iterates to rounding, and its time does not drift" * doctest::test_suite("slow")) {
    const Scene two = read_scene(Source(
        "two.toml",
        "lagrangian = \"a'^2 + b'^2/2 + a'*b'*cos(a-b) + 9.81*(2*cos(a)+cos(b))\"\n[coordinates]\n"
        "a = { position = 1, velocity = 0 }\nb = { position = 0.5, velocity = 0 }\n[run]\nstep = 0.1\nuntil = 1\n"));
    for (const double step : {0.1, 0.25, 0.4, 0.6}) {  // an iteration that ends early is off by 0.03 and more
        CAPTURE(step);
        const std::vector<double> single = plain_end(two, step, 10, "g++", Precision::single),
                                  exact = plain_end(two, step, 10, "g++");
        for (std::size_t i = 1; i < 3; ++i) CHECK(std::fabs(single[i] - exact[i]) < 2e-5);
    }
    // Without its rest the time is 1000.6.
    CHECK(std::fabs(plain_end(two, 0.01, 100000, "g++", Precision::single).front() - 1000) < 1e-4);
}

TEST_CASE("a plain text may have the name of a function of the C library" * doctest::test_suite("slow")) {
    Scene scene = scene_file("pendulum", "");
    const std::vector<double> end = plain_end(scene, 0.05, 3, "g++");
    for (const char* name : {"gamma", "clock", "main", "std"}) {
        scene.name = name;
        CHECK(plain_end(scene, 0.05, 3, "g++") == end);
    }
}

TEST_CASE("clang++ takes the plain text too, in float and long double" * doctest::test_suite("slow")) {
    const Scene pendulum = scene_file("pendulum", "");
    const std::vector<double> exact = plain_end(pendulum, 0.05, 40, "clang++", Precision::extended),
                              coarse = plain_end(pendulum, 0.05, 40, "clang++", Precision::single),
                              usual = plain_end(pendulum, 0.05, 40, "clang++");
    CHECK(std::fabs(exact[1] - usual[1]) < 1e-13);
    CHECK(std::fabs(exact[1] - coarse[1]) < 1e-4);
    CHECK(exact[1] != coarse[1]);
}

TEST_CASE("a step that cannot be solved is refused, and the state stays") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "main.cpp",
                     "#include <cstdio>\n#include \"" + tree +
                         "/generated/plain/pendulum.hpp\"\nint main() {\n"
                         "    namespace pendulum = lobatto::plain::pendulum;\n    pendulum::Parameters parameters;\n"
                         "    const pendulum::State start = pendulum::start(parameters);\n"
                         "    pendulum::State x = start;\n"
                         "    const bool solved = pendulum::step(parameters, 3.0, x);\n"
                         "    std::printf(\"%d %d\\n\", solved, x.t == start.t && x.q[0] == "
                         "start.q[0] && x.p[0] == start.p[0]);\n}\n");
    REQUIRE(test::run({"g++", "-std=c++17", folder / "main.cpp", "-o", folder / "main"}).exit_code == 0);
    CHECK(test::run({folder / "main"}).out == "0 1\n");
}

TEST_CASE("the plain text begins with the momentum of a particle near the speed of light") {
    for (const char* momentum : {"0.5", "1", "5", "50"}) {
        CAPTURE(momentum);
        const Scene scene =
            test::scene_of("-sqrt(1 - x'^2) + x", fmt::format("x = {{ position = 0, momentum = {} }}", momentum), 4);
        const double p = std::strtod(momentum, nullptr);
        const std::vector<double> end = plain_end(scene, 0.01, 100, "g++");
        CHECK(std::abs(end[1] - (std::hypot(1, p + 1) - std::hypot(1, p))) < 1e-12);
        CHECK(std::abs(end[2] - (p + 1)) < 1e-12);
    }
}

TEST_CASE("scenes that have no plain text are told why") {
    const auto message = [](Scene scene, Precision precision = Precision::double_) {
        return test::message_of<InputError>([&] { emit_plain(scene, precision); });
    };
    Scene clean = scene_file("pendulum", "");
    clean.method.arithmetic = StepArithmetic::clean;
    CHECK(message(clean).find("no clean arithmetic") != std::string::npos);
    CHECK(message(scene_file("wave_chain", "")).find("at most 64 coordinates, but the scene has 256") !=
          std::string::npos);
    CHECK(message(scene_file("pendulum", ""), Precision::quadruple).find("long double") != std::string::npos);
}
