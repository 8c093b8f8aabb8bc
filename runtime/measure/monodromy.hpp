// SPDX-License-Identifier: MIT
// How fast nearby trajectories diverge: the eigenvalues of one step, and the growth of a linear kernel's own motion.
#pragma once

#include <complex>
#include <optional>
#include <vector>

#include "runtime/build/library.hpp"

namespace lobatto {

// The eigenvalues of the tangent map of `steps` steps from (q, p) at `time`, the largest modulus first; 2n of them.
// Nothing when a step fails, or the kernel has no tangent map. The stepper is prepared with this step size.
std::optional<std::vector<std::complex<double>>> step_eigenvalues(const LoadedStepper<double>& stepper, double step,
                                                                  double time, const std::vector<double>& q,
                                                                  const std::vector<double>& p, int steps = 1);

// ln of the growth in one step of a linear system, measured by running the kernel for `steps` steps: two motions from
// seeded states, their distance brought back to 1 whenever it has become large or small. Of bounded motion some 1/steps
// or less remains, and a few times that of motion that is free to drift. Nothing when a step fails.
std::optional<double> measured_rate(LoadedStepper<double>& stepper, double step, long steps);

}  // namespace lobatto
