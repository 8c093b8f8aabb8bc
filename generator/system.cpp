// SPDX-License-Identifier: GPL-2.0-or-later
// The mechanical system of a scene: L = 1/2 q'^T M q' - V(q), taken apart symbolically.
#include "generator/system.hpp"

#include <sstream>

#include "generator/notation.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

bool depends_on(const ex& expression, const std::vector<GiNaC::symbol>& symbols) {
    for (const auto& symbol : symbols)
        if (expression.has(symbol)) return true;
    return false;
}

[[noreturn]] void refuse(const Scene& scene, const std::string& reason) {
    throw InputError(scene.path + ": the Lagrangian of '" + scene.title + "' cannot be treated: " + reason);
}

// The determinant by fraction-free elimination, and where it vanishes a direction of the kernel.
void require_regular(const Scene& scene, const System& system) {
    const unsigned n = static_cast<unsigned>(system.n);
    if (!system.mass.determinant().normal().is_zero()) return;
    std::string direction;
    for (const unsigned k : {n}) {
        GiNaC::matrix unknowns(k, 1), zero(k, 1);
        std::vector<GiNaC::symbol> x;
        for (unsigned i = 0; i < k; ++i) {
            x.emplace_back("x" + std::to_string(i));
            unknowns(i, 0) = x.back();
        }
        const GiNaC::matrix kernel = system.mass.solve(unknowns, zero);
        GiNaC::exmap ones;
        for (const auto& symbol : x) ones[symbol] = 1;
        for (unsigned i = 0; i < k; ++i) {
            const ex component = kernel(i, 0).subs(ones).normal();
            if (component.is_zero()) continue;
            if (!direction.empty()) direction += ", ";
            direction += system.v[i].get_name() + " = " + canonical_text(component);
        }
    }
    refuse(scene,
           "it is degenerate: the matrix of its second derivatives in the velocities is singular, so the velocities do "
           "not follow from the "
           "momenta. No kinetic energy opposes the direction (" +
               direction + "). Add the missing mass, or remove a coordinate.");
}

}  // namespace

System build_system(const Scene& scene) {
    System system;
    system.n = static_cast<int>(scene.coordinates.size());
    for (const Coordinate& coordinate : scene.coordinates) {
        system.q.push_back(coordinate.position);
        system.v.push_back(coordinate.velocity);
    }
    for (const Parameter& parameter : scene.parameters) system.parameters.push_back(parameter.symbol);
    system.lagrangian = scene.lagrangian;

    const unsigned n = static_cast<unsigned>(system.n);
    GiNaC::exmap at_rest;
    for (const auto& velocity : system.v) at_rest[velocity] = 0;
    system.mass = GiNaC::matrix(n, n);
    for (unsigned i = 0; i < n; ++i) {
        const ex momentum = scene.lagrangian.diff(system.v[i]);
        const ex at_zero = momentum.subs(at_rest).expand();
        if (!at_zero.is_zero())
            refuse(scene, "it has the term (" + canonical_text(at_zero) + ")*" + system.v[i].get_name() +
                              ", linear in a velocity (a magnetic or gyroscopic term); this version treats L = 1/2 "
                              "q'^T M q' - V(q) with a constant mass matrix M.");
        for (unsigned j = 0; j <= i; ++j) {
            const ex entry = momentum.diff(system.v[j]).expand();
            if (depends_on(entry, system.v))
                refuse(scene, "it is not quadratic in the velocities (d2L/d" + system.v[i].get_name() + " d" +
                                  system.v[j].get_name() + " = " + canonical_text(entry) +
                                  "); this version treats L = 1/2 q'^T M q' - V(q) with a constant mass matrix M.");
            if (depends_on(entry, system.q))
                refuse(scene, "its mass matrix depends on the position (d2L/d" + system.v[i].get_name() + " d" +
                                  system.v[j].get_name() + " = " + canonical_text(entry) +
                                  "); this version treats L = 1/2 q'^T M q' - V(q) with a constant mass matrix M.");
            system.mass(i, j) = entry;
            system.mass(j, i) = entry;
        }
    }
    require_regular(scene, system);

    system.potential = -scene.lagrangian.subs(at_rest);
    system.hessian = GiNaC::matrix(n, n);
    for (unsigned i = 0; i < n; ++i) {
        system.gradient.push_back(system.potential.diff(system.q[i]));
        for (unsigned j = 0; j <= i; ++j) {
            const ex entry = system.gradient[i].diff(system.q[j]);
            system.hessian(i, j) =
                entry.expand().is_zero() ? ex(0) : entry;  // kept as derived: expanding may lose a short form
            system.hessian(j, i) = system.hessian(i, j);
        }
    }
    return system;
}

}  // namespace lobatto
