// SPDX-License-Identifier: GPL-2.0-or-later
// --budget: how long measuring may take.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace lobatto {

struct BudgetOption {
    std::string text = "20s";
    void add_to(CLI::App& command);
    double seconds() const;  // InputError
};

}  // namespace lobatto
