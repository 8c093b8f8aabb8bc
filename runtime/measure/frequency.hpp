// SPDX-License-Identifier: MIT
// The largest frequency of small motions around a state: what a step is measured against.
#pragma once

#include <vector>

#include "runtime/build/library.hpp"

namespace lobatto {

// The largest |eigenvalue| of the derivative of Hamilton's equations at a state, radians per unit of time: of a stable
// motion its largest frequency, else the fastest growth may be it. By power iteration on the squared derivative,
// whose leading eigenvalue is -omega^2, with central differences: some per cent too small where several frequencies
// are near. `stepper` is prepared. scale: how far each position and momentum moves, 2n, positive: differences are small
// beside that, and the units do not matter. Not a number where the formulas fail; 0 with constraints, whose pull is not
// in these equations.
template <class real>
double largest_frequency(const LoadedStepper<real>& stepper, real time, const std::vector<real>& q,
                         const std::vector<real>& p, const std::vector<double>& scale);

// The same, looked at more closely, too: of what moves far together, as the parts of a thing in flight, differences
// that are small beside the way are large beside the thing.
double largest_frequency_near(const LoadedStepper<double>& stepper, double time, const std::vector<double>& q,
                              const std::vector<double>& p, const std::vector<double>& scale);

}  // namespace lobatto
