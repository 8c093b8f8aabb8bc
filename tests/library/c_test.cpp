// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto.h, called by a program of C99 (known.c) that has nothing but the header and the shared object.
#include <doctest/doctest.h>

#include "tests/support.hpp"

using namespace lobatto;

TEST_CASE("from C99 a scene is derived, checked, chosen for and proved, and what is refused says why") {
    const test::TemporaryFolder folder;
    const std::string program = folder / "known", libraries = LOBATTO_BUILD_DIR "/library";
    const test::Finished compiled =
        test::run({"gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-I",
                   LOBATTO_SOURCE_DIR "/library/include", LOBATTO_SOURCE_DIR "/tests/library/known.c", "-o", program,
                   "-L" + libraries, "-llobatto", "-Wl,-rpath," + libraries});
    CAPTURE(compiled.err);
    REQUIRE(compiled.exit_code == 0);
    const test::Finished ran = test::run(
        {program, LOBATTO_SOURCE_DIR "/scenes/pendulum.toml", LOBATTO_SOURCE_DIR "/scenes/rod_pendulum.toml"});
    CAPTURE(ran.out);
    REQUIRE(ran.exit_code == 0);
    for (const char* line : {
             "latex: whole, file none\n\\documentclass",
             "json: whole, file none\n{",
             "check: whole, file none\n{",
             "stability: whole, file none\n{",
             "emit: whole, file pendulum.hpp\n// ",
             "plain: whole, file pendulum.hpp\n// ",
             "splitting: status 2, " LOBATTO_SOURCE_DIR
             "/scenes/pendulum.toml: what is exact of stability is of Lobatto and Gauss; choose points or stages\n",
             "two methods: status 2, points, stages and splitting name different methods; give one of them\n",
             "no scene: status 2, there is no scene: NULL was given\n",
             "chosen: ",
             "too much: status 2, an error of 0.9 cannot be promised",
             "proof: all hold\n",
             "no scene proved: status 2, there is no scene: NULL was given\n",
             "stability knows no constraints yet; run, sweep, emit, derive, check and verify do",
         })
        CHECK_MESSAGE(ran.out.find(line) != std::string::npos, line);
}
