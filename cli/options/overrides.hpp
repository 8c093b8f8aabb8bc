// SPDX-License-Identifier: GPL-2.0-or-later
// --set, --step and --until: values on the command line that stand in for those of the scene.
#pragma once

#include "analysis/overrides.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace lobatto {

void add_set_option(CLI::App& command, Overrides& overrides);
CLI::Option* add_step_option(CLI::App& command, Overrides& overrides);
CLI::Option* add_until_option(CLI::App& command, Overrides& overrides);

}  // namespace lobatto
