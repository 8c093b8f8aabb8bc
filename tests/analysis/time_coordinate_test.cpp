// SPDX-License-Identifier: GPL-2.0-or-later
// Clocks of motions that do not keep their energy: the time is a coordinate (D64). Against exact solutions.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "generator/mechanics/clock/automatic_clock.hpp"
#include "generator/pipeline.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;

namespace {

constexpr double e = 0.9, u = 0.3, a = 0.05;

// Kepler's problem about a centre that moves like u t + a t^2/2 along x: explicit time in L and in the clock.
std::string moving_centre(const std::string& method, double step, double until) {
    return fmt::format(
        "time = \"t\"\nlagrangian = \"(x'^2 + y'^2)/2 + a*x + 1/r\"\n[definitions]\n"
        "r = \"sqrt((x - u*t - a*t^2/2)^2 + y^2)\"\n[coordinates]\nx = {{ position = \"1 - e\", velocity = \"u\" }}\n"
        "y = {{ position = 0, velocity = \"sqrt((1 + e)/(1 - e))\" }}\n[parameters]\ne = {}\nu = {}\na = {}\n[method]\n"
        "{}\n[run]\nstep = {}\nuntil = {}\n",
        e, u, a, method, step, until);
}

// Kepler's problem, half of it as a force.
std::string half_forced(const std::string& method, double step, double until, const std::string& rate = "velocity") {
    return fmt::format(
        "lagrangian = \"(x'^2 + y'^2)/2 + 1/(2*r)\"\n[definitions]\nr = \"sqrt(x^2 + y^2)\"\n[coordinates]\n"
        "x = {{ position = \"1 - e\", {4} = 0 }}\ny = {{ position = 0, {4} = \"sqrt((1 + e)/(1 - e))\" }}\n[forces]\n"
        "x = \"-x/(2*r^3)\"\ny = \"-y/(2*r^3)\"\n[parameters]\ne = {0}\n[method]\n{1}\n[run]\nstep = {2}\nuntil = "
        "{3}\n",
        e, method, step, until, rate);
}

Scene scene_of(const std::string& text) {
    return read_scene(Source("driven.toml", text));
}

TrajectoryResult run(const Scene& scene, std::int64_t arrivals = 61) {
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    const TrajectoryResult result = integrate(kernel, request_of(scene, arrivals, stepper));
    REQUIRE(result.status == LOBATTO_OK);
    return result;
}

// Kepler's equation, from the pericentre: x, y, and their rates.
std::vector<double> ellipse(double t, double eccentricity = e) {
    double anomaly = t;
    for (int i = 0; i < 2000; ++i)
        anomaly -= (anomaly - eccentricity * std::sin(anomaly) - t) / (1 - eccentricity * std::cos(anomaly)) / 2;
    const double c = std::cos(anomaly), s = std::sin(anomaly), b = std::sqrt(1 - eccentricity * eccentricity),
                 rate = 1 / (1 - eccentricity * c);
    return {c - eccentricity, b * s, -s * rate, b * c * rate};
}

double error_of(const TrajectoryResult& result, double t, bool moves) {
    const std::vector<double> at = ellipse(t);
    const double shift = moves ? u * t + a * t * t / 2 : 0;
    return std::fmax(std::fabs(result.q[0] - shift - at[0]), std::fabs(result.q[1] - at[1]));
}

}  // namespace

TEST_CASE("a clock follows a motion in explicit time, with the order of the method, against Kepler's solution") {
    struct Row {
        std::string method;
        double step;
        int order;
    };
    for (const Row& row :
         {Row{"points = 3", 0.08, 4}, Row{"points = 4", 0.15, 6}, Row{"family = \"gauss\"\nstages = 2", 0.08, 4}}) {
        INFO(row.method);
        double errors[2];
        for (const int part : {1, 2})
            errors[part - 1] = error_of(
                run(scene_of(moving_centre(row.method + "\nclock = \"r^(3/2)\"", row.step / part, 9))), 9, true);
        CHECK(std::log2(errors[0] / errors[1]) == doctest::Approx(row.order).epsilon(0.12));
    }
    const TrajectoryResult result = run(scene_of(moving_centre("points = 9\nclock = \"r^(3/2)\"", 0.4, 31.4)));
    CHECK(result.chain_steps < 130);  // equal steps take some 10,000
    CHECK(error_of(result, 31.4, true) < 1e-11);
    CHECK(result.q[2] == doctest::Approx(31.4).epsilon(1e-14));
}

