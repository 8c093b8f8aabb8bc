// SPDX-License-Identifier: GPL-2.0-or-later
// Terms of a potential whose derivatives are not written out, because one formula tells those of all of them.
//
// Where 200 bodies attract one another, L has 19,900 terms that are one formula. A kernel has that formula in a loop,
// and needs of the terms themselves only where their second derivatives stand.
#pragma once

#include <cln/real.h>
#include <ginac/ginac.h>

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "generator/mechanics/algebra/symbols.hpp"
#include "generator/mechanics/repeated/element.hpp"
#include "generator/scene/scene.hpp"

namespace lobatto {

class Formulas;

struct Unwritten {
    std::vector<Element> elements;  // terms of -L that hold positions and parameters only
    // Where their sum has second derivatives, row by row. Each changes with the positions.
    std::vector<std::pair<int, int>> places;
    // For each place a position on which its second derivative depends, and which only one term of the sum there holds.
    // So the other terms cannot cancel this dependence.
    std::vector<int> witnesses;

    bool empty() const { return elements.empty(); }
    // The second derivative at a place, written out after all.
    GiNaC::ex at(const std::pair<int, int>& place, const std::vector<GiNaC::symbol>& q) const;
};

// The values of formulas of an element's slots and coefficients, row by row: use(row, values). `point` knows the values
// of the scene's symbols. DomainError where one has none.
void at_rows(const Element& element, const std::vector<GiNaC::ex>& formulas, const SystemSymbols& symbols,
             const Formulas& point, const std::function<void(std::size_t, const std::vector<cln::cl_R>&)>& use);

// Rows of one formula that are written out as fast as they are looked at.
constexpr std::size_t fewest_unwritten = 64;

// Sets terms of L apart that need not be written out; `terms` keeps the others. Nothing is set apart where what the
// formulas depend on cannot be told for all rows at once.
Unwritten set_apart(const Scene& scene, const SystemSymbols& symbols, std::vector<GiNaC::ex>& terms);

}  // namespace lobatto
