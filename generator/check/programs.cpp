// SPDX-License-Identifier: GPL-2.0-or-later
// The optimised programs, run on 60-digit numbers as a kernel runs them, against derivatives of L and the formulas of
// the discretisation.
#include <cln/cln.h>

#include <algorithm>
#include <map>

#include "generator/check/check.hpp"
#include "generator/check/point.hpp"
#include "generator/programs/identifier.hpp"
#include "generator/programs/looped.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

// Runs programs over a store of named values: inputs are read from it by their C++ text, outputs written to it.
class Machine {
public:
    explicit Machine(const Programs& programs) : programs_(programs) {}

    void set(const std::string& name, const cln::cl_R& value) { store_[name] = value; }
    void set(const std::string& array, const Numbers& values) {
        for (std::size_t i = 0; i < values.size(); ++i) set(element(array, i), values[i]);
    }
    Numbers get(const std::string& array, std::size_t count) const {
        Numbers values;
        for (std::size_t i = 0; i < count; ++i) values.push_back(store_.at(element(array, i)));
        return values;
    }
    cln::cl_R get(const std::string& name) const { return store_.at(name); }

    bool has(const std::string& name) const {
        return std::any_of(programs_.programs.begin(), programs_.programs.end(),
                           [&](const Program& p) { return p.name == name; });
    }
    void run(const std::string& name) {
        for (const auto& [output, value] : outputs_of(name))
            set(output.effect == Effect::give_back ? "return" : output.target, value);
    }
    // The outputs of a program and their values.
    std::vector<std::pair<Output, cln::cl_R>> outputs_of(const std::string& name) const {
        const auto program = std::find_if(programs_.programs.begin(), programs_.programs.end(),
                                          [&](const Program& p) { return p.name == name; });
        std::vector<Id> roots;
        for (const Output& output : program->outputs) roots.push_back(output.value);
        const Numbers values = programs_.graph.evaluate(inputs(), roots);
        std::vector<std::pair<Output, cln::cl_R>> outputs;
        for (const Output& output : program->outputs)
            outputs.emplace_back(output, values[static_cast<std::size_t>(output.value)]);
        return outputs;
    }
    // A program whose outputs are locals that later outputs use.
    void run_in_order(const std::string& name) {
        for (const Program& program : programs_.programs)
            for (const Output& output : program.outputs)
                if (program.name == name)
                    set(output.target,
                        programs_.graph.evaluate(inputs(), {output.value})[static_cast<std::size_t>(output.value)]);
    }

private:
    static std::string element(const std::string& array, std::size_t i) {
        return array + "[" + std::to_string(i) + "]";
    }
    Numbers inputs() const {  // those not yet known are those that nothing run so far has used
        Numbers values;
        for (const Input& input : programs_.graph.inputs()) {
            const auto known = store_.find(input.code);
            values.push_back(known == store_.end() ? cln::cl_R(0) : known->second);
        }
        return values;
    }

    const Programs& programs_;
    std::map<std::string, cln::cl_R> store_;
};

// What is compared at one point: expected and computed numbers by claim.
class Comparison {
public:
    Comparison(const Derivation& derivation, Formulas& formulas, const Programs& programs)
        : derivation_(derivation),
          system_(derivation.system),
          formulas_(formulas),
          machine_(programs),
          n_(static_cast<std::size_t>(system_.n)),
          m_(static_cast<std::size_t>(derivation.quadrature.points) - 2) {
        for (std::size_t i = 0; i < system_.parameters.size(); ++i)
            machine_.set(identifier(derivation.scene.parameters[i].name), formulas.get(system_.parameters[i]));
        machine_.set("time", formulas.get(system_.t));
    }

    std::vector<std::pair<std::string, double>> run() {
        const Structure& structure = derivation_.structure;
        slopes_of_L();
        if (structure.looped) {
            repeated_terms();
        } else if (structure.form() == StepForm::general) {
            general();
        } else {
            mass_ = formulas_(entries(system_.mass.dense()));
            mechanics();
        }
        events();
        if (is_stepped(derivation_)) {
            const Discretisation& d = derivation_.discretisation();
            machine_.set("h", formulas_.get(d.h));
            propagation(d);
        }
        return measured_;
    }

