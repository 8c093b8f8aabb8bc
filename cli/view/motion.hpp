// SPDX-License-Identifier: GPL-2.0-or-later
// A scene, run for the eye: its states at so many times that the motion looks smooth, and all that is drawn of them.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "cli/view/page.hpp"
#include "library/parts.hpp"

namespace lobatto {

struct Viewed {
    ViewMotion motion;
    std::vector<ViewChart> charts;
    std::string title;
    bool is_interrupted = false;
    std::string failure;  // why the page does not show the motion as it is, to its end; empty: it does
};

// `most_numbers`: of all channels together, which decides how large the page is. `progress` hears the steps done, and
// of how many.
Viewed viewed_motion(const api::Scene& scene, const api::Settings& settings, bool is_alone, std::size_t most_numbers,
                     const std::function<void(std::int64_t, std::int64_t)>& progress);

}  // namespace lobatto
