// SPDX-License-Identifier: GPL-2.0-or-later
// Whether a motion can begin where a scene lets it begin.
#pragma once

#include "generator/mechanics/system/system.hpp"

namespace lobatto {

// At the scene's start, to 60 digits: L, the forces and all their derivatives are finite and real, the mass matrix
// dp/dv has an inverse, where the scene gives momenta there are velocities with p = dL/dv, and constraints are kept.
// Else InputError.
void check_start(const Scene& scene, const System& system);

// The start of a system with constraints: positions and velocities that keep them to 60 digits (D47). Those of the
// scene, or with `assemble` the nearest in the metric of the mass. InputError as check_start's.
struct StartOnConstraints {
    std::vector<cln::cl_R> q, v;
};
StartOnConstraints start_on_constraints(const Scene& scene, const System& system);

// Of values set since the scene was read: what formulas cannot tell after they were simplified (sqrt(a)^2 with a < 0),
// what masses, lengths and restitutions must keep, and that the start is on the right side of the walls. Else
// InputError.
void check_values(const Scene& scene);

}  // namespace lobatto
