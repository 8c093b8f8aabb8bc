// SPDX-License-Identifier: GPL-2.0-or-later
// Cyclic coordinates and the Lagrangian without them.
#pragma once

#include "generator/mechanics/structure/structure.hpp"

namespace lobatto {

// The coordinates that neither L nor any force holds, whose velocities occur at most squared: each momentum is
// constant, and its velocity follows from it in closed form. At most three are taken out, never all; none where L
// has no value at rest, or their part of the mass matrix is not definite: it might be singular somewhere, though the
// whole is not.
std::vector<int> find_cyclic(const Scene& scene, const System& system);

// R(v, q, P) = L - sum P v over the cyclic ones (D29), and its derivatives.
Routhian reduce(const System& system, const std::vector<int>& cyclic);

}  // namespace lobatto
