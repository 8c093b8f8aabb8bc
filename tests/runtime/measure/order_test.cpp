// SPDX-License-Identifier: GPL-2.0-or-later
// Orders of convergence, measured in quadruple precision; and that wrong methods are found out.
#include <doctest/doctest.h>

#include <cmath>

#include "runtime/error.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "runtime/measure/measured_order.hpp"
#include "runtime/measure/promises.hpp"
#include "runtime/measure/reference.hpp"
#include "tests/scenes/scenes.hpp"

using namespace lobatto;

namespace {

Kernel quadruple_kernel(const Scene& scene) {
    return test::kernel_in_own_cache(derive(scene), Precision::quadruple);
}

// m = 1, omega = 1 from q = 2 at rest: a swing of 115 degrees.
const QuadrupleStart wide_swing{{1, 1}, {2}, {0}};
const QuadrupleStart coupled_start{{}, {0.75, 0.25}, {0.5, 1}};

// |q(4) - exact| with the given number of steps.
double error_at_four(const Kernel& kernel, std::int64_t steps) {
    LoadedStepper<__float128> stepper(kernel);
    lobatto_advance call{};
    call.steps = steps;
    REQUIRE(stepper.prepare(wide_swing.parameters, __float128(4) / steps) == LOBATTO_OK);
    REQUIRE(stepper.start(0, wide_swing.q, wide_swing.p) == LOBATTO_OK);
    REQUIRE(stepper.advance(call) == LOBATTO_OK);
    __float128 time;
    std::vector<__float128> q, p;
    stepper.state(time, q, p);
    return std::fabs(static_cast<double>(q[0] - __float128(pendulum_solution(1, 2, 0, 4).q)));
}

// The hand-written pendulum with one entry of its stage matrix changed.
Kernel spoilt_pendulum() {
    KernelSource source;
    source.name = "handwritten_pendulum";
    source.digest = "0123456789abcdef";
    source.formulas = test::read_file(LOBATTO_SOURCE_DIR "/tests/handwritten/pendulum.hpp") +
                      "namespace lobatto::kernels { using handwritten_pendulum = HandwrittenPendulum; }\n";
    const std::string entry = "(11 - 5 * root5) / 120";
    REQUIRE(source.formulas.find(entry) != std::string::npos);
    source.formulas.replace(source.formulas.find(entry), entry.size(), "(11 - 4 * root5) / 120");
    const test::TemporaryFolder folder;
    const test::EnvironmentVariable cache("LOBATTO_CACHE_DIR", folder.string());
    return kernel_of(source, Precision::double_);
}

}  // namespace

TEST_CASE("the s-point kernel converges at order 2, 4, 6, 8 to the pendulum's elliptic solution for s = 2 ... 5") {
    for (int points = 2; points <= 5; ++points) {
        const Kernel kernel = quadruple_kernel(test::pendulum_scene(points));
        // The last error of s = 5 is 1.8e-15, far above the reference's rounding of about 1e-18.
        const std::int64_t steps = points == 2 ? 256 : points == 5 ? 8 : 16;
        const double fine = error_at_four(kernel, 2 * steps), finest = error_at_four(kernel, 4 * steps);
        INFO(points << " points: " << fine << " " << finest);
        CHECK(finest > 1e-16);
        CHECK(std::fabs(std::log2(fine / finest) - (2 * points - 2)) < 0.3);
    }
}

TEST_CASE("the order is 2, 4, 6, 8 for s = 2 ... 5 with two coordinates and a mass matrix that is not diagonal" *
          doctest::test_suite("slow")) {
    for (int points = 2; points <= 5; ++points) {
        const Kernel kernel = quadruple_kernel(test::coupled_scene(points));
        const MeasuredOrder convergence = measure_order(kernel, coupled_start, 0.1);
        REQUIRE(convergence.rows.size() >= 3);
        CHECK(convergence.settled);
        CHECK(std::fabs(convergence.order - (2 * points - 2)) < 0.05);
        CHECK(convergence.rows.front().error < 1);
        CHECK(convergence.rows.back().error > 1e-29);
    }
}

