// SPDX-License-Identifier: GPL-2.0-or-later
// Constraints that are equations for one coordinate, while a scene is read: they tell its start.
#include <fmt/format.h>

#include <algorithm>

#include "generator/scene/eliminated.hpp"
#include "generator/scene/system_reader.hpp"

namespace lobatto {

// Where one side is a coordinate, the other side tells it.
void SystemReader::solve_constraint(Constraint& constraint, const EventSyntax& sides, const Scope& scope,
                                    const std::vector<long>& indices) const {
    for (const Syntax* side : {&sides.left(), &sides.right()}) {
        if (side->kind != Syntax::Kind::name || constraint.solved_for) continue;
        const GiNaC::ex x = evaluate(source_, *side, scope, indices).expression;
        const auto found = std::find_if(scene_.coordinates.begin(), scene_.coordinates.end(),
                                        [&](const Coordinate& c) { return x.is_equal(c.position); });
        if (found == scene_.coordinates.end()) continue;
        constraint.solved_for = static_cast<std::size_t>(found - scene_.coordinates.begin());
        constraint.solution = side == &sides.left() ? x - constraint.value : x + constraint.value;
    }
}

// The starts of coordinates that have none follow from constraints that are equations for them.
void SystemReader::follow_equations(std::set<std::size_t>& missing) {
    GiNaC::exmap start{{scene_.time, 0}};
    const auto know = [&](std::size_t k) {
        start[scene_.coordinates[k].position] = scene_.initial_position[k];
        start[scene_.coordinates[k].velocity] = scene_.initial_rate[k];
    };
    for (std::size_t k = 0; k < scene_.coordinates.size(); ++k)
        if (missing.count(k) == 0) know(k);
    const auto is_known = [&](const Constraint& equation) {
        return std::none_of(missing.begin(), missing.end(),
                            [&](std::size_t k) { return equation.solution.has(scene_.coordinates[k].position); }) &&
               std::none_of(names_.switches.begin(), names_.switches.end(),
                            [&](const Switch& one) { return equation.solution.has(one.side); });
    };
    for (std::size_t before = 0; !missing.empty() && before != missing.size();) {
        before = missing.size();
        for (const Constraint& equation : scene_.constraints) {
            if (!equation.solved_for || missing.count(*equation.solved_for) == 0 || !is_known(equation)) continue;
            if (scene_.start == Start::momentum) continue;
            const std::size_t k = *equation.solved_for;
            scene_.initial_position[k] = equation.solution.subs(start, GiNaC::subs_options::no_pattern);
            scene_.initial_rate[k] =
                rate_of_change(equation.solution, scene_).subs(start, GiNaC::subs_options::no_pattern);
            const std::string& name = scene_.coordinates[k].written;
            value_in_range(source_, equation.at, scene_.initial_position[k], "the initial position of " + name,
                           parameter_values_, true);
            value_in_range(source_, equation.at, scene_.initial_rate[k], "the initial velocity of " + name,
                           parameter_values_, true);
            scene_.coordinates[k].rate_at = equation.at;
            scene_.coordinates[k].follows = true;
            missing.erase(k);
            know(k);
        }
    }
    if (missing.empty()) return;
    const std::size_t k = *missing.begin();
    const Group& group = *std::find_if(groups_.begin(), groups_.end(),
                                       [&](const Group& one) { return k >= one.first && k < one.first + one.count; });
    fail(group.entry->at,
         fmt::format(
             "{0} has no start: add position = 1 and {1} = 0{2}", scene_.coordinates[k].written,
             scene_.start == Start::velocity ? "velocity" : "momentum",
             scene_.start == Start::velocity
                 ? fmt::format(", or a constraint that tells it, as in \"{} = ...\"", scene_.coordinates[k].written)
                 : ""));
}

}  // namespace lobatto
