// SPDX-License-Identifier: GPL-2.0-or-later
// runtime/kernel/kernel.hpp alone: sine and cosine, small solves, and the step loop around the hand-written pendulum.
#include <doctest/doctest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

#include "tests/handwritten/pendulum.hpp"

using namespace lobatto;

namespace {

const long double half_pi = 2 * std::atan(1.0L);

// |got - want| in units of the last place of `want`, which has 11 more bits.
double ulps(double got, long double want) {
    int exponent = 0;
    std::frexp(static_cast<double>(want), &exponent);
    return static_cast<double>(std::fabs(got - want) / std::ldexp(1.0L, std::max(exponent - 53, -1074)));
}

struct Worst {
    double value = 0;
    void look_at(double x) {
        double sine = 0, cosine = 0;
        lobatto::sincos(x, sine, cosine);
        value = std::max({value, ulps(sine, std::sin(static_cast<long double>(x))),
                          ulps(cosine, std::cos(static_cast<long double>(x)))});
    }
};

bool same_bits(double a, double b) {
    return a == b && std::signbit(a) == std::signbit(b);
}

using Pendulum = Stepper<HandwrittenPendulum>;
static_assert(std::is_trivially_copyable_v<Pendulum>, "the host copies steppers byte by byte");

Pendulum pendulum(double h, double q, double p, double m = 1, double omega = 1) {
    Pendulum stepper;
    REQUIRE(stepper.prepare({m, omega}, h) == Status::ok);
    REQUIRE(stepper.start(0, &q, &p) == Status::ok);
    return stepper;
}

double momentum_of(const Pendulum& stepper) {
    double p = 0;
    stepper.momentum(&p);
    return p;
}

double energy_of(const Pendulum& stepper) {
    const double p = momentum_of(stepper);
    return HandwrittenPendulum::energy(stepper.coefficients, stepper.q, &p);
}

}  // namespace

TEST_CASE("sine and cosine err by less than 0.88 units of the last place") {
    std::mt19937_64 random(1);
    for (const double range : {0.5, 0.8, 4.0, 100.0, 1e4, 823548.0}) {
        CAPTURE(range);
        std::uniform_real_distribution<double> x(-range, range);
        Worst worst;
        for (int i = 0; i < 20000; ++i) worst.look_at(x(random));
        CHECK(worst.value < 0.88);  // 0.87 among 5e6 points, 0.77 below 1e4
    }
    Worst worst;  // where the octants meet
    for (int k = -524284; k <= 524284; k += 53) worst.look_at(static_cast<double>((k + 0.5) * half_pi));
    CHECK(worst.value < 0.88);
}

TEST_CASE("sine and cosine err by less than 1.1 units of the last place at the doubles nearest the multiples of pi/2") {
    Worst worst;
    for (int k = -524284; k <= 524284; k += 1 + (std::abs(k) > 2000) * 52) {
        const double x = static_cast<double>(k * half_pi);
        for (const double y : {x, std::nextafter(x, 1e9), std::nextafter(x, -1e9), x * (1 + 1e-9)}) worst.look_at(y);
    }
    worst.look_at(0x1.93c05c9ed3cbcp+18);  // the worst of all, 1.063: within 1e-16 of 263,260 pi/2
    CHECK(worst.value < 1.1);
    CHECK(worst.value > 1.0);  // so the worst is known
}

TEST_CASE("sine and cosine beyond the range of the reduction are the library's") {
    for (const double x : {823549.0, -823549.0, 1e6, 1e22, -1.7e308}) {
        CAPTURE(x);
        Worst worst;
        worst.look_at(x);
        CHECK(worst.value < 1);
    }
}

