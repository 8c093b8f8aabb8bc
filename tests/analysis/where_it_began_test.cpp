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
