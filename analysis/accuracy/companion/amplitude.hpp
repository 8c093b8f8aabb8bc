// SPDX-License-Identifier: GPL-2.0-or-later
// What errors are measured by: how far each position and momentum moves.
#pragma once

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "generator/scene/scene.hpp"

namespace lobatto {

// Of the place, by which what rests moves: the roundings of the forces there add to its own.
constexpr double few_roundings = 128;

constexpr double by_chance = 0.1;  // of an amplitude: what is apart by more may meet again, and is no small error then
constexpr double out_of_step = 0.5;  // of an amplitude: two motions of which each knows nothing of the other
constexpr double noise = 1e-10;      // of what moves a number: where that cancels, rounding leaves less

// Coordinates whose errors are measured by one amplitude have the same number: those of an array.
std::vector<int> amplitude_groups(const Scene& scene);

// The coordinates that stand in the formulas of walls.
std::vector<bool> stands_in_walls(const Scene& scene);

// Takes a row of `count` numbers into a range.
void widen_to(std::vector<double>& least, std::vector<double>& most, const double* row, std::size_t count);

// Of q then p: which move by more than rounding does, which is this part of their place. `places`: of each number
// (places_of).
std::vector<bool> moving(const std::vector<double>& least, const std::vector<double>& most,
                         const std::vector<double>& places, double rounding);
// That part for all steps of a run together, in numbers with this epsilon.
double rounding_of_run(double epsilon);

// For each number `noise` times the largest size of its kind, positions or momenta. A number that moves by less may be
// moved by rounding alone: forces may cancel, and constraints may hold a momentum at 0.
std::vector<double> noise_levels(const std::vector<double>& sizes);

// An amplitude below its noise level becomes 0 if the run and its companion do not agree on this number in most of the
// first comparisons. `pair(j, i)`: number i at comparison j, of the run and of the companion. `start`: q, p.
// A coordinate in a far larger unit is small, too, but it is left alone: it does not rest at 0 at the start, and the
// product of its amplitude and that of its momentum is not small, or it starts with much more than rounding.
void leave_out_noise(std::vector<double>& amplitudes, std::size_t comparisons, const std::vector<double>& start,
                     const std::function<std::pair<double, double>(std::size_t, std::size_t)>& pair);

// How far each number moved until the first comparison, half its range, and in how many steps.
struct FirstMoves {
    std::vector<double> amplitudes;
    double steps;
};

// An amplitude becomes 0 if the run and its companion differ by more than half of it, and it is no larger than one
// rounding of the place a step, from the beginning: what rests moves by that. `places`: as above.
void leave_out_rounding(std::vector<double>& amplitudes, std::size_t comparisons, const std::vector<double>& places,
                        double steps, double epsilon, const FirstMoves& first,
                        const std::function<std::pair<double, double>(std::size_t, std::size_t)>& pair);

// Between walls a body may be at one place after each step, of the run and of the companion. Where a position of these,
// `meets_wall`, goes nowhere and has a velocity, its amplitude becomes a part of what it goes in a step. `pace`: at the
// start (pace_at, errors_of_steps.hpp).
void widen_by_pace(std::vector<double>& amplitudes, const std::vector<bool>& meets_wall,
                   const std::vector<double>& pace);

// What the rounding of numbers in a range is measured by: the largest size of each, or what constraints make of it
// (constraint_sizes.hpp; empty: there are none).
std::vector<double> places_of(const std::vector<double>& least, const std::vector<double>& most,
                              const std::vector<double>& by_constraints);

// Half of each range.
std::vector<double> half_of(const std::vector<double>& least, const std::vector<double>& most);

// Half of each range, q then p, the largest of a group; 0: of what does not move, or by no more than rounding, which is
// some epsilon of the place.
std::vector<double> amplitudes_of(const std::vector<double>& least, const std::vector<double>& most,
                                  const std::vector<double>& places, const std::vector<int>& groups, double epsilon);

}  // namespace lobatto
