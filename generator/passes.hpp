// SPDX-License-Identifier: GPL-2.0-or-later
// Graph to graph: fold, factor, powers, stages, shared parts, sine-cosine pairs. Each pass is checked at 40 digits.
#pragma once

#include <string>
#include <vector>

#include "generator/graph.hpp"

namespace lobatto {

// One value a program computes, and the place in C++ where it goes.
struct Output {
    std::string target;  // W[0]
    Id value = 0;
};

// One function of the kernel: its outputs, computed together.
struct Program {
    std::string name;  // node
    std::vector<Output> outputs;
};

// All programs of a kernel over one graph, so that what they hoist is shared; and names for values that deserve one
// when hoisted.
struct Programs {
    Graph graph;
    std::vector<Program> programs;
    std::vector<std::pair<Id, std::string>> names;  // value -> identifier
};

// Operations of one evaluation of every program (a value that two programs need counts in both; values of stage
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
