// SPDX-License-Identifier: GPL-2.0-or-later
// The closed forms against published digits, against a Taylor integrator that knows nothing of elliptic functions, and
// against themselves.
#include "runtime/measure/reference.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <numbers>

using namespace lobatto;

namespace {

using real = long double;
constexpr real pi = std::numbers::pi_v<real>;

// q'' = -w2 sin q by the Taylor series of degree 24 in steps of at most 1/64, through s = sin q, c = cos q, s' = c v,
// c' = -s v.
PhasePoint taylor_pendulum(real omega_squared, PhasePoint point, real time) {
    const int steps = static_cast<int>(std::ceil(64 * std::fabs(time)));
    const real h = time / steps;
    for (int step = 0; step < steps; ++step) {
        constexpr int degree = 24;
        std::array<real, degree + 2> q{}, v{}, s{}, c{};
        q[0] = point.q;
        v[0] = point.velocity;
        s[0] = std::sin(point.q);
        c[0] = std::cos(point.q);
        for (int k = 0; k <= degree; ++k) {
            real sine = 0, cosine = 0;
            for (int j = 0; j <= k; ++j) {
                sine += c[j] * v[k - j];
                cosine -= s[j] * v[k - j];
            }
            q[k + 1] = v[k] / (k + 1);
            v[k + 1] = -omega_squared * s[k] / (k + 1);
            s[k + 1] = sine / (k + 1);
            c[k + 1] = cosine / (k + 1);
        }
        point = {0, 0};
        for (int k = degree + 1; k >= 0; --k) point = {point.q * h + q[k], point.velocity * h + v[k]};
    }
    return point;
}

real difference(PhasePoint a, PhasePoint b) {
    return std::fmax(std::fabs(a.q - b.q), std::fabs(a.velocity - b.velocity));
}

}  // namespace

TEST_CASE("the pendulum from acos 0.4 is at the published place at t = 10") {
    const PhasePoint point = pendulum_solution(1, std::acos(0.4L), 0, 10);
    CHECK(std::fabs(point.q - -1.12259070015398108L) < 2e-17L);  // the digits given; measured 8e-18
    CHECK(std::fabs(point.velocity - -0.25825993278479811L) < 2e-17L);
}

TEST_CASE("the pendulum from q = 2 is at the published place after 119 periods") {
    const PhasePoint point = pendulum_solution(1, 2, 0, 1000);
    CHECK(std::fabs(point.q - 0.19660156778468407370L) < 5e-16L);  // measured 6e-17: the phase 1000 times 5e-20
    CHECK(std::fabs(point.velocity - 1.67145620211022756180L) < 5e-16L);
}

TEST_CASE("libration, rotation and the neighbourhood of the separatrix agree with a Taylor series") {
    struct Start {
        real omega_squared, q, velocity;
    };
    for (const Start& start :
         {Start{1, 1.5L, 0}, Start{2.7L, -1, 0.9L}, Start{1, 3, 0}, Start{1, 0.5L, 2.5L}, Start{2, 1, -4},
          Start{1, 20, 3}, Start{1, -20, 0.1L}, Start{1, 2.9L, 2 * std::cos(1.45L)}, Start{39.4L, 0, 13}}) {
        CAPTURE(static_cast<double>(start.q));
        CAPTURE(static_cast<double>(start.velocity));
        for (const real time : {0.37L, 5.0L, -5.0L}) {
            const PhasePoint closed = pendulum_solution(start.omega_squared, start.q, start.velocity, time);
            const PhasePoint summed = taylor_pendulum(start.omega_squared, {start.q, start.velocity}, time);
            // Measured 1.7e-16 for the last start, whose w is the largest and which barely passes the top; elsewhere
            // 3e-17.
            CHECK(difference(closed, summed) < 1e-15L);
        }
    }
}

TEST_CASE("on the separatrix the pendulum creeps to the top: tan(q/2) = sinh(w t)") {
    // q0 = 0, q0' = 2 w: the one start whose energy is exactly that of the top.
    for (const real time : {-3.0L, 0.0L, 0.5L, 8.0L, 40.0L}) {
        const PhasePoint point = pendulum_solution(4, 0, 4, time);
        CHECK(std::fabs(point.q - 2 * std::atan(std::sinh(2 * time))) < 1e-18L);
        CHECK(std::fabs(point.velocity - 4 / std::cosh(2 * time)) < 1e-18L);
    }
    CHECK(difference(pendulum_solution(4, 0, -4, 0.5L), taylor_pendulum(4, {0, -4}, 0.5L)) < 1e-17L);
}

TEST_CASE("a swing of 1e-10 keeps all its digits") {
    // sin q = q to 1e-20 relative: the harmonic oscillator.
    for (const real time : {1.0L, 100.0L}) {
        const PhasePoint pendulum = pendulum_solution(2, 1e-10L, 3e-10L, time),
                         harmonic = harmonic_solution(2, 1e-10L, 3e-10L, time);
        CHECK(difference(pendulum, harmonic) < 1e-26L);  // measured 3e-28
        CHECK(std::fabs(pendulum.q) > 1e-11L);
    }
}

TEST_CASE("at rest at the bottom nothing moves, and a fast rotation is uniform") {
    CHECK(difference(pendulum_solution(1, 0, 0, 5), {0, 0}) == 0);
    const PhasePoint fast = pendulum_solution(1e-12L, 0.3L, 7, 2);
    CHECK(difference(fast, {14.3L, 7}) < 1e-12L);
}

TEST_CASE("after thousands of periods the pendulum is back where it was") {
    const real period = pendulum_period(3, 2);
    for (const real count : {1.0L, -7.0L, 5000.0L}) {
        // The last digit of the period, 2^-63 of it, times the count: 3e-15 for 5000.
        CHECK(difference(pendulum_solution(3, 2, 0, count * period), {2, 0}) < 1e-18L + 4e-18L * std::fabs(count));
    }
}

TEST_CASE(
    "the period of the pendulum is 2 pi for small swings and the published 7.4162987092054876737 for a quarter turn") {
    CHECK(std::fabs(pendulum_period(1, 1e-9L) - 2 * pi) < 3e-18L);
    CHECK(std::fabs(pendulum_period(1, pi / 2) - 7.4162987092054876737L) <
          3e-18L);  // 4 K(1/sqrt2), lemniscate constant
}

TEST_CASE("the solutions satisfy the flow property") {
    for (const real velocity : {0.0L, 1.5L, 2.0L, -2.5L, 30.0L}) {
        const PhasePoint middle = pendulum_solution(1.7L, -2, velocity, 3.3L);
        CHECK(difference(pendulum_solution(1.7L, middle.q, middle.velocity, 4.4L),
                         pendulum_solution(1.7L, -2, velocity, 7.7L)) < 1e-16L);  // 2e-17
    }
}

TEST_CASE("a pendulum with negative gravity hangs from the top") {
    CHECK(difference(pendulum_solution(-1, 2.5L, 0.3L, 4), taylor_pendulum(-1, {2.5L, 0.3L}, 4)) < 1e-16L);
}

TEST_CASE("the oscillator turns, the repelled particle flees, the free one drifts") {
    const PhasePoint quarter = harmonic_solution(4, 1, 0, pi / 4);
    CHECK(difference(quarter, {0, -2}) < 1e-18L);
    const PhasePoint repelled = harmonic_solution(-4, 1, 2, 0.5L);
    CHECK(difference(repelled, {std::exp(1.0L), 2 * std::exp(1.0L)}) < 3e-18L);
    CHECK(difference(harmonic_solution(0, 1, 2, 3), {7, 2}) == 0);
}
