// SPDX-License-Identifier: GPL-2.0-or-later
// Motions at rest: in an equilibrium, or where constraints hold all that might move. Rounding alone moves it. Then
// neither kinetic energy nor displacements measure anything.
#pragma once

#include <cstdint>
#include <vector>

#include "generator/mechanics/system/system.hpp"
#include "runtime/build/library.hpp"

namespace lobatto {

// A motion whose positions and momenta stay where they begin but for rounding: of themselves, or of the farthest where
// they begin at 0. start, least, most: of q, then p.
bool rests(const std::vector<double>& start, const std::vector<double>& least, const std::vector<double>& most,
           double epsilon);

// Such a motion, whose companion, which begins beside it, stays near, too. It has no amplitude.
bool rests_beside_companion(const std::vector<double>& start, const std::vector<double>& least,
                            const std::vector<double>& most, const std::vector<double>& least_of_companion,
                            const std::vector<double>& most_of_companion, double epsilon);

// Whether a motion that rests with its companion does so only because each step's change is less than a rounding of its
// state: by the derivative of the step and the forces at the start, it goes away in so many steps, as in a rotating
// frame, where momenta are not 0 at rest. The stepper is prepared, and no force depends on the time.
bool is_held_by_rounding(const LoadedStepper<double>& stepper, double time, const std::vector<double>& q,
                         const std::vector<double>& p, double step, std::int64_t steps);

// `rows`: states t, q, p, the start first, computed in numbers with this epsilon.
bool is_at_rest(const SystemOutline& system, const std::vector<std::vector<double>>& rows,
                const std::vector<double>& parameters, double epsilon);

}  // namespace lobatto
