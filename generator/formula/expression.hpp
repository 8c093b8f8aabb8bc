// SPDX-License-Identifier: GPL-2.0-or-later
// A formula to a GiNaC expression: sums written out, definitions inserted, exact.
#pragma once

#include <ginac/ginac.h>

#include <string>
#include <vector>

#include "generator/formula/formula.hpp"
#include "generator/formula/names.hpp"
#include "generator/formula/text/source.hpp"

namespace lobatto {

// `indices`: the values of those of the scope the formula was parsed in. Throws InputError.
Operand evaluate(const Source& source, const Syntax& formula, const Scope& scope,
                 const std::vector<long>& indices = {});

// A whole number that is known when the kernel is written, such as a count; `what` says which ("count").
long evaluate_whole(const Source& source, const Syntax& formula, const Scope& scope);

// Text to expression. Throws InputError.
GiNaC::ex parse_expression(const Source& source, const Text& text, const Scope& scope);

// The value of what was parsed, its symbols replaced by numbers. InputError at `at`, with the name of the formula, when
// it is not a real number that a double can hold with room to spare: 0, or of a size between 1e-300 and 1e300. What
// nobody wrote, `derived`, may be smaller.
GiNaC::numeric value_in_range(const Source& source, Position at, const GiNaC::ex& expression,
                              const std::string& formula, const GiNaC::exmap& symbols = {}, bool derived = false);

}  // namespace lobatto
