// SPDX-License-Identifier: GPL-2.0-or-later
// Products and powers of sums written out, where that is short.
#pragma once

#include <ginac/ginac.h>

namespace lobatto {

// An upper bound of the terms that writing it out would make, in arguments of functions too; at most some 1e9 times
// what it would be without its powers.
double terms_when_expanded(const GiNaC::ex& expression);

// The expression, written out if that takes at most `most_terms` terms; else as it is: ((x^64 + 1)^64 + 1)^64 has more
// terms than memory has room for.
constexpr double most_terms = 10000;
GiNaC::ex expanded(const GiNaC::ex& expression);

}  // namespace lobatto
