// SPDX-License-Identifier: GPL-2.0-or-later
// The one place that calls the stages in order: scene -> system -> quadrature -> structure -> (discretisation) -> graph
// -> passes -> kernel source.
#pragma once

#include "generator/emit/kernel.hpp"
#include "generator/mechanics/derivation.hpp"

namespace lobatto {

// `general`: with every shortcut of Structure switched off.
Derivation derive(const Scene& scene, bool general = false);
// The same system by another member of the family: only what depends on it is found anew.
Derivation with_method(const Derivation& derivation, const Method& method);
KernelSource emit(const Derivation& derivation, const EmitOptions& options = {});

}  // namespace lobatto
