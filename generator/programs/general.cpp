// SPDX-License-Identifier: GPL-2.0-or-later
// The programs of any other Lagrangian: one node's slopes and second derivatives in z = (v, q, P), from which the
// support header assembles the equations of a step (D25 ... D30).
#include "generator/mechanics/algebra/sample.hpp"
#include "generator/mechanics/structure/scaled_mass.hpp"
#include "generator/programs/builder.hpp"
#include "generator/programs/identifier.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

class GeneralBuilder : public ProgramBuilder {
public:
    using ProgramBuilder::ProgramBuilder;

    Programs build() {
        node();
        velocities_as_inputs();
        mechanics();
        if (d_.structure.hamiltonian()) hamiltonian(*d_.structure.hamiltonian());
        events();
        return std::move(p_);
    }

private:
    // g = dR/dz with the forces beside dR/dq, and its derivative.
    void node() {
        const Routhian& routhian = d_.structure.routhian();
        const std::size_t active = routhian.active.size(), multipliers = routhian.multipliers.size();
        const GiNaC::exmap before = symbols_;
        for (std::size_t c = 0; c < multipliers; ++c) {
            const std::size_t i = routhian.z.size() - multipliers + c;
            symbols_[routhian.z[i]] = g().input({at("z", i), routhian.z[i].get_name(), Phase::iterate, 0.1});
        }
        for (std::size_t i = 0; i + multipliers < routhian.z.size(); ++i) {
            const std::size_t kind = i / active;  // 0: v, 1: q, 2: P
            const std::vector<int>& coordinates = kind < 2 ? routhian.active : routhian.cyclic;
            const auto k = static_cast<std::size_t>(coordinates[i - std::min<std::size_t>(kind, 2) * active]);
            const std::string& name = d_.scene.coordinates[k].name;
            const std::string shown = kind == 0 ? name + "_dot" : kind == 1 ? name : "p_" + name;
            symbols_[routhian.z[i]] =
                g().input({at("z", i), shown, Phase::iterate, kind == 1 ? g().input_of(q_[k]).start : 0.1});
        }
        Ids slopes;
        for (const ex& slope : routhian.gradient) slopes.push_back(convert(slope));
        Program node{"node", {}};
        for (std::size_t i = 0; i < slopes.size(); ++i) node.outputs.push_back({at("g", i), slopes[i]});
        std::size_t e = 0;
        for (const auto& [place, value] : routhian.second.entries())
            node.outputs.push_back({at("H", e++), convert(value)});
        p_.programs.push_back(std::move(node));
        program("slope", "g", slopes);
        symbols_ = before;
    }

    // For the host: all coordinates, in (q, velocity).
    void mechanics() {
        Ids momentum, force;
        for (const ex& value : d_.system.momentum) momentum.push_back(convert(value));
        for (const ex& value : d_.system.force) force.push_back(convert(value));
        Program slopes{"slopes", {}}, legendre{"legendre", {}}, stage{"stage", {}};
        for (std::size_t k = 0; k < n_; ++k) slopes.outputs.push_back({at("Lv", k), momentum[k]});
        for (std::size_t k = 0; k < n_; ++k) slopes.outputs.push_back({at("Lq", k), force[k]});
        stage.outputs = slopes.outputs;
        p_.programs.push_back(std::move(slopes));
        const auto& bodies = d_.structure.hamiltonian();
        program("momentum", "p", bodies ? momentum_of(*bodies) : momentum);
        for (std::size_t k = 0; k < n_; ++k) legendre.outputs.push_back({at("p", k), momentum[k]});
        std::size_t e = 0;
        const bool scaled = uses_scaled_mass(d_.scene, d_.system, d_.structure);
        for (const auto& [place, value] : d_.system.momentum_v.entries()) {
            legendre.outputs.push_back({at("M", e), convert(value)});
            if (!scaled)
                stage.outputs.push_back({at("M", e), convert(value)});
            else if (e == 0)
                stage.outputs.push_back({at("M", e), convert(GiNaC::pow(value, -1))});
            ++e;
        }
        p_.programs.push_back(std::move(legendre));
        if (!bodies && d_.system.momenta_cancel()) summands("momentum_summands", d_.system.momentum_summands());
        if (!bodies) p_.programs.push_back(std::move(stage));
        constraints();
        if (d_.scene.clock) p_.programs.push_back({"clock", {{"", convert(d_.scene.clock->rate), Effect::give_back}}});
        if (d_.scene.has_energy() || d_.scene.clock)
            p_.programs.push_back({"energy", {{"", energy(), Effect::give_back}}});
    }

