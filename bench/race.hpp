// SPDX-License-Identifier: GPL-2.0-or-later
// The race: for each contestant and accuracy the fastest setting, found by a scan, then timed in turn with all others.
#pragma once

#include <array>
#include <optional>

#include "bench/contestants/contestant.hpp"

namespace lobatto::bench {

inline constexpr std::array<double, 3> targets = {1e-6, 1e-9, 1e-11};
inline constexpr int ensemble_size = 8;

struct Measurement {
    double setting;
    double seconds;  // a trajectory
    double error;    // max norm over (q, p) at T, of the worst trajectory
    double energy_error;
    long steps, evaluations;     // a trajectory
    double compile_seconds = 0;  // 0: nothing to compile
};

struct Lane {
    Contestant contestant;
    std::vector<Measurement> scan;                                // every setting tried
    std::array<std::optional<Measurement>, targets.size()> best;  // by target
};

struct Race {
    const Problem* problem;
    int trajectories;  // 1, or an ensemble
    std::vector<Lane> lanes;
};

struct RaceOptions {
    bool quick = false;  // fewer kernels, coarser ladders, fewer repetitions
    bool peers_only = false;
    std::vector<std::string> methods;  // only those whose names hold one of these; none: all
};

double seconds(const Lane& lane, std::size_t target);  // of the best setting; infinity: it does not reach the target

// The fastest lane of those chosen; null when none reaches the target.
template <class Race, class Choice>
auto fastest_of(Race& race, std::size_t target, const Choice& chosen) {
    decltype(&race.lanes.front()) best = nullptr;
    for (auto& lane : race.lanes)
        if (chosen(lane) && lane.best[target] && (best == nullptr || seconds(lane, target) < seconds(*best, target)))
            best = &lane;
    return best;
}

Race run_race(const Problem& problem, int trajectories, const RaceOptions& options);

// Measures the cold starts of our winners.
void fill_cold_starts(std::vector<Race>& races);

// "h = 0.25" or "tolerance = 1e-09".
std::string setting_text(const Problem& problem, const Contestant& contestant, double setting);

}  // namespace lobatto::bench
