// SPDX-License-Identifier: GPL-2.0-or-later
// The errors of the trajectories of a sweep, measured as those of a run (companion.hpp): each against the same motion
// in 3/2 of the steps, from a start that is four units in the last place away.
#pragma once

#include <cstdint>
#include <vector>

#include "generator/mechanics/derivation.hpp"
#include "runtime/run/ensemble.hpp"

namespace lobatto {

class EnsembleCompanion {
public:
    // What is handed over outlives it. `request`: that of the sweep, with its start.
    EnsembleCompanion(const Derivation& derivation, const Kernel& kernel, const EnsembleRequest& request);

    struct Error {
        double relative;  // of the positions at the end, each by its own amplitude; the largest. Not a number: unknown
        bool lost;        // as large as the motion, or the companion could not reach the end
    };
    // Of a trajectory that reached the end. To be asked in the order of the indices: the companions of many are
    // computed together.
    Error of(const EnsembleTrajectory& trajectory);

private:
    struct Known {
        lobatto_status status = LOBATTO_NOT_FINITE;
        std::vector<double> least, most, end;  // 2n
    };
    void compute(std::int64_t first);

    Kernel kernel_;
    const EnsembleRequest& request_;
    std::vector<int> groups_;
    int order_;
    std::int64_t taken_;  // steps of each companion
    std::int64_t first_ = 0;
    std::vector<Known> known_;  // from trajectory first_ on
};

}  // namespace lobatto
