// SPDX-License-Identifier: GPL-2.0-or-later
// Who runs in the race: a method with one setting to choose, and how it brings trajectories to the end of a problem.
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "bench/problems.hpp"

namespace lobatto::bench {

struct Trajectory {
    std::vector<double> q, p;
};

struct Effort {
    bool good = false;  // false: it did not reach the end
    long steps = 0;
    long evaluations = 0;  // of accelerations or slopes; 0: not counted
};

enum class Ladder { steps, tolerance };  // what the setting is: the number of steps to T, or an error tolerance

struct Contestant {
    std::string method;
    int order;  // 0: varies
    bool symplectic;
    bool ours;
    Ladder ladder;
    // From the initial values in place to the values at T, one trajectory after another or side by side. This is timed.
    std::function<Effort(double setting, std::vector<Trajectory>& trajectories)> run;
    // What is done once before the runs with a setting and not timed, such as compiling; returns its seconds.
    std::function<double(double setting, std::size_t trajectories)> prepare = {};
    // Seconds from formulas to a loaded program, nothing cached; where `prepare` does not tell them.
    std::function<double()> cold_start = {};
    double coarsest = 1e-3, finest = 1e-16, ratio = std::sqrt(10);  // of tolerances, and from one to the next
    double fewest_steps = 0;  // where the scan of steps begins; 0: where the problem says
};

using Contestants = std::vector<Contestant>;
Contestants own_peers(const Problem& problem);
Contestants taylor_peer(const Problem& problem);
Contestants taylor_peer_by_clang(const Problem& problem);
Contestants odeint_peers(const Problem& problem);
Contestants gsl_peers(const Problem& problem);
Contestants sundials_peers(const Problem& problem);
Contestants heyoka_peers(const Problem& problem, int trajectories);

// y = (q, p) in one array, as the libraries of first-order systems want it.
inline void join(const Trajectory& trajectory, double* y) {
    const std::size_t n = trajectory.q.size();
    for (std::size_t k = 0; k < n; ++k) y[k] = trajectory.q[k], y[n + k] = trajectory.p[k];
}
inline void split(const double* y, Trajectory& trajectory) {
    const std::size_t n = trajectory.q.size();
    for (std::size_t k = 0; k < n; ++k) trajectory.q[k] = y[k], trajectory.p[k] = y[n + k];
}

// Runs one trajectory after another with action(trajectory) -> Effort.
template <class Action>
Effort one_by_one(std::vector<Trajectory>& trajectories, const Action& action) {
    Effort all{true, 0, 0};
    for (Trajectory& trajectory : trajectories) {
        const Effort one = action(trajectory);
        all.good = all.good && one.good;
        all.steps += one.steps;
        all.evaluations += one.evaluations;
    }
    return all;
}

}  // namespace lobatto::bench
