// SPDX-License-Identifier: GPL-2.0-or-later
// --budget: how long measuring may take.
#pragma once

#include <string>

#include "cli/options/command_line.hpp"

namespace lobatto {

struct BudgetOption {
    std::string text = "20s";
    void add_to(Command& command);
    double seconds() const;  // InputError
};

}  // namespace lobatto
