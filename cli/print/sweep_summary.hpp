// SPDX-License-Identifier: GPL-2.0-or-later
// What is said of a sweep when it has ended.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/sweep/study.hpp"
#include "analysis/sweep/tally.hpp"

namespace lobatto {

// `asked`: trajectories that were to be computed.
void print_sweep(const SweepStudy& study, const SweepTally& tally, const StudyTimes& times, std::int64_t asked);

// After all rows: what holds for the steps and the end of all trajectories.
void print_sweep_notes(const SweepStudy& study);

// How many failed, why, and the first of them with their values.
std::string failures_text(const SweepStudy& study, const SweepTally& tally);

// For machines: one line of JSON (docs/schemas/sweep.json).
struct SweptTable {
    std::int64_t asked;  // trajectories that were to be computed
    std::string path;
    std::int64_t rows;
    std::vector<std::string> warnings;
};
std::string json_of_sweep(const SweepStudy& study, const SweepTally& tally, const StudyTimes& times,
                          const SweptTable& table);

}  // namespace lobatto
