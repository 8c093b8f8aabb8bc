// SPDX-License-Identifier: GPL-2.0-or-later
// Motions with constraints: against steps written by hand, the same systems in minimal coordinates, and their promises.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "analysis/exact_start.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "generator/mechanics/start.hpp"
#include "generator/pipeline.hpp"
#include "runtime/measure/frequency.hpp"
#include "runtime/measure/manifold.hpp"
#include "runtime/measure/symmetry.hpp"
#include "runtime/run/trajectory.hpp"
#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;

namespace {

Scene scene_of(const std::string& text) {
    return read_scene(Source("mechanism.toml", text));
}

// [method] and [run] of a scene.
std::string method(int points, double step, double until, const std::string& more = "") {
    return fmt::format("[method]\npoints = {}\n[run]\nstep = {:.17g}\nuntil = {:.17g}\n{}", points, step, until, more);
}

const std::string rod =
    "lagrangian = \"m*(x'^2 + y'^2)/2 - m*g*y\"\n[coordinates]\nx = { position = 0.6, velocity = 0.4 }\n"
    "y = { position = -0.8, velocity = 0.3 }\n[constraints]\nrod = \"x^2 + y^2 = l^2\"\n[parameters]\nm = 2\n"
    "g = 1.5\nl = 1\n";

const std::string two_rods =
    "lagrangian = \"sum(i = 1 .. 2, (x[i]'^2 + y[i]'^2)/2 - y[i])\"\n[definitions]\nX1 = \"x[1]\"\n"
    "[coordinates]\nx = { position = [\"sin(1)\", \"sin(1) + sin(2)\"], velocity = 0 }\n"
    "y = { position = [\"-cos(1)\", \"-cos(1) - cos(2)\"], velocity = 0 }\n"
    "[constraints]\nfirst = \"X1^2 + y[1]^2 = 1\"\nsecond = \"(x[2] - x[1])^2 + (y[2] - y[1])^2 = 1\"\n";
const std::string two_angles =
    "lagrangian = \"(x1'^2 + y1'^2 + x2'^2 + y2'^2)/2 - y1 - y2\"\n[definitions]\nx1 = \"sin(a)\"\ny1 = \"-cos(a)\"\n"
    "x2 = \"x1 + sin(b)\"\ny2 = \"y1 - cos(b)\"\n[coordinates]\na = { position = 1, velocity = 0 }\n"
    "b = { position = 2, velocity = 0 }\n";

struct Ended {
    TrajectoryRequest request;
    TrajectoryResult result;
};
Ended run(const Scene& scene) {
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    Ended ended{request_of(scene, steps_of(scene, {}).count, stepper), {}};
    ended.result = integrate(kernel, ended.request);
    REQUIRE(ended.result.status == LOBATTO_OK);
    return ended;
}
std::vector<double> end_state(const Scene& scene) {
    return run(scene).result.q;
}

double apart(const std::vector<double>& a, const std::vector<double>& b) {
    double most = 0;
    for (std::size_t k = 0; k < a.size(); ++k) most = std::fmax(most, std::fabs(a[k] - b[k]));
    return most;
}

// The order that the errors of steps h and h/2 show.
double order_of(const std::string& system, int points, double step, double until, const std::vector<double>& exact) {
    const double coarse = apart(end_state(scene_of(system + method(points, step, until))), exact),
                 fine = apart(end_state(scene_of(system + method(points, step / 2, until))), exact);
    CAPTURE(coarse);
    CAPTURE(fine);
    return std::log2(coarse / fine);
}

QuadrupleStart quadruple_start(const Scene& scene, const Kernel& kernel, __float128 step) {
    const StartIn<__float128> start = start_in<__float128>(ExactStart(scene), kernel, step);
    return {start.parameters, start.q, start.p};
}

// Its hook is not eliminated.
std::string kept_rod_loop() {
    return test::read_file(LOBATTO_SOURCE_DIR "/scenes/rod_loop.toml") + "[output]\nmultipliers = true\n";
}

std::string refusal(const std::string& text) {
    try {
        const Scene scene = scene_of(text);
        emit(derive(scene));
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

}  // namespace

TEST_CASE("two points are RATTLE, written by hand") {
    // A point of mass 2 on a rod of length 1 under gravity 1.5, 40 steps of 0.05.
    const double m = 2, g = 1.5, h = 0.05;
    double x = 0.6, y = -0.8, px = m * 0.4, py = m * 0.3;
    for (int step = 0; step < 40; ++step) {
        const double free_px = px, free_py = py - h / 2 * m * g;
        double lambda = 0, x1 = 0, y1 = 0;
        for (int i = 0; i < 30; ++i) {  // x1^2 + y1^2 = 1
            x1 = x + h / m * (free_px + h / 2 * 2 * x * lambda);
            y1 = y + h / m * (free_py + h / 2 * 2 * y * lambda);
            const double slope = 2 * x1 * h * h / m * x + 2 * y1 * h * h / m * y;
            lambda -= (x1 * x1 + y1 * y1 - 1) / slope;
        }
        const double half_px = free_px + h * x * lambda, half_py = free_py + h * y * lambda - h / 2 * m * g;
        const double mu = -(x1 * half_px + y1 * half_py) / (x1 * x1 + y1 * y1);
        x = x1, y = y1;
        px = half_px + mu * x1;
        py = half_py + mu * y1;
    }
    const Ended ended = run(scene_of(rod + method(2, h, 40 * h)));
    CHECK(apart(ended.result.q, {x, y}) < 1e-13);
    CHECK(apart(ended.result.p, {px, py}) < 1e-13);
}

TEST_CASE("a double pendulum of rods moves like the one in angles, with order 2s - 2" * doctest::test_suite("slow")) {
    const std::vector<double> angles = end_state(scene_of(two_angles + method(10, 0.02, 2)));
    const double a = angles[0], b = angles[1];
    const std::vector<double> exact{std::sin(a), std::sin(a) + std::sin(b), -std::cos(a), -std::cos(a) - std::cos(b)};
    CHECK(order_of(two_rods, 2, 0.02, 2, exact) == doctest::Approx(2).epsilon(0.05));
    CHECK(order_of(two_rods, 3, 0.05, 2, exact) == doctest::Approx(4).epsilon(0.05));
    CHECK(order_of(two_rods, 4, 0.1, 2, exact) == doctest::Approx(6).epsilon(0.06));
    CHECK(order_of(two_rods, 5, 0.1, 2, exact) == doctest::Approx(8).epsilon(0.1));
    CHECK(apart(end_state(scene_of(two_rods + method(8, 0.05, 2))), exact) < 1e-13);
}

TEST_CASE("constraints and their rates stay at rounding") {
    const Scene scene = scene_of(two_rods + method(4, 0.1, 5000));
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    TrajectoryRequest request = request_of(scene, 50000, stepper);
    double position = 0, rate = 0;
    std::vector<double> phi, phi_t, G, v;
    request.every = 100;
    request.sink = [&](const Records& records) {
        for (std::int64_t i = 0; i < records.count; ++i) {
            const double* const row = records.rows + i * records.columns + 1;
            const std::vector<double> q(row, row + 4), p(row + 4, row + 8);
            stepper.constraint(0, q, phi, phi_t, G);
            for (std::size_t c = 0; c < 2; ++c) {
                position = std::fmax(position, std::fabs(phi[c]));
                double sum = 0;  // of unit masses
                for (std::size_t k = 0; k < 4; ++k) sum += G[c * 4 + k] * p[k];
                rate = std::fmax(rate, std::fabs(sum));
            }
        }
    };
    CHECK(integrate(kernel, request).status == LOBATTO_OK);
    CHECK(position < 4e-15);
    CHECK(rate < 2e-14);
}

TEST_CASE("a momentum has a velocity where the equations of a fixed coordinate hold nothing but rounding") {
    const Scene scene = scene_of(kept_rod_loop());
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    REQUIRE(stepper.prepare(request_of(scene, 1, stepper).parameters, 0.01) == LOBATTO_OK);
    // A state on the way of this loop. Its hook is bead 8.
    const std::vector<double> q = {
        0.051932063865913321, 0.065785376886248942, 0.40211752502883585,   0.72150663081053057,
        0.57440689071034434,  0.27546125107591318,  -0.054069377703447823, -1.2036643980237283e-18,
        0.15598573467572582,  -0.34382231419739973, -0.71379621344678312,  -1.0984916762585628,
        -0.6206196573429773,  -0.21983105403250297, 0.15621357722325496,   0.65328148243818818};
    const std::vector<double> p = {
        -0.24231522816742462, 0.024306173568027539,  -0.23147255028746519,   0.20229888496050599,
        0.27356600031769857,  -0.1785592040234982,   0.049872411767204999,   -5.9484427969065921e-35,
        -0.02530472050383362, -0.017914703987514016, -0.2504354515808479,    0.109698431477909,
        0.13163605019541103,  -0.20560122973273967,  -0.0054249534933398687, 4.622511302427481e-33};
    std::vector<double> v;
    REQUIRE(stepper.velocity(86.04, q, p, v) == LOBATTO_OK);
    for (std::size_t k = 0; k < p.size(); ++k) CHECK(std::fabs(v[k] * 0.1 - p[k]) < 1e-15);  // m = 0.1
}

TEST_CASE("a coordinate that a constraint holds at 0 stops no run") {
    std::string text = kept_rod_loop();
    const auto replace = [&](const std::string& from, const std::string& to) {
        REQUIRE(test::contains(text, from));
        text.replace(text.find(from), from.size(), to);
    };
    replace("9.80665", "9.80665003");
    replace("until = 2", "until = 10");
    CHECK(run(scene_of(text)).result.steps_done == 1000);
}

TEST_CASE("no frequency is told of equations without the pull of the constraints") {
    const Scene scene = scene_of(rod + method(4, 0.1, 1));
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    const TrajectoryRequest request = request_of(scene, 1, stepper);
    CHECK(largest_frequency<double>(stepper, 0, request.q, request.p, {1, 1, 1, 1}) == 0);
}

TEST_CASE("fixed-point iteration with constraints finds the steps that Newton's finds") {
    // A velocity that the Lagrangian holds with the factor 0 of a parameter makes the form that Newton's iteration
    // solves.
    const std::string how = method(6, 0.05, 2);
    const Scene by_iteration = scene_of(two_rods + how);
    std::string text = two_rods;
    text.replace(text.find("- y[i])"), 7, "- y[i] + none*x[i]'*x[i]^2*y[i]'*y[i]*0.5)");
    const Scene by_newton = scene_of(text + "[parameters]\nnone = 0\n" + how);
    REQUIRE(build_system(by_iteration).constant_mass);
    REQUIRE(!build_system(by_newton).constant_mass);
    const Ended one = run(by_iteration), other = run(by_newton);
    CHECK(apart(one.result.q, other.result.q) < 1e-13);
    CHECK(apart(one.result.p, other.result.p) < 1e-13);
    CHECK(one.result.iterations > 3 * one.result.steps_done);  // evaluations, more than Newton's of the other
    CHECK(other.result.iterations <= 3 * other.result.steps_done);
}

TEST_CASE("a constraint that moves: a pendulum whose pivot is shaken" * doctest::test_suite("slow")) {
    const std::string shaken =
        "time = \"t\"\nlagrangian = \"(x'^2 + y'^2)/2 - y\"\n[coordinates]\nx = { position = 0, velocity = 0.9 }\n"
        "y = { position = -1, velocity = 0 }\n[constraints]\nrod = \"(x - 0.3*sin(3*t))^2 + y^2 = 1\"\n";
    const std::string angle =
        "time = \"t\"\nlagrangian = \"(x'^2 + y'^2)/2 - y\"\n[definitions]\nx = \"0.3*sin(3*t) + sin(a)\"\n"
        "y = \"-cos(a)\"\n[coordinates]\na = { position = 0, velocity = 0 }\n";
    const double a = end_state(scene_of(angle + method(10, 0.02, 3)))[0];
    const std::vector<double> exact{0.3 * std::sin(9.0) + std::sin(a), -std::cos(a)};
    CHECK(order_of(shaken, 3, 0.05, 3, exact) == doctest::Approx(4).epsilon(0.06));
    CHECK(order_of(shaken, 4, 0.1, 3, exact) == doctest::Approx(6).epsilon(0.08));
    CHECK(apart(end_state(scene_of(shaken + method(8, 0.05, 3))), exact) < 1e-13);
}

TEST_CASE("a dead point that is met exactly ends the run, and all that is kept is on the constraints" *
          doctest::test_suite("slowest")) {
    // A parallelogram whose cranks turn with the velocity 1: after a time of s all four bars lie on one line, and
    // multipliers grow beyond what their rounding lets corrections change.
    const std::string bars =
        "lagrangian = \"MASS*(x1'^2 + y1'^2)/2 + (x2'^2 + y2'^2)/2\"\n[parameters]\ns = {}\n[coordinates]\n"
        "x1 = {{ position = \"cos(s)\", velocity = \"sin(s)\" }}\ny1 = {{ position = \"sin(s)\", velocity = "
        "\"-cos(s)\" "
        "}}\nx2 = {{ position = \"2 + cos(s)\", velocity = \"sin(s)\" }}\ny2 = {{ position = \"sin(s)\", velocity = "
        "\"-cos(s)\" }}\n[constraints]\na = \"x1^2 + y1^2 = 1\"\nb = \"(x2 - 2)^2 + y2^2 = 1\"\n"
        "c = \"(x2 - x1)^2 + (y2 - y1)^2 = 4\"\n";
    for (const std::string mass : {"1", "(1 + y1^2)"}) {  // by fixed-point iteration, by Newton's
        std::string text = bars;
        text.replace(text.find("MASS"), 4, mass);
        for (const double s : {0.2, 0.3, 0.5, 0.7, 0.9}) {
            CAPTURE(mass);
            CAPTURE(s);
            const Scene scene = scene_of(fmt::format(fmt::runtime(text), s) + method(4, 0.1, 10));
            const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
            LoadedStepper<double> stepper(kernel);
            TrajectoryRequest request = request_of(scene, 100, stepper);
            double off = 0;
            std::vector<double> phi, phi_t, G;
            request.sink = [&](const Records& records) {
                for (std::int64_t i = 0; i < records.count; ++i) {
                    const double* const row = records.rows + i * records.columns + 1;
                    stepper.constraint(0, {row, row + 4}, phi, phi_t, G);
                    for (const double value : phi) off = std::fmax(off, std::fabs(value));
                }
            };
            const TrajectoryResult result = integrate(kernel, request);
            // Newton's iteration may find a way through, on the constraints.
            if (mass == "1") CHECK(result.status == LOBATTO_SINGULAR_JACOBIAN);
            if (mass == "1") CHECK(result.time == doctest::Approx(s));
            CHECK(off < 1e-13);
        }
    }
}

TEST_CASE("a charge on a sphere in a magnetic field, with friction: any Lagrangian may be constrained" *
          doctest::test_suite("slow")) {
    const std::string sphere =
        "lagrangian = \"(1 + z^2)*(x'^2 + y'^2 + z'^2)/2 + 0.7*(x*y' - y*x')/2 - z\"\n[coordinates]\n"
        "x = { position = \"sin(1)\", velocity = 0 }\ny = { position = 0, velocity = \"sin(1)\" }\n"
        "z = { position = \"cos(1)\", velocity = 0 }\n[forces]\nx = \"-0.2*x'\"\ny = \"-0.2*y'\"\nz = \"-0.2*z'\"\n"
        "[constraints]\nball = \"x^2 + y^2 + z^2 = 1\"\n";
    const std::string angles =
        "lagrangian = \"(1 + z^2)*(x'^2 + y'^2 + z'^2)/2 + 0.7*(x*y' - y*x')/2 - z\"\n[definitions]\n"
        "x = \"sin(a)*cos(b)\"\ny = \"sin(a)*sin(b)\"\nz = \"cos(a)\"\n[coordinates]\n"
        "a = { position = 1, velocity = 0 }\nb = { position = 0, velocity = 1 }\n[forces]\na = \"-0.2*a'\"\n"
        "b = \"-0.2*sin(a)^2*b'\"\n";
    const std::vector<double> end = end_state(scene_of(angles + method(10, 0.02, 2)));
    const std::vector<double> exact{std::sin(end[0]) * std::cos(end[1]), std::sin(end[0]) * std::sin(end[1]),
                                    std::cos(end[0])};
    CHECK(order_of(sphere, 3, 0.1, 2, exact) == doctest::Approx(4).epsilon(0.08));
    CHECK(order_of(sphere, 4, 0.2, 2, exact) == doctest::Approx(6).epsilon(0.1));
    CHECK(apart(end_state(scene_of(sphere + method(8, 0.05, 2))), exact) < 1e-12);
}

namespace {

// A rigid body's quaternion, whose mass matrix is singular along it.
const std::string body =
    "lagrangian = \"(w1^2 + 2*w2^2 + 3*w3^2)/2\"\n[coordinates]\nq0 = { position = 1, velocity = 0 }\n"
    "q1 = { position = 0, velocity = 0.15 }\nq2 = { position = 0, velocity = 1 }\n"
    "q3 = { position = 0, velocity = 0.05 }\n[definitions]\nw1 = \"2*(-q1*q0' + q0*q1' + q3*q2' - q2*q3')\"\n"
    "w2 = \"2*(-q2*q0' - q3*q1' + q0*q2' + q1*q3')\"\nw3 = \"2*(-q3*q0' + q2*q1' - q1*q2' + q0*q3')\"\n"
    "[constraints]\nunit = \"q0^2 + q1^2 + q2^2 + q3^2 = 1\"\n";

}  // namespace

TEST_CASE("a free body in a quaternion turns as Euler's equations say") {
    // w' = J^-1 (J w x w), q' = q w / 2, by Runge and Kutta's classical steps.
    using State = std::array<double, 7>;
    const auto rate = [](const State& s) {
        const double w1 = s[4], w2 = s[5], w3 = s[6];
        return State{(-s[1] * w1 - s[2] * w2 - s[3] * w3) / 2,
                     (s[0] * w1 + s[2] * w3 - s[3] * w2) / 2,
                     (s[0] * w2 + s[3] * w1 - s[1] * w3) / 2,
                     (s[0] * w3 + s[1] * w2 - s[2] * w1) / 2,
                     (2 - 3) * w2 * w3 / 1,
                     (3 - 1) * w3 * w1 / 2,
                     (1 - 2) * w1 * w2 / 3};
    };
    State s{1, 0, 0, 0, 0.3, 2, 0.1};
    const int steps = 6000;
    const double h = 3.0 / steps;
    const auto moved = [](const State& from, const State& by, double length) {
        State to = from;
        for (std::size_t i = 0; i < to.size(); ++i) to[i] += length * by[i];
        return to;
    };
    for (int i = 0; i < steps; ++i) {
        const State k1 = rate(s), k2 = rate(moved(s, k1, h / 2)), k3 = rate(moved(s, k2, h / 2)),
                    k4 = rate(moved(s, k3, h));
        for (std::size_t j = 0; j < s.size(); ++j) s[j] += h / 6 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j]);
    }
    const std::vector<double> exact(s.begin(), s.begin() + 4);
    CHECK(apart(end_state(scene_of(body + method(6, 0.05, 3))), exact) < 1e-12);
    CHECK(order_of(body, 3, 0.1, 3, exact) == doctest::Approx(4).epsilon(0.06));
}

