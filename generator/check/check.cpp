// SPDX-License-Identifier: GPL-2.0-or-later
// Identities of the discrete equations, by routes that the derivation does not take.
#include "generator/check/check.hpp"

#include <algorithm>

#include "generator/check/point.hpp"
#include "generator/formula/expansion.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using GiNaC::numeric;
using Expressions = std::vector<ex>;

unsigned at(std::size_t index) {
    return static_cast<unsigned>(index);
}

bool vanish(const Expressions& expressions) {
    return std::all_of(expressions.begin(), expressions.end(),
                       [](const ex& expression) { return expand_exactly(expression).is_zero(); });
}

Check exactly(const std::string& claim, bool holds, const std::string& meaning) {
    return {claim, holds, true, holds ? 0.0 : 1.0, 0, meaning};
}

constexpr double expansion_limit = 2000;  // terms in all: a few milliseconds

// Two lists of expressions that must be equal: by expansion when that is cheap and succeeds, else by numbers.
Check equal(const Derivation& derivation, const std::string& claim, const Expressions& x, const Expressions& y,
            const std::string& meaning) {
    double terms = 0;
    Expressions differences;
    for (std::size_t i = 0; i < x.size(); ++i) {
        differences.push_back(x[i] - y[i]);
        terms += terms_when_expanded(differences.back());
    }
    if (terms < expansion_limit && vanish(differences)) return exactly(claim, true, meaning);
    Check check{claim, false, false, 0, identity_bound, meaning};
    at_two_points(derivation, [&](Formulas& formulas) {
        check.measured = std::max(check.measured, relative_difference(formulas(x), formulas(y)));
    });
    check.holds = check.measured <= check.bound;
    return check;
}

// F's Jacobian J against central differences along seeded directions: (F(x + e d) - F(x - e d)) / 2e = J d + O(e^2).
Check differences(const Derivation& derivation, const std::string& claim, const Expressions& F,
                  const std::vector<GiNaC::symbol>& unknowns, const GiNaC::matrix& J) {
    Check check{claim, false, false, 0, difference_bound, "a derivative in the emitted Jacobian is wrong"};
    at_two_points(derivation, [&](Formulas& formulas) {
        Noise noise(7);
        Expressions entries;
        for (unsigned i = 0; i < J.rows(); ++i)
            for (unsigned j = 0; j < J.cols(); ++j) entries.push_back(J(i, j));
        const std::vector<Id> roots = formulas.convert(F);
        const Numbers values = formulas(entries);
        Numbers start;
        for (const auto& unknown : unknowns) start.push_back(formulas.get(unknown));
        const Numbers direction = seeded_direction(start, noise);
        const std::vector<Sized> sizes = formulas.evaluate_sized(roots);
        const auto difference = [&](const cln::cl_R& e) {
            return central_difference(start, direction, e, [&](const Numbers& x) {
                for (std::size_t j = 0; j < unknowns.size(); ++j) formulas.set(unknowns[j], x[j]);
                return formulas.evaluate(roots);
            });
        };
        check.measured = std::max(check.measured, difference_defect(times(values, direction), difference, sizes));
    });
    check.holds = check.measured <= check.bound;
    return check;
}

Expressions flat(const std::vector<Expressions>& rows) {
    Expressions result;
    for (const Expressions& row : rows) result.insert(result.end(), row.begin(), row.end());
    return result;
}

// The written-out equations against derivatives of L_d, and of each other.
class WrittenOut {
public:
    explicit WrittenOut(const Derivation& derivation)
        : derivation_(derivation),
          d_(derivation.discretisation()),
          system_(derivation.system),
          quadrature_(derivation.quadrature),
          n_(static_cast<std::size_t>(system_.n)),
          controls_(quadrature_.control.size()),
          inside_(controls_ - 2),
          stages_(quadrature_.c.size() - 2),
          nodes_are_unknowns_(quadrature_.method.family != Family::gauss) {}

    std::vector<Check> run() {
        action();
        slopes();
        if (!system_.separable) return std::move(checks_);
        solved_forms();
        jacobians();
        return std::move(checks_);
    }

private:
    static ex put(const ex& expression, const GiNaC::exmap& values) {
        return expression.subs(values, GiNaC::subs_options::no_pattern);
    }
    void add(const std::string& claim, const Expressions& one, const Expressions& other, const std::string& meaning) {
        if (!one.empty()) checks_.push_back(equal(derivation_, claim, one, other, meaning));
    }

