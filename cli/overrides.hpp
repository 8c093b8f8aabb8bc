// SPDX-License-Identifier: GPL-2.0-or-later
// Values of a scene that the command line replaces.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "generator/scene.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace lobatto {

struct Overrides {
    std::vector<std::string> set;  // "name=expression": run-time parameters; the expression is a number such as 2*pi
    std::string step, until;       // expressions in the parameters; empty: as in the scene
    std::optional<long> every;

    void add_set_to(CLI::App& command);
    CLI::Option* add_step_to(CLI::App& command);
    CLI::Option* add_until_to(CLI::App& command);
};

// The bytes of an argument from `begin` on, to before `end`, each with its column.
Text text_of(const std::string& argument, std::size_t begin, std::size_t end = std::string::npos);

// Throws InputError with the place in the argument.
void apply(const Overrides& overrides, Scene& scene);

}  // namespace lobatto