TEST_CASE("a coordinate that a constraint holds at 0 is at rest, whatever pulls at it" * doctest::test_suite("slow")) {
    // Rounding of its equations leaves 1e-66 or so there: neither increments nor errors are measured by that. A run
    // with g = 1000 stopped as infinite in its first step, one with g = 7 as beyond its horizon.
    const test::TemporaryFolder folder;
    const std::string scene = folder / "plane.toml", file = folder / "plane.csv";
    test::write_text(scene,
                     "lagrangian = \"(1 + x^2)*(x'^2 + z'^2)/2 - cos(x) - g*z\"\n[coordinates]\n"
                     "x = { position = 1, velocity = 0 }\nz = { position = 0, velocity = 0 }\n[parameters]\ng = 1\n"
                     "[constraints]\nplane = \"z = 0\"\n" +
                         method(4, 0.1, 10));
    for (const std::string g : {"7", "9.81", "1000"})
        for (const std::string step : {"0.1", "1/15", "0.05"}) {
            CAPTURE(g);
            CAPTURE(step);
            const test::Finished done =
                test::run({LOBATTO_PROGRAM, "run", scene, "--set", "g=" + g, "--step", step, "-o", file});
            CHECK(done.exit_code == 0);
            CHECK(done.err.empty());
        }
}