TEST_CASE("sine and cosine keep zero and tiny numbers, and have no value at infinity") {
    const auto sine = [](double x) {
        double s = 0, c = 0;
        lobatto::sincos(x, s, c);
        CHECK(c == 1);
        return s;
    };
    const double smallest = std::numeric_limits<double>::denorm_min();
    CHECK(sine(-0.0) == 0);
    for (const double x : {0.0, smallest, -smallest, 2.2e-308, 1e-200, -1e-9}) CHECK(same_bits(sine(x), x));
    for (const double x : {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
        double s = 0, c = 0;
        lobatto::sincos(x, s, c);
        CHECK(std::isnan(s));
        CHECK(std::isnan(c));
    }
}

TEST_CASE("finite numbers are told from the others") {
    CHECK(is_finite(0.0));
    CHECK(is_finite(-std::numeric_limits<double>::max()));
    CHECK_FALSE(is_finite(std::numeric_limits<double>::infinity()));
    CHECK_FALSE(is_finite(std::numeric_limits<double>::quiet_NaN()));
}

TEST_CASE_TEMPLATE("small systems are solved to rounding", Size, std::integral_constant<int, 1>,
                   std::integral_constant<int, 2>, std::integral_constant<int, 3>, std::integral_constant<int, 6>,
                   std::integral_constant<int, 12>) {
    constexpr int size = Size::value, columns = 3;
    using Square = Eigen::Matrix<double, size, size, size == 1 ? Eigen::ColMajor : Eigen::RowMajor>;
    using Block = Eigen::Matrix<double, size, columns, Eigen::RowMajor>;
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> entry(-1, 1);
    for (int trial = 0; trial < 200; ++trial) {
        Square A = Square::NullaryExpr([&] { return entry(random); });
        Block B = Block::NullaryExpr([&] { return entry(random); });
        if (size > 1) A(0, 0) = 0;  // so that rows have to be exchanged
        const Block expected = A.fullPivLu().solve(B);
        const double condition = A.norm() * A.inverse().norm();
        Square work = A;
        Block X = B;
        REQUIRE(solve<size, columns>(work.data(), X.data()));
        // At most 1.0 eps condition |X| measured.
        CHECK((X - expected).norm() <= 4 * std::numeric_limits<double>::epsilon() * condition * expected.norm());
    }
}

TEST_CASE("a singular system is refused") {
    double zero[1] = {0}, right[2] = {1, 1};
    CHECK_FALSE(solve<1, 1>(zero, right));
    double dependent[4] = {1, 2, 2, 4};
    CHECK_FALSE(solve<2, 1>(dependent, right));
    double unknown[4] = {1, std::nan(""), 2, 3};
    CHECK_FALSE(solve<2, 1>(unknown, right));
    double infinite[1] = {std::numeric_limits<double>::denorm_min()};  // its inverse overflows
    CHECK_FALSE(solve<1, 1>(infinite, right));
}

TEST_CASE("one step of the hand-written kernel satisfies the paper's equations") {
    const double m = 1.7, omega = 2.3, h = 0.3, root5 = std::sqrt(5.0);
    Pendulum stepper = pendulum(h, 1.1, 0.6, m, omega);
    for (int step = 0; step < 5; ++step) {
        const double ql = stepper.q[0], pl = momentum_of(stepper);
        REQUIRE(stepper.step() == Status::ok);
        const double qr = stepper.q[0], pr = momentum_of(stepper), qx = stepper.node_position(1, 0),
                     qy = stepper.node_position(2, 0);
        const auto force = [&](double q) { return m * omega * omega * std::sin(q); };  // V'
        // Each holds to rounding: 2e-16 measured, 9e-16 for the momenta. eq:internesNL
        CHECK(std::fabs(qx - h * h / (30 * m) * (force(qy) + 2 * force(qx)) - (5 + root5) / 10 * ql -
                        (5 - root5) / 10 * qr) < 2e-15);
        CHECK(std::fabs(qy - h * h / (30 * m) * (2 * force(qy) + force(qx)) - (5 - root5) / 10 * ql -
                        (5 + root5) / 10 * qr) < 2e-15);
        // eq:discreteDynamics
        CHECK(std::fabs(pr - pl + h / 12 * (force(ql) + 5 * (force(qx) + force(qy)) + force(qr))) < 4e-15);
        CHECK(std::fabs(qr - ql - h * h / (24 * m) * (force(qr) + root5 * (force(qy) - force(qx)) - force(ql)) -
                        h / (2 * m) * (pr + pl)) < 2e-15);
    }
}

TEST_CASE("the hand-written kernel converges at order 6 on the pendulum") {
    // From q = 2 at rest: the largest error of q at the times 0.5, 1, ... 16 against h = 1/80.
    const auto positions = [](int steps_per_sample) {
        Pendulum stepper = pendulum(0.5 / steps_per_sample, 2, 0);
        std::vector<double> q;
        for (int sample = 0; sample < 32; ++sample) {
            for (int i = 0; i < steps_per_sample; ++i) REQUIRE(stepper.step() == Status::ok);
            q.push_back(stepper.q[0]);
        }
        return q;
    };
    const std::vector<double> reference = positions(40);
    const auto error = [&](int steps_per_sample) {
        const std::vector<double> q = positions(steps_per_sample);
        double worst = 0;
        for (int i = 0; i < 32; ++i) worst = std::max(worst, std::fabs(q[i] - reference[i]));
        return worst;
    };
    // Errors 1.5e-6, 2.2e-8, 3.3e-10; orders 6.06 and 6.05.
    CHECK(std::fabs(std::log2(error(1) / error(2)) - 6) < 0.1);
    CHECK(std::fabs(std::log2(error(2) / error(4)) - 6) < 0.1);
}

TEST_CASE("the energy of a long run stays within its first oscillation" * doctest::test_suite("slow")) {
    Pendulum stepper = pendulum(0.2, 2, 0);
    const double energy = energy_of(stepper);
    double early = 0, late = 0;
    for (int i = 0; i < 1000000; ++i) {
        REQUIRE(stepper.step() == Status::ok);
        double& worst = i < 100 ? early : late;
        worst = std::max(worst, std::fabs(energy_of(stepper) - energy));
    }
    CHECK(early > 1e-10);
    CHECK(late < 1.02 * early);
}

TEST_CASE("time runs backwards to the start") {
    Pendulum there = pendulum(0.2, 2, 0.3);
    for (int i = 0; i < 1000; ++i) REQUIRE(there.step() == Status::ok);
    Pendulum back = pendulum(-0.2, there.q[0], momentum_of(there));
    for (int i = 0; i < 1000; ++i) REQUIRE(back.step() == Status::ok);
    CHECK(std::fabs(back.q[0] - 2) < 1e-12);            // 2.8e-14 measured
    CHECK(std::fabs(momentum_of(back) - 0.3) < 1e-12);  // 7.5e-14 measured
}

TEST_CASE("two iterations a step suffice on the pendulum with h = 0.2") {
    Pendulum stepper = pendulum(0.2, 2, 0);
    REQUIRE(stepper.step() == Status::ok);
    for (int i = 0; i < 1000; ++i) {
        REQUIRE(stepper.step() == Status::ok);
        CHECK(stepper.iterations <= 2);
    }
}

TEST_CASE("a copied stepper takes the same steps, bit for bit") {
    Pendulum stepper = pendulum(0.2, 2, 0);
    for (int i = 0; i < 10; ++i) REQUIRE(stepper.step() == Status::ok);
    Pendulum copy = stepper;
    for (int i = 0; i < 10; ++i) {
        REQUIRE(stepper.step() == Status::ok);
        REQUIRE(copy.step() == Status::ok);
    }
    CHECK(same_bits(stepper.q[0], copy.q[0]));
    CHECK(same_bits(stepper.u[0], copy.u[0]));
}

TEST_CASE("a pendulum at rest stays at rest") {
    Pendulum stepper = pendulum(0.2, 0, 0);
    for (int i = 0; i < 10; ++i) REQUIRE(stepper.step() == Status::ok);
    CHECK(stepper.q[0] == 0);
    CHECK(stepper.u[0] == 0);
}

TEST_CASE("a start that is not finite is refused") {
    Pendulum stepper = pendulum(0.2, 2, 0);
    const double good = 1;
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
        CHECK(stepper.start(0, &bad, &good) == Status::not_finite);
        CHECK(stepper.start(0, &good, &bad) == Status::not_finite);
        CHECK(stepper.start(bad, &good, &good) == Status::not_finite);
    }
}

