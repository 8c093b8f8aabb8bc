// SPDX-License-Identifier: GPL-2.0-or-later
// The derivative of a step by a parameter or an input: central differences of order 6, at distances that grow from very
// small ones for as long as each agrees with those before it. So what is far from the value has no say: a formula that
// saturates there, a wall, a place where no step can be taken.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "library/parts.hpp"

namespace lobatto::api {

namespace {

constexpr double rounding = 0x1p-50;         // of a state: a few units in the last place
constexpr double first = 0x1p-30, grow = 4;  // distances: the first, of the value or of 1; the ratio of neighbours
constexpr int most = 30, most_inwards = 8;   // of them; times that the first is made smaller
constexpr double inwards = 0x1p-12, nearest = 0x1p-43;  // of the value, whose last place is not far
constexpr double bent = 0.01;      // of a slope: what order 4 corrects of order 2, where a distance is far too large
constexpr double wanted = 1e-5;    // of a derivative, that it is known to
constexpr double roundings = 128;  // or of the rounding of the states, where it is about zero

using State = std::vector<double>;

// q, p after the step from where the stepper is, with another value; nothing where there is no such step.
std::optional<State> stepped(const Stepper& from, const std::string& name, double value) {
    try {
        Stepper stepper(from);
        stepper.set(name, value);
        if (!stepper.step()) return std::nullopt;
        State state(stepper.q(), stepper.q() + stepper.coordinates());
        state.insert(state.end(), stepper.p(), stepper.p() + stepper.coordinates());
        return state;
    } catch (const Error&) {
        return std::nullopt;
    }
}

// Of one number at one distance: its slope, how far that is known, how far by rounding alone, and by how much the
// slopes of the two sides differ.
struct Slope {
    double value = 0, error = std::numeric_limits<double>::infinity(), noise = 0, kink = 0, correction = 0, scatter = 0;
};

std::optional<std::vector<Slope>> slopes_at(const Stepper& stepper, const std::string& name, double value,
                                            double distance, const State& here, const State& scatter) {
    std::array<State, 7> states;  // from -3 to 3 distances
    for (int i = -3; i <= 3; ++i) {
        if (i == 0) continue;
        auto state = stepped(stepper, name, value + i * distance);
        if (!state) return std::nullopt;
        states[static_cast<std::size_t>(i + 3)] = std::move(*state);
    }
    std::vector<Slope> slopes(here.size());
    for (std::size_t k = 0; k < here.size(); ++k) {
        const auto f = [&](int i) { return states[static_cast<std::size_t>(i + 3)][k]; };
        const double one = f(1) - f(-1), two = f(2) - f(-2), three = f(3) - f(-3), second = one / (2 * distance),
                     fourth = (8 * one - two) / (12 * distance);
        Slope& slope = slopes[k];
        slope.value = (45 * one - 9 * two + three) / (60 * distance);
        // Of the states; in the error also of the values at these distances.
        const double size = std::fmax(std::fabs(f(1)), std::fmax(std::fabs(f(-1)), std::fabs(here[k])));
        slope.noise = std::fmax(rounding * size, scatter[k]) / distance;
        slope.scatter = std::fabs(f(3) + f(-3) - 6 * (f(2) + f(-2)) + 15 * (f(1) + f(-1)) - 20 * here[k]) / 8;
        slope.error =
            std::fabs(slope.value - fourth) + slope.noise + rounding / distance * std::fabs(slope.value * value);
        slope.kink = std::fabs(f(1) - 2 * here[k] + f(-1)) / distance;
        slope.correction = std::fabs(fourth - second);
    }
    return slopes;
}

bool is_far_too_large(const std::optional<std::vector<Slope>>& slopes) {
    return !slopes || std::any_of(slopes->begin(), slopes->end(), [](const Slope& slope) {
        return slope.correction > bent * std::fabs(slope.value) + roundings * slope.noise;
    });
}

}  // namespace

std::vector<double> Stepper::sensitivity(const std::string& name) const {
    const double value = parameter(name);
    const auto refuse = [&] {
        throw ComputationError(fmt::format(
            "sensitivity: the step from here has no derivative by {} at {:.6g}: it cannot be taken with values beside "
            "that, ends at a stop, or the two sides have other slopes, as where abs and max have their corner or a "
            "wall "
            "is just met",
            name, value));
    };
    const std::optional<State> here = stepped(*this, name, value);
    if (!here) refuse();
    State scatter(here->size(), 0.0);
    double distance = first * (value != 0 ? std::fabs(value) : 1);
    std::optional<std::vector<Slope>> slopes = slopes_at(*this, name, value, distance, *here, scatter);
    for (int i = 0; i < most_inwards && is_far_too_large(slopes); ++i) {
        if (distance * inwards < nearest * std::fabs(value)) refuse();
        slopes = slopes_at(*this, name, value, distance *= inwards, *here, scatter);
    }
    if (!slopes) refuse();
    for (std::size_t k = 0; k < scatter.size(); ++k) {
        Slope& slope = (*slopes)[k];
        scatter[k] = slope.scatter;
        slope.noise = std::fmax(slope.noise, scatter[k] / distance);
        slope.error += slope.noise;
    }
    std::vector<Slope> best = *slopes, before = *slopes;
    std::vector<bool> agrees(best.size(), true), is_judged(best.size(), false), has_kink(best.size(), false);
    for (int i = 1; i < most && std::find(agrees.begin(), agrees.end(), true) != agrees.end(); ++i) {
        slopes = slopes_at(*this, name, value, distance *= grow, *here, scatter);
        if (!slopes) break;
        for (std::size_t k = 0; k < best.size(); ++k) {
            const Slope& slope = (*slopes)[k];
            if (!agrees[k]) continue;
            agrees[k] = std::fabs(slope.value - best[k].value) <= 4 * (slope.error + best[k].error);
            if (!agrees[k]) continue;
            // Second differences over the distance grow in proportion to it, and where there is a kink not at all: at
            // the first distance where rounding does not hide them.
            if (!is_judged[k] && before[k].kink > roundings * before[k].noise) {
                is_judged[k] = true;
                has_kink[k] = before[k].kink > 2 / grow * slope.kink;
            }
            if (slope.error < best[k].error) best[k] = slope;
        }
        before = *slopes;
    }
    std::vector<double> derivative;
    for (std::size_t k = 0; k < best.size(); ++k) {
        const bool is_known = best[k].error <= wanted * std::fabs(best[k].value) + roundings * best[k].noise;
        if (!is_known || has_kink[k]) refuse();
        derivative.push_back(best[k].value);
    }
    return derivative;
}

}  // namespace lobatto::api
