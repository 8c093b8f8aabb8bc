// SPDX-License-Identifier: GPL-2.0-or-later
// Steps that are equally long in the time of a clock: the Lagrangian that is derived, and the motions that run.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "generator/mechanics/algebra/sample.hpp"
#include "generator/mechanics/clock/automatic_clock.hpp"
#include "generator/mechanics/clock/clock.hpp"
#include "generator/mechanics/structure/scaled_mass.hpp"
#include "generator/pipeline.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;

namespace {

std::string kepler(double e, const std::string& method, const std::string& run, const std::string& rest = "") {
    return "lagrangian = \"(x'^2 + y'^2)/2 + 1/r\"\n[definitions]\nr = \"sqrt(x^2 + y^2)\"\n[coordinates]\n"
           "x = { position = \"1 - e\", velocity = 0 }\n"
           "y = { position = 0, velocity = \"sqrt((1 + e)/(1 - e))\" }\n" +
           fmt::format("[parameters]\ne = {}\n[method]\n{}\n[run]\n{}\n{}", e, method, run, rest);
}

Scene scene_of(const std::string& text) {
    return read_scene(Source("clock.toml", text));
}

// The state at the end of the time, by the library itself.
struct Ended {
    TrajectoryRequest request;
    TrajectoryResult result;
    double energy_error = 0;
};
Ended run(const Scene& scene, std::int64_t arrivals = 61) {
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    Ended ended{request_of(scene, arrivals, stepper), {}};
    ended.result = integrate(kernel, ended.request);
    ended.energy_error = ended.result.energy_error_largest;
    REQUIRE(ended.result.status == LOBATTO_OK);
    return ended;
}

// Kepler's equation, from the pericentre.
std::vector<double> ellipse(double e, double t) {
    double u = t;
    for (int i = 0; i < 200; ++i) u -= (u - e * std::sin(u) - t) / (1 - e * std::cos(u));
    return {std::cos(u) - e, std::sqrt(1 - e * e) * std::sin(u)};
}

double error_of(const Ended& ended, double e, double t) {
    const std::vector<double> exact = ellipse(e, t);
    return std::fmax(std::fabs(ended.result.q[0] - exact[0]), std::fabs(ended.result.q[1] - exact[1]));
}

std::string refusal(const std::string& text) {
    try {
        emit(derive(scene_of(text)));
    } catch (const InputError& error) {
        const std::string text = error.what();
        return text.substr(0, text.find('\n'));
    }
    return "accepted";
}

}  // namespace

TEST_CASE("the Lagrangian of a clock is g (L(q, w/g) + E), and its momenta are those of L") {
    const std::string text =
        "lagrangian = \"(1 + x^2)*x'^2/2 + x*y*x'*y'/5 + y'^2/2 + x*y' - log(2 + cos(y')) - x^4 - "
        "y^2\"\n[coordinates]\n"
        "x = { position = 0.7, velocity = 0.3 }\ny = { position = 0.4, velocity = 0.5 }\n"
        "[method]\nclock = \"2 + sin(x*y)\"\n[run]\nstep = 0.1\nuntil = 1\n";
    const Scene scene = scene_of(text);
    const Derivation derivation = derive(scene);
    const auto L = [](double x, double y, double vx, double vy) {
        return (1 + x * x) * vx * vx / 2 + x * y * vx * vy / 5 + vy * vy / 2 + x * vy - std::log(2 + std::cos(vy)) -
               std::pow(x, 4) - y * y;
    };
    const auto px = [](double x, double y, double vx, double vy) { return (1 + x * x) * vx + x * y * vy / 5; };
    const auto py = [](double x, double y, double vx, double vy) {
        return x * y * vx / 5 + vy + x + std::sin(vy) / (2 + std::cos(vy));
    };
    const double E = 0.3 * px(0.7, 0.4, 0.3, 0.5) + 0.5 * py(0.7, 0.4, 0.3, 0.5) - L(0.7, 0.4, 0.3, 0.5);
    const double x = 0.6, y = -0.8, wx = 0.9, wy = 1.1, g = 2 + std::sin(x * y);
    Formulas formulas;
    const System& system = derivation.system;
    const auto set = [&](const GiNaC::symbol& symbol, double value) {
        formulas.set(symbol, float_of(GiNaC::numeric(value)));
    };
    set(system.q[0], x), set(system.q[1], y), set(system.v[0], wx), set(system.v[1], wy);
    const Parameter& energy = derivation.scene.parameters.back();
    CHECK(scene.evaluate(energy.value, "E").to_double() == doctest::Approx(E).epsilon(1e-14));
    formulas.set(energy.symbol, float_of(scene.evaluate(energy.value, "E")));
    const auto values = formulas({system.lagrangian, system.momentum[0], system.momentum[1]});
    CHECK(cln::double_approx(values[0]) == doctest::Approx(g * (L(x, y, wx / g, wy / g) + E)).epsilon(1e-13));
    CHECK(cln::double_approx(values[1]) == doctest::Approx(px(x, y, wx / g, wy / g)).epsilon(1e-13));
    CHECK(cln::double_approx(values[2]) == doctest::Approx(py(x, y, wx / g, wy / g)).epsilon(1e-13));
}

