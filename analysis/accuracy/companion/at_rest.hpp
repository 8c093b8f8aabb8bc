// SPDX-License-Identifier: GPL-2.0-or-later
// Mechanisms at rest: constraints hold all that might move, and rounding alone moves it. Then neither kinetic energy
// nor displacements measure anything.
#pragma once

#include <vector>

#include "generator/mechanics/system/system.hpp"

namespace lobatto {

// `rows`: states t, q, p, computed in numbers with this epsilon. False without constraints.
bool rests_on_constraints(const SystemOutline& system, const std::vector<std::vector<double>>& rows,
                          const std::vector<double>& parameters, double epsilon);

}  // namespace lobatto
