// SPDX-License-Identifier: GPL-2.0-or-later
// A whole run, kept in memory and judged as `lobatto run` judges it.
#include <fmt/format.h>
#include <unistd.h>

#include "analysis/columns.hpp"
#include "library/opened_run.hpp"

namespace lobatto::api {

namespace {

void append(std::vector<double>& all, const double* first, std::size_t count) {
    all.insert(all.end(), first, first + count);
}

void keep(Trajectory& trajectory, const Records& records) {
    const auto n = trajectory.coordinates.size();
    for (std::int64_t i = 0; i < records.count; ++i) {
        const double* const row = records.rows + i * records.columns;
        trajectory.t.push_back(row[0]);
        append(trajectory.q, row + 1, n);
        append(trajectory.p, row + 1 + n, n);
        if (records.energy != nullptr) trajectory.energy.push_back(records.energy[i]);
        const std::size_t columns = trajectory.column_names.size(), parts = static_cast<std::size_t>(records.parts);
        for (std::size_t c = 0; c < columns; ++c)
            trajectory.columns.push_back(records.beside[(static_cast<std::size_t>(i) * columns + c) * parts]);
    }
    trajectory.count += static_cast<std::size_t>(records.count);
}

void keep(Trajectory& trajectory, const EventRecords& records) {
    const auto n = trajectory.coordinates.size();
    for (std::int64_t i = 0; i < records.count; ++i) {
        const double* const row = records.rows + i * records.columns;
        trajectory.events.push_back(
            {static_cast<int>(row[0]), row[1], {row + 2, row + 2 + n}, {row + 2 + n, row + 2 + 2 * n}});
    }
}

void finish(Trajectory& trajectory, const OpenedRun& run, const TrajectoryResult& result, const RunVerdict& verdict) {
    trajectory.steps = run.scene().clock ? result.chain_steps : result.steps_done;
    trajectory.seconds = result.seconds;
    trajectory.interrupted = result.interrupted;
    if (result.stop >= 0) trajectory.stopped_by = trajectory.event_names[static_cast<std::size_t>(result.stop)];
    trajectory.reaches_end = ends_early(run.prepared(), result).empty();
    trajectory.warnings = verdict.warnings;
    if (!verdict.error) return;
    if (verdict.error->is_known_at_end()) trajectory.error = verdict.error->at_end;
    if (const std::string part = not_measured_at_end(*verdict.error); !part.empty())
        trajectory.warnings.push_back(part);
    trajectory.largest_error = verdict.error->worst();
    trajectory.doubling = verdict.error->doubling;
}

Trajectory begun(const OpenedRun& run) {
    Trajectory trajectory;
    trajectory.coordinates = coordinates_of(run.scene());
    trajectory.event_names = events_of(run.scene());
    for (const auto& [name, unit] : names_beside(run.scene())) trajectory.column_names.push_back(name);
    trajectory.method = run.scene().method.name();
    trajectory.digest = run.prepared().source.digest;
    trajectory.step = run.request().step;
    trajectory.dense = run.request().dense;
    return trajectory;
}

// All states are kept in memory. Without stops, what they need is known.
void refuse_too_much(const OpenedRun& run) {
    const TrajectoryRequest& request = run.request();
    const double states = static_cast<double>(request.steps) / static_cast<double>(request.every) * (1 + request.dense),
                 memory = states * (2 + 2 * static_cast<double>(request.q.size())) * sizeof(double),
                 there = static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
    if (memory > there)
        throw lobatto::InputError(
            fmt::format("every: the {:.3g} states of the run would need {:.3g} GB of memory; give a "
                        "larger number of steps between them",
                        states, memory / 1e9));
}

}  // namespace

Trajectory run(const Scene& scene, const RunOptions& options) {
    OpenedRun run(scene, options);
    if (!run.scene().may_end_early()) guarded([&] { refuse_too_much(run); });
    Trajectory trajectory = in_algebra([&] { return begun(run); });
    volatile int is_interrupted = 0;
    OpenedRun::Listeners listeners;
    listeners.states = [&](const Records& records) { keep(trajectory, records); };
    listeners.events = [&](const EventRecords& records) { keep(trajectory, records); };
    if (options.progress)
        listeners.progress = [&](std::int64_t done) {
            const double share = static_cast<double>(done) / static_cast<double>(run.request().steps);
            if (!ask(options.progress, share)) is_interrupted = 1;
        };
    listeners.interrupted = &is_interrupted;
    const TrajectoryResult& result = run.go(listeners);
    const RunVerdict verdict = run.verdict([&] {
        if (is_interrupted == 0 && options.progress && !ask(options.progress, 1.0)) is_interrupted = 1;
        return is_interrupted == 0;
    });
    finish(trajectory, run, result, verdict);
    if (!verdict.failure.empty())
        throw RunFailure(fmt::format("{}: {}", run.scene().path, verdict.failure), std::move(trajectory));
    return trajectory;
}

}  // namespace lobatto::api
