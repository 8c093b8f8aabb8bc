// SPDX-License-Identifier: GPL-2.0-or-later
// Gauss collocation by fixed-point iteration, after E. Hairer, M. Hairer, GniCodes - Matlab programs for geometric
// numerical integration, 2003 (gni_irk2): in the second-order form where the mass is constant, started from the last
// step's collocation polynomial, iterated to the rounding.
#pragma once

#include <algorithm>
#include <limits>

#include "bench/peers/legendre.hpp"
#include "bench/problems.hpp"

namespace lobatto::bench {

// s stage values of d components; few components lie beside each other by stage, many by component, for the vector
// unit.
template <class real, int s, int d>
struct Stages {
    static constexpr bool by_stage = d < s;
    std::array<real, s * d> values;

    real& at(int i, int k) { return values[by_stage ? k * s + i : i * d + k]; }

    // this += matrix f, the matrix by columns.
    void add(const std::array<std::array<real, s>, s>& matrix, const Stages& f) {
        if constexpr (by_stage) {
            for (int k = 0; k < d; ++k)
                for (int j = 0; j < s; ++j)
                    for (int i = 0; i < s; ++i) values[k * s + i] += matrix[j][i] * f.values[k * s + j];
        } else {
            for (int i = 0; i < s; ++i)
                for (int j = 0; j < s; ++j)
                    for (int k = 0; k < d; ++k) values[i * d + k] += matrix[j][i] * f.values[j * d + k];
        }
    }

    template <class Function>
    void evaluate(const Function& function, Stages& result) {
        for (int i = 0; i < s; ++i) {
            if constexpr (by_stage) {
                real x[d], y[d];
                for (int k = 0; k < d; ++k) x[k] = values[k * s + i];
                function(x, y);
                for (int k = 0; k < d; ++k) result.values[k * s + i] = y[k];
            } else {
                function(&values[i * d], &result.values[i * d]);
            }
        }
    }
};

template <class real>
inline constexpr real rounding = std::numeric_limits<real>::epsilon();
template <>
inline constexpr __float128 rounding<__float128> = exact("1.93e-34");

// `steps` steps of length h. Evaluations are returned, of the acceleration or of the slope; -1: an iteration did not
// converge. It ends when its increment, relative to the largest stage value, is below `tolerance`, or below its root
// and no longer falls.
template <int s, class Problem, class real>
long integrate_gauss(State<real, Problem::coordinates>& state, real h, long steps, real tolerance = rounding<real>) {
    constexpr int n = Problem::coordinates, d = Problem::separable ? n : 2 * n;
    static const GaussTable<real, s> table;
    const real scale = Problem::separable ? h * h : h, root = square_root(tolerance);
    auto iteration_map = Problem::separable ? table.A2 : table.A, predict = Problem::separable ? table.A2E : table.AE;
    for (int j = 0; j < s; ++j)
        for (int i = 0; i < s; ++i) iteration_map[j][i] *= scale, predict[j][i] *= scale;
    const auto function = [](const real* x, real* f) {
        if constexpr (Problem::separable)
            Problem::acceleration(x, f);
        else
            Problem::slope(x, f);
    };
    real y[2 * n];
    for (int k = 0; k < n; ++k) y[k] = state.q[k], y[n + k] = state.p[k];
    long evaluations = 1;
    Stages<real, s, d> base, X, next, F;
    {
        real f[d];
        function(y, f);
        for (int i = 0; i < s; ++i)
            for (int k = 0; k < d; ++k) F.at(i, k) = f[k];
    }
    for (long step = 0; step < steps; ++step) {
        for (int i = 0; i < s; ++i)
            for (int k = 0; k < d; ++k) base.at(i, k) = Problem::separable ? y[k] + h * table.c[i] * y[n + k] : y[k];
        X = base;
        X.add(step == 0 ? iteration_map : predict, F);
        real before = 1e300;
        for (int iteration = 0;; ++iteration) {
            X.evaluate(function, F);
            evaluations += s;
            next = base;
            next.add(iteration_map, F);
            real increment = 0, largest = 0;
            for (int i = 0; i < s * d; ++i) {
                increment = std::max(increment, magnitude(next.values[i] - X.values[i]));
                largest = std::max(largest, magnitude(next.values[i]));
            }
            X = next;
            if (increment <= tolerance * largest || (increment >= before && increment <= root * largest)) break;
            if (!(increment < 1e6) || iteration == 50) return -1;
            before = increment;
        }
        for (int k = 0; k < n; ++k) {
            if constexpr (Problem::separable) {
                real dq = h * y[n + k], dp = 0;
                for (int j = 0; j < s; ++j) {
                    dq += scale * table.beta[j] * F.at(j, k);
                    dp += table.b[j] * F.at(j, k);
                }
                y[k] += dq;
                y[n + k] += h * dp;
            } else {
                real dq = 0, dp = 0;
                for (int j = 0; j < s; ++j) {
                    dq += table.b[j] * F.at(j, k);
                    dp += table.b[j] * F.at(j, n + k);
                }
                y[k] += h * dq;
                y[n + k] += h * dp;
            }
        }
    }
    for (int k = 0; k < n; ++k) state.q[k] = y[k], state.p[k] = y[n + k];
    return evaluations;
}

}  // namespace lobatto::bench
