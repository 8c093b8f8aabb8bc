// SPDX-License-Identifier: GPL-2.0-or-later
// Which initial value of a scene a name stands for: q, q' or p_q; x[3] and x_3 are the same.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "generator/scene/scene.hpp"

namespace lobatto {

struct InitialValue {
    bool is_rate = false;  // else the position
    std::size_t index = 0;
};

// Nothing where no coordinate has the name. Names whose value cannot be given go to `fail`, which throws; `verb`:
// "vary", "set".
std::optional<InitialValue> initial_value(const Scene& scene, const std::string& name, const std::string& verb,
                                          const std::function<void(const std::string&)>& fail);

// The names that there are, as the scene writes them.
std::vector<std::string> initial_names(const Scene& scene);

}  // namespace lobatto
