// SPDX-License-Identifier: GPL-2.0-or-later
// Where a Lagrangian or its momentum jumps at a velocity: its two pieces at a switch have different values. No motion
// of a Lagrangian follows that, and the energy jumps too. Jumps at a place refract the motion (D67).
#pragma once

#include <string>
#include <vector>

#include "generator/scene/scene.hpp"

namespace lobatto {

// One sentence for each such switch, without full stop. Switches that are not linear in any velocity are not looked at.
std::vector<std::string> jumps_of(const Scene& scene, const std::vector<double>& parameters);

}  // namespace lobatto
