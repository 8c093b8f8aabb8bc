// SPDX-License-Identifier: GPL-2.0-or-later
// The pictures of a trade: work against precision, and error and energy against time.
#pragma once

#include <string>
#include <vector>

#include "analysis/tradeoff/experiment.hpp"

namespace lobatto {

// NAME.svg each, in the folder; the names that were drawn. MachineError when gnuplot is missing.
std::vector<std::string> draw_pictures(Experiment& experiment, const std::string& folder);

}  // namespace lobatto
