// SPDX-License-Identifier: GPL-2.0-or-later
// Mechanisms that rest, or hardly move, at positions of 0: the terms of their constraints are far larger than their
// positions, and rounding in these moves them.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>

#include "tests/analysis/measured_scene.hpp"
#include "tests/support.hpp"

using namespace lobatto;
using test::MeasuredScene;

namespace {

std::string over(double step, double until) {
    return fmt::format("[run]\nstep = {}\nuntil = {}\nassemble = true\n", step, until);
}

// A plank of the mass 2 that hangs on two equal bars, which are not parallel; `velocity`: of the first.
std::string trapeze(const std::string& velocity, const std::string& more = "") {
    return "lagrangian = \"-9.81*(a.y + c.y + 2*b.y)\"\n[bodies]\n"
           "a = { mass = 1, inertia = 0.1, position = [0.3, -0.4] }\n"
           "b = { mass = 2, inertia = 0.2, position = [1.1, -0.8] }\n"
           "c = { mass = 1, inertia = 0.1, position = [1.9, -0.4] }\n[joints]\n"
           "h1 = { type = \"hinge\", bodies = [\"ground\", \"a\"], point = [0, 0]" +
           velocity +
           " }\nh2 = { type = \"hinge\", bodies = [\"a\", \"b\"], point = [0.6, -0.8] }\n"
           "h3 = { type = \"hinge\", bodies = [\"ground\", \"c\"], point = [2.2, 0] }\n"
           "h4 = { type = \"hinge\", bodies = [\"b\", \"c\"], point = [1.6, -0.8] }\n" +
           more;
}

// A square of four bars, free in the plane: the angles of its joints stay 0.
const std::string frame =
    "[bodies]\na = { mass = 1, inertia = 0.1, position = [0.5, 0], velocity = [1, 0.3], angular_velocity = 1 }\n"
    "b = { mass = 1, inertia = 0.1, position = [1, 0.5] }\nc = { mass = 1, inertia = 0.1, position = [0.5, 1] }\n"
    "d = { mass = 1, inertia = 0.1, position = [0, 0.5] }\n[joints]\n"
    "j1 = { type = \"hinge\", bodies = [\"a\", \"b\"], point = [1, 0] }\n"
    "j2 = { type = \"hinge\", bodies = [\"b\", \"c\"], point = [1, 1] }\n"
    "j3 = { type = \"hinge\", bodies = [\"a\", \"d\"], point = [0, 0] }\n"
    "j4 = { type = \"hinge\", bodies = [\"d\", \"c\"], point = [0, 1] }\n";

// A plate on three ropes, at rest.
const std::string plate =
    "lagrangian = \"-9.81*2*p.z\"\n[bodies]\np = { mass = 2, inertia = [0.1, 0.1, 0.2], position = [0, 0, -1] }\n"
    "[joints]\na = { type = \"distance\", bodies = [\"ground\", \"p\"], from = [1, 0, 0], to = [1, 0, -1] }\n"
    "b = { type = \"distance\", bodies = [\"ground\", \"p\"], from = [-0.5, 0.8, 0], to = [-0.5, 0.8, -1] }\n"
    "c = { type = \"distance\", bodies = [\"ground\", \"p\"], from = [-0.5, -0.8, 0], to = [-0.5, -0.8, -1] }\n";

// Two points on three rods, at rest.
const std::string rods =
    "lagrangian = \"sum(i=1..2, m*(x[i]'^2 + y[i]'^2)/2 - m*9.81*y[i])\"\n[coordinates]\n"
    "x = { position = [0.6, 1.6], velocity = 0 }\ny = { position = [-0.8, -0.8], velocity = 0 }\n[parameters]\n"
    "m = 0.37\n[constraints]\na = \"x[1]^2 + y[1]^2 = 1\"\nb = \"(x[1] - x[2])^2 + (y[1] - y[2])^2 = 1\"\n"
    "c = \"(x[2] - 2.2)^2 + y[2]^2 = 1\"\n";

// What is printed of the whole run, as a part of the amplitude.
double printed(const test::Finished& finished) {
    const std::string row = "measured error          ";
    const std::size_t at = finished.out.find(row);
    return at == std::string::npos ? HUGE_VAL : std::strtod(finished.out.c_str() + at + row.size(), nullptr);
}

}  // namespace

