// SPDX-License-Identifier: GPL-2.0-or-later
// What the rounding of a formula is measured by: the summands of all sums in it, each with its effect on the whole. In
// floating point f is known to about epsilon times the sum of their sizes, however small f itself is.
#pragma once

#include <ginac/ginac.h>

#include <vector>

namespace lobatto {

// Each once, but for its sign, of the sums in f, and of those in its factors, bases of powers and functions: (x - a)^2
// + b has 2 (x - a) x, 2 (x - a) a, (x - a)^2 and b. Of what is no sum, f too. Their order is not the same everywhere.
std::vector<GiNaC::ex> summands_of(const GiNaC::ex& f);

}  // namespace lobatto