namespace {

struct Motion {
    std::string name, text;  // the scene without its method
};

const Motion henon_heiles = {"Henon and Heiles",
                             "lagrangian = \"(x'^2 + y'^2)/2 - (x^2 + y^2)/2 - x^2*y + y^3/3\"\n[coordinates]\n"
                             "x = { position = 0.25, velocity = 0.375 }\ny = { position = 0.125, velocity = 0.25 }\n"};
const Motion double_pendulum = {"a double pendulum",
                                "lagrangian = \"a'^2 + b'^2/2 + a'*b'*cos(a - b) + 2*cos(a) + cos(b)\"\n[coordinates]\n"
                                "a = { position = 0.75, velocity = 0.25 }\nb = { position = -0.5, velocity = 0.5 }\n"};
const Motion relativistic = {"a relativistic oscillator",
                             "lagrangian = \"-sqrt(1 - x'^2) - x^2/2 - x^4/8\"\n[coordinates]\n"
                             "x = { position = 0.75, velocity = 0.25 }\n"};
const Motion charged = {"a charge in a magnetic field that varies",
                        "lagrangian = \"(x'^2 + y'^2)/2 + (x*y' - y*x')*(1 + x^2)/2 - cos(y)*x^2/2\"\n[coordinates]\n"
                        "x = { position = 0.5, velocity = 0.5 }\ny = { position = 0.25, velocity = -0.25 }\n"};
// Two cyclic coordinates.
const Motion top = {"a top",
                    "lagrangian = \"(theta'^2 + sin(theta)^2*phi'^2)/2 + (psi' + cos(theta)*phi')^2/4 - "
                    "cos(theta)\"\n[coordinates]\ntheta = { position = 1, velocity = 0.25 }\n"
                    "phi = { position = 0, velocity = 1 }\npsi = { position = 0.5, velocity = 2 }\n"};
const Motion shaken = {"a pendulum shaken and pushed",  // separable, with time
                       "time = \"t\"\nlagrangian = \"q'^2/2 + (1 + cos(2*t)/2)*cos(q)\"\n[coordinates]\n"
                       "q = { position = 1, velocity = 0.5 }\n[forces]\nq = \"sin(t)/2 - q/4\"\n"};
const Motion driven = {"a driven pendulum with friction",
                       "time = \"t\"\nlagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\n"
                       "q = { position = 1, velocity = 0.5 }\n[forces]\nq = \"cos(2*t)/2 - q'/4 - q'^3/8\"\n"};

// The order from the scene's start over eight steps of about 0.2.
void check_order(const Motion& motion, const Method& method) {
    Scene scene =
        read_scene(Source("test.toml", "title = \"Test\"\n" + motion.text + "[run]\nstep = 0.1\nuntil = 1\n"));
    scene.method = method;
    scene.outputs.tangent = scene.outputs.energy = false;
    const Kernel kernel = quadruple_kernel(scene);
    LoadedStepper<__float128> stepper(kernel);
    REQUIRE(stepper.prepare({}, 0.2) == LOBATTO_OK);
    std::vector<__float128> q, velocity;
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {  // exact in double
        q.push_back(scene.evaluate(scene.initial_position[k], "q").to_double());
        velocity.push_back(scene.evaluate(scene.initial_rate[k], "v").to_double());
    }
    const MeasuredOrder convergence = measure_order(kernel, {{}, q, stepper.momentum(0, q, velocity)}, 0.2);
    INFO(motion.name << ", " << method.name() << ": order " << convergence.order << ", settled " << convergence.settled
                     << ", errors from " << (convergence.rows.empty() ? 0.0 : convergence.rows.front().error));
    CHECK(!convergence.exact);
    // Beyond order 16 rounding at 1e-29 leaves too few steps for the orders to settle, which they do from above;
    // measured 18.3 and 20.5 for 18 and 20, at most 23.5 for 22. The next lower order of a symmetric method is 2 less.
    if (method.order() <= 16) {
        CHECK(convergence.settled);
        CHECK(bears_out(convergence, method.order(), false));
    } else {
        CHECK(convergence.order > method.order() - 1);
        CHECK(convergence.order < method.order() + 3.5);
    }
    CHECK(kernel->order == method.order());
}

const std::vector<Motion> motions = {henon_heiles, double_pendulum, relativistic, charged, top, shaken, driven};

}  // namespace

