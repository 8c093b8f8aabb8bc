// SPDX-License-Identifier: GPL-2.0-or-later
// The mechanical system of a scene: L(q, q', t) and forces, their first and second derivatives, and of what kind they
// are.
//
// Derivatives are taken symbolically, term by term. Whether one vanishes, or depends on q, v or t, is told by its
// values at seeded points to 60 digits: a formula that is zero only after simplification is recognised, and nothing is
// expanded.
#include "generator/mechanics/system/system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "generator/formula/real.hpp"
#include "generator/graph/notation.hpp"
#include "generator/mechanics/algebra/sample.hpp"
#include "generator/mechanics/system/mass_equations.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using GiNaC::exvector;
using Symbols = std::vector<GiNaC::symbol>;

[[noreturn]] void refuse(const Scene& scene, const std::string& reason) {
    scene.source.fail(scene.lagrangian_at, "the Lagrangian " + reason);
}

// The variables that an expression holds, as indices in ascending order.
class Occurrences {
public:
    explicit Occurrences(const Symbols& variables) {
        for (std::size_t i = 0; i < variables.size(); ++i) index_[variables[i]] = i;
    }
    std::set<std::size_t> in(const ex& expression) const {
        std::set<std::size_t> found;
        visit(expression, found);
        return found;
    }

private:
    void visit(const ex& expression, std::set<std::size_t>& found) const {
        if (GiNaC::is_a<GiNaC::symbol>(expression)) {
            if (const auto known = index_.find(expression); known != index_.end()) found.insert(known->second);
            return;
        }
        for (std::size_t i = 0; i < expression.nops(); ++i) visit(expression.op(i), found);
    }
    std::map<ex, std::size_t, GiNaC::ex_is_less> index_;
};

// GiNaC goes through the whole of a substitution at every sum and product: only what occurs is put into it.
ex at(const ex& expression, const Symbols& variables, const Occurrences& occurrences, const ex& value) {
    GiNaC::exmap found;
    for (const std::size_t i : occurrences.in(expression)) found[variables[i]] = value;
    return expression.subs(found, GiNaC::subs_options::no_pattern);
}

// A value that does not depend on what its formula mentions, without it: at the origin, or where that is a pole, beside
// it.
ex without(const ex& value, const Symbols& mentioned, const Occurrences& occurrences) {
    for (const ex& place : {ex(0), ex(GiNaC::numeric(1, 2))}) try {
            return at(value, mentioned, occurrences, place);
        } catch (const std::exception&) {
        }
    GiNaC::exmap apart;
    for (const std::size_t i : occurrences.in(value))
        apart[mentioned[i]] = GiNaC::numeric(1, static_cast<long>(apart.size()) + 3);
    return value.subs(apart, GiNaC::subs_options::no_pattern);
}

void append_terms(const ex& expression, const Occurrences& occurrences, std::vector<ex>& terms) {
    if (GiNaC::is_a<GiNaC::add>(expression)) {
        for (const ex& term : expression) append_terms(term, occurrences, terms);
        return;
    }
    if (GiNaC::is_a<GiNaC::mul>(expression)) {
        exvector free, bound;
        for (const ex& factor : expression) (occurrences.in(factor).empty() ? free : bound).push_back(factor);
        if (bound.size() == 1 && GiNaC::is_a<GiNaC::add>(bound.front())) {
            std::vector<ex> inner;
            append_terms(bound.front(), occurrences, inner);
            const ex coefficient = GiNaC::mul(free);
            for (const ex& term : inner) terms.push_back(coefficient * term);
            return;
        }
    }
    terms.push_back(expression);
}

ex sum_of(const exvector& terms) {
    return terms.empty() ? ex(0) : ex(GiNaC::add(terms));
}

// Which of q, v, t and the inputs the derivatives of a system depend on, from their values at sample points.
class Dependence {
public:
    struct Kind {
        bool zero = true, on_q = false, on_v = false, on_t = false, on_inputs = false;
        bool constant() const { return !on_q && !on_v && !on_t && !on_inputs; }
    };

    Dependence(const Scene& scene, const System& system, const Symbols& motion)
        : scene_(scene), system_(system), motion_(motion) {}

