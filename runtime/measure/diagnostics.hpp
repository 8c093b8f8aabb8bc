// SPDX-License-Identifier: MIT
// Measures what a variational integrator promises: symplecticity, the conserved energy of linear systems, symmetries.
#pragma once

#include <optional>
#include <vector>

#include "runtime/build/library.hpp"
#include "runtime/build/number_stepper.hpp"

namespace lobatto {

// max |T^T J T - J| over the entries, T the tangent map of one step from (q, p): the symplectic defect. Relative to
// max(1, |T|^2), in units of q and p (powers of two) in which dq1/dp and dp1/dq are of one size.
template <class real>
real symplectic_defect(const LoadedStepper<real>& stepper, const std::vector<real>& q, const std::vector<real>& p);
// The same of a kernel in any numbers, computed exactly from its tangent map.
double symplectic_defect(const NumberStepper& stepper, const NumberStepper::Parts& q, const NumberStepper::Parts& p);

// The discrete energy that the map z -> Phi z + w of an autonomous linear system conserves (D21): about a fixed point
// z* it is H_d(z) = -1/2 (z - z*)^T J Phi (z - z*), for one coordinate the paper's eq:discreteEnergy. Where a constant
// force leaves no fixed point, z* is the nearest there is, w' = w - (1 - Phi) z*, and a linear term stands beside it:
// H_d(z) = -1/2 y^T J Phi y - 1/2 (J w' + Phi^T J w')^T y, y = z - z*.
// Empty for other systems, without a tangent map, and for more than 64 coordinates.
struct DiscreteEnergy {
    int n = 0;
    std::vector<double> form;    // 2n x 2n, symmetric part of -1/2 J Phi
    std::vector<double> centre;  // 2n: z*
    std::vector<double> slope;   // 2n: of the linear term; zero with a fixed point
    double operator()(const double* q, const double* p) const;
};
std::optional<DiscreteEnergy> discrete_energy(const LoadedStepper<double>& stepper);

}  // namespace lobatto
