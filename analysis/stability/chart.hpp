// SPDX-License-Identifier: GPL-2.0-or-later
// The stability chart: the trace with its bounds, and the growth of a step, theory and measurement.
#pragma once

#include <string>

#include "analysis/stability/report.hpp"

namespace lobatto {

// A gnuplot script. Of a linear scene, or of the equilibrium with the fastest oscillation; without one the stiffest
// moment of the motion is marked, and nothing is measured.
std::string stability_chart(const StabilityReport& report);

}  // namespace lobatto
