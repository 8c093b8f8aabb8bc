// SPDX-License-Identifier: GPL-2.0-or-later
// A derivation as a list of numbered formulas: which ones, in which order, under which names.
#include "generator/describe.hpp"

#include <fmt/format.h>

#include <set>

#include "generator/notation.hpp"
#include "generator/pipeline.hpp"
#include "generator/propagation.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using Names = std::vector<std::string>;

class Describer {
public:
    explicit Describer(const Derivation& derivation)
        : d_(derivation),
          n_(static_cast<std::size_t>(derivation.system.n)),
          s_(static_cast<std::size_t>(derivation.quadrature.points)),
          is_paper_scheme_(s_ == 4 && n_ == 1) {
        for (const Coordinate& coordinate : d_.scene.coordinates) {
            taken_.insert(coordinate.name);
            taken_.insert(coordinate.name + "'");
        }
        for (const Parameter& parameter : d_.scene.parameters) taken_.insert(parameter.name);
        taken_.insert("h");
        const Discretisation& disc = d_.discretisation();
        for (std::size_t i = 0; i < s_; ++i)
            for (std::size_t k = 0; k < n_; ++k) rename(disc.Q[i][k], fmt::format("{}_{}", name(k), i + 1));
        for (std::size_t k = 0; k < n_; ++k) {
            rename(disc.p0[k], n_ == 1 ? "p_left" : fmt::format("p_{}_left", name(k)));
            rename(disc.p1[k], n_ == 1 ? "p_right" : fmt::format("p_{}_right", name(k)));
        }
        for (std::size_t i = 0; i + 1 < s_; ++i)
            for (std::size_t k = 0; k < n_; ++k)
                rename(disc.Q_before[i][k], fmt::format("{}_before_{}", name(k), i + 1));
    }

