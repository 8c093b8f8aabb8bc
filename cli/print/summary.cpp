// SPDX-License-Identifier: GPL-2.0-or-later
// What is said of a computation when it has ended: a line for each fact.
#include "cli/print/summary.hpp"

#include <fmt/format.h>

namespace lobatto {

void print_row(const std::string& label, const std::string& value) {
    fmt::print("  {:<23} {}\n", label, value);
}

std::string counted(std::int64_t count, const std::string& one, const std::string& many) {
    return fmt::format("{} {}", count, count == 1 ? one : many);
}

std::string duration(double seconds) {
    if (seconds < 1e-6) return fmt::format("{:.3g} ns", seconds * 1e9);
    if (seconds < 1e-3) return fmt::format("{:.3g} us", seconds * 1e6);
    return seconds < 1 ? fmt::format("{:.3g} ms", seconds * 1e3) : fmt::format("{:.3g} s", seconds);
}

}  // namespace lobatto
