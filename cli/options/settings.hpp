// SPDX-License-Identifier: GPL-2.0-or-later
// What stands on the command line instead of the scene's: the method, and values, as the library takes them.
#pragma once

#include <utility>

#include "cli/options/command_line.hpp"
#include "generator/mechanics/structure/structure.hpp"
#include "library/include/lobatto/lobatto.hpp"

namespace lobatto {

// --points, --stages or --splitting, --tolerance or --arithmetic, --numbers, --clock.
void add_method_options(Command& command, api::Settings& settings);
std::pair<Option, Option> add_member_options(Command& command, api::Settings& settings);  // --points and --stages alone

Option add_general_flag(Command& command, Shortcuts& shortcuts);

Option add_set_option(Command& command, api::Settings& settings);
Option add_step_option(Command& command, api::Settings& settings);
Option add_until_option(Command& command, api::Settings& settings);

}  // namespace lobatto