    // L_d from its definition: the quadrature of L along the interpolating polynomial, or along the path that is
    // straight between nodes, whose kinetic energy is that of constant velocities.
    void action() {
        const Expressions &x = quadrature_.control, &b = quadrature_.weights;
        const ex h = d_.h;
        ex action = 0;
        along_.resize(b.size());
        for (std::size_t i = 0; i < b.size(); ++i) {
            along_[i][system_.t] = d_.t0 + quadrature_.nodes[i] * h;
            for (std::size_t k = 0; k < n_; ++k) {
                ex position = 0, velocity = 0;
                for (std::size_t j = 0; j < controls_; ++j) {
                    if (quadrature_.is_explicit()) {
                        if (x[j].is_equal(quadrature_.nodes[i])) position += d_.Q[j][k];
                        continue;
                    }
                    position += quadrature_.basis[j].subs(quadrature_.theta == quadrature_.nodes[i]) * d_.Q[j][k];
                    velocity += quadrature_.D(at(i), at(j)) * d_.Q[j][k] / h;
                }
                along_[i][system_.q[k]] = position;
                along_[i][system_.v[k]] = velocity;
            }
            action += h * b[i] * put(system_.lagrangian, along_[i]);
        }
        for (std::size_t j = 0; j + 1 < controls_ && quadrature_.is_explicit(); ++j) {
            GiNaC::exmap straight;
            for (std::size_t k = 0; k < n_; ++k)
                straight[system_.v[k]] = (d_.Q[j + 1][k] - d_.Q[j][k]) / ((x[j + 1] - x[j]) * h);
            action += h * (x[j + 1] - x[j]) * put(system_.lagrangian + system_.potential, straight);
        }
        add("L_d is the quadrature of L", {d_.L_d}, {action}, "the discrete Lagrangian is not that of the scene");
    }

    // The virtual work of outer forces at control point j.
    ex work(std::size_t j, std::size_t k) const {
        ex sum = 0;
        if (system_.outer_force[k].is_zero()) return sum;
        for (std::size_t i = 0; i < quadrature_.weights.size(); ++i)
            sum += d_.h * quadrature_.weights[i] * quadrature_.B(at(i), at(j)) * put(system_.outer_force[k], along_[i]);
        return sum;
    }

    // The discrete Euler-Lagrange equations by differentiating L_d as a whole.
    void slopes() {
        const auto slope = [&](std::size_t j, std::size_t k) { return d_.L_d.diff(d_.Q[j][k]) + work(j, k); };
        GiNaC::exmap to_step_before{{d_.t0, d_.t0 - d_.h}};
        for (std::size_t j = 0; j < controls_; ++j)
            for (std::size_t k = 0; k < n_; ++k) to_step_before[d_.Q[j][k]] = d_.Q_before[j][k];
        interior_.resize(inside_);
        Expressions border;
        for (std::size_t k = 0; k < n_; ++k) {
            for (std::size_t j = 0; j < inside_; ++j) interior_[j].push_back(slope(j + 1, k));
            left_.push_back(-slope(0, k));
            right_.push_back(slope(controls_ - 1, k));
            border.push_back(put(right_.back(), to_step_before) - left_.back());
        }
        Expressions momenta = d_.left_momentum, by_derivative = left_;
        momenta.insert(momenta.end(), d_.right_momentum.begin(), d_.right_momentum.end());
        by_derivative.insert(by_derivative.end(), right_.begin(), right_.end());
        add("interior equations are dL_d/dQ = 0", flat(interior_), flat(d_.interior),
            "the equations inside the step are not those of the discrete action");
        add("equations at the ends are dL_d/dq = 0", border, d_.border, "the discrete equations of motion are wrong");
        add("momenta are derivatives of L_d", by_derivative, momenta, "the momenta at the ends of a step are wrong");
    }

    // sum_j (B G)_ij e_j of the stages, and the positions at the nodes along the polynomial.
    std::vector<Expressions> stage_sums(GiNaC::exmap& path) const {
        std::vector<Expressions> sums(stages_, Expressions(n_));
        for (std::size_t i = 0; i < stages_; ++i)
            for (std::size_t k = 0; k < n_; ++k) {
                ex position = 0;
                for (std::size_t j = 0; j < controls_ && !nodes_are_unknowns_; ++j)
                    position += quadrature_.B(at(i), at(j)) * d_.Q[j][k];
                if (!nodes_are_unknowns_) path[d_.Y[i + 1][k]] = position;
                for (std::size_t j = 0; j < inside_; ++j) {
                    ex weight = nodes_are_unknowns_ ? quadrature_.G(at(i), at(j)) : ex(0);
                    for (std::size_t l = 0; l < inside_ && !nodes_are_unknowns_; ++l)
                        weight += quadrature_.B(at(i), at(l + 1)) * quadrature_.G(at(l), at(j));
                    sums[i][k] += weight * interior_[j][k];
                }
            }
        return sums;
    }

