// SPDX-License-Identifier: GPL-2.0-or-later
// The same scene gives the same bytes: again, from a new cache, from another folder, with any number of threads.
#include <doctest/doctest.h>

#include "tests/support.hpp"

using namespace lobatto::test;

namespace {

// A chain (loops, banded equations), a general Lagrangian, a driven one with friction.
const char* const scenes[] = {"fput_beta", "double_pendulum", "driven_damped_pendulum"};

std::string scene_file(const std::string& name) {
    return LOBATTO_SOURCE_DIR "/scenes/" + name + ".toml";
}

}  // namespace

TEST_CASE("a run has the same bytes again, from a new cache and from a copy of the scene elsewhere" *
          doctest::test_suite("slow")) {
    for (const std::string name : scenes) {
        CAPTURE(name);
        const TemporaryFolder folder;
        const auto bytes = [&](const std::string& scene, const std::string& cache, const std::string& expected) {
            const EnvironmentVariable variable("LOBATTO_CACHE_DIR", folder / cache);
            const std::string out = folder / "run.csv";
            const Finished done = run({LOBATTO_PROGRAM, "run", scene, "--step", "0.01", "--until", "3", "-o", out});
            REQUIRE_MESSAGE(done.exit_code == 0, done.err);
            CHECK(done.out.find(expected) != std::string::npos);
            return read_file(out);
        };
        const std::string first = bytes(scene_file(name), "one", ", compiled in ");
        CHECK(first.size() > 10000);
        CHECK(bytes(scene_file(name), "one", ", found derived and compiled in the cache\n") == first);
        std::filesystem::copy_file(scene_file(name), folder / (name + ".toml"));
        CHECK(bytes(folder / (name + ".toml"), "two", ", compiled in ") == first);
    }
}

TEST_CASE("columns beside the state and what sweeps keep have the same bytes in every process" *
          doctest::test_suite("slow")) {
    const TemporaryFolder folder;
    const auto same = [&](const std::vector<std::string>& command, const char* name) {
        std::string first;
        for (int i = 0; i < 4; ++i) {
            std::vector<std::string> words = command;
            words.insert(words.begin(), LOBATTO_PROGRAM);
            words.insert(words.end(), {"--unmeasured", "-o", (folder / "table.csv").string()});
            const Finished done = run(words);
            REQUIRE_MESSAGE(done.exit_code == 0, done.err);
            const std::string bytes = read_file(folder / "table.csv");
            if (i == 0) first = bytes;
            CHECK_MESSAGE(bytes == first, name);
        }
        CHECK(first.size() > 500);
    };
    for (const char* name : {"rigid_top", "slider_crank"})
        same({"run", scene_file(name), "--step", "0.01", "--until", "0.2"}, name);
    same({"sweep", scene_file("double_pendulum"), "--vary", "a=0.1:2:12", "--until", "2", "--keep",
          "last(sin(a)*b' + cos(b)*a' + a*b + 3*a' + b'/7)"},
         "sweep");
}

TEST_CASE("a sweep has the same bytes from a new cache and with any number of threads") {
    const TemporaryFolder folder;
    std::string first;
    for (const char* threads : {"1", "2", "3", "7"}) {
        const EnvironmentVariable variable("LOBATTO_CACHE_DIR",
                                           folder / (threads == std::string("1") ? "one" : "more"));
        const Finished done = run({LOBATTO_PROGRAM, "sweep", scene_file("henon_heiles"), "--vary", "x=0:0.3:23",
                                   "--until", "20", "--threads", threads, "-o", folder / "sweep.csv"});
        REQUIRE_MESSAGE(done.exit_code == 0, done.err);
        const std::string bytes = read_file(folder / "sweep.csv");
        if (first.empty()) first = bytes;
        CHECK(bytes == first);
    }
    CHECK(first.size() > 1000);
}
