// SPDX-License-Identifier: GPL-2.0-or-later
// Motions at rest: in an equilibrium, or where constraints hold all that might move. Rounding alone moves it. Then
// neither kinetic energy nor displacements measure anything.
#pragma once

#include <vector>

#include "generator/mechanics/system/system.hpp"

namespace lobatto {

// Whether positions stay where they begin but for this part of themselves, or of the farthest where they begin at 0.
// start: q; least, most: of q and p.
bool stays_within(double part, const double* start, const std::vector<double>& least, const std::vector<double>& most);

// A motion whose positions only rounding moves, and of which a companion that begins beside it goes no far way either:
// such a one has no amplitude.
bool rests_beside_companion(const double* start, const std::vector<double>& least, const std::vector<double>& most,
                            const std::vector<double>& least_of_companion, const std::vector<double>& most_of_companion,
                            double epsilon);

// `rows`: states t, q, p, the start first, computed in numbers with this epsilon.
bool is_at_rest(const SystemOutline& system, const std::vector<std::vector<double>>& rows,
                const std::vector<double>& parameters, double epsilon);

}  // namespace lobatto
