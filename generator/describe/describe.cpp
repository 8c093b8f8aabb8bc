// SPDX-License-Identifier: GPL-2.0-or-later
// A derivation as a list of numbered formulas: which ones, in which order, under which names.
#include "generator/describe/describe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "generator/formula/expansion.hpp"
#include "generator/graph/notation.hpp"
#include "generator/mechanics/derivation.hpp"
#include "generator/method/propagation.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using Names = std::vector<std::string>;

constexpr std::size_t largest_full_matrix = 12;  // rows; beyond, its entries that are not zero are listed

unsigned at(std::size_t index) {
    return static_cast<unsigned>(index);
}

// The description as it is written: its symbols under names that people know, its formulas in sections.
class DescriptionWriter {
public:
    explicit DescriptionWriter(const Derivation& derivation)
        : d_(derivation),
          n_(static_cast<std::size_t>(derivation.system.n)),
          s_(static_cast<std::size_t>(derivation.quadrature.points)),
          controls_(derivation.quadrature.control.size()),
          lobatto_(derivation.quadrature.method.family == Family::lobatto),
          general_(derivation.structure.form() == Form::general),
          written_out_(!derivation.quadrature.is_explicit() &&
                       is_written_out(derivation.system, derivation.quadrature)),
          is_paper_scheme_(lobatto_ && s_ == 4 && n_ == 1 && !general_) {
        for (const Coordinate& coordinate : d_.scene.coordinates) {
            taken_.insert(coordinate.name);
            taken_.insert(coordinate.name + "'");
        }
        for (const Parameter& parameter : d_.scene.parameters) taken_.insert(parameter.name);
        if (d_.scene.has_time) taken_.insert(d_.scene.time.get_name());
        taken_.insert("h");
        if (!written_out_) return;
        const Discretisation& disc = d_.discretisation();
        if (d_.scene.has_time) rename(disc.t0, d_.scene.time.get_name() + "_left");
        for (std::size_t i = 0; i < controls_; ++i)
            for (std::size_t k = 0; k < n_; ++k) rename(disc.Q[i][k], fmt::format("{}_{}", name(k), i + 1));
        for (std::size_t k = 0; k < n_; ++k) {
            rename(disc.p0[k], n_ == 1 ? "p_left" : fmt::format("p_{}_left", name(k)));
            rename(disc.p1[k], n_ == 1 ? "p_right" : fmt::format("p_{}_right", name(k)));
        }
        for (std::size_t i = 0; i + 1 < controls_; ++i)
            for (std::size_t k = 0; k < n_; ++k)
                rename(disc.Q_before[i][k], fmt::format("{}_before_{}", name(k), i + 1));
        if (!lobatto_)
            for (std::size_t i = 1; i + 1 < disc.Y.size(); ++i)
                for (std::size_t k = 0; k < n_; ++k) rename(disc.Y[i][k], fmt::format("{}_stage_{}", name(k), i));
    }

protected:
    std::string name(std::size_t k) const { return d_.scene.coordinates[k].name; }

    // A symbol of the derivation under a name that no other symbol has.
    void rename(const GiNaC::symbol& symbol, std::string wish) {
        while (!taken_.insert(wish).second) wish += "_";
        display_[symbol] = GiNaC::symbol(wish);
        names_[symbol] = wish;
    }
    std::string name_of(const GiNaC::symbol& symbol) const { return names_.at(symbol); }
    Names names_of(const std::vector<GiNaC::symbol>& symbols) const {
        Names names;
        for (const auto& symbol : symbols) names.push_back(name_of(symbol));
        return names;
    }
    ex shown(const ex& expression) const { return expression.subs(display_, GiNaC::subs_options::no_pattern); }

    // W, or W_x and W_y.
    Names by_coordinate(const std::string& letter) const {
        Names names;
        for (std::size_t k = 0; k < n_; ++k) names.push_back(n_ == 1 ? letter : letter + "_" + name(k));
        return names;
    }
    static Names numbered(const std::string& letter, std::size_t count) {
        Names names;
        for (std::size_t i = 1; i <= count; ++i) names.push_back(fmt::format("{}_{}", letter, i));
        return names;
    }