    // Of vectors x in the coordinates, one for each k: (q e_k) . x for quaternions, x for others.
    Ids along_bodies(const Hamiltonian& bodies, const Ids& x) {
        Ids result = x;
        for (const auto& places : bodies.quaternions)
            for (std::size_t k = 0; k < 4; ++k) {
                Ids terms;
                for (std::size_t j = 0; j < 4; ++j)
                    terms.push_back(signed_product(quaternion_product[k][j], places, q_, x[places[j]]));
                result[places[k]] = g().add(terms);
            }
        return result;
    }
    // The transpose: sum_k (q e_k)_j x_k.
    Ids across_bodies(const Hamiltonian& bodies, const Ids& x) {
        Ids result = x;
        for (const auto& places : bodies.quaternions)
            for (std::size_t j = 0; j < 4; ++j) {
                Ids terms;
                for (std::size_t k = 0; k < 4; ++k)
                    terms.push_back(signed_product(quaternion_product[k][j], places, q_, x[places[k]]));
                result[places[j]] = g().add(terms);
            }
        return result;
    }
    Id signed_product(const Signed& part, const std::array<std::size_t, 4>& places, const Ids& q, Id x) {
        const Id product = g().multiply({q[places[part.place]], x});
        return part.sign > 0 ? product : g().negate(product);
    }
    Ids times(const SparseMatrix& matrix, const Ids& x) {
        std::vector<Ids> terms(n_);
        for (const auto& [place, value] : matrix.entries())
            terms[static_cast<std::size_t>(place.first)].push_back(
                g().multiply({convert(value), x[static_cast<std::size_t>(place.second)]}));
        Ids result;
        for (const Ids& row : terms) result.push_back(g().add(row));
        return result;
    }

    // Each part of a quaternion by n.
    Ids by_length(const Hamiltonian& bodies, Ids x) {
        for (const auto& places : bodies.quaternions) {
            Ids squares;
            for (const std::size_t place : places) squares.push_back(g().power(q_[place], 2));
            const Id inverse = g().power(g().add(squares), -1);
            for (const std::size_t place : places) x[place] = g().multiply({inverse, x[place]});
        }
        return x;
    }
    // w = B^T q' / n
    Ids quasi_velocities(const Hamiltonian& bodies) { return by_length(bodies, along_bodies(bodies, velocity_)); }

    // (D62) p = B J w / n.
    Ids momentum_of(const Hamiltonian& bodies) {
        return by_length(bodies, across_bodies(bodies, times(bodies.mass, quasi_velocities(bodies))));
    }

    // (D62) q' = B N B^T p, and F = -dH/dq: of a quaternion sum_k w_k p e_k, the first part negative.
    void hamiltonian(const Hamiltonian& bodies) {
        Program prepare{"prepare", {}};
        for (const ex& pivot : bodies.pivots)
            if (const Id id = convert(pivot); !g().is_constant(id)) prepare.outputs.push_back({"pivot", id});
        p_.programs.push_back(std::move(prepare));
        Ids p, force;
        for (std::size_t k = 0; k < n_; ++k) p.push_back(in("p", k));
        program("velocity", "velocity", across_bodies(bodies, times(bodies.inverse, along_bodies(bodies, p))));
        const Ids w = quasi_velocities(bodies);
        for (const ex& at_rest : bodies.force) force.push_back(convert(at_rest));
        for (const auto& places : bodies.quaternions)
            for (std::size_t j = 0; j < 4; ++j) {
                Ids terms{force[places[j]], g().negate(g().multiply({p[places[j]], w[places[0]]}))};
                for (std::size_t k = 1; k < 4; ++k)
                    terms.push_back(signed_product(quaternion_product[k][j], places, p, w[places[k]]));
                force[places[j]] = g().add(terms);
            }
        program("force", "F", force);
    }

    // (D44) phi, dphi/dt and G.
    void constraints() {
        if (d_.system.constraints.empty()) return;
        Program program{"constraint", {}};
        std::size_t c = 0, e = 0;
        for (const Constraint& constraint : d_.system.constraints)
            program.outputs.push_back({at("phi", c++), convert(constraint.value)});
        c = 0;
        for (const ex& rate : d_.system.constraint_t) program.outputs.push_back({at("phi_t", c++), convert(rate)});
        for (const auto& [place, slope] : d_.system.constraint_q.entries())
            program.outputs.push_back({at("G", e++), convert(slope)});
        p_.programs.push_back(std::move(program));
        summands("constraint_summands", d_.system.constraint_summands());
        multiplier_terms();
    }