TEST_CASE("a closed chain at rest, or one that turns as a whole, runs and knows its error") {
    for (const std::string& text :
         {frame + over(0.01, 5), frame + over(0.05, 5), trapeze("") + over(0.01, 5), plate + over(0.01, 5),
          rods + over(0.01, 5), trapeze("", "[forces]\n\"h1.angle\" = \"-2*h1.angle'\"\n") + over(0.02, 5)}) {
        INFO(text);
        const MeasuredScene scene(text);
        const test::Finished finished = scene.run();
        INFO(finished.err);
        CHECK(finished.exit_code == 0);
        CHECK(finished.err.find("warning") == std::string::npos);
        CHECK(printed(finished) < 1e-11);
    }
}

TEST_CASE("a coordinate that rests, but for the error of steps, loses no motion") {
    // x = 1 and y = 0.35 sin t; an orbit beside an oscillator at rest; x = 0 by a force that cancels.
    struct Case {
        std::string head, method;
        double step;
    };
    const std::string beside =
                          "lagrangian = \"(x'^2 + y'^2)/2 - (x^2 + y^2)/2 + x\"\n[coordinates]\n"
                          "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 0.35 }\n",
                      orbit =
                          "lagrangian = \"(x'^2 + y'^2 + z'^2)/2 + 1/sqrt(x^2 + y^2) + 1/z - z^2/2 + 2*z\"\n"
                          "[coordinates]\nx = { position = 1, velocity = 0 }\n"
                          "y = { position = 0, velocity = 0.5 }\nz = { position = 1, velocity = 0 }\n",
                      force =
                          "lagrangian = \"(x'^2 + y'^2)/2 - (x^2 + y^2)/2\"\n[forces]\n"
                          "x = \"y'^2 + y^2 - 0.1225\"\n[coordinates]\nx = { position = 0, velocity = 0 }\n"
                          "y = { position = 0, velocity = 0.35 }\n";
    for (const Case& tried : {Case{beside, "points = 4\nclock = \"1 + x^2\"", 0.1},
                              {force, "points = 3", 0.1},
                              {force, "points = 2", 0.05},
                              {orbit, "points = 5\nclock = \"auto\"", 0.2}}) {
        INFO(tried.head << tried.method);
        const MeasuredScene scene(tried.head + "[method]\n" + tried.method +
                                  fmt::format("\n[run]\nstep = {}\nuntil = 5\n", tried.step));
        const test::Finished finished = scene.run();
        INFO(finished.err);
        CHECK(finished.exit_code == 0);
        CHECK(finished.err.find("warning") == std::string::npos);
        CHECK(printed(finished) < 1e-3);
        if (tried.head != orbit) {
            const double error = std::fabs(scene.end()[2] - 0.35 * std::sin(5.0)) / 0.35;
            CHECK(printed(finished) > error / 2);
        }
        CHECK(test::run({LOBATTO_PROGRAM, "sweep", scene.folder / "scene.toml", "--vary", "points=5,6", "-o",
                         scene.folder / "sweep.csv", "--quiet"})
                  .exit_code == 0);
    }
    // Not so what a pulse moves, in time or in space, or an instability, also beside one in a far smaller unit.
    for (const char* text :
         {"time = \"t\"\nlagrangian = \"(x'^2 + z'^2)/2 - 0.04*x^2/2 + 5e-4*z*exp(-((t - 7.5)/0.05)^2)\"\n"
          "[coordinates]\nx = { position = 1, velocity = 0 }\nz = { position = 0, velocity = 0 }\n"
          "[method]\npoints = 3\n[run]\nstep = 1\nuntil = 12\n",
          "lagrangian = \"(x'^2 + z'^2)/2 - 0.02*(x^2 + z^2)/2 + 5e-4*z*exp(-((x - 0.428)/0.05)^2)\"\n"
          "[coordinates]\nx = { position = 5, velocity = 0 }\nz = { position = 0, velocity = 0 }\n"
          "[method]\npoints = 3\n[run]\nstep = 1\nuntil = 20\n",
          "lagrangian = \"(x'^2 + z'^2)/2 - 0.04*x^2/2 + z^2/2\"\n[coordinates]\n"
          "x = { position = 1, velocity = 0 }\nz = { position = 4e-9, velocity = 0 }\n"
          "[method]\nfamily = \"gauss\"\nstages = 1\n[run]\nstep = 1\nuntil = 12\n",
          "lagrangian = \"(x'^2 + z'^2)/2 - 0.01*x^2/2 - (cos(z) - 1)\"\n[coordinates]\n"
          "x = { position = 2e9, velocity = 0 }\nz = { position = 1e-6, velocity = 0 }\n"
          "[method]\nfamily = \"gauss\"\nstages = 1\n[run]\nstep = 1\nuntil = 12\n"}) {
        INFO(text);
        CHECK(MeasuredScene(text).run().exit_code == 3);
    }
    // Nor what is slight but begins to move: beyond the stability limit, one way or the other.
    for (const char* start : {"velocity = 1e-6, position = 0", "velocity = 0, position = 1e-6"})
        CHECK(MeasuredScene(fmt::format("lagrangian = \"(x'^2 + y'^2)/2 - 1000*x^2/2 - y^2/2\"\n[coordinates]\n"
                                        "x = {{ {} }}\ny = {{ position = 0, velocity = 0.35 }}\n"
                                        "[run]\nstep = 0.1\nuntil = 5\n",
                                        start))
                  .run()
                  .exit_code == 3);
}

