// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/options/overrides.hpp"

namespace lobatto {

void add_set_option(Command& command, Overrides& overrides) {
    command.option("--set", overrides.set, "Value of a parameter, NAME=VALUE, as in m=2 or omega=2*pi; may be repeated")
        .shown_as("NAME=VALUE")
        .one_value_each();
}

Option add_step_option(Command& command, Overrides& overrides) {
    return command.option("--step", overrides.step, "Step h; may use the scene's parameters, as in 2*pi/omega/50")
        .shown_as("STEP");
}

Option add_until_option(Command& command, Overrides& overrides) {
    return command.option("--until", overrides.until, "End time; may use the scene's parameters").shown_as("TIME");
}

}  // namespace lobatto
