// SPDX-License-Identifier: MIT
// pendulum: A plane pendulum.
// Written by Lobatto from a scene file; edit the scene, not this file. Formula numbers (D..): docs/derivation.md.
//
// Lagrangian   L = m*q'^2/2 - m*omega^2*(1 - cos(q))
// Method       Lobatto, 4 points: order 6, symplectic, symmetric
// Coordinates  q[0] = q [rad]
// Structure    constant mass matrix: the masses are the same everywhere, so the end of a step needs no equations
// Structure    small enough to write out: 2 unknowns a step, at most 4: every formula is written out, no loops
// Structure    no explicit time: nothing depends on the time itself: no formula takes it
// Structure    no forces: all forces come from L, so every step is symplectic
// Structure    solution in closed form: q'' = -w2*sin(q), by Jacobi elliptic functions with w2 = omega^2
// Operations   122 in all, 139 as derived: 42 additions, 75 multiplications, 2 divisions, 3 functions
#pragma once

#include "kernel.hpp"

namespace lobatto::kernels {

struct pendulum {
    using real = double;

    static constexpr const char* name = "pendulum";
    static constexpr const char* digest = "ec05864c69738335";
    static constexpr const char* method = "Lobatto, 4 points";
    static constexpr lobatto::Form form = lobatto::Form::separable;  // how a step is taken
    static constexpr int coordinates = 1;       // n
    static constexpr int order = 6;             // of accuracy in h
    static constexpr int unknowns = 2;          // of the equations of a step; 0: none to solve
    static constexpr bool any_number = true;    // formulas of a state are templates on the type of its numbers: sweeps first
    static constexpr bool linear = false;       // all second derivatives are constant
    static constexpr bool autonomous = true;    // no formula holds the time
    static constexpr bool has_energy = true;    // asked for by the scene
    static constexpr bool has_tangent = true;   // the derivative of a step
    static constexpr int parameter_count = 2;   // in the order of the scene
    static constexpr int events = 0;            // that are watched for
    static constexpr int event_direction[1] = {};
    static constexpr int points = 4;            // nodes of a step, both ends included
    static constexpr bool is_explicit = false;  // the inner nodes are solved for
    static constexpr bool unrolled = true;      // every node and coordinate is written out
    static constexpr bool diagonal_part = false;  // nothing is taken into the stage map
    static constexpr bool neighbours = false;   // coordinates are taken one by one
    static constexpr bool clean = false;        // steps as fast as can be
    static constexpr bool absorbed = false;     // Newton's iteration has its own Jacobians
    static constexpr int entries = 1;           // of M^-1 V'' that are not identically zero
    static constexpr int entry_row[1] = {0};
    static constexpr int entry_column[1] = {0};
    static constexpr bool has_remainder = false;  // forces have no function without a part
    static constexpr bool costly = true;        // forces are evaluated less often for having second derivatives
    static constexpr int angles = 1;            // whose sines and cosines node is given, anew or from those of angles near

    // nodes on [0, 1]: 0; 1/2 - sqrt(5)/10; sqrt(5)/10 + 1/2; 1
    static constexpr real c[4] = {0.0, 0.276393202250021, 0.7236067977499789, 1.0};
    // their weights: 1/12; 5/12; 5/12; 1/12
    static constexpr real b[4] = {0.08333333333333333, 0.4166666666666667, 0.4166666666666667, 0.08333333333333333};
    // stage map A_ij over the interior nodes, row-major: 1/60; 11/120 - sqrt(5)/24; sqrt(5)/24 + 11/120; 1/60
    static constexpr real A[4] = {0.016666666666666666, -0.0015028323958245708, 0.1848361657291579,
        0.016666666666666666};
    // extrapolation from the nodes of one step to the interior nodes of the next, row-major: sqrt(5) - 3; 5*sqrt(5) -
    //     9; 5 - 4*sqrt(5); 8 - 2*sqrt(5); -sqrt(5) - 3; 4*sqrt(5) + 5; -5*sqrt(5) - 9; 2*sqrt(5) + 8
    static constexpr real E[8] = {-0.7639320225002103, 2.1803398874989486, -3.9442719099991588, 3.5278640450004204,
        -5.23606797749979, 13.94427190999916, -20.18033988749895, 12.47213595499958};

    // Values of the scene; change them before prepare().
    struct Parameters {
        real m = 1.0;                    // [kg m^2]
        real omega = 6.283185307179586;  // [rad/s]
    };
    static real& parameter(Parameters& p, int index) {
        switch (index) {
            case 0: return p.m;
            default: return p.omega;
        }
    }

