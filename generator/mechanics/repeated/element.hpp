// SPDX-License-Identifier: GPL-2.0-or-later
// One formula that stands in a sum many times, and what it is applied to.
#pragma once

#include <ginac/ginac.h>

#include <vector>

namespace lobatto {

// T(x; a), the same for every row; x_j stands for variable rows[r][j], a_j for coefficients[r][j].
struct Element {
    std::vector<GiNaC::symbol> x, a;
    GiNaC::ex term;                      // in x, a, time and run-time parameters that are the same in all rows
    std::vector<std::vector<int>> rows;  // rows x |x|: which variable
    std::vector<std::vector<GiNaC::ex>> coefficients;  // rows x |a|: a number or a parameter
    int target = -1;  // -1: the rows are terms of a potential; else: of the force on the variable x[target]
};

}  // namespace lobatto
