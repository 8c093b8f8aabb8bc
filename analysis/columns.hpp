// SPDX-License-Identifier: GPL-2.0-or-later
// The columns of a trajectory that are formulas: eliminated coordinates, and what bodies do.
#pragma once

#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "generator/scene/scene.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

// Names and units of all columns between the state and the energy: multipliers first.
std::vector<std::pair<std::string, std::string>> names_beside(const Scene& scene);

// In the numbers of the request's parameters; not numbers where a formula has no value. `algebra` guards formulas where
// several threads derive; it and the scene outlive what is returned.
TrajectoryRequest::Formulas columns_of(const Scene& scene, const TrajectoryRequest& request,
                                       std::recursive_mutex* algebra = nullptr);

}  // namespace lobatto
