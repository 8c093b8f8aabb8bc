// SPDX-License-Identifier: GPL-2.0-or-later
// Whether the step of a run suits its motion: against the stability limit, and in the steps where the motion changes
// most.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/accuracy/hardest_steps.hpp"
#include "analysis/accuracy/watch/some_states.hpp"
#include "generator/mechanics/outline.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

class StepJudge {
public:
    // Looks at the kept states go by: how far the motion goes, where it changes most, and a few states of all its
    // times.
    explicit StepJudge(const Scene& scene);
    void observe(const Records& records);

    // What it has observed so far, for a run that continues.
    std::vector<double> save() const;
    void restore(const std::vector<double>& saved);

    struct Judgement {
        double radians = 0;  // h times the largest frequency met; 0: not looked for
        double kept = 0;     // what long steps keep of velocities that a fast damping takes, of their amplitude
        double limit = 0;    // of that, by linear stability; infinite when it lies above, and for Gauss
        struct Unresolved {
            std::int64_t step;  // the first is 1
            double time;        // of its start
        };
        std::optional<Unresolved> unresolved;  // the first such step that was found
        double rounding = 0;                   // inside the formulas of forces, as a part of them: force_rounding.hpp
    };
    Judgement judge(const Outline& outline, const Kernel& kernel, const TrajectoryRequest& request,
                    const TrajectoryResult& result) const;
    // One warning a string. `error`: the measured one, or 0.
    static std::vector<std::string> warnings(const Judgement& judgement, double error);

private:
    std::vector<int> groups_;           // coordinates that share an amplitude have the same number
    std::int64_t rows_a_step_;          // states between the steps are less accurate than those at them
    std::vector<double> least_, most_;  // 2n
    SomeStates some_;
    HardestSteps hardest_;
    std::int64_t seen_ = 0;
    std::vector<bool> resting(LoadedStepper<double>& stepper, const TrajectoryRequest& request,
                              const std::vector<double>& sizes) const;
};

}  // namespace lobatto
