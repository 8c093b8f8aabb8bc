// SPDX-License-Identifier: GPL-2.0-or-later
// Whether the steps of a linear system made it grow as its own motion does not.
#pragma once

#include <string>

#include "generator/mechanics/outline.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

// Of linear systems whose energy changes, by forces or with the time, of up to 64 coordinates; EnergyWatch looks after
// the others. What to tell, as of any stop, when the steps of a run that came to its end made the motion 1000 times as
// large as by itself it becomes; else empty. `scene` with the values of the run.
std::string linear_departure(const Outline& outline, const Scene& scene, const Kernel& kernel,
                             const TrajectoryRequest& request, const TrajectoryResult& result);

}  // namespace lobatto
