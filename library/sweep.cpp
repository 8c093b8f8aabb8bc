// SPDX-License-Identifier: GPL-2.0-or-later
// Many trajectories of one scene, from starts in columns.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "analysis/sweep/study.hpp"
#include "library/parts.hpp"

namespace lobatto::api {

namespace {

// The columns, as a sweep takes them.
StartsRequest request_of(const Starts& starts) {
    StartsRequest request;
    StartTable& table = request.table.emplace();
    table.rows = static_cast<std::int64_t>(starts.count);
    for (const auto& [name, values] : starts.columns) {
        if (values.size() != starts.count)
            throw InputError(
                fmt::format("the column '{}' has {} values for {} trajectories", name, values.size(), starts.count));
        table.names.push_back(name);
        table.columns.push_back(values);
    }
    return request;
}

std::unique_ptr<SweepStudy> begin_sweep(const Scene& scene, const Starts& starts, const SweepOptions& options) {
    lobatto::Scene read =
        options.keep.empty() ? scene.parts().scene : read_scene(scene.parts().scene.source, options.keep);
    method_of(options).apply(read);
    StudyOptions study;
    study.overrides = overrides_of(options);
    study.threads = options.threads;
    study.measures = options.measure;
    return std::make_unique<SweepStudy>(std::move(read), request_of(starts), study, &algebra());
}

// Of a trajectory whose states were kept each `kept_every`-th step: the start, each `every`-th state, the last one.
void keep_states(Sweep& sweep, const EnsembleTrajectory& trajectory, std::int64_t kept_every, std::int64_t every) {
    const Records& kept = trajectory.kept;
    const auto n = static_cast<std::ptrdiff_t>(sweep.coordinates.size());
    Sweep::States& states = sweep.states;
    for (std::int64_t i = 0; i < kept.count; ++i) {
        if (i + 1 != kept.count && i * kept_every % every != 0) continue;
        const double* const row = kept.rows + i * kept.columns;
        states.t.push_back(row[0]);
        states.q.insert(states.q.end(), row + 1, row + 1 + n);
        states.p.insert(states.p.end(), row + 1 + n, row + 1 + 2 * n);
        states.energy_error.push_back(trajectory.energy_error(i));
    }
    states.first.push_back(states.t.size());
}

void keep(Sweep& sweep, const lobatto::Scene& scene, const EnsembleTrajectory& trajectory, int status) {
    const Records& kept = trajectory.kept;
    const double* const row = kept.rows + (kept.count - 1) * kept.columns;
    const auto n = static_cast<std::ptrdiff_t>(sweep.coordinates.size());
    sweep.status.push_back(status);
    sweep.steps.push_back(trajectory.steps_done);
    const auto first = static_cast<int>(scene.outputs.events.size()) - 1;
    sweep.stop.push_back(trajectory.stop >= 0 ? trajectory.stop - first : 0);
    sweep.t.push_back(row[0]);
    sweep.q.insert(sweep.q.end(), row + 1, row + 1 + n);
    sweep.p.insert(sweep.p.end(), row + 1 + n, row + 1 + 2 * n);
    sweep.energy_error.push_back(trajectory.energy_error(kept.count - 1));
    for (std::size_t k = 0; k < sweep.kept_names.size(); ++k)
        sweep.kept.push_back(trajectory.reduced != nullptr && k < trajectory.reduced->size() ? (*trajectory.reduced)[k]
                                                                                             : std::nan(""));
    ++sweep.count;
}

}  // namespace

Sweep sweep(const Scene& scene, const Starts& starts, const SweepOptions& options) {
    return guarded([&] {
        const std::unique_ptr<SweepStudy> study = in_algebra([&] { return begin_sweep(scene, starts, options); });
        const lobatto::Scene& swept = study->scene();
        Sweep sweep;
        sweep.coordinates = in_algebra([&] { return coordinates_of(swept); });
        for (const Reduction& kept : swept.outputs.kept) sweep.kept_names.push_back(kept.text);
        sweep.statuses.assign(sweep_statuses.begin(), sweep_statuses.end());
        volatile int is_interrupted = 0;
        std::function<void(std::int64_t)> progress;
        const auto count = static_cast<std::int64_t>(starts.count);
        if (options.progress)
            progress = [&](std::int64_t done) {
                if (!options.progress(static_cast<double>(done) / study->steps_of(0, count))) is_interrupted = 1;
            };
        // With a clock the scene itself says which states there are between.
        const std::int64_t every =
            swept.clock ? std::min<std::int64_t>(options.every.value_or(0), 1) : options.every.value_or(0);
        if (every > 0) sweep.states.first.push_back(0);
        const auto sink = [&](const EnsembleTrajectory& trajectory, const Verdict& verdict,
                              const EnsembleRequest& request) {
            if (options.measure) sweep.error.push_back(verdict.error);
            if (every > 0) keep_states(sweep, trajectory, request.every, every);
            keep(sweep, swept, trajectory, verdict.status);
        };
        sweep.interrupted = study->compute(0, count, sink, progress, &is_interrupted).interrupted;
        return sweep;
    });
}

}  // namespace lobatto::api