    // What is pieced may jump or bend beyond the sampled points, as x/sqrt(x^2) does: what holds it is taken to depend
    // on all that it mentions. Everything else is analytic: constant near a point is constant.
    bool is_broken(const ex& expression) const {
        for (auto part = expression.preorder_begin(); part != expression.preorder_end(); ++part)
            if (is_pieced(*part) && !motion_.in(*part).empty()) return true;
        return false;
    }
    // Whether something broken holds positions or velocities.
    bool is_bent(const ex& expression) const {
        const std::size_t n = system_.q.size();
        for (auto part = expression.preorder_begin(); part != expression.preorder_end(); ++part)
            if (is_pieced(*part))
                for (const std::size_t variable : motion_.in(*part))
                    if (variable < 2 * n) return true;
        return false;
    }

    std::vector<Kind> of(const std::vector<ex>& expressions) const {
        std::vector<Kind> kinds = sampled(expressions);
        const std::size_t n = system_.q.size();
        for (std::size_t i = 0; i < kinds.size(); ++i) {
            if (!is_broken(expressions[i])) continue;
            kinds[i].zero = false;
            for (const std::size_t variable : motion_.in(expressions[i]))
                (variable < n        ? kinds[i].on_q
                 : variable < 2 * n  ? kinds[i].on_v
                 : variable == 2 * n ? kinds[i].on_t
                                     : kinds[i].on_inputs) = true;
        }
        return kinds;
    }

    std::shared_ptr<const Formulas> formulas() const { return formulas_; }

private:
    std::vector<Kind> sampled(const std::vector<ex>& expressions) const {
        std::vector<Kind> kinds(expressions.size());
        try {
            at_sample_points(scene_, [&](NearStart& point) {
                point.set_all(*formulas_);
                examine(*formulas_, formulas_->convert(expressions), point, kinds);
            });
        } catch (const DomainError& error) {
            refuse(scene_, fmt::format("has no finite real derivatives at or near the start: {}; start away "
                                       "from the singularity, or mend the formula",
                                       error.what()));
        }
        return kinds;
    }

    void examine(Formulas& formulas, const std::vector<Id>& roots, NearStart& point, std::vector<Kind>& kinds) const {
        const std::vector<Sized> all = formulas.evaluate_all_sized(roots);
        const auto here = [&](std::size_t i) -> const Sized& { return all[static_cast<std::size_t>(roots[i])]; };
        const auto moved = [&](const Symbols& symbols, bool Kind::*flag) {
            const std::vector<bool> holding = formulas.holding(roots, symbols);
            std::vector<std::size_t> which;
            std::vector<Id> those;
            for (std::size_t i = 0; i < roots.size(); ++i)
                if (holding[i]) {
                    which.push_back(i);
                    those.push_back(roots[i]);
                }
            if (those.empty()) return;
            std::vector<cln::cl_R> before;
            for (const GiNaC::symbol& symbol : symbols) {
                before.push_back(formulas.get(symbol));
                formulas.set(symbol, point.near(before.back()));
            }
            const std::vector<Sized> there = formulas.evaluate_sized(those);
            for (std::size_t i = 0; i < those.size(); ++i)
                if (!here(which[i]).equals(there[i])) kinds[which[i]].*flag = true;
            for (std::size_t k = 0; k < symbols.size(); ++k) formulas.set(symbols[k], before[k]);
        };
        // What a term depends on counts also where the term is too small to be seen.
        const std::vector<GiNaC::exset> hidden = formulas.hidden(roots, all);
        const auto hides = [&](std::size_t i, const Symbols& symbols) {
            return !hidden[i].empty() &&
                   std::any_of(symbols.begin(), symbols.end(), [&](const auto& s) { return hidden[i].contains(s); });
        };
        for (std::size_t i = 0; i < kinds.size(); ++i) {
            if (!here(i).vanishes() || !hidden[i].empty()) kinds[i].zero = false;
            kinds[i].on_q |= hides(i, system_.q);
            kinds[i].on_v |= hides(i, system_.v);
            kinds[i].on_t |= hides(i, {system_.t});
            kinds[i].on_inputs |= hides(i, system_.inputs);
        }
        moved(system_.q, &Kind::on_q);
        moved(system_.v, &Kind::on_v);
        moved({system_.t}, &Kind::on_t);
        if (!system_.inputs.empty()) moved(system_.inputs, &Kind::on_inputs);
    }

    const Scene& scene_;
    const System& system_;
    const Occurrences motion_;  // q, v, t, inputs
    const std::shared_ptr<Formulas> formulas_ = std::make_shared<Formulas>();
};

