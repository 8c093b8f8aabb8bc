// SPDX-License-Identifier: GPL-2.0-or-later
// Walls and stops: exact motions, the order of steps with impacts, what is kept, and how impacts that cannot be told
// apart end.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "generator/check/check.hpp"
#include "generator/pipeline.hpp"
#include "generator/programs/programs.hpp"
#include "runtime/run/trajectory.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

constexpr double pi = std::numbers::pi;

Scene scene_of(const std::string& text) {
    return read_scene(Source("impacts.toml", text));
}

struct Ended {
    TrajectoryResult result;
    std::vector<std::vector<double>> events;  // number, t, q, p
};

Ended run(const Scene& scene, bool with_events = true) {
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    TrajectoryRequest request = request_of(scene, steps_of(scene, {}).count, stepper);
    Ended ended;
    if (with_events)
        request.events = [&](const EventRecords& records) {
            for (std::int64_t i = 0; i < records.count; ++i)
                ended.events.emplace_back(records.rows + i * records.columns, records.rows + (i + 1) * records.columns);
        };
    ended.result = integrate(kernel, request);
    return ended;
}
Ended run(const std::string& text) {
    return run(scene_of(text));
}

std::string method(const std::string& how, double step, double until) {
    return fmt::format("[method]\n{}\n[run]\nstep = {:.17g}\nuntil = {:.17g}\n", how, step, until);
}

const std::string ball =
    "lagrangian = \"m*y'^2/2 - m*g*y\"\n[parameters]\nm = 3\ng = 2\ne = {}\n[coordinates]\n"
    "y = {{ position = 1, velocity = 0 }}\n[impacts]\nfloor = {{ when = \"y = 0 falling\", restitution = \"e\" }}\n";

std::string refusal(const std::string& text) {
    try {
        derive(scene_of(text));
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}
}  // namespace

TEST_CASE("a ball bounces at the exact times, by every method, also where a step holds several impacts" *
          doctest::test_suite("slow")) {
    // From the height 1 at rest under g = 2 it falls for a time of 1, and flies e^k times 2 after impact k.
    for (const char* how : {"points = 2", "points = 5", "family = \"gauss\"\nstages = 2",
                            "family = \"splitting\"\nstages = 6", "points = 4\narithmetic = \"clean\""})
        for (const double step : {0.1, 2.7}) {
            CAPTURE(how);
            CAPTURE(step);
            const double e = 0.5;
            const Ended ended = run(fmt::format(fmt::runtime(ball), e) + method(how, step, 2.7));
            CHECK(ended.result.status == LOBATTO_OK);
            double time = 1, speed = 2;
            std::size_t count = 0;
            for (; time < 2.7; time += speed, ++count) {
                REQUIRE(count < ended.events.size());
                CHECK(std::fabs(ended.events[count][1] - time) < 1e-14);
                CHECK(std::fabs(ended.events[count][2]) < 1e-14);
                speed *= e;
                CHECK(std::fabs(ended.events[count][3] - 3 * speed) < 1e-14);  // the momentum after it
            }
            CHECK(ended.events.size() == count);
        }
}

TEST_CASE("the energy stays at rounding over 10^5 impacts in a billiard" * doctest::test_suite("slow")) {
    const Ended ended =
        run("lagrangian = \"(x'^2 + y'^2)/2\"\n[parameters]\nr = 0.4\n[coordinates]\nx = { position = 0.7, velocity = "
            "0.6 }\n"
            "y = { position = 0.1, velocity = 0.8 }\n[impacts]\neast = { when = \"x = 1 rising\" }\n"
            "west = { when = \"x = -1 falling\" }\nnorth = { when = \"y = 1 rising\" }\n"
            "south = { when = \"y = -1 falling\" }\ndisc = { when = \"x^2 + y^2 = r^2 falling\" }\n" +
            method("points = 3", 0.5, 105000));
    CHECK(ended.result.status == LOBATTO_OK);
    CHECK(ended.events.size() > 100000);
    CHECK(ended.result.energy_error_largest < 1e-12);
    for (const std::vector<double>& row : ended.events) {
        const double r2 = row[2] * row[2] + row[3] * row[3];
        REQUIRE(std::fabs(row[2]) < 1 + 1e-13);
        REQUIRE(std::fabs(row[3]) < 1 + 1e-13);
        REQUIRE(r2 > 0.16 - 1e-13);
    }
}

TEST_CASE("the energy of bodies that tumble on a floor stays at rounding over 10^5 impacts" *
          doctest::test_suite("slow")) {
    // Several impacts in a step of 1: measured 7.4e-14 after 104623 impacts. Short steps, eight times as many, add a
    // rounding of their own each.
    const Ended rod =
        run("lagrangian = \"-rod.y\"\n[bodies]\nrod = { mass = 1, inertia = \"1/12\", position = [0, 1.2], angle = "
            "0.3, angular_velocity = 0.5 }\n[impacts]\nright = { when = \"rod.y(0.5, 0) = 0 falling\" }\n"
            "left = { when = \"rod.y(-0.5, 0) = 0 falling\" }\n" +
            method("points = 5", 1, 140000));
    CHECK(rod.result.status == LOBATTO_OK);
    CHECK(rod.events.size() > 100000);
    CHECK(rod.result.energy_error_largest < 1e-12);
    // A brick that falls on its corners: 1.2e-11 of 6.6 after 102461 impacts; here a tenth of them.
    std::string corners;
    for (int c = 0; c < 8; ++c)
        corners += fmt::format("corner_{} = {{ when = \"brick.z({}, {}, {}) = 0 falling\" }}\n", c, c % 2 < 1 ? 1 : -1,
                               c % 4 < 2 ? 2 : -2, c < 4 ? 3 : -3);
    const Ended brick =
        run("lagrangian = \"-brick.z\"\n[bodies]\nbrick = { mass = 1, inertia = [\"13/3\", \"10/3\", \"5/3\"], "
            "position = [0, 0, 6], angular_velocity = [0.3, 0.2, 0.5] }\n[impacts]\n" +
            corners + method("points = 7", 0.5, 22500));
    CHECK(brick.result.status == LOBATTO_OK);
    CHECK(brick.events.size() > 10000);
    CHECK(brick.result.energy_error_largest < 5e-12);
}