TEST_CASE("the multiplier of a rod is its tension, with the order of the steps" * doctest::test_suite("slow")) {
    // Along (x, y) of length 1, whose slope is 2 (x, y): -m v^2 = 2 lambda - m g y.
    const auto error = [](int points, double step) {
        const test::TemporaryFolder folder;
        const std::string scene = folder / "rod.toml", file = folder / "rod.csv";
        test::write_text(scene, rod + method(points, step, 2) + "[output]\nmultipliers = true\n");
        REQUIRE(test::run({LOBATTO_PROGRAM, "run", scene, "--quiet", "-o", file}).exit_code == 0);
        const test::TrajectoryTable table = test::read_trajectory(file);
        REQUIRE(table.columns[5] == "lambda_rod");
        const std::vector<double>& row = table.rows.back();
        // Of the exact motion: the energy gives v^2 at its height.
        const Ended exact = run(scene_of(rod + method(10, 0.02, 2)));
        const double m = 2, g = 1.5, y = exact.result.q[1], v2 = 0.25 + 2 * g * (-0.8 - y);
        return std::fabs(row[5] - -(m * v2 - m * g * y) / 2);
    };
    CHECK(error(8, 0.05) < 1e-13);
    CHECK(std::log2(error(3, 0.1) / error(3, 0.05)) == doctest::Approx(4).epsilon(0.1));
}