// Refuses a mass matrix that is singular near the start.
void check_mass(const Scene& scene, const System& system) {
    for (int attempt = 0;; ++attempt) {
        try {
            Formulas formulas;
            NearStart(scene, attempt).set_all(formulas);
            MassEquations equations(system, formulas);
            const Elimination elimination = equations.eliminate({});
            if (!elimination.singular) break;
            if (const std::string dependent = equations.dependent_constraints(elimination); !dependent.empty())
                scene.source.fail(system.constraints.front().at, dependent);
            refuse(scene,
                   "is degenerate: its second derivatives in the velocities form a singular matrix, so velocities "
                   "do not follow from momenta. No kinetic energy opposes the direction " +
                       direction_text(system, elimination.vector) + "; add the missing mass, or remove a coordinate");
        } catch (const DomainError&) {
            if (attempt == sample_attempts) throw;
        }
    }
}

std::string slope_text(const std::string& of, const GiNaC::symbol& by, const ex& value) {
    std::string text = canonical_text(value);
    if (text.size() > 200) text = "a formula of " + std::to_string(text.size()) + " characters";
    return "d" + of + "/d" + by.get_name() + " = " + text;
}

}  // namespace

std::string direction_text(const System& system, const std::vector<cln::cl_R>& direction) {
    std::string text;
    int shown = 0;
    for (std::size_t k = 0; k < system.v.size(); ++k) {
        if (cln::abs(direction[k]) < cln::expt(cln::cl_RA(10), -30)) continue;
        if (++shown > 8) return text + ", ...";
        text += (text.empty() ? "" : ", ") + system.v[k].get_name() + " = " + decimal(direction[k], 6);
    }
    return text;
}

std::vector<ex> terms_of(const ex& expression, const Symbols& variables) {
    std::vector<ex> terms;
    append_terms(expression, Occurrences(variables), terms);
    return terms;
}

std::vector<ex> all_at(const std::vector<ex>& expressions, const Symbols& variables, const ex& value) {
    const Occurrences occurrences(variables);
    std::vector<ex> result;
    for (const ex& expression : expressions) result.push_back(at(expression, variables, occurrences, value));
    return result;
}

std::vector<ex> gradient_of(const std::vector<ex>& terms, const Symbols& variables) {
    const Occurrences occurrences(variables);
    std::vector<exvector> parts(variables.size());
    for (const ex& term : terms)
        for (const std::size_t i : occurrences.in(term)) parts[i].push_back(term.diff(variables[i]));
    std::vector<ex> gradient;
    for (const exvector& part : parts) gradient.push_back(sum_of(part));
    return gradient;
}

SparseMatrix derivative_of(const std::vector<ex>& vector, const Symbols& variables) {
    const Occurrences occurrences(variables);
    SparseMatrix result(static_cast<int>(vector.size()), static_cast<int>(variables.size()));
    for (std::size_t k = 0; k < vector.size(); ++k) {
        std::vector<ex> terms;
        append_terms(vector[k], occurrences, terms);
        std::map<std::size_t, exvector> parts;
        for (const ex& term : terms)
            for (const std::size_t i : occurrences.in(term)) parts[i].push_back(term.diff(variables[i]));
        for (const auto& [i, part] : parts) {
            const ex value = sum_of(part);
            if (!value.is_zero()) result.put(static_cast<int>(k), static_cast<int>(i), value);
        }
    }
    return result;
}

namespace {

bool mentions(const System& system, const GiNaC::symbol& t) {
    const auto has = [&](const ex& e) { return e.has(t); };
    return has(system.lagrangian) || std::any_of(system.outer_force.begin(), system.outer_force.end(), has);
}

// Builds a System in the order of its parts; what a part finds against the separable form is kept as the reason.
class SystemBuilder {
public:
    SystemBuilder(const Scene& scene, bool writes_all) : scene_(scene), writes_all_(writes_all) {}

