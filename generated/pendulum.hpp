// SPDX-License-Identifier: MIT
// pendulum: A plane pendulum.
// Written by Lobatto from a scene file; edit the scene, not this file. Formula numbers (D..): docs/derivation.md.
//
// Lagrangian   L = m*q'^2/2 - m*omega^2*(1 - cos(q))
// Method       Lobatto, 4 points: order 6, symplectic, symmetric
// Coordinates  q[0] = q [rad]
// Structure    constant mass matrix: M is the same everywhere, so the end of a step follows without equations
// Structure    no explicit time: t appears nowhere, so no formula takes it
// Structure    no forces: all forces come from L, so every step is symplectic
// Structure    solution in closed form: q'' = -w2*sin(q), by Jacobi elliptic functions with w2 = omega^2
// Operations   16 in all, 18 as derived: 2 additions, 10 multiplications, 1 divisions, 3 functions
#pragma once

#include "kernel.hpp"

namespace lobatto::kernels { inline namespace of_7723d3c1a30c689c {

struct pendulum : lobatto::KernelDefaults {
    using real = double;

    static constexpr const char* name = "pendulum";
    static constexpr const char* digest = "7723d3c1a30c689c";
    static constexpr const char* method = "Lobatto, 4 points";
    static constexpr lobatto::Form form = lobatto::Form::separable;  // how a step is taken
    static constexpr int coordinates = 1;       // n
    static constexpr int order = 6;             // of accuracy in h
    static constexpr int unknowns = 2;          // of the equations of a step; 0: none to solve
    static constexpr bool any_number = true;    // formulas are templates on the type of numbers: fixed-point iteration first
    static constexpr bool autonomous = true;    // no formula holds the time
    static constexpr bool has_energy = true;    // asked for by the scene
    static constexpr bool has_tangent = true;   // the derivative of a step
    static constexpr int parameter_count = 2;   // in the order of the scene
    static constexpr int points = 4;            // nodes of a step, both ends included
    static constexpr int entries = 1;           // of M^-1 V'' that are not identically zero
    static constexpr int entry_row[1] = {0};
    static constexpr int entry_column[1] = {0};
    // Unknowns of coordinate a stand at position[a]; groups are solved by themselves.
    static constexpr int position[1] = {0};
    static constexpr int group_count = 1;       // groups of coupled coordinates
    static constexpr int group_first[2] = {0, 1};
    static constexpr int group_bandwidth[1] = {0};
    static constexpr bool uses_hessian = true;  // forces are evaluated less often for having second derivatives

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
        number omega_squared;  // omega*omega
        number k1;             // m*omega_squared
        number inverse_m;      // 1/m
        number k2;             // inverse_m/2
    };
    using Coefficients = CoefficientsOf<real>;

    // The coefficients of these parameters and this step size.
    static Status prepare(const Parameters& p, real, Coefficients& k) {
        k.m = p.m;
        k.omega_squared = p.omega * p.omega;
        k.k1 = p.m * k.omega_squared;
        k.inverse_m = 1.0 / p.m;
        k.k2 = 0.5 * k.inverse_m;
        const real pivot_1 = p.m;
        if (pivot_1 == real(0)) return Status::singular_mass;
        if (!lobatto::is_finite(k.m, k.omega_squared, k.k1, k.inverse_m, k.k2)) return Status::not_finite;
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
    template <class given, class number>
    LOBATTO_INLINE
    static void node(const CoefficientsOf<given>& k, const number* q, number* W, number* S) {
        number sin_q, cos_q;
        lobatto::sincos(q[0], sin_q, cos_q);
        W[0] = k.omega_squared * sin_q;
        S[0] = k.omega_squared * cos_q;
    }

    // (D1) W = M^-1 grad V(q) alone; n.
    template <class given, class number>
    LOBATTO_INLINE
    static void minus_acceleration(const CoefficientsOf<given>& k, const number* q, number* W) {
        W[0] = k.omega_squared * lobatto::sin(q[0]);
    }
};

}}  // namespace lobatto::kernels
