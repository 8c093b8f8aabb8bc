// SPDX-License-Identifier: GPL-2.0-or-later
// The mechanical system of a scene: L = 1/2 q'^T M q' - V(q), taken apart symbolically.
#include "generator/system.hpp"

#include <sstream>

#include <algorithm>

#include "generator/notation.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

// The value at a point of small rationals, which is a number where the expression is a rational function.
ex at_point(const ex& expression, int point) {
    GiNaC::exmap values;
    int index = 0;
    for (auto part = expression.preorder_begin(); part != expression.preorder_end(); ++part)
        if (GiNaC::is_a<GiNaC::symbol>(*part) && !values.contains(*part))
            values[*part] = GiNaC::numeric(7 + 3 * point + 2 * index++, 11 + point);
    try {
        return expression.subs(values, GiNaC::subs_options::no_pattern);
    } catch (const std::exception&) {  // a pole
        return expression;
    }
}

[[noreturn]] void refuse(const Scene& scene, const std::string& reason) {
    scene.source.fail(scene.lagrangian_at, "the Lagrangian " + reason);
}

constexpr const char* treated = "; this version treats L = 1/2 q'^T M q' - V(q) with a constant mass matrix M";

// A direction in the velocities that no kinetic energy opposes, in words: a' = -1, b' = 1.
std::string free_direction(const System& system) {
    const unsigned n = static_cast<unsigned>(system.n);
    GiNaC::matrix unknowns(n, 1), zero(n, 1);
    GiNaC::exmap ones;
    for (unsigned i = 0; i < n; ++i) {
        const GiNaC::symbol x;
        unknowns(i, 0) = x;
        ones[x] = 1;
    }
    const GiNaC::matrix kernel = system.mass.solve(unknowns, zero);
    std::string direction;
    for (unsigned i = 0; i < n; ++i) {
        const ex component = kernel(i, 0).subs(ones).normal();
        if (component.is_zero()) continue;
        direction += (direction.empty() ? "" : ", ") + system.v[i].get_name() + " = " + canonical_text(component);
    }
    return direction;
}

}  // namespace

bool vanishes(const ex& expression) {
    const ex value = at_point(expression, 0);
    if (GiNaC::is_a<GiNaC::numeric>(value) && !value.is_zero()) return false;
    return expression.expand().is_zero();
}

bool depends_on(const ex& expression, const std::vector<GiNaC::symbol>& symbols) {
    const auto has_any = [&symbols](const ex& e) {
        return std::any_of(symbols.begin(), symbols.end(), [&e](const GiNaC::symbol& s) { return e.has(s); });
    };
    if (!has_any(expression)) return false;
    for (const auto& symbol : symbols) {
        const ex slope = at_point(expression.diff(symbol), 0);
        if (GiNaC::is_a<GiNaC::numeric>(slope) && !slope.is_zero()) return true;
    }
    return has_any(expression.expand());
}

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
        const std::string velocity = system.v[i].get_name();
        if (!at_zero.is_zero())
            refuse(scene, "has the term (" + canonical_text(at_zero) + ")*" + velocity +
                              ", linear in a velocity (magnetic or gyroscopic)" + treated);
        for (unsigned j = 0; j <= i; ++j) {
            const ex entry = momentum.diff(system.v[j]).expand();
            const std::string second =
                "d2L/d" + velocity + "d" + system.v[j].get_name() + " = " + canonical_text(entry);
            if (depends_on(entry, system.v)) refuse(scene, "is not quadratic in the velocities: " + second + treated);
            if (depends_on(entry, system.q))
                refuse(scene, "has a mass matrix that depends on the position: " + second + treated);
            system.mass(i, j) = entry;
            system.mass(j, i) = entry;
        }
    }
    if (system.mass.determinant().normal().is_zero())
        refuse(scene,
               "is degenerate: its second derivatives in the velocities form a singular matrix, so velocities do not "
               "follow from momenta. No kinetic energy "
               "opposes the direction " +
                   free_direction(system) + "; add the missing mass, or remove a coordinate");

    system.potential = -scene.lagrangian.subs(at_rest);
    system.hessian = GiNaC::matrix(n, n);
    for (unsigned i = 0; i < n; ++i) {
        system.gradient.push_back(system.potential.diff(system.q[i]));
        for (unsigned j = 0; j <= i; ++j) {
            const ex entry = system.gradient[i].diff(system.q[j]);
            system.hessian(i, j) = vanishes(entry) ? ex(0) : entry;  // kept as derived: expanding may lose a short form
            system.hessian(j, i) = system.hessian(i, j);
        }
    }
    return system;
}

}  // namespace lobatto
