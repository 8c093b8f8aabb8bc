// SPDX-License-Identifier: GPL-2.0-or-later
// Where a problem ends: Kepler's closed solution, or Gauss collocation of order 24 with small steps; computed anew in
// each run.
#pragma once

#include "bench/contestants/contestant.hpp"

namespace lobatto::bench {

// The state at T in quadruple precision, P9's in 80 bits, by steps of the problem's reference step times `refinement`.
// The error is below 1e-20 for P1 to P7, and what docs/benchmarks.md says for P8 and P9.
Trajectory reference_end(const Problem& problem, const Trajectory& start, double refinement = 1);

// The same in 80-bit arithmetic, ten times as fast: error below 1e-14, for the many starts of ensembles; where that is
// not sure, in quadruple precision.
Trajectory quick_reference_end(const Problem& problem, const Trajectory& start);

// Of the problems named, or all: the end, and how far it moves with steps of four fifths of the length.
void print_references(const std::vector<std::string>& names);

// H of the problem.
double energy_of(const Problem& problem, const Trajectory& state);

}  // namespace lobatto::bench