    // What depends on parameters and step size only, computed once by prepare().
    template <class number>
    struct CoefficientsOf {
        number m;
        number h;
        number omega_squared;  // omega*omega
        number k1;             // m*omega_squared
        number inverse_m;      // 1/m
        number k2;             // inverse_m/2
        number h_b1;           // h/12
        number h_c2;           // (1/2 - sqrt(5)/10)*h
        number h_c3;           // (sqrt(5)/10 + 1/2)*h
        number h2_A2;          // (13/120 - sqrt(5)/24)*(h*h)
        number h2_A3;          // (sqrt(5)/24 + 13/120)*(h*h)
        number k3;             // (-(sqrt(5)/20 - 7/60))*(h*h)
        number h2_AE22;        // (29*sqrt(5)/120 - 21/40)*(h*h)
        number k4;             // (-(3/10 - 3*sqrt(5)/20))*(h*h)
        number h2_AE24;        // (9/20 - 11*sqrt(5)/60)*(h*h)
        number k5;             // (-(-sqrt(5)/20 - 7/60))*(h*h)
        number h2_AE32;        // (3*sqrt(5)/20 + 3/10)*(h*h)
        number k6;             // (-(-29*sqrt(5)/120 - 21/40))*(h*h)
        number h2_AE34;        // (11*sqrt(5)/60 + 9/20)*(h*h)
        number h2_A22;         // (h*h)/60
        number h2_A23;         // (11/120 - sqrt(5)/24)*(h*h)
        number h2_A32;         // (sqrt(5)/24 + 11/120)*(h*h)
        number h2_d2;          // (sqrt(5)/24 + 5/24)*(h*h)
        number h2_d3;          // (5/24 - sqrt(5)/24)*(h*h)
        number h_b2;           // 5*h/12
    };
    using Coefficients = CoefficientsOf<real>;

    // Values of stage parameter and step size.
    static Status prepare(const Parameters& p, real h, Coefficients& k) {
        k.m = p.m;
        k.h = h;
        k.omega_squared = p.omega * p.omega;
        k.k1 = p.m * k.omega_squared;
        k.inverse_m = 1.0 / p.m;
        k.k2 = 0.5 * k.inverse_m;
        k.h_b1 = 0.08333333333333333 * h;
        k.h_c2 = 0.276393202250021 * h;
        k.h_c3 = 0.7236067977499789 * h;
        const real t1 = h * h;
        k.h2_A2 = 0.015163834270842096 * t1;
        k.h2_A3 = 0.20150283239582456 * t1;
        k.k3 = 0.004863267791677182 * t1;
        k.h2_AE22 = 0.015383094562449177 * t1;
        k.k4 = 0.03541019662496846 * t1;
        k.h2_AE24 = 0.04005420412503856 * t1;
        k.k5 = 0.22847006554165616 * t1;
        k.h2_AE32 = 0.6354101966249684 * t1;
        k.k6 = 1.0653830945624492 * t1;
        k.h2_AE34 = 0.8599457958749614 * t1;
        k.h2_A22 = 0.016666666666666666 * t1;
        k.h2_A23 = -0.0015028323958245708 * t1;
        k.h2_A32 = 0.1848361657291579 * t1;
        k.h2_d2 = 0.3015028323958246 * t1;
        k.h2_d3 = 0.11516383427084209 * t1;
        k.h_b2 = 0.4166666666666667 * h;
        const real pivot_1 = p.m;
        if (pivot_1 == real(0)) return Status::singular_mass;
        if (!lobatto::is_finite(k.m, k.h, k.omega_squared, k.k1, k.inverse_m, k.k2, k.h_b1, k.h_c2, k.h_c3, k.h2_A2,
            k.h2_A3, k.k3, k.h2_AE22, k.k4, k.h2_AE24, k.k5, k.h2_AE32, k.k6, k.h2_AE34, k.h2_A22, k.h2_A23, k.h2_A32,
            k.h2_d2, k.h2_d3, k.h_b2)) return Status::not_finite;
        return Status::ok;
    }

    // (D3) Hamiltonian H(q, p) = p^T M^-1 p / 2 + V(q); q, p: n.
    template <class given, class number>
    static number energy(const CoefficientsOf<given>& k, const number* q, const number* p) {
        return k.k1 * (1.0 - lobatto::cos(q[0])) + p[0] * (k.k2 * p[0]);
    }

    // (D2) p = dL/dq' = M q'; n each.
    template <class given, class number>
    static void momentum(const CoefficientsOf<given>& k, const number* velocity, number* p) {
        p[0] = k.m * velocity[0];
    }

    // (D2) q' = M^-1 p; n each.
    template <class given, class number>
    static void velocity(const CoefficientsOf<given>& k, const number* p, number* velocity) {
        velocity[0] = k.inverse_m * p[0];
    }

    // (D1) At one node: W = M^-1 grad V(q), n, and S = the entries of M^-1 V''(q) listed in entry_row, entry_column.
    template <class given, class number, class Angles = lobatto::AnglesAnew>
    LOBATTO_INLINE
    static void node(const CoefficientsOf<given>& k, const number* q, number* W, number* S, Angles angle = {}) {
        number sin_q, cos_q;
        angle.sincos(0, q[0], sin_q, cos_q);
        W[0] = k.omega_squared * sin_q;
        S[0] = k.omega_squared * cos_q;
    }

