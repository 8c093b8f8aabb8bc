// SPDX-License-Identifier: GPL-2.0-or-later
// A method that stands in for the scene's; the words are those of the command line.
#pragma once

#include <optional>
#include <string>

#include "generator/scene/scene.hpp"

namespace lobatto {

struct MethodChoice {
    std::optional<int> points, stages, splitting;  // one of them at most
    std::optional<double> tolerance;
    std::string arithmetic, numbers;  // empty: as in the scene, and so is `clock`
    std::string clock;                // "none": equal steps, "auto"

    // InputError for what there is not, and for two methods at once.
    void apply(Scene& scene) const;
    // InputError where the scene asks for other numbers than double, in which alone `command` computes.
    static void require_double(const Scene& scene, const std::string& command);
    std::optional<Method> member() const;  // nothing where none is named
};

// What is wrong with a tolerance; empty: nothing. `written`: as errors show it.
std::string tolerance_complaint(double tolerance, const std::string& written);

}  // namespace lobatto
