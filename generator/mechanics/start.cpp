// SPDX-License-Identifier: GPL-2.0-or-later
// Whether a motion can begin where a scene lets it begin.
#include "generator/mechanics/start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "generator/graph/notation.hpp"
#include "generator/mechanics/algebra/sample.hpp"
#include "generator/mechanics/clock/clock.hpp"
#include "generator/mechanics/constraints/constrained_start.hpp"
#include "generator/mechanics/constraints/impacts.hpp"
#include "generator/mechanics/repeated/elements.hpp"
#include "generator/mechanics/start_domains.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using Numbers = std::vector<cln::cl_R>;

std::size_t unsigned_index(int index) {
    return static_cast<std::size_t>(index);
}

class StartCheck {
public:
    StartCheck(const Scene& scene, const System& system)
        : scene_(scene),
          system_(system),
          start_(as_given(scene, *system.formulas)),
          equations_(system, start_),
          constrained_(scene, system, start_, equations_) {}

    void require_formulas() {
        require_domains(scene_, system_, start_);
        require_equations();
    }

    // Coordinates that are eliminated start as their equations say.
    void require_equations() {
        if (scene_.run.assemble) return;
        for (const Eliminated& x : scene_.eliminated) {
            if (x.coordinate.follows) continue;
            require_equation(x, x.position, x.initial_position, "position");
            require_equation(x, x.velocity, x.initial_velocity, "velocity");
        }
    }

    void run() {
        require_values();
        require_formulas();
        if (!system_.constraints.empty()) {
            require_mass();
            constrained_.keep_positions();
        }
        const bool seeks = scene_.start == Start::momentum && !system_.separable;
        if (!seeks || !has_mass_near_the_momentum()) require_mass();
        if (seeks) find_velocities();
        if (!system_.constraints.empty()) constrained_.keep_velocities();
        if (!seeks) return;
        require_values();
        require_mass();
    }

    StartOnConstraints found() const {
        StartOnConstraints start;
        for (const auto& q : system_.q) start.q.push_back(start_.get(q));
        for (const auto& v : system_.v) start.v.push_back(start_.get(v));
        return start;
    }

private:
    void require_equation(const Eliminated& x, const ex& formula, const ex& given, const std::string& what) {
        const std::string& name = x.coordinate.written;
        const std::vector<Id> ids = start_.convert({formula - given, formula});
        const Sized off = start_.evaluate_sized(ids).front();
        const cln::cl_R rounding = off.size * cln::expt(cln::cl_RA(10), -14), least = cln::expt(cln::cl_RA(10), -300);
        if (cln::abs(off.value) <= cln::max(rounding, least)) return;
        scene_.source.fail(
            x.constraint.at,
            fmt::format("the start does not keep the constraint {} ({}): the {} of {} is {}, but the other coordinates "
                        "ask for {}: write that, leave the start of {} out, or add assemble = true to [run]",
                        x.constraint.written, x.constraint.text, what, name,
                        decimal(value_of(given, "the initial " + what + " of " + name), 17),
                        decimal(start_.evaluate(ids)[1], 17), name));
    }

    // The scene's numbers; velocities are 0 where it gives momenta.
    static Formulas as_given(const Scene& scene, Formulas start) {
        const auto set = [&](const GiNaC::symbol& symbol, const ex& value, const std::string& what) {
            start.set(symbol, float_of(scene.evaluate(value, what)));
        };
        for (const Parameter& parameter : scene.parameters)
            set(parameter.symbol, parameter.value, "the parameter " + parameter.name);
        start.set(scene.time, 0);
        for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {
            const Coordinate& coordinate = scene.coordinates[k];
            set(coordinate.position, scene.initial_position[k], "the initial position of " + coordinate.name);
            if (scene.start == Start::velocity)
                set(coordinate.velocity, scene.initial_rate[k], "the initial velocity of " + coordinate.name);
            else
                start.set(coordinate.velocity, 0);
        }
        return start;
    }
    cln::cl_R value_of(const ex& expression, const std::string& what) const {
        return float_of(scene_.evaluate(expression, what));
    }

