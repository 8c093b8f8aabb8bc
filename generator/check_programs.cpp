// SPDX-License-Identifier: GPL-2.0-or-later
// The optimised programs, run on 60-digit numbers as a kernel runs them, against the formulas of the discretisation.
#include <cln/cln.h>

#include <algorithm>
#include <map>

#include "generator/check.hpp"
#include "generator/check_point.hpp"
#include "generator/identifier.hpp"

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

    void run(const std::string& name) {
        const auto program = std::find_if(programs_.programs.begin(), programs_.programs.end(),
                                          [&](const Program& p) { return p.name == name; });
        std::vector<Id> roots;
        for (const Output& output : program->outputs) roots.push_back(output.value);
        const Numbers values = programs_.graph.evaluate(inputs(), roots);
        for (const Output& output : program->outputs)
            set(output.target, values[static_cast<std::size_t>(output.value)]);
    }
    // A program whose outputs are locals that later outputs use.
    void run_in_order(const std::string& name) {
        const std::string local = "const real ";
        for (const Program& program : programs_.programs)
            for (const Output& output : program.outputs)
                if (program.name == name)
                    set(output.target.starts_with(local) ? output.target.substr(local.size()) : output.target,
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
          d_(derivation.discretisation()),
          system_(derivation.system),
          formulas_(formulas),
          machine_(programs),
          n_(static_cast<std::size_t>(system_.n)),
          m_(static_cast<std::size_t>(derivation.quadrature.points) - 2) {
        for (std::size_t i = 0; i < system_.parameters.size(); ++i)
            machine_.set(identifier(derivation.scene.parameters[i].name), formulas.get(system_.parameters[i]));
        machine_.set("h", formulas.get(d_.h));
        mass_ = formulas(entries(system_.mass.dense()));
    }

    std::vector<std::pair<std::string, double>> run() {
        mechanics();
        if (derivation_.structure.linear) {
            if (n_ == 1) propagation();
        } else {
            begin_step();
            if (m_ > 0) {
                start_values();
                stages();
            }
            arrival();
        }
        return measured_;
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

    static std::vector<ex> entries(const GiNaC::matrix& matrix) {
        std::vector<ex> all;
        for (unsigned i = 0; i < matrix.rows(); ++i)
            for (unsigned j = 0; j < matrix.cols(); ++j) all.push_back(matrix(i, j));
        return all;
    }
    Numbers values_of(const std::vector<GiNaC::symbol>& symbols) const {
        Numbers values;
        for (const auto& symbol : symbols) values.push_back(formulas_.get(symbol));
        return values;
    }
    Numbers acceleration_at(const std::vector<GiNaC::symbol>& position) {
        machine_.set("q", values_of(position));
        machine_.run("acceleration");
        return machine_.get("W", n_);
    }

    // p = dL/dq', H = p q' - L, grad V = M W, V'' = M S: all from L itself.
    void mechanics() {
        const std::string claim = "emitted energy, momentum, forces";
        std::vector<ex> momentum;
        ex energy = -system_.lagrangian;
        for (std::size_t k = 0; k < n_; ++k) {
            momentum.push_back(system_.lagrangian.diff(system_.v[k]));
            energy += momentum.back() * system_.v[k];
        }
        const Numbers p = formulas_(momentum), v = values_of(system_.v);
        machine_.set("q", values_of(system_.q));
        machine_.set("velocity", v);
        machine_.run("momentum");
        compare(claim, p, machine_.get("p", n_));
        machine_.set("p", p);
        machine_.run("velocity");
        compare(claim, v, machine_.get("velocity", n_));
        machine_.run("energy");
        compare(claim, formulas_({energy}), {machine_.get("return")});
        machine_.run("node");
        std::vector<ex> gradient, hessian;
        for (std::size_t k = 0; k < n_; ++k) {
            gradient.push_back(-system_.lagrangian.diff(system_.q[k]));
            for (std::size_t l = 0; l < n_; ++l) hessian.push_back(gradient[k].diff(system_.q[l]));
        }
        compare(claim, formulas_(gradient), times(mass_, machine_.get("W", n_)));
        const auto& places = derivation_.structure.entries;
        const Numbers stored = machine_.get("S", places.size());
        const Numbers second = formulas_(hessian);
        for (std::size_t l = 0; l < n_; ++l) {
            Numbers expected, column(n_, cln::cl_R(0));
            for (std::size_t e = 0; e < places.size(); ++e)
                if (static_cast<std::size_t>(places[e].second) == l)
                    column[static_cast<std::size_t>(places[e].first)] = stored[e];
            for (std::size_t k = 0; k < n_; ++k) expected.push_back(second[k * n_ + l]);
            compare(claim, expected, times(mass_, column));
        }
        compare(claim, formulas_(gradient), times(mass_, acceleration_at(system_.q)));
    }

    void begin_step() {
        const Numbers W0 = acceleration_at(d_.Q[0]);
        machine_.set("p", values_of(d_.p0));
        machine_.run("velocity");
        machine_.set("u", machine_.get("velocity", n_));
        machine_.set("W0", W0);
        machine_.run("drift");
        compare("emitted drift velocity", formulas_(d_.drift_velocity), machine_.get("v", n_));
    }

    // Q_i = base_i - h^2 sum_j A_ij w_j, with w_j = W0, or the polynomial through the last step's s accelerations at 1
    // + c_j.
    void start_values() {
        const Quadrature& quadrature = derivation_.quadrature;
        const std::size_t s = m_ + 2;
        const Numbers A = formulas_(entries(quadrature.A)), W0 = machine_.get("W0", n_),
                      base = machine_.get("base", n_ * m_);
        Numbers before;
        Noise noise(11);
        for (std::size_t i = 0; i < s * n_; ++i) before.push_back(noise.next());
        machine_.set("W_before", before);
        std::vector<ex> continued;
        for (std::size_t j = 0; j < m_; ++j)
            for (std::size_t i = 0; i < s; ++i)
                continued.push_back(quadrature.basis[i].subs(quadrature.theta == 1 + quadrature.c[j + 1]));
        const Numbers extrapolation = formulas_(continued);
        const cln::cl_R h = formulas_.get(d_.h);
        Numbers simple = base, extrapolated = base;
        for (std::size_t i = 0; i < m_; ++i)
            for (std::size_t j = 0; j < m_; ++j)
                for (std::size_t k = 0; k < n_; ++k) {
                    cln::cl_R w = 0;
                    for (std::size_t r = 0; r < s; ++r) w = w + extrapolation[j * s + r] * before[r * n_ + k];
                    simple[i * n_ + k] = simple[i * n_ + k] - h * h * A[i * m_ + j] * W0[k];
                    extrapolated[i * n_ + k] = extrapolated[i * n_ + k] - h * h * A[i * m_ + j] * w;
                }
        machine_.run("simple_start");
        compare("emitted start values", simple, machine_.get("Q", n_ * m_));
        machine_.run("extrapolated_start");
        compare("emitted start values", extrapolated, machine_.get("Q", n_ * m_));
    }

    void stages() {
        const auto& places = derivation_.structure.entries;
        const std::size_t N = n_ * m_, e = places.size();
        Numbers Q, W, S;
        const auto append = [](Numbers& list, const Numbers& more) {
            list.insert(list.end(), more.begin(), more.end());
        };
        for (std::size_t j = 1; j <= m_; ++j) {
            machine_.set("q", values_of(d_.Q[j]));
            machine_.run("node");
            append(Q, values_of(d_.Q[j]));
            append(W, machine_.get("W", n_));
            append(S, machine_.get("S", e));
        }
        machine_.set("Q", Q);
        machine_.set("W", W);
        machine_.set("S", S);
        const Numbers F = formulas_(d_.reduced_system), J = formulas_(entries(d_.reduced_jacobian));
        machine_.run("residual");
        compare("emitted stage equations", F, machine_.get("F", N));
        machine_.run("jacobian");
        compare("emitted Jacobian", J, machine_.get("J", N * N));
        machine_.run("correction");
        Numbers minus_F;
        for (const cln::cl_R& value : F) minus_F.push_back(-value);
        const Numbers delta = machine_.get("delta", N);
        if (N <= static_cast<std::size_t>(closed_form_limit)) {
            compare("emitted Newton correction", minus_F, times(J, delta));
        } else {
            compare("emitted Newton correction", minus_F, delta);
            compare("emitted Newton correction", J, machine_.get("J", N * N));
        }
        machine_.run("carry");
        Numbers carried = W;
        for (std::size_t j = 0; j < m_; ++j)
            for (std::size_t i = 0; i < e; ++i) {
                cln::cl_R& value = carried[j * n_ + static_cast<std::size_t>(places[i].first)];
                value = value + S[j * e + i] * delta[j * n_ + static_cast<std::size_t>(places[i].second)];
            }
        compare("emitted Newton correction", carried, machine_.get("W", N));
        machine_.set("W", W);
    }

    void arrival() {
        machine_.run("arrive");
        compare("emitted arrival", formulas_(d_.arrival_position), machine_.get("q1", n_));
        const Numbers W = machine_.get("W", n_ * m_);
        machine_.set("W1", acceleration_at(d_.Q.back()));
        machine_.set("W", W);
        machine_.run("finish");
        compare("emitted arrival", formulas_(d_.arrival_momentum), times(mass_, machine_.get("u1", n_)));
    }

    // The closed form against the stage equations solved by numbers.
    void propagation() {
        machine_.set("q", values_of(d_.Q[0]));
        machine_.set("p", values_of(d_.p0));
        machine_.run_in_order("prepare_map");
        machine_.run("propagate");
        const Numbers correction = solve(formulas_(entries(d_.reduced_jacobian)), formulas_(d_.reduced_system));
        for (std::size_t j = 0; j < m_; ++j)
            formulas_.set(d_.Q[j + 1][0], formulas_.get(d_.Q[j + 1][0]) - correction[j]);
        const cln::cl_R q1 = formulas_(d_.arrival_position)[0];
        formulas_.set(d_.Q.back()[0], q1);
        compare("emitted propagation in closed form", {q1, formulas_(d_.arrival_momentum)[0]},
                {machine_.get("q1[0]"), machine_.get("p1[0]")});
    }

    const Derivation& derivation_;
    const Discretisation& d_;
    const System& system_;
    Formulas& formulas_;
    Machine machine_;
    std::size_t n_, m_;
    Numbers mass_;  // n x n
    std::vector<std::pair<std::string, double>> measured_;
};

}  // namespace

std::vector<Check> check_programs(const Derivation& derivation, const Programs& optimised) {
    std::vector<Check> checks;
    at_two_points(derivation, [&](Formulas& formulas) {
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
