// SPDX-License-Identifier: GPL-2.0-or-later
// The stability of a member and of a scene, for people and for machines.
#pragma once

#include <string>

#include "cli/stability_report.hpp"

namespace lobatto {

// The propagation matrix, its trace, every interval, the phase error, the proof: of a member alone.
std::string text_of(const Stability& member);
// The same and then the scene.
std::string text_of(const StabilityReport& report);

// docs/stability.md, last section. `report` may be null: the member alone.
std::string json_of(const Stability& member, const StabilityReport* report);

}  // namespace lobatto
