// SPDX-License-Identifier: GPL-2.0-or-later
// The errors of the trajectories of a sweep, measured as those of a run (companion.hpp): each against the same motion
// in 3/2 of the steps, from a start that is four units in the last place away. They are compared at the kept states.
#pragma once

#include <cstdint>
#include <vector>

#include "analysis/accuracy/formulas/constraint_sizes.hpp"
#include "analysis/accuracy/formulas/narrow_terms.hpp"
#include "analysis/accuracy/formulas/pulses.hpp"
#include "generator/mechanics/outline.hpp"
#include "runtime/run/ensemble/ensemble.hpp"

namespace lobatto {

class EnsembleCompanion {
public:
    // What is handed over outlives it. `plain`: the kernel in double. `request`: that of the sweep, with its start.
    EnsembleCompanion(const Outline& outline, const Kernel& kernel, const Kernel& plain,
                      const EnsembleRequest& request);

    struct Error {
        // Of the positions at the end, each by its own amplitude; the largest. The largest of all, where the two were
        // so far apart that they may have met again by chance. Not a number: unknown.
        double relative;
        bool lost;                 // it was as large as the motion, or the companion could not reach the end
        bool interrupted = false;  // before it was measured
    };
    // Of a trajectory that reached the end. To be asked in the order of the indices: the companions of many are
    // computed together.
    Error of(const EnsembleTrajectory& trajectory);

private:
    struct Known {
        lobatto_status status = LOBATTO_NOT_FINITE;
        std::vector<double> rows;    // 2n x parts each: where the trajectory keeps its states, but for the start
        std::vector<double> ranges;  // 2n, 2n: the least and the most on the way to each
    };
    void compute(std::int64_t first);
    // `steps` of the sweep's own from `begin` on; the companions are at `begin` already.
    void take(std::int64_t begin, std::int64_t steps, std::int64_t every);
    // Whether it may meet pulses or narrow terms, or is driven and kept too often for a companion in lanes.
    bool goes_alone(const EnsembleTrajectory& trajectory, const EnsembleStart& start);
    bool meets_narrow_terms(const EnsembleTrajectory& trajectory, const EnsembleStart& start);
    bool has_pulses(const EnsembleStart& start);
    bool go_to_stop(Known& known, const Records& kept, const EnsembleStart& start) const;
    Error alone(const EnsembleTrajectory& trajectory, const EnsembleStart& start) const;
    // As Companion::amplitudes. `pair(j, i)`: number i at comparison j, of the trajectory and of its companion.
    std::vector<double> amplitudes(const Records& kept, const Known& known, const std::vector<double>& parameters,
                                   std::int64_t comparisons,
                                   const std::function<std::pair<double, double>(std::size_t, std::size_t)>& pair);
    std::int64_t every() const {
        return request_.every == 0 ? request_.steps : std::min(request_.every, request_.steps);
    }

    Outline outline_;
    Kernel kernel_;
    std::size_t parts_;
    const EnsembleRequest& request_;
    std::vector<int> groups_;
    std::vector<bool> meets_wall_;          // n
    std::vector<double> pulse_parameters_;  // those that were asked for last
    bool has_pulses_ = false;               // with these
    NarrowTerms narrow_;
    ConstraintSizes constraints_;
    LoadedStepper<double> stepper_;
    std::int64_t first_ = 0;
    double seconds_of_one_ = 0;  // that a companion took, of those computed last
    std::vector<Known> known_;   // from trajectory first_ on
};

}  // namespace lobatto
