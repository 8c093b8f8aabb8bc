// SPDX-License-Identifier: MIT
// pendulum: A plane pendulum.
//
// Lagrangian   L = m*q'^2/2 - m*omega^2*(1 - cos(q))
// Method       Lobatto, 4 points: order 6, symplectic and symmetric
//
// Written by Lobatto from a scene file. It needs C++17 and its standard library, nothing else: copy it
// where you need it. Formula numbers (D..) are those of Lobatto's docs/derivation.md.
//
//   namespace motion = lobatto::plain::pendulum;
//   motion::Parameters parameters;
//   motion::State x = motion::start(parameters);
//   while (x.t < 10 && motion::step(parameters, 0.01, x)) std::printf("%g %g\n", double(x.t), double(x.q[0]));
#pragma once

#ifdef __FAST_MATH__
#error "-Ofast and -ffast-math give wrong motions: compile this without them"
#endif

#include <cmath>
#include <limits>

namespace lobatto::plain::pendulum {

using real = double;

// Coordinates: q[0] = q [rad]
constexpr int n = 1;
// Points of a step, both ends included.
constexpr int s = 4;
// Their places in the step.
constexpr real c[4] = {0.0, 0.276393202250021, 0.7236067977499789, 1.0};
// Their weights.
constexpr real b[4] = {0.08333333333333333, 0.4166666666666667, 0.4166666666666667, 0.08333333333333333};
// Stage matrix of the inner points.
constexpr real A[2][2] = {{0.016666666666666666, -0.0015028323958245708}, {0.1848361657291579, 0.016666666666666666}};

struct Parameters {
    real m = 1.0;  // [kg m^2]
    real omega = 6.283185307179586;  // [rad/s]
};

struct State {
    real t = 0, t_rest = 0;  // the time is their sum
    real q[n] = {};  // positions
    real p[n] = {};  // momenta
};

// Relative changes this small that no longer shrink are rounding.
constexpr real rounding = 10000000 * std::numeric_limits<real>::epsilon();
constexpr real small_part = real(0.0001);

// The larger one, or not a number.
static inline real larger(real one, real other) { return one >= other || std::isnan(one) ? one : other; }
// The change of a number; what it is measured against is at least a small part of the largest of its kind, whose
// rounding it gets.
static inline real relative_change(real next, real last, const real* all) {
    real largest = 0;
    for (int k = 0; k < n; ++k) largest = larger(largest, std::fabs(all[k]));
    const real size = std::fabs(next) + std::fabs(last) + small_part * largest;
    return next == last ? 0 : std::fabs(next - last) / size;
}
// A step later; what rounding leaves out of the time is kept beside it, else it would add up.
static inline void add_time(real h, State& x) {
    const real step = h + x.t_rest, sum = x.t + step;
    x.t_rest = step - (sum - x.t);
    x.t = sum;
}
static inline bool is_finite(const State& x) {
    bool all = std::isfinite(x.t);
    for (int k = 0; k < n; ++k) all = all && std::isfinite(x.q[k]) && std::isfinite(x.p[k]);
    return all;
}

// W = M^-1 (grad V - F): minus the acceleration at q (D1).
static inline void minus_acceleration(const Parameters& parameters, real, const real* q, real* W) {
    W[0] = (parameters.omega * parameters.omega) * std::sin(q[0]);
}

// p = M v (D2).
static inline void momentum(const Parameters& parameters, const real* velocity, real* p) {
    p[0] = parameters.m * velocity[0];
}

// v = M^-1 p.
static inline void velocity(const Parameters& parameters, const real* p, real* velocity) {
    velocity[0] = p[0] / parameters.m;
}

// One step of length h from x. False: the iteration did not converge, or the step does not end at finite numbers; x is
// then what it was. Try a smaller step.
//
//   v   = u - h b_1 W(q)                                 u = M^-1 p                                            (D11)
//   Q_i = q + h c_i v - h^2 sum_j A_ij W(Q_j)            inner nodes, i = 2 ... s - 1                          (D12)
//   q1  = q + h v     - h^2 sum_j b_j (1 - c_j) W(Q_j)                                                         (D16)
//   u1  = v - h sum_j b_j W(Q_j) - h b_s W(q1)           p1 = M u1                                             (D17)
static inline bool step(const Parameters& parameters, real h, State& x) {
    real u[n], v[n], Q[s][n], W[s][n];
    velocity(parameters, x.p, u);
    minus_acceleration(parameters, x.t, x.q, W[0]);
    for (int k = 0; k < n; ++k) {
        v[k] = u[k] - h * b[0] * W[0][k];
        for (int i = 1; i < s - 1; ++i) Q[i][k] = x.q[k] + h * c[i] * v[k];
    }
    // Fixed-point iteration for (D12), until its changes are rounding.
    real change = std::numeric_limits<real>::infinity();
    for (int iteration = 0; s > 2; ++iteration) {
        const real before = change;
        change = 0;
        for (int i = 1; i < s - 1; ++i) minus_acceleration(parameters, x.t + c[i] * h, Q[i], W[i]);
        for (int i = 1; i < s - 1; ++i)
            for (int k = 0; k < n; ++k) {
                real next = x.q[k] + h * c[i] * v[k];
                for (int j = 1; j < s - 1; ++j) next -= h * h * A[i - 1][j - 1] * W[j][k];
                change = larger(change, relative_change(next, Q[i][k], x.q));
                Q[i][k] = next;
            }
        if (change <= rounding && !(change < before)) break;
        if (iteration == 100 || !(change <= rounding || iteration < 4 || change < before)) return false;
    }
    State end = x;
    add_time(h, end);
    for (int k = 0; k < n; ++k) {
        end.q[k] = x.q[k] + h * v[k];
        for (int j = 1; j < s - 1; ++j) end.q[k] -= h * h * b[j] * (1 - c[j]) * W[j][k];
    }
    minus_acceleration(parameters, end.t, end.q, W[s - 1]);
    for (int k = 0; k < n; ++k) {
        u[k] = v[k] - h * b[s - 1] * W[s - 1][k];
        for (int j = 1; j < s - 1; ++j) u[k] -= h * b[j] * W[j][k];
    }
    momentum(parameters, u, end.p);
    if (!is_finite(end)) return false;
    x = end;
    return true;
}

// H(q, p) = p^T M^-1 p / 2 + V(q) (D3).
static inline real energy(const Parameters& parameters, real, const real* q, const real* p) {
    return (parameters.m * (parameters.omega * parameters.omega)) * (1.0 - std::cos(q[0])) + p[0] * ((0.5 /
        parameters.m) * p[0]);
}
static inline real energy(const Parameters& values, const State& x) { return energy(values, x.t, x.q, x.p); }

// The start of the scene.
static inline State start(const Parameters& parameters) {
    State x;
    x.q[0] = 1.5707963267948966;
    const real v[n] = {0.0};
    momentum(parameters, v, x.p);
    return x;
}

}  // namespace lobatto::plain::pendulum