    // Whether the step itself is a program.
    static bool is_stepped(const Derivation& derivation) {
        return derivation.structure.form() == StepForm::linear_map && derivation.system.n == 1 &&
               !derivation.quadrature.is_explicit();
    }

private:
    void compare(const std::string& claim, const Numbers& expected, const Numbers& computed) {
        const double difference = relative_difference(expected, computed);
        for (auto& [known, most] : measured_)
            if (known == claim) {
                most = std::max(most, difference);
                return;
            }
        measured_.emplace_back(claim, difference);
    }

    // Where terms cancel, near an equilibrium, a difference that is rounding beside their sizes is none.
    void compare(const std::string& claim, const Numbers& expected, Numbers computed, const Numbers& size) {
        for (std::size_t i = 0; i < expected.size(); ++i)
            if (Sized{expected[i], size[i]}.equals({computed[i], 0})) computed[i] = expected[i];
        compare(claim, expected, computed);
    }

    static std::vector<ex> entries(const GiNaC::matrix& matrix) {
        std::vector<ex> all;
        for (unsigned i = 0; i < matrix.rows(); ++i)
            for (unsigned j = 0; j < matrix.cols(); ++j) all.push_back(matrix(i, j));
        return all;
    }
    static std::vector<ex> entries(const SparseMatrix& matrix) {
        std::vector<ex> all;
        for (const auto& [place, value] : matrix.entries()) all.push_back(value);
        return all;
    }
    Numbers values_of(const std::vector<GiNaC::symbol>& symbols) const {
        Numbers values;
        for (const auto& symbol : symbols) values.push_back(formulas_.get(symbol));
        return values;
    }
    // p = dL/dq' and dL/dq + F by differentiating L as a whole where that is cheap; check_action compares the system's
    // own with differences of L.
    void slopes_of_L() {
        constexpr int whole_limit = 24;  // coordinates
        std::vector<ex> momentum = system_.momentum, force = system_.force;
        ex energy = -system_.lagrangian;
        for (std::size_t k = 0; k < n_; ++k) {
            if (system_.n <= whole_limit) {
                momentum[k] = system_.lagrangian.diff(system_.v[k]);
                force[k] = system_.lagrangian.diff(system_.q[k]) + system_.outer_force[k];
            }
            energy += momentum[k] * system_.v[k];
        }
        const auto sized = [&](const std::vector<ex>& all, Numbers& values, Numbers& sizes) {
            for (const Sized& one : formulas_.evaluate_sized(formulas_.convert(all))) {
                values.push_back(one.value);
                sizes.push_back(one.size);
            }
        };
        sized(momentum, p_, p_size_);
        sized(force, force_, force_size_);
        sized({energy}, energy_, energy_size_);
    }

    // p = dL/dq', H = p q' - L, grad V = M W, V'' = M S.
    void mechanics() {
        const std::string claim = "emitted energy, momentum, forces";
        const Numbers v = values_of(system_.v);
        machine_.set("q", values_of(system_.q));
        machine_.set("velocity", v);
        machine_.run("momentum");
        compare(claim, p_, machine_.get("p", n_), p_size_);
        machine_.set("p", p_);
        machine_.run("velocity");
        compare(claim, v, machine_.get("velocity", n_));
        if (machine_.has("energy")) {
            machine_.run("energy");
            compare(claim, energy_, {machine_.get("return")}, energy_size_);
        }
        machine_.run("node");
        Numbers gradient;
        for (const cln::cl_R& force : force_) gradient.push_back(-force);
        compare(claim, gradient, times(mass_, machine_.get("W", n_)), force_size_);
        compare_columns(claim, "S", derivatives(system_.gradient, system_.q));
        machine_.run("minus_acceleration");
        compare(claim, gradient, times(mass_, machine_.get("W", n_)), force_size_);
        if (machine_.has("quadratic_part")) {
            machine_.run("quadratic_part");
            compare_columns(claim, "S0", derivation_.structure.separable().constant_hessian.dense());
        }
    }
    // `second` = M S, column by column; of S a program gives the entries that may differ from zero.
    void compare_columns(const std::string& claim, const std::string& name, const GiNaC::matrix& second) {
        const auto& places = derivation_.structure.constant_mass().entries;
        const Numbers stored = machine_.get(name, places.size()), wanted = formulas_(entries(second));
        for (std::size_t l = 0; l < n_; ++l) {
            Numbers expected, column(n_, cln::cl_R(0));
            for (std::size_t e = 0; e < places.size(); ++e)
                if (static_cast<std::size_t>(places[e].second) == l)
                    column[static_cast<std::size_t>(places[e].first)] = stored[e];
            for (std::size_t k = 0; k < n_; ++k) expected.push_back(wanted[k * n_ + l]);
            compare(claim, expected, times(mass_, column));
        }
    }
    GiNaC::matrix derivatives(const std::vector<ex>& vector, const std::vector<GiNaC::symbol>& symbols) const {
        return derivative_of(vector, symbols).dense();
    }

