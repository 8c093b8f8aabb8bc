// SPDX-License-Identifier: MIT
// The motion by explicit extrapolation, which shares no formula with a step: what checks of steps may be judged by.
#pragma once

#include "runtime/measure/measured_order.hpp"

namespace lobatto {

// The largest frequency that the motion meets from its start to `duration`, radians per unit of time, as far as it can
// be followed; with constraints that at the start.
double fastest_oscillation(const Kernel& kernel, const QuadrupleStart& start, double duration);

// Whether the motion can be followed so far in steps of high order. False where an acceleration has no bound.
bool is_smooth(const Kernel& kernel, const QuadrupleStart& start, double duration);

}  // namespace lobatto