TEST_CASE("steps preserve areas on the constraints, and run backwards; friction is told apart" *
          doctest::test_suite("slow")) {
    const auto defect = [](const std::string& text) {
        const Scene scene = scene_of(text);
        EmitOptions options;
        options.precision = Precision::quadruple;
        const Kernel kernel = kernel_of(emit(derive(scene), options), options.precision);
        const __float128 step = number_of<__float128>(scene.evaluate(scene.run.step, "the step"));
        const QuadrupleStart start = quadruple_start(scene, kernel, step);
        CHECK(return_distance(kernel, start, step, 20) < 1e-28);
        return area_defect(kernel, start, step);
    };
    CHECK(defect(two_rods + method(4, 0.1, 1)) < 1e-15);
    CHECK(defect(body + method(3, 0.1, 1)) < 1e-15);
    CHECK(defect(two_rods + "[forces]\n\"x[2]\" = \"-0.1*x[2]'\"\n" + method(4, 0.1, 1)) > 1e-4);
}

TEST_CASE("momenta of symmetries that the constraints have are conserved, others are not looked for") {
    const Scene scene = scene_of(body + method(4, 0.1, 10));
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    const auto start = start_in<double>(ExactStart(scene), kernel, 0.1);
    const auto symmetries = find_symmetries(kernel, start.parameters, start.q, 0.1, {"q0", "q1", "q2", "q3"});
    CHECK(symmetries.size() == 3);  // of space; the body's own moments differ
    for (const Symmetry& symmetry : symmetries)
        CHECK(momentum_variation(kernel, symmetry, start.parameters, start.q, start.p, 0.1, 200).variation < 1e-13);

    // Free of forces L does not change with x, but the rod does.
    const Scene held = scene_of(
        "lagrangian = \"(x'^2 + y'^2)/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
        "y = { position = 0, velocity = 1 }\n[constraints]\nrod = \"x^2 + y^2 = 1\"\n" +
        method(4, 0.1, 1));
    const Kernel of_held = kernel_of(emit(derive(held)), Precision::double_);
    const auto there = start_in<double>(ExactStart(held), of_held, 0.1);
    const auto found = find_symmetries(of_held, there.parameters, there.q, 0.1, {"x", "y"});
    REQUIRE(found.size() == 1);
    CHECK(found[0].kind == "rotation in the (x, y) plane");
}