    // (D25 ... D29): one node in z, and the whole system in (q, velocity).
    void general() {
        const Routhian& routhian = derivation_.structure.routhian();
        set_cyclic_momenta();
        set_multipliers();
        machine_.set("z", values_of(routhian.z));
        const Numbers g = formulas_(routhian.gradient);
        const std::string at_node = "emitted node: slopes and second derivatives";
        machine_.run("node");
        compare(at_node, g, machine_.get("g", g.size()));
        compare(at_node, formulas_(entries(routhian.second)), machine_.get("H", routhian.second.entries().size()));
        machine_.run("slope");
        compare(at_node, g, machine_.get("g", g.size()));
        if (!system_.constraints.empty()) constraints();

        const std::string claim = "emitted energy, momentum, forces";
        machine_.set("q", values_of(system_.q));
        machine_.set("velocity", values_of(system_.v));
        machine_.run("momentum");
        compare(claim, p_, machine_.get("p", n_), p_size_);
        machine_.run("slopes");
        compare(claim, p_, machine_.get("Lv", n_), p_size_);
        compare(claim, force_, machine_.get("Lq", n_), force_size_);
        machine_.run("legendre");
        compare(claim, p_, machine_.get("p", n_), p_size_);
        if (derivation_.structure.hamiltonian()) {
            machine_.set("p", p_);
            machine_.run("velocity");
            compare(claim, values_of(system_.v), machine_.get("velocity", n_));
            machine_.run("force");
            compare(claim, force_, machine_.get("F", n_), force_size_);
        }
        std::vector<ex> mass;
        for (const auto& [place, value] : system_.momentum_v.entries())
            mass.push_back(system_.momentum[static_cast<std::size_t>(place.first)].diff(
                system_.v[static_cast<std::size_t>(place.second)]));
        compare(claim, formulas_(mass), machine_.get("M", mass.size()));
        if (machine_.has("energy")) {
            machine_.run("energy");
            compare(claim, energy_, {machine_.get("return")}, energy_size_);
        }
    }
    void set_multipliers() {
        Noise noise(17);
        for (const auto& lambda : derivation_.structure.routhian().multipliers) formulas_.set(lambda, noise.next());
    }
    // (D44) phi and its derivatives, each taken of the whole; G^T lambda beside the forces of a node.
    void constraints() {
        const std::vector<GiNaC::symbol>& lambda = derivation_.structure.routhian().multipliers;
        std::vector<ex> phi, phi_t, G, pull;
        ex constrained = 0;
        for (std::size_t c = 0; c < lambda.size(); ++c) {
            phi.push_back(system_.constraints[c].value);
            phi_t.push_back(phi.back().diff(system_.t));
            constrained += lambda[c] * phi.back();
        }
        for (const auto& [place, value] : system_.constraint_q.entries())
            G.push_back(
                phi[static_cast<std::size_t>(place.first)].diff(system_.q[static_cast<std::size_t>(place.second)]));
        machine_.set("q", values_of(system_.q));
        machine_.run("constraint");
        const std::string claim = "emitted constraints and their slopes";
        compare(claim, formulas_(phi), machine_.get("phi", phi.size()));
        compare(claim, formulas_(phi_t), machine_.get("phi_t", phi.size()));
        compare(claim, formulas_(G), machine_.get("G", G.size()));
        for (const auto& q : system_.q) pull.push_back(constrained.diff(q));
        Numbers forces = formulas_(pull);
        for (std::size_t k = 0; k < n_; ++k) forces[k] = forces[k] + force_[k];
        const Numbers g = machine_.get("g", 2 * n_ + lambda.size());
        compare(claim, forces,
                {g.begin() + static_cast<std::ptrdiff_t>(n_), g.begin() + static_cast<std::ptrdiff_t>(2 * n_)});
    }
    void set_cyclic_momenta() {
        const Routhian& routhian = derivation_.structure.routhian();
        for (std::size_t c = 0; c < routhian.cyclic.size(); ++c)
            formulas_.set(routhian.P[c], p_[static_cast<std::size_t>(routhian.cyclic[c])]);
    }

