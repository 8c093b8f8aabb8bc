// SPDX-License-Identifier: GPL-2.0-or-later
// How errors of rounding grow with the number of steps: the same steps in double, plain and clean, and in long double.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "generator/scene/scene.hpp"

namespace lobatto {

// What rounding has done after `steps` steps, over all trajectories.
struct RoundoffRow {
    std::int64_t steps = 0;
    double energy_mean = 0, energy_rms = 0;  // of H - H without rounding, in units of the energy (below)
    double position_rms = 0;  // largest |q - q without rounding|, relative to the largest |q| so far; NaN: not known
};

// A straight line through the logarithms of rms values, from 1000 steps on: their exponents; NaN with fewer than three.
struct RoundoffGrowth {
    std::vector<RoundoffRow> rows;
    double energy_exponent = 0, position_exponent = 0;
    double nanoseconds = 0;  // a step, the fastest trajectory
    double iterations = 0;   // a step, on average
};

struct RoundoffResult {
    RoundoffGrowth plain, clean;
    std::int64_t steps = 0;  // of the last row
    int trajectories = 0;    // in the rows: all, unless interrupted
    bool interrupted = false;
    bool lost =
        false;  // energies are off by as much as the motion has: the step is beyond stability, or it is too long
};

// Trajectory i begins at (1 + i/2^20) times the scene's positions and momenta. What rounding does is seen beside clean
// steps in long double from the very same numbers, energies are evaluated in quadruple precision, of both numbers that
// clean arithmetic has for a position; the unit is |H(0)|, or half of the largest kinetic energy met where that is
// larger, for each trajectory. Nothing is said of the method's own error, which both share. Without the
// `reference` in long double energies are compared with H(0), so that the method's own error is in them, and positions
// with nothing. ComputationError where a step fails; InputError without a constant mass matrix, and where energies
// would be compared that the motion does not conserve. Ends soon after `interrupted` is raised: with the trajectories
// that were at their end, or, where none was, as far as all had come that had begun.
// `progress` hears now and then how many steps of all trajectories are done, from one thread at a time.
RoundoffResult roundoff_growth(
    Scene scene, std::int64_t steps, int trajectories, bool reference, const volatile int* interrupted,
    const std::function<void(std::int64_t)>& progress = [](std::int64_t) {});

}  // namespace lobatto
