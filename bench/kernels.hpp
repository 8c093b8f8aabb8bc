// SPDX-License-Identifier: GPL-2.0-or-later
// Our own contestants: kernels derived from the scenes of bench/scenes/, compiled and loaded as `lobatto run` does.
#pragma once

#include "bench/contestant.hpp"
#include "generator/emit/kernel.hpp"
#include "generator/scene/scene.hpp"

namespace lobatto::bench {

KernelSource source_of(const Problem& problem, Method method);

// Of all methods in the race, each iterated to rounding and to tolerances. `few`: of some. `together`: how many
// trajectories go side by side; 0: one alone.
Contestants kernel_contestants(const Problem& problem, bool few, std::int64_t together);

// Seconds from the scene to the loaded kernel, nothing cached; the best of three.
double cold_start_seconds(const Problem& problem, Method method, std::int64_t together);

}  // namespace lobatto::bench
