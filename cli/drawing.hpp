// SPDX-License-Identifier: GPL-2.0-or-later
// Drawings as SVG files, through gnuplot.
#pragma once

#include <string>

namespace lobatto {

// Writes NAME.svg into `folder` as the script says; it finds the data files of the folder, a white page and the common
// grid, axes and line styles. The same script gives the same bytes. MachineError, with `advice` for the case that
// gnuplot is missing, when it fails.
void draw(const std::string& folder, const std::string& name, const std::string& script, int width, int height,
          const std::string& advice);

}  // namespace lobatto
