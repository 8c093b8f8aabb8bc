// SPDX-License-Identifier: GPL-2.0-or-later
// Coordinates that follow from others: the constraint x = f(q, t) is put into all formulas.
#pragma once

#include "generator/scene/scene.hpp"

namespace lobatto {

// Of a scene that is read; what it eliminates, and what not and why, stands in the scene afterwards.
void eliminate_coordinates(Scene& scene);

// "x = l*sin(a), y = -l*cos(a)": as written.
std::string equations_of_eliminated(const Scene& scene);

// df/dt along the motion, of a formula of positions and the time.
GiNaC::ex rate_of_change(const GiNaC::ex& formula, const Scene& scene);

}  // namespace lobatto
