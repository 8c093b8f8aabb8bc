// SPDX-License-Identifier: GPL-2.0-or-later
// Explicit symplectic splitting methods for q'' = -W(q): kicks and drifts in turn, with published coefficients.
#pragma once

#include <ginac/ginac.h>

#include <vector>

namespace lobatto {

// One step: kick u -= h b_0 W(q), drift q += h a_0 u, kick with b_1, ... drift with a_{r-1}, kick with b_r; a
// palindrome. A method that begins and ends with a drift has b_0 = b_r = 0. All numbers are the published decimals,
// exactly; the middle ones complete the sums to 1. Further digits are not known: orders hold to `digits` digits.
struct Splitting {
    int stages = 0;  // gradients a step
    int order = 0;
    int digits = 0;
    std::vector<GiNaC::numeric> kicks, drifts;  // r + 1 and r
};

// The stages of all there are, ascending: 6, 11, 14, 17, 35.
const std::vector<int>& splitting_stages();
int splitting_order(int stages);     // std::invalid_argument where there is none
Splitting splitting_of(int stages);  // the same

}  // namespace lobatto