    Description run() {
        result_.name = d_.scene.name;
        result_.title = d_.scene.title;
        result_.findings = d_.structure.findings;
        facts();
        quadrature();
        system();
        discrete_equations();
        full_system();
        if (d_.structure.linear && n_ == 1)
            propagation_of_one();
        else
            reduced_system();
        return std::move(result_);
    }

private:
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
    // Labels of the paper belong to four points and one coordinate.
    void add(Formula formula) {
        if (!is_paper_scheme_) formula.paper.clear();
        for (ex& value : formula.values) value = shown(value);
        result_.sections.back().formulas.push_back(std::move(formula));
    }

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
        for (const auto& [title, parameters] :
             {std::pair{"Parameters", &d_.scene.parameters}, std::pair{"Constants", &d_.scene.constants}}) {
            list.clear();
            for (const Parameter& parameter : *parameters)
                append(with_unit(parameter.name + " = " + canonical_text(parameter.value), parameter.unit));
            if (!list.empty()) facts.emplace_back(title, list);
        }
        facts.emplace_back("Method", fmt::format("Lobatto, {} points: order {}", s_, d_.quadrature.order()));
        list.clear();
        for (std::size_t i = 0; i < s_; ++i)
            for (std::size_t k = 0; k < n_; ++k) append(name_of(d_.discretisation().Q[i][k]));
        const std::string in_paper = is_paper_scheme_ ? "; the paper's q_l, q_xi, q_{1-xi}, q_r" : "";
        facts.emplace_back("Positions", list + " at the nodes of one step, from its left end to its right" + in_paper);
        list.clear();
        for (const auto& momenta : {d_.discretisation().p0, d_.discretisation().p1})
            for (const auto& symbol : momenta) append(name_of(symbol));
        facts.emplace_back("Momenta", list + " at the two ends");
    }

    void quadrature() {
        const Quadrature& q = d_.quadrature;
        section("Quadrature and interpolation on [0, 1]");
        vector("nodes", "D22", "eq:lobattoQuad", "nodes", numbered("c", s_), q.c);
        vector("weights", "D22", "eq:lobattoQuad", "weights", numbered("b", s_), q.b);
        vector("basis", "D22", "eq:basisFunctions", "basis: the polynomials that are 1 at their node, 0 at the others",
               numbered("l", s_), q.basis);
        matrix("differentiation", "D22", "", "differentiation matrix: derivative of basis polynomial j at node i", "D",
               q.D);
        matrix("rigidity", "D4", "eq:rigidityKE", "rigidity: the integrals of products of derivatives", "K", q.K);
        if (s_ > 2) matrix("stage_map", "D19", "", "stage map over the interior nodes", "A", q.A);
    }

    void system() {
        const System& system = d_.system;
        section("The system");
        matrix("mass", "D2", "", "mass matrix", "M", system.mass.dense());
        scalar("potential", "D3", "", "potential energy", "V", system.potential);
        const GiNaC::matrix inverse = system.mass.dense().inverse();
        std::vector<ex> W, momenta;
        GiNaC::matrix S(static_cast<unsigned>(n_), static_cast<unsigned>(n_));
        ex energy = system.potential;
        for (unsigned k = 0; k < n_; ++k) {
            ex sum = 0, momentum = 0;
            for (unsigned l = 0; l < n_; ++l) {
                sum += inverse(k, l).normal() * system.gradient[l];
                momentum += system.mass(k, l) * system.v[l];
                energy += inverse(k, l).normal() * momentum_symbol(k) * momentum_symbol(l) / 2;
                for (unsigned j = 0; j < n_; ++j) S(k, j) += inverse(k, l).normal() * system.hessian(l, j);
            }
            W.push_back(sum);
            momenta.push_back(momentum);
        }
        vector("acceleration", "D1", "", "negative acceleration, M^-1 grad V", by_coordinate("W"), W);
        matrix("stiffness", "D1", "", "its derivative, M^-1 V''", "S", S);
        vector("momentum", "D2", "", "momentum", by_coordinate("p"), momenta);
        scalar("energy", "D3", "", "energy", "H", energy);
    }
    GiNaC::symbol momentum_symbol(std::size_t k) {
        while (p_.size() <= k) {
            p_.emplace_back("p");
            std::string wish = by_coordinate("p")[p_.size() - 1];
            rename(p_.back(), wish);
        }
        return p_[k];
    }

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
                   "interior discrete Euler-Lagrange equations: the derivatives of L_d at the interior nodes",
                   Names(interior.size(), "0"), interior);
        vector("left_momentum", "D6", "", "momentum at the left end", names_of(disc.p0), disc.left_momentum);
        vector("right_momentum", "D7", "eq:rightMomentum", "momentum at the right end", names_of(disc.p1),
               disc.right_momentum);
        vector("border_equations", "D8", linear ? "eq:centerEL" : "eq:ELequationsNL",
               "border equations: the momentum at the right end of the step before is that at the left end of this one",
               Names(n_, "0"), disc.border);
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
        section("The reduced form: interior unknowns only");
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
            vector("reduced_system", "D12", "", "F = 0 for the interior positions",
                   numbered("F", disc.reduced_system.size()), with_drift(disc.reduced_system));
            matrix("reduced_jacobian", "D13", "", "its Jacobian", "J", disc.reduced_jacobian);
        }
        Names arrival;
        for (const auto& symbol : disc.Q[s_ - 1]) arrival.push_back(name_of(symbol));
        vector("arrival_position", "D16", "", "arrival, explicit", arrival, with_drift(disc.arrival_position));
        vector("arrival_momentum", "D17", "", "and its momentum, explicit", names_of(disc.p1), disc.arrival_momentum);
    }

    // (D20) and the energy that it conserves, (D21).
    void propagation_of_one() {
        const Propagation phi = propagation(d_.quadrature);
        const Discretisation& disc = d_.discretisation();
        const ex h = disc.h, m = d_.system.mass(0, 0), stiffness = d_.system.hessian(0, 0).expand();
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
               {name_of(disc.Q[s_ - 1][0]), name_of(disc.p1[0])},
               {position / symbol("delta"), momentum / symbol("delta")});
        if (force.is_zero())
            scalar(
                "discrete_energy", "D21", "eq:discreteEnergy", "the energy that the steps conserve exactly", "H_d",
                (h / m * symbol("c") * GiNaC::pow(disc.p0[0], 2) - m / h * symbol("b") * GiNaC::pow(disc.Q[0][0], 2)) /
                    (2 * symbol("delta")));
    }

    const Derivation& d_;
    std::size_t n_, s_;
    bool is_paper_scheme_;
    std::set<std::string> taken_;
    GiNaC::exmap display_;
    std::map<ex, std::string, GiNaC::ex_is_less> names_;
    std::vector<GiNaC::symbol> p_;
    Description result_;
};

}  // namespace

Description describe(const Derivation& derivation) {
    return Describer(derivation).run();
}

}  // namespace lobatto
