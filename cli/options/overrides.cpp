// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/options/overrides.hpp"

#include <CLI/CLI.hpp>

namespace lobatto {

void add_set_option(CLI::App& command, Overrides& overrides) {
    command
        .add_option("--set", overrides.set,
                    "Value of a parameter, NAME=VALUE, as in m=2 or omega=2*pi; may be repeated")
        ->allow_extra_args(false);
}

CLI::Option* add_step_option(CLI::App& command, Overrides& overrides) {
    return command.add_option("--step", overrides.step, "Step h; may use the scene's parameters, as in 2*pi/omega/50");
}

CLI::Option* add_until_option(CLI::App& command, Overrides& overrides) {
    return command.add_option("--until", overrides.until, "End time; may use the scene's parameters");
}

}  // namespace lobatto
