// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/scene/eliminated.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "generator/formula/real.hpp"
#include "generator/formula/spline.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

// A chain x[i] = x[i-1] + ... would couple all of its coordinates: steps with a constraint are faster then, unless one
// of the coordinates moves nothing else.
constexpr std::size_t most_held = 8;           // coordinates in a formula
constexpr std::size_t longest_formula = 2000;  // numbers, names and operations

template <class Does>
bool any_part(const ex& expression, const Does& does) {
    return std::any_of(expression.preorder_begin(), expression.preorder_end(), does);
}

class Elimination {
public:
    explicit Elimination(Scene& scene) : scene_(scene) {}

    void run() {
        for (std::size_t c = 0; c < scene_.constraints.size(); ++c) {
            const Constraint& constraint = scene_.constraints[c];
            if (!constraint.solved_for) continue;
            const std::string why = reason_to_keep(constraint);
            if (why.empty()) continue;
            scene_.not_eliminated.push_back(
                fmt::format("{}: {}", scene_.coordinates[*constraint.solved_for].written, why));
        }
        if (formulas_.empty()) return;
        for (const auto& [k, solved] : formulas_) {
            const Coordinate& coordinate = scene_.coordinates[k];
            follows_[coordinate.position] = solved.formula;
            follows_[coordinate.velocity] = rate_of_change(solved.formula, scene_);
        }
        tell_momenta();
        hand_on_forces();
        substitute();
        remove();
    }

private:
    struct Solved {
        Constraint constraint;
        ex formula;  // in coordinates that stay
    };

    // Empty: it is solved, and stands in formulas_.
    std::string reason_to_keep(const Constraint& constraint) {
        const std::size_t k = *constraint.solved_for;
        const Coordinate& x = scene_.coordinates[k];
        if (scene_.start == Start::momentum) return "the scene gives momenta, which belong to all coordinates";
        if (scene_.outputs.multipliers) return "its multiplier is asked for";
        if (std::any_of(scene_.impacts.begin(), scene_.impacts.end(),
                        [](const Impact& impact) { return !impact.reset_position.empty(); }))
            return "an impact resets coordinates";
        if (x.written.find(".q[") != std::string::npos) return "it is a part of a quaternion";
        if (std::count_if(scene_.constraints.begin(), scene_.constraints.end(),
                          [&](const Constraint& other) { return other.solved_for == k; }) > 1)
            return "it has several equations";
        const std::string rough = what_is_not_smooth(constraint.solution);
        if (!rough.empty()) return "its equation holds " + rough;
        return solve(k, constraint);
    }

    // Of what has fewer than three derivatives, or jumps.
    std::string what_is_not_smooth(const ex& formula) const {
        for (const Switch& one : scene_.switches)
            if (formula.has(one.side)) return one.text;
        for (const GiNaC::symbol& input : scene_.inputs())
            if (formula.has(input)) return "an input";
        if (any_part(formula, [](const ex& part) { return is_table_value(part); })) return "measured values";
        if (any_part(formula, [](const ex& part) { return is_angle(part); })) return "atan2";
        return "";
    }

    std::string solve(std::size_t k, const Constraint& constraint) {
        const ex x = scene_.coordinates[k].position;
        GiNaC::exmap known;
        for (const auto& [other, solved] : formulas_) known[scene_.coordinates[other].position] = solved.formula;
        const ex formula = constraint.solution.subs(known, GiNaC::subs_options::no_pattern);
        if (formula.has(x)) return "its equation holds it on both sides";
        std::map<std::size_t, Solved> all = formulas_;
        all[k] = {constraint, formula};
        for (auto& [other, solved] : all) {
            ex& of = solved.formula;  // bindings cannot be captured
            if (other != k) of = of.subs(x == formula, GiNaC::subs_options::no_pattern);
            if (is_needed(constraint)) continue;
            const auto held =
                static_cast<std::size_t>(std::count_if(scene_.coordinates.begin(), scene_.coordinates.end(),
                                                       [&](const Coordinate& c) { return of.has(c.position); }));
            if (held > most_held) return fmt::format("it follows from more than {} coordinates", most_held);
            if (static_cast<std::size_t>(std::distance(of.preorder_begin(), of.preorder_end())) > longest_formula)
                return "its formula is long";
        }
        formulas_ = std::move(all);
        return "";
    }

    // Whether its formula holds a coordinate whose velocity is not in L, and so has no mass before it is eliminated.
    bool is_needed(const Constraint& constraint) const {
        return std::any_of(scene_.coordinates.begin(), scene_.coordinates.end(), [&](const Coordinate& c) {
            return constraint.solution.has(c.position) && !scene_.lagrangian.has(c.velocity);
        });
    }

    // What keeps and plots hold of p_x: dL/dx' of L as it is written.
    void tell_momenta() {
        if (scene_.outputs.momenta_of_kept.empty()) return;
        GiNaC::exmap momenta;
        for (const auto& [k, solved] : formulas_) {
            ex momentum = scene_.lagrangian.diff(scene_.coordinates[k].velocity);
            put_into(momentum);
            momenta[scene_.outputs.momenta_of_kept[k]] = momentum;
        }
        follows_.insert(momenta.begin(), momenta.end());
    }