TEST_CASE("steps with impacts have the order of the method" * doctest::test_suite("slow")) {
    // A pendulum that meets a wall leaning against its left side, in angles.
    const std::string pendulum =
        "lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 1, velocity = 0.3 }\n[impacts]\n"
        "wall = { when = \"q = -0.4 falling\", restitution = 0.9 }\n";
    const auto end = [&](const std::string& how, double step) {
        const Ended ended = run(pendulum + method(how, step, 8));
        CHECK(ended.events.size() >= 2);
        return ended.result.q[0];
    };
    const double exact = end("points = 8", 0.05);
    for (const auto& [how, order, step] :
         {std::tuple{"points = 3", 4, 0.1}, {"points = 4", 6, 0.4}, {"family = \"gauss\"\nstages = 2", 4, 0.1}}) {
        const std::string tried = how;  // bindings cannot be captured
        CAPTURE(tried);
        const double coarse = std::fabs(end(how, step) - exact), fine = std::fabs(end(how, step / 2) - exact);
        CHECK(std::log2(coarse / fine) > order - 0.7);
        CHECK(coarse > 1e-9);  // it is the method that is measured, not rounding
    }
}

TEST_CASE("a pendulum on a rod meets a wall like the same pendulum in an angle") {
    const std::string wall = "[impacts]\nwall = {{ when = \"{} falling\", restitution = 0.8 }}\n",
                      time = method("points = 8", 0.05, 12);
    const Ended angle = run("lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 1, velocity = 0.3 }\n" +
                            fmt::format(fmt::runtime(wall), "sin(q) = -0.4") + time);
    const Ended rod =
        run("lagrangian = \"(x'^2 + y'^2)/2 - y\"\n[coordinates]\nx = { position = \"sin(1)\", velocity = "
            "\"0.3*cos(1)\" }\n"
            "y = { position = \"-cos(1)\", velocity = \"0.3*sin(1)\" }\n[constraints]\nrod = \"x^2 + y^2 = 1\"\n" +
            fmt::format(fmt::runtime(wall), "x = -0.4") + time);
    REQUIRE(angle.events.size() >= 2);
    REQUIRE(angle.events.size() == rod.events.size());
    for (std::size_t i = 0; i < angle.events.size(); ++i)
        CHECK(std::fabs(angle.events[i][1] - rod.events[i][1]) < 1e-11);
    CHECK(std::fabs(std::sin(angle.result.q[0]) - rod.result.q[0]) < 1e-11);
    const double length = std::hypot(rod.result.q[0], rod.result.q[1]);
    CHECK(std::fabs(length - 1) < 1e-14);
}

TEST_CASE("a coupled mass is thrown back in the metric of the mass") {
    // Two masses 1 and 3 meet: momentum and energy decide all.
    const Ended ended =
        run("lagrangian = \"a*x'^2/2 + b*y'^2/2\"\n[parameters]\na = 1\nb = 3\n[coordinates]\n"
            "x = { position = 0, velocity = 2 }\ny = { position = 1, velocity = -1 }\n[impacts]\n"
            "meet = { when = \"x = y rising\" }\n" +
            method("points = 4", 0.1, 1));
    REQUIRE(ended.events.size() == 1);
    CHECK(std::fabs(ended.events[0][1] - 1.0 / 3) < 1e-15);
    CHECK(std::fabs(ended.result.p[0] + 2.5) < 1e-14);  // (m1 - m2) / (m1 + m2) u1 + 2 m2 / (m1 + m2) u2
    CHECK(std::fabs(ended.result.p[1] - 1.5) < 1e-14);
}

TEST_CASE("a moving wall gives its own velocity") {
    const Ended ended =
        run("time = \"t\"\nlagrangian = \"x'^2/2\"\n[coordinates]\nx = { position = 1, velocity = -1 }\n[impacts]\n"
            "piston = { when = \"x = t/2 falling\", restitution = 0.5 }\n" +
            method("points = 3", 0.1, 2));
    REQUIRE(ended.events.size() == 1);
    CHECK(std::fabs(ended.events[0][1] - 2.0 / 3) < 1e-15);
    CHECK(std::fabs(ended.result.p[0] - 1.25) < 1e-14);  // 1/2 + 1/2 (1 + 1/2)
}

TEST_CASE("walls that are met at once act one after another: a corner, and Newton's cradle") {
    const Ended corner =
        run("lagrangian = \"(x'^2 + y'^2)/2\"\n[coordinates]\nx = { position = 1, velocity = -1 }\n"
            "y = { position = 1, velocity = -1 }\n[impacts]\na = { when = \"x = 0 falling\" }\n"
            "b = { when = \"y = 0 falling\" }\n" +
            method("points = 3", 0.3, 3));
    REQUIRE(corner.events.size() == 2);
    CHECK(corner.result.p == std::vector<double>{1, 1});

    const Ended cradle =
        run("lagrangian = \"sum(i = 1 .. 5, q[i]'^2/2 + cos(q[i]))\"\n[coordinates]\n"
            "q = { position = [-0.5, 0, 0, 0, 0], velocity = 0 }\n[impacts]\n"
            "\"touch[i]\" = { when = \"q[i+1] = q[i] falling\", count = 4 }\n" +
            method("points = 6", 0.1, 100));
    CHECK(cradle.result.status == LOBATTO_OK);
    CHECK(cradle.result.energy_error_largest < 1e-13);
    // The first and the last ball share all of the motion.
    const double energy = 1 - std::cos(0.5),
                 outer = 2 - std::cos(cradle.result.q[0]) - std::cos(cradle.result.q[4]) +
                         (std::pow(cradle.result.p[0], 2) + std::pow(cradle.result.p[4], 2)) / 2;
    CHECK(std::fabs(outer - energy) < 1e-12);
}