TEST_CASE("a step that fails keeps the last good state") {
    const auto state_after_failure = [](double h, double p, Status expected) {
        Pendulum stepper = pendulum(h, 2, p);
        Status status = Status::ok;
        int steps = 0;
        double q = stepper.q[0], u = stepper.u[0], time = stepper.time();
        while (steps < 1000 && (status = stepper.step()) == Status::ok) {
            ++steps;
            q = stepper.q[0], u = stepper.u[0], time = stepper.time();
        }
        CHECK(status == expected);
        CHECK(same_bits(stepper.q[0], q));
        CHECK(same_bits(stepper.u[0], u));
        CHECK(stepper.time() == time);
        CHECK(stepper.steps == steps);
    };
    state_after_failure(20, 0, Status::not_converged);
    state_after_failure(1e200, 0, Status::not_finite);
    state_after_failure(1e10, 1e300, Status::not_finite);
}

TEST_CASE("a step too short to be seen in the time is refused") {
    Pendulum stepper;
    REQUIRE(stepper.prepare({1, 1}, 1e-3) == Status::ok);
    const double q = 2, p = 0;
    REQUIRE(stepper.start(1e15, &q, &p) == Status::ok);
    CHECK(stepper.step() == Status::time_stands_still);
    CHECK(stepper.steps == 0);
    REQUIRE(stepper.prepare({1, 1}, 0.0) == Status::ok);
    REQUIRE(stepper.start(0, &q, &p) == Status::ok);
    CHECK(stepper.step() == Status::time_stands_still);
}

