// SPDX-License-Identifier: GPL-2.0-or-later
// Where a problem ends: Gauss collocation of order 24 with small steps, computed anew in each run.
#pragma once

#include "bench/contestant.hpp"

namespace lobatto::bench {

// The state at T in quadruple precision: error below 1e-20 for all five problems (steps of half the length change
// less).
Trajectory reference_end(const Problem& problem, const Trajectory& start);

// The same in 80-bit arithmetic, ten times as fast: error below 1e-14, for the many starts of ensembles.
Trajectory quick_reference_end(const Problem& problem, const Trajectory& start);

// H of the problem.
double energy_of(const Problem& problem, const Trajectory& state);

}  // namespace lobatto::bench
