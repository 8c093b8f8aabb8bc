// SPDX-License-Identifier: GPL-2.0-or-later
// Repeated terms of a sum: one formula, written once, and the table of what it is applied to.
#pragma once

#include <ginac/ginac.h>

#include <vector>

#include "generator/mechanics/algebra/symbols.hpp"
#include "generator/mechanics/repeated/element.hpp"

namespace lobatto {

struct Elements {
    std::vector<Element> repeated;                        // of at least `fewest_rows` rows
    std::vector<GiNaC::ex> others;                        // terms that repeat too seldom
    std::vector<std::pair<int, GiNaC::ex>> other_forces;  // likewise: variable acted on, term
};

constexpr std::size_t fewest_rows = 8;

// Rows that follow one another with each variable the next: their formula can be taken in vector lanes.
struct RowRun {
    int begin, count;
};
std::vector<RowRun> runs_of(const Element& element);
// Whether most rows of all formulas stand in long runs, with the same distances between the variables of a row.
bool are_neighbours(const Elements& elements);
// A formula of the slots and coefficients of an element, for one of its rows.
GiNaC::ex of_row(const Element& element, const GiNaC::ex& formula, std::size_t row,
                 const std::vector<GiNaC::symbol>& variables);
// The slots (i, j) whose second derivative is not zero, row by row.
std::vector<std::pair<std::size_t, std::size_t>> pairs_of(const Element& element);
// How far the rows of long runs reach from the first coordinate, where all of them begin; -1 where some do not.
int row_reach(const Elements& elements);
// Whether the rows are one run, along all of `count` variables or all pairs or triples of neighbours.
bool covers(const Element& element, int count);

// Where the formula of all pairs of neighbours holds beyond the first coordinate, or the last, with zero for the one
// that is not there: a chain with fixed ends.
struct FixedEnds {
    std::size_t element = 0;  // its number
    bool before = false, behind = false;
    std::vector<GiNaC::ex> others;  // without the terms of the fixed ends
};
FixedEnds fixed_ends_of(const Elements& elements, const std::vector<GiNaC::symbol>& q);
// Whether the slope is that of one formula, of single coordinates or pairs of neighbours, which covers all of them.
bool is_one_pass(const Elements& elements, const FixedEnds& fixed_ends, const std::vector<GiNaC::symbol>& q);

// The terms of a potential (or Lagrangian) in the variables, and of forces: (variable acted on, term).
Elements find_elements(const SystemSymbols& symbols, const std::vector<GiNaC::symbol>& variables,
                       const std::vector<GiNaC::ex>& terms, const std::vector<std::pair<int, GiNaC::ex>>& forces);

}  // namespace lobatto