    void section(const std::string& title) { result_.sections.push_back({title, {}}); }
    void scalar(const std::string& id, const std::string& number, const std::string& paper, const std::string& meaning,
                const std::string& left, const ex& value) {
        add({id, number, paper, meaning, {left}, {}, {value}});
    }
    void vector(const std::string& id, const std::string& number, const std::string& paper, const std::string& meaning,
                const Names& left, const std::vector<ex>& values) {
        add({id, number, paper, meaning, left, {values.size()}, values});
    }
    void matrix(const std::string& id, const std::string& number, const std::string& paper, const std::string& meaning,
                const std::string& left, const GiNaC::matrix& value) {
        std::vector<ex> values;
        for (unsigned i = 0; i < value.rows(); ++i)
            for (unsigned j = 0; j < value.cols(); ++j) values.push_back(value(i, j));
        add({id, number, paper, meaning, {left}, {value.rows(), value.cols()}, values});
    }
    // A matrix of many rows as a list of the entries that are not zero.
    void matrix(const std::string& id, const std::string& number, const std::string& meaning, const std::string& left,
                const SparseMatrix& value) {
        if (static_cast<std::size_t>(value.rows()) <= largest_full_matrix) {
            matrix(id, number, "", meaning, left, value.dense());
            return;
        }
        Names names;
        std::vector<ex> values;
        for (const auto& [place, entry] : value.entries()) {
            names.push_back(fmt::format("{}_{}_{}", left, place.first + 1, place.second + 1));
            values.push_back(entry);
        }
        vector(id, number, "", meaning + "; all other entries are 0", names, values);
    }
    // Labels of the paper belong to four points and one coordinate.
    void add(Formula formula) {
        if (!is_paper_scheme_) formula.paper.clear();
        for (ex& value : formula.values) value = shown(value);
        result_.sections.back().formulas.push_back(std::move(formula));
    }

    GiNaC::symbol momentum_symbol(std::size_t k) {
        while (p_.size() <= k) {
            p_.emplace_back("p");
            std::string wish = by_coordinate("p")[p_.size() - 1];
            rename(p_.back(), wish);
        }
        return p_[k];
    }

    const Derivation& d_;
    std::size_t n_, s_, controls_;
    bool lobatto_, general_, written_out_, is_paper_scheme_;
    std::set<std::string> taken_;
    GiNaC::exmap display_;
    std::map<ex, std::string, GiNaC::ex_is_less> names_;
    std::vector<GiNaC::symbol> p_;
    Description result_;
};

// The system and its quadrature.
class SystemDescriber : protected DescriptionWriter {
protected:
    using DescriptionWriter::DescriptionWriter;

    void facts() {
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

    void quadrature() {
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
                   numbered("x", controls_), q.control);
        vector("basis", "D22", "eq:basisFunctions",
               std::string("basis: the polynomials that are 1 at their ") + (lobatto_ ? "node" : "control point") +
                   ", 0 at the others",
               numbered("l", controls_), q.basis);
        if (!lobatto_)
            matrix("interpolation", "D28", "", "interpolation matrix: basis polynomial j at node i", "B", q.B);
        matrix("differentiation", "D22", "", "differentiation matrix: derivative of basis polynomial j at node i", "D",
               q.D);
        if (general_) return;
        matrix("rigidity", "D4", "eq:rigidityKE", "rigidity: the integrals of products of derivatives", "K", q.K);
        if (s_ > 2)
            matrix("stage_map", lobatto_ ? "D19" : "D32", "",
                   lobatto_ ? "stage map over the interior nodes" : "stage map over the nodes", "A", q.A);
    }

