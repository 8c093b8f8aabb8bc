// SPDX-License-Identifier: GPL-2.0-or-later
// Where measured values bend sharply: a blow, an edge.
#pragma once

#include <vector>

#include "generator/formula/spline.hpp"

namespace lobatto {

struct Bend {
    double place;  // a knot where the second derivative is largest among its neighbours
    double width;  // on which it alone would change the values by all that they range over
};

// The sharpest first.
std::vector<Bend> bends_of(const Spline& spline);

}  // namespace lobatto