    // Formulas applied to the rows of their tables, added up as the loops of a kernel add them.
    void repeated_terms() {
        const bool general = derivation_.structure.form() == StepForm::general;
        const std::vector<GiNaC::symbol>& variables = general ? derivation_.structure.routhian().z : system_.q;
        const Numbers z = values_of(variables);
        machine_.set("q", values_of(system_.q));
        machine_.set("z", z);
        std::map<std::string, cln::cl_R> sums;  // by target
        const auto add = [&](const std::string& target, const cln::cl_R& value) {
            const auto [place, is_new] = sums.emplace(target, value);
            if (!is_new) place->second = place->second + value;
        };
        const std::string slope = general ? "g" : "W", second = general ? "H" : "S";
        std::map<std::pair<int, int>, std::size_t> entry;
        if (general)
            for (const auto& [place, value] : derivation_.structure.routhian().second.entries())
                entry.emplace(place, entry.size());
        else
            for (const auto& place : derivation_.structure.constant_mass().entries) entry.emplace(place, entry.size());
        const auto element_target = [](const std::string& array, std::size_t i) {
            return array + "[" + std::to_string(i) + "]";
        };
        const std::string rest_energy = name_of({LoopPart::rest, LoopPart::Of::energy});
        const auto add_energy = [&](const std::string& program) {
            if (!machine_.has(program)) return;
            for (const auto& [output, value] : machine_.outputs_of(program)) add(output.target, value);
        };
        for (const auto& [output, value] : machine_.outputs_of(name_of({LoopPart::rest, LoopPart::Of::node})))
            add(output.target, value);
        add_energy(rest_energy);
        const std::vector<Element>& elements = derivation_.structure.elements.repeated;
        for (int number = 0; number < static_cast<int>(elements.size()); ++number) {
            const Element& element = elements[static_cast<std::size_t>(number)];
            const auto pairs = pairs_of(element);
            for (std::size_t row = 0; row < element.rows.size(); ++row) {
                const auto variable = [&](std::size_t j) { return element.rows[row][j]; };
                for (std::size_t j = 0; j < element.x.size(); ++j)
                    machine_.set("x" + std::to_string(j), z[static_cast<std::size_t>(variable(j))]);
                if (!element.a.empty()) {
                    const Numbers a = formulas_(element.coefficients[row]);
                    for (std::size_t j = 0; j < a.size(); ++j) machine_.set("a" + std::to_string(j), a[j]);
                }
                for (const auto& [output, value] : machine_.outputs_of(name_of({number, LoopPart::Of::node})))
                    for (std::size_t j = 0; j < element.x.size(); ++j) {
                        if (output.target == slope + "[i" + std::to_string(j) + "]")
                            add(element_target(slope, static_cast<std::size_t>(variable(j))),
                                output.effect == Effect::subtract ? -value : value);
                        for (std::size_t column = 0; column < pairs.size() && j == 0; ++column)
                            if (output.target == second + "[" + entry_of_row(derivation_, number, pairs, column) + "]")
                                add(element_target(second, entry.at({variable(pairs[column].first),
                                                                     variable(pairs[column].second)})),
                                    value);
                    }
                add_energy(name_of({number, LoopPart::Of::energy}));
            }
        }
        const auto sum = [&](const std::string& target) {
            const auto known = sums.find(target);
            return known == sums.end() ? cln::cl_R(0) : known->second;
        };
        Numbers expected_slope = p_, computed_slope, expected_second, computed_second;
        if (general)
            expected_slope.insert(expected_slope.end(), force_.begin(), force_.end());
        else
            for (std::size_t k = 0; k < n_; ++k) expected_slope[k] = -force_[k];
        for (std::size_t i = 0; i < variables.size(); ++i) computed_slope.push_back(sum(element_target(slope, i)));
        const SparseMatrix& matrix = general ? derivation_.structure.routhian().second : system_.hessian;
        expected_second = formulas_(entries(matrix));
        for (const auto& [place, value] : matrix.entries())
            computed_second.push_back(sum(element_target(second, entry.at(place))));
        const std::string claim = "emitted terms in loops";
        compare(claim, expected_slope, computed_slope);
        compare(claim, expected_second, computed_second);
        if (machine_.has(rest_energy)) compare(claim, general ? energy_ : formulas_({system_.potential}), {sum("sum")});
    }