TEST_CASE("a mechanism whose motion dies away runs on at rest") {
    const MeasuredScene scene(trapeze(", velocity = 1", "[forces]\n\"h1.angle\" = \"-2*h1.angle'\"\n") +
                              over(0.02, 60));
    const test::Finished finished = scene.run();
    INFO(finished.err);
    CHECK(finished.exit_code == 0);
    CHECK(std::fabs(scene.end()[1]) < 1e-12);
}

TEST_CASE("a mechanism that comes to rest for a moment goes on, however little of the step is left then") {
    // The same in one coordinate. Friction turns round where a' = 0, some way before the end of a step.
    const std::string run = "[run]\nstep = 0.01\nuntil = 0.5\n";
    for (const char* force : {"6 - sign(a')", "6 - a'*abs(a')"}) {
        INFO(force);
        const std::string friction = fmt::format("[forces]\na = \"{}\"\n", force);
        const MeasuredScene tied(
            "lagrangian = \"(1 + a^2)*a'^2/2 + b'^2/2\"\n[coordinates]\n"
            "a = { position = 0.4, velocity = -1 }\n"
            "b = { position = \"sin(0.4)\", velocity = \"-cos(0.4)\" }\n"
            "[constraints]\nguide = \"sin(a) - b = 0\"\n" +
            friction + run),
            free(
                "lagrangian = \"(1 + a^2 + cos(a)^2)*a'^2/2\"\n[coordinates]\n"
                "a = { position = 0.4, velocity = -1 }\n" +
                friction + run);
        const test::Finished finished = tied.run();
        CHECK_MESSAGE(finished.exit_code == 0, finished.err);
        CHECK(free.run().exit_code == 0);
        CHECK(tied.end()[1] == doctest::Approx(free.end()[1]).epsilon(1e-9));
    }
}

TEST_CASE("small swings of a closed chain are as good as rounding in its constraints lets them be") {
    for (const double velocity : {1e-3, 1e-5, 1e-7}) {
        CAPTURE(velocity);
        const MeasuredScene scene(trapeze(fmt::format(", velocity = {}", velocity)) + over(0.01, 5));
        const test::Finished finished = scene.run();
        INFO(finished.err);
        REQUIRE(finished.exit_code == 0);
        CHECK(printed(finished) < 1e-14 / velocity);
    }
}

TEST_CASE("a pendulum that hangs at rest may be watched where it is") {
    const MeasuredScene scene(
        "lagrangian = \"(x'^2 + y'^2)/2 - 9.80665*y\"\n[coordinates]\nx = { position = 0, velocity = 0 }\n"
        "y = { position = -2, velocity = 0 }\n[constraints]\nrod = \"x^2 + y^2 = 4\"\n[output]\n"
        "events = [\"x = 0 rising\"]\n" +
        over(0.05, 5));
    const test::Finished finished = scene.run();
    INFO(finished.err);
    CHECK(finished.exit_code == 0);
}

