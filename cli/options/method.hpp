// SPDX-License-Identifier: GPL-2.0-or-later
// The method on the command line, instead of the scene's: --points, --stages or --splitting, --tolerance or
// --arithmetic, --numbers, --clock.
#pragma once

#include <utility>

#include "analysis/method_choice.hpp"
#include "cli/options/command_line.hpp"

namespace lobatto {

struct MethodOption : MethodChoice {
    void add_to(Command& command);
    std::pair<Option, Option> add_members_to(Command& command);  // --points and --stages alone
};

}  // namespace lobatto