    // As decimals, which the coefficients are.
    void straight_path() {
        const Quadrature& q = d_.quadrature;
        const auto decimal_of = [](const ex& value) {
            const auto exact = cln::the<cln::cl_R>(GiNaC::ex_to<GiNaC::numeric>(value).to_cl_N());
            return GiNaC::numeric(cln::cl_float(exact, cln::float_format(60)));
        };
        std::vector<ex> nodes, kicks, drifts;
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

    void separable_system() {
        const System& system = d_.system;
        section("The system");
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
        std::vector<ex> W(n_), momenta(n_);
        ex energy = system.potential;
        for (const auto& [place, value] : inverse.entries()) {
            const auto k = static_cast<std::size_t>(place.first), l = static_cast<std::size_t>(place.second);
            W[k] += value * system.gradient[l];
            energy += value * momentum_symbol(k) * momentum_symbol(l) / 2;
        }
        for (const auto& [place, value] : system.mass.entries())
            momenta[static_cast<std::size_t>(place.first)] += value * system.v[static_cast<std::size_t>(place.second)];
        for (const auto& [k, j] : d_.structure.constant_mass().entries) {
            ex sum = 0;
            if (d_.structure.constant_mass().diagonal_mass)
                sum = inverse(static_cast<std::size_t>(k), static_cast<std::size_t>(k)) *
                      system.hessian(static_cast<std::size_t>(k), static_cast<std::size_t>(j));
            else
                for (std::size_t l = 0; l < n_; ++l)
                    sum += inverse(static_cast<std::size_t>(k), l) * system.hessian(l, static_cast<std::size_t>(j));
            if (!sum.is_zero()) S.put(k, j, sum);
        }
        const bool forced = std::any_of(system.outer_force.begin(), system.outer_force.end(),
                                        [](const ex& force) { return !force.is_zero(); });
        vector("acceleration", "D1", "",
               forced ? "negative acceleration, M^-1 (grad V - F)" : "negative acceleration, M^-1 grad V",
               by_coordinate("W"), W);
        matrix("stiffness", "D1", forced ? "its derivative" : "its derivative, M^-1 V''", "S", S);
        vector("momentum", "D2", "", "momentum", by_coordinate("p"), momenta);
        scalar("energy", "D3", "", "energy", "H", energy);
    }
    void general_system() {
        const System& system = d_.system;
        section("The system");
        vector("momentum", "D25", "", "momentum, dL/dq'", by_coordinate("p"), system.momentum);
        const bool forced = std::any_of(system.outer_force.begin(), system.outer_force.end(),
                                        [](const ex& force) { return !force.is_zero(); });
        vector("force", "D25", "", forced ? "force, dL/dq + F" : "force, dL/dq", by_coordinate("f"), system.force);
        second_derivatives("momentum_by_velocity", "dp/dq'", "p_v", system.momentum_v);
        second_derivatives("momentum_by_position", "dp/dq", "p_q", system.momentum_q);
        second_derivatives("force_by_velocity", "df/dq'", "f_v", system.force_v);
        second_derivatives("force_by_position", "df/dq", "f_q", system.force_q);
        ex energy = -system.lagrangian;
        for (std::size_t k = 0; k < n_; ++k) energy += system.momentum[k] * system.v[k];
        scalar("energy", "D26", "", "energy, p.q' - L", "H", energy);
    }
    // (D44)
    void constraints() {
        const System& system = d_.system;
        section("The constraints");
        Names phi, phi_t;
        std::vector<ex> values;
        for (const Constraint& constraint : system.constraints) {
            phi.push_back("phi_" + constraint.name);
            phi_t.push_back("dphi_" + constraint.name + "/dt");
            values.push_back(constraint.value);
        }
        vector("constraints", "D44", "", "constraints, phi = 0", phi, values);
        matrix("constraint_slopes", "D44", "their slopes, dphi/dq", "G", system.constraint_q);
        if (!system.autonomous) vector("constraint_rates", "D44", "", "and by the time", phi_t, system.constraint_t);
    }
    void second_derivatives(const std::string& id, const std::string& what, const std::string& left,
                            const SparseMatrix& value) {
        if (!value.entries().empty()) matrix(id, "D25", what, left, value);
    }

    // (D29): the gradient of R, and with it the velocities of the cyclic coordinates.
    void routhian() {
        const Routhian& routhian = d_.structure.routhian();
        section("Without the cyclic coordinates");
        for (const GiNaC::symbol& momentum : routhian.P) rename(momentum, momentum.get_name());
        const auto named = [&](const std::string& letter, const std::vector<int>& which) {
            Names names;
            for (const int k : which) names.push_back(letter + "_" + name(static_cast<std::size_t>(k)));
            return names;
        };
        const auto part = [&](std::size_t first, std::size_t count, int sign) {
            std::vector<ex> values;
            for (std::size_t e = first; e < first + count; ++e) values.push_back(sign * routhian.gradient[e]);
            return values;
        };
        const std::size_t active = routhian.active.size(), cyclic = routhian.cyclic.size();
        Names velocities;
        for (const int k : routhian.cyclic) velocities.push_back(name(static_cast<std::size_t>(k)) + "'");
        vector("cyclic_velocity", "D29", "", "velocities of the cyclic coordinates, whose momenta are constant",
               velocities, part(2 * active, cyclic, -1));
        vector("routhian_momentum", "D29", "", "derivative of the Routhian in the other velocities",
               named("R_v", routhian.active), part(0, active, 1));
        vector("routhian_force", "D29", "", "and in the other positions, with outer forces",
               named("R_q", routhian.active), part(active, active, 1));
    }

    // (D30) in blocks: one entry for all coordinates together.
    void general_step() {
        const Quadrature& q = d_.quadrature;
        const std::size_t r = q.nodes.size(), unknowns = controls_ - 1;
        const bool multiplier = lobatto_ && !d_.structure.routhian().cyclic.empty();
        section("The step: all positions but the first, in blocks of all coordinates");
        std::map<std::string, std::vector<GiNaC::symbol>> node;  // g_v at node 1, 2 ...
        for (const char* block :
             {"g_v", "g_q", "g_P", "H_vv", "H_vq", "H_vP", "H_qv", "H_qq", "H_qP", "H_Pv", "H_Pq", "H_PP"})
            for (std::size_t i = 1; i <= r; ++i) {
                node[block].emplace_back(fmt::format("{}_{}", block, i));
                rename(node[block].back(), node[block].back().get_name());
            }
        const GiNaC::symbol h = written_out_ ? d_.discretisation().h : GiNaC::symbol("h"), left("p_0");
        rename(left, "p_0");
        const auto slope = [&](std::size_t j) {
            ex sum = 0;
            for (std::size_t i = 0; i < r; ++i)
                sum += q.weights[i] * (q.D(at(i), at(j)) * node["g_v"][i] + h * q.B(at(i), at(j)) * node["g_q"][i]);
            return sum;
        };
        const bool constrained = !d_.system.constraints.empty();
        for (const char* block : {"lambda", "phi", "G", "GT"})
            for (std::size_t i = 1; i <= r && constrained; ++i) {
                node[block].emplace_back(fmt::format("{}_{}", block, i));
                rename(node[block].back(), node[block].back().get_name());
            }
        const auto pull = [&](std::size_t j) -> ex {
            return constrained ? h * q.weights[j] * node["GT"][j] * node["lambda"][j] : ex(0);
        };
        std::vector<ex> residual;
        Names names;
        for (std::size_t j = 0; j < unknowns; ++j) {
            residual.push_back(slope(j) + (j == 0 ? ex(left) : ex(0)) + pull(j));
            names.push_back(fmt::format("R_{}", j + 1));
        }
        for (std::size_t j = 0; j < unknowns && constrained; ++j) {
            residual.push_back(node["phi"][j + 1]);
            names.push_back(fmt::format("R_phi_{}", j + 2));
        }
        const std::size_t size = constrained ? 2 * unknowns : unknowns + (multiplier ? 1 : 0);
        GiNaC::matrix J(at(size), at(size));
        for (std::size_t j = 0; j < unknowns && constrained; ++j) {
            J(at(j), at(unknowns + j)) = h * q.weights[j] * node["GT"][j];
            J(at(unknowns + j), at(j)) = node["G"][j + 1];
        }
        for (std::size_t j = 0; j < unknowns; ++j)
            for (std::size_t k = 1; k <= unknowns; ++k)
                for (std::size_t i = 0; i < r; ++i) {
                    const ex Dj = q.D(at(i), at(j)), Dk = q.D(at(i), at(k)), Bj = q.B(at(i), at(j)),
                             Bk = q.B(at(i), at(k));
                    J(at(j), at(k - 1)) += q.weights[i] * (Dj * Dk / h * node["H_vv"][i] + Dj * Bk * node["H_vq"][i] +
                                                           Bj * Dk * node["H_qv"][i] + h * Bj * Bk * node["H_qq"][i]);
                }
        if (multiplier) {
            ex condition = 0;
            for (std::size_t i = 0; i < r; ++i) {
                const ex weight = q.weights[i] * q.legendre[i];
                condition += h * weight * node["g_P"][i];
                for (std::size_t j = 0; j < unknowns; ++j) {
                    J(at(j), at(unknowns)) +=
                        weight * (q.D(at(i), at(j)) * node["H_vP"][i] + h * q.B(at(i), at(j)) * node["H_qP"][i]);
                    J(at(unknowns), at(j)) += weight * (q.D(at(i), at(j + 1)) * node["H_Pv"][i] +
                                                        h * q.B(at(i), at(j + 1)) * node["H_Pq"][i]);
                }
                J(at(unknowns), at(unknowns)) += h * weight * q.legendre[i] * node["H_PP"][i];
            }
            residual.push_back(condition);
            names.push_back("R_kappa");
        }
        vector("step_equations", "D30", "",
               "R = 0: g_v and g_q are momentum and force at the nodes" +
                   std::string(multiplier    ? ", g_P the negative velocity of the cyclic coordinates"
                               : constrained ? ", GT = G^T, lambda the multipliers of the constraints"
                                             : ""),
               names, residual);
        matrix("step_jacobian", "D30", "",
               "its Jacobian: H are the second derivatives at the nodes" +
                   std::string(constrained ? ", those of phi times lambda among H_qq" : "") +
                   "; columns: positions 2 to " + std::to_string(controls_) +
                   (multiplier    ? ", kappa"
                    : constrained ? fmt::format(", lambda_1 to lambda_{}", unknowns)
                                  : ""),
               "J", J);
        vector("arrival_momentum", "D30", "", "arrival, explicit: the momentum after the step", {"p_1"},
               {slope(controls_ - 1) + pull(controls_ - 1)});
        if (constrained)
            vector("hidden_constraint", "D46", "",
                   fmt::format("where lambda_{} keeps the velocity on the constraints", r), {"0"},
                   {node["G"].back() * GiNaC::symbol("v_1") + GiNaC::symbol("phi_t")});
    }
};

// The equations of a step.
class Describer : SystemDescriber {
public:
    using SystemDescriber::SystemDescriber;

