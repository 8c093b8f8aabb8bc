// SPDX-License-Identifier: GPL-2.0-or-later
// Runs that go wrong say where that began, though what is wrong may grow; and steps near a limit of the velocities.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>

#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;

TEST_CASE("a run that bounces past a narrow barrier is wrong from there on, whatever it does later") {
    // A bright pulse of light in a fibre: a = sqrt(4 cos^2 t + (1 - P) sin^2 t / 4), 0.005 wide at t = pi/2.
    const test::TemporaryFolder folder;
    for (const char* until : {"3", "50"}) {
        test::write_text(
            folder / "scene.toml",
            fmt::format("lagrangian = \"a'^2/2 - (1 - P)/(2*a^2) - a^2/2\"\n[coordinates]\na = {{ position = "
                        "2, velocity = 0 }}\n[parameters]\nP = 0.9999\n[method]\npoints = 6\n[run]\nstep = "
                        "0.02\nuntil = {}\n",
                        until));
        const test::Finished ran = test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv"});
        CHECK(ran.exit_code == 3);
        CHECK(test::contains(ran.out, "as large as the motion itself from t = 1."));
        CHECK(test::contains(ran.err, "the run is wrong from step 79 on, at t = 1.58"));
    }
}

TEST_CASE("iterations that go beyond the speed of light come back") {
    // A charge of gamma = 30 in a uniform field, on a circle: its velocity turns by three times 1/gamma in a step.
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml",
                     "lagrangian = \"-sqrt(1 - x'^2 - y'^2) + g/2*(x*y' - y*x')\"\n[coordinates]\n"
                     "x = { position = 1, momentum = 0 }\ny = { position = 0, momentum = \"-sqrt(g^2 - 1) + g/2\" }\n"
                     "[parameters]\ng = 30\n[method]\npoints = 8\n[run]\nstep = 0.1\nuntil = 20\n");
    const test::Finished ran = test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv"});
    INFO(ran.err);
    REQUIRE(ran.exit_code == 0);
    const double radius = std::sqrt(1 - 1.0 / 900), centre = 1 - radius;
    for (const auto& row : test::read_trajectory(folder / "run.csv").rows)
        CHECK(std::hypot(row[1] - centre, row[2]) == doctest::Approx(radius).epsilon(1e-12));
}

TEST_CASE("the error of an escape is measured at its stop, whatever end was asked for" * doctest::test_suite("slow")) {
    // Henon and Heiles' potential above its saddles; the time of the stop by a Taylor series in 40 digits.
    constexpr double stop = 42.107854171345, speed = 5.2;
    const test::TemporaryFolder folder;
    for (const char* until : {"60", "600", "6000"}) {
        INFO(until);
        test::write_text(
            folder / "scene.toml",
            fmt::format(
                "lagrangian = \"(x'^2 + y'^2)/2 - (x^2 + y^2)/2 - x^2*y + y^3/3\"\n[coordinates]\n"
                "x = {{ position = 0, velocity = \"v*cos(phi)\" }}\ny = {{ position = 0, velocity = \"v*sin(phi)\" }}\n"
                "[parameters]\nv = 0.62\nphi = \"42*2*pi/399\"\n[method]\npoints = 5\n[run]\nstep = 0.1\n"
                "until = {}\nstop = [\"x^2 + y^2 = 16 rising\"]\n",
                until));
        const test::Finished ran =
            test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--json"});
        INFO(ran.err);
        REQUIRE(ran.exit_code == 0);
        const auto end = test::read_trajectory(folder / "run.csv").rows.back();
        const double largest = std::fmax(std::fabs(end[1]), std::fabs(end[2])),
                     error = std::fabs(end[0] - stop) * speed;
        const std::size_t at = ran.out.find("\"at_end\"");
        REQUIRE(at != std::string::npos);
        const double printed = std::stod(ran.out.substr(ran.out.find(':', at) + 1)) * largest;
        CHECK(printed > error / 5);
        CHECK(printed < error * 5);
        const test::Finished swept = test::run(
            {LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary", "v=0.62", "-o", folder / "sweep.csv"});
        INFO(swept.err);
        CHECK(swept.exit_code == 0);
        const double in_table = test::read_trajectory(folder / "sweep.csv").rows.back().back() * largest;
        CHECK(in_table > error / 5);  // of another companion
        CHECK(in_table < error * 10);
    }
}
