// SPDX-License-Identifier: GPL-2.0-or-later
// Values that stand in for those of a scene: parameters, the start, step, end, what is kept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "generator/scene/scene.hpp"

namespace lobatto {

struct Overrides {
    // "name=expression": run-time parameters, by a number such as 2*pi; q, q' or p_q of the start, in the parameters.
    std::vector<std::string> set;
    std::string step, until;      // expressions in the parameters; empty: as in the scene
    std::optional<double> every;  // one of so many states is kept; with a clock, the time between two
};

// The bytes of an argument from `begin` on, to before `end`, each with its column.
Text text_of(const std::string& argument, std::size_t begin, std::size_t end = std::string::npos);

// Throws InputError with the place in the argument.
void apply(const Overrides& overrides, Scene& scene);

// The scene with the values that are set alone; empty where none are.
std::function<Scene()> with_values(const Scene& scene, const Overrides& overrides);

// A sweep keeps one of so many states; 0: the last one alone. With a clock those at the scene's times are kept.
std::int64_t kept_by_sweeps(const Overrides& overrides, const Scene& scene);

}  // namespace lobatto
