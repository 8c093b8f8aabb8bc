// SPDX-License-Identifier: GPL-2.0-or-later
// Formulas of pieces, whose sides are symbols (Switch in names.hpp), and two functions that stand for them.
//
// A step that is to be cut at u = 0 looks beyond it first, with the piece that it comes from. There a piece such as
// max(u, 0) is negative, and a broken power of it has no value. positive_part(u) is u where u > 0 and 0 elsewhere, so
// that the power is 0 beyond. Its derivative is given as 1: derivatives of powers above 1 are 0 beyond, too.
//
// side_of(u), 1 where u > 0 and -1 elsewhere, is for formulas that are evaluated along a motion and not derived.
#pragma once

#include <ginac/ginac.h>

#include <functional>
#include <vector>

#include "generator/formula/names.hpp"

namespace lobatto {

DECLARE_FUNCTION_1P(positive_part)
DECLARE_FUNCTION_1P(side_of)
bool is_positive_part(const GiNaC::ex& expression);
bool is_side(const GiNaC::ex& expression);

// Of `first` where u > 0, `second` elsewhere: 1 for max(u, 0) and max(-u, 0), -1 for their negatives, which have one
// sign everywhere; 0 for all others.
int sign_of_pieces(const GiNaC::ex& u, const GiNaC::ex& first, const GiNaC::ex& second);
// Pieces of that sign, with their form beyond the switch.
Operand with_one_sign(int sign, Operand pieces);
// The base of a power: that form, where the power and its derivative are 0 beyond the switch.
Operand power_base(const Operand& base, const Operand& exponent, const Arithmetic& arithmetic);

// What has the sign of u and is finite where u has a pole, because a denominator `moves`. Of a few denominators it is
// numerator times denominator, which is 0 at the pole; else atan(u), which jumps there.
GiNaC::ex without_poles(const GiNaC::ex& u, const std::function<bool(const GiNaC::ex&)>& moves);
// The side of a switch of u, which changes with what u holds.
Operand as_side(const GiNaC::symbol& symbol, const Operand& u);
// Whether u is 0 over stretches of a motion, where formulas of pieces in it are constant: with some choice of their
// sides, at places by chance.
bool stays_zero(const GiNaC::ex& u, const std::vector<Switch>& switches);

}  // namespace lobatto
