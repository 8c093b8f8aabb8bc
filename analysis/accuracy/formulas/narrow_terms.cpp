// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/formulas/narrow_terms.hpp"

#include <ginac/ginac.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "analysis/accuracy/formulas/bends.hpp"
#include "generator/formula/real.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

constexpr std::size_t most_terms = 128;
constexpr int most_parts = 20000;  // of a formula that are looked at
constexpr int places = 8;          // at the way
constexpr int sections = 40;       // shorter ones
constexpr double shorter = 0.381966;
constexpr double smallest = 745;       // exp(-745) is the least number
constexpr double fine = 0.25;          // of the scale on which a term changes: what it does to the motion may be large
constexpr double flat = 20;            // tanh(20) is 1
constexpr std::size_t most_bends = 4;  // of a table: the sharpest
constexpr double sharp = 0.02;         // of what the table covers

// As (1 - v^2)^(-3/2), which is never small.
bool grows_without_bound(const ex& mass, const std::vector<GiNaC::symbol>& velocities) {
    for (auto part = mass.preorder_begin(); part != mass.preorder_end(); ++part)
        if (GiNaC::is_a<GiNaC::power>(*part) && part->op(1).info(GiNaC::info_flags::negative) &&
            std::any_of(velocities.begin(), velocities.end(), [&](const auto& v) { return part->op(0).has(v); }))
            return true;
    return false;
}

}  // namespace

NarrowTerms::NarrowTerms(const SystemOutline& system) {
    std::vector<GiNaC::symbol> variables{system.t};
    for (const auto* list : {&system.q, &system.v}) variables.insert(variables.end(), list->begin(), list->end());
    variables.insert(variables.end(), system.parameters.begin(), system.parameters.end());
    const Tape::Variables numbered(variables);
    GiNaC::exset known;
    bool is_kinetic = false;
    const auto add = [&](Kind kind, const ex& u) {
        if (terms_.size() == most_terms) return;
        // Near the speed of light 1 - v^2 is small, and smaller on a way that is not the motion's. It is no pole of any
        // force.
        const auto holds = [&](const GiNaC::symbol& v) { return u.has(v); };
        if (is_kinetic && std::any_of(system.v.begin(), system.v.end(), holds)) return;
        if (!known.insert(u).second) return;
        std::vector<std::size_t> coordinates;
        for (std::size_t k = 0; k < system.q.size(); ++k)
            if (u.has(system.q[k]) || u.has(system.v[k])) coordinates.push_back(k);
        if (coordinates.empty() && !u.has(system.t)) return;
        if (const auto tape = Tape::of(u, numbered)) terms_.push_back({kind, *tape, coordinates});
    };
    static const std::map<std::string, Kind> kinds{{"exp", Kind::peak},  {"tanh", Kind::step}, {"sinh", Kind::step},
                                                   {"cosh", Kind::step}, {"atan", Kind::tail}, {"log", Kind::pole}};
    // Measured values change at a sharp bend as tanh does where it passes zero.
    const auto add_table = [&](const ex& table) {
        const Spline& spline = spline_of(GiNaC::ex_to<GiNaC::numeric>(table.op(0)).to_int());
        const double span = cln::double_approx(spline.x().back() - spline.x().front());
        std::vector<Bend> bends = bends_of(spline);
        bends.resize(std::min(bends.size(), most_bends));
        for (const Bend& bend : bends)
            if (bend.width < sharp * span)
                add(Kind::step, (table.op(2) - GiNaC::numeric(bend.place)) / GiNaC::numeric(bend.width));
    };
    const std::vector<GiNaC::symbol> motion = system.motion();
    int parts = 0;
    const auto look_at = [&](const ex& formula) {
        for (auto part = formula.preorder_begin(); part != formula.preorder_end() && parts < most_parts; ++part) {
            ++parts;
            if (GiNaC::is_a<GiNaC::function>(*part)) {
                const std::string name = GiNaC::ex_to<GiNaC::function>(*part).get_name();
                if (const auto kind = kinds.find(name); kind != kinds.end()) add(kind->second, part->op(0));
                if (is_angle(*part)) add(Kind::pole, GiNaC::pow(part->op(0), 2) + GiNaC::pow(part->op(1), 2));
                if (is_table_value(*part)) add_table(*part);
                if (name == "tan") add(Kind::pole, GiNaC::cos(part->op(0)));
                if (name == "asin" || name == "acos") add(Kind::pole, 1 - GiNaC::pow(part->op(0), 2));
            } else if (is_exponential(*part, motion)) {
                add(Kind::peak, natural_exponent(*part));
            } else if (GiNaC::is_a<GiNaC::power>(*part) && !part->op(1).info(GiNaC::info_flags::nonnegint)) {
                add(Kind::pole, part->op(0));
            }
        }
    };
    is_kinetic = true;
    look_at(system.lagrangian);
    is_kinetic = false;
    for (const ex& force : system.outer_force) look_at(force);
    for (const Constraint& constraint : system.constraints) look_at(constraint.value);
    for (const auto& [place, mass] : system.momentum_v.entries())
        if (place.first == place.second && !grows_without_bound(mass, system.v)) add(Kind::pole, mass);
}