TEST_CASE("steps of a clock have the order of their method in physical time") {
    struct Row {
        std::string method;
        double step;
        int order;
    };
    for (const Row& row :
         {Row{"points = 3", 0.1, 4}, Row{"points = 4", 0.2, 6}, Row{"family = \"gauss\"\nstages = 2", 0.1, 4}}) {
        INFO(row.method);
        double errors[2];
        for (const int part : {1, 2})
            errors[part - 1] = error_of(run(scene_of(kepler(0.6, row.method + "\nclock = \"r^(3/2)\"",
                                                            fmt::format("step = {}\nuntil = 9", row.step / part)))),
                                        0.6, 9);
        CHECK(std::log2(errors[0] / errors[1]) == doctest::Approx(row.order).epsilon(0.12));  // 4.01, 5.9, 4.0
    }
}

TEST_CASE("an eccentric orbit takes less than twenty steps a revolution") {
    // 10 revolutions of e = 0.99 in some 160 steps, where equal ones are 50,000 for less.
    const Ended ended = run(scene_of(kepler(0.99, "points = 9\nclock = \"r^(3/2)\"", "step = 0.73\nuntil = 62.8")));
    CHECK(ended.result.chain_steps < 200);
    CHECK(error_of(ended, 0.99, 62.8) < 1e-8);  // 1e-10
}

TEST_CASE("the energy of an eccentric orbit stays bounded") {
    const auto after = [](double until) {
        return run(scene_of(
                       kepler(0.99, "points = 8\nclock = \"r^(3/2)\"", fmt::format("step = 0.9\nuntil = {}", until))))
            .energy_error;
    };
    const double early = after(200), late = after(20000);
    CHECK(early > 0);
    CHECK(late < 3 * early);
}

TEST_CASE("a step of a clock is symplectic") {
    const Scene scene = scene_of(kepler(0.6, "points = 5\nclock = \"r\"", "step = 0.3\nuntil = 1"));
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    const TrajectoryRequest request = request_of(scene, 1, stepper);
    CHECK(symplectic_defect(stepper, request.q, request.p) < 1e-14);
}

TEST_CASE("a motion with a clock goes back where it came from") {
    const Scene scene = scene_of(kepler(0.8, "points = 6\nclock = \"r^(3/2)\"", "step = 0.4\nuntil = 20"));
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    TrajectoryRequest request = request_of(scene, 61, stepper);
    const TrajectoryResult there = integrate(kernel, request);
    const std::vector<double> q = request.q, p = request.p;
    request.q = there.q;
    request.p = there.p;
    request.time = 20;
    request.step = -request.step;
    request.arrivals.interval = -request.arrivals.interval;
    request.arrivals.end = 0;
    const TrajectoryResult back = integrate(kernel, request);
    REQUIRE(back.status == LOBATTO_OK);
    for (std::size_t k = 0; k < 2; ++k) {
        CHECK(back.q[k] == doctest::Approx(q[k]).epsilon(1e-4));  // by shortened steps at the ends
        CHECK(back.p[k] == doctest::Approx(p[k]).epsilon(1e-4));
    }
}

TEST_CASE("arrivals are at their times, and leave the motion alone") {
    const std::string text = kepler(0.7, "points = 7\nclock = \"r\"", "step = 0.3\nuntil = 10");
    const Ended often = run(scene_of(text), 100), once = run(scene_of(text), 1);
    CHECK(often.result.time == 10);
    CHECK(often.result.chain_steps == once.result.chain_steps);
    CHECK(often.result.q == once.result.q);
    CHECK(often.result.p == once.result.p);

    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", text + "[output]\nevery = 0.4\n");
    REQUIRE(test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--quiet"}).exit_code ==
            0);
    const auto rows = test::read_trajectory(folder / "run.csv").rows;
    REQUIRE(rows.size() == 26);
    for (std::size_t i = 0; i < rows.size(); ++i) {
        CHECK(rows[i][0] == doctest::Approx(0.4 * static_cast<double>(i)).epsilon(1e-15));
        const std::vector<double> exact = ellipse(0.7, rows[i][0]);
        CHECK(std::fabs(rows[i][1] - exact[0]) < 1e-7);
        CHECK(std::fabs(rows[i][2] - exact[1]) < 1e-7);
    }
}

TEST_CASE("states at given times are as exact as the ends of steps") {
    const test::TemporaryFolder folder;
    for (const char* method : {"points = 9", "family = \"gauss\"\nstages = 8"}) {
        INFO(method);
        test::write_text(folder / "scene.toml", kepler(0.9, std::string(method) + "\nclock = \"auto\"",
                                                       "step = 0.022\nuntil = 13", "[output]\nevery = 0.03125\n"));
        REQUIRE(
            test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--quiet"}).exit_code ==
            0);
        const auto rows = test::read_trajectory(folder / "run.csv").rows;
        REQUIRE(rows.size() == 417);  // of 25 steps
        double worst = 0;
        for (const auto& row : rows) {
            const std::vector<double> exact = ellipse(0.9, row[0]);
            worst = std::fmax(worst, std::fmax(std::fabs(row[1] - exact[0]), std::fabs(row[2] - exact[1])));
        }
        CHECK(worst < 1e-9);
    }
}

