// SPDX-License-Identifier: GPL-2.0-or-later
// How long a step of a member of the family may be before it amplifies an oscillation.
#pragma once

#include <limits>

#include "generator/method/quadrature.hpp"

namespace lobatto {

// The h omega where the first unstable interval begins that is worth a warning (generator/stability, exact): intervals
// in which no step grows by more than 1e-6 are passed over. Those of Lobatto's high orders near multiples of pi are
// narrower than what any step would meet: the first limit of 8 points is pi, growth there 4e-9; this one is 6.283.
// Infinite for Gauss, and where no limit of either kind lies below `up_to`, rounded up: that is told in milliseconds
// (Sturm's theorem), while all intervals of 12 points take a quarter of a second. Of splitting methods by numbers.
double stability_limit(const Quadrature& quadrature, double up_to = std::numeric_limits<double>::infinity());

// A part of a step of this h omega that is below the limit, to two digits.
double part_below(double limit, double radians);

}  // namespace lobatto