TEST_CASE("equations of neighbours stay banded") {
    const Scene chain = scene_of(
        "lagrangian = \"sum(i = 1 .. n, (x[i]'^2 + y[i]'^2)/2 - y[i])\"\n[coordinates]\n"
        "x = { count = \"n\", position = \"i\", velocity = 0 }\ny = { count = \"n\", position = 0, velocity = 0 }\n"
        "[parameters]\nn = { value = 20, constant = true }\n[constraints]\nfirst = \"x[1]^2 + y[1]^2 = 1\"\n"
        "\"rod[i]\" = { equation = \"(x[i+1] - x[i])^2 + (y[i+1] - y[i])^2 = 1\", count = \"n - 1\" }\n" +
        method(3, 0.05, 0.5));
    const Derivation derivation = derive(chain);
    REQUIRE(derivation.structure.groups.size() == 1);
    CHECK(derivation.structure.groups[0].coordinates.size() == 60);
    CHECK(derivation.structure.groups[0].bandwidth <= 8);
    const Ended ended = run(chain);
    for (std::size_t i = 1; i < 20; ++i) {
        const double dx = ended.result.q[i] - ended.result.q[i - 1],
                     dy = ended.result.q[20 + i] - ended.result.q[19 + i];
        CHECK(std::fabs(dx * dx + dy * dy - 1) < 1e-13);
    }
}

