// SPDX-License-Identifier: GPL-2.0-or-later
// What impacts ask of a system, and what cannot be had with them, said in one place.
#pragma once

#include "generator/mechanics/system/system.hpp"

namespace lobatto {

// InputError unless momenta are affine in velocities, so that an impulse changes velocities by M^-1 of it (D52), and
// the scene starts on the right side of its walls.
void check_impacts(const Scene& scene, const System& system);
void require_start_before_walls(const Scene& scene);

// InputError where a scene with impacts, or with formulas that are not smooth, is given to what knows none: "lobatto
// stability".
void refuse_impacts(const Scene& scene, const std::string& what);

// InputError where an impact moves positions: what compares positions along a motion has no measure of that.
void refuse_jumps(const Scene& scene, const std::string& what);

}  // namespace lobatto