TEST_CASE("a clock's masses change alike, for any number of bodies" * doctest::test_suite("slow")) {
    // Three coordinates of each of six bodies: more than a full matrix at every node is kept for.
    std::string text =
        "lagrangian = \"sum(i = 1 .. 6, m[i]*(x[i]'^2 + y[i]'^2 + z[i]'^2)/2) + sum(i = 1 .. 5, sum(j = i + 1 .. 6, "
        "m[i]*m[j]/sqrt((x[i] - x[j])^2 + (y[i] - y[j])^2 + (z[i] - z[j])^2)))\"\n[parameters]\n"
        "m = [1, 2, 3, 1, 2, 3]\n[coordinates]\nx = { position = [1, -2, 4, 0, 3, -3], velocity = 0 }\n"
        "y = { position = [3, -1, -1, 2, 5, -4], velocity = 0.1 }\n"
        "z = { position = [0, 1, -1, -3, 2, 2], velocity = 0 }\n[method]\npoints = 6\nclock = \"auto\"\n[run]\n"
        "step = 0.1\nuntil = 4\n";
    const Derivation derivation = derive(scene_of(text));
    CHECK(has_light_mass(derivation.scene, derivation.system, derivation.structure));
    const Ended ended = run(scene_of(text), 1);
    CHECK(ended.energy_error < 1e-9);
    // Fixed-point iterations: Newton's would be 2 or 3 a step.
    CHECK(ended.result.iterations > 5 * ended.result.chain_steps);
}

TEST_CASE("the clock auto knows the frequencies that are the same everywhere (D65)") {
    struct {
        const char* lagrangian;
        double quiet;  // omega^2 of all but the pole
    } const motions[] = {
        {"(x'^2 + y'^2)/2 + x*y' - y*x' + 3/2*x^2 + 1/sqrt(x^2 + y^2)", 2 * 2 + 3},  // Hill's problem
        {"3*(x'^2 + y'^2)/2 + 5*x*y' - 9*x^2/2 - 3*y^2 + 3/sqrt(x^2 + y^2)", 25.0 / 9 + 3 + 2},
        {"(x'^2 + y'^2)/2 + x*y^2 - y^4 + x^2*y*x' + 1/sqrt(x^2 + y^2)", 0},
    };
    for (const auto& motion : motions) {
        const std::string lagrangian = motion.lagrangian;
        const double quiet = motion.quiet;
        INFO(lagrangian);
        const Scene scene =
            scene_of(fmt::format("lagrangian = \"{}\"\n[coordinates]\nx = {{ position = 0.5, velocity = 0 }}\n"
                                 "y = {{ position = 0, velocity = 1 }}\n[method]\npoints = 8\nclock = \"auto\"\n"
                                 "[run]\nstep = 0.01\nuntil = 1\n",
                                 lagrangian));
        for (const double r : {0.5, 0.01, 2.0, 300.0}) {
            const GiNaC::ex there = automatic_clock(scene).subs(
                GiNaC::lst{scene.coordinates[0].position == 0, scene.coordinates[1].position == r});
            const double clock = scene.value_of(there).to_double();
            CHECK(clock == doctest::Approx(std::sqrt((8 + quiet) / (std::pow(r, -3) + quiet))).epsilon(1e-12));
        }
    }
}

TEST_CASE("a solution of a step that lies far away is not taken") {
    // A comet without mass beside a planet: the first step has a solution at t = 4e54.
    const test::TemporaryFolder folder;
    test::write_text(
        folder / "scene.toml",
        "lagrangian = \"sum(i = 1 .. 3, m[i]*(x[i]'^2 + y[i]'^2 + z[i]'^2)/2) + G*sum(i = 2 .. 3, sum(j = 1 .. "
        "i - 1, m[i]*m[j]/sqrt((x[i] - x[j])^2 + (y[i] - y[j])^2 + (z[i] - z[j])^2)))\"\n[coordinates]\n"
        "x = { position = [0, 5.2, 1], velocity = [0, 0, 0] }\n"
        "y = { position = [0, 0, 0], velocity = [0, 2.755, 8.28] }\n"
        "z = { position = [0, 0, 0.05], velocity = [0, 0, 0.1] }\n[parameters]\nG = 39.47841760435743\n"
        "m = [1, 9.54e-4, 1e-15]\n[method]\npoints = 9\nclock = \"auto\"\n[run]\nstep = 0.05\nuntil = 60\n");
    const test::Finished ended = test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv"});
    CHECK(ended.exit_code == 3);
    CHECK(test::contains(ended.err, "equal steps (--clock none)"));
    for (const auto& row : test::read_trajectory(folder / "run.csv").rows) CHECK(row[0] <= 60);
}