TEST_CASE("a clock follows a motion with forces, whose power its energy takes") {
    for (const std::string method : {"points = 9", "family = \"gauss\"\nstages = 8"}) {
        INFO(method);
        const TrajectoryResult result = run(scene_of(half_forced(method + "\nclock = \"r^(3/2)\"", 0.4, 31.4)));
        CHECK(result.chain_steps < 130);
        CHECK(error_of(result, 31.4, false) < 1e-11);
        // p_time = -H of the Lagrangian, without the potential of the force.
        const std::vector<double> at = ellipse(31.4);
        const double H = (at[2] * at[2] + at[3] * at[3]) / 2 - 0.5 / std::hypot(at[0], at[1]);
        CHECK(result.p[2] == doctest::Approx(-H).epsilon(1e-10));
    }
}

TEST_CASE("an automatic clock follows poles that move") {
    const Scene scene = with_automatic_clock(scene_of(moving_centre("points = 9", 0.4 * std::pow(1 - e, 1.5), 31.4)));
    REQUIRE(scene.has_time_coordinate());
    const TrajectoryResult result = run(scene);
    CHECK(result.chain_steps < 4200);
    CHECK(error_of(result, 31.4, true) < 1e-10);
    CHECK(with_equal_steps(scene).coordinates.size() == 2);
}

TEST_CASE("steps in explicit time are symplectic in the extended phase space, and go back the way they came") {
    const Scene scene = scene_of(moving_centre("points = 6\nclock = \"r^(3/2)\"", 0.2, 1));
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    const TrajectoryRequest request = request_of(scene, 10, stepper);
    CHECK(symplectic_defect<double>(stepper, request.q, request.p) < 1e-14);
    // Forces do no harm to the last check, but to this one.
    const Scene forced = scene_of(half_forced("points = 6\nclock = \"r^(3/2)\"", 0.2, 1));
    const Kernel of_forced = kernel_of(emit(derive(forced)), Precision::double_);
    LoadedStepper<double> forced_stepper(of_forced);
    const TrajectoryRequest with_forces = request_of(forced, 10, forced_stepper);
    CHECK(symplectic_defect<double>(forced_stepper, with_forces.q, with_forces.p) > 1e-6);
}

TEST_CASE("a start sets the time and its momentum, whatever it is given for them, from momenta too") {
    const TrajectoryResult by_velocity = run(scene_of(half_forced("points = 9\nclock = \"r^(3/2)\"", 0.4, 9)));
    const Scene scene = scene_of(half_forced("points = 9\nclock = \"r^(3/2)\"", 0.4, 9, "momentum"));
    const TrajectoryResult by_momentum = run(scene);
    CHECK(by_momentum.q[0] == doctest::Approx(by_velocity.q[0]).epsilon(1e-12));
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    TrajectoryRequest request = request_of(scene, 61, stepper);
    CHECK(request.p[2] == doctest::Approx(-(9.5 - 5)).epsilon(1e-14));  // -H at the start
    request.q[2] = 5;
    request.p[2] = 99;
    CHECK(integrate(kernel, request).q[0] == by_momentum.q[0]);
}

