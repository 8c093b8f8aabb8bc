// SPDX-License-Identifier: GPL-2.0-or-later
// The programs of systems with a constant mass matrix: mechanics, one affine map, or the step with implicit interior
// nodes (D11 ... D20).
#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "generator/formula/expansion.hpp"
#include "generator/method/propagation.hpp"
#include "generator/programs/builder.hpp"

namespace lobatto {

namespace {

// M^-1 as straight-line code: Gauss-Jordan elimination on the graph, zeros skipped. The pivots are the values that must
// not vanish.
Rows invert(Graph& graph, Rows matrix, Ids& pivots) {
    const std::size_t n = matrix.size();
    Rows result(n, Ids(n, graph.number(0)));
    for (std::size_t k = 0; k < n; ++k) result[k][k] = graph.number(1);
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t row = k;
        while (row < n && graph.is_number(matrix[row][k], 0)) ++row;
        if (row == n) throw std::logic_error("the mass matrix is singular: the system stage should have refused it");
        std::swap(matrix[k], matrix[row]);
        std::swap(result[k], result[row]);
        pivots.push_back(matrix[k][k]);
        const Id reciprocal = graph.power(matrix[k][k], -1);
        for (std::size_t j = 0; j < n; ++j) {
            if (!graph.is_number(matrix[k][j], 0)) matrix[k][j] = graph.multiply({reciprocal, matrix[k][j]});
            if (!graph.is_number(result[k][j], 0)) result[k][j] = graph.multiply({reciprocal, result[k][j]});
        }
        for (std::size_t i = 0; i < n; ++i) {
            if (i == k || graph.is_number(matrix[i][k], 0)) continue;
            const Id factor = matrix[i][k];
            for (std::size_t j = 0; j < n; ++j) {
                matrix[i][j] = graph.subtract(matrix[i][j], graph.multiply({factor, matrix[k][j]}));
                result[i][j] = graph.subtract(result[i][j], graph.multiply({factor, result[k][j]}));
            }
        }
    }
    return result;
}

class SeparableBuilder : public ProgramBuilder {
public:
    explicit SeparableBuilder(const Derivation& derivation) : ProgramBuilder(derivation) {
        for (std::size_t k = 0; k < n_; ++k) {
            mass_.emplace_back();
            for (std::size_t l = 0; l < n_; ++l) mass_.back().push_back(convert(d_.system.mass(k, l)));
        }
        inverse_mass_ = invert(g(), mass_, pivots_);
    }

    Programs build() {
        prepare();
        mechanics();
        if (d_.structure.form == Form::linear_map) {
            if (n_ == 1) propagation_of_one();
        } else {
            if (d_.structure.unrolled) step();
            if (d_.structure.diagonal_part || d_.structure.absorbed) quadratic_part();
            if (d_.structure.diagonal_part) remainder();
        }
        velocities_as_inputs();
        events();
        return std::move(p_);
    }

private:
    Id c(std::size_t i) { return convert(d_.quadrature.c[i]); }
    Id b(std::size_t i) { return convert(d_.quadrature.b[i]); }
    Id A(std::size_t i, std::size_t j) {
        return convert(d_.quadrature.A(static_cast<unsigned>(i), static_cast<unsigned>(j)));
    }
    Id h2() { return g().power(h_, 2); }
    // h^2 A_ij and its kin, named for the hoisted coefficients. Node numbers are those of the derivation, from 1.
    Id h2A(std::size_t i, std::size_t j) {
        return named("h2_A" + std::to_string(i + 2) + std::to_string(j + 2), g().multiply({h2(), A(i, j)}));
    }
    Id hb(std::size_t i) { return named("h_b" + std::to_string(i + 1), g().multiply({h_, b(i)})); }
    Id hc(std::size_t i) { return named("h_c" + std::to_string(i + 1), g().multiply({h_, c(i)})); }

    // What prepare must refuse: a mass matrix without inverse.
    void prepare() {
        Program program{"prepare", {}};
        for (const Id pivot : pivots_)
            if (!g().is_constant(pivot)) program.outputs.push_back({"pivot", pivot});
        p_.programs.push_back(std::move(program));
    }