TEST_CASE("the clock auto follows escapes in a rotating frame") {
    // Hill's problem, away from the planet: with steps that grow like r^(3/2) the run stopped at t = 1.55.
    const Scene scene = scene_of(
        "lagrangian = \"(x'^2 + y'^2)/2 + x*y' - y*x' + 3/2*x^2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\n"
        "x = { position = 0.3, velocity = 0.1 }\ny = { position = 0, velocity = 2.6 }\n[method]\npoints = 9\n"
        "clock = \"auto\"\n[run]\nstep = 0.05\nuntil = 20\n");
    const Ended clocked = run(scene), equal = run(with_equal_steps(scene), 400);
    CHECK(clocked.energy_error < 1e-10);
    REQUIRE(clocked.result.time == equal.result.time);
    for (std::size_t k = 0; k < 2; ++k) CHECK(clocked.result.q[k] == doctest::Approx(equal.result.q[k]).epsilon(1e-10));
}

TEST_CASE("events of a motion with a clock happen at their physical times") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", kepler(0.9, "points = 9\nclock = \"r^(3/2)\"", "step = 0.7\nuntil = 40") +
                                                "[output]\nevents = [\"x*x' + y*y' = 0 rising\"]\n");
    REQUIRE(test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--quiet"}).exit_code ==
            0);
    const auto rows = test::read_trajectory(folder / "run.events.csv").rows;
    REQUIRE(rows.size() == 6);  // pericentres after the start
    for (std::size_t i = 0; i < rows.size(); ++i)
        CHECK(std::fabs(rows[i][1] - 2 * std::acos(-1) * static_cast<double>(i + 1)) < 1e-8);
}

TEST_CASE("sweeps of scenes with a clock measure their errors") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", kepler(0.5, "points = 8\nclock = \"r^(3/2)\"", "step = 0.6\nuntil = 50"));
    const test::Finished finished = test::run(
        {LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary", "e=0.3,0.9,0.97", "-o", folder / "sweep.csv"});
    INFO(finished.err);
    CHECK(finished.exit_code == 0);
    CHECK(finished.err.find("stability limit") == std::string::npos);  // h is 0.6 of the clock's time, not of t
}

TEST_CASE("a sweep with a clock compares all that comes before a stop, also where an event holds the time") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", "time = \"t\"\n" + kepler(0.5, "points = 10\nclock = \"auto\"",
                                                                      "step = 0.1\nuntil = 12\n"
                                                                      "stop = [\"t = 3.3\", \"x = -0.9 falling\"]"));
    for (const std::vector<std::string>& every : {{}, {"--every", "0.1"}, std::vector<std::string>{"--every", "0.5"}}) {
        std::vector<std::string> command{LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary",
                                         "e=0.3,0.5,0.6", "-o",    folder / "sweep.csv"};
        command.insert(command.end(), every.begin(), every.end());
        const test::Finished finished = test::run(command);
        INFO(finished.err);
        CHECK(finished.exit_code == 0);
        const auto rows = test::read_trajectory(folder / "sweep.csv").rows;
        CHECK(rows.back().back() < 1e-12);  // the error of the last trajectory
    }
}

TEST_CASE("an error at a stop is measured there, however many steps lead to it from the last comparison") {
    const test::TemporaryFolder folder;
    // 76,000 steps before the first comparison, at t = 10: more than one call of a kernel takes.
    test::write_text(folder / "scene.toml", kepler(0.5, "points = 4\nclock = \"r^(3/2)\"",
                                                   "step = 0.00005\nuntil = 610\nstop = \"y = -0.5 falling\""));
    const test::Finished one =
        test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--every", "10"});
    INFO(one.out << one.err);
    CHECK(one.exit_code == 0);
    CHECK(test::contains(one.out, "of the amplitude at the end"));
    const test::Finished many =
        test::run({LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary", "e=0.4,0.5", "-o", folder / "sweep.csv"});
    INFO(many.err);
    CHECK(many.exit_code == 0);
    for (const auto& row : test::read_trajectory(folder / "sweep.csv").rows) CHECK(row.back() < 1e-9);
}

TEST_CASE("means with a clock over parts of periods are those over the time, with a high order") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", kepler(0.6, "points = 8\nclock = \"r^(3/2)\"",
                                                   "step = 0.1\nuntil = 20\nstop = \"r = 1.5 rising\""));
    const auto largest_error = [&](const std::string& step) {
        const test::Finished finished =
            test::run({LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary", "e=0.6,0.9", "--keep",
                       "mean(r), mean(3 + 0*x)", "--step", step, "-o", folder / "sweep.csv"});
        INFO(finished.err);
        REQUIRE(finished.exit_code == 0);
        double worst = 0;
        for (const auto& row : test::read_trajectory(folder / "sweep.csv").rows) {
            const double e = row[1], u = std::acos(-0.5 / e);  // where r = 1 - e cos u is 1.5
            const double mean =
                (u * (1 + e * e / 2) - 2 * e * std::sin(u) + e * e / 4 * std::sin(2 * u)) / (u - e * std::sin(u));
            worst = std::fmax(worst, std::fabs(row[row.size() - 3] - mean));
            CHECK(std::fabs(row[row.size() - 2] - 3) < 1e-14);
        }
        return worst;
    };
    CHECK(largest_error("0.3") < 1e-3);    // 4e-4, of 3 steps and a part; 1.3e-2 by the trapezoidal rule alone
    CHECK(largest_error("0.1") < 1e-6);    // 1.2e-7; 1.5e-3
    CHECK(largest_error("0.01") < 1e-12);  // 5e-14; 1.5e-5
}

