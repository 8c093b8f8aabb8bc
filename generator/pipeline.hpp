// SPDX-License-Identifier: GPL-2.0-or-later
// The one place that calls the stages in order: scene -> system -> quadrature -> structure -> (discretisation) -> graph
// -> passes -> kernel source.
#pragma once

#include <memory>
#include <string>

#include "generator/discretisation.hpp"
#include "generator/emit.hpp"
#include "generator/quadrature.hpp"
#include "generator/scene.hpp"
#include "generator/structure.hpp"
#include "generator/system.hpp"

namespace lobatto {

// Everything known of a scene before any code is written.
struct Derivation {
    Scene scene;
    System system;
    Quadrature quadrature;
    Structure structure;

    // The equations of all nodes written out, for people and for checks; a kernel is assembled from one node's formulas
    // and does not need them. Made at the first call.
    const Discretisation& discretisation() const;
    void put(Discretisation equations) {
        discretisation_ = std::make_shared<const Discretisation>(std::move(equations));
    }

private:
    mutable std::shared_ptr<const Discretisation> discretisation_;
};

// `general`: with every shortcut of Structure switched off.
Derivation derive(const Scene& scene, bool general = false);
// The same system by another member of the family: only what depends on it is found anew.
Derivation with_method(const Derivation& derivation, const Method& method);
KernelSource emit(const Derivation& derivation, const EmitOptions& options = {});

}  // namespace lobatto
