// SPDX-License-Identifier: GPL-2.0-or-later
// What a kernel computes, as programs over one graph: node, drift, start values, correction, arrival, energy ...
// (docs/derivation.md).
#pragma once

#include <set>
#include <string>

#include "generator/graph/optimise.hpp"

namespace lobatto {

struct Derivation;

// The programs of a scene's kernel, as derived, before any pass. Shapes of the inputs and outputs are those of
// runtime/kernel/kernel.hpp.
Programs build_programs(const Derivation& derivation);

// The same as every later stage takes them: optimised, with what their costs decide.
struct OptimisedPrograms {
    Programs programs;
    std::vector<PassReport> report;  // first row: as derived
    double cost_of_node = 0;         // in additions, about
    bool uses_hessian = false;       // second derivatives save more evaluations than they cost
};
OptimisedPrograms optimised_programs(const Derivation& derivation);

}  // namespace lobatto