TEST_CASE("means over a motion with a clock are those over the time") {
    const test::TemporaryFolder folder;
    const double pi = std::acos(-1);
    test::write_text(folder / "scene.toml",
                     kepler(0.5, "points = 9\nclock = \"auto\"", "step = \"0.7*(1 - e)^(3/2)\"\nuntil = \"20*pi\""));
    const test::Finished finished =
        test::run({LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary", "e=0.3,0.5,0.6", "--keep",
                   "mean(x), mean(x^2 + y^2), mean(2 + 0*x)", "-o", folder / "sweep.csv"});
    INFO(finished.err);
    REQUIRE(finished.exit_code == 0);
    const test::TrajectoryTable table = test::read_trajectory(folder / "sweep.csv");
    REQUIRE(table.rows.size() == 3);
    for (const auto& row : table.rows) {  // index, e, status, steps, t, the means, the error
        const double e = row[1];
        CAPTURE(e);
        CHECK(std::fabs(row[4] - 20 * pi) < 1e-12);
        CHECK(std::fabs(row[5] + 3 * e / 2) < 1e-3);  // in t it is 1 to 2 %
        CHECK(std::fabs(row[6] - 1 - 3 * e * e / 2) < 1e-3);
        CHECK(std::fabs(row[7] - 2) < 1e-14);
    }
}

TEST_CASE("means with a clock count steps that end where states are asked for, and the clock is that of the kernel") {
    const test::TemporaryFolder folder;
    const auto means = [&](const std::string& text, std::vector<std::string> options) {
        test::write_text(folder / "scene.toml", text);
        options.insert(options.begin(), {LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary", "points=8",
                                         "--keep", "mean(y), mean(y^2)", "-o", folder / "sweep.csv"});
        const test::Finished finished = test::run(options);
        INFO(finished.err);
        REQUIRE(finished.exit_code == 0);
        return test::read_trajectory(folder / "sweep.csv").rows.at(0);  // index, points, status, steps, t, the means
    };
    // x rests, so that the clock is 1: each fourth step ends at a state that is asked for, or at none.
    for (const char* every : {"0.5", "0.53"}) {
        const auto row = means(
            "lagrangian = \"(x'^2 + y'^2)/2 - (4*pi*y)^2/2\"\n[coordinates]\nx = { position = 0, velocity = 0 }\n"
            "y = { position = 1, velocity = 0 }\n[method]\nclock = \"1 + x^2\"\n[run]\nstep = 0.125\nuntil = 8\n"
            "[output]\nevery = " +
                std::string(every) + "\n",
            {});
        CHECK(std::fabs(row[5]) < 1e-12);
        CHECK(std::fabs(row[6] - 0.5) < 1e-12);
    }
    const std::string two =
        "lagrangian = \"(x'^2 + y'^2)/2 + k/sqrt(x^2 + y^2) + 1/sqrt((x - 4)^2 + y^2)\"\n"
        "[coordinates]\nx = { position = 3, velocity = 0 }\ny = { position = 0, velocity = 0.7 }\n"
        "[parameters]\nk = 1\n[method]\nclock = \"auto\"\n[run]\nstep = 0.05\nuntil = 20\n";
    const auto with_clock = means(two, {"--set", "k=-0.3"}),
               without = means(two, {"--set", "k=-0.3", "--clock", "none", "--step", "0.002"});
    CHECK(std::fabs(with_clock[6] - without[6]) < 1e-4);  // 0.25293; with the clock of k = -0.3 it would be 0.2489
}

TEST_CASE("a row of a sweep with a clock is the end of a run, for any number of threads") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", kepler(0.5, "points = 8\nclock = \"r^(3/2)\"", "step = 0.6\nuntil = 50"));
    const auto table_of = [&](const std::string& threads) {
        const test::Finished finished =
            test::run({LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary", "e=0.3:0.9:19", "--every", "7", "-o",
                       folder / "sweep.csv", "--threads", threads});
        INFO(finished.err);
        REQUIRE(finished.exit_code == 0);
        return test::read_file(folder / "sweep.csv");
    };
    const std::string table = table_of("1");
    CHECK(table_of("2") == table);
    int compared = 0;
    for (const std::string e : {"0.3", "0.6", "0.9"}) {
        REQUIRE(test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "--set", "e=" + e, "-o", folder / "run.csv",
                           "--quiet"})
                    .exit_code == 0);
        const std::vector<double> end = test::read_trajectory(folder / "run.csv").rows.back();
        std::istringstream lines(table);
        for (std::string line; std::getline(lines, line);) {
            std::istringstream fields(line);
            std::vector<std::string> row;
            for (std::string field; std::getline(fields, field, ',');) row.push_back(field);
            // trajectory, e, status, steps, t, x, y, p_x, p_y, ...
            if (row.size() < 9 || row[4] != "50" || std::fabs(std::stod(row[1]) - std::stod(e)) > 1e-15) continue;
            ++compared;
            for (std::size_t k = 0; k < 4; ++k) CHECK(std::fabs(std::stod(row[5 + k]) - end[1 + k]) < 1e-11);
        }
    }
    CHECK(compared == 3);
}

