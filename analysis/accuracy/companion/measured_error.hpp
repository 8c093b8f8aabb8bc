// SPDX-License-Identifier: GPL-2.0-or-later
// The measured error of a run, as numbers and as the printed line. It is computed elsewhere: of a run by
// Companion::compare (comparison.cpp), of the trajectories of a sweep in ensemble_companion.cpp.
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "generator/scene/scene.hpp"

namespace lobatto {

inline constexpr double large_error = 0.01;  // of the amplitude: worth a warning whoever asked

struct MeasuredError {
    double end = 0;               // at `until`: of the positions, relative to the amplitude of each; the largest
    std::size_t coordinate = 0;   // of which it is
    double absolute = 0;          // the same in its unit
    double largest = 0;           // over all comparisons
    double until = 0;             // the time of the last comparison
    bool complete = false;        // that is the end of the run
    bool end_is_largest = false;  // `end` is the largest error so far: the two are near again, perhaps by chance
    // `end`; of what was not compared, as errors of this run grew so far; not a number where that is far more than what
    // was compared.
    double at_end = 0;
    std::vector<double> lost_q, lost_p;       // where the run was then
    std::optional<double> lost_after;         // from then on the error is as large as the motion
    std::optional<double> doubling;           // of errors that grow exponentially: the time in which they double
    bool rests = false;                       // the run, while the companion may leave its place
    std::optional<double> companion_stopped;  // the time where the companion could not go on, though the run could

    bool is_lost() const { return lost_after.has_value(); }
    bool is_known_at_end() const { return !std::isnan(at_end); }
    double worst() const { return std::fmax(at_end, largest); }
};

// One line.
std::string text_of(const MeasuredError& error, const Scene& scene);
// Where `at_end` is no measurement, that it is none; for those who do not read that line. Empty: it is one.
std::string not_measured_at_end(const MeasuredError& error);

}  // namespace lobatto