    [[noreturn]] void refuse(const std::string& reason) const { scene_.source.fail(scene_.lagrangian_at, reason); }

    // All formulas at once; when one has no value, one by one to find it.
    void require_values() {
        std::vector<ex> all = system_.terms;
        for (const auto* list : {&system_.outer_force, &system_.momentum, &system_.force})
            all.insert(all.end(), list->begin(), list->end());
        for (const Constraint& constraint : system_.constraints) all.push_back(constraint.value);
        for (const SparseMatrix* matrix :
             {&system_.momentum_v, &system_.momentum_q, &system_.force_v, &system_.force_q, &system_.constraint_q})
            for (const auto& [place, value] : matrix->entries()) all.push_back(value);
        try {
            start_(all);
        } catch (const DomainError&) {
            name_culprit();
        }
        for (const Element& element : system_.unwritten.elements) require_rows(element);
    }

    // Of terms that are not written out: the first and second derivatives of their formula, row by row.
    void require_rows(const Element& element) {
        std::vector<ex> derivatives;
        for (const auto& x : element.x) derivatives.push_back(element.term.diff(x));
        for (const auto& [i, j] : pairs_of(element)) derivatives.push_back(derivatives[i].diff(element.x[j]));
        std::size_t row = 0;
        try {
            at_rows(element, derivatives, system_, start_, [&](std::size_t done, const Numbers&) { row = done + 1; });
        } catch (const DomainError& error) {
            const ex term = of_row(element, element.term, row, system_.q);
            refuse(
                fmt::format("has derivatives without a value at the start, {}, because of its term {}: {}; start "
                            "elsewhere, or mend the formula",
                            values_in(term, system_, start_), short_text(-term), error.what()));
        }
    }

    void name_culprit() {
        const auto require = [&](const ex& formula, const auto& what, Position place, const char* remedy = "") {
            try {
                start_({formula});
            } catch (const DomainError& error) {
                scene_.source.fail(
                    place, fmt::format("{} at the start, {}: {}; start elsewhere, or mend the formula{}", what(),
                                       values_in(formula, system_, start_), error.what(), remedy));
            }
        };
        const Position lagrangian = scene_.lagrangian_at;
        for (const auto& [begin, end] : portions_of(system_.terms.size())) {
            const std::vector<ex> portion(system_.terms.begin() + static_cast<std::ptrdiff_t>(begin),
                                          system_.terms.begin() + static_cast<std::ptrdiff_t>(end));
            try {
                start_(portion);
                continue;
            } catch (const DomainError&) {
            }
            for (const ex& term : portion)
                require(
                    term, [&] { return "the Lagrangian has no value because of its term " + short_text(term); },
                    lagrangian);
        }
        for (std::size_t k = 0; k < system_.outer_force.size(); ++k) {
            const ex& force = system_.outer_force[k];
            const std::string on = "the force on " + scene_.coordinates[k].written;
            const Position place = scene_.coordinates[k].force_at;
            require(
                force, [&] { return on + " has no value"; }, place);
            for (const auto* symbols : {&system_.q, &system_.v})
                for (const auto& symbol : *symbols)
                    require(
                        force.diff(symbol), [&] { return on + " has no derivative in " + symbol.get_name(); }, place,
                        ": for sqrt(u) write sqrt(u + 1e-20)");
        }
        for (const Constraint& constraint : system_.constraints) {
            require(
                constraint.value, [&] { return "the constraint " + constraint.written + " has no value"; },
                constraint.at);
            for (const auto& symbol : system_.q)
                require(
                    constraint.value.diff(symbol),
                    [&] {
                        return "the constraint " + constraint.written + " has no derivative in " + symbol.get_name();
                    },
                    constraint.at);
        }
        const auto first = [&](const GiNaC::symbol& by, const ex& value) {
            require(
                value,
                [&] {
                    return fmt::format("the derivative dL/d{} = {} has no value", by.get_name(), short_text(value));
                },
                lagrangian);
        };
        for (std::size_t k = 0; k < system_.momentum.size(); ++k) {
            first(system_.v[k], system_.momentum[k]);
            first(system_.q[k], system_.force[k]);
        }
        const auto second = [&](const SparseMatrix& matrix, const auto& of, const auto& by) {
            for (const auto& [place, value] : matrix.entries())
                require(
                    value,
                    [&, row = place.first, column = place.second, entry = value] {
                        return fmt::format("the second derivative d2L/d{}d{} = {} has no value",
                                           of[unsigned_index(row)].get_name(), by[unsigned_index(column)].get_name(),
                                           short_text(entry));
                    },
                    lagrangian);
        };
        second(system_.momentum_v, system_.v, system_.v);
        second(system_.momentum_q, system_.v, system_.q);
        second(system_.force_v, system_.q, system_.v);
        second(system_.force_q, system_.q, system_.q);
        throw std::logic_error("formulas have no values together, but each by itself");
    }