    void events() {
        std::vector<ex> values;
        for (const Event& event : derivation_.scene.watched()) values.push_back(event.value);
        if (values.empty()) return;
        machine_.set("q", values_of(system_.q));
        machine_.set("velocity", values_of(system_.v));
        machine_.run("event");
        compare("emitted events", formulas_(values), machine_.get("value", values.size()));
        if (!derivation_.scene.impacts.empty()) impacts();
        refractions();
    }

    void refractions() {
        std::vector<ex> gradient, rate;
        for (const Switch& one : derivation_.scene.switches) {
            if (!one.refracts) continue;
            for (const GiNaC::symbol& q : system_.q) gradient.push_back(one.value.diff(q));
            rate.push_back(one.value.diff(system_.t));
        }
        if (rate.empty()) return;
        machine_.run("refraction");
        compare("emitted refractions", formulas_(gradient), machine_.get("G", gradient.size()));
        compare("emitted refractions", formulas_(rate), machine_.get("g_t", rate.size()));
    }

    void impacts() {
        const std::vector<Impact>& walls = derivation_.scene.impacts;
        std::vector<ex> gradient, rate, restitution, rest, position, velocity;
        for (const Impact& wall : walls) {
            for (const GiNaC::symbol& q : system_.q) gradient.push_back(wall.when.value.diff(q));
            rate.push_back(wall.when.value.diff(system_.t));
            restitution.push_back(wall.restitution);
            rest.push_back(wall.rest);
            position.insert(position.end(), wall.reset_position.begin(), wall.reset_position.end());
            velocity.insert(velocity.end(), wall.reset_velocity.begin(), wall.reset_velocity.end());
        }
        const std::string claim = "emitted impacts";
        machine_.run("impact");
        compare(claim, formulas_(gradient), machine_.get("G", gradient.size()));
        compare(claim, formulas_(rate), machine_.get("g_t", rate.size()));
        compare(claim, formulas_(restitution), machine_.get("restitution", restitution.size()));
        compare(claim, formulas_(rest), machine_.get("rest", rest.size()));
        if (position.empty()) return;
        machine_.run("reset");
        compare(claim, formulas_(position), machine_.get("q1", position.size()));
        compare(claim, formulas_(velocity), machine_.get("velocity1", velocity.size()));
    }

    // The closed form against the stage equations solved by numbers.
    void propagation(const Discretisation& d) {
        machine_.set("q", values_of(d.Q[0]));
        machine_.set("p", values_of(d.p0));
        machine_.run_in_order("prepare_map");
        machine_.run("propagate");
        const Numbers correction = solve(formulas_(entries(d.reduced_jacobian)), formulas_(d.reduced_system));
        for (std::size_t j = 0; j < m_; ++j) formulas_.set(d.Y[j + 1][0], formulas_.get(d.Y[j + 1][0]) - correction[j]);
        const cln::cl_R q1 = formulas_(d.arrival_position)[0];
        formulas_.set(d.Q.back()[0], q1);
        compare("emitted propagation in closed form", {q1, formulas_(d.arrival_momentum)[0]},
                {machine_.get("q1[0]"), machine_.get("p1[0]")});
    }

    const Derivation& derivation_;
    const System& system_;
    Formulas& formulas_;
    Machine machine_;
    std::size_t n_, m_;
    Numbers mass_;                               // n x n, of separable systems
    Numbers p_, force_, energy_;                 // at the point: n, n, 1
    Numbers p_size_, force_size_, energy_size_;  // what their rounding is measured against (Sized)
    std::vector<std::pair<std::string, double>> measured_;
};

}  // namespace

std::vector<Check> check_programs(const Derivation& derivation, const Programs& optimised) {
    std::vector<Check> checks;
    at_two_attempts([&](int attempt) {
        Formulas formulas;
        if (Comparison::is_stepped(derivation))
            formulas = point_near_start(derivation, attempt);
        else
            NearStart(derivation.scene, attempt).set_all(formulas);
        for (const auto& [claim, measured] : Comparison(derivation, formulas, optimised).run()) {
            auto check = std::find_if(checks.begin(), checks.end(),
                                      [&, name = claim](const Check& c) { return c.claim == name; });
            if (check == checks.end())
                check = checks.insert(checks.end(), {claim, false, false, 0, identity_bound,
                                                     "the emitted code does not compute what was derived"});
            check->measured = std::max(check->measured, measured);
            check->holds = check->measured <= check->bound;
        }
    });
    return checks;
}

}  // namespace lobatto
