// SPDX-License-Identifier: GPL-2.0-or-later
// The programs of systems with a constant mass matrix: their mechanics (D1 ... D3) and, of one linear coordinate, the
// step as an affine map (D20).
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
IdMatrix invert(Graph& graph, IdMatrix matrix, Ids& pivots) {
    const std::size_t n = matrix.size();
    IdMatrix result(n, Ids(n, graph.number(0)));
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
        if (d_.structure.form() == StepForm::linear_map) {
            if (n_ == 1) propagation_of_one();
        } else if (d_.structure.diagonal_part() || d_.structure.absorbed()) {
            quadratic_part();
        }
        velocities_as_inputs();
        events();
        return std::move(p_);
    }

private:
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
        if (d_.scene.has_energy()) {
            Ids energy;
            for (std::size_t k = 0; k < n_; ++k)
                energy.push_back(
                    g().raw(Op::multiply, {p[k], g().multiply({g().number(1, 2), rates[k]})}));  // p^2 may overflow
            energy.push_back(convert(d_.system.potential));
            p_.programs.push_back({"energy", {{"", g().add(energy), Effect::give_back}}});
        }
        program("momentum", "p", times(mass_, velocity));
        program("velocity", "velocity", rates);

        const Ids W = times(inverse_mass_, gradient);
        Program node{"node", {}};
        for (std::size_t k = 0; k < n_; ++k) node.outputs.push_back({at("W", k), W[k]});
        for (std::size_t e = 0; e < d_.structure.constant_mass().entries.size(); ++e)
            node.outputs.push_back({at("S", e), stiffness(e, d_.system.hessian)});
        p_.programs.push_back(std::move(node));
        program("minus_acceleration", "W", W);
    }

    // Entry e of M^-1 V'', for the V'' given.
    Id stiffness(std::size_t e, const SparseMatrix& hessian) {
        const auto [row, column] = d_.structure.constant_mass().entries[e];
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
        for (std::size_t e = 0; e < d_.structure.constant_mass().entries.size(); ++e)
            values.push_back(stiffness(e, d_.structure.separable().constant_hessian));
        program("quadratic_part", "S0", values);
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
            prepare_map.outputs.push_back({name, value, Effect::declare});
            return g().input({name, name, Phase::step_size});
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

    Ids pivots_;
    IdMatrix mass_, inverse_mass_;
};

}  // namespace

Programs separable_programs(const Derivation& derivation) {
    return SeparableBuilder(derivation).build();
}

}  // namespace lobatto
