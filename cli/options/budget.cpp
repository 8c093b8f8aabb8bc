// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/options/budget.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "generator/formula/source.hpp"

namespace lobatto {

namespace {

constexpr double least = 1, most = 86400;

}  // namespace

void BudgetOption::add_to(Command& command) {
    command.option("--budget", text, "Time it may take, as in 30s or 5min").shown_as("TIME").show_default();
}

double BudgetOption::seconds() const {
    if (const std::string complaint = number_complaint(text); !complaint.empty())
        throw InputError("--budget: " + complaint);
    char* unit = nullptr;
    const double value = std::strtod(text.c_str(), &unit);
    const std::string rest = unit;
    const double factor = rest.empty() || rest == "s" ? 1 : rest == "min" ? 60 : rest == "h" ? 3600 : std::nan("");
    const double seconds = value * factor;
    if (unit == text.c_str() || std::isnan(seconds))
        throw InputError(fmt::format("--budget: '{}' is not a time; write 30s, 5min or 1h", text));
    if (!(seconds >= least && seconds <= most))
        throw InputError(fmt::format(
            "--budget: {} is {} for one measurement, which needs a compiled kernel; give 1s to 24h, as in --budget 30s",
            text, seconds < least ? "too little" : "too much"));
    return seconds;
}

}  // namespace lobatto
