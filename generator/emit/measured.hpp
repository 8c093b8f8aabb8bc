// SPDX-License-Identifier: GPL-2.0-or-later
// Measured values in a kernel: its splines as tables.
#pragma once

#include <string>

#include "generator/graph/passes.hpp"
#include "generator/graph/precision.hpp"

namespace lobatto {

// The splines of the scene, in the order of their names.
std::string measured_values(const Programs& programs, Precision precision);

}  // namespace lobatto
