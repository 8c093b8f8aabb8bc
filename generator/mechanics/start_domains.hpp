// SPDX-License-Identifier: GPL-2.0-or-later
// Whether the formulas of a scene have values where the motion begins.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "generator/mechanics/algebra/sample.hpp"

namespace lobatto {

struct Scene;
struct System;

// What formulas ask for as they are written, though they may have lost it since: a/a, sqrt(a)^2. Throws InputError.
void require_domains(const Scene& scene, const System& system, Formulas& start);

// "x = 0, x' = 1": what of the start an expression holds.
std::string values_in(const GiNaC::ex& expression, const System& system, const Formulas& start);

// Many formulas are evaluated together: what an evaluation costs besides them grows with all that are known.
std::vector<std::pair<std::size_t, std::size_t>> portions_of(std::size_t count);

}  // namespace lobatto
