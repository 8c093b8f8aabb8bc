// SPDX-License-Identifier: GPL-2.0-or-later
// The programs of kernels with loops over repeated terms, and what their tables hold.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "generator/mechanics/derivation.hpp"
#include "generator/programs/programs.hpp"

namespace lobatto {

Programs looped_programs(const Derivation& derivation);

// Whether all second derivatives are there, of so many variables that no table says where they stand: that of variables
// i and j of N is number i N + j.
bool has_full_matrix(const Derivation& derivation);
// The values of each coefficient: a number a row, or a body where the rows are all pairs of bodies.
std::vector<std::vector<GiNaC::ex>> coefficient_tables(const Element& element);
// How a row's loop calls the place of the second derivative by the slots pairs[column], among all entries.
std::string entry_of_row(const Derivation& derivation, int element,
                         const std::vector<std::pair<std::size_t, std::size_t>>& pairs, std::size_t column);
// Whether coefficients that vary are run-time parameters, not numbers.
bool has_parameters(const Element& element);

}  // namespace lobatto