    // Formulas of the system itself: (D1) ... (D3).
    void mechanics() {
        Ids gradient, p, velocity;
        for (std::size_t k = 0; k < n_; ++k) {
            gradient.push_back(convert(d_.system.gradient[k]));
            p.push_back(in("p", k));
            velocity.push_back(in("velocity", k));
        }
        const Ids rates = times(inverse_mass_, p);
        if (d_.scene.outputs.energy) {
            Ids energy;
            for (std::size_t k = 0; k < n_; ++k)
                energy.push_back(
                    g().raw(Op::multiply, {p[k], g().multiply({g().number(1, 2), rates[k]})}));  // p^2 may overflow
            energy.push_back(convert(d_.system.potential));
            p_.programs.push_back({"energy", {{"return", g().add(energy)}}});
        }
        program("momentum", "p", times(mass_, velocity));
        program("velocity", "velocity", rates);

        const Ids W = times(inverse_mass_, gradient);
        Program node{"node", {}};
        for (std::size_t k = 0; k < n_; ++k) node.outputs.push_back({at("W", k), W[k]});
        for (std::size_t e = 0; e < d_.structure.entries.size(); ++e)
            node.outputs.push_back({at("S", e), stiffness(e, d_.system.hessian)});
        p_.programs.push_back(std::move(node));
        program("acceleration", "W", W);
    }

    // Entry e of M^-1 V'', for the V'' given.
    Id stiffness(std::size_t e, const SparseMatrix& hessian) {
        const auto [row, column] = d_.structure.entries[e];
        Ids terms;
        for (std::size_t l = 0; l < n_; ++l) {
            const Id inverse = inverse_mass_[static_cast<std::size_t>(row)][l];
            if (g().is_number(inverse, 0)) continue;
            const GiNaC::ex entry = hessian(l, static_cast<std::size_t>(column));
            if (!entry.is_zero()) terms.push_back(g().multiply({inverse, convert(entry)}));
        }
        return g().add(terms);
    }

    // The constant part of M^-1 V'', which the quadratic part of V leaves (D31).
    void quadratic_part() {
        Ids values;
        for (std::size_t e = 0; e < d_.structure.entries.size(); ++e)
            values.push_back(stiffness(e, d_.structure.constant_hessian));
        program("quadratic_part", "S0", values);
    }

    // What V leaves without its quadratic part: W - D q without what cancels in it.
    void remainder() {
        std::vector<GiNaC::ex> gradient = d_.system.gradient;
        for (const auto& [place, value] : d_.structure.constant_hessian.entries())
            gradient[static_cast<std::size_t>(place.first)] -=
                value * d_.system.q[static_cast<std::size_t>(place.second)];
        // Expanded where that leaves fewer terms: then some cancelled.
        const auto terms = [](const GiNaC::ex& e) { return GiNaC::is_a<GiNaC::add>(e) ? e.nops() : 1; };
        Ids rest;
        for (const GiNaC::ex& one : gradient) {
            const GiNaC::ex open = expanded(one);
            rest.push_back(convert(terms(open) < terms(one) ? open : one));
        }
        program("remainder", "R", times(inverse_mass_, rest));
    }

