// SPDX-License-Identifier: MIT
// What a step keeps on the manifold that constraints leave of phase space: phi(q, t) = 0, G v + dphi/dt = 0.
#pragma once

#include <cstdint>

#include "runtime/measure/measured_order.hpp"

namespace lobatto {

// How much areas change in a step: |w1 - w| over the sum of the sizes of the terms of w, where w = dq . dp' - dq' . dp
// of two directions along the manifold, and w1 that of their images; largest of some random pairs at some states along
// the motion. Directions and images are differences of neighbours 1e-9 apart, good to about 1e-17.
double area_defect(const Kernel& kernel, const QuadrupleStart& start, __float128 step);

// Forwards and, with -h, backwards again: the distance from the start, relative to the largest position on the way.
double return_distance(const Kernel& kernel, const QuadrupleStart& start, __float128 step, std::int64_t steps);

}  // namespace lobatto
