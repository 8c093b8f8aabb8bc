// SPDX-License-Identifier: MIT
// What a step's own polynomial says of its error: how far the polynomial of the step before, carried on, misses it.
#pragma once

#include <vector>

#include "runtime/build/library.hpp"

namespace lobatto {

// max_k |P_before(1 + theta) - P(theta)|_k / scale_k over some theta in (0, 1), for the two steps that begin at a
// state; of the size of h^s for polynomials of degree s - 1. Two steps and a few values of polynomials are all it
// costs. `stepper` is prepared; its trajectory is lost. Not a number without dense output, or when a step fails.
template <class real>
double polynomial_defect(LoadedStepper<real>& stepper, real time, const std::vector<real>& q,
                         const std::vector<real>& p, const std::vector<double>& scale);

}  // namespace lobatto
