// SPDX-License-Identifier: GPL-2.0-or-later
// Drawings as SVG files, through gnuplot.
#pragma once

#include <string>

namespace lobatto {

// Draws NAME.svg in `folder` as the script says; it finds the data files of the folder, a white page and the common
// grid, axes and line styles. The same script gives the same bytes. The name is any name of a file: it does not reach
// gnuplot. The picture appears whole or not at all. MachineError when gnuplot is missing or fails, or the machine
// refuses; `without`: how one does without the picture, "leave --chart out", if one can.
void draw(const std::string& folder, const std::string& name, const std::string& script, int width, int height,
          const std::string& without = "");

// A text for gnuplot, between single quotes, where it is no command.
std::string gnuplot_text(const std::string& text);

}  // namespace lobatto
