// SPDX-License-Identifier: GPL-2.0-or-later
// The order of a splitting method, found by power series.
#pragma once

#include <cstddef>

#include "generator/method/quadrature.hpp"

namespace lobatto {

// How far the coefficients of h, h^2, ... h^order of a step differ from those of the motion, for q'' = -grad V with two
// coordinates and a V of no symmetry, whose derivatives up to the fifth occur; the largest, relative to the largest of
// the motion's. With 60 digits.
double splitting_defect(const Quadrature& quadrature, std::size_t order);

}  // namespace lobatto
