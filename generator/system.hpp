// SPDX-License-Identifier: GPL-2.0-or-later
// The mechanical system of a scene: L = 1/2 q'^T M q' - V(q), taken apart symbolically.
#pragma once

#include <ginac/ginac.h>

#include <vector>

#include "generator/scene.hpp"

namespace lobatto {

struct System {
    int n = 0;                              // coordinates
    std::vector<GiNaC::symbol> q, v;        // n each: positions, velocities
    std::vector<GiNaC::symbol> parameters;  // run-time parameters, scene order
    GiNaC::ex lagrangian;                   // L(q, v)
    GiNaC::matrix mass;                     // n x n, symmetric: M = d2L/dv dv, free of q and v
    GiNaC::ex potential;                    // V(q) = -L(q, 0), constant terms kept
    std::vector<GiNaC::ex> gradient;        // n: dV/dq_k
    GiNaC::matrix hessian;                  // n x n: d2V/dq_k dq_l
};

// Whether an expression is identically zero, or depends on one of the symbols once simplified. A polynomial that does
// not is told at a rational point; only what vanishes there, or is no polynomial, is expanded.
bool vanishes(const GiNaC::ex& expression);
bool depends_on(const GiNaC::ex& expression, const std::vector<GiNaC::symbol>& symbols);

// Throws InputError when L is outside the class treated (mass matrix that depends on q, terms linear or of higher
// degree in the velocity) or degenerate (M singular), naming the offending term or direction.
System build_system(const Scene& scene);

}  // namespace lobatto