TEST_CASE("starts at any time, from velocities and momenta, are those of the motion there") {
    // A field that changes: p = v + B(t) x, so a momentum belongs to a time.
    const std::string text =
        "time = \"t\"\nlagrangian = \"(x'^2 + y'^2)/2 + 0.3*cos(t)*(x*y' - y*x') + 1/sqrt(x^2 + "
        "y^2)\"\n[coordinates]\nx = { position = 0.3, velocity = 0 }\ny = { position = 0, velocity = 1.5 }\n"
        "[method]\npoints = 8\nclock = \"auto\"\n[run]\nstep = 0.05\nuntil = 5\n";
    const Kernel kernel = kernel_of(emit(derive(scene_of(text))), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    REQUIRE(stepper.prepare({}, 0.05) == LOBATTO_OK);
    for (const double given : {0.0, 1.0, 7.0}) {  // for the time and its rate
        const std::vector<double> p = stepper.momentum(2, {0.3, 0, given}, {0, 1.5, given});
        CHECK(p[1] == doctest::Approx(1.5 + 0.3 * std::cos(2) * 0.3).epsilon(1e-14));
    }
    // Momenta of a Lagrangian that has no velocities beyond that of light, and of one without a mass at rest.
    for (const std::string lagrangian :
         {"-sqrt(1 - x'^2 - y'^2) + 1/sqrt(x^2 + y^2)", "x'^4/4 + y'^2/2 + 1/sqrt(x^2 + y^2)"}) {
        INFO(lagrangian);
        const std::string forced = "lagrangian = \"" + lagrangian +
                                   "\"\n[coordinates]\nx = { position = 2, momentum = 0.8 }\n"
                                   "y = { position = 0, momentum = 1.5 }\n[forces]\ny = \"-0.01*y'\"\n[method]\n"
                                   "points = 6\n";
        const TrajectoryResult by_clock = run(scene_of(forced + "clock = \"auto\"\n[run]\nstep = 0.05\nuntil = 1\n"));
        const TrajectoryResult equal = run(scene_of(forced + "[run]\nstep = 0.01\nuntil = 1\n"), 100);
        CHECK(by_clock.q[0] == doctest::Approx(equal.q[0]).epsilon(1e-10));
        CHECK(by_clock.q[1] == doctest::Approx(equal.q[1]).epsilon(1e-10));
    }
}

TEST_CASE("an automatic clock keeps to the places of poles whose strengths change, or turn round, in time") {
    for (const std::string strength : {"exp(-0.01*t)", "cos(t)", "sin(t)"}) {
        INFO(strength);
        const std::string text =
            "time = \"t\"\nlagrangian = \"(x'^2 + y'^2)/2 + " + strength +
            "/sqrt(x^2 + y^2 + 0.01) + 1/sqrt((x - 3)^2 + y^2 + 0.01)\"\n[coordinates]\nx = { position = 0.5, velocity "
            "= 0 }\ny = { position = 0, velocity = 1.4 }\n[method]\npoints = 8\n";
        const TrajectoryResult by_clock = run(scene_of(text + "clock = \"auto\"\n[run]\nstep = 0.05\nuntil = 6\n"));
        const TrajectoryResult equal = run(scene_of(text + "[run]\nstep = 0.005\nuntil = 6\n"), 1200);
        CHECK(by_clock.q[0] == doctest::Approx(equal.q[0]).epsilon(1e-9));
        CHECK(by_clock.q[1] == doctest::Approx(equal.q[1]).epsilon(1e-9));
    }
}

TEST_CASE("verify proves steps in explicit time and with forces") {
    const test::TemporaryFolder folder;
    for (const bool moves : {true, false}) {
        const std::string method = "points = 4\nclock = \"r^(3/2)\"";
        test::write_text(folder / "scene.toml", moves ? moving_centre(method, 0.1, 5) : half_forced(method, 0.1, 5));
        const test::Finished proof = test::run({LOBATTO_PROGRAM, "verify", folder / "scene.toml"});
        INFO(proof.out);
        CHECK(proof.exit_code == 0);
        CHECK((proof.out.find("symplectic step") != std::string::npos) == !moves);  // not promised with forces
    }
}

TEST_CASE("rows of a sweep in explicit time are the ends of runs; the time itself cannot be varied") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", moving_centre("points = 8\nclock = \"r^(3/2)\"", 0.4, 20));
    const test::Finished sweep = test::run(
        {LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary", "a=0.01:0.09:9", "-o", folder / "sweep.csv"});
    INFO(sweep.err);
    REQUIRE(sweep.exit_code == 0);
    const auto table = test::read_trajectory(folder / "sweep.csv");
    REQUIRE(table.rows.size() == 9);
    REQUIRE(test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv"}).exit_code == 0);
    const auto end = test::read_trajectory(folder / "run.csv").rows.back();
    // trajectory, a, status, steps, t, x, ... beside t, x, ...
    for (std::size_t k = 0; k < 7; ++k) CHECK(table.rows[4][4 + k] == doctest::Approx(end[k]).epsilon(1e-10));
    // The first row of a start from momenta knows that of the time, too.
    test::write_text(folder / "scene.toml", half_forced("points = 8\nclock = \"r^(3/2)\"", 0.4, 2, "momentum"));
    REQUIRE(test::run({LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary", "p_y=4,4.3", "--every", "30", "-o",
                       folder / "kept.csv"})
                .exit_code == 0);
    const auto kept = test::read_trajectory(folder / "kept.csv");
    CHECK(kept.rows[0][4] == 0);
    CHECK(kept.rows[0][10] == doctest::Approx(-(8.0 - 5)).epsilon(1e-12));
    for (const std::string name : {"time", "time'", "p_time"}) {
        const test::Finished refused =
            test::run({LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary", name + "=0,1"});
        CHECK(refused.exit_code == 2);
        CHECK(refused.err.find(name + " is of the time, which a clock counts from 0") != std::string::npos);
    }
}

TEST_CASE("the kernel of a clock is the same in every process" * doctest::test_suite("slow")) {
    // g is a product of powers, in an order that differs from one process to the next.
    const std::string rest =
        "\n[coordinates]\nx = { position = 0.45, velocity = 0.1 }\ny = { position = 0, velocity = 1.1 }\n[parameters]\n"
        "m1 = 0.7\nm2 = 0.3\n[definitions]\nr = \"sqrt((x + m2*cos(t))^2 + (y + m2*sin(t))^2)\"\n"
        "s = \"sqrt((x - m1*cos(t))^2 + (y - m1*sin(t))^2)\"\n[run]\nstep = 0.02\nuntil = 3\n[method]\npoints = 4\n";
    const test::TemporaryFolder folder;
    for (const std::string clock : {"auto", "r^(3/2)*s^(1/2)"}) {
        test::write_text(folder / "scene.toml", "time = \"t\"\nlagrangian = \"(x'^2 + y'^2)/2 + m1/r + m2/s\"" + rest +
                                                    "clock = \"" + clock + "\"\n");
        std::string first;
        for (int process = 0; process < 8; ++process) {
            REQUIRE(test::run({LOBATTO_PROGRAM, "emit", folder / "scene.toml", "-o", folder / "out"}).exit_code == 0);
            const std::string text = test::read_file(folder / "out/scene.hpp");
            if (first.empty()) first = text;
            CHECK(text == first);
        }
    }
}

TEST_CASE("the clock auto takes the sizes of poles, whatever sign a parameter gets") {
    const std::string text =
        "time = \"t\"\nlagrangian = \"(x'^2 + y'^2)/2 + k/sqrt(x^2 + y^2 + 0.01) + sin(t + phase)/sqrt((x - 3)^2 + y^2 "
        "+ "
        "0.01)\"\n[coordinates]\nx = { position = 0.5, velocity = 0 }\ny = { position = 0, velocity = 1.4 }\n[method]\n"
        "points = 8\nclock = \"auto\"\n[run]\nstep = 0.05\nuntil = 6\n[parameters]\nphase = 1\n";
    const test::TemporaryFolder folder;
    test::write_text(folder / "there.toml", text + "k = 1\n");
    test::write_text(folder / "here.toml", text + "k = -1\n");
    const auto end_of = [&](std::vector<std::string> arguments) {
        arguments.insert(arguments.begin(), {LOBATTO_PROGRAM, "run"});
        arguments.insert(arguments.end(), {"-o", folder / "run.csv", "--quiet"});
        const test::Finished finished = test::run(arguments);
        INFO(finished.err);
        REQUIRE(finished.exit_code == 0);
        return test::read_trajectory(folder / "run.csv").rows;
    };
    CHECK(end_of({folder / "there.toml", "--set", "k=-1"}) == end_of({folder / "here.toml"}));
    // An amplitude that is 0 at the start counts as 1.
    std::string still = text + "k = 1\n";
    still.replace(still.find("phase = 1"), 9, "phase = 0");
    test::write_text(folder / "still.toml", still);
    CHECK(!end_of({folder / "still.toml"}).empty());
}

TEST_CASE("a clock may hold the time alone") {
    const TrajectoryResult result = run(
        scene_of("time = \"t\"\nlagrangian = \"(x'^2 - x^2)/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
                 "[method]\npoints = 6\nclock = \"1 + t\"\n[run]\nstep = 0.01\nuntil = 6\n"));
    CHECK(result.q[0] == doctest::Approx(std::cos(6)).epsilon(1e-9));
    CHECK(result.chain_steps == doctest::Approx(100 * std::log(7)).epsilon(0.02));
}

TEST_CASE("momenta that no velocity has, and singular masses, are refused with a clock too") {
    const auto refusal = [](const std::string& lagrangian, const std::string& momentum) {
        const std::string text =
            "lagrangian = \"" + lagrangian + "\"\n[coordinates]\nx = { position = 1, momentum = " + momentum +
            " }\ny = { position = 1, momentum = 1 }\n[forces]\ny = \"-y'\"\n[method]\nclock = \"auto\"\n"
            "[run]\nstep = 0.01\nuntil = 1\n";
        try {
            derive(scene_of(text));
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    CHECK(test::contains(refusal("x'^4/4 + y'^2/2 + 1/sqrt(x^2 + y^2)", "0"),
                         "driven.toml:1:15: the mass matrix is singular"));
    CHECK(test::contains(refusal("(x' + y')^2/2 + 1/sqrt(x^2 + y^2)", "1"),
                         "driven.toml:1:15: the mass matrix is singular"));
    CHECK(test::contains(refusal("sqrt(1 + x'^2) + y'^2/2 + 1/sqrt(x^2 + y^2)", "2"),
                         "driven.toml:3:32: no velocity was found that has the momenta of the start"));
}

TEST_CASE("a stop at the end of a table counts steps, and looks as far as a step lasts") {
    const test::TemporaryFolder folder;
    std::string rows;
    for (int i = 0; i <= 40; ++i) rows += fmt::format("{},{}\n", 0.1 * i, std::sin(0.1 * i));
    test::write_text(folder / "table.csv", rows);
    test::write_text(
        folder / "scene.toml",
        "time = \"t\"\nlagrangian = \"\"\"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2) + 0.1*x*table(\"table.csv\", t)\"\"\"\n"
        "[coordinates]\nx = { position = 0.4, velocity = 0 }\ny = { position = 0, velocity = 2 }\n[method]\n"
        "points = 6\nclock = \"auto\"\n[run]\nstep = 0.05\nuntil = 4\n");
    const test::Finished finished =
        test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv"});
    CHECK(finished.exit_code == 3);
    const std::size_t at = finished.out.find("steps ");
    REQUIRE(at != std::string::npos);
    const int steps = std::stoi(finished.out.substr(finished.out.find_first_of("0123456789", at)));
    CHECK(test::contains(finished.err, fmt::format("the run stopped in step {}, after t = ", steps + 1)));
    CHECK(test::contains(finished.err, "because steps with a clock go beyond the end of a run"));
}

TEST_CASE("tune takes a clock in explicit time where it is cheaper, and keeps its promise" *
          doctest::test_suite("slow")) {
    const test::TemporaryFolder folder;
    std::string text = moving_centre("points = 8", 0.001, 20);
    text.replace(text.find("e = 0.9"), 7, "e = 0.99");
    test::write_text(folder / "scene.toml", text);
    const test::Finished tuned =
        test::run({LOBATTO_PROGRAM, "tune", folder / "scene.toml", "--error", "1e-6", "--budget", "60s", "--write"});
    INFO(tuned.out << tuned.err);
    REQUIRE(tuned.exit_code == 0);
    CHECK(tuned.out.find("clock = \"auto\"") != std::string::npos);
    REQUIRE(test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv"}).exit_code == 0);
    const auto end = test::read_trajectory(folder / "run.csv").rows.back();
    const std::vector<double> at = ellipse(end[0], 0.99);
    const double shift = u * end[0] + a * end[0] * end[0] / 2;
    CHECK(std::fabs(end[1] - shift - at[0]) < 2e-6 * (shift + 2));
    CHECK(std::fabs(end[2] - at[1]) < 2e-6);
}
