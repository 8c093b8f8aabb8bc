// SPDX-License-Identifier: GPL-2.0-or-later
// What runs say of themselves where little moves, where a stop ends them, and where no motion follows the Lagrangian.
#include <doctest/doctest.h>

#include <lobatto/lobatto.hpp>

#include <cmath>
#include <string>

#include "tests/support.hpp"

using namespace lobatto;

namespace {

test::Finished run(const std::string& scene) {
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", scene);
    return test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "out.csv"});
}

double error_in(const std::string& said) {
    const std::string label = "measured error";
    const std::size_t at = said.find(label);
    return at == std::string::npos ? HUGE_VAL : std::atof(said.c_str() + at + label.size());
}

const std::string bouncing =
    "lagrangian = \"y'^2/2 - 10*y\"\n[coordinates]\ny = { position = 5, velocity = 0 }\n"
    "[impacts]\nfloor = { when = \"y = 0 falling\", restitution = 0.5 }\n[run]\nstep = 0.1\nuntil = 10\n";

std::string jumping(const std::string& lagrangian) {
    return "lagrangian = \"" + lagrangian +
           "\"\n[coordinates]\nx = { position = -1, velocity = 0.1 }\n[run]\nstep = 0.02\nuntil = 10\n";
}

}  // namespace

TEST_CASE("a momentum that constraints hold at 0 tells nothing of the error, in runs and in sweeps") {
    const std::string held =
        "lagrangian = \"(a' + b')^2/2 + a'^2/2 + 9.81*cos(a)\"\n"
        "[coordinates]\na = { position = 1, velocity = 0.3 }\nb = { position = -1, velocity = -0.3 }\n"
        "[constraints]\nlevel = \"a + b = 0\"\n[run]\nstep = 0.02\nuntil = 5\n";
    const test::Finished alone = run(held);
    CHECK_MESSAGE(alone.exit_code == 0, alone.err);
    CHECK(error_in(alone.out) < 1e-10);
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", held);
    const test::Finished swept = test::run({LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--zip", "--vary",
                                            "a'=0.3,0.4", "--vary", "b'=-0.3,-0.4", "-o", folder / "table.csv"});
    CHECK_MESSAGE(swept.exit_code == 0, swept.err);
    // A plate on two parallel rods does not turn.
    const test::Finished plate =
        run("lagrangian = \"-9.81*b.y\"\n"
            "[bodies]\nb = { mass = 1, inertia = 0.3, position = [0.5, -0.5], velocity = [0.3, 0] }\n[joints]\n"
            "e = { type = \"distance\", bodies = [\"ground\", \"b\"], from = [0, 1], to = [0, -0.5] }\n"
            "f = { type = \"distance\", bodies = [\"ground\", \"b\"], from = [1, 1], to = [1, -0.5] }\n"
            "[run]\nstep = 0.01\nuntil = 3\nassemble = true\n");
    CHECK_MESSAGE(plate.exit_code == 0, plate.err);
    CHECK(plate.err == "");
    CHECK(error_in(plate.out) < 1e-11);
}

TEST_CASE("what a companion meets beyond the stop of a run is nothing of its motion") {
    const test::Finished stopped = run(bouncing + "stop = \"y' = 0\"\n");
    CHECK_MESSAGE(stopped.exit_code == 0, stopped.err);
    CHECK(stopped.out.find("by 'y' = 0' at t = 1.5") != std::string::npos);
    CHECK(error_in(stopped.out) < 1e-13);
    CHECK(run(bouncing).exit_code == 3);  // its impacts accumulate
}