TEST_CASE("starts off the constraints are errors that tell the nearest start") {
    const std::string free =
        "lagrangian = \"(x'^2 + 4*y'^2)/2 - y\"\n[coordinates]\nx = { position = PX, velocity = VX }\n"
        "y = { position = PY, velocity = 0 }\n[constraints]\nrod = \"x^2 + y^2 = 1\"\n";
    const auto with = [&](const std::string& px, const std::string& py, const std::string& vx) {
        std::string text = free;
        text.replace(text.find("PX"), 2, px);
        text.replace(text.find("PY"), 2, py);
        text.replace(text.find("VX"), 2, vx);
        return text;
    };
    const std::string off = refusal(with("1.1", "0", "0") + method(3, 0.1, 1));
    CHECK(test::contains(off, "does not keep the constraint rod (x^2 + y^2 = 1)"));
    CHECK(test::contains(off, "0.21"));
    CHECK(test::contains(off, "x = 1"));
    CHECK(test::contains(off, "assemble = true"));
    const std::string moving = refusal(with("0.6", "0.8", "1") + method(3, 0.1, 1));
    CHECK(test::contains(moving, "at the rate 1.2"));
    CHECK(test::contains(moving, "x' = "));
    CHECK(refusal(with("0.6", "0.8", "0") + method(3, 0.1, 1)) == "");

    // The nearest in the metric of the mass: M (q - q0) along the slope of the constraint.
    const Scene assembled = scene_of(with("2", "1", "1") + method(3, 0.1, 1, "assemble = true\n"));
    const StartOnConstraints start = start_on_constraints(assembled, build_system(assembled));
    const auto number = [](const cln::cl_R& x) { return cln::double_approx(x); };
    const double x = number(start.q[0]), y = number(start.q[1]), vx = number(start.v[0]), vy = number(start.v[1]);
    CHECK(x * x + y * y == doctest::Approx(1).epsilon(1e-15));
    CHECK((x - 2) * y == doctest::Approx(4 * (y - 1) * x).epsilon(1e-12));
    CHECK(std::fabs(x * vx + y * vy) < 1e-15);
    CHECK((vx - 1) * y == doctest::Approx(4 * vy * x).epsilon(1e-12));
    CHECK(run(assembled).result.steps_done == 10);
}

