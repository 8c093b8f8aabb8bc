// SPDX-License-Identifier: GPL-2.0-or-later
// What a kernel computes, as programs over one graph: node, drift, start values, correction, arrival, energy ...
// (docs/derivation.md).
#pragma once

#include <set>
#include <string>

#include "generator/graph/passes.hpp"

namespace lobatto {

struct Derivation;

// The programs of a scene's kernel, as derived, before any pass. Shapes of the inputs and outputs are those of
// runtime/kernel/kernel.hpp.
Programs build_programs(const Derivation& derivation);

// Unknowns N of the stage equations up to which the Newton correction is written in closed form (Cramer's rule).
constexpr int closed_form_limit = 3;

}  // namespace lobatto