TEST_CASE("what is narrow in a constraint is not missed") {
    // A bump on a parabola, and a jerk of a pivot, both far shorter than a step.
    const std::string bump =
                          "lagrangian = \"(x'^2 + y'^2)/2 - 9.81*y\"\n[coordinates]\n"
                          "x = { position = -1, velocity = 0 }\ny = { position = 1, velocity = 0 }\n[constraints]\n"
                          "c = \"y - x^2 - 0.2*exp(-((x - 0.3013)/0.0005)^2) = 0\"\n[method]\npoints = 5\n",
                      jerk =
                          "time = \"t\"\nlagrangian = \"(x'^2 + y'^2)/2 - 9.81*y\"\n[coordinates]\n"
                          "x = { position = 0.6, velocity = 0 }\ny = { position = -0.8, velocity = 0 }\n[constraints]\n"
                          "c = \"(x - 0.5*exp(-((t - 2.013)/0.001)^2))^2 + y^2 = 1\"\n";
    for (const std::string& text :
         {bump + over(0.025, 3), bump + over(0.04, 3), jerk + over(0.2, 5), jerk + over(0.125, 5)}) {
        INFO(text);
        CHECK(MeasuredScene(text).run().exit_code == 3);
    }
}

TEST_CASE("steps of mechanisms at rest are proved" * doctest::test_suite("slow")) {
    for (const std::string& text : {trapeze(", velocity = 1e-5") + over(0.01, 5), rods + over(0.01, 5)}) {
        INFO(text);
        const MeasuredScene scene(text);
        const test::Finished proved = test::run({LOBATTO_PROGRAM, "verify", scene.folder / "scene.toml"});
        CHECK_MESSAGE(proved.exit_code == 0, proved.out);
    }
}

TEST_CASE("tune measures a mechanism at rest by the size of what holds it" * doctest::test_suite("slow")) {
    const MeasuredScene scene(rods + over(0.01, 5));
    const test::Finished tuned =
        test::run({LOBATTO_PROGRAM, "tune", scene.folder / "scene.toml", "--error", "1e-6", "--budget", "600"});
    CHECK_MESSAGE(tuned.exit_code == 0, tuned.err);
}

TEST_CASE("an equilibrium is no motion that is lost, wherever it is") {
    const std::string rest = "[run]\nstep = 0.02\nuntil = 20\n";
    const char* equilibria[] = {
        "lagrangian = \"(x'^2 + y'^2)/2 - (y - x - 1)^2/2\"\n[coordinates]\nx = { position = 0, velocity = 0 }\n"
        "y = { position = 1, velocity = 0 }\n",
        // A circular orbit in the frame that turns with it; the same orbit's neighbourhood, where rounding moves x.
        "lagrangian = \"((x' - y)^2 + (y' + x)^2)/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\n"
        "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 0 }\n",
        "lagrangian = \"(x'^2 + y'^2)/2 + x*y' - y*x' + 3*x^2/2\"\n[coordinates]\n"
        "x = { position = 0, velocity = 0 }\ny = { position = 1, velocity = 0 }\n"};
    for (const std::string scene : equilibria) {
        CAPTURE(scene);
        const test::MeasuredScene at_rest(scene + rest);
        for (const char* until : {"20", "200"}) {
            const test::Finished finished = at_rest.run({"--until", until});
            CHECK_MESSAGE(finished.exit_code == 0, finished.err);
            CHECK(finished.err == "");
        }
        const test::Finished swept = test::run({LOBATTO_PROGRAM, "sweep", at_rest.folder / "scene.toml", "--vary",
                                                "y=0,1", "-o", at_rest.folder / "sweep.csv"});
        CHECK_MESSAGE(swept.exit_code == 0, swept.err);
    }
    // Beside one that rests far away, a motion is measured by itself: these steps are too long for it.
    const test::MeasuredScene far(
        "lagrangian = \"R'^2/2 + th'^2/2 + cos(th) - th^4*1e5\"\n[coordinates]\nR = { position = 1.5e11, velocity = 0 "
        "}\n"
        "th = { position = 0, velocity = 1e-3 }\n[run]\nstep = 2.2\nuntil = 1000\n");
    CHECK(far.run().exit_code == 3);
    // One that is left because it is unstable is told: y is beside 1 by less than any double can say.
    const test::MeasuredScene unstable(
        "lagrangian = \"(x'^2 + y'^2)/2 + (y - x - 1)^2/2\"\n[coordinates]\nx = { position = 0, velocity = 0 }\n"
        "y = { position = 1, velocity = 0 }\n" +
        rest);
    const test::Finished left = unstable.run({"--until", "100"});
    CHECK(left.exit_code == 3);
    CHECK(test::contains(left.err, "the run rests where it begins, q = (0, 1), p = (0, 0), but a start that differs "));
    CHECK(
        test::contains(left.out, "  measured error          not known: the run rests, and a start beside it leaves\n"));
    // Steps that are too long leave one that is stable.
    const test::MeasuredScene stable(
        "lagrangian = \"q'^2/2 + y'^2/2 + 100*cos(q - 1) - y^2\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n"
        "y = { position = 0, velocity = 0 }\n[method]\npoints = 2\n[run]\nstep = 0.35\nuntil = 200\n");
    const test::Finished thrown = stable.run();
    CHECK(thrown.exit_code == 3);
    CHECK(test::contains(thrown.err, "or the step is too long for it"));
    CHECK(test::contains(thrown.err, "a smaller step, such as h = 0.175"));
    CHECK(stable.run({"--step", "0.1"}).exit_code == 0);
}