TEST_CASE("a Lagrangian or a momentum that jumps at a velocity has no motion there, and runs and sweeps say so") {
    for (const auto& [lagrangian, what] :
         {std::pair<std::string, std::string>{"if(abs(x') < 1, x'^2/2, x'^2/10 + 0.4) + x", "the momentum of x jumps"},
          {"x'^2/2 + 0.3*if(x' > 0, 1, 0) - x^2/2",
           "the Lagrangian jumps, by about 0.3, where if in the Lagrangian"}}) {
        CHECK(run(jumping(lagrangian)).err.find(what) != std::string::npos);
        const test::TemporaryFolder folder;
        test::write_text(folder / "scene.toml", jumping(lagrangian));
        CHECK(test::run(
                  {LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary", "x=-1,-0.9", "-o", folder / "sweep.csv"})
                  .err.find(what) != std::string::npos);
    }
    for (const std::string lagrangian : {"x'^2/2 - x^2*if(x > 0, 1, 4)", "x'^2/2 - abs(abs(x) - 0.5)",
                                         "if(x' > 0, x'^2, x'^2/2) - x^2/2", "x'^2/2 - if(x > 1/3, 0.333333 - x, 0)"}) {
        CAPTURE(lagrangian);
        const test::Finished done = run(jumping(lagrangian));
        CHECK_MESSAGE(done.exit_code == 0, done.err);
        CHECK(done.err.empty());
    }
}

TEST_CASE("a damping that Gauss's steps do not see is told, not where the start fits it") {
    const auto charging = [](const std::string& stages, const std::string& current) {
        return run(
            "lagrangian = \"L*q'^2/2 - q^2/(2*C) + q*V\"\n[coordinates]\nq = { position = 0, velocity = \"" + current +
            "\" }\n[forces]\nq = \"-R*q'\"\n[parameters]\nL = 1e-8\nC = 1e-6\nR = 1000\nV = 5\n[method]\nfamily = "
            "\"gauss\"\nstages = " +
            stages + "\n[run]\nstep = 2e-5\nuntil = 4e-3\n");
    };
    for (const std::string stages : {"2", "4"}) {
        CHECK(charging(stages, "0").err.find("velocities keep what they had at the start") != std::string::npos);
        const test::Finished fits = charging(stages, "V/R");
        CHECK(fits.exit_code == 0);
        CHECK(fits.err == "");
    }
}

TEST_CASE("a momentum that is a difference at rest has its velocity where the motion turns") {
    for (const std::string lagrangian : {"exp(x') - x' - x^2/2", "1/(2 - x') - x'/4 - x^2/8"}) {
        CAPTURE(lagrangian);
        const std::string scene = "lagrangian = \"" + lagrangian +
                                  "\"\n[coordinates]\nx = { position = 0.5, velocity = 0 }\n[method]\npoints = 5\n"
                                  "[run]\nstep = 0.05\nuntil = 20\n";
        const test::Finished alone = run(scene);
        CHECK_MESSAGE(alone.exit_code == 0, alone.err);
        CHECK(alone.err == "");
        const test::TemporaryFolder folder;
        test::write_text(folder / "scene.toml", scene);
        const test::Finished proved = test::run({LOBATTO_PROGRAM, "verify", folder / "scene.toml"});
        CHECK_MESSAGE(proved.exit_code == 0, proved.out << proved.err);
    }
}

TEST_CASE("a force that vanishes on the node of a wave is not called one that has lost its digits") {
    const test::Finished wave =
        run("lagrangian = \"sum(i=1..n, u[i]'^2/2) - sum(i=1..n-1, (u[i+1]-u[i])^2/2 + (u[i+1]-u[i])^4/16)"
            " - u[1]^2/2 - u[n]^2/2\"\n[coordinates]\n"
            "u = { count = \"n\", position = \"sin(2*pi*i/(n+1))\", velocity = 0 }\n"
            "[parameters]\nn = { value = 7, constant = true }\n[method]\npoints = 5\n[run]\nstep = 0.1\nuntil = 20\n");
    CHECK(wave.exit_code == 0);
    CHECK(wave.err == "");
}

TEST_CASE("a step too long for a stiff floor is not called a jump") {
    const std::string floor =
        "lagrangian = \"y'^2/2 - 9.81*y - 5e6*max(-y, 0)^2\"\n[coordinates]\ny = { position = 1, velocity = 0 "
        "}\n[run]\n"
        "step = 0.01\nuntil = 5\n";
    const test::Finished done = run(floor);
    CHECK(done.exit_code == 3);
    CHECK(done.err.find("The step is too long for the method to be stable or for the forces met there") !=
          std::string::npos);
}

TEST_CASE("a kinetic energy that is not positive is told") {
    const auto of_mass = [](const std::string& mass) {
        return "lagrangian = \"y'^2/2 + m*x'^2/2 - x^2/2 - y^2/2\"\n[parameters]\nm = " + mass +
               "\n[coordinates]\nx = { position = 1, velocity = 0 }\ny = { position = 1, velocity = 0.5 }\n[run]\nstep "
               "= "
               "0.1\nuntil = 1\n";
    };
    CHECK(run(of_mass("-1")).err.find("the mass of x is negative") != std::string::npos);
    CHECK(run(of_mass("1")).err.empty());
    // Coupled inductances of more than sqrt(L1 L2).
    const std::string coils =
        "lagrangian = \"(a'^2 + b'^2)/2 + M*a'*b' - (a^2 + b^2)/2\"\n[parameters]\nM = 1.05\n[coordinates]\n"
        "a = { position = 1, velocity = 0 }\nb = { position = 0, velocity = 0 }\n[run]\nstep = 0.01\nuntil = 1\n";
    CHECK(run(coils).err.find("the kinetic energy is negative for some velocities, that of b among them") !=
          std::string::npos);
    CHECK(run(std::string(coils).replace(coils.find("1.05"), 4, "0.95")).err.empty());
    const std::string product =
        "lagrangian = \"a'*b' - a*b\"\n[coordinates]\na = { position = 1, velocity = 0 }\nb = { position = 1, "
        "velocity = 0 }\n[run]\nstep = 0.01\nuntil = 1\n";
    CHECK(run(product).err.find("the kinetic energy is negative for some velocities, that of a among them") !=
          std::string::npos);
    const lobatto::api::Sweep sweep =
        lobatto::api::sweep(lobatto::api::Scene::from_text(coils), {5, {{"M", {0.5, 0.9, 1.1, 1.2, -1.1}}}});
    REQUIRE(sweep.warnings.size() == 1);
    CHECK(sweep.warnings[0].find("trajectory 2, M = 1.1: the kinetic energy is negative") == 0);
    CHECK(sweep.warnings[0].find("; so it is in 2 others") != std::string::npos);
    // A metric of relativity: a light ray's neighbour around a black hole.
    const test::Finished geodesic =
        run("lagrangian = \"(r'^2/(1 - 2/r) - (1 - 2/r)*w'^2 + r^2*phi'^2)/2\"\n[coordinates]\nr = { position = 10, "
            "velocity = "
            "0 }\nw = { position = 0, velocity = 1.2 }\nphi = { position = 0, velocity = 0.04 }\n[run]\nstep = "
            "0.5\nuntil = 20\n");
    CHECK_MESSAGE(geodesic.err.empty(), geodesic.err);
}
