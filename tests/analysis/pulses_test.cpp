// SPDX-License-Identifier: GPL-2.0-or-later
// Pulses in chains whose forces are small differences of large terms, as exp(a) - exp(b): far from the pulse nothing
// moves but by their rounding.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/analysis/measured_scene.hpp"
#include "tests/support.hpp"

using namespace lobatto;
using test::absolute_error, test::MeasuredScene;

namespace {

struct Chain {
    const char *name, *potential;
    int n;
};

const Chain chains[] = {
    {"Morse", "sum(i=1..n-1, (1 - exp(-(u[i+1] - u[i])))^2/2)", 24},
    {"Lennard-Jones", "sum(i=1..n-1, (1/(1 + u[i+1] - u[i])^12 - 2/(1 + u[i+1] - u[i])^6)/72)", 64},
    {"Toda", "sum(i=1..n, exp(u[i] - u[mod(i,n)+1]))", 40},
};

std::string pulse(const Chain& chain, double size, double step) {
    return fmt::format(
        "lagrangian = \"sum(i=1..n, u[i]'^2/2) - {}\"\n[coordinates]\n"
        "u = {{ count = \"n\", position = 0, velocity = \"a*exp(-(i - n/2)^2/2)\" }}\n"
        "[parameters]\nn = {{ value = {}, constant = true }}\na = {}\n[method]\npoints = 5\n[run]\nstep = {}\nuntil = "
        "10\n",
        chain.potential, chain.n, size, step);
}

}  // namespace

TEST_CASE("a pulse in a chain runs, whatever its size, and its error is measured") {
    for (const Chain& chain : chains)
        for (const double size : {0.1, 1e-3, 1e-5}) {
            CAPTURE(chain.name);
            CAPTURE(size);
            const MeasuredScene scene(pulse(chain, size, 0.2));
            const test::Finished finished = scene.run();
            REQUIRE_MESSAGE(finished.exit_code == 0, finished.err);
            const std::vector<double> rough = scene.end();
            REQUIRE(scene.run({"--step", "0.02"}).exit_code == 0);
            const std::vector<double> fine = scene.end();
            double error = 0;
            for (int k = 1; k <= chain.n; ++k) error = std::max(error, std::abs(rough[k] - fine[k]));
            CAPTURE(error);
            CHECK(absolute_error(finished.out) > error / 3 - 1e-16);
            CHECK(absolute_error(finished.out) < 3 * error + 1e-16);
            if (size == 0.1) CHECK(finished.err == "");
        }
}

TEST_CASE("pulses in sweeps and in clean arithmetic, and the checks of their steps") {
    const MeasuredScene morse(pulse(chains[0], 1, 0.1));
    CHECK(morse.run({"--arithmetic", "clean"}).exit_code == 0);
    const test::Finished proved = test::run({LOBATTO_PROGRAM, "verify", morse.folder / "scene.toml"});
    CHECK_MESSAGE(proved.exit_code == 0, proved.out << proved.err);
    const test::Finished swept = test::run({LOBATTO_PROGRAM, "sweep", morse.folder / "scene.toml", "--vary",
                                            "a=0.01,0.1,1", "-o", morse.folder / "sweep.csv"});
    CHECK_MESSAGE(swept.exit_code == 0, swept.err);
    REQUIRE(morse.run({"--set", "a=0.1"}).exit_code == 0);
    const std::vector<double> alone = morse.end();
    const auto rows = test::read_trajectory(morse.folder / "sweep.csv").rows;
    REQUIRE(rows.size() == 3);
    // Columns of the sweep before the positions: number, a, status, steps, time.
    for (int k = 1; k <= chains[0].n; ++k) CHECK(std::abs(rows[1][4 + k] - alone[k]) < 1e-13);
}

TEST_CASE("a fast coordinate beside it does not change how the steps of a slow one are solved") {
    // Newton's iteration comes up an exponential wall by its width at a time: no rounding, though the width is small.
    const auto end_beside = [](const char* speed) {
        const MeasuredScene wall(
            "lagrangian = \"A'^2/2 + b'^2/2 - c^2*(exp(b/c) - b/c)\"\n[coordinates]\n"
            "A = { position = 0, velocity = " +
            std::string(speed) +
            " }\nb = { position = -400e-9, velocity = 0 }\n"
            "[parameters]\nc = 1e-9\n[run]\nstep = 1\nuntil = 29\n");
        wall.run({"--unmeasured"});
        return wall.end();
    };
    const std::vector<double> alone = end_beside("0"), beside = end_beside("1000");
    CHECK(alone[0] == beside[0]);
    CHECK(alone[2] == beside[2]);
    CHECK(alone[4] == beside[4]);
}
