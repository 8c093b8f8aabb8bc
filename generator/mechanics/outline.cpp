// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/outline.hpp"

#include "generator/mechanics/clock/clock.hpp"

namespace lobatto {

Outline::Outline(const Scene& written, const SystemFacts& facts) : scene(in_clock_time(written)) {
    system = undifferentiated(facts.drops_time ? without_time(scene) : scene);
    system.momentum = gradient_of(terms_of(system.lagrangian, system.motion()), system.v);
    system.momentum_v = derivative_of(system.momentum, system.v);
    system.autonomous = facts.autonomous;
    system.linear = facts.linear;
    quadrature = quadrature_of(scene.method);
    closed_solution = facts.closed_solution;
}

Outline::Outline(const Derivation& derivation) : Outline(derivation.scene, facts_of(derivation)) {}

bool Outline::conserves_energy() const {
    return lobatto::conserves_energy(scene, system);
}

SystemFacts facts_of(const Derivation& derivation) {
    SystemFacts facts{derivation.system.autonomous, derivation.system.linear,
                      !derivation.system.lagrangian.is_equal(derivation.scene.lagrangian),
                      derivation.structure.closed_solution};
    for (std::size_t k = 0; k < derivation.scene.coordinates.size(); ++k)
        facts.drops_time =
            facts.drops_time || !derivation.system.outer_force[k].is_equal(derivation.scene.coordinates[k].force);
    return facts;
}

}  // namespace lobatto
