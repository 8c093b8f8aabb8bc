// SPDX-License-Identifier: GPL-2.0-or-later
// Identities of the discrete equations, by routes that the derivation does not take.
#include "generator/check/check.hpp"

#include <algorithm>
#include <functional>

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
        const auto difference = [&](const cln::cl_R& e) {
            return central_difference(start, direction, e, [&](const Numbers& x) {
                for (std::size_t j = 0; j < unknowns.size(); ++j) formulas.set(unknowns[j], x[j]);
                return formulas.evaluate(roots);
            });
        };
        check.measured = std::max(check.measured, difference_defect(times(values, direction), difference));
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
std::vector<Check> check_written_out(const Derivation& derivation) {
    const Discretisation& d = derivation.discretisation();
    const System& system = derivation.system;
    const Quadrature& quadrature = derivation.quadrature;
    const Expressions &c = quadrature.c, &x = quadrature.control, &b = quadrature.weights;
    const std::size_t n = static_cast<std::size_t>(system.n), s = c.size(), controls = x.size(), m = controls - 2;
    const ex h = d.h;

    // L_d from its definition: the quadrature of L along the interpolating polynomial, or along the path that is
    // straight between nodes, whose kinetic energy is that of constant velocities; and the virtual work of outer forces
    // at control point j.
    ex action = 0;
    std::vector<GiNaC::exmap> along(b.size());
    for (std::size_t i = 0; i < b.size(); ++i) {
        along[i][system.t] = d.t0 + quadrature.nodes[i] * h;
        for (std::size_t k = 0; k < n; ++k) {
            ex position = 0, velocity = 0;
            for (std::size_t j = 0; j < controls; ++j) {
                if (quadrature.is_explicit()) {
                    if (x[j].is_equal(quadrature.nodes[i])) position += d.Q[j][k];
                    continue;
                }
                position += quadrature.basis[j].subs(quadrature.theta == quadrature.nodes[i]) * d.Q[j][k];
                velocity += quadrature.D(at(i), at(j)) * d.Q[j][k] / h;
            }
            along[i][system.q[k]] = position;
            along[i][system.v[k]] = velocity;
        }
        action += h * b[i] * system.lagrangian.subs(along[i], GiNaC::subs_options::no_pattern);
    }
    for (std::size_t j = 0; j + 1 < controls && quadrature.is_explicit(); ++j) {
        GiNaC::exmap straight;
        for (std::size_t k = 0; k < n; ++k)
            straight[system.v[k]] = (d.Q[j + 1][k] - d.Q[j][k]) / ((x[j + 1] - x[j]) * h);
        const ex kinetic = system.lagrangian + system.potential;
        action += h * (x[j + 1] - x[j]) * kinetic.subs(straight, GiNaC::subs_options::no_pattern);
    }
    const auto work = [&](std::size_t j, std::size_t k) {
        ex sum = 0;
        if (system.outer_force[k].is_zero()) return sum;
        for (std::size_t i = 0; i < b.size(); ++i)
            sum += h * b[i] * quadrature.B(at(i), at(j)) *
                   system.outer_force[k].subs(along[i], GiNaC::subs_options::no_pattern);
        return sum;
    };
    // The discrete Euler-Lagrange equations by differentiating L_d as a whole.
    const auto slope = [&](std::size_t j, std::size_t k) { return d.L_d.diff(d.Q[j][k]) + work(j, k); };
    GiNaC::exmap to_step_before{{d.t0, d.t0 - h}};
    for (std::size_t j = 0; j < controls; ++j)
        for (std::size_t k = 0; k < n; ++k) to_step_before[d.Q[j][k]] = d.Q_before[j][k];
    std::vector<Expressions> interior(m);
    Expressions left, right, border;
    for (std::size_t k = 0; k < n; ++k) {
        for (std::size_t j = 0; j < m; ++j) interior[j].push_back(slope(j + 1, k));
        left.push_back(-slope(0, k));
        right.push_back(slope(controls - 1, k));
        border.push_back(right.back().subs(to_step_before, GiNaC::subs_options::no_pattern) - left.back());
    }
    Expressions momenta = d.left_momentum, momenta_by_derivative = left;
    momenta.insert(momenta.end(), d.right_momentum.begin(), d.right_momentum.end());
    momenta_by_derivative.insert(momenta_by_derivative.end(), right.begin(), right.end());

    std::vector<Check> checks;
    const auto add = [&](const std::string& claim, const Expressions& one, const Expressions& other,
                         const std::string& meaning) {
        if (!one.empty()) checks.push_back(equal(derivation, claim, one, other, meaning));
    };
    add("L_d is the quadrature of L", {d.L_d}, {action}, "the discrete Lagrangian is not that of the scene");
    add("interior equations are dL_d/dQ = 0", flat(interior), flat(d.interior),
        "the equations inside the step are not those of the discrete action");
    add("border equations are dL_d/dq = 0", border, d.border, "the discrete equations of motion are wrong");
    add("momenta are slopes of L_d", momenta_by_derivative, momenta, "the momenta at the ends of a step are wrong");
    if (!system.separable) return checks;

    // The solved forms as combinations of them, e_j = dL_d/dQ_j, x_j the control points:
    //   stages    h M^-1 sum_j (B G)_ij e_j
    //   momentum  (p1 - right) - (p0 - left) - sum_j e_j
    //   position  h M^-1 (sum_j (x_j - 1/2) e_j + (right - p1)/2 + (left - p0)/2)
    //   arrival   q1 - (q1 of the reduced form) = h M^-1 (left - p0 - sum_j (1 - x_j) e_j)
    //   reduced   stages + c_i arrival
    const GiNaC::matrix inverse_mass = system.mass.dense().inverse();
    const auto times_inverse_mass = [&](const Expressions& vector, std::size_t k) {
        ex sum = 0;
        for (std::size_t l = 0; l < n; ++l) sum += inverse_mass(at(k), at(l)) * vector[l];
        return h * sum;
    };
    const bool nodes_are_unknowns = quadrature.method.family != Family::gauss;
    const std::size_t stages = s - 2;
    GiNaC::exmap path;  // the positions at the nodes along the polynomial
    std::vector<Expressions> stage_sum(stages, Expressions(n));
    for (std::size_t i = 0; i < stages; ++i) {
        for (std::size_t k = 0; k < n; ++k) {
            ex position = 0;
            for (std::size_t j = 0; j < controls && !nodes_are_unknowns; ++j)
                position += quadrature.B(at(i), at(j)) * d.Q[j][k];
            if (!nodes_are_unknowns) path[d.Y[i + 1][k]] = position;
            for (std::size_t j = 0; j < m; ++j) {
                ex weight = nodes_are_unknowns ? quadrature.G(at(i), at(j)) : ex(0);
                for (std::size_t l = 0; l < m && !nodes_are_unknowns; ++l)
                    weight += quadrature.B(at(i), at(l + 1)) * quadrature.G(at(l), at(j));
                stage_sum[i][k] += weight * interior[j][k];
            }
        }
    }
    Expressions momentum, position_sum(n), arrival_sum(n), combined, reduced;
    for (std::size_t k = 0; k < n; ++k) {
        ex sum = (d.p1[k] - right[k]) - (d.p0[k] - left[k]);
        position_sum[k] = (right[k] - d.p1[k]) / 2 + (left[k] - d.p0[k]) / 2;
        arrival_sum[k] = left[k] - d.p0[k];
        for (std::size_t j = 0; j < m; ++j) {
            const ex& e = interior[j][k];
            sum -= e;
            position_sum[k] += (x[j + 1] - numeric(1, 2)) * e;
            arrival_sum[k] -= (1 - x[j + 1]) * e;
        }
        momentum.push_back(sum);
    }
    for (std::size_t i = 0; i < stages; ++i)
        for (std::size_t k = 0; k < n; ++k) {
            combined.push_back(times_inverse_mass(stage_sum[i], k));
            reduced.push_back(combined.back() + c[i + 1] * times_inverse_mass(arrival_sum, k));
        }
    combined.insert(combined.end(), momentum.begin(), momentum.end());
    for (std::size_t k = 0; k < n; ++k) combined.push_back(times_inverse_mass(position_sum, k));
    Expressions reduced_form = d.reduced_system;
    for (std::size_t k = 0; k < n; ++k) {
        reduced.push_back(times_inverse_mass(arrival_sum, k));
        reduced_form.push_back(d.Q.back()[k] - d.arrival_position[k]);
        reduced.push_back(momentum[k]);
        reduced_form.push_back(d.p1[k] - d.arrival_momentum[k]);
    }
    for (ex& equation : reduced_form) equation = equation.subs(path, GiNaC::subs_options::no_pattern);

    if (nodes_are_unknowns)
        add("full system combines these", d.full_system, combined, "F_L does not follow from the discrete action");
    add("reduced system combines these", reduced_form, reduced,
        "what the kernel solves does not follow from the discrete action");
    const auto derivatives = [](const Expressions& F, const std::vector<GiNaC::symbol>& unknowns) {
        Expressions entries;
        for (const ex& equation : F)
            for (const auto& unknown : unknowns) entries.push_back(equation.diff(unknown));
        return entries;
    };
    const auto entries_of = [](const GiNaC::matrix& J) {
        Expressions entries;
        for (unsigned i = 0; i < J.rows(); ++i)
            for (unsigned j = 0; j < J.cols(); ++j) entries.push_back(J(i, j));
        return entries;
    };
    std::vector<GiNaC::symbol> interior_unknowns;
    for (std::size_t j = 1; j <= stages; ++j)
        interior_unknowns.insert(interior_unknowns.end(), d.Y[j].begin(), d.Y[j].end());
    if (nodes_are_unknowns)
        add("dF_L is the derivative of F_L", derivatives(d.full_system, d.full_unknowns), entries_of(d.full_jacobian),
            "an entry of the full Jacobian is wrong");
    const std::string title =
        nodes_are_unknowns ? "and so is the reduced Jacobian" : "reduced Jacobian is the derivative";
    if (stages > 0)
        add(title, derivatives(d.reduced_system, interior_unknowns), entries_of(d.reduced_jacobian),
            "an entry of the reduced Jacobian is wrong");
    if (nodes_are_unknowns)
        checks.push_back(differences(derivation, "dF_L against central differences", d.full_system, d.full_unknowns,
                                     d.full_jacobian));
    if (stages > 0)
        checks.push_back(differences(derivation, "reduced Jacobian against differences", d.reduced_system,
                                     interior_unknowns, d.reduced_jacobian));
    return checks;
}

}  // namespace

std::vector<Check> check_equations(const Derivation& derivation) {
    const bool written_out = is_written_out(derivation.system, derivation.quadrature);
    std::vector<Check> checks;
    if (written_out) checks = check_written_out(derivation);
    if (!written_out || derivation.structure.form == Form::general)
        for (const Check& check : check_action(derivation)) checks.push_back(check);
    return checks;
}

}  // namespace lobatto
