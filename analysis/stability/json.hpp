// SPDX-License-Identifier: GPL-2.0-or-later
// The stability of members and of a scene, for machines (docs/stability.md, last section).
#pragma once

#include <string>
#include <vector>

#include "analysis/stability/report.hpp"

namespace lobatto {

std::string json_of(const std::vector<Stability>& members);
std::string json_of(const StabilityReport& report);

}  // namespace lobatto