    // (D20): the paper's Phi for one coordinate, the shift for a constant force.
    void propagation_of_one() {
        const Propagation exact = propagation(d_.quadrature);
        const Id k = convert(expanded(d_.system.hessian(0, 0)));
        const Id m = mass_[0][0];
        const Id force = g().negate(convert(d_.system.gradient[0].subs(d_.system.q[0] == 0)));
        // The polynomials as locals of prepare(): each is an input to what follows.
        Program prepare_map{"prepare_map", {}};
        const auto local = [&](std::string name, Id value) {
            const auto& inputs = g().inputs();  // a parameter may have the name already
            while (std::any_of(inputs.begin(), inputs.end(), [&](const Input& other) { return other.code == name; }))
                name += "_";
            prepare_map.outputs.push_back({"const real " + name, value});
            return g().input({name, name, Stage::step_size});
        };
        const Id h_by_m = g().multiply({h_, g().power(m, -1)});
        const Id z = local("z", g().multiply({h_by_m, h_, k}));
        const auto polynomial = [&](const std::string& name, const GiNaC::ex& e) {
            return local(name, g().from(e, {{exact.z, z}}));
        };
        const Id inverse_delta = g().power(polynomial("delta", exact.delta), -1);
        // The kernel stores E = Phi - I: for a small step it keeps the digits that Phi would round off.
        const Id a = polynomial("a_minus_delta", (exact.a - exact.delta).expand()), b = polynomial("phi_b", exact.b),
                 c = polynomial("phi_c", exact.c);
        const Ids position = {a, g().multiply({h_by_m, c}),
                              g().multiply({h_, h_by_m, force, g().from(exact.e_q, {{exact.z, z}})})};
        const Ids momentum = {g().multiply({g().power(h_by_m, -1), b}), a,
                              g().multiply({h_, force, g().from(exact.e_p, {{exact.z, z}})})};
        std::size_t index = 0;
        for (const Ids& row : {position, momentum})
            for (const Id entry : row)
                prepare_map.outputs.push_back({at("k.Phi_minus_I", index++), g().multiply({entry, inverse_delta})});
        p_.programs.push_back(std::move(prepare_map));

        const auto row = [&](std::size_t r) {
            Ids terms = {g().multiply({in("k.Phi_minus_I", 3 * r), q_[0]}),
                         g().multiply({in("k.Phi_minus_I", 3 * r + 1), in("p", 0)})};
            if (!g().is_number(force, 0)) terms.push_back(in("k.Phi_minus_I", 3 * r + 2));
            // Small terms first, then the state they are added to.
            return g().raw(Op::add, {r == 0 ? q_[0] : in("p", 0), g().add(terms)});
        };
        p_.programs.push_back({"propagate", {{"q1[0]", row(0)}, {"p1[0]", row(1)}}});
    }

