// SPDX-License-Identifier: GPL-2.0-or-later
// Graph to graph: fold, factor, powers, phases, shared parts, sine-cosine pairs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "generator/graph/graph.hpp"

namespace lobatto {

// What becomes of a value: it is put into its target, or added to it, or taken away from it; it is a new constant of
// that name; or the function gives it back.
enum class Effect : std::uint8_t { assign, add, subtract, declare, give_back };

// One value a program computes, and the place in C++ where it goes.
struct Output {
    std::string target;  // W[0]; nothing when it is given back
    Id value = 0;
    Effect effect = Effect::assign;
};

// What a program computes of a system in loops: of the rows of one repeated term, or of the terms that do not repeat.
struct LoopPart {
    enum class Of : std::uint8_t { node, slope, quadratic, energy, coefficients };
    static constexpr int rest = -1, inside = -2;  // in place of an element; inside: where fixed ends are rows
    int element = rest;
    Of of = Of::node;
    bool operator==(const LoopPart&) const = default;
};

// One function of the kernel: its outputs, computed together.
struct Program {
    std::string name;  // node
    std::vector<Output> outputs;
    std::optional<LoopPart> part = std::nullopt;
};

std::string element_text(int element);      // element_1, rest, inside
std::string name_of(const LoopPart& part);  // element_1_slope
inline Program program_of(const LoopPart& part) {
    return {name_of(part), {}, part};
}

// All programs of a kernel over one graph, so that what they hoist is shared; and names for values that deserve one
// when hoisted.
struct Programs {
    Graph graph;
    std::vector<Program> programs;
    std::vector<std::pair<Id, std::string>> names;  // value -> identifier
};

// The values that the programs and the names ask for.
std::vector<Id> roots_of(const Programs& programs);

// The passes. Each gives the same values on a graph of its own.
Programs fold_constants(const Programs& programs);   // numbers of 60 digits; the formula stays as label
Programs factor_sums(const Programs& programs);      // Horner
Programs multiply_powers(const Programs& programs);  // integer powers by multiplication
Programs group_by_phase(const Programs& programs);   // what is known first is combined first
Programs share_pairs(const Programs& programs);      // common parts of sums and products
Programs add_angles(const Programs& programs);       // sin(a - b) from those of a and b, where these are there
Programs pair_sines(const Programs& programs);       // sine and cosine of one argument together

}  // namespace lobatto