    // Virtual work: a force on x is one on what x follows from, F dx/dq.
    void hand_on_forces() {
        for (const auto& [k, solved] : formulas_) {
            const Coordinate& x = scene_.coordinates[k];
            if (x.force.is_zero()) continue;
            for (std::size_t i = 0; i < scene_.coordinates.size(); ++i) {
                Coordinate& other = scene_.coordinates[i];
                if (formulas_.count(i) > 0 || !solved.formula.has(other.position)) continue;
                if (other.force.is_zero()) other.force_at = x.force_at;
                other.force += x.force * solved.formula.diff(other.position);
            }
        }
    }

    void put_into(ex& formula) const { formula = formula.subs(follows_, GiNaC::subs_options::no_pattern); }
    void put_into(std::vector<Event>& events) const {
        for (Event& event : events) put_into(event.value);
    }
    void put_into(std::vector<ex>& formulas) const {
        for (ex& formula : formulas) put_into(formula);
    }

    void substitute() {
        put_into(scene_.lagrangian);
        for (Coordinate& coordinate : scene_.coordinates) put_into(coordinate.force);
        for (Constraint& constraint : scene_.constraints) put_into(constraint.value);
        for (Impact& impact : scene_.impacts) put_into(impact.when.value);
        for (std::vector<Switch>* list : {&scene_.switches, &scene_.seen_switches})
            for (Switch& one : *list) put_into(one.value);
        for (DomainCondition& condition : scene_.conditions) {
            put_into(condition.expression);
            put_into(condition.exponent);
            put_into(condition.argument);
        }
        if (scene_.clock) put_into(scene_.clock->rate);
        put_into(scene_.run.stops);
        put_into(scene_.outputs.events);
        for (Reduction& kept : scene_.outputs.kept) {
            put_into(kept.crossing.value);
            put_into(kept.value);
        }
        for (Column& column : scene_.outputs.columns) put_into(column.value);
        for (auto& [x, y] : scene_.places) {
            put_into(x);
            put_into(y);
        }
        for (DrawnBody& body : scene_.bodies) {
            put_into(body.place);
            put_into(body.rotation);
        }
        for (MovingFigure& figure : scene_.figures) {
            put_into(figure.radius);
            for (std::vector<ex>& corner : figure.corners) put_into(corner);
        }
        for (Plot& plot : scene_.plots) put_into(plot.value);
    }

    // x and what is said of it goes, and has columns.
    void remove() {
        std::vector<Column> columns;
        for (const auto& [k, solved] : formulas_) {
            const Coordinate& x = scene_.coordinates[k];
            const ex velocity = follows_.at(x.velocity);
            scene_.eliminated.push_back({x, k, solved.constraint, solved.formula, velocity, scene_.initial_position[k],
                                         scene_.initial_rate[k]});
            columns.push_back({x.name, x.unit, solved.formula});
            columns.push_back({x.name + "'", "", velocity});
        }
        std::vector<Column>& all = scene_.outputs.columns;
        all.insert(all.begin(), columns.begin(), columns.end());
        for (auto solved = formulas_.rbegin(); solved != formulas_.rend(); ++solved) {
            const auto k = static_cast<std::ptrdiff_t>(solved->first);
            scene_.coordinates.erase(scene_.coordinates.begin() + k);
            scene_.initial_position.erase(scene_.initial_position.begin() + k);
            scene_.initial_rate.erase(scene_.initial_rate.begin() + k);
            std::vector<GiNaC::symbol>& momenta = scene_.outputs.momenta_of_kept;
            if (!momenta.empty()) momenta.erase(momenta.begin() + k);
        }
        const auto is_solved = [&](const Constraint& constraint) {
            return std::any_of(formulas_.begin(), formulas_.end(),
                               [&](const auto& solved) { return solved.second.constraint.name == constraint.name; });
        };
        std::erase_if(scene_.constraints, is_solved);
        scene_.lagrangian_text += ", where " + equations_of_eliminated(scene_);
    }

    Scene& scene_;
    std::map<std::size_t, Solved> formulas_;  // by the number of the coordinate
    GiNaC::exmap follows_;                    // x -> f, x' -> df/dt
};

}  // namespace

std::string equations_of_eliminated(const Scene& scene) {
    std::string text;
    std::string last;
    for (const Eliminated& x : scene.eliminated) {
        // All elements of an array have one equation.
        const std::string equation = x.constraint.text;
        if (equation != last) text += (text.empty() ? "" : ", ") + equation;
        last = equation;
    }
    return text;
}

GiNaC::ex rate_of_change(const ex& formula, const Scene& scene) {
    ex rate = formula.diff(scene.time);
    for (const Coordinate& coordinate : scene.coordinates)
        rate += formula.diff(coordinate.position) * coordinate.velocity;
    return rate;
}

void eliminate_coordinates(Scene& scene) {
    Elimination(scene).run();
}

}  // namespace lobatto
