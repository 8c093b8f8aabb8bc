// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/options/method.hpp"

#include <cstdlib>
#include <string>

#include "generator/method/splitting.hpp"

namespace lobatto {

std::pair<Option, Option> MethodOption::add_members_to(Command& command) {
    Option lobatto = command.option("--points", points, "Lobatto with this many points: order 2 points - 2");
    lobatto.shown_as("N");
    Option gauss = command.option("--stages", stages, "Gauss with this many stages: order 2 stages");
    gauss.shown_as("N");
    lobatto.between(2, 12);
    gauss.between(1, 10).excludes(lobatto);
    return {lobatto, gauss};
}

void MethodOption::add_to(Command& command) {
    const auto [lobatto, gauss] = add_members_to(command);
    command
        .option("--splitting", splitting,
                "An explicit splitting method with this many stages: 6 (order 4), 11, 14 (6), 17 (8), 35 (10)")
        .shown_as("N")
        .one_of(splitting_stages())
        .excludes(lobatto)
        .excludes(gauss);
    command.option("--tolerance", tolerance, "Stop the iteration of a step at increments this small, relative")
        .shown_as("EPSILON")
        .checked_by(
            [](const std::string& text) { return tolerance_complaint(std::strtod(text.c_str(), nullptr), text); });
    command.option("--arithmetic", arithmetic, "Plain, or clean: rounding errors grow like a random walk only (slower)")
        .shown_as("KIND")
        .one_of(std::vector<std::string>{"plain", "clean"});
    command.option("--numbers", numbers, "What the steps are computed in: double, quadruple, \"50 digits\" and others")
        .shown_as("TYPE")
        .checked_by([](const std::string& text) {
            return precision_of(text) ? "" : "unknown numbers; there are " + precision_list();
        });
    command.option("--clock", clock, "Equal steps, or those of the clock that follows from the Lagrangian")
        .shown_as("CLOCK")
        .checked_by([](const std::string& text) {
            return text == "none" || text == "auto"
                       ? std::string()
                       : "it is none or auto; a formula stands in the scene, under [method]: clock = \"" + text + "\"";
        });
}

}  // namespace lobatto
