// SPDX-License-Identifier: GPL-2.0-or-later
// The example of the README, compiled and run as a reader would.
#include <doctest/doctest.h>

#include <cmath>
#include <sstream>

#include "runtime/measure/reference.hpp"
#include "tests/support.hpp"

using namespace lobatto;

TEST_CASE("the example program compiles against the generated pendulum and follows the exact motion") {
    const test::TemporaryFolder folder;
    const std::string tree = LOBATTO_SOURCE_DIR, program = folder / "pendulum";
    const test::Finished compiled =
        test::run({"g++", "-std=c++17", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I", tree + "/generated",
                   "-I", tree + "/runtime/kernel", tree + "/examples/pendulum.cpp", "-o", program});
    INFO(compiled.err);
    REQUIRE(compiled.exit_code == 0);
    const test::Finished ran = test::run({program});
    REQUIRE(ran.exit_code == 0);
    std::istringstream lines(ran.out);
    const long double pi = 3.14159265358979323846264L;
    double time = 0, q = 0, worst = 0;
    int count = 0;
    while (lines >> time >> q) {
        ++count;
        worst = std::max(worst, std::fabs(q - static_cast<double>(pendulum_solution(4 * pi * pi, pi / 2, 0, time).q)));
    }
    CHECK(count == 24);
    CHECK(std::fabs(time - 1.2) < 1e-12);
    CHECK(worst < 8e-8);  // measured 4.07e-8; a wrong sign or a lost term errs by more than 1e-3
    CHECK(worst > 0);
}