TEST_CASE("every form of kernel has its method's order: Lobatto's 2 s - 2, Gauss's 2 s, forces and time included" *
          doctest::test_suite("slow")) {
    check_order(henon_heiles, {Family::lobatto, 8});
    check_order(henon_heiles, {Family::gauss, 3});
    check_order(double_pendulum, {Family::lobatto, 6});
    check_order(double_pendulum, {Family::gauss, 2});
    check_order(relativistic, {Family::lobatto, 3});
    check_order(charged, {Family::gauss, 4});
    check_order(top, {Family::lobatto, 4});
    check_order(shaken, {Family::gauss, 1});
    check_order(driven, {Family::lobatto, 5});
}

TEST_CASE("and so has every member, up to Lobatto's order 22 and Gauss's 20" * doctest::test_suite("slowest")) {
    for (int points = 2; points <= 12; ++points)
        check_order(motions[static_cast<std::size_t>(points + 3) % motions.size()], {Family::lobatto, points});
    for (int stages = 1; stages <= 10; ++stages)
        check_order(motions[static_cast<std::size_t>(stages + 3) % motions.size()], {Family::gauss, stages});
}

TEST_CASE("a Stoermer-Verlet kernel does not pass for one of order 4, nor a kernel of order 6 for one of order 4") {
    const MeasuredOrder verlet = measure_order(quadruple_kernel(test::pendulum_scene(2)), wide_swing, 0.1);
    CHECK(bears_out(verlet, 2, false));
    CHECK(!bears_out(verlet, 4, false));
    CHECK(!bears_out(verlet, 4, true));
    const MeasuredOrder sixth = measure_order(quadruple_kernel(test::pendulum_scene(4)), wide_swing, 0.1);
    CHECK(bears_out(sixth, 6, false));
    CHECK(!bears_out(sixth, 4, false));
    CHECK(bears_out(sixth, 4, true));  // a linear system may converge faster
}

TEST_CASE("high orders may still rise, and weakly nonlinear motions converge faster; other orders do not pass") {
    const auto measured = [](std::vector<double> orders) {
        MeasuredOrder convergence;
        convergence.settled = true;
        convergence.order = orders.back();
        for (const double order : orders) convergence.rows.push_back({0, 0, order});
        return convergence;
    };
    CHECK(bears_out(measured({0, 19.31, 20.22, 20.88}), 22, false));  // a nonlinear fall onto a floor
    CHECK(!bears_out(measured({0, 20.8, 20.85, 20.88}), 22, false));
    CHECK(!bears_out(measured({0, 20.4, 20.3, 20.88}), 22, false));  // no rise, but rounding
    CHECK(bears_out(measured({0, 23.99, 24.1}), 22, false));         // a harmonic oscillator under a gauge
    CHECK(!bears_out(measured({0, 24.9, 24.8}), 22, false));
    CHECK(!bears_out(measured({0, 12.1, 12.0}), 10, false));
    CHECK(!bears_out(measured({0, 10.8, 11.1, 11.25}), 12, false));
    CHECK(!bears_out(measured({0, 5.95, 6.0}), 4, false));
    CHECK(!bears_out(measured({0, 3.4, 3.45}), 4, false));
}

TEST_CASE("a ladder that begins far too coarse is refined until the orders settle") {
    const MeasuredOrder convergence = measure_order(quadruple_kernel(test::pendulum_scene(3)), wide_swing, 40);
    CHECK(convergence.settled);
    CHECK(convergence.rows.front().step < 40);
    CHECK(std::fabs(convergence.order - 4) < 0.1);
}

TEST_CASE("a ladder that begins at the rounding floor is coarsened until there is an error to measure") {
    const MeasuredOrder pendulum = measure_order(quadruple_kernel(test::pendulum_scene(5)), wide_swing, 1e-4);
    CHECK(pendulum.settled);
    CHECK(pendulum.rows.front().step > 1e-4);
    CHECK(std::fabs(pendulum.order - 8) < 0.3);
    const Kernel oscillator =
        quadruple_kernel(test::scene_of("q'^2/2 - q^2/2", "q = { position = 1, velocity = 0 }", 5));
    CHECK(std::fabs(measure_order(oscillator, {{}, {1.5}, {0}}, 0.0125).order - 8) < 0.3);
}

TEST_CASE("an order that rounding hides at every step is not judged") {
    // Around q = 1e20 quadruple leaves 14 digits to an angle: steps short enough for them show nothing but rounding.
    const MeasuredOrder convergence =
        measure_order(quadruple_kernel(test::pendulum_scene(5)), {{1, 1}, {1e20}, {2}}, 1e-6);
    INFO(convergence.order);
    CHECK(!convergence.settled);
    CHECK(!convergence.exact);
    CHECK(convergence.below_rounding);
    CHECK(bears_out(convergence, 8, false));
}

