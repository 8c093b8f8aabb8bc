// SPDX-License-Identifier: GPL-2.0-or-later
// What a run says of its error where one step decides, as in close encounters, and where energies are rounding.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

struct Said {
    double error = -1;  // relative; 1: as large as the motion
    bool warns = false;
};

Said said_of(const std::string& scene_text, std::vector<std::string> options) {
    const test::TemporaryFolder folder;
    const std::string scene = folder / "scene.toml";
    test::write_text(scene, scene_text);
    options.insert(options.begin(), {LOBATTO_PROGRAM, "run", scene, "-o", folder / "run.csv"});
    const test::Finished done = test::run(options);
    const std::string row = "  measured error          ";
    const std::size_t place = done.out.find(row);
    REQUIRE(place != std::string::npos);
    std::string value = done.out.substr(place + row.size());
    value = value.substr(0, value.find('\n'));
    const std::string end = "at the end ";
    if (const std::size_t at = value.find(end); at != std::string::npos && value.find("at most") < at)
        value = value.substr(at + end.size());
    const bool is_lost = value.starts_with("as large") || value.starts_with("not known");
    CHECK(done.exit_code == (is_lost ? 3 : 0));
    return {is_lost ? 1 : std::strtod(value.c_str(), nullptr), done.err.find("warning") != std::string::npos};
}

// x = cos t, y = w sin t in polar coordinates: past the pole at the distance w.
std::string polar(double w) {
    return fmt::format(
        "lagrangian = \"r'^2/2 + r^2*f'^2/2 - r^2/2\"\n"
        "[coordinates]\nr = {{ position = 1, velocity = 0 }}\nf = {{ position = 0, velocity = {} }}\n"
        "[run]\nstep = 0.01\nuntil = 3\n",
        w);
}

const char* const kepler =
    "lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n"
    "[coordinates]\nx = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 0.2 }\n"
    "[run]\nstep = 0.01\nuntil = 2\n";

}  // namespace

TEST_CASE(
    "one step past the pole decides: the printed error follows the true one, and a run that does not resolve it "
    "warns" *
    doctest::test_suite("slow")) {
    struct Run {
        double w, step;
        std::vector<std::string> method;
        double error;  // against a fine run; measured
        bool warns;
    };
    for (const Run& run : std::vector<Run>{{1e-5, 0.01, {"--points", "10"}, 0.11, true},
                                           {1e-5, 0.01, {"--stages", "3"}, 0.26, true},
                                           {1e-6, 0.01, {"--points", "4"}, 0.2, true},
                                           {1e-4, 0.003, {"--points", "4"}, 0.74, true},
                                           {1e-4, 1e-4, {"--points", "4"}, 8e-4, false},
                                           {1e-4, 1e-4, {"--points", "10"}, 3e-11, false}}) {
        std::vector<std::string> options = run.method;
        options.insert(options.end(), {"--step", fmt::format("{}", run.step)});
        CAPTURE(run.w);
        CAPTURE(options);
        const Said said = said_of(polar(run.w), options);
        CHECK(said.error > run.error / 10);
        CHECK(said.error < run.error * 10);
        CHECK(said.warns == run.warns);
    }
    // r changes its sign and f hardly moves: in x and y that is nearly right, in r and f it is not.
    CHECK(said_of(polar(1e-8), {"--points", "4"}).warns);
    // Straight through, which f = 0 allows.
    CHECK(!said_of(polar(0), {"--points", "4"}).warns);
}

TEST_CASE("a close encounter by Gauss is in the printed error" * doctest::test_suite("slow")) {
    // True errors: 0.13 and 0.22.
    const Said long_step = said_of(kepler, {"--stages", "6"});
    CHECK(long_step.error > 0.02);
    CHECK(long_step.warns);
    CHECK(said_of(kepler, {"--stages", "2", "--step", "0.003"}).error > 0.05);
    const Said resolved = said_of(kepler, {"--stages", "3", "--step", "1e-4"});
    CHECK(resolved.error < 1e-10);
    CHECK(!resolved.warns);
    const Said few_kept = said_of(kepler, {"--stages", "6", "--every", "100"});
    CHECK(few_kept.error > 0.02);
    CHECK(few_kept.error == 1);  // nothing of the motion is left: an error, exit code 3, in the place of a warning
}

