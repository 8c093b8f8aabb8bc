// SPDX-License-Identifier: GPL-2.0-or-later
// The time as a coordinate: of scenes with a clock whose motion does not keep its energy (D64).
#pragma once

#include "generator/scene/scene.hpp"

namespace lobatto {

// Whether the Lagrangian or the clock holds the time, or forces act. Then a clock needs the time and its momentum,
// minus the energy, beside the other coordinates.
bool needs_time_coordinate(const Scene& scene);

// With it as the last one, where a clock needs it; formulas of the scene go on holding `time`. And without it.
void add_time_coordinate(Scene& scene);
Scene without_time_coordinate(Scene scene);

}  // namespace lobatto
