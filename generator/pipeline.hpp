// SPDX-License-Identifier: GPL-2.0-or-later
// The one place that calls the stages in order: scene -> system -> quadrature -> discretisation -> structure -> graph
// -> passes -> kernel source.
#pragma once

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
    Discretisation discretisation;
    Structure structure;
};

Derivation derive(const Scene& scene);
KernelSource emit(const Derivation& derivation, const EmitOptions& options = {});

}  // namespace lobatto
