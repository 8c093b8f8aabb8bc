// SPDX-License-Identifier: GPL-2.0-or-later
// The variational integrator of a system: discrete Lagrangian, discrete Euler-Lagrange equations, momenta, Jacobian
// (docs/derivation.md).
#pragma once

#include <ginac/ginac.h>

#include <vector>

#include "generator/mechanics/system/system.hpp"
#include "generator/method/quadrature.hpp"

namespace lobatto {

// Written out for all nodes and coordinates: for people and for checks of small systems.
struct Discretisation {
    GiNaC::symbol h{"h"};
    GiNaC::symbol t0{"t0"};  // time at the left end of the step; in no formula of an autonomous system
    std::vector<std::vector<GiNaC::symbol>> Q;  // m x n: positions at the control points; Q[0] = left end, Q[m-1] =
                                                // right end of the step. Lobatto, splitting: m = s, at the nodes
    std::vector<GiNaC::symbol> p0, p1;          // n each: momenta at the ends

    GiNaC::ex L_d;  // discrete Lagrangian L_d(Q_0 ... Q_{m-1})      (paper: eq:discreteLagrangianNL)
    // Its slopes, with the virtual work of outer forces (D30).
    std::vector<std::vector<GiNaC::ex>>
        interior;                           // (m-2) x n: dL_d/dQ_j = 0                      (paper: eq:ELinternalNL)
    std::vector<GiNaC::ex> left_momentum;   // n: p0 = -dL_d/dQ_0
    std::vector<GiNaC::ex> right_momentum;  // n: p1 = +dL_d/dQ_{m-1}                        (paper: eq:rightMomentum)
    std::vector<GiNaC::ex>
        border;  // n: dL_d/dQ_{m-1} of the step before + dL_d/dQ_0 of this one = 0 (paper: eq:ELequationsNL)
    std::vector<std::vector<GiNaC::symbol>>
        Q_before;  // m x n: the positions of the step before, for `border`; Q_before[m-1] = Q[0]

    // Separable systems. The full system F_L(Q_1 ... Q_{s-2}, p1, q1) = 0 in solved form (paper: eq:internesNL,
    // eq:discreteDynamics), n s equations, and its Jacobian dF_L, (n s) x (n s), columns in the order of the unknowns
    // Q_1 ... Q_{s-2}, p1, Q_{s-1}. Not of Gauss' family.
    std::vector<GiNaC::ex> full_system;
    std::vector<GiNaC::symbol> full_unknowns;
    GiNaC::matrix full_jacobian;

    // Separable systems. The reduced form, interior unknowns only (numerics: Y_i = q0 + h c_i v - h^2 sum A_ij M^-1
    // grad V(Y_j)), n (s-2) equations and Jacobian, s the nodes with both ends of the step.
    std::vector<std::vector<GiNaC::symbol>> Y;  // s x n: positions at the nodes. Gauss: Y_i = sum_j B_ij Q_j; else Q
    std::vector<GiNaC::ex> drift_velocity;      // n: v = M^-1 (p0 - h b_0 grad V(q0))
    std::vector<GiNaC::ex> reduced_system;
    GiNaC::matrix reduced_jacobian;
    std::vector<GiNaC::ex> arrival_position;  // n: q1, explicit in the Y_j
    std::vector<GiNaC::ex> arrival_momentum;  // n: p1, explicit in the Y_j and q1
};

Discretisation discretise(const System& system, const Quadrature& quadrature);

// Positions of a step, coordinates times control points, beyond which nothing is written out: the formulas of one node
// say it all.
constexpr int written_out_limit = 60;
bool is_written_out(const System& system, const Quadrature& quadrature);

}  // namespace lobatto
