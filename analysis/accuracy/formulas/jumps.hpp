// SPDX-License-Identifier: GPL-2.0-or-later
// Where a Lagrangian jumps: its two pieces at a switch of positions or velocities have different values. No motion of a
// Lagrangian follows that, and the energy jumps too.
#pragma once

#include <string>
#include <vector>

#include "generator/scene/scene.hpp"

namespace lobatto {

// One sentence for each such switch, without full stop. Switches that are not linear in any position or velocity are
// not looked at.
std::vector<std::string> jumps_of(const Scene& scene, const std::vector<double>& parameters);

}  // namespace lobatto
