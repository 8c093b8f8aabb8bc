// SPDX-License-Identifier: GPL-2.0-or-later
// The mechanical system of a scene: L(q, q', t) and forces, their first and second derivatives, and of what kind they
// are.
//
// Derivatives are taken symbolically, term by term (derivatives.cpp). Whether one vanishes, or depends on q, v or t, is
// told by its values at seeded points to 60 digits (dependence.cpp): a formula that is zero only after simplification
// is recognised, and nothing is expanded.
#include "generator/mechanics/system/system.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "generator/formula/real.hpp"
#include "generator/graph/notation.hpp"
#include "generator/mechanics/algebra/summands.hpp"
#include "generator/mechanics/system/dependence.hpp"
#include "generator/mechanics/system/mass_equations.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using Symbols = std::vector<GiNaC::symbol>;

// Whether this direction is that of the velocity, which no energy opposes where L is homogeneous of degree 1.
bool is_along_velocity(const System& system, Formulas& formulas, const std::vector<cln::cl_R>& direction) {
    ex rest = -system.lagrangian;  // v . dL/dv - L
    for (std::size_t k = 0; k < system.v.size(); ++k) rest += system.v[k] * system.momentum[k];
    if (!formulas.evaluate_sized(formulas.convert({rest})).front().vanishes()) return false;
    cln::cl_R product = 0, size = 0, length = 0;
    for (std::size_t k = 0; k < system.v.size(); ++k) {
        const cln::cl_R v = formulas.get(system.v[k]);
        product = product + v * direction[k];
        size = size + v * v;
        length = length + direction[k] * direction[k];
    }
    return system.constraints.empty() &&
           cln::abs(product * product - size * length) < cln::expt(cln::cl_RA(10), -30) * size * length;
}

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
            if (system.momentum_v.entries().empty())
                refuse_lagrangian(scene,
                                  "is degenerate: it is linear in the velocities, as phase-space and guiding-centre "
                                  "Lagrangians are, whose momenta tell no velocity; write the motion with its kinetic "
                                  "energy");
            if (is_along_velocity(system, formulas, elimination.vector))
                refuse_lagrangian(
                    scene,
                    "is degenerate: twice the velocity makes it twice as large, as the length of a path, so "
                    "no velocity follows from momenta. Take its square, which has the same paths");
            refuse_lagrangian(
                scene,
                "is degenerate: its second derivatives in the velocities form a singular matrix, so velocities "
                "do not follow from momenta. No kinetic energy opposes the direction " +
                    direction_text(system, elimination.vector) + "; add the missing mass, or remove a coordinate");
        } catch (const DomainError&) {
            if (attempt == sample_attempts) throw;
        }
    }
}

std::string slope_text(const std::string& of, const GiNaC::symbol& by, const ex& value) {
    return "d" + of + "/d" + by.get_name() + " = " + short_text(value);
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
    system.constraints = scene.constraints;
    return system;
}

std::vector<std::vector<ex>> System::constraint_summands() const {
    std::vector<std::vector<ex>> summands;
    for (const Constraint& constraint : constraints) summands.push_back(summands_of(constraint.value));
    return summands;
}

std::vector<std::vector<ex>> System::momentum_summands() const {
    std::vector<std::vector<ex>> summands;
    for (const ex& p : momentum) summands.push_back(summands_of(p));
    return summands;
}

bool System::momenta_cancel() const {
    try {
        const std::vector<ex> rest = all_at(momentum, v, 0);
        std::vector<ex> summands;
        for (std::size_t k = 0; k < momentum.size(); ++k)
            if (rest[k].is_zero())
                for (const ex& summand : summands_of(momentum[k])) summands.push_back(summand);
        summands = all_at(summands, v, 0);
        return !std::all_of(summands.begin(), summands.end(), [](const ex& summand) { return summand.is_zero(); });
    } catch (const std::exception&) {  // no value at rest
        return false;
    }
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