TEST_CASE("values that are set later must keep what those of the scene do") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "ball.toml",
                     "lagrangian = \"y'^2/2 - 2*y\"\n[parameters]\ne = 1\nfloor_height = 0\n[coordinates]\n"
                     "y = { position = 1, velocity = 0 }\n[impacts]\n"
                     "floor = { when = \"y = floor_height falling\", restitution = \"e\" }\n"
                     "[run]\nstep = 0.1\nuntil = 3\n");
    test::write_text(folder / "top.toml",
                     "[bodies]\ntop = { mass = \"m\", inertia = [\"A\", 0.2, 0.15], velocity = [0, 0, 0], "
                     "angular_velocity = [0.1, 2, 0.1] }\n[parameters]\nm = 1\nA = 0.2\n[run]\nstep = 0.1\n"
                     "until = 1\n");
    struct Row {
        const char *scene, *set, *complaint;  // no complaint: accepted
    };
    for (const Row& row :
         {Row{"ball.toml", "e=1.5", ":8:60: the restitution of floor is not within 0 to 1"},
          Row{"ball.toml", "e=-0.1", ":8:60: the restitution of floor is not within 0 to 1"},
          Row{"ball.toml", "e=0.9", nullptr},
          Row{"ball.toml", "floor_height=1.5", ":8:18: the start is behind the wall floor"},
          Row{"top.toml", "m=-1", ":2:16: the mass of top is not positive"},
          Row{"top.toml", "A=-0.1", ":2:31: the inertia of top is not positive"},
          Row{"top.toml", "A=0.36", ":2:31: no body has the inertia of top"}, Row{"top.toml", "A=0.35", nullptr}}) {
        CAPTURE(row.set);
        const test::Finished done = test::run(
            {LOBATTO_PROGRAM, "run", folder / row.scene, "--set", row.set, "-o", folder / "run.csv", "--quiet"});
        INFO(done.err);
        CHECK(done.exit_code == (row.complaint == nullptr ? 0 : 2));
        if (row.complaint != nullptr) CHECK(done.err.find(row.complaint) != std::string::npos);
    }
    // Of a sweep such trajectories fail, each by itself.
    const auto failed = [&](const std::string& scene, const std::string& vary) {
        return test::run(
                   {LOBATTO_PROGRAM, "sweep", folder / scene, "--vary", vary, "-o", folder / "table.csv", "--quiet"})
            .err;
    };
    CHECK(failed("ball.toml", "e=0.9,1.5,1")
              .find("trajectory 1, e = 1.5: the restitution of floor is not within 0 to 1") != std::string::npos);
    CHECK(failed("ball.toml", "floor_height=0,1.5")
              .find("trajectory 1, floor_height = 1.5: start off the constraints or behind a wall") !=
          std::string::npos);
    CHECK(failed("top.toml", "A=0.1,-1,0.36").find("trajectory 2, A = 0.36: no body has the inertia of top") !=
          std::string::npos);
}

TEST_CASE("a state that rounding leaves behind a wall may be a start, one that is behind it may not") {
    // Two oscillators of which one rests at a wall, in units that differ by 1e6: the metric of the kinetic energy makes
    // them equal.
    const auto oscillators = [](const std::string& first, const std::string& second) {
        return fmt::format(
            "lagrangian = \"(x'^2 + y'^2*1e12)/2 - x^2/2 - y^2*1e12/2\"\n[coordinates]\n"
            "x = {{ position = {}, velocity = 0 }}\ny = {{ position = {}, velocity = 0 }}\n"
            "[impacts]\nwall = {{ when = \"y = 0 falling\" }}\n{}",
            first, second, method("points = 4", 0.05, 3));
    };
    const Ended ended = run(oscillators("1", "-1e-21"));
    CHECK(ended.result.status == LOBATTO_OK);
    CHECK(std::fabs(ended.result.q[0] - std::cos(3.0)) < 1e-5);
    CHECK(std::fabs(ended.result.q[1]) < 1e-20);
    // As far behind it as rounding of x would be if both were of one unit.
    CHECK_THROWS_WITH(run(oscillators("1", "-1e-16")), doctest::Contains("or is behind a wall"));
    CHECK(refusal(oscillators("1", "-1e-12")).find("behind the wall wall") != std::string::npos);
    std::string pole = oscillators("1", "0");
    pole.replace(pole.find("y = 0 falling"), 5, "1/y = 0");
    CHECK(refusal(pole).find("the wall wall has no finite real value where the motion starts") != std::string::npos);
}

TEST_CASE("impacts that accumulate end the run, with the state before that step") {
    // The heights fall by e^2, so that all ends at sqrt(2/g) (1 + e) / (1 - e) = 3.
    for (const double e : {0.5, 0.0}) {
        const Ended ended = run(fmt::format(fmt::runtime(ball), e) + method("points = 4", 0.15, 4));
        CHECK(ended.result.status == LOBATTO_IMPACTS_ACCUMULATE);
        CHECK(std::fabs(ended.result.time - (e == 0.5 ? 2.85 : 0.9)) < 1e-14);
        // Of the step that was not taken no impact is told: those of e = 0.5 are at 1, 2, 2.5, 2.75, ...
        CHECK(ended.events.size() == (e == 0.5 ? 4 : 0));
        CHECK((ended.events.empty() || ended.events.back()[1] <= ended.result.time));
        CHECK(test::contains(explain_stop(ended.result, TrajectoryRequest()), "impacts accumulate"));
    }
    // At rest on the floor from the start.
    const Ended rests =
        run("lagrangian = \"y'^2/2 - y\"\n[coordinates]\ny = { position = 0, velocity = 0 }\n[impacts]\n"
            "floor = { when = \"y = 0 falling\" }\n" +
            method("points = 4", 0.1, 1));
    CHECK(rests.result.status == LOBATTO_IMPACTS_ACCUMULATE);
    CHECK(rests.result.steps_done == 0);
}

TEST_CASE("a wall that is touched and not crossed does nothing") {
    const Ended ended =
        run("lagrangian = \"(x'^2 + y'^2)/2\"\n[coordinates]\nx = { position = -2, velocity = 1 }\n"
            "y = { position = 1, velocity = 0 }\n[impacts]\ndisc = { when = \"x^2 + y^2 = 1 falling\" }\n" +
            method("points = 4", 0.3, 4));
    CHECK(ended.result.status == LOBATTO_OK);
    CHECK(ended.result.p == std::vector<double>{1, 0});
}