    // The step of a nonlinear system with constant mass: (D11) ... (D17).
    void step() {
        const std::size_t m = s_ - 2, N = n_ * m;
        const auto& entries = d_.structure.entries;
        Ids drift, base;
        for (std::size_t k = 0; k < n_; ++k)
            drift.push_back(g().subtract(in("u", k), g().multiply({hb(0), in("W0", k)})));
        Program drift_program{"drift", {}};
        for (std::size_t k = 0; k < n_; ++k) drift_program.outputs.push_back({at("v", k), drift[k]});
        for (std::size_t i = 1; i < s_; ++i)
            for (std::size_t k = 0; k < n_; ++k)
                drift_program.outputs.push_back({at("base", (i - 1) * n_ + k),
                                                 g().add({q_[k], g().multiply({i + 1 < s_ ? hc(i) : h_, drift[k]})})});
        p_.programs.push_back(std::move(drift_program));

        if (N > 0) {
            Ids simple, extrapolated;
            for (std::size_t i = 0; i < m; ++i) {
                Ids row;
                for (std::size_t j = 0; j < m; ++j) row.push_back(A(i, j));
                const Id sum = named("h2_A" + std::to_string(i + 2), g().multiply({h2(), g().add(row)}));
                Ids weights;  // h^2 (A E)_ij
                for (std::size_t j = 0; j < s_; ++j) {
                    GiNaC::ex weight = 0;
                    for (std::size_t l = 0; l < m; ++l)
                        weight += d_.quadrature.A(static_cast<unsigned>(i), static_cast<unsigned>(l)) *
                                  d_.quadrature.E(static_cast<unsigned>(l), static_cast<unsigned>(j));
                    weights.push_back(named("h2_AE" + std::to_string(i + 2) + std::to_string(j + 1),
                                            g().multiply({h2(), convert(weight.expand())})));
                }
                for (std::size_t k = 0; k < n_; ++k) {
                    simple.push_back(g().subtract(in("base", i * n_ + k), g().multiply({sum, in("W0", k)})));
                    Ids terms{in("base", i * n_ + k)};
                    for (std::size_t j = 0; j < s_; ++j)
                        terms.push_back(g().negate(g().multiply({weights[j], in("W_before", j * n_ + k)})));
                    extrapolated.push_back(g().add(terms));
                }
            }
            program("simple_start", "Q", simple);
            program("extrapolated_start", "Q", extrapolated);

            // (D12) F_i = Q_i - base_i + h^2 sum_j A_ij W_j and (D13) J = I + h^2 A (x) S.
            Ids F;
            for (std::size_t i = 0; i < m; ++i)
                for (std::size_t k = 0; k < n_; ++k) {
                    Ids terms{in("Q", i * n_ + k, Stage::iterate), g().negate(in("base", i * n_ + k))};
                    for (std::size_t j = 0; j < m; ++j)
                        terms.push_back(g().multiply({h2A(i, j), in("W", j * n_ + k, Stage::iterate)}));
                    F.push_back(g().add(terms));
                }
            Rows J(N, Ids(N, g().number(0)));
            for (std::size_t i = 0; i < N; ++i) J[i][i] = g().number(1);
            for (std::size_t i = 0; i < m; ++i)
                for (std::size_t j = 0; j < m; ++j)
                    for (std::size_t e = 0; e < entries.size(); ++e) {
                        Id& entry = J[i * n_ + static_cast<std::size_t>(entries[e].first)]
                                     [j * n_ + static_cast<std::size_t>(entries[e].second)];
                        entry = g().add(
                            {entry, g().multiply({h2A(i, j), in("S", j * entries.size() + e, Stage::iterate)})});
                    }
            program("residual", "F", F);
            Ids flat;
            for (const Ids& row : J) flat.insert(flat.end(), row.begin(), row.end());
            program("jacobian", "J", flat);
            correction(F, J, m);

            Program carry{"carry", {}};
            for (std::size_t j = 0; j < m; ++j)
                for (std::size_t k = 0; k < n_; ++k) {
                    Ids terms{in("W", j * n_ + k, Stage::iterate)};
                    for (std::size_t e = 0; e < entries.size(); ++e)
                        if (static_cast<std::size_t>(entries[e].first) == k)
                            terms.push_back(g().multiply(
                                {in("S", j * entries.size() + e, Stage::iterate),
                                 in("delta", j * n_ + static_cast<std::size_t>(entries[e].second), Stage::iterate)}));
                    carry.outputs.push_back({at("W", j * n_ + k), g().add(terms)});
                }
            p_.programs.push_back(std::move(carry));
        }

        Ids position, rate;
        for (std::size_t k = 0; k < n_; ++k) {
            Ids terms{in("base", (s_ - 2) * n_ + k)}, rates{in("v", k)};
            for (std::size_t j = 0; j < m; ++j) {
                const GiNaC::ex weight = (d_.quadrature.b[j + 1] * (1 - d_.quadrature.c[j + 1])).expand();
                const Id h2d = named("h2_d" + std::to_string(j + 2), g().multiply({h2(), convert(weight)}));
                terms.push_back(g().negate(g().multiply({h2d, in("W", j * n_ + k, Stage::iterate)})));
                rates.push_back(g().negate(g().multiply({hb(j + 1), in("W", j * n_ + k, Stage::iterate)})));
            }
            rates.push_back(g().negate(g().multiply({hb(s_ - 1), in("W1", k)})));
            position.push_back(g().add(terms));
            rate.push_back(g().add(rates));
        }
        program("arrive", "q1", position);
        program("finish", "u1", rate);
    }

