// SPDX-License-Identifier: GPL-2.0-or-later
// All passes in order, each counted and checked at 40 digits.
#pragma once

#include <string>
#include <vector>

#include "generator/graph/passes.hpp"

namespace lobatto {

// Operations of one evaluation of every program (a value that two programs need counts in both; values of phase
// constant are free, values hoisted to parameters and step size count once).
struct Operations {
    long additions = 0, multiplications = 0, divisions = 0, functions = 0;
    long total() const { return additions + multiplications + divisions + functions; }
};
Operations count(const Programs& programs);
Operations count(const Graph& graph, const std::vector<Id>& nodes);

struct PassReport {
    std::string pass;  // "fold constants"
    Operations after;
    double disagreement = 0;  // largest relative difference to the graph before the pass, at seeded points
};

// Runs all passes in order. A pass whose values differ by more than 1e-40 relative is a bug of ours: std::logic_error.
// The first report row counts the programs as derived.
std::vector<PassReport> optimise(Programs& programs);

}  // namespace lobatto
