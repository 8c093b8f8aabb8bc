// SPDX-License-Identifier: GPL-2.0-or-later
// Two functions of formulas of pieces, whose sides are symbols elsewhere (Switch in names.hpp).
//
// A step that is to be cut at u = 0 looks beyond it first, with the piece that it comes from. There a piece such as
// max(u, 0) is negative, and a broken power of it has no value. positive_part(u) is u where u > 0 and 0 elsewhere, so
// that the power is 0 beyond. Its derivative is given as 1: derivatives of powers above 1 are 0 beyond, too.
//
// side_of(u), 1 where u > 0 and -1 elsewhere, is for formulas that are evaluated along a motion and not derived.
#pragma once

#include <ginac/ginac.h>

namespace lobatto {

DECLARE_FUNCTION_1P(positive_part)
DECLARE_FUNCTION_1P(side_of)
bool is_positive_part(const GiNaC::ex& expression);
bool is_side(const GiNaC::ex& expression);

}  // namespace lobatto
