// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/hardest_steps.hpp"

#include <algorithm>
#include <cmath>

namespace lobatto {

namespace {

constexpr std::size_t shared = 16;       // places for positions, and for momenta
constexpr double step_work = 3e5;        // steps times numbers of a state that are taken again; more are not
constexpr double grossly = 0.1;          // of what a step moves
constexpr double spike = 100;            // times as fast as at the ends of the step
constexpr std::size_t spike_limit = 64;  // coordinates
constexpr int looks = 16, closer = 60;   // at the way of a step; then golden sections
constexpr double golden = 0.6180339887498949;
constexpr double first_part = 0.4142135623730950;  // sqrt(2) - 1: the nodes of Lobatto and Gauss hold other roots

// Of the `every` states from `state` on, the one from which a step goes furthest.
std::vector<double> before_furthest(LoadedStepper<double>& stepper, const std::vector<double>& state,
                                    std::int64_t every, const std::vector<double>& scale) {
    std::vector<double> furthest = state, here = state;
    if (every == 1 || start_at(stepper, state) != LOBATTO_OK) return furthest;
    double largest = 0;
    for (std::int64_t i = 0; i < every; ++i) {
        const std::vector<double> next = state_after(stepper, 1);
        if (next.empty()) break;
        if (const double moved = distance(next, here, scale); moved > largest) {
            largest = moved;
            furthest = here;
        }
        here = next;
    }
    return furthest;
}

// After a step from each state; empty where it fails, and where there is none.
States<double> ends_of(LoadedStepper<double>& stepper, const States<double>& states) {
    States<double> ends(states.size());
    for (std::size_t i = 0; i < states.size(); ++i)
        if (!states[i].empty() && start_at(stepper, states[i]) == LOBATTO_OK) ends[i] = state_after(stepper, 1);
    return ends;
}

// Whether on the straight way from one state to the next a velocity or a force is far larger than at both ends and in
// between: a singularity, or a barrier, that no node of the step has met.
bool jumps_over(LoadedStepper<double>& stepper, const std::vector<double>& from, const std::vector<double>& to,
                double step, const std::vector<double>& scale) {
    const std::size_t n = from.size() / 2;
    if (n > spike_limit) return false;
    // |q'|, |p'| at a part of the way; nothing where there are none.
    const auto rates = [&](double part) {
        std::vector<double> q(n), p(n), v, Lv, Lq;
        const auto between = [&](std::size_t k) {
            return from[1 + k] + static_cast<double>(part) * (to[1 + k] - from[1 + k]);
        };
        for (std::size_t k = 0; k < n; ++k) q[k] = between(k), p[k] = between(n + k);
        std::vector<double> sizes;
        if (stepper.velocity(from[0], q, p, v) != LOBATTO_OK) return sizes;
        stepper.slopes(from[0], q, v, Lv, Lq);
        for (const std::vector<double>* part_of : {&v, &Lq})
            for (const double rate : *part_of) sizes.push_back(std::fabs(static_cast<double>(rate)));
        return sizes;
    };
    const std::vector<double> first = rates(0), last = rates(1);
    if (first.empty() || last.empty()) return false;
    const double gone = distance(to, from, scale);
    std::vector<std::vector<double>> inside;
    for (int i = 1; i < looks; ++i) {
        inside.push_back(rates(static_cast<double>(i) / looks));
        if (inside.back().empty()) return true;
    }
    for (std::size_t k = 0; k < 2 * n; ++k) {
        if (std::isinf(scale[k])) continue;
        const double mean = std::fabs((to[1 + k] - from[1 + k]) / step), ordinary = std::max({first[k], last[k], mean});
        const auto most =
            std::max_element(inside.begin(), inside.end(), [k](const auto& x, const auto& y) { return x[k] < y[k]; });
        if (!((*most)[k] > 2 * ordinary)) continue;
        // A number that hardly moves in this step may be many times as fast on a way that no motion takes.
        const double least = std::max(spike * ordinary, grossly * gone * scale[k] / std::fabs(step));
        double low = static_cast<double>(most - inside.begin()) / looks, high = low + 2.0 / looks;
        for (int section = 0; section < closer; ++section) {
            const double left = high - golden * (high - low), right = low + golden * (high - low);
            const std::vector<double> at_left = rates(left), at_right = rates(right);
            if (at_left.empty() || at_right.empty()) return true;
            if (std::max(at_left[k], at_right[k]) > least) return true;
            (at_left[k] > at_right[k] ? high : low) = at_left[k] > at_right[k] ? right : left;
        }
    }
    return false;
}

}  // namespace

HardestSteps::HardestSteps() : places_(2 * shared + 1) {}

void HardestSteps::observe(const std::vector<double>& state, double energy) {
    const std::size_t n = state.size() / 2;
    const auto consider = [&](std::size_t place, double change) {
        if (change < 0) change = -change;
        if (change > places_[place].change) places_[place] = {change, before_};
    };
    if (!before_.empty()) {
        for (std::size_t k = 0; k < n; ++k) {
            consider(k % shared, state[1 + k] - before_[1 + k]);
            consider(shared + k % shared, state[1 + n + k] - before_[1 + n + k]);
        }
        consider(2 * shared, energy - energy_before_);
    }
    before_ = state;
    energy_before_ = energy;
}

States<double> HardestSteps::states() const {
    States<double> states;
    for (const Place& place : places_)
        if (!place.state.empty()) states.push_back(place.state);
    std::sort(states.begin(), states.end());
    states.erase(std::unique(states.begin(), states.end()), states.end());
    return states;
}

std::vector<double> HardestSteps::save() const {
    if (before_.empty()) return {};
    std::vector<double> all = before_;
    all.push_back(energy_before_);
    for (std::size_t i = 0; i < places_.size(); ++i) {
        if (places_[i].state.empty()) continue;
        all.push_back(static_cast<double>(i));
        all.push_back(places_[i].change);
        all.insert(all.end(), places_[i].state.begin(), places_[i].state.end());
    }
    return all;
}

void HardestSteps::restore(const std::vector<double>& saved, std::size_t columns) {
    if (saved.empty()) return;
    const auto width = static_cast<std::ptrdiff_t>(columns);
    auto at = saved.begin();
    before_.assign(at, at + width);
    energy_before_ = at[width];
    for (at += width + 1; at < saved.end(); at += width + 2)
        places_[static_cast<std::size_t>(at[0])] = {at[1], {at + 2, at + 2 + width}};
}

std::optional<double> first_unresolved(LoadedStepper<double>& stepper, const States<double>& states, std::int64_t every,
                                       double end, const std::vector<double>& parameters, double step,
                                       const std::vector<double>& scale) {
    const double work = static_cast<double>(every) * static_cast<double>(states.size() * scale.size());
    States<double> hardest = states;
    if (every > 1 && work <= step_work)
        for (std::vector<double>& state : hardest) {
            const std::int64_t left = std::llround((end - state[0]) / step);
            state = before_furthest(stepper, state, std::min(every, left), scale);
        }
    const States<double> whole = ends_of(stepper, hardest);
    // In two parts that no nodes share with the whole step: what looks constant at its nodes does not look so at
    // theirs.
    if (stepper.prepare(parameters, step * first_part) != LOBATTO_OK) return {};
    const States<double> within = ends_of(stepper, hardest);
    if (stepper.prepare(parameters, step * (1 - first_part)) != LOBATTO_OK) return {};
    const States<double> parted = ends_of(stepper, within);
    stepper.prepare(parameters, step);
    for (std::size_t i = 0; i < hardest.size(); ++i) {
        if (whole[i].empty()) continue;
        const double difference = parted[i].empty() ? HUGE_VAL : distance(parted[i], whole[i], scale);
        if (!(difference <= grossly * distance(whole[i], hardest[i], scale)) ||
            jumps_over(stepper, hardest[i], whole[i], step, scale))
            return hardest[i][0];
    }
    return {};
}

}  // namespace lobatto
