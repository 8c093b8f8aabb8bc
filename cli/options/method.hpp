// SPDX-License-Identifier: GPL-2.0-or-later
// The method on the command line, instead of the scene's: --points, --stages or --splitting, --tolerance or
// --arithmetic.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "generator/scene/scene.hpp"

namespace lobatto {

struct MethodOption {
    std::optional<int> points, stages, splitting;
    std::optional<double> tolerance;
    std::optional<std::string> arithmetic;

    void add_to(CLI::App& command);
    void add_members_to(CLI::App& command);  // --points and --stages alone
    void apply(Scene& scene) const;
    std::optional<Method> member() const;  // nothing where none is named
};

}  // namespace lobatto