TEST_CASE("free fall has no error to measure") {
    const Kernel kernel = quadruple_kernel(
        test::scene_of("m*q'^2/2 - m*g*q", "q = { position = 0, velocity = 0 }", 4, "m = 2\ng = 9.81"));
    const MeasuredOrder convergence = measure_order(kernel, {{2, 9.75}, {0}, {1}}, 0.1);
    CHECK(convergence.exact);
    CHECK(convergence.rows.empty());
    CHECK(bears_out(convergence, 6, true));
}

TEST_CASE("steps that fail at any length leave no order to measure") {
    const Kernel kernel = quadruple_kernel(test::scene_of("q'^2/2 + 1/q", "q = { position = 1, velocity = 0 }", 4));
    CHECK(test::message_of<ComputationError>([&] {
              measure_order(kernel, {{}, {0}, {0}}, 0.1);
          }) == "the order cannot be measured: the steps fail from this start, however short");
}

TEST_CASE("a stage matrix with one wrong entry is neither symplectic nor reversible") {
    const Kernel kernel = spoilt_pendulum();
    LoadedStepper<double> stepper(kernel);
    REQUIRE(stepper.prepare({1, 1}, 0.5) == LOBATTO_OK);
    CHECK(symplectic_defect<double>(stepper, {2}, {0.5}) > 1e-6);  // rounding is 1e-16
    const Return back = there_and_back<double>(kernel, {1, 1}, {2}, {0}, 0.5, 100);
    CHECK(back.distance > 1e3 * back.rounding);
    CHECK(back.rounding > 0);
}

TEST_CASE("the way there and back leads to the start within the rounding it allows, in both precisions") {
    const Derivation derivation = derive(test::coupled_scene(4));
    const Return twice = there_and_back<double>(test::kernel_in_own_cache(derivation, Precision::double_), {},
                                                {0.75, 0.25}, {0.5, 1}, 0.1, 500);
    CHECK(twice.steps == 500);
    CHECK(twice.distance > 0);
    CHECK(twice.distance < twice.rounding);
    CHECK(twice.rounding < 1e-9);
    const Return exact = there_and_back<__float128>(test::kernel_in_own_cache(derivation, Precision::quadruple), {},
                                                    coupled_start.q, coupled_start.p, 0.125, 500);
    CHECK(exact.distance < exact.rounding);
    CHECK(exact.rounding < 1e-26);
}

TEST_CASE("the tangent map is the derivative of the step to 1e-20") {
    for (int points = 2; points <= 5; ++points)
        CHECK(tangent_defect(quadruple_kernel(test::coupled_scene(points)), coupled_start, 0.3) < 1e-20);
}

TEST_CASE("the tangent map is measured in the units of the motion: a satellite in metres, an angle of a million") {
    const Kernel satellite = quadruple_kernel(test::scene_of(
        "m*(x'^2 + y'^2)/2 + m*mu/sqrt(x^2 + y^2)",
        "x = { position = 7e6, velocity = 0 }\ny = { position = 0, velocity = 8000 }", 5, "m = 1000\nmu = 3.986e14"));
    CHECK(tangent_defect(satellite, {{1000, 3.986e14}, {7e6, 0}, {0, 8e6}}, 20) < 1e-18);  // measured: 2e-20
    CHECK(tangent_defect(quadruple_kernel(test::pendulum_scene(5)), {{1, 1}, {1e6}, {2}}, 0.01) < 1e-18);  // 5e-22
    // x rests, but for the error of the step.
    const Kernel resting = quadruple_kernel(
        test::scene_of("(x'^2 + y'^2)/2 - (x^2 + y^2)/2 + x*(y'^2 + y^2 - 0.1225)",
                       "x = { position = 0, velocity = 0 }\ny = { position = 0, velocity = 0.35 }", 4));
    CHECK(tangent_defect(resting, {{}, {0, 0}, {0, 0.35}}, 0.1) < 1e-18);
}

