// SPDX-License-Identifier: MIT
// harmonic_oscillator: A harmonic oscillator.
// Written by Lobatto from a scene file; edit the scene, not this file. Formula numbers (D..): docs/derivation.md.
//
// Lagrangian   L = m*q'^2/2 - m*omega^2*q^2/2
// Method       Lobatto, 4 points: order 6, symplectic, symmetric
// Coordinates  q[0] = q [m]
// Structure    constant mass matrix: M is the same everywhere, so the end of a step follows without equations
// Structure    linear system: all forces are linear, so a step is a product with one matrix, without iteration
// Structure    no explicit time: t appears nowhere, so no formula takes it
// Structure    no forces: all forces come from L, so every step is symplectic
// Structure    solution in closed form: q'' = -w2*q with w2 = omega^2
// Operations   52 in all, 57 as derived: 14 additions, 35 multiplications, 3 divisions, 0 functions
#pragma once

#include "kernel.hpp"

namespace lobatto::kernels { inline namespace of_9d7d90533142377f {

struct harmonic_oscillator : lobatto::KernelDefaults {
    using real = double;

    static constexpr const char* name = "harmonic_oscillator";
    static constexpr const char* digest = "9d7d90533142377f";
    static constexpr const char* method = "Lobatto, 4 points";
    static constexpr lobatto::Form form = lobatto::Form::linear_map;  // how a step is taken
    static constexpr int coordinates = 1;       // n
    static constexpr int order = 6;             // of accuracy in h
    static constexpr int unknowns = 0;          // of the equations of a step; 0: none to solve
    static constexpr bool any_number = true;    // formulas are templates on the type of numbers: fixed-point iteration first
    static constexpr bool linear = true;        // all second derivatives are constant
    static constexpr bool autonomous = true;    // no formula holds the time
    static constexpr bool has_energy = true;    // asked for by the scene
    static constexpr bool has_tangent = true;   // the derivative of a step
    static constexpr int parameter_count = 2;   // in the order of the scene
    static constexpr int points = 4;            // nodes of a step, both ends included
    static constexpr int entries = 1;           // of M^-1 V'' that are not identically zero
    static constexpr int entry_row[1] = {0};
    static constexpr int entry_column[1] = {0};

    // nodes on [0, 1]: 0; 1/2 - sqrt(5)/10; sqrt(5)/10 + 1/2; 1
    static constexpr real c[4] = {0.0, 0.276393202250021, 0.7236067977499789, 1.0};
    // their weights: 1/12; 5/12; 5/12; 1/12
    static constexpr real b[4] = {0.08333333333333333, 0.4166666666666667, 0.4166666666666667, 0.08333333333333333};
    // stage map A_ij over the interior nodes, row-major: 1/60; 11/120 - sqrt(5)/24; sqrt(5)/24 + 11/120; 1/60
    static constexpr real A[4] = {0.016666666666666666, -0.0015028323958245708, 0.1848361657291579,
        0.016666666666666666};

    // Values of the scene; change them before prepare().
    struct Parameters {
        real m = 1.0;                    // [kg]
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
        number omega_squared;  // omega*omega
        number k1;             // m*omega_squared/2
        number inverse_m;      // 1/m
        number k2;             // inverse_m/2
        number Phi_minus_I[6];  // what a step adds: rows q1, p1; columns q, p, shift
    };
    using Coefficients = CoefficientsOf<real>;

    // The coefficients of these parameters and this step size.
    static Status prepare(const Parameters& p, real h, Coefficients& k) {
        k.m = p.m;
        k.omega_squared = p.omega * p.omega;
        k.k1 = 0.5 * p.m * k.omega_squared;
        k.inverse_m = 1.0 / p.m;
        k.k2 = 0.5 * k.inverse_m;
        const real pivot_1 = p.m;
        const real z = k.omega_squared * (h * h);
        const real delta = 1.0 + z * (0.03333333333333333 + 0.0005555555555555556 * z);
        const real a_minus_delta = z * (z * (0.025 - 0.0002777777777777778 * z) - 0.5);
        const real phi_b = z * (z * (0.13333333333333333 + z * (2.3148148148148147e-05 * z - 0.0033333333333333335)) -
            1.0);
        const real phi_c = 1.0 + z * (0.0033333333333333335 * z - 0.13333333333333333);
        const real t1 = 1.0 / delta;
        k.Phi_minus_I[0] = t1 * a_minus_delta;
        k.Phi_minus_I[1] = k.inverse_m * h * t1 * phi_c;
        k.Phi_minus_I[2] = 0.0;
        k.Phi_minus_I[3] = p.m * t1 * phi_b / h;
        k.Phi_minus_I[4] = k.Phi_minus_I[0];
        k.Phi_minus_I[5] = k.Phi_minus_I[2];
        if (pivot_1 == real(0)) return Status::singular_mass;
        if (delta == real(0)) return Status::singular_jacobian;
        if (!lobatto::is_finite(k.m, k.omega_squared, k.k1, k.inverse_m, k.k2, k.Phi_minus_I[0], k.Phi_minus_I[1],
            k.Phi_minus_I[2], k.Phi_minus_I[3], k.Phi_minus_I[4], k.Phi_minus_I[5])) return Status::not_finite;
        lobatto::round_to_unit_determinant(k.Phi_minus_I);
        return Status::ok;
    }

    // (D3) Hamiltonian H(q, p) = p^T M^-1 p / 2 + V(q); q, p: n.
    template <class given, class number>
    static number energy(const CoefficientsOf<given>& k, const number* q, const number* p) {
        return k.k1 * (q[0] * q[0]) + p[0] * (k.k2 * p[0]);
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
    template <class given, class number>
    static void node(const CoefficientsOf<given>& k, const number* q, number* W, number* S) {
        W[0] = k.omega_squared * q[0];
        S[0] = k.omega_squared;
    }

    // (D1) W = M^-1 grad V(q) alone; n.
    template <class given, class number>
    static void minus_acceleration(const CoefficientsOf<given>& k, const number* q, number* W) {
        W[0] = k.omega_squared * q[0];
    }

    // (D20) The whole step: (q1, p1) = Phi (q, p) + shift, as (q, p) + (Phi - I) (q, p) + shift.
    template <class given, class number>
    static void propagate(const CoefficientsOf<given>& k, const number* q, const number* p, number* q1, number* p1) {
        q1[0] = q[0] + (q[0] * k.Phi_minus_I[0] + p[0] * k.Phi_minus_I[1]);
        p1[0] = p[0] + (q[0] * k.Phi_minus_I[3] + p[0] * k.Phi_minus_I[4]);
    }

    // (D21) The energy that the steps conserve exactly, nearly h times H(q, p); q, p: n.
    template <class given, class number>
    static number discrete_energy(const CoefficientsOf<given>& k, const number* q, const number* p) {
        return lobatto::discrete_energy<coordinates>(k.Phi_minus_I, q, p);
    }
};

}}  // namespace lobatto::kernels
