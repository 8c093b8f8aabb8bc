// SPDX-License-Identifier: GPL-2.0-or-later
// What is said of a computation when it has ended: a line for each fact.
#pragma once

#include <cstdint>
#include <string>

namespace lobatto {

void print_row(const std::string& label, const std::string& value);

// "1 step", "2 steps".
std::string counted(std::int64_t count, const std::string& one, const std::string& many);

// Three digits and a unit.
std::string duration(double seconds);

}  // namespace lobatto