    void require_mass() const {
        const Elimination elimination = equations_.eliminate({});
        if (!elimination.singular) return;
        if (const std::string dependent = equations_.dependent_constraints(elimination); !dependent.empty())
            scene_.source.fail(system_.constraints.front().at, "at the start " + dependent);
        ex held = 0;
        for (const auto& [place, value] : system_.momentum_v.entries()) held += GiNaC::pow(value, 2);
        const bool everywhere =
            std::none_of(system_.q.begin(), system_.q.end(), [&](const auto& q) { return held.has(q); });
        std::string zeros;  // parameters that may be the reason
        for (const Parameter& parameter : scene_.parameters)
            if (held.has(parameter.symbol) && zerop(start_.get(parameter.symbol)))
                zeros += (zeros.empty() ? ", or give a value other than 0 to " : " or ") + parameter.written;
        refuse(fmt::format("the mass matrix is singular at the start, {}: no kinetic energy opposes the direction {}{}",
                           values_in(held, system_, start_), direction_text(system_, elimination.vector),
                           everywhere
                               ? "; give it mass, or remove a coordinate"
                               : fmt::format(" there; start elsewhere, {}choose coordinates that are regular there (x "
                                             "and y instead of an angle at its pole){}",
                                             zeros.empty() ? "or " : "", zeros)));
    }

    // p(v) + G^T mu - p0, then G v + dphi/dt, and the sum of the squares; of a velocity, and mu after it.
    struct Residual {
        Numbers vector;
        cln::cl_R square = 0;
        bool vanishes = true;
    };
    std::optional<Residual> residual(const Numbers& velocity, const Numbers& wanted) {
        const std::size_t n = system_.v.size();
        for (std::size_t k = 0; k < velocity.size(); ++k)
            start_.set(k < n ? system_.v[k] : constrained_.mu()[k - n], velocity[k]);
        try {
            const std::vector<Sized> p = start_.evaluate_sized(constrained_.momentum());
            Residual result;
            for (std::size_t k = 0; k < p.size(); ++k) {
                result.vector.push_back(p[k].value - wanted[k]);
                result.square = result.square + cln::square(result.vector[k]);
                result.vanishes = result.vanishes && p[k].equals({wanted[k], cln::abs(wanted[k])});
            }
            for (const Sized& rate : start_.evaluate_sized(constrained_.rates())) {
                result.vector.push_back(rate.value);
                result.square = result.square + cln::square(rate.value);
                result.vanishes = result.vanishes && rate.vanishes();
            }
            return result;
        } catch (const std::exception&) {  // DomainError; CLN's own when a velocity leaves its range
            return std::nullopt;
        }
    }

    Numbers wanted_momentum() const {
        Numbers wanted;
        for (std::size_t k = 0; k < scene_.initial_rate.size(); ++k)
            wanted.push_back(value_of(scene_.initial_rate[k], "the initial momentum of " + scene_.coordinates[k].name));
        return wanted;
    }

    bool is_singular() const { return equations_.eliminate({}).singular; }

