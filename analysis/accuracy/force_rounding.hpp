// SPDX-License-Identifier: GPL-2.0-or-later
// What rounding inside the formulas of the forces does. Terms that nearly cancel leave few digits, and every run in
// double loses the same ones: no companion in double sees that.
#pragma once

#include <vector>

#include "generator/mechanics/outline.hpp"
#include "runtime/build/library.hpp"

namespace lobatto {

// The largest error of a force that the kernel computes at these states (rows t, q, p), against 60 digits, as a part of
// the largest size of that force there, or of those on its array (`groups`: amplitude_groups) where it vanishes beside
// them. Of the coordinates that move; 0 where there are more than most_looked_at. `stepper` is prepared with
// `parameters`.
inline constexpr std::size_t most_looked_at = 16;
double force_rounding(const Outline& outline, const LoadedStepper<double>& stepper,
                      const std::vector<double>& parameters, const std::vector<std::vector<double>>& rows,
                      const std::vector<bool>& moves, const std::vector<int>& groups);

}  // namespace lobatto