    System build() {
        differentiate_once();
        const std::array<SparseMatrix, 4> derived = {
            derivative_of(system_.momentum, system_.v), derivative_of(system_.momentum, system_.q),
            derivative_of(system_.force, system_.v), derivative_of(system_.force, system_.q)};
        // Derivatives and first-order quantities together, each with what it depends on.
        std::vector<ex> expressions = system_.momentum;
        expressions.insert(expressions.end(), system_.force.begin(), system_.force.end());
        const std::size_t first_order = expressions.size();
        for (const SparseMatrix& matrix : derived)
            for (const auto& [place, value] : matrix.entries()) expressions.push_back(value);
        const Dependence dependence(scene_, system_, motion_);
        const std::vector<Dependence::Kind> kinds = dependence.of(expressions);

        system_.formulas = dependence.formulas();
        keep_second_order(derived, {kinds.begin() + static_cast<std::ptrdiff_t>(first_order), kinds.end()});
        keep_first_order(kinds, dependence);
        // What is watched is given the time, as all else is.
        for (const Event& event : scene_.watched()) watch_time(event.value);
        for (const Impact& impact : scene_.impacts)
            for (const auto* reset : {&impact.reset_position, &impact.reset_velocity})
                for (const ex& value : *reset) watch_time(value);
        if (system_.autonomous && mentions(system_, system_.t))
            return SystemBuilder(without_time(scene_), writes_all_).build();
        check_mass(scene_, system_);
        if (system_.separable) check_rest(dependence);
        system_.constant_mass = system_.separable;
        if (!system_.constraints.empty())
            refuse_separable("the constraint " + system_.constraints.front().written + " pulls on coordinates");
        if (system_.separable) keep_separable_parts();
        return may_stay_unwritten() ? system_ : SystemBuilder(scene_, true).build();
    }

private:
    void watch_time(const ex& value) {
        if (value.has(system_.t)) system_.autonomous = false;
    }
    void differentiate_once() {
        system_ = undifferentiated(scene_);
        motion_ = system_.motion();
        system_.terms = terms_of(system_.lagrangian, motion_);
        std::vector<ex> written = system_.terms;
        if (!writes_all_) system_.unwritten = set_apart(scene_, system_, written);
        system_.momentum = gradient_of(written, system_.v);
        system_.force = gradient_of(written, system_.q);
        for (std::size_t k = 0; k < system_.force.size(); ++k) system_.force[k] += system_.outer_force[k];
        system_.linear = system_.unwritten.empty();
        system_.separable = true;
        differentiate_constraints();
    }

    void differentiate_constraints() {
        system_.constraints = scene_.constraints;
        if (system_.constraints.empty()) return;
        std::vector<ex> values;
        for (const Constraint& constraint : system_.constraints) {
            values.push_back(constraint.value);
            system_.constraint_t.push_back(constraint.value.diff(system_.t));
            if (constraint.value.has(system_.t)) system_.autonomous = false;
        }
        system_.constraint_q = derivative_of(values, system_.q);
        system_.linear = false;
    }

    // dp/dv, dp/dq, df/dv, df/dq, whose entries are of these kinds, one after another.
    void keep_second_order(const std::array<SparseMatrix, 4>& derived, const std::vector<Dependence::Kind>& kinds) {
        const std::array<SparseMatrix*, 4> kept = {&system_.momentum_v, &system_.momentum_q, &system_.force_v,
                                                   &system_.force_q};
        const Occurrences of_motion(motion_);
        std::size_t next = 0;
        for (std::size_t block = 0; block < derived.size(); ++block) {
            *kept[block] = SparseMatrix(system_.n, system_.n);
            for (const auto& [place, value] : derived[block].entries()) {
                const Dependence::Kind& kind = kinds[next++];
                if (kind.zero) continue;
                const bool constant = kind.constant();
                const ex kept_value = constant ? without(value, motion_, of_motion) : value;
                kept[block]->put(place.first, place.second, kept_value);
                system_.linear = system_.linear && constant;
                if (system_.separable) check_second_order(block, place, kept_value, kind, constant);
            }
        }
    }

    void check_second_order(std::size_t block, const std::pair<int, int>& place, const ex& value,
                            const Dependence::Kind& kind, bool constant) {
        const std::string of = (block < 2 ? "p_" : "f_") + coordinate_of(static_cast<std::size_t>(place.first));
        const GiNaC::symbol& by =
            (block == 0 || block == 2 ? system_.v : system_.q)[static_cast<std::size_t>(place.second)];
        const auto text = [&] { return slope_text(of, by, value); };
        if (block == 0 && !constant)
            refuse_separable(text() + (kind.on_v   ? " depends on the velocity"
                                       : kind.on_q ? " depends on the position"
                                       : kind.on_t ? " depends on the time"
                                                   : " depends on an input"));
        if (block == 1) refuse_separable(text() + ": the momentum depends on the position");
        if (block == 2) refuse_separable(text() + ": the force depends on the velocity");
    }

