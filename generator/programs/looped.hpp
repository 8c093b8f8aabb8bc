// SPDX-License-Identifier: GPL-2.0-or-later
// The programs of kernels with loops over repeated terms, and what their tables hold.
#pragma once

#include <utility>
#include <vector>

#include "generator/mechanics/derivation.hpp"
#include "generator/programs/programs.hpp"

namespace lobatto {

Programs looped_programs(const Derivation& derivation);

// The slots (i, j) of an element whose second derivative is not zero, row by row.
std::vector<std::pair<std::size_t, std::size_t>> pairs_of(const Element& element);
// Whether coefficients that vary are run-time parameters, not numbers.
bool has_parameters(const Element& element);

}  // namespace lobatto