TEST_CASE("the motion arrives at a wall, and never crosses it: an event there falls as often as the wall is met") {
    for (int i = 0; i < 30; ++i) {
        const double from = 0.7 + 0.11 * i;
        CAPTURE(from);
        const Ended ended = run(
            fmt::format("lagrangian = \"y'^2/2 - 9.81*y\"\n[coordinates]\ny = {{ position = {}, velocity = 0 }}\n"
                        "[impacts]\nf = {{ when = \"y = 0 falling\" }}\n",
                        from) +
            method("points = 4", 0.1, 60) + "[output]\nevents = [\"y = 0\", \"y = 0 rising\", \"y = 0 falling\"]\n");
        int met[4] = {};
        for (const auto& event : ended.events) ++met[static_cast<int>(event[0])];
        CHECK(met[3] > 30);
        CHECK(met[0] == met[3]);
        CHECK(met[1] == 0);
        CHECK(met[2] == met[3]);
    }
}

TEST_CASE("a reset that leads off a constraint is told as that, not as a wrong start") {
    const std::string text =
        "lagrangian = \"(x'^2 + y'^2)/2 - 9.81*y\"\n[coordinates]\nx = { position = 0.5, velocity = 2 }\n"
        "y = { position = 0.25, velocity = 2 }\n[constraints]\nc = \"sin(y - x^2) = 0\"\n[impacts]\n"
        "w = { when = \"y = 0.5 rising\", reset = { \"x\" = \"-x/2\" } }\n" +
        method("points = 5", 0.01, 3);
    const Scene scene = scene_of(text);
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    const TrajectoryRequest request = request_of(scene, steps_of(scene, {}).count, stepper);
    const TrajectoryResult result = integrate(kernel, request);
    CHECK(result.status == LOBATTO_OFF_CONSTRAINTS);
    CHECK(result.steps_done > 0);
    CHECK(explain_stop(result, request)
              .find("the motion does not keep the constraints, or is behind a wall: a reset leads elsewhere") !=
          std::string::npos);
}

TEST_CASE("a bead goes on where its wire goes from one smooth piece to another, also where the wire is level there") {
    for (const std::string wire : {"max(x, 0)^2", "if(x > 0, x^2/4, x^2)", "x^2/2 + max(x, 0)^3"})
        for (const double step : {0.01, 0.013}) {
            CAPTURE(wire);
            CAPTURE(step);
            const Scene scene = scene_of(
                "lagrangian = \"(x'^2 + y'^2)/2 - 9.81*y\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
                "y = { position = 1.5, velocity = 0 }\n[constraints]\nc = \"y = " +
                wire + "\"\n[run]\nassemble = true\nuntil = 1\nstep = " + std::to_string(step) + "\n");
            const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
            LoadedStepper<double> stepper(kernel);
            const TrajectoryRequest request = request_of(scene, steps_of(scene, {}).count, stepper);
            const TrajectoryResult result = integrate(kernel, request);
            CHECK(result.status == LOBATTO_OK);
            CHECK(result.q[0] < 0);
            CHECK(result.energy_error_largest < 1e-5);
        }
}

TEST_CASE("a reset is the state after the impact") {
    const Ended ended =
        run("lagrangian = \"x'^2/2\"\n[coordinates]\nx = { position = 0, velocity = 1 }\n[impacts]\n"
            "gate = { when = \"x = 1 rising\", reset = { \"x\" = \"x - 1\", \"x'\" = \"2*x'\" } }\n" +
            method("points = 3", 0.1, 1.7));
    REQUIRE(ended.events.size() == 2);  // at 1 and 1.5
    CHECK(std::fabs(ended.events[1][1] - 1.5) < 1e-14);
    CHECK(std::fabs(ended.result.q[0] - 0.8) < 1e-14);
    CHECK(ended.result.p[0] == 4);
}

TEST_CASE("after a reset formulas of pieces are those of where it leads: no wall is met that is not there") {
    // A step down of the ground behind x = 0, and a foot that is set there: free fall from 0.4.
    const Ended step =
        run("lagrangian = \"(x'^2 + y'^2)/2 - 9.81*y\"\n[coordinates]\nx = { position = 0.5, velocity = 0 }\n"
            "y = { position = 1, velocity = 0 }\n[impacts]\nground = { when = \"y = -max(x, 0) falling\", reset = { "
            "\"x\" = \"-0.5\", \"y\" = \"y + 0.9\", \"y'\" = \"0\" } }\n" +
            method("points = 4", 0.01, 0.9));
    REQUIRE(step.events.size() == 2);
    const double first = std::sqrt(3 / 9.81), second = first + std::sqrt(0.8 / 9.81);
    CHECK(std::fabs(step.events[0][1] - first) < 1e-14);
    CHECK(std::fabs(step.events[1][1] - second) < 1e-14);
    CHECK(std::fabs(step.result.q[1] - (0.9 - 9.81 * (0.9 - second) * (0.9 - second) / 2)) < 1e-13);
    // Another wall's reset, which leads to the other piece of this one.
    const Ended other = run(
        "lagrangian = \"(x'^2 + y'^2)/2\"\n[coordinates]\nx = { position = 0.5, velocity = 1 }\n"
        "y = { position = 0.2, velocity = 0 }\n[impacts]\na = { when = \"x = 1 rising\", reset = { \"x\" = \"-1\" } }\n"
        "b = { when = \"y + max(x, 0) = 0 falling\", restitution = 1 }\n" +
        method("points = 4", 0.1, 1));
    CHECK(other.events.size() == 1);
    CHECK(std::fabs(other.result.q[0] + 0.5) < 1e-14);
}

namespace {

std::string kicked_rotor(const std::string& when, double step, double until) {
    return "lagrangian = \"q'^2/2\"\ntime = \"t\"\n[coordinates]\nq = { position = 1, velocity = 0.5 }\n[impacts]\n"
           "kick = { when = \"" +
           when + "\", reset = { \"q'\" = \"q' + 0.6*sin(q)\" } }\n" + method("points = 4", step, until);
}

}  // namespace

