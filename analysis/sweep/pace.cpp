// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/sweep/pace.hpp"

#include <algorithm>

namespace lobatto {

namespace {

constexpr double seconds_of_compiler = 5, seconds_of_trial = 0.2;
constexpr std::int64_t on_processor = 256, on_device = 131072;  // trajectories of a trial, for each thread and in all

// Steps of all trajectories in a second: of the first `count`, as many as the sweep takes or the trial has time for.
double pace_of(const Kernel& kernel, EnsembleRequest trial, std::int64_t count) {
    const std::int64_t all = trial.steps;
    trial.count = std::min(trial.count, count);
    trial.every = 0;
    trial.sink = nullptr;
    trial.progress = nullptr;
    for (trial.steps = std::min<std::int64_t>(all, 64);; trial.steps = std::min(all, 4 * trial.steps)) {
        const EnsembleResult result = integrate(kernel, trial);
        if (result.seconds > seconds_of_trial || trial.steps == all)
            return static_cast<double>(result.steps_done) / result.seconds;
    }
}

double pace_of_processor(const Kernel& kernel, EnsembleRequest request) {
    request.device = nullptr;
    return pace_of(kernel, request, on_processor * thread_count(request.threads));
}

}  // namespace

bool is_long(const Kernel& kernel, const EnsembleRequest& request, std::int64_t trajectories) {
    const double steps = static_cast<double>(trajectories) * static_cast<double>(request.steps);
    return steps > 0 && steps / pace_of_processor(kernel, request) > seconds_of_compiler;
}

bool is_faster_on_device(const Kernel& kernel, const EnsembleRequest& request) {
    return pace_of(kernel, request, on_device) > pace_of_processor(kernel, request);
}

}  // namespace lobatto
