// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto.h, called by programs of C99 that have nothing but the header and the shared object.
#include <doctest/doctest.h>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

// Compiles a program of this folder, and runs it with the paths of scenes.
test::Finished run_c(const std::string& source, const std::vector<std::string>& scenes) {
    const test::TemporaryFolder folder;
    const std::string program = folder / "program", libraries = LOBATTO_BUILD_DIR "/library";
    const test::Finished compiled =
        test::run({"gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-I",
                   LOBATTO_SOURCE_DIR "/library/include", LOBATTO_SOURCE_DIR "/tests/library/" + source, "-o", program,
                   "-L" + libraries, "-llobatto", "-lm", "-Wl,-rpath," + libraries});
    CAPTURE(compiled.err);
    REQUIRE(compiled.exit_code == 0);
    std::vector<std::string> command = {program};
    for (const std::string& scene : scenes) command.push_back(LOBATTO_SOURCE_DIR "/scenes/" + scene + ".toml");
    return test::run(command);
}

}  // namespace

TEST_CASE("from C99 a scene is derived, checked, chosen for and proved, and what is refused says why" *
          doctest::test_suite("slow")) {
    const test::Finished ran = run_c("known.c", {"pendulum", "rod_pendulum"});
    CAPTURE(ran.out);
    REQUIRE(ran.exit_code == 0);
    for (const char* line : {
             "latex: whole, file none\n\\documentclass",
             "json: whole, file none\n{",
             "check: whole, file none\n{",
             "stability: whole, file none\n{",
             "emit: whole, file pendulum.hpp\n// ",
             "plain: whole, file pendulum.hpp\n// ",
             "splitting: status 2, " LOBATTO_SOURCE_DIR "/scenes/pendulum.toml: what is exact here is of Lobatto and "
             "Gauss; choose one (--points 4), or ask for the "
             "limits of the method alone: lobatto stability --splitting 6\n",
             "two methods: status 2, points, stages and splitting name different methods; give one of them\n",
             "no scene: status 2, there is no scene: NULL was given\n",
             "chosen: ",
             "too much: status 2, an error of 0.9 cannot be promised",
             "proof: all hold\n",
             "no scene proved: status 2, there is no scene: NULL was given\n",
             "lobatto stability knows no constraints yet; run, sweep, emit, derive, check, verify, tune and tradeoff "
             "do",
         })
        CHECK_MESSAGE(ran.out.find(line) != std::string::npos, line);
}

TEST_CASE("from C99 a motion tells what it met, what holds it, and what a step does" * doctest::test_suite("slow")) {
    const test::Finished ran = run_c("motion.c", {"bouncing_ball", "rod_pendulum", "pendulum"});
    CAPTURE(ran.out);
    REQUIRE(ran.exit_code == 0);
    CHECK(ran.out.starts_with("met: "));
    CHECK(ran.out.find("unknown: status 2, unknown parameter 'omga'; declared: m, omega. Did you mean 'omega'?\n") !=
          std::string::npos);
    CHECK(ran.out.find("warning: the error is ") != std::string::npos);
}