TEST_CASE("the energy that a periodic motion rounds away step by step is no drift of the method") {
    const Kernel kernel = test::kernel_in_own_cache(
        derive(test::scene_of("m*q'^2/2 + g*cos(q)", "q = { position = 0.3, velocity = 9 }", 5, "m = 1\ng = 2")),
        Precision::double_);
    const EnergyDrift drift = energy_drift(kernel, {1, 2}, {0.3}, {9}, 0.01, 20000);  // turning over and over
    INFO(drift.drift << " " << drift.swing << " " << drift.rounding);
    CHECK(drift.bounded);
    CHECK(drift.drift <= drift.swing / 4 + drift.rounding);
    CHECK(drift.rounding < 1e-10 * 42);  // of the energy
}

TEST_CASE("the energy of a map that is not symplectic drifts") {
    const Kernel kernel = spoilt_pendulum();
    const EnergyDrift drift = energy_drift(kernel, {1, 1}, {2}, {0.5}, 0.1, 2000);
    INFO(drift.drift << " " << drift.swing << " " << drift.rounding);
    CHECK(drift.bounded);
    CHECK(drift.drift > drift.swing / 4 + drift.rounding);
}

TEST_CASE("an energy whose terms cancel in double is found out, a plain one is not") {
    using States = std::vector<std::pair<std::vector<double>, std::vector<double>>>;
    const auto defect = [&](const std::string& potential, const States& states = {{{0.3}, {0.2}}, {{0.1}, {0.25}}}) {
        const Derivation derivation =
            derive(test::scene_of("q'^2/2 - " + potential, "q = { position = 0.3, velocity = 0.2 }", 3));
        return energy_defect(test::kernel_in_own_cache(derivation, Precision::double_),
                             test::kernel_in_own_cache(derivation, Precision::quadruple), {}, 0.01, states);
    };
    CHECK(defect("(sqrt(1 + 1e-14*q^2) - 1)*1e14") > 1e-3);
    CHECK(defect("(1 - cos(q))") < 1e-14);
    CHECK(defect("exp(-q^2)", {{{-40}, {0}}}) == 0);  // below all doubles, and nothing beside it
}

TEST_CASE("the energy of a long run swings without drifting; a motion that leaves is not judged") {
    const Kernel kernel = test::kernel_in_own_cache(derive(test::pendulum_scene(3)), Precision::double_);
    const EnergyDrift drift = energy_drift(kernel, {1, 1}, {2}, {0}, 0.3, 20000);
    CHECK(drift.steps == 20000);
    CHECK(drift.bounded);
    CHECK(drift.swing > 1e-5);                                         // the method's error
    CHECK(drift.drift < drift.swing / 100);                            // measured: a thousandth
    CHECK(energy_drift(kernel, {1, 1}, {0}, {3}, 0.1, 1000).bounded);  // turning over and over, at an even pace
    const Kernel falling = test::kernel_in_own_cache(
        derive(test::scene_of("q'^2/2 - q", "q = { position = 0, velocity = 0 }", 4)), Precision::double_);
    CHECK(!energy_drift(falling, {}, {0}, {1}, 0.1, 20000).bounded);
}

TEST_CASE("with friction and explicit time the way back leads to the start too, however the flow contracts") {
    Scene scene = read_scene(Source(
        "test.toml", "title = \"Test\"\n" + driven.text + "[method]\npoints = 4\n[run]\nstep = 0.1\nuntil = 1\n"));
    const Kernel kernel = test::kernel_in_own_cache(derive(scene), Precision::double_);
    const Return back = there_and_back<double>(kernel, {}, {1}, {0.5}, 0.1, 100, false);
    CHECK(back.steps == 100);
    CHECK(back.distance > 0);
    CHECK(back.distance < back.rounding);  // measured 2e-13 and 1e-10
    CHECK(back.rounding < 1e-8);
}

TEST_CASE("the energy of a chaotic motion is not judged, that of a regular one is") {
    const auto drift = [](double a, double b) {
        const Scene scene = read_scene(Source("test.toml", "title = \"Test\"\n" + double_pendulum.text +
                                                               "[method]\npoints = 4\n[run]\nstep = 0.1\nuntil = 1\n"));
        const Kernel kernel = test::kernel_in_own_cache(derive(scene), Precision::double_);
        return energy_drift(kernel, {}, {a, b}, {0, 0}, 0.05, 10000);
    };
    CHECK(drift(2, -2).chaotic);
    const EnergyDrift small = drift(0.25, -0.125);
    CHECK(!small.chaotic);
    CHECK(small.bounded);
    CHECK(small.drift <= small.swing / 4 + small.rounding);
}
