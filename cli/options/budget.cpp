// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/options/budget.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "generator/formula/text/source.hpp"
#include "library/whole.hpp"

namespace lobatto {

void BudgetOption::add_to(Command& command) {
    command.option("--budget", text, "Time it may take, beside compiling what is measured first, as in 30s or 5min")
        .shown_as("TIME")
        .show_default();
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
    api::check_budget(seconds, text);
    return seconds;
}

}  // namespace lobatto
