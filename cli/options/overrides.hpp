// SPDX-License-Identifier: GPL-2.0-or-later
// --set, --step and --until: values on the command line that stand in for those of the scene.
#pragma once

#include "analysis/overrides.hpp"
#include "cli/options/command_line.hpp"

namespace lobatto {

void add_set_option(Command& command, Overrides& overrides);
Option add_step_option(Command& command, Overrides& overrides);
Option add_until_option(Command& command, Overrides& overrides);

}  // namespace lobatto