TEST_CASE("momenta at the start must be those of a velocity that keeps the constraints") {
    const std::string by_momentum =
        "lagrangian = \"(x'^2 + y'^2)/2 - y\"\n[coordinates]\nx = { position = 1, momentum = 0.5 }\n"
        "y = { position = 0, momentum = 2 }\n[constraints]\nrod = \"x^2 + y^2 = 1\"\n";
    CHECK(test::contains(refusal(by_momentum + method(3, 0.1, 1)), "those of no velocity that keeps it"));
    const Ended ended = run(scene_of(by_momentum + method(3, 0.1, 0.1, "assemble = true\n")));
    CHECK(apart(ended.request.p, {0, 2}) < 1e-15);
}

TEST_CASE("what cannot be constrained so is one clear error") {
    const std::string two =
        "lagrangian = \"(x'^2 + y'^2 + z'^2)/2 - y\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
        "y = { position = 0, velocity = 0 }\nz = { position = 0, velocity = 0 }\n";
    const auto constrained = [&](const std::string& lines) {
        return refusal(two + "[constraints]\n" + lines + method(3, 0.1, 1));
    };
    CHECK(test::contains(constrained("a = \"x^2 + y^2 = 1\"\nb = \"2*x^2 = 2 - 2*y^2\"\n"),
                         "the constraints a, b depend on one another"));
    CHECK(test::contains(constrained("a = \"y^2 = 0\"\n"), "has no slope"));
    CHECK(test::contains(constrained("a = \"x'^2 + y^2 = 1\"\n"), "holds a velocity"));
    CHECK(test::contains(constrained("a = \"1 = 1\"\n"), "holds no coordinate"));
    CHECK(test::contains(constrained("a = \"x = 1 rising\"\n"), "leave out 'rising'"));
    CHECK(test::contains(constrained("a = \"x = 1\"\nb = \"y = 0\"\nc = \"z = 0\"\n"),
                         "nothing is left that could move"));
    CHECK(test::contains(constrained("\"a[i]\" = \"x = 1\"\n"), "has a count"));
    CHECK(test::contains(constrained("a = { equation = \"x = 1\", count = 2 }\n"), "a count makes an array"));
    CHECK(test::contains(constrained("a = 3\n"), "must be an equation in quotes"));
    CHECK(test::contains(constrained("x = \"x = 1\"\n"), "both a coordinate and a constraint"));
    CHECK(test::contains(constrained("a = \"x^2 + y^2 = -1\"\n"), "cannot close"));
    CHECK(test::contains(refusal(two + method(3, 0.1, 1, "assemble = true\n")), "nothing to assemble"));
    for (const char* const other :
         {"family = \"gauss\"\n", "family = \"splitting\"\n", "arithmetic = \"clean\"\n", "clock = \"x\"\n"})
        CHECK(test::contains(refusal(two + "[constraints]\na = \"x^2 + y^2 = 1\"\n[method]\n" + other +
                                     "[run]\nstep = 0.1\nuntil = 1\n"),
                             "constraints need"));
}

