// SPDX-License-Identifier: GPL-2.0-or-later
// What a run asks of a derivation beside its kernel. All of it follows from the scene and a few facts, so that a kernel
// whose facts were kept need not be derived again.
#pragma once

#include <optional>

#include "generator/mechanics/derivation.hpp"

namespace lobatto {

// What only a derivation finds out.
struct SystemFacts {
    bool autonomous = false, linear = false;
    bool drops_time = false;  // the scene's Lagrangian holds the time, but the motion does not know it
    std::optional<ClosedSolution> closed_solution;
};

struct Outline {
    Scene scene;  // in the time of its clock
    SystemOutline system;
    Quadrature quadrature;
    std::optional<ClosedSolution> closed_solution;  // q'' = -w2 q, or -w2 sin(q)

    Outline(const Scene& scene, const SystemFacts& facts);
    Outline(const Derivation& derivation);  // NOLINT(google-explicit-constructor): it knows all that is asked for

    bool conserves_energy() const;  // as Derivation's
};

SystemFacts facts_of(const Derivation& derivation);

}  // namespace lobatto
