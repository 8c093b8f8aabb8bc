// SPDX-License-Identifier: GPL-2.0-or-later
// A scene as a request for a trajectory.
#pragma once

#include "analysis/overrides.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

// The number of steps to the end; the end itself when it is a multiple of h.
struct Steps {
    std::int64_t count = 0;
    bool reaches_end = true;
};
// `overrides` are applied already; errors name them. InputError when the step or the end make no sense.
GiNaC::numeric step_of(const Scene& scene, const Overrides& overrides = {});
Steps steps_of(const Scene& scene, const Overrides& overrides = {});

// The same. InputError if the run is too short for one step.
Steps steps_of_run(const Scene& scene, const Overrides& overrides = {});

// Of a scene with a clock; none for others. `count` of steps_of.
Arrivals arrivals_of(const Scene& scene, std::int64_t count);

// Prepares and starts the stepper too: a start that is impossible, ComputationError, is known before anything is
// written.
TrajectoryRequest request_of(const Scene& scene, std::int64_t steps, LoadedStepper<double>& stepper);

// The parameters, the step and the start with all digits of this kernel's numbers, where they are not double.
void add_digits(TrajectoryRequest& request, const Scene& scene, const Kernel& kernel);

}  // namespace lobatto
