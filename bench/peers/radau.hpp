// SPDX-License-Identifier: GPL-2.0-or-later
// Gauss-Radau collocation of order 15 for q'' = a(q) by predictor and corrector, with steps from the last coefficient
// of the acceleration's polynomial and compensated sums: E. Everhart, An efficient integrator that uses Gauss-Radau
// spacings, in Dynamics of Comets, 1985, 185-202; H. Rein and D. S. Spiegel, IAS15, MNRAS 446 (2015) 1424-1437.
#pragma once

#include <algorithm>
#include <cmath>

#include "bench/peers/nystrom.hpp"

namespace lobatto::bench {

// With x = (t - t0)/h: a = a_0 + sum over j < 7 of b_j x^(j+1) = a_0 + sum of g_j x (x - c_1) ... (x - c_j).
struct RadauTable {
    static constexpr int nodes = 8;
    // Zeros of (P_7 + P_8)(2x - 1), as both papers print them.
    std::array<__float128, nodes> c = {0,
                                       exact("0.0562625605369221464656522"),
                                       exact("0.1802406917368923649875799"),
                                       exact("0.3526247171131696373739078"),
                                       exact("0.5471536263305553830014486"),
                                       exact("0.7342101772154105315232106"),
                                       exact("0.8853209468390957680903598"),
                                       exact("0.9775206135612875018911745")};
    std::array<std::array<__float128, 7>, 7> power{};     // [j][i]: of x^(i+1) in x (x - c_1) ... (x - c_j)
    std::array<std::array<__float128, 7>, nodes> over{};  // [i][j]: 1 / (c_i - c_j), j < i
    std::array<std::array<__float128, 7>, 7> binomial{};  // [j][k]: k + 1 over j + 1

    constexpr RadauTable() {
        for (int j = 0; j < 7; ++j) {
            power[j][j] = 1;
            for (int i = 0; i < j; ++i) power[j][i] = (i > 0 ? power[j - 1][i - 1] : 0) - c[j] * power[j - 1][i];
        }
        for (int i = 1; i < nodes; ++i)
            for (int j = 0; j < i; ++j) over[i][j] = 1 / (c[i] - c[j]);
        for (int j = 0; j < 7; ++j)
            for (int k = j; k < 7; ++k) binomial[j][k] = k == j ? 1 : binomial[j][k - 1] * (k + 1) / (k - j);
    }
};
inline constexpr RadauTable radau_15;

// The steps of one trajectory. The polynomial of a step, carried on to the next, is where its iteration begins.
template <class Problem, class real>
struct RadauStep {
    static constexpr int n = Problem::coordinates;
    static constexpr const RadauTable& table = radau_15;
    using Coefficients = std::array<std::array<real, n>, 7>;

    std::array<real, n> q, p, a, lost_q{}, lost_p{};  // lost: what roundings have added
    Coefficients b{}, g{}, predicted{}, last_b{}, last_predicted{};
    long evaluations = 1;

    explicit RadauStep(const State<real, n>& state) : q(state.q), p(state.p) {
        Problem::acceleration(q.data(), a.data());
    }

    // The polynomial over h, until b_6 stands still relative to the acceleration, or no longer comes to rest.
    bool solve(real h, real tolerance) {
        real before = 2;
        for (int iteration = 0; iteration < 12; ++iteration) {
            real change = 0, largest = 0;
            unrolled<7>([&](auto previous) WRITTEN_OUT {
                constexpr int i = previous + 1;
                constexpr real c = static_cast<real>(table.c[i]);
                real Q[n], f[n];
                for (int k = 0; k < n; ++k) {
                    real sum = 0;
                    unrolled<7>([&](auto backwards) WRITTEN_OUT {
                        constexpr int j = 6 - backwards;
                        sum = (sum + b[j][k] * (real(1) / ((j + 2) * (j + 3)))) * c;
                    });
                    Q[k] = q[k] + (c * h) * (p[k] + (c * h) * (a[k] / 2 + sum));
                }
                Problem::acceleration(Q, f);
                for (int k = 0; k < n; ++k) {
                    real difference = (f[k] - a[k]) * static_cast<real>(table.over[i][0]);
                    unrolled<i - 1>([&](auto j) WRITTEN_OUT {
                        difference = (difference - g[j][k]) * static_cast<real>(table.over[i][j + 1]);
                    });
                    const real moved = difference - g[i - 1][k];
                    g[i - 1][k] = difference;
                    unrolled<i>([&](auto j)
                                    WRITTEN_OUT { b[j][k] += static_cast<real>(table.power[i - 1][j]) * moved; });
                    if constexpr (i == 7) {
                        change = std::max(change, magnitude(moved));
                        largest = std::max(largest, magnitude(f[k]));
                    }
                }
            });
            evaluations += 7;
            if (!(change < real(1e6) * largest || change == 0)) return false;
            const real relative = largest > 0 ? change / largest : real(0);
            if (relative < tolerance || (iteration > 1 && relative >= before)) break;
            before = relative;
        }
        return true;
    }

