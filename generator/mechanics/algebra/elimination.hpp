// SPDX-License-Identifier: GPL-2.0-or-later
// Gaussian elimination of sparse matrices of 60-digit numbers.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "generator/mechanics/algebra/sample.hpp"

namespace lobatto {

struct Elimination {
    bool singular = false;
    // Singular: the first direction that the matrix maps to zero. Else: x with A x = right. n components.
    std::vector<cln::cl_R> vector;
};

// `entries` of the n x n matrix A, by row and column; a pivot below 1e-35 of what its row was computed from is zero.
Elimination eliminate(const std::map<std::pair<int, int>, Sized>& entries, std::vector<cln::cl_R> right);

}  // namespace lobatto
