// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/derivation.hpp"

#include <algorithm>

#include "generator/formula/limits.hpp"

namespace lobatto {

const Discretisation& Derivation::discretisation() const {
    if (discretisation_) return *discretisation_;
    const DerivationLimits limits(scene.path);
    discretisation_ = std::make_shared<const Discretisation>(discretise(system, quadrature));
    return *discretisation_;
}

bool changes_with_time(const Scene& scene, const SystemOutline& system) {
    const auto holds_time = [&](const auto& of) { return of.value.has(system.t); };
    return system.lagrangian.has(system.t) ||
           std::any_of(scene.constraints.begin(), scene.constraints.end(), holds_time) ||
           std::any_of(scene.switches.begin(), scene.switches.end(), holds_time);
}

bool conserves_energy(const Scene& scene, const SystemOutline& system) {
    const auto gives_all_back = [&](const Impact& impact) {
        return impact.reset_position.empty() && impact.restitution.is_equal(1) && !impact.when.value.has(system.t);
    };
    return !changes_with_time(scene, system) && !system.has_forces() && !scene.has_time_coordinate() &&
           std::all_of(scene.impacts.begin(), scene.impacts.end(), gives_all_back);
}

}  // namespace lobatto