TEST_CASE("a motion that rests because each step changes less than a last digit is not called right") {
    // Momenta that are not 0 at rest, of a frame that turns, take no smaller change.
    const std::string saddle =
        "lagrangian = \"((x' - W*y)^2 + (y' + W*x)^2)/2 - W^2*(x^2 + y^2)/2 - ((x - 1)^2 - (y - "
        "1)^2)/2\"\n[parameters]\n"
        "W = 1\n[coordinates]\nx = { position = 1, velocity = 0 }\ny = { position = \"1 + 1e-14\", velocity = 0 }\n";
    const std::string second_point =
        "lagrangian = \"((x' - y)^2 + (y' + x)^2)/2 + (1 - mu)/sqrt((x + mu)^2 + y^2) + mu/sqrt((x - 1 + mu)^2 + "
        "y^2)\"\n"
        "[parameters]\nmu = 0.01215\n[coordinates]\nx = { position = 1.1556799130947353, velocity = 0 }\n"
        "y = { position = 0, velocity = 0 }\n";
    for (const std::string& lagrangian : {saddle + "[run]\nstep = 0.01\nuntil = 100\n",
                                          second_point + "[run]\nstep = 0.001\nuntil = 30\n[output]\nevery = 1000\n"}) {
        const test::MeasuredScene held(lagrangian);
        const test::Finished done = held.run();
        CHECK(done.exit_code == 3);
        CHECK(test::contains(done.err, "or each step changes less than a last digit"));
    }
    // A stable one, in the same frame.
    const test::MeasuredScene stable(
        "lagrangian = \"((x' - y)^2 + (y' + x)^2)/2 + (1 - mu)/sqrt((x + mu)^2 + y^2) + mu/sqrt((x - 1 + mu)^2 + "
        "y^2)\"\n"
        "[parameters]\nmu = 0.01215\n[coordinates]\nx = { position = \"0.5 - mu\", velocity = 0 }\n"
        "y = { position = \"sqrt(3)/2\", velocity = 0 }\n[run]\nstep = 0.001\nuntil = 100\n[output]\nevery = 1000\n");
    CHECK(stable.run().exit_code == 0);
    // The same in a sweep.
    const test::TemporaryFolder folder;
    test::write_text(folder / "saddle.toml", saddle + "[run]\nstep = 0.01\nuntil = 100\n");
    const test::Finished swept =
        test::run({LOBATTO_PROGRAM, "sweep", folder / "saddle.toml", "--vary", "W=1,1.0", "-o", folder / "swept.csv"});
    CHECK(test::contains(swept.out + swept.err, "not resolved"));
}