TEST_CASE("a mass that is missing along the constraints is told, one that is missing across them is none") {
    CHECK(test::contains(refusal("lagrangian = \"(x' + y')^2/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
                                 "y = { position = 1, velocity = 0 }\n[constraints]\nboth = \"x + y = 2\"\n" +
                                 method(3, 0.1, 1)),
                         "No kinetic energy opposes the direction"));
    // x moves with the mass of both: q'' = 0.
    const Ended ended =
        run(scene_of("lagrangian = \"(x' + y')^2/2\"\n[coordinates]\nx = { position = 1, velocity = 2 }\n"
                     "y = { position = 1, velocity = 2 }\n[constraints]\nside = \"x - y = 0\"\n" +
                     method(3, 0.1, 1)));
    CHECK(apart(ended.result.q, {3, 3}) < 1e-14);
}

TEST_CASE("a sweep refuses the trajectories that start off the constraints, and assembles them where it is asked to") {
    const test::TemporaryFolder folder;
    const std::string scene = folder / "rod.toml", table = folder / "table.csv";
    const std::string text =
        "lagrangian = \"(x'^2 + y'^2)/2 - y\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
        "y = { position = 0, velocity = 0 }\n[constraints]\nrod = \"x^2 + y^2 = 1\"\n[run]\nstep = 0.1\nuntil = 1\n";
    const auto rows = [&](const std::string& more) {
        test::write_text(scene, text + more);
        const test::Finished done =
            test::run({LOBATTO_PROGRAM, "sweep", scene, "--vary", "x=1,1.1", "--quiet", "-o", table});
        return std::pair{done.exit_code, test::read_file(table)};
    };
    const auto [refused, off] = rows("");
    CHECK(refused == 3);
    CHECK(test::contains(off, "9 start off the constraints"));
    CHECK(test::contains(off, ",9,"));
    const auto [taken, assembled] = rows("assemble = true\n");
    CHECK(taken == 0);
    CHECK(!test::contains(assembled, ",9,"));
}