    // max |b_6| / max |a|, of the start: what the step size is chosen by.
    real last_term() const {
        real largest = 0, acceleration = 0;
        for (int k = 0; k < n; ++k) {
            largest = std::max(largest, magnitude(b[6][k]));
            acceleration = std::max(acceleration, magnitude(a[k]));
        }
        return acceleration > 0 ? largest / acceleration : largest;
    }

    void accept(real h) {
        const auto add = [](real& x, real& lost, real increment) {
            const real added = increment - lost, next = x + added;
            lost = (next - x) - added;
            x = next;
        };
        for (int k = 0; k < n; ++k) {
            real q_sum = 0, p_sum = 0;
            for (int j = 6; j >= 0; --j) {
                q_sum += b[j][k] * (real(1) / ((j + 2) * (j + 3)));
                p_sum += b[j][k] * (real(1) / (j + 2));
            }
            add(q[k], lost_q[k], h * (p[k] + h * (a[k] / 2 + q_sum)));
            add(p[k], lost_p[k], h * (a[k] + p_sum));
        }
        Problem::acceleration(q.data(), a.data());
        ++evaluations;
        last_b = b;
        last_predicted = predicted;
    }

    // The last accepted polynomial, over `ratio` of its step beyond its end, and what the last prediction missed.
    void predict(real ratio) {
        real factor = 1;
        for (int j = 0; j < 7; ++j) {
            factor *= ratio;
            for (int k = 0; k < n; ++k) {
                real sum = 0;
                for (int i = j; i < 7; ++i) sum += static_cast<real>(table.binomial[j][i]) * last_b[i][k];
                predicted[j][k] = ratio > 20 ? real(0) : factor * sum;
                b[j][k] = ratio > 20 ? real(0) : predicted[j][k] + (last_b[j][k] - last_predicted[j][k]);
            }
        }
        // The divided differences of that polynomial: its coefficients by the products x (x - c_1) ... instead.
        for (int k = 0; k < n; ++k) {
            std::array<real, 7> rest;
            for (int j = 0; j < 7; ++j) rest[j] = b[j][k];
            for (int j = 6; j >= 0; --j) {
                g[j][k] = rest[j];
                for (int i = 0; i < j; ++i) rest[i] -= static_cast<real>(table.power[j][i]) * g[j][k];
            }
        }
    }
};

// Steps of one length.
template <class Problem, class real>
long integrate_radau_fixed(State<real, Problem::coordinates>& state, real h, long steps, real tolerance) {
    RadauStep<Problem, real> step(state);
    for (long i = 0; i < steps; ++i) {
        if (!step.solve(h, tolerance)) return -1;
        step.accept(h);
        step.predict(1);
    }
    state = {step.q, step.p};
    return step.evaluations;
}

// To the time `until`: steps such that |b_6| is `tolerance` of |a|, to the power 1/7; a step that should have been
// shorter than a quarter is taken again, one that may be four times as long grows by four.
template <class Problem>
AdaptiveCount integrate_radau(State<double, Problem::coordinates>& state, double until, double tolerance,
                              long most_steps) {
    RadauStep<Problem, double> step(state);
    double t = 0, lost_t = 0, h = 0.01, last_h = 0;
    AdaptiveCount count{0, 0};
    while (count.steps < most_steps) {
        const double left = (until - t) + lost_t;
        const bool is_last = h >= left;
        if (is_last) h = left;
        if (last_h > 0) step.predict(h / last_h);
        const bool solved = step.solve(h, 1e-16);
        const double term = step.last_term();
        const double ratio = !solved ? 0.1 : term > 0 ? std::pow(tolerance / term, 1.0 / 7) : 4;
        if (!(ratio >= 0.25)) {
            h *= ratio > 0 ? ratio : 0.1;
            if (last_h == 0) step.b = step.g = {};
            if (!(h > 1e-14 * until)) return {-1, step.evaluations};
            continue;
        }
        step.accept(h);
        ++count.steps;
        if (is_last) {
            state = {step.q, step.p};
            return {count.steps, step.evaluations};
        }
        const double added = h - lost_t, next = t + added;
        lost_t = (next - t) - added;
        t = next;
        last_h = h;
        h *= std::min(ratio, 4.0);
    }
    return {-1, step.evaluations};
}

}  // namespace lobatto::bench