// Where on the way, 0 to 1, exp(u) is largest, or |u| least, if the term changes there within half of the way.
template <class U>
std::optional<NarrowTerms::Found> NarrowTerms::narrow_place(Kind kind, const U& u) {
    const double begin = u(0), middle = u(0.5), end = u(1);
    const double variation = std::fabs(end - begin) + 4 * std::fabs(2 * middle - begin - end);
    const double least = std::fmin(std::fabs(middle), std::fmin(std::fabs(begin), std::fabs(end)));
    if (!(variation > (kind == Kind::pole ? least / 2 : kind == Kind::tail ? std::fmax(1, least) : 1))) return {};
    // Small where the term is narrow.
    const auto height = [&](double place) { return kind == Kind::peak ? -u(place) : std::fabs(u(place)); };
    std::array<double, places + 1> heights{};
    for (int i = 0; i <= places; ++i) {
        heights[static_cast<std::size_t>(i)] = height(static_cast<double>(i) / places);
        if (!std::isfinite(heights[static_cast<std::size_t>(i)])) return {};
    }
    const auto lowest = std::min_element(heights.begin(), heights.end());
    double place = static_cast<double>(lowest - heights.begin()) / places, low = std::fmax(0, place - 1.0 / places),
           high = std::fmin(1, place + 1.0 / places), here = *lowest;
    for (int i = 0; i < sections; ++i) {
        const bool is_above = high - place > place - low;
        const double trial = place + shorter * ((is_above ? high : low) - place), there = height(trial);
        if (there < here) {
            (is_above ? low : high) = place;
            place = trial;
            here = there;
        } else {
            (is_above ? high : low) = trial;
        }
    }
    if (here > (kind == Kind::step ? flat : smallest) && kind != Kind::tail && kind != Kind::pole) return {};
    const double change = kind == Kind::pole ? here : kind == Kind::tail ? std::fmax(1, here) : 1, at_place = u(place);
    for (double width = 0x1p-40; width < 0.5; width *= 2)
        if (std::fabs(u(place + width) - at_place) > change || std::fabs(u(place - width) - at_place) > change)
            return Found{place, width};
    return {};
}

std::optional<Pulse> NarrowTerms::on_the_way(const State& from, const State& to, std::int64_t& evaluations) const {
    const std::size_t n = from.q.size();
    const double duration = to.time - from.time;
    std::vector<double> variables(1 + 2 * n);
    variables.insert(variables.end(), parameters_.begin(), parameters_.end());
    std::optional<Found> narrowest;
    for (const Term& term : terms_) {
        const auto u = [&](double s) {
            ++evaluations;
            variables[0] = from.time + s * duration;
            const double r = 1 - s;
            for (const std::size_t k : term.coordinates) {
                const double a = duration * from.v[k], b = duration * to.v[k], way = to.q[k] - from.q[k];
                variables[1 + k] = from.q[k] + s * s * (3 - 2 * s) * way + s * r * (r * a - s * b);
                variables[1 + n + k] = (6 * s * r * way + r * (1 - 3 * s) * a + s * (3 * s - 2) * b) / duration;
            }
            return term.tape(variables);
        };
        const std::optional<Found> found = narrow_place(term.kind, u);
        if (found && (!narrowest || found->width < narrowest->width)) narrowest = found;
    }
    if (!narrowest) return {};
    return Pulse{from.time + narrowest->place * duration, fine * narrowest->width * std::fabs(duration)};
}

bool NarrowTerms::may_be_met(const State& at, double step, double reach) const {
    std::vector<double> variables{at.time};
    variables.insert(variables.end(), at.q.begin(), at.q.end());
    variables.insert(variables.end(), at.v.begin(), at.v.end());
    variables.insert(variables.end(), parameters_.begin(), parameters_.end());
    return std::any_of(terms_.begin(), terms_.end(), [&](const Term& term) {
        const auto u = [&](double steps) {
            variables[0] = at.time + steps * step;
            for (const std::size_t k : term.coordinates) variables[1 + k] = at.q[k] + steps * step * at.v[k];
            return term.tape(variables);
        };
        const double before = u(-1), here = u(0), after = u(1);
        if (!std::isfinite(before + after)) return true;
        if (term.kind != Kind::pole) return std::fmax(std::fabs(after - here), std::fabs(before - here)) > 1;
        // |u| is least where this parabola is, or where it vanishes.
        const double slope = (after - before) / 2, bend = before - 2 * here + after;
        if (std::fabs(slope) * reach > std::fabs(here) && std::fabs(bend) * reach < std::fabs(slope)) return true;
        const double place = -slope / bend, least = here + slope * place / 2;
        return std::fabs(place) <= reach && !(2 * std::fabs(least) > std::fabs(bend) / 4);
    });
}

}  // namespace lobatto
