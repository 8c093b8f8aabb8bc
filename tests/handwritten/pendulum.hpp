// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's four-point scheme for the pendulum V = m omega^2 (1 - cos q), written by hand: the reference for emitted
// kernels.
//
// Eliminating q_r and p_r from eq:internesNL and eq:discreteDynamics leaves, with W = V'/m = omega^2 sin q and u = p/m,
//     v       = u - h/12 W_l
//     q_xi    = q_l + h xi v     - h^2 [ 1/60 W_xi             + (11 - 5 sqrt5)/120 W_{1-xi} ]
//     q_{1-xi}= q_l + h (1-xi) v - h^2 [ (11 + 5 sqrt5)/120 W_xi + 1/60 W_{1-xi} ]
//     q_r     = q_l + h v        - h^2 [ (5 + sqrt5)/24 W_xi     + (5 - sqrt5)/24 W_{1-xi} ]
//     u_r     = v - h [ 5/12 W_xi + 5/12 W_{1-xi} + 1/12 W_r ]
// The test "one step of the hand-written kernel satisfies the paper's equations" checks this elimination.
#pragma once

#include <cmath>

#include "runtime/kernel/kernel.hpp"

namespace lobatto {

struct HandwrittenPendulum : KernelDefaults {
    using real = double;
    static constexpr int coordinates = 1;
    static constexpr int points = 4;
    static constexpr int order = 6;
    static constexpr int unknowns = 2;  // q_xi, q_{1-xi}
    static constexpr int parameter_count = 2;
    static constexpr int entries = 1;  // S = V''/m has one entry
    static constexpr Form form = Form::separable;
    static constexpr bool autonomous = true, has_energy = true, has_tangent = true;
    static constexpr bool any_number = false, uses_hessian = true;
    static constexpr const char* method = "Lobatto, 4 points";
    static constexpr const char* name = "handwritten_pendulum";
    static constexpr const char* digest = "0123456789abcdef";
    static constexpr int entry_row[1] = {0};
    static constexpr int entry_column[1] = {0};
    static constexpr int position[1] = {0}, group_count = 1, group_first[2] = {0, 1}, group_bandwidth[1] = {0};

    static constexpr real root5 = 2.2360679774997896964;
    static constexpr real xi = 0.27639320225002103036;  // 1/2 - sqrt5/10
    static constexpr real c[4] = {0, xi, 1 - xi, 1};
    static constexpr real b[4] = {1.0 / 12, 5.0 / 12, 5.0 / 12, 1.0 / 12};
    static constexpr real A[4] = {1.0 / 60, (11 - 5 * root5) / 120, (11 + 5 * root5) / 120, 1.0 / 60};

    // The cubic through the nodes of one step, at the inner nodes of the next.
    static constexpr real E[8] = {root5 - 3,  5 * root5 - 9, 5 - 4 * root5,  8 - 2 * root5,
                                  -root5 - 3, 4 * root5 + 5, -5 * root5 - 9, 2 * root5 + 8};

    struct Parameters {
        real m, omega;
    };
    static real& parameter(Parameters& parameters, int i) { return i == 0 ? parameters.m : parameters.omega; }

    struct Coefficients {
        real m, omega_squared;
        real hc[3];       // h xi, h (1 - xi), h
        real hb[4];       // h b
        real inner[4];    // h^2 A, 2 x 2
        real arrival[2];  // h^2 b (1 - c) of the inner nodes
        real start[8];    // 2 x 4: h^2 A times the cubic through the last step's accelerations at 1 + xi and 2 - xi
    };

