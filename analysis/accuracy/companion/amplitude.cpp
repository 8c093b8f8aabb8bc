// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/companion/amplitude.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

namespace lobatto {

namespace {

constexpr double displaced = 0.01;  // of its amplitude, at the start: what moves, not what rounding moves
// Of the largest place of all: what is left of rounding where a constraint holds a coordinate at 0. Newton's iteration
// squares it each time; a motion that small beside others is none.
constexpr double held_at_zero = 0x1p-100;
constexpr double many_roundings = 0x1p-45;  // of the largest amplitude: what starts with more was meant to
constexpr double part_of_step = 1.0 / 16;   // that is a part of the amplitude of all motions that a step resolves
constexpr double nowhere = 1e-6;            // of what it goes in a step
constexpr std::size_t first_compared = 16;  // comparisons: by then other motions are known, if steps are of any use

}  // namespace

std::vector<int> amplitude_groups(const Scene& scene) {
    std::map<std::string, int> numbers;
    std::vector<int> groups;
    for (const Coordinate& coordinate : scene.coordinates) {
        const std::string array = coordinate.array();
        groups.push_back(numbers.try_emplace(array, static_cast<int>(numbers.size())).first->second);
    }
    return groups;
}

std::vector<bool> stands_in_walls(const Scene& scene) {
    std::vector<bool> held;
    for (const Coordinate& coordinate : scene.coordinates)
        held.push_back(std::any_of(scene.impacts.begin(), scene.impacts.end(),
                                   [&](const Impact& impact) { return impact.when.value.has(coordinate.position); }));
    return held;
}

void widen_to(std::vector<double>& least, std::vector<double>& most, const double* row, std::size_t count) {
    if (least.empty()) least.assign(row, row + count), most = least;
    for (std::size_t i = 0; i < count; ++i) {
        least[i] = std::fmin(least[i], row[i]);
        most[i] = std::fmax(most[i], row[i]);
    }
}

std::vector<bool> moving(const std::vector<double>& least, const std::vector<double>& most,
                         const std::vector<double>& places, double rounding) {
    const std::size_t n = least.size() / 2;
    double farthest[2] = {0, 0};  // of positions, of momenta
    for (std::size_t i = 0; i < 2 * n; ++i)
        farthest[i / n] = std::fmax(farthest[i / n], std::fmax(std::fabs(least[i]), std::fabs(most[i])));
    std::vector<bool> moves(2 * n);
    for (std::size_t i = 0; i < 2 * n; ++i) {
        const double half = (most[i] - least[i]) / 2;
        moves[i] = half > rounding * places[i] && half > held_at_zero * farthest[i / n];
    }
    return moves;
}

double rounding_of_run(double epsilon) {
    return std::fmax(0x1p-40, few_roundings * epsilon);
}

std::vector<double> noise_levels(const std::vector<double>& sizes) {
    const auto middle = sizes.begin() + std::ssize(sizes) / 2;
    std::vector<double> levels;
    for (const auto& [begin, end] : {std::pair{sizes.begin(), middle}, std::pair{middle, sizes.end()}})
        levels.insert(levels.end(), static_cast<std::size_t>(end - begin), noise * *std::max_element(begin, end));
    return levels;
}

void leave_out_noise(std::vector<double>& amplitudes, std::size_t comparisons, const std::vector<double>& start,
                     const std::function<std::pair<double, double>(std::size_t, std::size_t)>& pair) {
    const std::vector<double> levels = noise_levels(amplitudes);
    const std::size_t n = amplitudes.size() / 2;
    std::vector<double> products;  // do not depend on units
    for (std::size_t k = 0; k < n; ++k) products.push_back(amplitudes[k] * amplitudes[n + k]);
    const double smallest = noise * *std::max_element(products.begin(), products.end());
    const auto is_displaced = [&](std::size_t i) {
        return start[i] != 0 && std::fabs(start[i]) >= displaced * amplitudes[i];
    };
    const auto is_small_but_meant = [&](std::size_t i) {
        return amplitudes[i] < levels[i] && amplitudes[i] > many_roundings / noise * levels[i];
    };
    const auto is_of_another_unit = [&](std::size_t k) {
        return (is_displaced(k) && (products[k] > smallest || is_small_but_meant(k))) ||
               (is_displaced(n + k) && (products[k] > smallest || is_small_but_meant(n + k)));
    };
    for (std::size_t i = 0; i < amplitudes.size(); ++i) {
        if (!(amplitudes[i] > 0 && amplitudes[i] < levels[i] && !is_of_another_unit(i % n))) continue;
        int agree = 0, disagree = 0;
        for (std::size_t j = 0; j < std::min(comparisons, first_compared); ++j) {
            const auto [run, companion] = pair(j, i);
            const double size = std::fmax(std::fabs(run), std::fabs(companion));
            if (size > 0) ++(std::fabs(run - companion) > by_chance * size ? disagree : agree);
        }
        if (disagree > agree) amplitudes[i] = 0;
    }
}

void leave_out_rounding(std::vector<double>& amplitudes, std::size_t comparisons, const std::vector<double>& places,
                        double steps, double epsilon, const FirstMoves& first,
                        const std::function<std::pair<double, double>(std::size_t, std::size_t)>& pair) {
    const std::size_t n = amplitudes.size() / 2;
    for (std::size_t i = 0; i < 2 * n; ++i) {
        if (!(amplitudes[i] > 0 && amplitudes[i] < epsilon * steps * places[i])) continue;
        if (first.amplitudes[i] > epsilon * (first.steps + few_roundings) * places[i]) continue;
        for (std::size_t j = 0; j < comparisons && amplitudes[i] > 0; ++j) {
            const auto [run, companion] = pair(j, i);
            if (std::fabs(run - companion) > out_of_step * amplitudes[i]) amplitudes[i] = 0;
        }
        if (i < n && amplitudes[i] == 0) amplitudes[n + i] = 0;
    }
}

void widen_by_pace(std::vector<double>& amplitudes, const std::vector<bool>& meets_wall,
                   const std::vector<double>& pace) {
    for (std::size_t k = 0; k < pace.size() / 2; ++k)
        if (const double way = std::fabs(pace[k]); meets_wall[k] && amplitudes[k] < nowhere * way)
            amplitudes[k] = part_of_step * way;
}

std::vector<double> places_of(const std::vector<double>& least, const std::vector<double>& most,
                              const std::vector<double>& by_constraints) {
    std::vector<double> places = by_constraints;
    places.resize(least.size(), 0.0);
    for (std::size_t i = 0; i < least.size(); ++i)
        places[i] = std::fmax(places[i], std::fmax(std::fabs(least[i]), std::fabs(most[i])));
    return places;
}

std::vector<double> half_of(const std::vector<double>& least, const std::vector<double>& most) {
    std::vector<double> half;
    for (std::size_t i = 0; i < least.size(); ++i) half.push_back((most[i] - least[i]) / 2);
    return half;
}

std::vector<double> amplitudes_of(const std::vector<double>& least, const std::vector<double>& most,
                                  const std::vector<double>& places, const std::vector<int>& groups, double epsilon) {
    const std::size_t n = groups.size();
    std::vector<double> own(2 * n), shared(2 * n, 0.0);
    const std::vector<bool> moves = moving(least, most, places, few_roundings * epsilon);
    const std::vector<double> half = half_of(least, most);
    for (std::size_t i = 0; i < 2 * n; ++i) own[i] = moves[i] ? half[i] : 0;
    for (std::size_t k = 0; k < n; ++k)
        if (own[k] == 0) own[n + k] = 0;  // what rests has the momentum that rounding gives it
    std::map<std::pair<bool, int>, double> largest;
    for (std::size_t i = 0; i < 2 * n; ++i) {
        double& of_group = largest[{i < n, groups[i % n]}];
        of_group = std::fmax(of_group, own[i]);
    }
    for (std::size_t i = 0; i < 2 * n; ++i) shared[i] = largest[{i < n, groups[i % n]}];
    return shared;
}

}  // namespace lobatto
