// SPDX-License-Identifier: GPL-2.0-or-later
// Whether the step of a run suits its motion: against the stability limit, and by what its own polynomials say.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "generator/pipeline.hpp"
#include "runtime/trajectory.hpp"

namespace lobatto {

class StepJudge {
public:
    // Looks at the kept states go by: how far the motion goes, and a few states of all its times.
    explicit StepJudge(const Scene& scene);
    void look(const Records& records);

    // What it has seen so far, for a later run that goes on.
    std::vector<double> seen() const;
    void go_on_after(const std::vector<double>& seen);

    struct Judgement {
        std::optional<double> error;  // estimated, relative to the amplitude; nothing without dense output
        double radians = 0;           // h times the largest frequency met; 0: not looked for
        double limit = 0;             // of that, by linear stability; infinite for Gauss
    };
    Judgement judge(const Derivation& derivation, const Kernel& kernel, const TrajectoryRequest& request,
                    const TrajectoryResult& result) const;
    // One warning a string.
    static std::vector<std::string> warnings(const Judgement& judgement, double wanted_error);

private:
    std::vector<int> groups_;                // coordinates of the same unit have the same number
    std::vector<double> least_, most_;       // 2n
    std::vector<std::vector<double>> some_;  // rows of t, q, p
    std::int64_t seen_ = 0, stride_ = 1;
};

// Coordinates of the same unit have the same number.
std::vector<int> unit_groups(const Scene& scene);

}  // namespace lobatto