    // Newton's correction delta = -J^-1 F, for each independent group of coordinates by itself: Cramer's rule for few
    // unknowns, else J and F of the group for the elimination in the support header.
    void correction(const Ids& F, const Rows& J, std::size_t m) {
        Program program{"correction", {}};
        Ids reciprocals;
        const bool alone = d_.structure.groups.size() == 1;
        for (std::size_t number = 0; number < d_.structure.groups.size(); ++number) {
            std::vector<std::size_t> unknowns;
            for (std::size_t i = 0; i < m; ++i)
                for (const int k : d_.structure.groups[number].coordinates)
                    unknowns.push_back(i * n_ + static_cast<std::size_t>(k));
            std::sort(unknowns.begin(), unknowns.end());
            const bool uncoupled = std::all_of(unknowns.begin(), unknowns.end(), [&](std::size_t i) {
                return std::all_of(J[i].begin(), J[i].end(), [&](Id entry) { return g().is_constant(entry); });
            });
            if (uncoupled) {  // moves uniformly: its start value is exact
                for (const std::size_t i : unknowns) program.outputs.push_back({at("delta", i), g().negate(F[i])});
            } else if (unknowns.size() <= closed_form_limit) {
                reciprocals.push_back(cramer(F, J, unknowns, program));
            } else {
                const std::string mark = alone ? "" : "_" + std::to_string(number + 1);
                for (std::size_t i = 0; i < unknowns.size(); ++i)
                    program.outputs.push_back({at("delta" + mark, i), g().negate(F[unknowns[i]])});
                for (std::size_t i = 0; i < unknowns.size(); ++i)
                    for (std::size_t j = 0; j < unknowns.size(); ++j)
                        program.outputs.push_back(
                            {at("J" + mark, i * unknowns.size() + j), J[unknowns[i]][unknowns[j]]});
                p_.solves.push_back({mark, unknowns});
            }
        }
        for (const Id& reciprocal : reciprocals)
            program.outputs.push_back(
                {&reciprocal == &reciprocals.back() ? "return reciprocal" : "require reciprocal", reciprocal});
        p_.programs.push_back(std::move(program));
    }

    // delta = -adj(J) F / det(J) over some unknowns; the value is 1 / det(J).
    Id cramer(const Ids& F, const Rows& J, const std::vector<std::size_t>& unknowns, Program& program) {
        const std::size_t N = unknowns.size();
        // Each a local of its own: in products written out the powers of h would be hoisted, and overflow or vanish.
        std::map<std::pair<std::size_t, std::size_t>, Id> locals;
        const auto entry = [&](std::size_t row, std::size_t column) {
            const std::size_t r = unknowns[row], c = unknowns[column];
            if (g().is_constant(J[r][c])) return J[r][c];
            const auto [known, is_new] = locals.try_emplace({r, c}, 0);
            if (is_new) {
                const std::string name = "J_" + std::to_string(r + 1) + "_" + std::to_string(c + 1);
                program.outputs.push_back({"const real " + name, J[r][c]});
                known->second = g().input({name, name, Stage::iterate});
            }
            return known->second;
        };
        const auto minor = [&](std::size_t row, std::size_t column) {  // signed cofactor
            std::vector<std::size_t> r, c;
            for (std::size_t i = 0; i < N; ++i) {
                if (i != row) r.push_back(i);
                if (i != column) c.push_back(i);
            }
            Id value = g().number(1);
            if (N == 2) value = entry(r[0], c[0]);
            if (N == 3)
                value = g().subtract(g().multiply({entry(r[0], c[0]), entry(r[1], c[1])}),
                                     g().multiply({entry(r[0], c[1]), entry(r[1], c[0])}));
            return (row + column) % 2 == 0 ? value : g().negate(value);
        };
        Ids terms;
        for (std::size_t j = 0; j < N; ++j) terms.push_back(g().multiply({entry(0, j), minor(0, j)}));
        const Id inverse = named("inverse_determinant", g().power(g().add(terms), -1));
        for (std::size_t i = 0; i < N; ++i) {
            Ids sum;
            for (std::size_t j = 0; j < N; ++j) sum.push_back(g().negate(g().multiply({minor(j, i), F[unknowns[j]]})));
            program.outputs.push_back({at("delta", unknowns[i]), g().multiply({inverse, g().add(sum)})});
        }
        return inverse;
    }

    Ids pivots_;
    Rows mass_, inverse_mass_;
};

}  // namespace

Programs separable_programs(const Derivation& derivation) {
    return SeparableBuilder(derivation).build();
}

}  // namespace lobatto
