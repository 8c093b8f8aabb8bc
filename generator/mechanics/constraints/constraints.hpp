// SPDX-License-Identifier: GPL-2.0-or-later
// What cannot be had with constraints, said in one place.
#pragma once

#include "generator/scene/scene.hpp"

namespace lobatto {

// InputError unless the method keeps constraints: multipliers belong to nodes, and a step must end on the constraints,
// so both ends are nodes, as Lobatto's are; in equal steps of time, and plain arithmetic.
void require_method_of_constraints(const Scene& scene);

// InputError where a scene with constraints is given to what knows none: "lobatto stability".
void refuse_constraints(const Scene& scene, const std::string& what);

}  // namespace lobatto
