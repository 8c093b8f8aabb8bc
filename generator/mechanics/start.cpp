// SPDX-License-Identifier: GPL-2.0-or-later
// Whether a motion can begin where a scene lets it begin.
#include "generator/mechanics/start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "generator/graph/notation.hpp"
#include "generator/mechanics/clock.hpp"
#include "generator/mechanics/mass_equations.hpp"
#include "generator/mechanics/sample.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using Numbers = std::vector<cln::cl_R>;

std::size_t unsigned_index(int index) {
    return static_cast<std::size_t>(index);
}

std::string short_text(const ex& expression) {
    const std::string text = canonical_text(expression);
    return text.size() <= 120 ? text : fmt::format("a formula of {} characters", text.size());
}

class StartCheck {
public:
    StartCheck(const Scene& scene, const System& system)
        : scene_(scene), system_(system), start_(as_given(scene)), equations_(system, start_) {
        convert_constraints();
    }

    // What formulas ask for as they are written, though they may have lost it since: a/a, sqrt(a)^2.
    void require_domains() {
        for (const DomainCondition& condition : scene_.conditions) {
            const bool moves = scene_.start == Start::momentum &&
                               std::any_of(system_.v.begin(), system_.v.end(),
                                           [&](const auto& v) { return condition.expression.has(v); });
            if (moves) continue;  // velocities are not known yet
            std::string found;
            try {
                const cln::cl_R value = start_({condition.expression}).front();
                using Kind = DomainCondition::Kind;
                const bool holds = condition.kind == Kind::nonzero       ? !cln::zerop(value)
                                   : condition.kind == Kind::nonnegative ? !cln::minusp(value)
                                   : condition.kind == Kind::positive    ? cln::plusp(value)
                                                                         : cln::abs(value) <= 1;
                if (holds) continue;
                found = cln::zerop(value) ? "0" : decimal(value, 6);
            } catch (const DomainError& error) {
                found = error.what();
            }
            scene_.source.fail(condition.at,
                               fmt::format("{} has no value at the start: it is of {} = {}{}", condition.operation,
                                           short_text(condition.expression), found, start_text(condition.expression)));
        }
    }

