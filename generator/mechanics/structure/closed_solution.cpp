// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/structure/closed_solution.hpp"

#include <utility>

#include "generator/formula/expansion.hpp"
#include "generator/graph/notation.hpp"

namespace lobatto {

using GiNaC::ex;

std::optional<ClosedSolution> find_closed_solution(const System& system) {
    if (system.n != 1 || !system.separable || !system.autonomous) return std::nullopt;
    const ex q = system.q[0];
    const ex acceleration = expanded(system.gradient[0] / system.mass(0, 0));  // -q''
    for (const auto& [kind, shape] :
         {std::pair<ClosedSolution::Kind, ex>{ClosedSolution::Kind::harmonic, q},
          std::pair<ClosedSolution::Kind, ex>{ClosedSolution::Kind::pendulum, GiNaC::sin(q)}}) {
        const ex omega_squared = expanded(acceleration / shape);
        if (!omega_squared.is_zero() && !has_any(omega_squared, system.q)) return ClosedSolution{kind, omega_squared};
    }
    return std::nullopt;
}

Finding solution_finding(const std::optional<ClosedSolution>& solution) {
    if (!solution)
        return {"solution in closed form", false,
                "known only for a harmonic oscillator or a plane pendulum, without walls, switches and explicit time"};
    const bool is_harmonic = solution->kind == ClosedSolution::Kind::harmonic;
    return {"solution in closed form", true,
            std::string(is_harmonic ? "q'' = -w2*q" : "q'' = -w2*sin(q), by Jacobi elliptic functions") +
                " with w2 = " + canonical_text(solution->omega_squared)};
}

}  // namespace lobatto
