// SPDX-License-Identifier: GPL-2.0-or-later
// The stability of a member and of a scene, for people.
#pragma once

#include <string>
#include <vector>

#include "analysis/stability/report.hpp"

namespace lobatto {

// The propagation matrix, its trace, every interval, the phase error, the proof: of a member alone.
std::string text_of(const Stability& member);
// The same and then the scene.
std::string text_of(const StabilityReport& report);

// A table, a line for each.
std::string text_of(const std::vector<Stability>& members);

}  // namespace lobatto
