// SPDX-License-Identifier: GPL-2.0-or-later
// A sweep by many processes: the first hands out ranges of trajectories and receives their rows, in their order; the
// others compute.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "analysis/sweep/rows.hpp"
#include "cli/ranks/ranks.hpp"
#include "library/opened_sweep.hpp"

namespace lobatto {

// Trajectories that are computed, with what the table and the summary need of them.
struct SweepBlock {
    std::int64_t first = 0, last = 0;
    StudyTimes times;
    std::vector<SweepFigures> figures;  // of each
    std::vector<double> states;         // 2n each: q, p at the end
    std::vector<TableCell> cells;       // rows of all of them

    void clear();  // what was computed; its memory stays
    void add(const SweepStudy& study, const EnsembleTrajectory& trajectory, const Verdict& verdict,
             const EnsembleRequest& request);
};

// Of the first process. Whatever happens, the others end with it.
class CrewLeader {
public:
    explicit CrewLeader(Ranks& ranks);
    ~CrewLeader();
    CrewLeader(const CrewLeader&) = delete;
    CrewLeader& operator=(const CrewLeader&) = delete;

    // Trajectories first, ..., last - 1: blocks come in their order. `meanwhile` is called between them, and often.
    // `cells_each`: of the rows of a trajectory, about. Rethrows what others threw, with their numbers. The times of
    // all; interrupted: not all came.
    StudyTimes compute(std::int64_t first, std::int64_t last, const std::function<void(const SweepBlock&)>& take,
                       const std::function<void()>& meanwhile, const volatile int* interrupted, double cells_each);
    std::vector<std::string> end();  // what judges warn of

private:
    void tell_all(const std::string& message);

    Ranks& ranks_;
    bool has_ended_ = false;
};

// Of the others: computes what it is told to, until the end. `begin` makes the study, once the first process has made
// its own. Errors are told to the first process.
void work_in_crew(Ranks& ranks, const std::function<api::OpenedSweep()>& begin);

}  // namespace lobatto
