// SPDX-License-Identifier: GPL-2.0-or-later
// --set, --step and --until: values on the command line that stand in for those of the scene; with the method, as the
// library takes them.
#pragma once

#include "analysis/method_choice.hpp"
#include "analysis/overrides.hpp"
#include "cli/options/command_line.hpp"
#include "library/include/lobatto/lobatto.hpp"

namespace lobatto {

void add_set_option(Command& command, Overrides& overrides);
Option add_step_option(Command& command, Overrides& overrides);
Option add_until_option(Command& command, Overrides& overrides);

api::Settings settings_of(const MethodChoice& method, const Overrides& overrides = {});

}  // namespace lobatto