    Description run() {
        result_.name = d_.scene.name;
        result_.title = d_.scene.title;
        result_.findings = d_.findings;
        facts();
        quadrature();
        if (general_)
            general_system();
        else
            separable_system();
        if (written_out_ && !general_) discrete_equations();
        if (general_) {
            if (!d_.system.constraints.empty())
                constraints();
            else if (written_out_)
                general_equations();
            if (!d_.structure.routhian().cyclic.empty()) routhian();
            general_step();
        } else if (written_out_) {
            if (lobatto_) full_system();
            if (d_.structure.form() == Form::linear_map && n_ == 1)
                propagation_of_one();
            else
                reduced_system();
        }
        return std::move(result_);
    }

private:
    void discrete_equations() {
        const Discretisation& disc = d_.discretisation();
        const bool linear = d_.structure.linear;
        section("The discrete Lagrangian and its equations");
        scalar("discrete_lagrangian", "D4", linear ? "eq:discreteLagrangian" : "eq:discreteLagrangianNL",
               "discrete Lagrangian: the quadrature of L along the interpolated path", "L_d", disc.L_d);
        std::vector<ex> interior;
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

    // (D28, D30) in positions and velocities at the nodes, which have names of their own: written out in the control
    // points alone they would be too long to read.
    void general_equations() {
        const Discretisation& disc = d_.discretisation();
        const Quadrature& q = d_.quadrature;
        const std::size_t r = q.nodes.size();
        const ex h = disc.h;
        section("The discrete Lagrangian and its equations");
        std::vector<GiNaC::exmap> at_node(r);
        Names position_names, velocity_names;
        std::vector<ex> positions, velocities;
        for (std::size_t i = 0; i < r; ++i) {
            at_node[i][d_.system.t] = disc.t0 + q.nodes[i] * h;
            for (std::size_t k = 0; k < n_; ++k) {
                const std::string place = fmt::format("{}{}_{}", name(k), lobatto_ ? "" : "_at", i + 1);
                const GiNaC::symbol position(place), velocity(place + "'");
                ex value = 0, rise = 0;
                for (std::size_t j = 0; j < controls_; ++j) {
                    value += q.B(at(i), at(j)) * disc.Q[j][k];
                    rise += q.D(at(i), at(j)) * disc.Q[j][k];
                }
                at_node[i][d_.system.q[k]] = lobatto_ ? value : ex(position);
                at_node[i][d_.system.v[k]] = velocity;
                rename(velocity, velocity.get_name());
                velocity_names.push_back(name_of(velocity));
                velocities.push_back(rise / h);
                if (lobatto_) continue;
                rename(position, position.get_name());
                position_names.push_back(name_of(position));
                positions.push_back(value);
            }
        }
        if (!lobatto_) vector("node_positions", "D28", "", "positions at the nodes", position_names, positions);
        vector("node_velocities", "D28", "", "velocities at the nodes", velocity_names, velocities);
        const auto moved = [&](const ex& expression, std::size_t i) {
            return expression.subs(at_node[i], GiNaC::subs_options::no_pattern);
        };
        ex action = 0;
        for (std::size_t i = 0; i < r; ++i) action += h * q.weights[i] * moved(d_.system.lagrangian, i);
        scalar("discrete_lagrangian", "D30", "", "discrete Lagrangian: the quadrature of L along the interpolated path",
               "L_d", action);
        const auto slopes = [&](std::size_t j, int sign) {
            std::vector<ex> values;
            for (std::size_t k = 0; k < n_; ++k) {
                ex sum = 0;
                for (std::size_t i = 0; i < r; ++i)
                    sum += q.weights[i] * (q.D(at(i), at(j)) * moved(d_.system.momentum[k], i) +
                                           h * q.B(at(i), at(j)) * moved(d_.system.force[k], i));
                values.push_back(sign * sum);
            }
            return values;
        };
        std::vector<ex> interior;
        for (std::size_t j = 1; j + 1 < controls_; ++j) {
            const std::vector<ex> more = slopes(j, 1);
            interior.insert(interior.end(), more.begin(), more.end());
        }
        if (!interior.empty())
            vector("interior_equations", "D30", "", "interior discrete Euler-Lagrange equations",
                   Names(interior.size(), "0"), interior);
        vector("left_momentum", "D6", "", "momentum at the left end", names_of(disc.p0), slopes(0, -1));
        vector("right_momentum", "D7", "", "momentum at the right end", names_of(disc.p1), slopes(controls_ - 1, 1));
    }

    void full_system() {
        const Discretisation& disc = d_.discretisation();
        section("The full system");
        std::string unknowns;
        for (const auto& symbol : disc.full_unknowns) unknowns += (unknowns.empty() ? "" : ", ") + name_of(symbol);
        vector("full_system", "D9", "eq:internesNL, eq:discreteDynamics", "F_L = 0 for the unknowns " + unknowns,
               numbered("F_L", disc.full_system.size()), disc.full_system);
        matrix("full_jacobian", "D10", "section 5, dF_L", "its Jacobian; columns: " + unknowns, "dF_L",
               disc.full_jacobian);
    }

    void reduced_system() {
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
        const auto with_drift = [&](std::vector<ex> equations) {
            for (ex& equation : equations) equation = equation.subs(values, GiNaC::subs_options::no_pattern);
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
    void propagation_of_one() {
        const Propagation phi = propagation(d_.quadrature);
        const Discretisation& disc = d_.discretisation();
        const ex h = disc.h, m = d_.system.mass(0, 0), stiffness = expanded(d_.system.hessian(0, 0));
        const ex force = -d_.system.gradient[0].subs(d_.system.q[0] == 0);
        rename(phi.z, "z");
        std::map<std::string, GiNaC::symbol> symbols;
        for (const char* letter : {"delta", "a", "b", "c", "e_q", "e_p"}) {
            symbols.emplace(letter, GiNaC::symbol(letter));
            rename(symbols.at(letter), letter);
        }
        const auto symbol = [&](const char* letter) { return ex(symbols.at(letter)); };
        const auto left = [&](const char* letter) { return name_of(symbols.at(letter)); };
        section("The step in closed form");
        scalar("squared_angle", "D20", "", "the only number the step depends on, up to scaling", name_of(phi.z),
               h * h * stiffness / m);
        vector("propagation_polynomials", "D20", "eq:symplecticCoeffs",
               "numerators and denominator, with a^2 - b*c = delta^2", {left("delta"), left("a"), left("b"), left("c")},
               {phi.delta, phi.a, phi.b, phi.c});
        ex position = symbol("a") * disc.Q[0][0] + h / m * symbol("c") * disc.p0[0];
        ex momentum = m / h * symbol("b") * disc.Q[0][0] + symbol("a") * disc.p0[0];
        if (!force.is_zero()) {
            vector("force_polynomials", "D20", "", "numerators of what the constant force adds",
                   {left("e_q"), left("e_p")}, {phi.e_q, phi.e_p});
            position += h * h * force / m * symbol("e_q");
            momentum += h * force * symbol("e_p");
        }
        vector("propagation", "D20", "eq:symplecticSystem", "one step",
               {name_of(disc.Q.back()[0]), name_of(disc.p1[0])},
               {position / symbol("delta"), momentum / symbol("delta")});
        scalar("discrete_energy", "D21", "eq:discreteEnergy", "the energy that the steps conserve exactly", "H_d",
               (h / m * symbol("c") * GiNaC::pow(disc.p0[0], 2) - m / h * symbol("b") * GiNaC::pow(disc.Q[0][0], 2) -
                (force.is_zero() ? ex(0) : 2 * h * force * symbol("e_p") * disc.Q[0][0])) /
                   (2 * symbol("delta")));
    }
};

}  // namespace

Description describe(const Derivation& derivation) {
    return Describer(derivation).run();
}

}  // namespace lobatto
