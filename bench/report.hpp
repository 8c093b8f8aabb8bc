// SPDX-License-Identifier: GPL-2.0-or-later
// What a race is told as: tables in Markdown, one CSV line a measurement, work-precision diagrams.
#pragma once

#include "bench/race.hpp"

namespace lobatto::bench {

void print_machine();
void print_tables(const std::vector<Race>& races);  // of the same number of trajectories
void write_csv(const std::string& path, const std::vector<Race>& races);
void draw_diagram(const std::string& folder, const Race& race);

}  // namespace lobatto::bench
