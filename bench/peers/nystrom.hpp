// SPDX-License-Identifier: GPL-2.0-or-later
// Dormand, El-Mikkawy and Prince's explicit Runge-Kutta-Nystroem pair of orders 12 and 10, with fixed or adaptive
// steps.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "bench/peers/nystrom_table.hpp"
#include "bench/problems.hpp"

namespace lobatto::bench {

// Put where it is used: the compiler alone gives up in functions as large as a step or a series written out.
#define WRITTEN_OUT __attribute__((always_inline))

// Calls action(std::integral_constant<int, i>) for i = 0 ... count - 1: loops whose zero coefficients cost nothing.
template <int count, class Action>
WRITTEN_OUT inline void unrolled(const Action& action) {
    [&]<int... i>(std::integer_sequence<int, i...>) WRITTEN_OUT {
        (action(std::integral_constant<int, i>()), ...);
    }
    (std::make_integer_sequence<int, count>());
}

// One step; the increments of q and p, and how far those of order 10 differ. f[0] holds a(q).
template <class Problem, class real>
struct NystromStep {
    static constexpr int n = Problem::coordinates, stages = NystromTable::stages;
    real f[stages][n], dq[n], dp[n], error_q[n], error_p[n];

    void take(const real* q, const real* p, real h) {
        const real h2 = h * h;
        unrolled<stages - 1>([&](auto previous) {
            constexpr int i = previous + 1;
            real sum[n] = {}, Q[n];
            unrolled<i>([&](auto j) {
                if constexpr (nystrom_12.a[i][j] != 0)
                    for (int k = 0; k < n; ++k) sum[k] += static_cast<real>(nystrom_12.a[i][j]) * f[j][k];
            });
            for (int k = 0; k < n; ++k) Q[k] = q[k] + static_cast<real>(nystrom_12.c[i]) * h * p[k] + h2 * sum[k];
            Problem::acceleration(Q, f[i]);
        });
        for (int k = 0; k < n; ++k) dq[k] = dp[k] = error_q[k] = error_p[k] = 0;
        unrolled<stages>([&](auto j) {
            constexpr const NystromTable& t = nystrom_12;
            for (int k = 0; k < n; ++k) {
                if constexpr (t.b[j] != 0) dq[k] += static_cast<real>(t.b[j]) * f[j][k];
                if constexpr (t.slope_b[j] != 0) dp[k] += static_cast<real>(t.slope_b[j]) * f[j][k];
                if constexpr (t.b[j] != 0) error_q[k] += static_cast<real>(t.b[j] - t.lower_b[j]) * f[j][k];
                if constexpr (t.slope_b[j] != 0)
                    error_p[k] += static_cast<real>(t.slope_b[j] - t.lower_slope_b[j]) * f[j][k];
            }
        });
        for (int k = 0; k < n; ++k) {
            dq[k] = h * p[k] + h2 * dq[k];
            dp[k] *= h;
            error_q[k] *= h2;
            error_p[k] *= h;
        }
    }
};

template <class Problem, class real>
long integrate_nystrom_fixed(State<real, Problem::coordinates>& state, real h, long steps) {
    NystromStep<Problem, real> step;
    for (long i = 0; i < steps; ++i) {
        Problem::acceleration(state.q.data(), step.f[0]);
        step.take(state.q.data(), state.p.data(), h);
        for (int k = 0; k < Problem::coordinates; ++k) state.q[k] += step.dq[k], state.p[k] += step.dp[k];
    }
    return steps * NystromTable::stages;
}

struct AdaptiveCount {
    long steps, evaluations;
};

// To the time `until`, each step's difference of the two orders below tolerance (1 + |y|).
template <class Problem>
AdaptiveCount integrate_nystrom(State<double, Problem::coordinates>& state, double until, double tolerance) {
    constexpr int n = Problem::coordinates;
    NystromStep<Problem, double> step;
    double t = 0, h = 0.1;
    AdaptiveCount count{0, 1};
    Problem::acceleration(state.q.data(), step.f[0]);
    while (t < until) {
        const bool last = t + h * (1 + 1e-10) >= until;
        if (last) h = until - t;
        step.take(state.q.data(), state.p.data(), h);
        count.evaluations += NystromTable::stages - 1;
        double error = 0;
        for (int k = 0; k < n; ++k) {
            error = std::max(error, std::fabs(step.error_q[k]) / (1 + std::fabs(state.q[k])));
            error = std::max(error, std::fabs(step.error_p[k]) / (1 + std::fabs(state.p[k])));
        }
        const double ratio = error / tolerance;
        const bool good = ratio <= 1;
        if (good) {
            for (int k = 0; k < n; ++k) state.q[k] += step.dq[k], state.p[k] += step.dp[k];
            t = last ? until : t + h;
            ++count.steps;
            ++count.evaluations;
            Problem::acceleration(state.q.data(), step.f[0]);
        }
        // The error of order 10 falls with h^11.
        h *= std::clamp(0.9 * std::pow(std::max(ratio, 1e-30), -1.0 / 11), 0.2, good ? 4.0 : 0.9);
        if (!(h > 1e-12 * until)) return {-1, count.evaluations};
    }
    return count;
}

}  // namespace lobatto::bench
