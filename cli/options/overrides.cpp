// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/options/overrides.hpp"

#include "library/parts.hpp"

namespace lobatto {

void add_set_option(Command& command, Overrides& overrides) {
    command
        .option(
            "--set", overrides.set,
            "Value of a parameter, or of the start, NAME=VALUE, as in m=2, omega=2*pi, q=0.5, q'=1 or p_q=1; may be "
            "repeated")
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

api::Settings settings_of(const MethodChoice& method, const Overrides& overrides) {
    api::Settings settings{method.points,
                           method.stages,
                           method.splitting,
                           method.tolerance,
                           method.arithmetic.value_or(""),
                           method.numbers.value_or(""),
                           method.clock.value_or(""),
                           {},
                           overrides.step,
                           overrides.until,
                           overrides.every};
    for (const std::string& argument : overrides.set) settings.set.push_back(api::named_value(argument));
    return settings;
}

}  // namespace lobatto