TEST_CASE("a clock that does not stay positive ends the run, and says so") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml",
                     "lagrangian = \"x'^2/2 - x^2/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n[method]\n"
                     "points = 6\nclock = \"x\"\n[run]\nstep = 0.1\nuntil = 10\n");
    const test::Finished finished =
        test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--quiet"});
    INFO(finished.err);
    CHECK(finished.exit_code == 3);
    const auto rows = test::read_trajectory(folder / "run.csv").rows;
    REQUIRE(!rows.empty());
    for (const auto& row : rows) CHECK(std::fabs(row[1] - std::cos(row[0])) < 1e-6);  // what was computed is right
}

TEST_CASE("a motion that rounding or the step would throw back where the clock is 0 ends there, alone and in a sweep" *
          doctest::test_suite("slow")) {
    // x = cos t comes to every one of these places, however the steps are.
    const auto text = [](const std::string& clock, double step) {
        return fmt::format(
            "lagrangian = \"x'^2/2 + y'^2/2 - x^2/2 - 2*b*y^2\"\n[coordinates]\nx = {{ position = 1, velocity = 0 }}\n"
            "y = {{ position = 0.3, velocity = 0.4 }}\n[parameters]\nb = 0.5\n[method]\npoints = 5\n"
            "clock = \"{}\"\n[run]\nstep = {}\nuntil = 20\n",
            clock, step);
    };
    const test::TemporaryFolder folder;
    const auto finished = [&](const std::string& clock, double step) {
        test::write_text(folder / "scene.toml", text(clock, step));
        return test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--quiet"});
    };
    for (const std::string clock : {"x + b", "x + 0.999", "log(x + 1.5)", "y", "x^2"})
        for (const double step : {0.1, 0.31}) {
            const test::Finished ended = finished(clock, step);
            INFO(clock << ", " << step << ": " << ended.err);
            CHECK(ended.exit_code == 3);
            CHECK(ended.err.find("the clock comes to 0 along the step, or so near to it that time stands still or the "
                                 "energy is lost") != std::string::npos);
            double worst = 0;  // what was computed is right
            for (const auto& row : test::read_trajectory(folder / "run.csv").rows)
                worst = std::fmax(worst, std::fabs(row[1] - std::cos(row[0])));
            CHECK(worst < 1e-4);
        }
    // The place is that of the clock's last step, also where few states are kept.
    finished("x^2", 0.1);
    const test::Finished rarely = test::run(
        {LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--quiet", "--every", "1.5"});
    CHECK(rarely.exit_code == 3);
    CHECK_MESSAGE(rarely.err.find("after t = 1.5707") != std::string::npos, rarely.err);
    // Slower than with x^2: time passes like the cubic root of 1 over the steps.
    CHECK(test::contains(finished("x^4", 0.1).err, "time stands still"));
    // Clocks that become small, and stay above 0.
    for (const std::string clock : {"x^2 + 1e-6", "x + 1.001"}) {
        INFO(clock);
        CHECK(finished(clock, 0.1).exit_code == 0);
        CHECK(std::fabs(test::read_trajectory(folder / "run.csv").rows.back()[1] - std::cos(20)) < 1e-4);
    }
    test::write_text(folder / "scene.toml", text("x + b", 0.1));
    const test::Finished swept = test::run({LOBATTO_PROGRAM, "sweep", folder / "scene.toml", "--vary",
                                            "b=2,0.5,1.5,0.9", "-o", folder / "table.csv", "--quiet"});
    CHECK(swept.exit_code == 3);
    CHECK(swept.err.find("2 of 4 trajectories failed: 2 t + h equals t or the clock is 0.") != std::string::npos);
}

TEST_CASE("many small steps on the way to a near passage are not taken for a clock that comes to 0") {
    // From doubling to doubling of 65,536 steps the time passed is 135, 66, 57, 34, and 44 after the passage at r
    // = 7.07.
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml",
                     "lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\n"
                     "x = { position = -100, velocity = 0.3 }\ny = { position = 14, velocity = 0 }\n[method]\n"
                     "points = 3\nclock = \"auto\"\n[run]\nstep = 0.003\nuntil = 1000\n[output]\nevery = 500\n");
    const test::Finished done =
        test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--quiet", "--unmeasured"});
    CHECK_MESSAGE(done.exit_code == 0, done.err);
}

TEST_CASE("a clock that runs away with an escaping motion is told, and one that grows less goes on") {
    const test::TemporaryFolder folder;
    const auto run = [&](const std::string& clock) {
        test::write_text(
            folder / "scene.toml",
            "lagrangian = \"(x'^2 + y'^2)/2 + 1/r\"\ndefinitions = { r = \"sqrt(x^2 + y^2)\" }\n[coordinates]\n"
            "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 2 }\n[method]\npoints = 9\n"
            "clock = \"" +
                clock + "\"\n[run]\nstep = 0.3\nuntil = 1000\n");
        return test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--quiet"});
    };
    const test::Finished away = run("auto");
    CHECK(away.exit_code == 3);
    CHECK(away.err.find("It escapes, and the steps grow beyond all bounds. Try an earlier end") != std::string::npos);
    const test::Finished slower = run("r^(3/2)/(1 + sqrt(r))");
    CHECK(slower.exit_code == 0);
    CHECK(slower.err.empty());
}

TEST_CASE("an event of what the motion conserves does not end it") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml",
                     "lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\n"
                     "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 0.1 }\n"
                     "[output]\nevents = [\"x*y' - y*x' = 0.1\"]\n[method]\npoints = 9\nclock = \"auto\"\n"
                     "[run]\nstep = 0.1\nuntil = 20\n");
    const test::Finished done =
        test::run({LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--quiet"});
    CHECK_MESSAGE(done.exit_code == 0, done.err);
}

TEST_CASE("a motion with a clock that fails tells the last state of its file") {
    const test::TemporaryFolder folder;
    for (const double step : {0.05, 0.1}) {
        test::write_text(folder / "scene.toml",
                         kepler(0.9, "points = 8\nclock = \"auto\"", fmt::format("step = {}\nuntil = 62.83", step)));
        const test::Finished done = test::run(
            {LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--quiet", "--unmeasured"});
        CHECK(done.exit_code == 3);
        const std::vector<double> last = test::read_trajectory(folder / "run.csv").rows.back();
        INFO(done.err);
        CHECK(done.err.find(fmt::format("after t = {:.6g}, from q = ({:.6g}, {:.6g})", last[0], last[1], last[2])) !=
              std::string::npos);
    }
}

TEST_CASE("an automatic clock follows the poles of the Lagrangian") {
    const auto clock_of = [](const std::string& lagrangian) {
        const Scene scene =
            scene_of("lagrangian = \"" + lagrangian +
                     "\"\n[coordinates]\nx = { position = 2, velocity = 0 }\n"
                     "y = { position = 0, velocity = 1 }\n[method]\nclock = \"auto\"\n[run]\nstep = 0.1\n"
                     "until = 1\n");
        const Scene transformed = in_clock_time(scene);
        GiNaC::exmap place{{transformed.coordinates[0].position, 8}, {transformed.coordinates[1].position, 0}};
        return transformed.evaluate(transformed.clock->rate.subs(place), "the clock").to_double();
    };
    // g = 1 at r = 2; at r = 8 the powers of 4.
    CHECK(std::fabs(clock_of("(x'^2 + y'^2)/2 + 2/sqrt(x^2 + y^2)") - 8) < 1e-14);          // r^(3/2)
    CHECK(std::fabs(clock_of("(x'^2 + y'^2)/2 - 2/(x^2 + y^2) - x^3") - 16) < 1e-13);       // r^2
    CHECK(std::fabs(clock_of("(x'^2 + y'^2)/2 - 2*(x^2 + y^2)^(-1) - x^4") - 16) < 1e-13);  // as before
    CHECK(std::fabs(clock_of("(1 + 1/x^2)*(x'^2 + y'^2)/2 + 3/x + 1/sqrt(x^2 + y^2)") - 8) <
          1e-14);  // masses do not count
    // Numerators that are 0 at the start, or become negative: r^-2 and r^-3 in their places.
    CHECK(std::fabs(clock_of("(x'^2 + y'^2)/2 + x*y/(x^2 + y^2)^2") - 16) < 1e-13);
    CHECK(std::fabs(clock_of("(x'^2 + y'^2)/2 - 3*cos(y)*(x^2 - y^2)/sqrt(x^2 + y^2)^5") - 32) < 1e-13);
    CHECK(std::fabs(clock_of("(x'^2 + y'^2)/2 - (1 + x^2)/(x^2 + y^2)") - 16) < 1e-13);
    CHECK_THROWS_WITH_AS(clock_of("(x'^2 + y'^2)/2 - x^2/(x^2 + y^2)"), doctest::Contains("and there is none"),
                         InputError);
    CHECK_THROWS_WITH_AS(clock_of("(x'^2 + y'^2)/2 - x^2/2"), doctest::Contains("and there is none; write a formula"),
                         InputError);
}

TEST_CASE("an automatic clock follows encounters with light bodies, which the potential hardly knows") {
    // In the restricted problem of mass ratio 0.001 a body falls past the planet, within 0.02.
    const std::string text =
        "lagrangian = \"(x'^2 + y'^2)/2 + (1 - mu)/sqrt(x^2 + y^2) + mu/sqrt((x - 1)^2 + y^2)\"\n[coordinates]\n"
        "x = { position = 1.3, velocity = -0.1 }\ny = { position = 0.02, velocity = 0 }\n[parameters]\nmu = 0.001\n"
        "[method]\npoints = 9\nclock = \"auto\"\n[run]\nstep = 0.15\nuntil = 1.2\n";
    const Ended ended = run(scene_of(text));
    CHECK(ended.energy_error < 1e-9);
    std::string by_potential = text;
    by_potential.replace(text.find("\"auto\""), 6, "\"((1 - mu)/sqrt(x^2 + y^2) + mu/sqrt((x - 1)^2 + y^2))^(-3/2)\"");
    CHECK(run(scene_of(by_potential)).energy_error > 1e3 * ended.energy_error);
    // Three equal bodies have the shorter formula; exact numbers of many digits do not grow in it.
    const Scene outer = read_scene(LOBATTO_SOURCE_DIR "/scenes/outer_solar_system.toml");
    CHECK(emit(derive(with_automatic_clock(outer))).header.find("clocked = true") != std::string::npos);
}

TEST_CASE("the last part of a step that runs far out is measured, too") {
    const test::TemporaryFolder folder;
    const std::string path = folder / "scene.toml";
    test::write_text(path,
                     "lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\nx = { position = 1, "
                     "velocity = 0 }\ny = { position = 0, velocity = \"sqrt(3)\" }\n[method]\npoints = 9\nclock = "
                     "\"auto\"\n[run]\nstep = 0.3\nuntil = 150\n");
    const test::Finished finished = test::run({LOBATTO_PROGRAM, "run", path, "-o", folder / "run.csv", "--json"});
    REQUIRE(finished.exit_code == 0);
    const double printed = nlohmann::json::parse(finished.out).at("measured_error").at("at_end");
    // From the hyperbola: r = e cosh(u) - 1, t = e sinh(u) - u for e = 2.
    double u = 5;
    for (int i = 0; i < 100; ++i) u -= (2 * std::sinh(u) - u - 150) / (2 * std::cosh(u) - 1);
    const std::vector<double> end = test::read_trajectory(folder / "run.csv").rows.back();
    const double truth =
        std::hypot(end[1] - (2 - std::cosh(u)), end[2] - std::sqrt(3.0) * std::sinh(u)) / std::sqrt(3.0) / std::sinh(u);
    CHECK(printed > truth / 4);
    CHECK(printed < truth * 4);
}

TEST_CASE("a run with a clock that leaves its energy stops there, and says so") {
    const test::TemporaryFolder folder;
    const std::string path = folder / "scene.toml";
    test::write_text(path,
                     "lagrangian = \"(x'^2 + y'^2)/2 + x*y' - y*x' + (x^2 + y^2)/2 + U\"\n[definitions]\n"
                     "U = \"(1 - mu)/sqrt((x + mu)^2 + y^2) + mu/sqrt((x - 1 + mu)^2 + y^2)\"\n[coordinates]\n"
                     "x = { position = 0.5, velocity = 0 }\n"
                     "y = { position = 0, velocity = \"sqrt(2*((1 - mu)/(0.5 + mu) + mu/(0.5 - mu)) + 0.25 - C)\" }\n"
                     "[parameters]\nmu = 0.01215\nC = 2.887179487179487\n[method]\npoints = 10\n"
                     "clock = \"U^(-3/2)\"\n[run]\nstep = 0.57\nuntil = 50\n");
    const test::Finished finished = test::run({LOBATTO_PROGRAM, "run", path, "-o", folder / "run.csv"});
    CHECK(finished.exit_code == 3);
    CHECK(test::contains(finished.err, "the energy is lost"));
}

TEST_CASE("what has no clock says so") {
    const std::string good = kepler(0.5, "clock = \"r\"", "step = 0.1\nuntil = 1");
    CHECK(refusal(good) == "accepted");
    CHECK(refusal(kepler(0.5, "clock = \"x'^2\"", "step = 0.1\nuntil = 1")) ==
          "clock.toml:10:9: a clock is a formula of positions, parameters and the time, such as \"sqrt(x^2 + y^2)\"");
    CHECK(refusal(kepler(0.5, "clock = \"2*e\"", "step = 0.1\nuntil = 1")) ==
          "clock.toml:10:9: this clock holds no position and no time, so that all its steps are equal; leave it out");
    CHECK(refusal(kepler(0.5, "clock = \"2 + 0*x\"", "step = 0.1\nuntil = 1")) ==
          "clock.toml:10:9: this clock holds no position and no time, so that all its steps are equal; leave it out");
    CHECK(refusal(kepler(0.5, "clock = \"-r\"", "step = 0.1\nuntil = 1")) ==
          "clock.toml:10:9: the clock is -0.5 at the start; it must be positive wherever the motion goes");
    for (const char* pole : {"1/y", "log(y)", "1/(x - 1)"})
        CHECK(refusal(kepler(0, fmt::format("clock = \"{}\"", pole), "step = 0.1\nuntil = 1")) ==
              "clock.toml:10:9: the clock, or the Lagrangian, has no finite real value at the start; "
              "start elsewhere, or mend the formula");
    CHECK(refusal(kepler(0.5, "clock = \"r\"\nfamily = \"splitting\"", "step = 0.1\nuntil = 1")) ==
          "clock.toml: splitting methods have no clock; choose Lobatto or Gauss (--points 8)");
    CHECK(refusal(kepler(0.5, "clock = \"r\"\narithmetic = \"clean\"", "step = 0.1\nuntil = 1")) ==
          "clock.toml: clean arithmetic has no clock; choose Lobatto or Gauss (--points 8) and --arithmetic plain");
    const test::TemporaryFolder folder;
    test::write_text(folder / "scene.toml", good);
    for (const std::string command : {"stability", "roundoff"}) {
        INFO(command);
        const test::Finished finished = test::run({LOBATTO_PROGRAM, command, folder / "scene.toml"});
        CHECK(finished.exit_code == 2);
        CHECK(finished.err.find("lobatto " + command + " takes steps that are equal in time") != std::string::npos);
    }
}