TEST_CASE("kicks at times: the standard map, in steps that end at kicks and in others") {
    for (const double step : {0.25, 0.3, 1.0, 1.7}) {
        for (const std::string when : {"sin(2*pi*t) = 0 rising", "sin(pi*t) = 0"}) {
            CAPTURE(step);
            CAPTURE(when);
            const Ended ended = run(kicked_rotor(when, step, 34));
            REQUIRE(ended.result.status == LOBATTO_OK);
            double q = 1, p = 0.5;
            std::size_t kicks = 0;
            for (; kicks < ended.events.size(); ++kicks) {
                p += 0.6 * std::sin(q);
                const std::vector<double>& row = ended.events[kicks];
                CHECK(std::fabs(row[1] - static_cast<double>(kicks)) < 1e-13);
                CHECK(std::fabs(row[2] - q) < 1e-11);
                CHECK(std::fabs(row[3] - p) < 1e-11);
                q += p;
            }
            // Of a kick at the very end the state before it is the last.
            CHECK(kicks == static_cast<std::size_t>(std::ceil(ended.result.time - 1e-9)));
        }
    }
    const Ended once = run(kicked_rotor("t = 5 rising", 0.3, 9.9));
    REQUIRE(once.events.size() == 1);
    CHECK(std::fabs(once.result.q[0] - (3.5 + (0.5 + 0.6 * std::sin(3.5)) * 4.9)) < 1e-13);
    CHECK(run(kicked_rotor("t = 5 falling", 0.3, 9.9)).events.empty());
}

TEST_CASE("a motion passes where the scene says so, with a reset in the direction that is named") {
    const auto oscillator = [](const std::string& gates, double step, double until) {
        return run("lagrangian = \"x'^2/2 - x^2/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n[impacts]\n" +
                   gates + method("points = 8", step, until));
    };
    for (const auto& [direction, crossings] : {std::pair{"", 13}, {" falling", 7}, {" rising", 6}}) {
        const Ended ended = oscillator(fmt::format("gate = {{ when = \"x = 0{}\", passes = true, reset = {{ \"x'\" = "
                                                   "\"0.9*x'\" }} }}\n",
                                                   direction),
                                       0.1, 40);
        CHECK(ended.events.size() == static_cast<std::size_t>(crossings));
        CHECK(std::fabs(ended.result.q[0] - std::pow(0.9, crossings) * std::cos(40)) < 1e-12);
    }
    // A reset that turns the motion back leaves it on its side.
    const Ended mirrors =
        run("lagrangian = \"x'^2/2\"\n[coordinates]\nx = { position = 0, velocity = 1 }\n[impacts]\n"
            "a = { when = \"x = 1\", passes = true, reset = { \"x'\" = \"-x'\" } }\n"
            "b = { when = \"x = -1 falling\", restitution = 1 }\n" +
            method("points = 3", 0.3, 40.2));
    CHECK(mirrors.events.size() == 20);
    CHECK(std::fabs(mirrors.result.q[0] - 0.2) < 1e-12);
    // Two at one time, in the order of the scene.
    const Ended both =
        run("lagrangian = \"x'^2/2\"\ntime = \"t\"\n[coordinates]\nx = { position = 0, velocity = 1 }\n[impacts]\n"
            "a = { when = \"t = 1\", reset = { \"x'\" = \"x' + 1\" } }\nb = { when = \"t = 1\", reset = { \"x'\" = "
            "\"3*x'\" } }\n" +
            method("points = 3", 0.25, 3));
    CHECK(both.events.size() == 2);
    CHECK(std::fabs(both.result.q[0] - 13) < 1e-13);
}

TEST_CASE("steps that kicks cut have the order of the method" * doctest::test_suite("slow")) {
    const auto end = [](const std::string& how, double step) {
        return run("lagrangian = \"q'^2/2 + cos(q)\"\ntime = \"t\"\n[coordinates]\n"
                   "q = { position = 1, velocity = 0 }\n[impacts]\n\"kick[i]\" = { when = \"t = 0.7*i\", count = 4, "
                   "reset = { \"q'\" = \"q' + 0.3*cos(q)\" } }\n" +
                   method(how, step, 3.2))
            .result.q[0];
    };
    const double exact = end("points = 12", 0.05);
    for (const auto& [how, order] :
         {std::pair{"points = 3", 4.0}, {"points = 4", 6.0}, {"family = \"gauss\"\nstages = 2", 4.0}}) {
        const double measured = std::log2(std::fabs(end(how, 0.4) - exact) / std::fabs(end(how, 0.05) - exact)) / 3;
        CHECK(measured > order - 0.6);  // 3.5, 5.9, 4.4
    }
}

TEST_CASE("a stop ends the run at its time, and says which") {
    // The separatrix: sin(q/2) = tanh t.
    const std::string text = "lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 0, velocity = 2 }\n" +
                             method("points = 8", 0.1, 100) + "stop = [\"q = 7\", \"q = 1 rising\"]\n" +
                             "[output]\nevents = [\"q = 1/2\", \"q = 3/2\"]\n";
    const Ended ended = run(text);
    const double exact = std::atanh(std::sin(0.5));
    CHECK(ended.result.status == LOBATTO_OK);
    CHECK(ended.result.stop == 3);
    CHECK(std::fabs(ended.result.time - exact) < 1e-14);
    CHECK(std::fabs(ended.result.q[0] - 1) < 1e-14);
    CHECK(ended.result.steps_done == 5);
    REQUIRE(ended.events.size() == 2);
    CHECK(ended.events[1][0] == 3);
    // Who does not ask for events is not stopped.
    Scene scene = scene_of(text);
    scene.run.until = 1;
    CHECK(run(scene, false).result.stop == -1);
}

TEST_CASE("stops and impacts work together") {
    const Ended ended =
        run(fmt::format(fmt::runtime(ball), 0.5) + method("points = 4", 0.125, 4) + "stop = \"y' = 0 falling\"\n");
    CHECK(ended.result.stop == 0);
    CHECK(std::fabs(ended.result.time - 1.5) < 1e-14);
    CHECK(std::fabs(ended.result.q[0] - 0.25) < 1e-14);
    CHECK(ended.events.size() == 2);
}

