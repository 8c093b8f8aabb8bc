// SPDX-License-Identifier: GPL-2.0-or-later
// What can win is found with few measurements: orders are known, so a few runs tell what the others would give.
#pragma once

#include <optional>
#include <vector>

#include "analysis/tradeoff/experiment.hpp"

namespace lobatto {

// One member's coarsest steps that meet a goal.
struct Attempt {
    std::optional<Measurement> measurement;  // nothing: it does not reach the goal
    double least_error = 0;                  // what it does reach
    bool is_rounding = false;                // more steps bring nothing
    double seconds = 0;  // infinite without; else the less of its time and of the same steps' with a looser iteration
};
// Runs to stagnation, with a handful of steps: from the error of one the next is told by the order. Runs that take
// longer than `limit` seconds are left: others are faster.
Attempt cross(Experiment& experiment, const Member& member, double goal, double limit = infinity);

// The fastest way to the goal with this member: with longer steps, where the error does not grow evenly with them; with
// iterations that stop earlier; with steps that are shorter but need fewer fixed-point iterations.
Measurement polish(Experiment& experiment, const Measurement& crossing, double goal);

// The fastest of the whole family in these numbers for an error at most `goal`, as far as the time goes.
struct Search {
    std::optional<Measurement> best;  // nothing: no member that was tried reaches the goal
    double least_error = 0;           // of all that was tried
    bool is_rounding = false;         // that is rounding
    int members = 0;                  // tried
    bool complete = false;            // no member that was not tried can be expected to win
};
Search search(Experiment& experiment, double goal, Precision numbers);
// The kernels to begin with.
std::vector<Member> first_guess(double goal, std::size_t count, Precision numbers);

}  // namespace lobatto
