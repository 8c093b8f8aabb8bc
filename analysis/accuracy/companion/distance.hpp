// SPDX-License-Identifier: GPL-2.0-or-later
// How far a run and its companion are from each other at one time.
#pragma once

#include <cstddef>
#include <vector>

#include "analysis/accuracy/companion/amplitude.hpp"
#include "runtime/build/library.hpp"

namespace lobatto {

struct Distance {
    double apart = 0;            // of positions and momenta, the most; not a number where one is none
    double relative = 0;         // the error of the run: of positions, the most
    std::size_t coordinate = 0;  // of which it is
    double absolute = 0;         // the same in its unit

    bool is_lost() const { return !(apart < out_of_step); }
};

// Of an amplitude: where positions agree to this, momenta alone lose no motion. They may turn within a moment, as at
// the pericentre of a long orbit; at a wall they turn at once.
double momenta_alone(const Kernel& kernel);

// Distances are in amplitudes; numbers whose amplitude is 0 do not count. `run`, `companion`: q, p, each number in
// `parts` doubles. `of_run`: the error of the run for one of their difference.
Distance distance_between(const double* run, const double* companion, std::size_t parts,
                          const std::vector<double>& amplitude, double of_run, double momenta_alone);

// What the difference of a run and a companion with `ratio` times as many steps is to be multiplied by, to be the error
// of the run: errors are in proportion to h^order.
double error_of_run(double ratio, int order);

// Where a companion begins: q, a few units in the last place beside the start, so that it leaves it where nearby
// trajectories diverge, also when the motion itself stands still in rounding.
void move_beside(const Kernel& kernel, std::vector<double>& q);

}  // namespace lobatto