TEST_CASE("dry friction takes 2 mu from each half period, until it holds") {
    // x'' = -x - mu sign(x'): half circles around -mu and mu in turn.
    const std::string slide =
        "lagrangian = \"x'^2/2 - x^2/2\"\n[parameters]\nmu = {}\n[coordinates]\nx = {{ position = 1, velocity = 0 }}\n"
        "[forces]\nx = \"-mu*sign(x')\"\n";
    for (const char* how : {"points = 8", "family = \"gauss\"\nstages = 7"}) {
        const Ended ended = run(fmt::format(fmt::runtime(slide), 0.01) + method(how, 0.25, 40));
        const int half_periods = static_cast<int>(40 / pi);
        const double side = half_periods % 2 == 0 ? 1 : -1, turn = 1 - 0.02 * half_periods,
                     exact = side * (0.01 + (turn - 0.01) * std::cos(40 - pi * half_periods));
        CHECK(std::fabs(ended.result.q[0] - exact) < 1e-12);
        CHECK(ended.events.empty());
    }
    const Ended held = run(fmt::format(fmt::runtime(slide), 0.3) + method("points = 8", 0.25, 40));
    CHECK(held.result.status == LOBATTO_IMPACTS_ACCUMULATE);  // at x = -0.4 + 0.6, below 0.3, after two half periods
    CHECK(held.result.time == 6.25);
    // A stop where the velocity is 0 ends the motion there, too: that of its direction.
    const std::string sticks = fmt::format(fmt::runtime(slide), 0.3) + method("points = 8", 0.25, 40);
    const Ended arrested = run(sticks + "stop = \"x' = 0 rising\"\n"),
                other = run(sticks + "stop = \"x' = 0 falling\"\n");
    CHECK(arrested.result.status == LOBATTO_OK);
    CHECK(std::fabs(arrested.result.time - pi) < 1e-13);
    CHECK(std::fabs(arrested.result.q[0] + 0.4) < 1e-13);
    CHECK(other.result.status == LOBATTO_OK);
    CHECK(std::fabs(other.result.time - 2 * pi) < 1e-13);
    CHECK(std::fabs(other.result.q[0] + 0.2) < 1e-13);
}

TEST_CASE("steps are cut where a formula is not smooth: whole numbers of abs, max and if, to rounding") {
    // A mass in the potential |x| falls like a stone: period 4 sqrt(2).
    const Ended valley = run("lagrangian = \"x'^2/2 - abs(x)\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n" +
                             method("points = 3", 0.1, 100));
    const double phase = 100 - 17 * 4 * std::sqrt(2.0), risen = phase - 2 * std::sqrt(2.0);  // from -1 on
    CHECK(std::fabs(valley.result.q[0] - (risen * risen / 2 - 1)) < 1e-12);
    CHECK(valley.result.energy_error_largest < 1e-13);

    const Ended heavier =
        run("time = \"t\"\nlagrangian = \"y'^2/2 - y*if(t < 1.23, 1, 2)\"\n[coordinates]\ny = { position = 1, velocity "
            "= 0 }\n" +
            method("points = 3", 0.1, 2));
    CHECK(std::fabs(heavier.result.q[0] - (1 - 1.23 * 1.23 / 2 - 1.23 * 0.77 - 0.77 * 0.77)) < 1e-14);

    // Of sides that are known when the kernel is written nothing is left.
    const Scene known = scene_of(
        "lagrangian = \"x'^2/2 - max(2, 1)*x^2/2 + min(1, 2)*hypot(3, 4) + if(1 > 2, 7, 0)\"\n"
        "[coordinates]\nx = { position = 1, velocity = 0 }\n" +
        method("points = 3", 0.1, 1));
    CHECK(known.switches.empty());
    CHECK(
        known.lagrangian.subs(known.coordinates[0].position == 1).subs(known.coordinates[0].velocity == 0).is_equal(4));
}

TEST_CASE("a motion may begin just before a switch that is small all the way") {
    // Defect once: zero was measured by the switch itself, 1e-8, not by the rounding of x = 3.3.
    for (const double step : {6e-5, 6.01e-5, 1e-4, 1.7e-4}) {
        CAPTURE(step);
        const Ended ended = run(
            "lagrangian = \"x'^2/2\"\n[coordinates]\nx = { position = 3.3008413461538466, velocity = 1 }\n[forces]\n"
            "x = \"if((x - 3.301)^2 < 1e-8, 100, 0)\"\n" +
            method("points = 4", step, 20 * step));
        CHECK(ended.result.status == LOBATTO_OK);
        CHECK(ended.result.p[0] == doctest::Approx(std::sqrt(1 + 2 * 100 * 2e-4)).epsilon(1e-12));
    }
}

TEST_CASE("a contact of one side keeps the order of the method") {
    // A mass that meets a spring at x = 0: nonlinear on both sides.
    const auto end = [&](const std::string& how, double step) {
        return run("lagrangian = \"x'^2/2 - cosh(x) - 20*max(-x, 0)^3\"\n[coordinates]\nx = { position = 1, velocity = "
                   "0 }\n" +
                   method(how, step, 6))
            .result.q[0];
    };
    const double exact = end("points = 8", 0.05);
    for (const auto& [how, order, step] : {std::tuple{"points = 3", 4, 0.1}, {"points = 4", 6, 0.2}}) {
        const std::string tried = how;  // bindings cannot be captured
        CAPTURE(tried);
        const double coarse = std::fabs(end(how, step) - exact), fine = std::fabs(end(how, step / 2) - exact);
        CHECK(std::log2(coarse / fine) > order - 0.7);
        CHECK(coarse > 1e-9);
    }
}

TEST_CASE("formulas of pieces are written with their operands") {
    const auto wrong = [&](const std::string& formula) {
        return refusal("lagrangian = \"x'^2/2 - " + formula +
                       "\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n" + method("points = 4", 0.1, 1));
    };
    CHECK(test::contains(wrong("max(x)"), "1:29: max is written max(a, b)"));
    CHECK(test::contains(wrong("if(x, 1, 2)"), "a condition is written if(a > b, c, d)"));
    CHECK(test::contains(wrong("abs x"), "abs needs parentheses: write abs(a)"));
    CHECK(test::contains(wrong("x^2*sig(x)"), "unknown function 'sig'"));
    CHECK(test::contains(
        refusal("lagrangian = \"x'^2/2\"\n[parameters]\nabs = 1\n[coordinates]\nx = { position = 1, velocity = "
                "0 }\n" +
                method("points = 4", 0.1, 1)),
        "abs"));
    CHECK(test::contains(
        refusal("lagrangian = \"x'^2/2\"\n[parameters]\na = 1\n[coordinates]\nx = { position = \"abs(a)\", "
                "velocity = 0 }\n" +
                method("points = 4", 0.1, 1)),
        "abs needs a number here"));
}

