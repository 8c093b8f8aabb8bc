// SPDX-License-Identifier: GPL-2.0-or-later
// Mass matrices whose entries all change alike.
#pragma once

#include "generator/mechanics/structure/structure.hpp"

namespace lobatto {

// Whether M = d2L/dvdv is m(q, v, t) M0 with a constant M0, by values: M_ij M'_e = M_e M'_ij for all entries and one of
// them, e, with M' at the start, at points near it and away from it. Always so for one coordinate.
bool has_scaled_mass(const Scene& scene, const System& system);

// Whether the iterations of its steps use that; and whether M0 is diagonal, so that there may be any number of
// coordinates.
bool uses_scaled_mass(const Scene& scene, const System& system, const Structure& structure);
bool has_light_mass(const Scene& scene, const System& system, const Structure& structure);

// No two velocities are multiplied.
bool has_diagonal_mass(const System& system);

}  // namespace lobatto
