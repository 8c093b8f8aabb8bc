// SPDX-License-Identifier: GPL-2.0-or-later
// One page of HTML that holds all: pictures, scene, structure, machine and data; it asks nothing of any other file.
#pragma once

#include <string>
#include <vector>

#include "analysis/tradeoff/experiment.hpp"

namespace lobatto {

// `pictures`: names of SVG files in the folder, in order; `json`: the data.
std::string report_page(const Experiment& experiment, const std::string& folder,
                        const std::vector<std::string>& pictures, const std::string& json);

}  // namespace lobatto
