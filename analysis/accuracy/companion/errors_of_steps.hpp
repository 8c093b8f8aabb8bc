// SPDX-License-Identifier: GPL-2.0-or-later
// Coordinates that errors of steps alone move, as velocities and forces tell: they have no amplitude.
#pragma once

#include <functional>
#include <vector>

#include "runtime/build/library.hpp"

namespace lobatto {

// States t, q, p of a run, its start first.
using Rows = std::vector<std::vector<double>>;

// How far each number would go in a step at the pace of a state, q then p, with its sign. Empty where the state is
// refused. `stepper` is prepared.
std::vector<double> pace_at(LoadedStepper<double>& stepper, double step, const std::vector<double>& row);

// Which coordinates stay slight beside the others.
std::vector<bool> slight(const std::vector<double>& amplitudes);

// Which coordinates begin at rest, without a force, and would stay there wherever the others are: errors alone move
// them. Of `asked` only.
std::vector<bool> rests_beside(LoadedStepper<double>& stepper, double step, const Rows& rows,
                               const std::vector<double>& amplitudes, const std::vector<bool>& asked);

// The amplitudes of slight coordinates become 0 if they rest, and those of the run are larger than those of the
// companion, whose steps are shorter: then they are errors of steps. `rests`: rests_beside, where there is one that
// may.
void leave_out_errors_of_steps(std::vector<double>& amplitudes, const std::vector<double>& of_run,
                               const std::vector<double>& of_companion,
                               const std::function<std::vector<bool>(const std::vector<bool>& asked)>& rests);

}  // namespace lobatto