TEST_CASE("the emitted impacts are what the scene says, to 50 digits") {
    const Scene scene = scene_of(
        "time = \"t\"\nlagrangian = \"(1 + x^2)*x'^2/2 + y'^2/2 - x*y\"\n[parameters]\ne = 0.7\n[coordinates]\n"
        "x = { position = 1, velocity = 0 }\ny = { position = 1, velocity = 0 }\n[impacts]\n"
        "a = { when = \"sin(x*y) = t^2/9 falling\", restitution = \"e^2\" }\n"
        "b = { when = \"x = 5 rising\", reset = { \"x'\" = \"-x'*y + t\" } }\n" +
        method("points = 3", 0.1, 1));
    const Derivation derivation = derive(scene);
    bool is_there = false;
    for (const Check& check : check_programs(derivation, optimised_programs(derivation).programs)) {
        CAPTURE(check.claim);
        CHECK(check.holds);
        is_there = is_there || check.claim == "emitted impacts";
    }
    CHECK(is_there);
}

TEST_CASE("what is wrong with a wall is said with its place") {
    const std::string head = "lagrangian = \"y'^2/2 - y\"\n[coordinates]\ny = { position = 1, velocity = 0 }\n",
                      tail = method("points = 4", 0.1, 1);
    const auto wall = [&](const std::string& line) { return refusal(head + "[impacts]\n" + line + "\n" + tail); };
    CHECK(test::contains(wall("a = { when = \"y = 0\" }"), "5:14: from which side does the motion meet a?"));
    CHECK(test::contains(wall("a = { when = \"y' = 0 falling\" }"), "the wall a holds a velocity"));
    CHECK(test::contains(wall("a = { when = \"1 = 0 falling\" }"), "a never happens"));
    CHECK(test::contains(wall("a = { when = \"y = 0.5\", passes = true }"),
                         "the motion passes a: say what changes there"));
    const std::string kick = "time = \"t\"\n" + head + "[impacts]\na = { when = \"t = 0.5\"";
    CHECK(test::contains(refusal(kick + " }\n" + tail),
                         "6:14: the motion passes a: say what changes there, as in reset"));
    CHECK(test::contains(refusal(kick + ", passes = false, reset = { \"y'\" = \"1\" } }\n" + tail),
                         "a holds no coordinate, so the motion always passes it"));
    CHECK(test::contains(wall("a = { when = \"y = 0 falling\", restitution = 1.5 }"), "5:45: the restitution is 1.5"));
    CHECK(test::contains(wall("a = { when = \"y = 2 falling\" }"), "the start is behind the wall a"));
    CHECK(test::contains(wall("a = { restitution = 1 }"), "when = \"y = 0 falling\""));
    CHECK(test::contains(wall("\"a[i]\" = { when = \"y = 0 falling\" }"), "how many impacts a[i] are there?"));
    CHECK(test::contains(wall("a = { when = \"y = 0 falling\", reset = { z = 1 } }"), "there is no coordinate 'z'"));
    CHECK(test::contains(wall("a = { when = \"y = 0 falling\", reset = {} }"), "this reset changes nothing"));
    CHECK(test::contains(wall("y = { when = \"y = 0 falling\" }"), "y"));
    CHECK(test::contains(refusal("lagrangian = \"y'^4 + y'^2 - y\"\n[coordinates]\ny = { position = 1, velocity = 1 }\n"
                                 "[impacts]\na = { when = \"y = 0 falling\" }\n" +
                                 tail),
                         "quadratic"));
    CHECK(test::contains(
        refusal(head + "[impacts]\na = { when = \"y = 0 falling\" }\n" + tail + "[output]\ndense = 3\n"), "dense = 0"));
}

TEST_CASE("formulas with sides may start at numbers that are not rational") {
    for (const std::string position : {"sqrt(2)", "cos(1)", "2*cos(2*pi/17)"})
        CHECK_NOTHROW(
            derive(scene_of("lagrangian = \"q'^2/2\"\n[coordinates]\nq = { position = \"" + position +
                            "\", velocity = 0 }\n[forces]\nq = \"-abs(q)\"\n[run]\nstep = 0.1\nuntil = 1\n")));
}