    void run() {
        require_values();
        require_domains();
        if (!system_.constraints.empty()) keep_positions();
        const bool seeks = scene_.start == Start::momentum && !system_.separable;
        if (!seeks || !has_mass_near_the_momentum()) require_mass();
        if (seeks) find_velocities();
        if (!system_.constraints.empty()) keep_velocities();
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
    // The scene's numbers; velocities are 0 where it gives momenta.
    static Formulas as_given(const Scene& scene) {
        Formulas start;
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

    // "x = 0, x' = 1": what of the start an expression holds.
    std::string values_in(const ex& expression) const {
        std::string text;
        int shown = 0;
        const auto add = [&](const GiNaC::symbol& symbol) {
            if (!expression.has(symbol) || ++shown > 6) return;
            const cln::cl_R value = start_.get(symbol);
            text += fmt::format("{}{} = {}", shown == 1 ? "" : ", ", symbol.get_name(),
                                cln::zerop(value) ? "0" : decimal(value, 6));
        };
        for (const auto* symbols : {&system_.q, &system_.v})
            for (const auto& symbol : *symbols) add(symbol);
        add(system_.t);
        if (shown == 0)
            for (const auto& symbol : system_.parameters) add(symbol);
        return text + (shown > 6 ? ", ..." : "");
    }

    std::string start_text(const ex& expression) const {
        const std::string values = values_in(expression);
        return (values.empty() ? "" : ", with " + values) + "; start elsewhere, or mend the formula";
    }

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
    }

    void name_culprit() {
        const auto require = [&](const ex& formula, const auto& what, Position place) {
            try {
                start_({formula});
            } catch (const DomainError& error) {
                scene_.source.fail(place, fmt::format("{} at the start, {}: {}; start elsewhere, or mend the formula",
                                                      what(), values_in(formula), error.what()));
            }
        };
        const Position lagrangian = scene_.lagrangian_at;
        for (const ex& term : system_.terms)
            require(
                term, [&] { return "the Lagrangian has no value because of its term " + short_text(term); },
                lagrangian);
        for (std::size_t k = 0; k < system_.outer_force.size(); ++k) {
            const ex& force = system_.outer_force[k];
            const std::string on = "the force on " + scene_.coordinates[k].written;
            const Position place = scene_.coordinates[k].force_at;
            require(
                force, [&] { return on + " has no value"; }, place);
            for (const auto* symbols : {&system_.q, &system_.v})
                for (const auto& symbol : *symbols)
                    require(
                        force.diff(symbol), [&] { return on + " has no derivative in " + symbol.get_name(); }, place);
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

    // p + G^T mu and G v + dphi/dt, with symbols for mu; phi.
    void convert_constraints() {
        std::vector<ex> momentum = system_.momentum, rates = system_.constraint_t, values;
        for (const Constraint& constraint : system_.constraints) {
            mu_.emplace_back("mu_" + constraint.name);
            start_.set(mu_.back(), cln::cl_R(0));
            values.push_back(constraint.value);
        }
        for (const auto& [place, slope] : system_.constraint_q.entries()) {
            const std::size_t c = unsigned_index(place.first), k = unsigned_index(place.second);
            momentum[k] += slope * mu_[c];
            rates[c] += slope * system_.v[k];
        }
        momentum_ = start_.convert(momentum);
        rates_ = start_.convert(rates);
        constraints_ = start_.convert(values);
    }

    // The constraint, or its rate, that is furthest from 0, beyond the rounding of a double.
    std::optional<std::size_t> furthest(const std::vector<Id>& of) const {
        const std::vector<Sized> values = start_.evaluate_sized(of);
        const cln::cl_R rounding = cln::expt(cln::cl_RA(10), -14);
        std::optional<std::size_t> worst;
        for (std::size_t c = 0; c < values.size(); ++c)
            if (cln::abs(values[c].value) > values[c].size * rounding &&
                (!worst || cln::abs(values[c].value) > cln::abs(values[*worst].value)))
                worst = c;
        return worst;
    }
    std::string value_text(const std::vector<Id>& of, std::size_t c) const {
        return decimal(start_.evaluate(of)[c], 6);
    }

    // "x = 0.6, y = 0.8": of those that have moved.
    std::string moved_text(const std::vector<GiNaC::symbol>& symbols, const Numbers& before) const {
        std::string text;
        int shown = 0;
        for (std::size_t k = 0; k < symbols.size(); ++k) {
            const cln::cl_R value = start_.get(symbols[k]);
            if (cln::abs(value - before[k]) <= cln::abs(value) * cln::expt(cln::cl_RA(10), -30)) continue;
            if (++shown > 8) return text + ", ...";
            text += fmt::format("{}{} = {}", shown == 1 ? "" : ", ", symbols[k].get_name(), decimal(value, 17));
        }
        return text;
    }
    Numbers values_of(const std::vector<GiNaC::symbol>& symbols) const {
        Numbers values;
        for (const auto& symbol : symbols) values.push_back(start_.get(symbol));
        return values;
    }

    [[noreturn]] void refuse_off(std::size_t c, const std::string& what, const std::string& nearest) const {
        const Constraint& constraint = system_.constraints[c];
        scene_.source.fail(
            constraint.at,
            fmt::format("the start does not keep the constraint {} ({}): {}; the nearest start that keeps "
                        "all constraints has {}: write that, or add assemble = true to [run]",
                        constraint.written, constraint.text, what, nearest));
    }

    // (D47) Positions that keep the constraints to all digits: those given, or the nearest.
    void keep_positions() {
        const std::optional<std::size_t> off = furthest(constraints_);
        const std::string what =
            off ? "its left side minus its right side is " + value_text(constraints_, *off) : std::string();
        const Numbers given = values_of(system_.q);
        move_positions(given);
        if (off && !scene_.run.assemble) refuse_off(*off, what, moved_text(system_.q, given));
    }

    // Newton's iteration M (q - q0) + G^T mu = 0, phi(q) = 0, its steps halved while phi would grow.
    void move_positions(const Numbers& given) {
        const cln::cl_R small = cln::expt(cln::cl_RA(10), -30);
        const auto set = [&](const Numbers& q) {
            for (std::size_t k = 0; k < q.size(); ++k) start_.set(system_.q[k], q[k]);
        };
        const auto square = [&]() -> std::optional<cln::cl_R> {
            try {
                cln::cl_R sum = 0;
                for (const cln::cl_R& phi : start_.evaluate(constraints_)) sum = sum + cln::square(phi);
                return sum;
            } catch (const DomainError&) {
                return std::nullopt;
            }
        };
        Numbers q = given;
        for (int iteration = 0; iteration < 100; ++iteration) {
            Numbers away;
            for (std::size_t k = 0; k < q.size(); ++k) away.push_back(q[k] - given[k]);
            Numbers right = equations_.mass_times(away);
            for (const cln::cl_R& phi : start_.evaluate(constraints_)) right.push_back(phi);
            const Elimination step = equations_.eliminate(right);
            if (step.singular && iteration == 0) require_mass();
            if (step.singular) break;
            const std::optional<cln::cl_R> before = square();
            cln::cl_RA fraction = 1;
            for (int halvings = 0; halvings < 60; ++halvings, fraction = fraction / 2) {
                Numbers trial;
                for (std::size_t k = 0; k < q.size(); ++k) trial.push_back(q[k] - fraction * step.vector[k]);
                set(trial);
                const std::optional<cln::cl_R> now = square();
                if (now && *now <= *before) break;
            }
            const Numbers moved = values_of(system_.q);
            cln::cl_R change = 0, size = 0;
            for (std::size_t k = 0; k < q.size(); ++k) {
                change = cln::max(change, cln::abs(moved[k] - q[k]));
                size = cln::max(size, cln::abs(moved[k]));
            }
            q = moved;
            const bool stands = change <= size * small;
            if (stands && !furthest(constraints_)) return;
            if (stands && iteration > 0) break;
        }
        const std::optional<std::size_t> off = furthest(constraints_);
        if (!off) return;
        const Constraint& constraint = system_.constraints[*off];
        scene_.source.fail(
            constraint.at,
            fmt::format("no positions near the start keep the constraints: {} ({}) stays off by {}; a loop "
                        "that cannot close? Mend its lengths, or start nearer",
                        constraint.written, constraint.text, value_text(constraints_, *off)));
    }

    // (D47) The same of velocities: M (v - v0) + G^T mu = 0, G v + dphi/dt = 0.
    void keep_velocities() {
        const bool by_momentum = scene_.start == Start::momentum;
        const std::optional<std::size_t> off = by_momentum ? pulled() : furthest(rates_);
        const std::string what =
            !off ? ""
            : by_momentum
                ? "its momenta are those of no velocity that keeps it"
                : "its velocities change its left side minus its right side at the rate " + value_text(rates_, *off);
        const Numbers given = values_of(system_.v);
        for (int iteration = 0; iteration < 2; ++iteration) {
            Numbers right(system_.q.size(), cln::cl_R(0));
            for (const cln::cl_R& rate : start_.evaluate(rates_)) right.push_back(rate);
            const Elimination step = equations_.eliminate(right);
            if (step.singular) require_mass();
            for (std::size_t k = 0; k < system_.v.size(); ++k)
                start_.set(system_.v[k], start_.get(system_.v[k]) - step.vector[k]);
        }
        if (!off || scene_.run.assemble) return;
        refuse_off(*off, what,
                   by_momentum ? "the velocities " + moved_text(system_.v, Numbers(given.size(), cln::cl_R(0)))
                               : moved_text(system_.v, given));
    }

    // The constraint that pulls most on the momenta that are given.
    std::optional<std::size_t> pulled() const {
        std::optional<std::size_t> most;
        const std::vector<cln::cl_R> momentum = start_.evaluate(momentum_);
        cln::cl_R size = 0;
        for (const cln::cl_R& p : momentum) size = cln::max(size, cln::abs(p));
        for (std::size_t c = 0; c < mu_.size(); ++c)
            if (cln::abs(start_.get(mu_[c])) > size * cln::expt(cln::cl_RA(10), -14) &&
                (!most || cln::abs(start_.get(mu_[c])) > cln::abs(start_.get(mu_[*most]))))
                most = c;
        return most;
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
        refuse(fmt::format("the mass matrix is singular at the start, {}: no kinetic energy opposes the direction {}{}",
                           values_in(held), direction_text(system_, elimination.vector),
                           everywhere ? "; give it mass, or remove a coordinate"
                                      : " there; start elsewhere, or choose coordinates that are regular there (x and "
                                        "y instead of an angle at its pole)"));
    }

    // p(v) + G^T mu - p0, then G v + dphi/dt, and the sum of the squares; of a velocity, and mu after it.
    struct Residual {
        Numbers vector;
        cln::cl_R square = 0;
        bool vanishes = true;
    };
    std::optional<Residual> residual(const Numbers& velocity, const Numbers& wanted) {
        const std::size_t n = system_.v.size();
        for (std::size_t k = 0; k < velocity.size(); ++k) start_.set(k < n ? system_.v[k] : mu_[k - n], velocity[k]);
        try {
            const std::vector<Sized> p = start_.evaluate_sized(momentum_);
            Residual result;
            for (std::size_t k = 0; k < p.size(); ++k) {
                result.vector.push_back(p[k].value - wanted[k]);
                result.square = result.square + cln::square(result.vector[k]);
                result.vanishes = result.vanishes && p[k].equals({wanted[k], cln::abs(wanted[k])});
            }
            for (const Sized& rate : start_.evaluate_sized(rates_)) {
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
    std::vector<GiNaC::symbol> mu_;
    std::vector<Id> momentum_, rates_, constraints_;
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

void check_domains(const Scene& scene, const System& system) {
    StartCheck(in_clock_time(scene), system).require_domains();
}

}  // namespace lobatto
