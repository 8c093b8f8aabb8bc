// SPDX-License-Identifier: GPL-2.0-or-later
// A whole run, kept in memory and judged as `lobatto run` judges it.
#include <fmt/format.h>

#include <thread>

#include "analysis/accuracy/judged_run.hpp"
#include "analysis/columns.hpp"
#include "library/parts.hpp"

namespace lobatto::api {

namespace {

void append(std::vector<double>& all, const double* first, std::size_t count) {
    all.insert(all.end(), first, first + count);
}

// The start of a run, its kernel, and what is to be kept of it.
struct BegunRun {
    PreparedRun prepared;
    TrajectoryRequest request;
    std::vector<double> velocity;
};

BegunRun begin_run(const Scene& scene, const RunOptions& options) {
    BegunRun begun{prepare_run(with_method(scene, options), overrides_of(options)), {}, {}};
    LoadedStepper<double> stepper(begun.prepared.plain);
    begun.request = request_of(begun.prepared.scene, begun.prepared.steps.count, stepper);
    add_digits(begun.request, begun.prepared.scene, begun.prepared.kernel);
    begun.request.formulas = columns_of(begun.prepared.scene, begun.request, &algebra());
    stepper.velocity(begun.request.time, begun.request.q, begun.request.p, begun.velocity);
    return begun;
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

void finish(Trajectory& trajectory, const BegunRun& begun, const TrajectoryResult& result, const RunVerdict& verdict) {
    trajectory.steps = begun.prepared.scene.clock ? result.chain_steps : result.steps_done;
    trajectory.seconds = result.seconds;
    trajectory.interrupted = result.interrupted;
    if (result.stop >= 0) trajectory.stopped_by = trajectory.event_names[static_cast<std::size_t>(result.stop)];
    trajectory.warnings = verdict.warnings;
    if (!verdict.error) return;
    trajectory.error = verdict.error->at_end;
    trajectory.largest_error = verdict.error->worst();
    trajectory.doubling = verdict.error->doubling;
}

}  // namespace

Trajectory run(const Scene& scene, const RunOptions& options) {
    return guarded([&] {
        BegunRun begun = in_algebra([&] { return begin_run(scene, options); });
        const PreparedRun& prepared = begun.prepared;
        Trajectory trajectory;
        std::optional<RunObservers> observers;
        in_algebra([&] {
            trajectory.coordinates = coordinates_of(prepared.scene);
            trajectory.event_names = events_of(prepared.scene);
            for (const auto& [name, unit] : names_beside(prepared.scene)) trajectory.column_names.push_back(name);
            observers.emplace(prepared, LoadedStepper<double>(prepared.plain), begun.request, begun.velocity,
                              options.measure);
        });
        trajectory.method = prepared.scene.method.name();
        trajectory.digest = prepared.source.digest;
        trajectory.step = begun.request.step;

        volatile int is_interrupted = 0;
        TrajectoryRequest& request = begun.request;
        request.interrupted = &is_interrupted;
        request.sink = [&](const Records& records) {
            keep(trajectory, records);
            observers->observe(records);
        };
        if (!trajectory.event_names.empty())
            request.events = [&](const EventRecords& records) {
                keep(trajectory, records);
                observers->observe(records);
            };
        if (options.progress)
            request.progress = [&](std::int64_t done) {
                const double share = static_cast<double>(done) / static_cast<double>(request.steps);
                if (!options.progress(share)) is_interrupted = 1;
            };
        if (observers->companion && std::thread::hardware_concurrency() > 1) observers->companion->start();
        const TrajectoryResult result = integrate(prepared.kernel, request);
        observers->watch.look_at_end(result);
        const RunVerdict verdict =
            in_algebra([&] { return verdict_of(prepared, request, result, *observers, options.beyond_horizon); });
        finish(trajectory, begun, result, verdict);
        if (!verdict.failure.empty())
            throw RunFailure(fmt::format("{}: {}", prepared.scene.path, verdict.failure), std::move(trajectory));
        return trajectory;
    });
}

}  // namespace lobatto::api