TEST_CASE("walls that are met at one time are told, unless they stand at right angles or nothing joins them") {
    const auto said = [](const std::string& text) {
        const test::TemporaryFolder folder;
        test::write_text(folder / "walls.toml", text);
        const test::Finished done =
            test::run({LOBATTO_PROGRAM, "run", folder / "walls.toml", "-o", folder / "walls.csv"});
        CHECK_MESSAGE(done.exit_code == 0, done.err);
        return done.err;
    };
    const std::string together = "one time. They act one after another, in the order of the scene";
    const std::string box =
        "lagrangian = \"-9.81*box.y\"\n[bodies]\nbox = { mass = 1, inertia = \"2*w^2/3\", position = [0, 1], angle = "
        "{} "
        "}\n[parameters]\nw = 0.25\n[impacts]\nleft = { when = \"box.y(-w, -w) = 0 falling\", restitution = 0.5 }\n"
        "right = { when = \"box.y(w, -w) = 0 falling\", restitution = 0.5 }\n" +
        method("points = 4", 0.01, 0.45);
    const auto tilted = [&](const std::string& angle) {
        std::string text = box;
        return text.replace(text.find("{}"), 2, angle);
    };
    CHECK(said(tilted("0")).find("the motion meets the walls left and right at " + together) != std::string::npos);
    CHECK(said(tilted("0.1")).empty());
    const auto point = [&](const std::string& walls) {
        return "lagrangian = \"(x'^2 + y'^2)/2\"\n[coordinates]\nx = { position = 1, velocity = -1 }\ny = { position = "
               "1, "
               "velocity = -1 }\n[impacts]\n" +
               walls + method("points = 3", 0.1, 1.5);
    };
    CHECK(said(point("a = { when = \"x = 0 falling\" }\nb = { when = \"y = 0 falling\" }\n")).empty());
    CHECK(said(point("a = { when = \"x = 0 falling\" }\nb = { when = \"x + 2*y = 0 falling\" }\n")).find(together) !=
          std::string::npos);
    // One wall written twice; a wall with a reset that is not met.
    CHECK(
        said(point("a = { when = \"x = 0 falling\", restitution = 0.5 }\nb = { when = \"2*x = 0 falling\", restitution "
                   "= 0.5 }\n"))
            .empty());
    CHECK(said(point("a = { when = \"x = 0 falling\" }\nb = { when = \"x + 2*y = 0 falling\" }\n"
                     "c = { when = \"x = 9 rising\", reset = { \"x'\" = \"-2*x'\" } }\n"))
              .find(together) != std::string::npos);
    // Balls that touch: what one gets is thrown on to the next. Hit from both sides, the middle one is undecided, but
    // for equal masses that lose nothing: they go on as if they had passed through one another.
    const auto cradle = [&](const std::string& last) {
        return "lagrangian = \"(x1'^2 + x2'^2 + x3'^2)/2\"\n[coordinates]\nx1 = { position = -1, velocity = 1 }\n"
               "x2 = { position = 0, velocity = 0 }\nx3 = { " +
               last +
               " }\n[impacts]\na = { when = \"x2 - x1 = 0 falling\" }\nb = { when = \"x3 - x2 = 0 falling\" }\n" +
               method("points = 3", 0.1, 1.5);
    };
    CHECK(said(cradle("position = 0, velocity = 0")).empty());
    CHECK(said(cradle("position = 1, velocity = -1")).empty());
    std::string heavy = cradle("position = 1, velocity = -1");
    CHECK(said(heavy.replace(heavy.find("x3'^2"), 5, "2*x3'^2")).find(together) != std::string::npos);
}

TEST_CASE("a motion comes to rest on a wall where it leaves it more slowly than is asked for") {
    // It flies e^k times 2 after impact k, and a height of 1 takes it a time of 1 to fall.
    const auto resting = [](double e, const std::string& rest) {
        std::string text = fmt::format(fmt::runtime(ball), e);
        return text.replace(text.find("restitution = \"e\""), 17, "restitution = \"e\", rest = " + rest);
    };
    const Ended ended = run(resting(0.5, "0.1") + method("points = 4", 0.3, 10));
    CHECK(ended.result.status == LOBATTO_OK);
    REQUIRE(ended.events.size() == 5);  // it leaves with 1, 1/2, 1/4, 1/8, 1/16
    CHECK(ended.result.stop == 0);
    CHECK(std::fabs(ended.result.time - (1 + 1 + 0.5 + 0.25 + 0.125)) < 1e-14);
    CHECK(std::fabs(ended.events.back()[3] - 3.0 / 16) < 1e-14);
    // In sight of a stop the stop counts; with no restitution the first impact is the last; a start may lie there.
    CHECK(run(resting(0.5, "0.1") + method("points = 4", 0.3, 10) + "stop = \"y' = 0.7\"\n").result.stop == 0);
    const Ended first = run(resting(0, "1e-6") + method("points = 4", 0.3, 10));
    CHECK(first.events.size() == 1);
    CHECK(std::fabs(first.result.time - 1) < 1e-14);
    std::string lying = resting(0.5, "0.1") + method("points = 4", 0.3, 10);
    lying.replace(lying.find("position = 1"), 12, "position = 0");
    CHECK(run(lying).result.time == 0);
    // Its error is measured to there, and a sweep keeps it as a stop.
    const test::TemporaryFolder folder;
    for (const double e : {0.0, 0.5}) {
        test::write_text(folder / "ball.toml", resting(e, "1e-3") + method("points = 4", 0.07, 10));
        const test::Finished done =
            test::run({LOBATTO_PROGRAM, "run", folder / "ball.toml", "-o", folder / "ball.csv"});
        CHECK_MESSAGE(done.exit_code == 0, done.err);
        CHECK(done.out.find("at rest on 'floor: y = 0 falling' at t = ") != std::string::npos);
        CHECK(done.out.find("e-1") < done.out.find("of the amplitude"));
    }
    const test::Finished swept = test::run(
        {LOBATTO_PROGRAM, "sweep", folder / "ball.toml", "--vary", "y=0.5:1.5:3", "-o", folder / "balls.csv"});
    CHECK_MESSAGE(swept.exit_code == 0, swept.err);
    CHECK(test::read_file(folder / "balls.csv").find("# stop 1: floor: y = 0 falling\n") != std::string::npos);
    // Of walls that are met together the last one counts: here it goes on to the second, and both are left for good.
    const Ended box =
        run("lagrangian = \"-9.81*box.y\"\n[bodies]\nbox = { mass = 1, inertia = 0.04, position = [0, 1] }\n[impacts]\n"
            "left = { when = \"box.y(-0.25, -0.25) = 0 falling\", restitution = 0, rest = 0.01 }\n"
            "right = { when = \"box.y(0.25, -0.25) = 0 falling\", restitution = 0, rest = 0.01 }\n" +
            method("points = 4", 0.01, 1));
    REQUIRE(box.events.size() > 2);
    CHECK(box.result.stop >= 0);
    CHECK(std::fabs(box.result.time - std::sqrt(2 * 0.75 / 9.81)) < 1e-13);
    for (std::size_t k = 0; k < 3; ++k) CHECK(std::fabs(box.result.p[k]) < 1e-2);  // both corners are slower than that
    // Mistakes.
    CHECK(refusal(resting(0.5, "-1") + method("points = 4", 0.3, 10)).find("rest of floor is negative") !=
          std::string::npos);
    std::string reset = resting(0.5, "1") + method("points = 4", 0.3, 10);
    reset.replace(reset.find("restitution = \"e\""), 17, "reset = { \"y'\" = \"-y'\" }");
    CHECK(refusal(reset).find("a reset leaves the wall as it says; leave out rest") != std::string::npos);
}