    // The solved forms as combinations of the slopes, e_j = dL_d/dQ_j, x_j the control points:
    //   stages    h M^-1 sum_j (B G)_ij e_j
    //   momentum  (p1 - right) - (p0 - left) - sum_j e_j
    //   position  h M^-1 (sum_j (x_j - 1/2) e_j + (right - p1)/2 + (left - p0)/2)
    //   arrival   q1 - (q1 of the reduced form) = h M^-1 (left - p0 - sum_j (1 - x_j) e_j)
    //   reduced   stages + c_i arrival
    void solved_forms() {
        const GiNaC::matrix inverse_mass = system_.mass.dense().inverse();
        const auto times_inverse_mass = [&](const Expressions& vector, std::size_t k) {
            ex sum = 0;
            for (std::size_t l = 0; l < n_; ++l) sum += inverse_mass(at(k), at(l)) * vector[l];
            return d_.h * sum;
        };
        GiNaC::exmap path;
        const std::vector<Expressions> stage_sum = stage_sums(path);
        Expressions momentum, position_sum(n_), arrival_sum(n_), combined, reduced;
        for (std::size_t k = 0; k < n_; ++k) {
            ex sum = (d_.p1[k] - right_[k]) - (d_.p0[k] - left_[k]);
            position_sum[k] = (right_[k] - d_.p1[k]) / 2 + (left_[k] - d_.p0[k]) / 2;
            arrival_sum[k] = left_[k] - d_.p0[k];
            for (std::size_t j = 0; j < inside_; ++j) {
                const ex &e = interior_[j][k], &x = quadrature_.control[j + 1];
                sum -= e;
                position_sum[k] += (x - numeric(1, 2)) * e;
                arrival_sum[k] -= (1 - x) * e;
            }
            momentum.push_back(sum);
        }
        for (std::size_t i = 0; i < stages_; ++i)
            for (std::size_t k = 0; k < n_; ++k) {
                combined.push_back(times_inverse_mass(stage_sum[i], k));
                reduced.push_back(combined.back() + quadrature_.c[i + 1] * times_inverse_mass(arrival_sum, k));
            }
        combined.insert(combined.end(), momentum.begin(), momentum.end());
        for (std::size_t k = 0; k < n_; ++k) combined.push_back(times_inverse_mass(position_sum, k));
        Expressions reduced_form = d_.reduced_system;
        for (std::size_t k = 0; k < n_; ++k) {
            reduced.push_back(times_inverse_mass(arrival_sum, k));
            reduced_form.push_back(d_.Q.back()[k] - d_.arrival_position[k]);
            reduced.push_back(momentum[k]);
            reduced_form.push_back(d_.p1[k] - d_.arrival_momentum[k]);
        }
        for (ex& equation : reduced_form) equation = put(equation, path);
        if (nodes_are_unknowns_)
            add("the full system F_L combines these", d_.full_system, combined,
                "F_L does not follow from the discrete action");
        add("the reduced system combines these", reduced_form, reduced,
            "what the kernel solves does not follow from the discrete action");
    }

    static Expressions derivatives(const Expressions& F, const std::vector<GiNaC::symbol>& unknowns) {
        Expressions entries;
        for (const ex& equation : F)
            for (const auto& unknown : unknowns) entries.push_back(equation.diff(unknown));
        return entries;
    }
    static Expressions entries_of(const GiNaC::matrix& J) {
        Expressions entries;
        for (unsigned i = 0; i < J.rows(); ++i)
            for (unsigned j = 0; j < J.cols(); ++j) entries.push_back(J(i, j));
        return entries;
    }

    void jacobians() {
        std::vector<GiNaC::symbol> unknowns;
        for (std::size_t j = 1; j <= stages_; ++j) unknowns.insert(unknowns.end(), d_.Y[j].begin(), d_.Y[j].end());
        if (nodes_are_unknowns_)
            add("dF_L is the derivative of F_L", derivatives(d_.full_system, d_.full_unknowns),
                entries_of(d_.full_jacobian), "an entry of the full Jacobian is wrong");
        if (stages_ > 0)
            add("the reduced Jacobian is the derivative", derivatives(d_.reduced_system, unknowns),
                entries_of(d_.reduced_jacobian), "an entry of the reduced Jacobian is wrong");
        if (nodes_are_unknowns_)
            checks_.push_back(differences(derivation_, "dF_L against central differences", d_.full_system,
                                          d_.full_unknowns, d_.full_jacobian));
        if (stages_ > 0)
            checks_.push_back(differences(derivation_, "reduced Jacobian against differences", d_.reduced_system,
                                          unknowns, d_.reduced_jacobian));
    }

    const Derivation& derivation_;
    const Discretisation& d_;
    const System& system_;
    const Quadrature& quadrature_;
    const std::size_t n_, controls_, inside_, stages_;
    const bool nodes_are_unknowns_;
    std::vector<GiNaC::exmap> along_;    // time, positions and velocities at the nodes
    std::vector<Expressions> interior_;  // slopes of L_d, node by node
    Expressions left_, right_;           // and at the ends, as momenta
    std::vector<Check> checks_;
};

}  // namespace

std::vector<Check> check_equations(const Derivation& derivation) {
    const bool written_out = is_written_out(derivation.system, derivation.quadrature);
    std::vector<Check> checks;
    if (written_out) checks = WrittenOut(derivation).run();
    if (!written_out || derivation.structure.form() == StepForm::general)
        for (const Check& check : check_action(derivation)) checks.push_back(check);
    return checks;
}

}  // namespace lobatto