    // At rest there may be no inverse, as of v^4: then the velocities begin at the multiple of the momentum whose own
    // momentum is nearest, as in kernels.
    bool has_mass_near_the_momentum() {
        if (!is_singular()) return true;
        const Numbers wanted = wanted_momentum();
        Numbers best(wanted.size(), cln::cl_R(0));
        std::optional<Residual> nearest;
        for (int exponent = -40; exponent <= 40; ++exponent) {
            Numbers trial;
            for (const cln::cl_R& p : wanted) trial.push_back(p * cln::expt(cln::cl_R(2), exponent));
            std::optional<Residual> there = residual(trial, wanted);
            if (!there || (nearest && there->square >= nearest->square)) continue;
            nearest = there;
            best = trial;
        }
        residual(best, wanted);
        if (!is_singular()) {
            first_velocity_ = best;
            return true;
        }
        residual(Numbers(wanted.size(), cln::cl_R(0)), wanted);
        return false;
    }

    // Newton's method for dL/dv = p0, its steps halved until the residual falls: what kernels do too.
    void find_velocities() {
        const Numbers wanted = wanted_momentum();
        Numbers velocity = first_velocity_;
        velocity.resize(equations_.unknowns(), cln::cl_R(0));
        std::optional<Residual> here = residual(velocity, wanted);
        for (int iteration = 0; here && !here->vanishes; ++iteration) {
            const Elimination step = equations_.eliminate(here->vector);
            if (step.singular || iteration == 100) refuse_momentum(wanted, *here);
            cln::cl_RA fraction = 1;
            for (int halvings = 0;; ++halvings, fraction = fraction / 2) {
                if (halvings == 60) refuse_momentum(wanted, *here);
                Numbers trial;
                for (std::size_t k = 0; k < velocity.size(); ++k)
                    trial.push_back(velocity[k] - fraction * step.vector[k]);
                std::optional<Residual> there = residual(trial, wanted);
                if (!there || there->square > here->square * (1 - fraction / 8)) continue;
                velocity = trial;
                here = there;
                break;
            }
        }
    }

    [[noreturn]] void refuse_momentum(const Numbers& wanted, const Residual& nearest) const {
        std::size_t worst = 0;  // of the momenta
        for (std::size_t k = 1; k < wanted.size(); ++k)
            if (cln::abs(nearest.vector[k]) > cln::abs(nearest.vector[worst])) worst = k;
        const Coordinate& coordinate = scene_.coordinates[worst];
        scene_.source.fail(
            coordinate.rate_at,
            fmt::format("no velocity has this momentum: p_{0} = dL/d{1} = {2} comes no nearer to {3} than {4:.6g}; "
                        "give a momentum that a velocity has, or the velocity itself",
                        coordinate.name, coordinate.velocity.get_name(), short_text(system_.momentum[worst]),
                        decimal(wanted[worst], 6), cln::double_approx(wanted[worst] + nearest.vector[worst])));
    }

    const Scene& scene_;
    const System& system_;
    Formulas start_;
    MassEquations equations_;
    ConstrainedStart constrained_;
    Numbers first_velocity_;  // empty: rest
};

}  // namespace

void check_start(const Scene& scene, const System& system) {
    StartCheck(scene, system).run();
}

StartOnConstraints start_on_constraints(const Scene& scene, const System& system) {
    StartCheck check(scene, system);
    check.run();
    return check.found();
}

void check_values(const Scene& scene) {
    for (const Requirement& required : scene.requirements) {
        const GiNaC::numeric value = scene.evaluate(required.value, "what a value must keep");
        if (required.may_vanish ? value.is_negative() : !value.is_positive())
            scene.source.fail(required.at, required.complaint);
    }
    require_start_before_walls(scene);
    const Scene in_time = in_clock_time(scene);
    System system = undifferentiated(in_time);
    system.formulas = std::make_shared<const Formulas>();
    StartCheck check(in_time, system);
    check.require_formulas();
}

}  // namespace lobatto
