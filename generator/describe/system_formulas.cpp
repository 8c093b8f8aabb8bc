// SPDX-License-Identifier: GPL-2.0-or-later
// What is said of the system and its quadrature.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "generator/describe/writer.hpp"
#include "generator/graph/notation.hpp"

namespace lobatto {

void Describer::facts() {
    auto& facts = result_.facts;
    facts.emplace_back("Lagrangian", "L = " + d_.scene.lagrangian_text);
    const auto with_unit = [](const std::string& text, const std::string& unit) {
        return unit.empty() ? text : text + " [" + unit + "]";
    };
    std::string list;
    const auto append = [&list](const std::string& item) { list += (list.empty() ? "" : ", ") + item; };
    for (const Coordinate& coordinate : d_.scene.coordinates) append(with_unit(coordinate.name, coordinate.unit));
    facts.emplace_back("Coordinates", list);
    std::vector<Parameter> parameters, inputs;
    for (const Parameter& parameter : d_.scene.parameters)
        (parameter.is_input ? inputs : parameters).push_back(parameter);
    const auto& constants = d_.scene.constants;
    for (const auto& [title, of] :
         {std::pair{"Parameters", parameters}, std::pair{"Inputs", inputs}, std::pair{"Constants", constants}}) {
        list.clear();
        for (const Parameter& parameter : of)
            append(with_unit(parameter.name + " = " + canonical_text(parameter.value), parameter.unit));
        if (!list.empty()) facts.emplace_back(title, list);
    }
    list.clear();
    for (const Coordinate& coordinate : d_.scene.coordinates)
        if (!coordinate.force.is_zero()) append(coordinate.name + ": " + canonical_text(coordinate.force));
    if (!list.empty()) facts.emplace_back("Forces", list);
    if (d_.scene.has_time) facts.emplace_back("Time", d_.scene.time.get_name());
    facts.emplace_back("Method", fmt::format("{}: order {}", d_.scene.method.name(), d_.quadrature.order()));
    if (d_.quadrature.is_explicit()) {
        facts.emplace_back("Step",
                           "u = M^-1 p and q move in turn: kick u -> u - h b_i W(q) at node i, drift q -> q + "
                           "h a_i u to the next (D40); nothing is solved for");
        return;
    }
    if (!written_out_) {
        facts.emplace_back("Equations",
                           fmt::format("not written out: {} coordinates at {} points of a step are {} positions, "
                                       "more than {}; the kernel assembles them from the formulas of one node",
                                       n_, controls_, n_ * controls_, written_out_limit));
        return;
    }
    list.clear();
    for (std::size_t i = 0; i < controls_; ++i)
        for (std::size_t k = 0; k < n_; ++k) append(name_of(d_.discretisation().Q[i][k]));
    const std::string in_paper = is_paper_scheme_ ? "; the paper's q_l, q_xi, q_{1-xi}, q_r" : "";
    facts.emplace_back("Positions", list + " at the " + (lobatto_ ? "nodes" : "control points") +
                                        " of one step, from its left end to its right" + in_paper);
    list.clear();
    for (const auto& momenta : {d_.discretisation().p0, d_.discretisation().p1})
        for (const auto& symbol : momenta) append(name_of(symbol));
    facts.emplace_back("Momenta", list + " at the two ends");
}

void Describer::quadrature() {
    const Quadrature& q = d_.quadrature;
    const std::size_t r = q.nodes.size();
    if (q.is_explicit()) {
        straight_path();
        return;
    }
    section("Quadrature and interpolation on [0, 1]");
    vector("nodes", "D22", "eq:lobattoQuad", "nodes", numbered("c", r), q.nodes);
    vector("weights", "D22", "eq:lobattoQuad", "weights", numbered("b", r), q.weights);
    if (!lobatto_)
        vector("control_points", "D28", "", "control points: their positions determine the path in a step",
               numbered("d", controls_), q.control);
    vector("basis", "D22", "eq:basisFunctions",
           std::string("basis: the polynomials that are 1 at their ") + (lobatto_ ? "node" : "control point") +
               ", 0 at the others",
           numbered("l", controls_), q.basis);
    if (!lobatto_) matrix("interpolation", "D28", "", "interpolation matrix: basis polynomial j at node i", "B", q.B);
    matrix("differentiation", "D22", "", "differentiation matrix: derivative of basis polynomial j at node i", "D",
           q.D);
    if (general_) return;
    matrix("rigidity", "D4", "eq:rigidityKE", "rigidity: the integrals of products of derivatives", "K", q.K);
    if (s_ > 2)
        matrix("stage_map", lobatto_ ? "D19" : "D32", "",
               lobatto_ ? "stage map over the interior nodes" : "stage map over the nodes", "A", q.A);
}

// As decimals, which the coefficients are.
void Describer::straight_path() {
    const Quadrature& q = d_.quadrature;
    const auto decimal_of = [](const GiNaC::ex& value) {
        const auto exact = cln::the<cln::cl_R>(GiNaC::ex_to<GiNaC::numeric>(value).to_cl_N());
        return GiNaC::numeric(cln::cl_float(exact, cln::float_format(60)));
    };
    std::vector<GiNaC::ex> nodes, kicks, drifts;
    for (std::size_t i = 0; i < s_; ++i) {
        nodes.emplace_back(decimal_of(q.c[i]));
        kicks.emplace_back(decimal_of(q.b[i]));
        if (i + 1 < s_) drifts.emplace_back(decimal_of(q.c[i + 1] - q.c[i]));
    }
    section("The path, straight from node to node");
    vector("nodes", "D40", "", "nodes", numbered("c", s_), nodes);
    vector("weights", "D40", "", "weights: lengths of the kicks", numbered("b", s_), kicks);
    vector("drifts", "D40", "", "and of the drifts, c_i+1 - c_i", numbered("a", s_ - 1), drifts);
}

namespace {

// Written out or with its brackets, whichever is shorter.
GiNaC::ex shorter(const GiNaC::ex& expression) {
    const GiNaC::ex expanded = expression.expand();
    return canonical_text(expanded).size() < canonical_text(expression).size() ? expanded : expression;
}

// (D26) The energy of a term of L: d - 1 times itself, if it is of degree d in the velocities.
std::optional<GiNaC::ex> energy_by_degree(const GiNaC::ex& term, const GiNaC::ex& radial) {
    for (int degree = 0; degree <= 4; ++degree)
        if ((radial - degree * term).expand().is_zero()) return (degree - 1) * term;
    return std::nullopt;
}

// (D26) v . dL/dv - L, term by term, so that no kinetic energy is subtracted from its double where that can be seen.
GiNaC::ex energy_of(const System& system) {
    GiNaC::ex energy = 0;
    for (const GiNaC::ex& term : system.terms)
        for (const GiNaC::ex& part : terms_of(term.expand(), system.v)) {
            const std::vector<GiNaC::ex> slopes = gradient_of({part}, system.v);
            GiNaC::ex radial = 0;
            for (std::size_t k = 0; k < slopes.size(); ++k) radial += system.v[k] * slopes[k];
            energy += energy_by_degree(part, radial).value_or(radial - part);
        }
    return shorter(energy);
}

}  // namespace

// (D25, D44) d/dt dL/dv - dL/dq - F, and what constraints add. With a clock L is that of the clock's time.
void Describer::equations_of_motion() {
    if (d_.scene.clock) return;
    const System& system = d_.system;
    std::vector<GiNaC::ex> inertia(n_), rest;
    for (const GiNaC::ex& force : system.force) rest.push_back(-force);
    for (const auto& [place, value] : system.momentum_v.entries()) {
        const auto k = static_cast<std::size_t>(place.first), j = static_cast<std::size_t>(place.second);
        inertia[k] += value * acceleration_symbol(j);
    }
    for (const auto& [place, value] : system.momentum_q.entries())
        rest[static_cast<std::size_t>(place.first)] += value * system.v[static_cast<std::size_t>(place.second)];
    const SparseMatrix by_time = derivative_of(system.momentum, {system.t});
    for (const auto& [place, value] : by_time.entries()) rest[static_cast<std::size_t>(place.first)] += value;
    for (const auto& [place, value] : system.constraint_q.entries())
        rest[static_cast<std::size_t>(place.second)] -=
            value * multiplier_symbol(static_cast<std::size_t>(place.first));
    for (std::size_t k = 0; k < n_; ++k) inertia[k] += shorter(rest[k]);
    const std::string of_constraints = system.constraints.empty() ? "" : ", with the multipliers of the constraints";
    vector("equations_of_motion", system.constraints.empty() ? "D25" : "D44", "",
           "equations of motion (Euler-Lagrange)" + of_constraints, Names(n_, "0"), inertia);
}

void Describer::separable_system() {
    const System& system = d_.system;
    section("The system");
    equations_of_motion();
    matrix("mass", "D2", "mass matrix", "M", system.mass);
    scalar("potential", "D3", "", "potential energy", "V", system.potential);
    SparseMatrix inverse(system.n, system.n), S(system.n, system.n);
    if (d_.structure.constant_mass().diagonal_mass) {
        for (const auto& [place, value] : system.mass.entries()) inverse.put(place.first, place.second, 1 / value);
    } else {
        const GiNaC::matrix full = system.mass.dense().inverse();
        for (unsigned k = 0; k < n_; ++k)
            for (unsigned l = 0; l < n_; ++l)
                inverse.put(static_cast<int>(k), static_cast<int>(l), full(k, l).normal());
    }
    std::vector<GiNaC::ex> W(n_), momenta(n_);
    GiNaC::ex energy = system.potential;
    for (const auto& [place, value] : inverse.entries()) {
        const auto k = static_cast<std::size_t>(place.first), l = static_cast<std::size_t>(place.second);
        W[k] += value * system.gradient[l];
        energy += value * momentum_symbol(k) * momentum_symbol(l) / 2;
    }
    for (const auto& [place, value] : system.mass.entries())
        momenta[static_cast<std::size_t>(place.first)] += value * system.v[static_cast<std::size_t>(place.second)];
    for (const auto& [k, j] : d_.structure.constant_mass().entries) {
        GiNaC::ex sum = 0;
        if (d_.structure.constant_mass().diagonal_mass)
            sum = inverse(static_cast<std::size_t>(k), static_cast<std::size_t>(k)) *
                  system.hessian(static_cast<std::size_t>(k), static_cast<std::size_t>(j));
        else
            for (std::size_t l = 0; l < n_; ++l)
                sum += inverse(static_cast<std::size_t>(k), l) * system.hessian(l, static_cast<std::size_t>(j));
        if (!sum.is_zero()) S.put(k, j, sum);
    }
    const bool forced = system.has_forces();
    vector("acceleration", "D1", "",
           forced ? "negative acceleration, M^-1 (grad V - F)" : "negative acceleration, M^-1 grad V",
           by_coordinate("W"), W);
    matrix("stiffness", "D1", forced ? "its derivative" : "its derivative, M^-1 V''", "S", S);
    vector("momentum", "D2", "", "momentum", by_coordinate("p"), momenta);
    scalar("energy", "D3", "", "energy", "H", energy);
}

void Describer::general_system() {
    const System& system = d_.system;
    section("The system");
    equations_of_motion();
    vector("momentum", "D25", "", "momentum, dL/dq'", by_coordinate("p"), system.momentum);
    const bool forced = system.has_forces();
    vector("force", "D25", "", forced ? "force, dL/dq + F" : "force, dL/dq", by_coordinate("f"), system.force);
    second_derivatives("momentum_by_velocity", "derivatives of the momenta by the velocities v", "dp/dv",
                       system.momentum_v);
    second_derivatives("momentum_by_position", "and by the positions", "dp/dq", system.momentum_q);
    second_derivatives("force_by_velocity", "derivatives of the forces by the velocities v", "df/dv", system.force_v);
    second_derivatives("force_by_position", "and by the positions", "df/dq", system.force_q);
    scalar("energy", "D26", "", "energy, p.q' - L", "H", energy_of(system));
}

// (D44)
void Describer::constraints() {
    const System& system = d_.system;
    section("The constraints");
    Names phi, phi_t;
    std::vector<GiNaC::ex> values;
    for (const Constraint& constraint : system.constraints) {
        phi.push_back("phi_" + constraint.name);
        phi_t.push_back("dphi_" + constraint.name + "/dt");
        values.push_back(constraint.value);
    }
    vector("constraints", "D44", "", "constraints, phi = 0", phi, values);
    matrix("constraint_slopes", "D44", "their slopes, dphi/dq", "G", system.constraint_q);
    if (!system.autonomous) vector("constraint_rates", "D44", "", "and by the time", phi_t, system.constraint_t);
}

void Describer::second_derivatives(const std::string& id, const std::string& what, const std::string& left,
                                   const SparseMatrix& value) {
    if (!value.entries().empty()) matrix(id, "D25", what, left, value);
}

// (D29): the gradient of R, and with it the velocities of the cyclic coordinates.
void Describer::routhian() {
    const Routhian& routhian = d_.structure.routhian();
    section("Without the cyclic coordinates");
    for (const GiNaC::symbol& momentum : routhian.P) rename(momentum, momentum.get_name());
    const auto named = [&](const std::string& letter, const std::vector<int>& which) {
        Names names;
        for (const int k : which) names.push_back(letter + "_" + name(static_cast<std::size_t>(k)));
        return names;
    };
    const auto part = [&](std::size_t first, std::size_t count, int sign) {
        std::vector<GiNaC::ex> values;
        for (std::size_t e = first; e < first + count; ++e) values.push_back(sign * routhian.gradient[e]);
        return values;
    };
    const std::size_t active = routhian.active.size(), cyclic = routhian.cyclic.size();
    Names velocities;
    for (const int k : routhian.cyclic) velocities.push_back(name(static_cast<std::size_t>(k)) + "'");
    vector("cyclic_velocity", "D29", "", "velocities of the cyclic coordinates, whose momenta are constant", velocities,
           part(2 * active, cyclic, -1));
    vector("routhian_momentum", "D29", "", "derivative of the Routhian in the other velocities",
           named("R_v", routhian.active), part(0, active, 1));
    vector("routhian_force", "D29", "", "and in the other positions, with outer forces", named("R_q", routhian.active),
           part(active, active, 1));
}

}  // namespace lobatto
