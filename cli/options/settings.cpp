// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/options/settings.hpp"

#include <cstdlib>
#include <string>

#include "analysis/method_choice.hpp"
#include "generator/method/splitting.hpp"
#include "library/parts.hpp"

namespace lobatto {

std::pair<Option, Option> add_member_options(Command& command, api::Settings& settings) {
    Option lobatto = command.option("--points", settings.points, "Lobatto with this many points: order 2 points - 2");
    lobatto.shown_as("N");
    Option gauss = command.option("--stages", settings.stages, "Gauss with this many stages: order 2 stages");
    gauss.shown_as("N");
    lobatto.between(2, 12);
    gauss.between(1, 10).excludes(lobatto);
    return {lobatto, gauss};
}

void add_method_options(Command& command, api::Settings& settings) {
    const auto [lobatto, gauss] = add_member_options(command, settings);
    command
        .option("--splitting", settings.splitting,
                "An explicit splitting method with this many stages: 6 (order 4), 11, 14 (6), 17 (8), 35 (10)")
        .shown_as("N")
        .one_of(splitting_stages())
        .excludes(lobatto)
        .excludes(gauss);
    command.option("--tolerance", settings.tolerance, "Stop the iteration of a step at increments this small, relative")
        .shown_as("EPSILON")
        .checked_by(
            [](const std::string& text) { return tolerance_complaint(std::strtod(text.c_str(), nullptr), text); });
    command
        .option("--arithmetic", settings.arithmetic,
                "Plain, or clean: rounding errors grow like a random walk only (slower)")
        .shown_as("KIND")
        .one_of(std::vector<std::string>{"plain", "clean"});
    command
        .option("--numbers", settings.numbers,
                "What the steps are computed in: double, quadruple, \"50 digits\" and others")
        .shown_as("TYPE")
        .checked_by([](const std::string& text) {
            return precision_of(text) ? "" : "unknown numbers; there are " + precision_list();
        });
    command.option("--clock", settings.clock, "Equal steps, or those of the clock that follows from the Lagrangian")
        .shown_as("CLOCK")
        .checked_by([](const std::string& text) {
            return text == "none" || text == "auto"
                       ? std::string()
                       : "it is none or auto; a formula stands in the scene, under [method]: clock = \"" + text + "\"";
        });
}

Option add_general_flag(Command& command, Shortcuts& shortcuts) {
    return command.flag(
        "--general", [&shortcuts] { shortcuts = Shortcuts::none; },
        "Turn off all shortcuts that the scene's structure allows, for comparison");
}

Option add_set_option(Command& command, api::Settings& settings) {
    Option option = command.option(
        "--set", [&settings](const std::string& argument) { settings.set.push_back(api::named_value(argument)); },
        "Value of a parameter, or of the start, NAME=VALUE, as in m=2, omega=2*pi, q=0.5, q'=1 or p_q=1; may be "
        "repeated");
    return option.shown_as("NAME=VALUE").one_value_each();
}

Option add_step_option(Command& command, api::Settings& settings) {
    return command.option("--step", settings.step, "Step h; may use the scene's parameters, as in 2*pi/omega/50")
        .shown_as("STEP");
}

Option add_until_option(Command& command, api::Settings& settings) {
    return command.option("--until", settings.until, "End time; may use the scene's parameters").shown_as("TIME");
}

}  // namespace lobatto