TEST_CASE("energies of small motions are rounding in double, and no reason for alarm") {
    for (const char* amplitude : {"1e-20", "1e-160"}) {
        const Said said = said_of(fmt::format("lagrangian = \"q'^2/2 - (1 - cos(q))\"\n"
                                              "[coordinates]\nq = {{ position = {}, velocity = 0 }}\n"
                                              "[method]\nfamily = \"lobatto\"\npoints = 6\n"
                                              "[run]\nstep = 0.1\nuntil = 100\n",
                                              amplitude),
                                  {});
        CAPTURE(amplitude);
        CHECK(said.error > 0);
        CHECK(said.error < 1e-11);
    }
}

TEST_CASE("what rounding alone moves raises no alarm: a circular orbit's radius, a system at rest away from 0") {
    const char* const circle =
        "lagrangian = \"r'^2/2 + r^2*phi'^2/2 + 1/r\"\n"
        "[coordinates]\nr = { position = 0.7, velocity = 0, unit = \"m\" }\n"
        "phi = { position = 0, velocity = \"sqrt(1/0.343)\", unit = \"rad\" }\n"
        "[run]\nstep = 0.05\nuntil = 100\n";
    const char* const spring =
        "lagrangian = \"x'^2/2 - (x - 1)^2/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
        "[run]\nstep = 0.05\nuntil = 200\n";
    const char* const hanging =
        "lagrangian = \"1.3*(r'^2 + r^2*th'^2)/2 - 20*(r - 0.3)^2 + 1.3*g*r*cos(th)\"\n"
        "[coordinates]\nr = { position = \"0.3 + 1.3*g/40\", velocity = 0, unit = \"m\" }\n"
        "th = { position = 0, velocity = 0, unit = \"rad\" }\n[parameters]\ng = 9.81\n"
        "[run]\nstep = 0.05\nuntil = 20\n";
    for (const char* scene : {circle, spring, hanging}) {
        CAPTURE(scene);
        CHECK_FALSE(said_of(scene, {}).warns);  // and exit code 0
    }
}

// Five links in a line, at rest: only the first one has an acceleration, and the others hardly move in a step.
TEST_CASE("a chain that begins at rest raises no alarm: the straight way through its first step is none of its own") {
    const std::string chain =
        "lagrangian = \"sum(k = 1 .. 5, (x[k]'^2 + y[k]'^2)/2 - 9.81*y[k])\"\n[definitions]\n"
        "\"x[k]\" = \"sum(i = 1 .. k, sin(a[i]))\"\n\"y[k]\" = \"-sum(i = 1 .. k, cos(a[i]))\"\n"
        "[coordinates]\na = { count = 5, position = 1, velocity = 0 }\n[run]\nstep = 0.01\nuntil = 1\n";
    CHECK_FALSE(said_of(chain, {}).warns);
}

TEST_CASE("how fast a thing flies does not make its oscillation faster") {
    for (const char* velocity : {"0", "1e6"}) {
        const Said said =
            said_of(fmt::format("lagrangian = \"(x'^2 + y'^2)/2 - 5*(y - x - 1)^2 - (y - x - 1)^4\"\n[coordinates]\n"
                                "x = {{ position = 0, velocity = {0} }}\ny = {{ position = 1.3, velocity = {0} }}\n"
                                "[method]\npoints = 6\n[run]\nstep = 0.2\nuntil = 20\n",
                                velocity),
                    {});
        CAPTURE(velocity);
        CHECK_FALSE(said.warns);
    }
}
