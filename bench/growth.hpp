// SPDX-License-Identifier: GPL-2.0-or-later
// How the cost of a step grows with the number of coordinates, and what a linear step costs beside a matrix times a
// vector.
#pragma once

namespace lobatto::bench {

// Prints two tables in Markdown: chains of 8 to 4096 masses; linear systems of 1 to 16 coordinates.
void print_growth();

}  // namespace lobatto::bench
