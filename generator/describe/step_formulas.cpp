// SPDX-License-Identifier: GPL-2.0-or-later
// The equations of a step of a system with constant mass.
#include <map>

#include "generator/describe/writer.hpp"
#include "generator/formula/expansion.hpp"
#include "generator/method/propagation.hpp"

namespace lobatto {

void Describer::discrete_equations() {
    const Discretisation& disc = d_.discretisation();
    const bool linear = d_.structure.linear;
    section("The discrete Lagrangian and its equations");
    scalar("discrete_lagrangian", "D4", linear ? "eq:discreteLagrangian" : "eq:discreteLagrangianNL",
           "discrete Lagrangian: the quadrature of L along the interpolated path", "L_d", disc.L_d);
    std::vector<GiNaC::ex> interior;
    for (const auto& row : disc.interior) interior.insert(interior.end(), row.begin(), row.end());
    if (!interior.empty())
        vector("interior_equations", "D5", "eq:ELinternalNL",
               "interior discrete Euler-Lagrange equations: the derivatives of L_d at the interior " +
                   std::string(lobatto_ ? "nodes" : "control points"),
               Names(interior.size(), "0"), interior);
    vector("left_momentum", "D6", "", "momentum at the left end", names_of(disc.p0), disc.left_momentum);
    vector("right_momentum", "D7", "eq:rightMomentum", "momentum at the right end", names_of(disc.p1),
           disc.right_momentum);
    vector("border_equations", "D8", linear ? "eq:centerEL" : "eq:ELequationsNL",
           "border equations: the momentum at the right end of the step before is that at the left end of this one",
           Names(n_, "0"), disc.border);
}

void Describer::full_system() {
    const Discretisation& disc = d_.discretisation();
    section("The full system");
    std::string unknowns;
    for (const auto& symbol : disc.full_unknowns) unknowns += (unknowns.empty() ? "" : ", ") + name_of(symbol);
    vector("full_system", "D9", "eq:internesNL, eq:discreteDynamics", "F_L = 0 for the unknowns " + unknowns,
           numbered("F_L", disc.full_system.size()), disc.full_system);
    matrix("full_jacobian", "D10", "section 5, dF_L", "its Jacobian; columns: " + unknowns, "dF_L", disc.full_jacobian);
}

void Describer::reduced_system() {
    const Discretisation& disc = d_.discretisation();
    section(lobatto_ ? "The reduced form: interior unknowns only" : "The reduced form: positions at the nodes");
    const Names v = by_coordinate("v");
    std::vector<GiNaC::symbol> drift;
    GiNaC::exmap values;
    for (std::size_t k = 0; k < n_; ++k) {
        drift.emplace_back(v[k]);
        rename(drift.back(), v[k]);
        values[disc.drift_velocity[k]] = drift.back();
    }
    // The drift velocity under its own name, wherever the derivation has put its value.
    const auto with_drift = [&](std::vector<GiNaC::ex> equations) {
        for (GiNaC::ex& equation : equations) equation = equation.subs(values, GiNaC::subs_options::no_pattern);
        return equations;
    };
    vector("drift_velocity", "D11", "", "drift velocity, known before the unknowns are", names_of(drift),
           disc.drift_velocity);
    if (!disc.reduced_system.empty()) {
        vector("reduced_system", "D12", "",
               lobatto_ ? "F = 0 for the interior positions" : "F = 0 for the positions at the nodes",
               numbered("F", disc.reduced_system.size()), with_drift(disc.reduced_system));
        matrix("reduced_jacobian", "D13", "", "its Jacobian", "J", disc.reduced_jacobian);
    }
    Names arrival;
    for (const auto& symbol : disc.Q.back()) arrival.push_back(name_of(symbol));
    vector("arrival_position", "D16", "", "arrival, explicit", arrival, with_drift(disc.arrival_position));
    vector("arrival_momentum", "D17", "", "and its momentum, explicit", names_of(disc.p1), disc.arrival_momentum);
}

// (D20) and the energy that it conserves, (D21).
void Describer::propagation_of_one() {
    const Propagation phi = propagation(d_.quadrature);
    const Discretisation& disc = d_.discretisation();
    const GiNaC::ex h = disc.h, m = d_.system.mass(0, 0), stiffness = expanded(d_.system.hessian(0, 0));
    const GiNaC::ex force = -d_.system.gradient[0].subs(d_.system.q[0] == 0);
    rename(phi.z, "z");
    std::map<std::string, GiNaC::symbol> symbols;
    for (const char* letter : {"delta", "a", "b", "c", "e_q", "e_p"}) {
        symbols.emplace(letter, GiNaC::symbol(letter));
        rename(symbols.at(letter), letter);
    }
    const auto symbol = [&](const char* letter) { return GiNaC::ex(symbols.at(letter)); };
    const auto left = [&](const char* letter) { return name_of(symbols.at(letter)); };
    section("The step in closed form");
    scalar("squared_angle", "D20", "", "the only number the step depends on, up to scaling", name_of(phi.z),
           h * h * stiffness / m);
    vector("propagation_polynomials", "D20", "eq:symplecticCoeffs",
           "numerators and denominator, with a^2 - b*c = delta^2", {left("delta"), left("a"), left("b"), left("c")},
           {phi.delta, phi.a, phi.b, phi.c});
    GiNaC::ex position = symbol("a") * disc.Q[0][0] + h / m * symbol("c") * disc.p0[0];
    GiNaC::ex momentum = m / h * symbol("b") * disc.Q[0][0] + symbol("a") * disc.p0[0];
    if (!force.is_zero()) {
        vector("force_polynomials", "D20", "", "numerators of what the constant force adds", {left("e_q"), left("e_p")},
               {phi.e_q, phi.e_p});
        position += h * h * force / m * symbol("e_q");
        momentum += h * force * symbol("e_p");
    }
    vector("propagation", "D20", "eq:symplecticSystem", "one step", {name_of(disc.Q.back()[0]), name_of(disc.p1[0])},
           {position / symbol("delta"), momentum / symbol("delta")});
    scalar("discrete_energy", "D21", "eq:discreteEnergy", "the energy that the steps conserve exactly", "H_d",
           (h / m * symbol("c") * GiNaC::pow(disc.p0[0], 2) - m / h * symbol("b") * GiNaC::pow(disc.Q[0][0], 2) -
            (force.is_zero() ? GiNaC::ex(0) : 2 * h * force * symbol("e_p") * disc.Q[0][0])) /
               (2 * symbol("delta")));
}

}  // namespace lobatto
