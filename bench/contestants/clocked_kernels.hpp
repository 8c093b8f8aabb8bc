// SPDX-License-Identifier: GPL-2.0-or-later
// Our contestants whose steps follow the motion: kernels of the scenes of bench/scenes/ with a clock.
#pragma once

#include "bench/contestants/contestant.hpp"

namespace lobatto::bench {

// Of several methods and tolerances with each clock of the problem; none where it has no clock. `few`: of some methods;
// `together`: how many trajectories go side by side; 0: one alone.
Contestants clocked_contestants(const Problem& problem, bool few, std::int64_t together);

}  // namespace lobatto::bench
