// SPDX-License-Identifier: GPL-2.0-or-later
// Everything known of a scene before any code is written: what the later stages read.
#pragma once

#include <memory>
#include <utility>

#include "generator/mechanics/discretisation.hpp"
#include "generator/mechanics/structure/structure.hpp"
#include "generator/mechanics/system/system.hpp"
#include "generator/method/quadrature.hpp"
#include "generator/scene/scene.hpp"

namespace lobatto {

// Whether the motion keeps its energy: no time, no forces, and walls that give all of it back.
bool conserves_energy(const Scene& scene, const SystemOutline& system);
// Whether the time itself matters to the motion; to events that only look at it, it may.
bool changes_with_time(const Scene& scene, const SystemOutline& system);

struct Derivation {
    Scene scene;
    System system;
    Quadrature quadrature;
    Structure structure;
    std::vector<Finding> findings;  // what the structure rests on, and what was looked for in vain

    bool conserves_energy() const { return lobatto::conserves_energy(scene, system); }

    // The equations of all nodes written out, for people and for checks; a kernel is assembled from one node's formulas
    // and does not need them. Made at the first call.
    const Discretisation& discretisation() const;
    void put(Discretisation equations) {
        discretisation_ = std::make_shared<const Discretisation>(std::move(equations));
    }

private:
    mutable std::shared_ptr<const Discretisation> discretisation_;
};

}  // namespace lobatto
