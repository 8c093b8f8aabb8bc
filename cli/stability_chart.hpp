// SPDX-License-Identifier: GPL-2.0-or-later
// The stability chart: the trace with its bounds, and the growth of a step, theory and measurement.
#pragma once

#include <optional>
#include <string>

#include "cli/stability_report.hpp"

namespace lobatto {

// A gnuplot script; nothing when the scene has no oscillation to draw.
std::optional<std::string> stability_chart(const StabilityReport& report);

}  // namespace lobatto