    // In an order that is the same everywhere.
    void summands(const std::string& name, const std::vector<std::vector<ex>>& of_all) {
        Program program{name, {}};
        std::size_t e = 0;
        for (const std::vector<ex>& of_one : of_all) {
            Ids ids;
            for (const ex& summand : of_one) ids.push_back(convert(summand));
            for (Id& id : ids) {
                const Id other = g().negate(id);
                const bool is_sum = g()[id].op == Op::add && g()[other].op == Op::add;
                if (g().is_negative(id) || (is_sum && g().compare(other, id) < 0)) id = other;
            }
            std::sort(ids.begin(), ids.end(), [this](Id a, Id b) { return g().compare(a, b) < 0; });
            for (const Id id : ids) program.outputs.push_back({at("T", e++), id});
        }
        p_.programs.push_back(std::move(program));
    }

    // (D49) The right sides of the equations for accelerations and multipliers.
    void multiplier_terms() {
        const System& system = d_.system;
        std::vector<ex> motion = system.force, kept;
        for (std::size_t k = 0; k < n_; ++k) motion[k] -= system.momentum[k].diff(system.t);
        for (const auto& [place, slope] : system.momentum_q.entries())
            motion[static_cast<std::size_t>(place.first)] -= slope * system.v[static_cast<std::size_t>(place.second)];
        std::vector<ex> rates = system.constraint_t;  // dphi/dt along the motion
        for (const auto& [place, slope] : system.constraint_q.entries())
            rates[static_cast<std::size_t>(place.first)] += slope * system.v[static_cast<std::size_t>(place.second)];
        for (const ex& rate : rates) {
            ex sum = -rate.diff(system.t);
            for (std::size_t k = 0; k < n_; ++k) sum -= rate.diff(system.q[k]) * system.v[k];
            kept.push_back(sum);
        }
        Program program{"multiplier_terms", {}};
        for (std::size_t k = 0; k < n_; ++k) program.outputs.push_back({at("r", k), convert(motion[k])});
        for (std::size_t c = 0; c < kept.size(); ++c) program.outputs.push_back({at("s", c), convert(kept[c])});
        p_.programs.push_back(std::move(program));
    }

    std::vector<GiNaC::symbol> motion_symbols() const {
        std::vector<GiNaC::symbol> all = d_.system.q;
        all.insert(all.end(), d_.system.v.begin(), d_.system.v.end());
        return all;
    }

    // (D26) H = v . dL/dv - L, term by term: a term of degree d in the velocities gives d - 1 times itself, so that no
    // kinetic energy is subtracted from its double.
    Id energy() {
        const std::vector<ex> terms =
            d_.scene.clock ? terms_of(d_.scene.clock->lagrangian, motion_symbols()) : d_.system.terms;
        const std::size_t moving = n_ - (d_.scene.has_time_coordinate() ? 1 : 0);
        std::vector<ex> radial;  // v . d(term)/dv
        for (const ex& term : terms) {
            const std::vector<ex> slopes = gradient_of({term}, d_.system.v);
            ex sum = 0;
            for (std::size_t k = 0; k < moving; ++k)
                if (!slopes[k].is_zero()) sum += d_.system.v[k] * slopes[k];
            radial.push_back(sum);
        }
        const std::vector<int> degrees = degrees_of(terms, radial);
        Ids sum;
        for (std::size_t i = 0; i < terms.size(); ++i)
            sum.push_back(degrees[i] >= 0 ? g().multiply({g().number(degrees[i] - 1), convert(terms[i])})
                                          : g().subtract(convert(radial[i]), convert(terms[i])));
        return g().add(sum);
    }

    // The degree of each term, 0 to 4; -1 when it has none: v . d(term)/dv = degree * term at sample points.
    std::vector<int> degrees_of(const std::vector<ex>& terms, const std::vector<ex>& radial) {
        std::vector<int> degrees(terms.size(), -2);
        at_sample_points(d_.scene, [&](NearStart& point) {
            Formulas formulas;
            point.set_all(formulas);
            const std::vector<Sized> values = formulas.evaluate_sized(formulas.convert(terms)),
                                     products = formulas.evaluate_sized(formulas.convert(radial));
            for (std::size_t i = 0; i < terms.size(); ++i) {
                int here = -1;
                for (int degree = 0; degree <= 4; ++degree)
                    if (products[i].equals({values[i].value * degree, values[i].size * degree})) here = degree;
                degrees[i] = degrees[i] == -2 || degrees[i] == here ? here : -1;
            }
        });
        return degrees;
    }
};

}  // namespace

Programs general_programs(const Derivation& derivation) {
    return GeneralBuilder(derivation).build();
}

}  // namespace lobatto
