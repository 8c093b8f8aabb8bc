// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/constraints/impacts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace lobatto {

void check_impacts(const Scene& scene, const System& system) {
    for (const Impact& impact : scene.impacts)
        for (const auto& [place, mass] : system.momentum_v.entries())
            for (const GiNaC::symbol& v : system.v)
                if (impact.reset_position.empty() && mass.has(v))
                    scene.source.fail(impact.when.at,
                                      fmt::format("the wall {0} throws back velocities of a kinetic energy that is "
                                                  "quadratic in them, and this one is not; give a reset, such as "
                                                  "reset = {{ \"{1}'\" = \"-{1}'\" }}",
                                                  impact.written, scene.coordinates.front().written));
    require_start_before_walls(scene);
}

// A motion may leave a body behind a wall by a rounding, and such a state may be a start. Here no more is refused than
// what is surely behind; of the rest the kernel decides, which knows the metric of the coordinates.
void require_start_before_walls(const Scene& scene) {
    constexpr double rounding = 64 * std::numeric_limits<double>::epsilon();
    GiNaC::exmap start;
    double largest = 0;
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {
        start[scene.coordinates[k].position] = scene.initial_position[k];
        largest = std::max(largest, std::fabs(scene.evaluate(scene.initial_position[k], "the start").to_double()));
    }
    start[scene.time] = 0;
    for (const Impact& impact : scene.impacts) {
        if (impact.passes) continue;
        const auto value_at = [&](const GiNaC::exmap& place) {
            try {
                return scene.value_of(impact.when.value.subs(place)).to_double();
            } catch (const std::domain_error&) {
                scene.source.fail(impact.when.at,
                                  "the wall " + impact.written + " has no finite real value where the motion starts");
            }
        };
        const auto rounded_value = [&] {
            double most = 0;
            for (const Coordinate& moved : scene.coordinates) {
                GiNaC::exmap place = start;
                place[moved.position] += rounding * largest;
                most += std::fabs(value_at(place) - value_at(start));
            }
            return most;
        };
        const double value = value_at(start), depth = value * impact.when.direction;
        if (depth > 0 && depth > rounded_value())
            scene.source.fail(impact.when.at,
                              fmt::format("the start is behind the wall {}: the left side minus the right is {:.6g}, "
                                          "and a wall met {} asks for one {} 0",
                                          impact.written, value, impact.when.direction < 0 ? "falling" : "rising",
                                          impact.when.direction < 0 ? "of at least" : "of at most"));
    }
}

void refuse_impacts(const Scene& scene, const std::string& what) {
    if (!scene.impacts.empty())
        scene.source.fail(scene.impacts.front().when.at,
                          what + " knows no impacts; run, sweep, tune, tradeoff, emit, derive, check and verify do");
    if (!scene.switches.empty() || !scene.tables.empty())
        scene.source.fail(scene.switches.empty() ? scene.tables.front().at : scene.switches.front().at,
                          what +
                              " takes smooth formulas only; run, sweep, tune, tradeoff, emit, derive, check and verify "
                              "take this one, too");
}

void refuse_jumps(const Scene& scene, const std::string& what) {
    for (const Impact& impact : scene.impacts)
        for (std::size_t k = 0; k < impact.reset_position.size(); ++k)
            if (!impact.reset_position[k].is_equal(scene.coordinates[k].position))
                scene.source.fail(impact.when.at,
                                  fmt::format("{} compares positions along the motion, and the wall {} moves {}: just "
                                              "before and just after they differ, however good the steps are",
                                              what, impact.written, scene.coordinates[k].written));
}

}  // namespace lobatto
