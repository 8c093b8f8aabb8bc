// SPDX-License-Identifier: GPL-2.0-or-later
// Our own contestants: kernels derived from the scenes of bench/scenes/, compiled and loaded as `lobatto run` does.
#pragma once

#include "bench/contestants/contestant.hpp"
#include "generator/emit/kernel.hpp"
#include "generator/scene/scene.hpp"
#include "runtime/build/library.hpp"

namespace lobatto::bench {

// `clock`: of the scene, which has none of its own; empty: equal steps.
KernelSource source_of(const Problem& problem, Method method, const std::string& clock = "");

// `together`: how many trajectories go side by side; 0: one alone.
std::vector<Kernel> kernels_of(const Problem& problem, const std::vector<Method>& methods, std::int64_t together,
                               const std::string& clock);

// With equal steps, of all methods in the race, each iterated to rounding and to tolerances. `few`: of some.
Contestants kernel_contestants(const Problem& problem, bool few, std::int64_t together);

// Seconds from the scene to the loaded kernel, nothing cached; the best of three.
double cold_start_seconds(const Problem& problem, Method method, std::int64_t together, const std::string& clock);

// A kernel takes momenta, a trajectory has velocities: p times masses, or divided by them.
std::vector<double> masses_of(const Problem& problem);
template <class Operation>
void change_momenta(const std::vector<double>& masses, std::vector<Trajectory>& trajectories, const Operation& change) {
    for (Trajectory& trajectory : trajectories)
        for (std::size_t k = 0; k < masses.size(); ++k) trajectory.p[k] = change(trajectory.p[k], masses[k]);
}

}  // namespace lobatto::bench