TEST_CASE("a massless pendulum is refused") {
    Pendulum stepper;
    CHECK(stepper.prepare({0, 1}, 0.1) == Status::singular_mass);
}

TEST_CASE("the discrete energy of an affine symplectic map is conserved, with a fixed point and without") {
    // A kick p -= A q + a, then a drift q += B p + b: symplectic for symmetric A and B. With a singular A there is no
    // fixed point.
    for (const double last : {1.25, 0.5}) {  // 1, 1/2; 1/2, last: the determinant is last - 1/4
        const double A[2][2] = {{1, 0.5}, {0.5, last == 0.5 ? 0.25 : last}}, B[2][2] = {{0.5, 0.25}, {0.25, 1}};
        const double a[2] = {0.3, -1}, b[2] = {0.7, 0.2};
        double E[4 * 5] = {};  // rows q, p; columns q, p, shift
        for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) {
                E[(2 + i) * 5 + j] = -A[i][j];
                E[i * 5 + 2 + j] = B[i][j];
                for (int k = 0; k < 2; ++k) E[i * 5 + j] -= B[i][k] * A[k][j];
                E[i * 5 + 4] -= B[i][j] * a[j];
            }
            E[i * 5 + 4] += b[i];
            E[(2 + i) * 5 + 4] = -a[i];
        }
        double q[2] = {0.4, -1.1}, p[2] = {0.9, 0.35};
        const double first = lobatto::discrete_energy<2>(E, q, p);
        CHECK(std::fabs(first) > 0.01);
        for (int step = 0; step < 6; ++step) {
            double q1[2], p1[2];
            lobatto::apply_map<2>(E, q, p, q1, p1);
            for (int k = 0; k < 2; ++k) {
                q[k] = q1[k];
                p[k] = p1[k];
            }
            CHECK(std::fabs(lobatto::discrete_energy<2>(E, q, p) - first) < 1e-12);
        }
    }
}
