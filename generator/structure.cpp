// SPDX-License-Identifier: GPL-2.0-or-later
// What a scene's system lets the kernel leave out, each finding with its reason.
#include "generator/structure.hpp"

#include "generator/notation.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

bool has_any(const ex& expression, const std::vector<GiNaC::symbol>& symbols) {
    for (const auto& symbol : symbols)
        if (expression.has(symbol)) return true;
    return false;
}

std::optional<ClosedSolution> closed_solution(const System& system) {
    if (system.n != 1) return std::nullopt;
    const ex q = system.q[0];
    const ex acceleration = (system.gradient[0] / system.mass(0, 0)).expand();  // -q''
    for (const auto& [kind, shape] :
         {std::pair<ClosedSolution::Kind, ex>{ClosedSolution::Kind::harmonic, q},
          std::pair<ClosedSolution::Kind, ex>{ClosedSolution::Kind::pendulum, GiNaC::sin(q)}}) {
        const ex omega_squared = (acceleration / shape).expand();
        if (!omega_squared.is_zero() && !has_any(omega_squared, system.q)) return ClosedSolution{kind, omega_squared};
    }
    return std::nullopt;
}

}  // namespace

Structure find_structure(const System& system) {
    Structure structure;
    const unsigned n = static_cast<unsigned>(system.n);

    structure.diagonal_mass = true;
    std::string coupling;
    for (unsigned i = 0; i < n; ++i)
        for (unsigned j = 0; j < i; ++j)
            if (!system.mass(i, j).is_zero() && structure.diagonal_mass) {
                structure.diagonal_mass = false;
                coupling = system.v[j].get_name() + " and " + system.v[i].get_name() + " are coupled by " +
                           canonical_text(system.mass(i, j));
            }
    structure.findings.push_back(
        {"constant mass matrix", true,
         "the second derivatives of L in the velocities are free of positions: only the interior nodes are implicit"});
    structure.findings.push_back(
        {"diagonal mass matrix", structure.diagonal_mass,
         structure.diagonal_mass ? "no product of two different velocities occurs" : coupling});

    structure.linear = true;
    std::string nonlinear;
    for (unsigned i = 0; i < n && structure.linear; ++i)
        for (unsigned j = 0; j <= i && structure.linear; ++j)
            if (depends_on(system.hessian(i, j), system.q)) {
                structure.linear = false;
                nonlinear = "d2V/d" + system.q[i].get_name() + "d" + system.q[j].get_name() + " = " +
                            canonical_text(system.hessian(i, j)) + " depends on the position";
            }
    structure.findings.push_back(
        {"linear system", structure.linear,
         structure.linear ? "every second derivative of V is free of positions: the step is one matrix, no iteration"
                          : nonlinear});

    // M^-1 V'' has an entry (i, j) where row i of M^-1 meets column j of V''; for a diagonal mass, where V'' has one.
    for (unsigned i = 0; i < n; ++i)
        for (unsigned j = 0; j < n; ++j) {
            bool present = !system.hessian(i, j).is_zero();
            if (!structure.diagonal_mass)
                for (unsigned k = 0; k < n; ++k) present = present || !system.hessian(k, j).is_zero();
            if (present) structure.entries.emplace_back(static_cast<int>(i), static_cast<int>(j));
        }
    const bool full = structure.entries.size() == static_cast<std::size_t>(n) * n;
    structure.findings.push_back({"sparse second derivatives", !full,
                                  std::to_string(structure.entries.size()) + " of " + std::to_string(n * n) +
                                      " entries of M^-1 V'' are not identically zero"});

    structure.closed_solution = closed_solution(system);
    const bool closed = structure.closed_solution.has_value();
    structure.findings.push_back({"solution in closed form", closed,
                                  closed ? (structure.closed_solution->kind == ClosedSolution::Kind::harmonic
                                                ? "q'' = -w2*q"
                                                : "q'' = -w2*sin(q), by Jacobi elliptic functions") +
                                               std::string(" with w2 = ") +
                                               canonical_text(structure.closed_solution->omega_squared)
                                         : "neither a harmonic oscillator nor a plane pendulum"});
    return structure;
}

}  // namespace lobatto