    static Status prepare(const Parameters& parameters, real h, Coefficients& k) {
        k.m = parameters.m;
        k.omega_squared = parameters.omega * parameters.omega;
        for (int i = 0; i < 3; ++i) k.hc[i] = h * c[i + 1];
        for (int i = 0; i < 4; ++i) k.hb[i] = h * b[i];
        for (int i = 0; i < 4; ++i) k.inner[i] = h * h * A[i];
        k.arrival[0] = h * h * (5 + root5) / 24;
        k.arrival[1] = h * h * (5 - root5) / 24;
        for (int j = 0; j < 4; ++j) {
            real basis[2] = {1, 1};  // Lagrange's, of node j
            for (int i = 0; i < 2; ++i) {
                for (int l = 0; l < 4; ++l) {
                    if (l != j) basis[i] *= (1 + c[i + 1] - c[l]) / (c[j] - c[l]);
                }
            }
            k.start[j] = k.inner[0] * basis[0] + k.inner[1] * basis[1];
            k.start[4 + j] = k.inner[2] * basis[0] + k.inner[3] * basis[1];
        }
        return parameters.m != 0 ? Status::ok : Status::singular_mass;
    }

    static real energy(const Coefficients& k, const real* q, const real* p) {
        return p[0] * p[0] / (2 * k.m) + k.m * k.omega_squared * (1 - std::cos(q[0]));
    }
    static void momentum(const Coefficients& k, const real* velocity, real* p) { p[0] = k.m * velocity[0]; }
    static void velocity(const Coefficients& k, const real* p, real* velocity) { velocity[0] = p[0] / k.m; }

    static void minus_acceleration(const Coefficients& k, const real* q, real* W) {
        real sine, cosine;
        sincos(q[0], sine, cosine);
        W[0] = k.omega_squared * sine;
    }
    static void node(const Coefficients& k, const real* q, real* W, real* S) {
        real sine, cosine;
        sincos(q[0], sine, cosine);
        W[0] = k.omega_squared * sine;
        S[0] = k.omega_squared * cosine;
    }

    // base: what is known of q_xi, q_{1-xi} and q_r before the inner accelerations are.
    static void drift(const Coefficients& k, const real* q, const real* u, const real* W0, real* v, real* base) {
        v[0] = u[0] - k.hb[0] * W0[0];
        for (int i = 0; i < 3; ++i) base[i] = q[0] + k.hc[i] * v[0];
    }

    static void simple_start(const Coefficients& k, const real* base, const real* W0, real* Q) {
        for (int i = 0; i < 2; ++i) Q[i] = base[i] - (k.inner[2 * i] + k.inner[2 * i + 1]) * W0[0];
    }

    static void extrapolated_start(const Coefficients& k, const real* base, const real* W_previous, real* Q) {
        for (int i = 0; i < 2; ++i) {
            real sum = 0;
            for (int j = 0; j < 4; ++j) sum += k.start[4 * i + j] * W_previous[j];
            Q[i] = base[i] - sum;
        }
    }

    static void residual(const Coefficients& k, const real* base, const real* Q, const real* W, real* F) {
        for (int i = 0; i < 2; ++i) F[i] = Q[i] - base[i] + (k.inner[2 * i] * W[0] + k.inner[2 * i + 1] * W[1]);
    }

    static void jacobian(const Coefficients& k, const real* S, real* J) {
        J[0] = 1 + k.inner[0] * S[0];
        J[1] = k.inner[1] * S[1];
        J[2] = k.inner[2] * S[0];
        J[3] = 1 + k.inner[3] * S[1];
    }

    static bool correction(const Coefficients& k, const real* base, const real* Q, const real* W, const real* S,
                           real* delta) {
        real F[2], J[4];
        residual(k, base, Q, W, F);
        jacobian(k, S, J);
        const real determinant = J[0] * J[3] - J[1] * J[2];
        delta[0] = -(J[3] * F[0] - J[1] * F[1]) / determinant;
        delta[1] = -(J[0] * F[1] - J[2] * F[0]) / determinant;
        return determinant != 0;
    }

    static void carry(const Coefficients&, const real* S, const real* delta, real* W) {
        for (int i = 0; i < 2; ++i) W[i] += S[i] * delta[i];
    }

    static void arrive(const Coefficients& k, const real* base, const real* W, real* q1) {
        q1[0] = base[2] - (k.arrival[0] * W[0] + k.arrival[1] * W[1]);
    }

    static void finish(const Coefficients& k, const real* v, const real* W, const real* W1, real* u1) {
        u1[0] = v[0] - (k.hb[1] * W[0] + k.hb[2] * W[1]) - k.hb[3] * W1[0];
    }
};

}  // namespace lobatto
