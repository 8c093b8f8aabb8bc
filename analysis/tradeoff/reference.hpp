// SPDX-License-Identifier: GPL-2.0-or-later
// Where a scene truly is at evenly spaced times, computed in two ways, and how far these agree.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "analysis/exact_start.hpp"
#include "analysis/tradeoff/candidate.hpp"
#include "runtime/build/library.hpp"
#include "runtime/error.hpp"

namespace lobatto {

struct Reference {
    Precision precision = Precision::quadruple;
    std::string first, second;  // the two ways, in words
    double until = 0;           // the time it covers; shorter than asked for when the formulas fail on the way
    int samples = 0;            // rows at i until/samples, i = 0 ... samples
    std::size_t n = 0;
    std::size_t compared = 0;  // of the 2n: all; where walls throw the motion back, positions only: a momentum that
                               // jumps is another one just before and just after
    std::int64_t steps = 0;    // of the family, where steps are cut; else 0
    std::vector<double> high, low;     // (samples + 1) x 2n, q then p: the state is the sum of both
    std::vector<double> scale;         // 2n: half the way between smallest and largest value, the largest among the
                                       // coordinates of the same unit, momenta likewise; where nothing moves, the
                                       // place that constraints measure it by, or 1
    std::vector<double> disagreement;  // samples + 1: of the two ways up to there, relative to `scale`
    double tolerance = 0;              // of a macro step of the extrapolation
    double energy_scale = 0;           // the largest |p v|/2
    double frequency = 0;              // the largest met (largest_frequency)
    double frequency_at_start = 0;     // likewise
    double usual_frequency = 0;        // at half of the places, the largest there is this or more
    double seconds = 0;                // that it took
    bool is_late = false;              // more time would have made it better

    double time(int sample) const { return until * sample / samples; }
    // The last time up to which the two ways differ by less than this.
    double trusted_until(double error) const;
};

struct ReferenceRequest {
    double until = 0;
    double wanted = 1e-20;       // the disagreement that is good enough
    double seconds_limit = 10;   // of wall time, beyond which it stays as good as it is
    std::vector<int> groups;     // n: coordinates of the same unit have the same number
    std::vector<double> places;  // 2n: what constraints measure the rounding of positions by; empty: there are none
    bool is_cut = false;         // steps are, at walls, or where formulas are not smooth
    bool has_walls = false;      // at which momenta jump
    const volatile int* interrupted = nullptr;
};

// It cannot be had within the time that is given.
class TooSlow : public ComputationError {
public:
    TooSlow(const std::string& message, double reached_time) : ComputationError(message), reached(reached_time) {}
    double reached;  // the time to which that would do, about
};

// With a kernel of the family in extended or quadruple precision. ComputationError when there is no reference.
Reference compute_reference(const Kernel& kernel, const ExactStart& start, const ReferenceRequest& request);

// Of a motion whose steps are cut, which extrapolation cannot follow: by shorter and shorter steps of the family.
Reference compute_cut_reference(const Kernel& kernel, const ExactStart& start, const ReferenceRequest& request);

// Thrown between two steps when the flag is raised.
class Interrupted {};

}  // namespace lobatto
