// SPDX-License-Identifier: MIT
// Momenta that belong to several velocities, as p = v^3/3 - v does. Kernels keep positions and momenta, and their steps
// begin with the velocity that they find from rest: of several it may be another one than the start has.
#pragma once

#include <string>
#include <vector>

#include "runtime/build/library.hpp"
#include "runtime/build/number_stepper.hpp"

namespace lobatto {

// The velocity with which a prepared stepper would leave (q, p), if it is another one than `velocity`, whose momentum p
// is; else nothing. Vectors have n numbers, of NumberStepper `parts` doubles each; the result has n doubles.
template <class real>
std::vector<double> other_velocity(const LoadedStepper<real>& stepper, real time, const std::vector<real>& q,
                                   const std::vector<real>& velocity, const std::vector<real>& p);
std::vector<double> other_velocity(const NumberStepper& stepper, const NumberStepper::Parts& time,
                                   const NumberStepper::Parts& q, const NumberStepper::Parts& velocity,
                                   const NumberStepper::Parts& p);

// The momentum of a start. ComputationError, with the reason and what to try, if steps would leave it with another
// velocity; it begins with `place`, such as "scene.toml: ".
template <class real>
std::vector<real> momentum_of_start(const LoadedStepper<real>& stepper, real time, const std::vector<real>& q,
                                    const std::vector<real>& velocity, const std::string& place = "");

}  // namespace lobatto
