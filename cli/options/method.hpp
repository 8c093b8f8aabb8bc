// SPDX-License-Identifier: GPL-2.0-or-later
// The method on the command line, instead of the scene's: --points, --stages or --splitting, --tolerance or
// --arithmetic, --numbers.
#pragma once

#include <optional>
#include <string>

#include "cli/options/command_line.hpp"
#include "generator/scene/scene.hpp"

namespace lobatto {

struct MethodOption {
    std::optional<int> points, stages, splitting;
    std::optional<double> tolerance;
    std::optional<std::string> arithmetic, numbers;

    void add_to(Command& command);
    std::pair<Option, Option> add_members_to(Command& command);  // --points and --stages alone
    void apply(Scene& scene) const;
    // InputError where the scene asks for other numbers than double, in which alone `command` computes.
    static void require_double(const Scene& scene, const std::string& command);
    std::optional<Method> member() const;  // nothing where none is named
};

}  // namespace lobatto
