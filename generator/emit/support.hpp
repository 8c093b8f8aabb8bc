// SPDX-License-Identifier: GPL-2.0-or-later
// Which parts of runtime/kernel/kernel.hpp a kernel needs.
#pragma once

#include <string>
#include <vector>

#include "generator/graph/graph.hpp"
#include "generator/graph/notation.hpp"

namespace lobatto {

struct Derivation;

// Beside those that these include. `graph`: of the kernel's programs.
std::vector<std::string> support_of(const Derivation& derivation, const Graph& graph);
// What must stand before all that a kernel in these numbers is compiled from; empty: nothing.
std::string before_support(Precision precision);

}  // namespace lobatto
