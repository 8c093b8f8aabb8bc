// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/constraints/constrained_start.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "generator/formula/real.hpp"
#include "generator/graph/notation.hpp"

namespace lobatto {

namespace {

cln::cl_R power_of_ten(int exponent) {
    return cln::expt(cln::cl_RA(10), exponent);
}

using Numbers = std::vector<cln::cl_R>;

Numbers difference(const Numbers& a, const Numbers& b) {
    Numbers result;
    for (std::size_t k = 0; k < a.size(); ++k) result.push_back(a[k] - b[k]);
    return result;
}

cln::cl_R largest_of(const Numbers& numbers) {
    cln::cl_R largest = 0;
    for (const cln::cl_R& number : numbers) largest = cln::max(largest, cln::abs(number));
    return largest;
}

}  // namespace

ConstrainedStart::ConstrainedStart(const Scene& scene, const System& system, Formulas& start,
                                   const MassEquations& equations)
    : scene_(scene), system_(system), start_(start), equations_(equations) {
    std::vector<GiNaC::ex> momentum = system.momentum, rates = system.constraint_t, values, slopes;
    for (const Constraint& constraint : system.constraints) {
        mu_.emplace_back("mu_" + constraint.name);
        start.set(mu_.back(), cln::cl_R(0));
        values.push_back(constraint.value);
    }
    for (const auto& [place, slope] : system.constraint_q.entries()) {
        const auto c = static_cast<std::size_t>(place.first), k = static_cast<std::size_t>(place.second);
        slopes.push_back(slope);
        momentum[k] += slope * mu_[c];
        rates[c] += slope * system.v[k];
    }
    momentum_ = start.convert(momentum);
    rates_ = start.convert(rates);
    constraints_ = start.convert(values);
    slopes_ = start.convert(slopes);
}

void ConstrainedStart::keep_positions() {
    const std::optional<std::size_t> off = furthest(constraints_);
    const std::string what =
        off ? "its left side minus its right side is " + value_text(constraints_, *off) : std::string();
    const Numbers given = values_of(system_.q);
    move_positions(given);
    if (off && !scene_.run.assemble) refuse(*off, what, moved_text(system_.q, given));
}

// M (q - q0) = G^T mu, phi(q) = 0, with M at q0. Steps without the second derivatives of phi go down, halved while phi
// would grow, but slowly where phi curves; those of Newton's iteration are taken where they are the better ones.
void ConstrainedStart::move_positions(const Numbers& given) {
    const cln::cl_R small = power_of_ten(-working_digits() / 2);
    const MassEquations::Entries mass = equations_.mass();
    Numbers q = given;
    for (int iteration = 0; iteration < 200; ++iteration) {
        const Numbers right = residual(mass, given);
        const Elimination step = equations_.eliminate(mass, right);
        if (step.singular) break;
        if (iteration < 2 || !newton_step(mass, given, right, step)) go(q, step.vector);
        const Numbers moved = values_of(system_.q);
        const cln::cl_R change = largest_of(difference(moved, q)), size = largest_of(moved);
        q = moved;
        const bool stands = change <= size * small;
        if (stands && !furthest(constraints_)) return;
        if (stands && iteration > 0) break;
    }
    if (const std::optional<std::size_t> off = furthest(constraints_)) refuse_unreachable(*off);
}

// M (q - q0), then phi(q).
ConstrainedStart::Numbers ConstrainedStart::residual(const MassEquations::Entries& mass, const Numbers& given) const {
    const Numbers away = difference(values_of(system_.q), given);
    Numbers right(away.size(), cln::cl_R(0));
    for (const auto& [place, value] : mass) {
        cln::cl_R& row = right[static_cast<std::size_t>(place.first)];
        row = row + value.value * away[static_cast<std::size_t>(place.second)];
    }
    for (const cln::cl_R& phi : start_.evaluate(constraints_)) right.push_back(phi);
    return right;
}

// From q along a step, the whole of it, a half, a quarter, ... until phi is no larger than before, or no larger than a
// quarter of |G| |step|. A step along the constraints changes phi by the square of its length, which this allows.
void ConstrainedStart::go(const Numbers& q, const Numbers& step) {
    const std::optional<cln::cl_R> before = square();
    cln::cl_R slope = 0, length = 0;
    for (const cln::cl_R& value : start_.evaluate(slopes_)) slope = slope + cln::square(value);
    for (std::size_t k = 0; k < q.size(); ++k) length = length + cln::square(step[k]);
    const cln::cl_R whole = slope * length / 16;
    cln::cl_RA fraction = 1;
    for (int halvings = 0; halvings < 60; ++halvings, fraction = fraction / 2) {
        for (std::size_t k = 0; k < q.size(); ++k) start_.set(system_.q[k], q[k] - fraction * step[k]);
        const std::optional<cln::cl_R> now = square();
        if (now && *now <= cln::max(*before, whole * cln::square(fraction))) return;
    }
}

// Newton's step, where what it leaves to do is a quarter of `step` at most; else positions stay.
bool ConstrainedStart::newton_step(const MassEquations::Entries& mass, const Numbers& given, const Numbers& right,
                                   const Elimination& step) {
    if (bends_.empty()) find_bends();
    const Numbers q = values_of(system_.q);
    const std::size_t n = q.size();
    for (std::size_t c = 0; c < mu_.size(); ++c) start_.set(mu_[c], step.vector[n + c]);
    bool is_better = false;
    try {
        MassEquations::Entries block = mass;
        const std::vector<Sized> bends = start_.evaluate_sized(bends_);
        for (std::size_t i = 0; i < bends.size(); ++i) {
            Sized& entry = block.try_emplace(bend_places_[i], Sized{cln::cl_R(0), cln::cl_R(0)}).first->second;
            entry.value = entry.value - bends[i].value;
            entry.size = entry.size + bends[i].size;
        }
        const Elimination newton = equations_.eliminate(block, right);
        if (!newton.singular) {
            for (std::size_t k = 0; k < n; ++k) start_.set(system_.q[k], q[k] - newton.vector[k]);
            const Elimination left = equations_.eliminate(mass, residual(mass, given));
            const auto positions = [n](const Elimination& of) {
                return Numbers(of.vector.begin(), of.vector.begin() + static_cast<std::ptrdiff_t>(n));
            };
            is_better = !left.singular && 4 * largest_of(positions(left)) <= largest_of(positions(step)) &&
                        goes_down(mass, right, newton, step);
        }
    } catch (const DomainError&) {
    }
    for (const auto& mu : mu_) start_.set(mu, cln::cl_R(0));
    if (!is_better)
        for (std::size_t k = 0; k < n; ++k) start_.set(system_.q[k], q[k]);
    return is_better;
}

// Whether the part of Newton's step along the constraints reduces the distance, as that of `step` does. Else it leads
// to a saddle of the distance.
bool ConstrainedStart::goes_down(const MassEquations::Entries& mass, Numbers right, const Elimination& newton,
                                 const Elimination& step) const {
    std::fill_n(right.begin(), system_.q.size(), cln::cl_R(0));
    const Elimination across = equations_.eliminate(mass, right);  // to the constraints alone, in both steps
    cln::cl_R together = 0;
    for (const auto& [place, value] : mass) {
        const auto i = static_cast<std::size_t>(place.first), j = static_cast<std::size_t>(place.second);
        together = together + (newton.vector[i] - across.vector[i]) * value.value * (step.vector[j] - across.vector[j]);
    }
    return !(together < 0);
}

// The second derivatives of mu phi.
void ConstrainedStart::find_bends() {
    std::map<std::pair<int, int>, GiNaC::ex> sums;
    for (const auto& [place, slope] : system_.constraint_q.entries())
        for (std::size_t k = 0; k < system_.q.size(); ++k)
            if (slope.has(system_.q[k]))
                sums[{place.second, static_cast<int>(k)}] +=
                    mu_[static_cast<std::size_t>(place.first)] * slope.diff(system_.q[k]);
    std::vector<GiNaC::ex> formulas;
    for (const auto& [place, sum] : sums) {
        bend_places_.push_back(place);
        formulas.push_back(sum);
    }
    bends_ = start_.convert(formulas);
}

// M (v - v0) + G^T mu = 0, G v + dphi/dt = 0; the second look takes the rounding of the first away.
void ConstrainedStart::keep_velocities() {
    const bool by_momentum = scene_.start == Start::momentum;
    const std::optional<std::size_t> off = by_momentum ? pulled() : furthest(rates_);
    const std::string what = !off          ? ""
                             : by_momentum ? "its momenta are those of no velocity that keeps it"
                                           : "its velocities change its left side minus its right side at the rate " +
                                                 value_text(rates_, *off);
    const Numbers given = values_of(system_.v);
    for (int look = 0; look < 2; ++look) {
        Numbers right(system_.q.size(), cln::cl_R(0));
        for (const cln::cl_R& rate : start_.evaluate(rates_)) right.push_back(rate);
        const Elimination step = equations_.eliminate(right);
        for (std::size_t k = 0; k < system_.v.size(); ++k)
            start_.set(system_.v[k], start_.get(system_.v[k]) - step.vector[k]);
    }
    // What constraints take away wholly is 0, not the rounding that is left of it.
    const cln::cl_R nothing = largest_of(given) * power_of_ten(-30);
    for (std::size_t k = 0; k < given.size(); ++k) {
        const cln::cl_R value = start_.get(system_.v[k]);
        if (value != given[k] && cln::abs(value) <= nothing) start_.set(system_.v[k], cln::cl_R(0));
    }
    if (!off || scene_.run.assemble) return;
    refuse(*off, what,
           by_momentum ? "the velocities " + moved_text(system_.v, Numbers(given.size(), cln::cl_R(0)))
                       : moved_text(system_.v, given));
}

// The constraint, or its rate, that is furthest from 0, beyond the rounding of a double.
std::optional<std::size_t> ConstrainedStart::furthest(const std::vector<Id>& of) const {
    const std::vector<Sized> values = start_.evaluate_sized(of);
    const cln::cl_R rounding = power_of_ten(-14);
    std::optional<std::size_t> worst;
    for (std::size_t c = 0; c < values.size(); ++c)
        if (cln::abs(values[c].value) > values[c].size * rounding &&
            (!worst || cln::abs(values[c].value) > cln::abs(values[*worst].value)))
            worst = c;
    return worst;
}

// The constraint whose multiplier takes most away from the momenta that are given, beyond the rounding of a double.
std::optional<std::size_t> ConstrainedStart::pulled() const {
    cln::cl_R size = 0;
    for (const cln::cl_R& p : start_.evaluate(momentum_)) size = cln::max(size, cln::abs(p));
    std::optional<std::size_t> most;
    for (std::size_t c = 0; c < mu_.size(); ++c)
        if (cln::abs(start_.get(mu_[c])) > size * power_of_ten(-14) &&
            (!most || cln::abs(start_.get(mu_[c])) > cln::abs(start_.get(mu_[*most]))))
            most = c;
    return most;
}

// The sum of the squares of the constraints; nothing where one has no value.
std::optional<cln::cl_R> ConstrainedStart::square() const {
    try {
        cln::cl_R sum = 0;
        for (const cln::cl_R& phi : start_.evaluate(constraints_)) sum = sum + cln::square(phi);
        return sum;
    } catch (const DomainError&) {
        return std::nullopt;
    }
}

ConstrainedStart::Numbers ConstrainedStart::values_of(const std::vector<GiNaC::symbol>& symbols) const {
    Numbers values;
    for (const auto& symbol : symbols) values.push_back(start_.get(symbol));
    return values;
}

std::string ConstrainedStart::value_text(const std::vector<Id>& of, std::size_t constraint) const {
    return decimal(start_.evaluate(of)[constraint], 6);
}

// "x = 0.6, y = 0.8": of those that have moved.
std::string ConstrainedStart::moved_text(const std::vector<GiNaC::symbol>& symbols, const Numbers& before) const {
    std::string text;
    int shown = 0;
    for (std::size_t k = 0; k < symbols.size(); ++k) {
        const cln::cl_R value = start_.get(symbols[k]);
        if (cln::abs(value - before[k]) <= cln::abs(value) * power_of_ten(-30)) continue;
        if (++shown > 8) return text + ", ...";
        text += fmt::format("{}{}{} = {}", shown == 1 ? "" : ", ", scene_.coordinates[k].written,
                            &symbols == &system_.v ? "'" : "", decimal(value, 17));
    }
    return text;
}

void ConstrainedStart::refuse(std::size_t constraint, const std::string& what, const std::string& nearest) const {
    const Constraint& of = system_.constraints[constraint];
    scene_.source.fail(of.at, fmt::format("the start does not keep the constraint {} ({}): {}; the nearest start that "
                                          "keeps all constraints has {}: {}, or add assemble = true to [run]",
                                          of.written, of.text, what, nearest,
                                          scene_.bodies.empty() ? "write that" : "bring bodies and joints there"));
}

void ConstrainedStart::refuse_unreachable(std::size_t constraint) const {
    const Constraint& of = system_.constraints[constraint];
    scene_.source.fail(
        of.at, fmt::format("no positions near the start keep the constraints: {} ({}) stays off by {}. If they form a "
                           "loop, it cannot close: change the lengths, or start nearer",
                           of.written, of.text, value_text(constraints_, constraint)));
}

}  // namespace lobatto