    // (D1) W = M^-1 grad V(q) alone; n.
    template <class given, class number>
    LOBATTO_INLINE
    static void acceleration(const CoefficientsOf<given>& k, const number* q, number* W) {
        W[0] = k.omega_squared * lobatto::sin(q[0]);
    }

    // (D11) v = u - h b_1 W0 and base_i = q + h c_i v, i = 2 ... s, node-major.
    static void drift(const Coefficients& k, const real* q, const real* u, const real* W0, real* v, real* base) {
        const real t1 = u[0] - k.h_b1 * W0[0];
        v[0] = t1;
        base[0] = q[0] + k.h_c2 * t1;
        base[1] = q[0] + k.h_c3 * t1;
        base[2] = q[0] + k.h * t1;
    }

    // (D14) First guess with constant acceleration: Q_i = base_i - h^2 (sum_j A_ij) W0.
    static void simple_start(const Coefficients& k, const real* base, const real* W0, real* Q) {
        Q[0] = base[0] - k.h2_A2 * W0[0];
        Q[1] = base[1] - k.h2_A3 * W0[0];
    }

    // (D15) First guess from the polynomial through the accelerations of the step before (s nodes): Q_i = base_i - h^2
    //     sum_j (A E)_ij W_before_j.
    static void extrapolated_start(const Coefficients& k, const real* base, const real* W_before, real* Q) {
        Q[0] = base[0] + k.k3 * W_before[0] - k.h2_AE22 * W_before[1] + k.k4 * W_before[2] - k.h2_AE24 * W_before[3];
        Q[1] = base[1] + k.k5 * W_before[0] - k.h2_AE32 * W_before[1] + k.k6 * W_before[2] - k.h2_AE34 * W_before[3];
    }

    // (D12) Interior discrete Euler-Lagrange equations, solved form: F_i = Q_i - base_i + h^2 sum_j A_ij W_j; N.
    static void residual(const Coefficients& k, const real* base, const real* Q, const real* W, real* F) {
        F[0] = Q[0] - base[0] + k.h2_A22 * W[0] + k.h2_A23 * W[1];
        F[1] = Q[1] - base[1] + k.h2_A32 * W[0] + k.h2_A22 * W[1];
    }

    // (D13) J = dF/dQ = I + h^2 A (x) S; N x N, row-major.
    static void jacobian(const Coefficients& k, const real* S, real* J) {
        J[0] = 1.0 + k.h2_A22 * S[0];
        J[1] = k.h2_A23 * S[1];
        J[2] = k.h2_A32 * S[0];
        J[3] = 1.0 + k.h2_A22 * S[1];
    }

    // (D14) Newton's correction delta = -J^-1 F; false when J is singular.
    static bool correction(const Coefficients& k, const real* base, const real* Q, const real* W, const real* S, real*
                           delta) {
        const real J_1_1 = 1.0 + k.h2_A22 * S[0];
        const real J_2_2 = 1.0 + k.h2_A22 * S[1];
        const real J_1_2 = k.h2_A23 * S[1];
        const real J_2_1 = k.h2_A32 * S[0];
        const real t1 = Q[1] - base[1] + k.h2_A32 * W[0] + k.h2_A22 * W[1];
        const real t2 = Q[0] - base[0] + k.h2_A22 * W[0] + k.h2_A23 * W[1];
        const real inverse_determinant = 1.0 / (J_1_1 * J_2_2 - J_1_2 * J_2_1);
        delta[0] = (J_1_2 * t1 - J_2_2 * t2) * inverse_determinant;
        delta[1] = (J_2_1 * t2 - J_1_1 * t1) * inverse_determinant;
        return lobatto::is_reciprocal(inverse_determinant);
    }

    // The accelerations at Q + delta, to first order: W_j += S_j delta_j.
    static void carry(const Coefficients&, const real* S, const real* delta, real* W) {
        W[0] = W[0] + S[0] * delta[0];
        W[1] = W[1] + S[1] * delta[1];
    }

    // (D16) q1 = base_s - h^2 sum_j b_j (1 - c_j) W_j.
    static void arrive(const Coefficients& k, const real* base, const real* W, real* q1) {
        q1[0] = base[2] - k.h2_d2 * W[0] - k.h2_d3 * W[1];
    }

    // (D17) u1 = v - h sum_j b_j W_j - h b_s W1, with u = M^-1 p.
    static void finish(const Coefficients& k, const real* v, const real* W, const real* W1, real* u1) {
        u1[0] = (v[0] - k.h_b1 * W1[0]) - k.h_b2 * W[0] - k.h_b2 * W[1];
    }
};

}  // namespace lobatto::kernels
