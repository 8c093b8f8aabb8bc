// SPDX-License-Identifier: GPL-2.0-or-later
// Drawings through gnuplot: SVG, PNG, or characters of a terminal.
#pragma once

#include <string>

namespace lobatto {

// Draws NAME.svg in `folder` as the script says; it finds the data files of the folder, a white page and the common
// grid, axes and line styles. The same script gives the same bytes. The name is any name of a file: it does not reach
// gnuplot. The picture appears whole or not at all. MachineError when gnuplot is missing or fails, or the machine
// refuses; `without`: how one does without the picture, "leave --chart out", if one can.
void draw(const std::string& folder, const std::string& name, const std::string& script, int width, int height,
          const std::string& without = "");

// The same as PATH, whose ending is .svg or .png, where the script holds its data.
void draw_picture(const std::string& path, const std::string& script, int width, int height);

// The same in characters, for a terminal of so many columns and rows.
std::string drawn_in_characters(const std::string& script, int columns, int rows);

// A text for gnuplot, between single quotes, where it is no command.
std::string gnuplot_text(const std::string& text);

}  // namespace lobatto
