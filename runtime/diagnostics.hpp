// SPDX-License-Identifier: MIT
// Measures what a variational integrator promises: symplecticity, the conserved energy of linear systems, symmetries.
#pragma once

#include <optional>
#include <vector>

#include "runtime/library.hpp"

namespace lobatto {

// max |T^T J T - J| over the entries, T the tangent map of one step from (q, p): the symplectic defect. Relative to
// max(1, |T|^2).
template <class real>
real symplectic_defect(const LoadedStepper<real>& stepper, const std::vector<real>& q, const std::vector<real>& p);

// The discrete energy H_d(z) = -1/2 (z - z*)^T J Phi (z - z*) that the map z -> Phi z + shift of a linear system
// conserves; for one coordinate the paper's eq:discreteEnergy. Empty when the map has no fixed point z* (a constant
// force).
struct DiscreteEnergy {
    int n = 0;
    std::vector<double> form;    // 2n x 2n, symmetric part of -1/2 J Phi
    std::vector<double> centre;  // 2n: z*
    double operator()(const double* q, const double* p) const;
};
std::optional<DiscreteEnergy> discrete_energy(const LoadedStepper<double>& stepper);

}  // namespace lobatto
