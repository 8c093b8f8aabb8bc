// SPDX-License-Identifier: GPL-2.0-or-later
// Programs in a new graph, node by node: what all passes are made of.
#pragma once

#include <functional>
#include <vector>

#include "generator/graph/passes.hpp"

namespace lobatto {

// What `rule` makes of a node, given its operands already rewritten.
using Rule = std::function<Id(Graph& result, const Graph& before, Id id, std::vector<Id> operands)>;

// What `rule` makes of the nodes that `roots` ask for.
std::vector<Id> images(Graph& after, const Graph& before, const std::vector<Id>& roots, const Rule& rule);
// The programs in a new graph, and what has a name.
Programs rewrite(const Programs& before, const Rule& rule);
// The same operation on other operands.
Id same(Graph& graph, const Node& node, std::vector<Id> operands);

std::vector<Id> roots_of(const Program& program);

}  // namespace lobatto
