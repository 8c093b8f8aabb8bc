// SPDX-License-Identifier: GPL-2.0-or-later
// Angles whose sines and cosines a kernel may be given instead of computing them.
#pragma once

#include <map>

#include "generator/graph/passes.hpp"

namespace lobatto {

// The pairs of sine and cosine that a program computes, of arguments that move with the coordinates, numbered. Not
// those beside a quotient whose divisor moves with the same: in sin(r)/r both must come from the same digits of r.
std::map<Id, int> angles_of(const Graph& graph, const Program& program);

}  // namespace lobatto
