// SPDX-License-Identifier: GPL-2.0-or-later
// Systems of one coordinate with a solution in closed form.
#pragma once

#include <ginac/ginac.h>

#include <optional>

#include "generator/mechanics/structure/findings.hpp"
#include "generator/mechanics/system/system.hpp"

namespace lobatto {

struct ClosedSolution {
    enum class Kind { harmonic, pendulum };  // q'' = -w2 q; q'' = -w2 sin(q) (Jacobi elliptic functions)
    Kind kind = Kind::harmonic;
    GiNaC::ex omega_squared;  // w2, in parameters
};

std::optional<ClosedSolution> find_closed_solution(const System& system);
Finding solution_finding(const std::optional<ClosedSolution>& solution);

}  // namespace lobatto
