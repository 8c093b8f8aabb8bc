// SPDX-License-Identifier: GPL-2.0-or-later
// The steps that a compiled kernel takes, put into the equations that it was derived from.
#pragma once

#include <vector>

#include "generator/mechanics/derivation.hpp"
#include "runtime/build/library.hpp"

namespace lobatto {

// How much the first steps of one trajectory leave in the discrete Euler-Lagrange equations, in units of rounding
// (equations_left in generator/check/check.hpp): the largest of the first three steps, which have no step before them,
// one and two, as far as they succeed. The kernel takes them as in any run. ComputationError when the first one fails.
template <class real>
double trajectory_leaves(const Derivation& derivation, const Kernel& kernel, const std::vector<real>& parameters,
                         const std::vector<real>& q, const std::vector<real>& p, real step);

// The same of one lane of an ensemble; the positions inside its steps are those of `kernel`, which begins where the
// lane does.
double lane_leaves(const Derivation& derivation, const Kernel& kernel, const Kernel& ensemble_kernel,
                   const std::vector<double>& parameters, const std::vector<double>& q, const std::vector<double>& p,
                   double step);

// The kernel's Jacobian of a step's equations, with which Newton's iteration solves them where the fixed-point
// iteration does not contract, against central differences of the equations, along a seeded direction: the relative
// difference.
double jacobian_defect(const Derivation& derivation, const Kernel& kernel, const std::vector<__float128>& parameters,
                       const std::vector<__float128>& q, const std::vector<__float128>& p, __float128 step);

}  // namespace lobatto
