// SPDX-License-Identifier: GPL-2.0-or-later
// The example of the README, compiled and run as a reader would.
#include <doctest/doctest.h>

#include <cmath>
#include <sstream>

#include "runtime/measure/reference.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const long double pi = 3.14159265358979323846264L;

// What an example prints, compiled against the generated pendulum.
std::istringstream lines_of(const std::string& example) {
    const test::TemporaryFolder folder;
    const std::string tree = LOBATTO_SOURCE_DIR, program = folder / "program";
    const test::Finished compiled = test::run(
        {"g++", "-std=c++17", "-O2", "-march=native", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror",
         "-I", tree + "/generated", "-I", tree + "/runtime/kernel", tree + "/examples/" + example, "-o", program});
    INFO(compiled.err);
    REQUIRE(compiled.exit_code == 0);
    const test::Finished ran = test::run({program});
    REQUIRE(ran.exit_code == 0);
    return std::istringstream(ran.out);
}

double exact(double start, double time) {
    return static_cast<double>(pendulum_solution(4 * pi * pi, start, 0, time).q);
}

}  // namespace

TEST_CASE("the example program compiles against the generated pendulum and follows the exact motion") {
    std::istringstream lines = lines_of("pendulum.cpp");
    double time = 0, q = 0, worst = 0;
    int count = 0;
    while (lines >> time >> q) {
        ++count;
        worst = std::max(worst, std::fabs(q - exact(static_cast<double>(pi / 2), time)));
    }
    CHECK(count == 24);
    CHECK(std::fabs(time - 1.2) < 1e-12);
    CHECK(worst < 8e-8);  // measured 4.07e-8; a wrong sign or a lost term errs by more than 1e-3
    CHECK(worst > 0);
}

TEST_CASE("the example of an ensemble follows the exact motion from each start") {
    std::istringstream lines = lines_of("ensemble.cpp");
    double start = 0, q = 0;
    int count = 0;
    for (; lines >> start >> q; ++count) CHECK(std::fabs(q - exact(start, 1.2)) < 1e-6);
    CHECK(count == 8);
}
