// SPDX-License-Identifier: GPL-2.0-or-later
// What a run costs, independent of the machine: evaluations of the gradient of V, or of L.
#pragma once

#include "runtime/build/library.hpp"

namespace lobatto {

// From the iterations and the steps of a run.
double gradients_of(const lobatto_kernel& kernel, double iterations, double steps);

}  // namespace lobatto
