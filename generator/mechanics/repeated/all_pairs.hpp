// SPDX-License-Identifier: GPL-2.0-or-later
// Rows that are all pairs of some bodies: a loop in a loop says what a table with a row a pair would say.
#pragma once

#include <ginac/ginac.h>

#include <optional>
#include <vector>

#include "generator/mechanics/repeated/elements.hpp"

namespace lobatto {

// Bodies 0, 1, ..., bodies - 1; a row is a pair of them, the first before the second.
struct AllPairs {
    int bodies = 0;
    struct Variable {
        int begin;       // its number for body 0; the next body's is the next
        bool of_second;  // it belongs to the second body of the pair, else to the first
    };
    std::vector<Variable> variables;  // as Element::x
    struct Coefficient {
        bool of_second;
        std::vector<GiNaC::ex> values;  // bodies - 1: of the first body from 0 on, of the second from 1 on
    };
    std::vector<Coefficient> coefficients;  // as Element::a
};

// Nothing where the rows are not all pairs of at least `fewest_bodies`, or a coefficient belongs to a pair as such.
std::optional<AllPairs> all_pairs(const Element& element);

constexpr int fewest_bodies = 8;

// A number of each pair that is a product of one for each body, as m_i m_j is where masses are numbers, becomes these
// two: then a loop over pairs needs no table of all of them.
void split_products(Element& element);

// The rows in the order of the loops: first body by first body, and its partners one after another.
std::vector<std::vector<int>> rows_of(const AllPairs& pairs);

}  // namespace lobatto
