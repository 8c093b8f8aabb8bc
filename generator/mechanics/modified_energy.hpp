// SPDX-License-Identifier: GPL-2.0-or-later
// The energy that the steps of a separable system keep better than H: its leading term, by backward error analysis.
#pragma once

#include <ginac/ginac.h>

#include <optional>
#include <vector>

#include "generator/mechanics/system/system.hpp"
#include "generator/method/quadrature.hpp"

namespace lobatto {

// The steps follow, but for terms of higher order, the exact motion of H + h^order term (D37). Autonomous separable
// systems without outer forces: L = 1/2 v^T M v - V(q).
struct ModifiedEnergy {
    int order = 0;     // of the member
    GiNaC::ex energy;  // H = 1/2 p^T M^-1 p + V, in the system's positions q and the momenta p
    GiNaC::ex term;    // H_order
    std::vector<GiNaC::symbol> p;
};

// Whether the system is of this kind, and not beyond what can be written down whatever its potential.
bool has_modified_energy(const System& system, const Method& method);
// Nothing for other systems, and where the formula grows too long.
std::optional<ModifiedEnergy> modified_energy(const System& system, const Method& method);

// The same for one coordinate and any V, in p, m and the derivatives V_1, V_2, ... of V at q; nothing when too long.
std::optional<GiNaC::ex> general_modified_energy(const Method& method);

}  // namespace lobatto