    // Momenta, then forces, of these kinds.
    void keep_first_order(const std::vector<Dependence::Kind>& kinds, const Dependence& dependence) {
        const std::size_t n = system_.momentum.size();
        for (std::size_t i = 0; i < n + system_.force.size(); ++i) {
            ex& value = i < n ? system_.momentum[i] : system_.force[i - n];
            if (kinds[i].zero) value = 0;
            if (kinds[i].on_t) system_.autonomous = false;
            if (!dependence.is_bent(value)) continue;
            system_.linear = false;
            if (kinds[i].on_v && i >= n)
                refuse_separable("f_" + coordinate_of(i - n) + ": the force depends on the velocity");
        }
    }

    // Terms linear in the velocities with coefficients free of positions: p = M v + a(t).
    void check_rest(const Dependence& dependence) {
        std::vector<ex> at_zero;
        try {
            at_zero = all_at(system_.momentum, system_.v, 0);
            all_at({system_.lagrangian}, system_.v, 0);
        } catch (const std::domain_error&) {  // however small, a term that is infinite at rest, or 0^0
            refuse_separable("the Lagrangian has no value at rest");
            return;
        }
        const std::vector<Dependence::Kind> rest = dependence.of(at_zero);
        for (std::size_t k = 0; k < rest.size(); ++k)
            if (!rest[k].zero && system_.separable)
                refuse_separable("p_" + coordinate_of(k) + " = " + canonical_text(at_zero[k]) + " at rest");
    }

    void keep_separable_parts() {
        // Forces that do not depend on velocities may mention them, as turns do: cos^2 + sin^2 is no 1 for GiNaC.
        const Occurrences of_v(system_.v);
        const auto freed = [&](const ex& value) { return without(value, system_.v, of_v); };
        system_.mass = system_.momentum_v;
        system_.potential = -at(system_.lagrangian, system_.v, of_v, 0);
        system_.hessian = SparseMatrix(system_.n, system_.n);
        for (const ex& force : system_.force) system_.gradient.push_back(-freed(force));
        for (const auto& [place, value] : system_.force_q.entries())
            system_.hessian.put(place.first, place.second, -freed(value));
    }

    // What is written must not take away what is not.
    bool may_stay_unwritten() const {
        const Unwritten& unwritten = system_.unwritten;
        if (unwritten.empty()) return true;
        if (!system_.separable) return false;
        for (const auto& [place, value] : system_.force_q.entries()) {
            const auto known = std::lower_bound(unwritten.places.begin(), unwritten.places.end(), place);
            if (known == unwritten.places.end() || *known != place) continue;
            const int witness = unwritten.witnesses[static_cast<std::size_t>(known - unwritten.places.begin())];
            if (value.has(system_.q[static_cast<std::size_t>(witness)])) return false;
        }
        return true;
    }

    std::string coordinate_of(std::size_t k) const { return system_.q[k].get_name(); }

    // The first reason is told.
    void refuse_separable(const std::string& why) {
        if (system_.separable) system_.not_separable = why;
        system_.separable = false;
    }

    const Scene& scene_;
    const bool writes_all_;
    System system_;
    Symbols motion_;  // positions, velocities, time and inputs
};

}  // namespace

Scene without_time(const Scene& scene) {
    const Symbols time{scene.time};
    const Occurrences occurrences(time);
    const auto still = [&](const ex& value) { return without(value, time, occurrences); };
    Scene result = scene;
    result.lagrangian = still(scene.lagrangian);
    for (Coordinate& coordinate : result.coordinates) coordinate.force = still(coordinate.force);
    return result;
}

System undifferentiated(const Scene& scene) {
    System system;
    system.n = static_cast<int>(scene.coordinates.size());
    system.t = scene.time;
    for (const Coordinate& coordinate : scene.coordinates) {
        system.q.push_back(coordinate.position);
        system.v.push_back(coordinate.velocity);
        system.outer_force.push_back(coordinate.force);
    }
    for (const Parameter& parameter : scene.parameters) system.parameters.push_back(parameter.symbol);
    system.inputs = scene.inputs();
    system.lagrangian = scene.lagrangian;
    return system;
}

std::vector<GiNaC::symbol> SystemOutline::motion() const {
    Symbols all = q;
    all.insert(all.end(), v.begin(), v.end());
    all.push_back(t);
    all.insert(all.end(), inputs.begin(), inputs.end());
    return all;
}

bool SystemOutline::has_forces() const {
    return std::any_of(outer_force.begin(), outer_force.end(), [](const GiNaC::ex& F) { return !F.is_zero(); });
}

System build_system(const Scene& scene) {
    return SystemBuilder(scene, true).build();
}

System build_short_system(const Scene& scene) {
    return SystemBuilder(scene, false).build();
}

}  // namespace lobatto
