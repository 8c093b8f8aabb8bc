// SPDX-License-Identifier: GPL-2.0-or-later
// Many trajectories of one scene: opened for all who sweep, and computed from starts in columns.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "analysis/sweep/warnings.hpp"
#include "generator/formula/text/source.hpp"
#include "library/opened_sweep.hpp"

namespace lobatto::api {

StartsRequest request_of(const Starts& starts) {
    if (starts.count == 0) throw InputError("a sweep needs a start; columns of no number have none");
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

namespace {

constexpr double most_memory = 4e9;  // bytes of kept states
constexpr int most_threads = 1024;

// A name has one value or many.
void refuse_both(const lobatto::Scene& scene, const Settings& settings, const SweepStarts& starts) {
    // Of the scene, x_1 as x[1]: the study has read all names that are set.
    const auto of = [&](std::string name) {
        std::erase(name, ' ');
        return varied_name(scene, name, "name", [](const std::string& message) { throw lobatto::InputError(message); });
    };
    for (const SweepStarts::Column& varied : starts.columns())
        for (const auto& [name, value] : settings.set)
            if (const VariedName set = of(name); set.role == varied.of.role && set.index == varied.of.index)
                throw lobatto::InputError(
                    fmt::format("--set: '{}' is varied too; leave one of both out", varied.of.name));
    using Role = VariedName::Role;
    const bool names_member = settings.points || settings.stages || settings.splitting;
    const auto refuse = [&](Role role, bool is_given, const std::string& option) {
        if (is_given && starts.varies(role, 0))
            throw lobatto::InputError(fmt::format("{}: it is varied too; leave one of both out", option));
    };
    refuse(Role::step, !settings.step.empty(), "--step");
    refuse(Role::tolerance, settings.tolerance.has_value(), "--tolerance");
    for (const Role role : {Role::points, Role::stages, Role::splitting})
        refuse(role, names_member, "the method on the command line");
}

void refuse_too_much(const SweepStudy& study) {
    const std::int64_t count = study.starts().count();
    const double steps = study.steps_of(0, count);
    if (steps > 9e18)
        throw lobatto::InputError(
            fmt::format("--vary: {} {} of {:.0f} steps are {:.3g} steps, too many to count; vary less, or make the end "
                        "time smaller",
                        count, count == 1 ? "trajectory" : "trajectories", steps / static_cast<double>(count), steps));
    const SweepStudy::Setting& setting = study.first_setting();
    const double memory = memory_of(*setting.kernel, setting.request);
    if (memory > most_memory)
        throw lobatto::InputError(fmt::format(
            "--every: the states that trajectories keep while they wait for their turn would need {:.3g} GB of memory; "
            "give a larger number of steps, or fewer --threads",
            memory / 1e9));
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

OpenedSweep open_sweep(const Scene& scene, const StartsRequest& starts, const SweepOptions& options) {
    if (options.threads < 0 || options.threads > most_threads)
        throw lobatto::InputError(
            fmt::format("--threads: {} is no number of threads; 0 takes one for each processor, {} are the most",
                        options.threads, most_threads));
    if (options.steps && !options.until.empty())
        throw lobatto::InputError("--steps: the end is given by --until; leave one of them out");
    auto study = in_algebra([&] {
        lobatto::Scene read =
            options.keep.empty() ? scene.parts().scene : read_scene(scene.parts().scene.source, options.keep);
        method_of(options).apply(read);
        StudyOptions wish;
        wish.overrides = overrides_of(options);
        wish.steps = options.steps;
        wish.device = options.device == Device::cuda        ? StudyDevice::cuda
                      : options.device == Device::automatic ? StudyDevice::automatic
                                                            : StudyDevice::processor;
        wish.threads = options.threads;
        wish.measures = options.measure;
        wish.beyond_horizon = options.beyond_horizon;
        OpenedSweep made(new SweepStudy(std::move(read), starts, wish, algebra()));
        refuse_both(made->scene(), options, made->starts());
        return made;
    });
    guarded([&] {
        study->choose_device();
        refuse_too_much(*study);
    });
    return study;
}

Sweep sweep(const Scene& scene, const Starts& starts, const SweepOptions& options) {
    return guarded([&] {
        const OpenedSweep study = open_sweep(scene, request_of(starts), options);
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
                if (!ask(options.progress, static_cast<double>(done) / study->steps_of(0, count))) is_interrupted = 1;
            };
        const std::int64_t every = kept_by_sweeps(overrides_of(options), swept);
        if (every > 0) sweep.states.first.push_back(0);
        Worst worst;
        const auto sink = [&](const EnsembleTrajectory& trajectory, const Verdict& verdict,
                              const EnsembleRequest& request) {
            if (options.measure) sweep.error.push_back(verdict.error);
            if (options.measure && verdict.status == LOBATTO_OK)
                worst.see(verdict.error, static_cast<std::int64_t>(sweep.count));
            if (every > 0) keep_states(sweep, trajectory, request.every, every);
            keep(sweep, swept, trajectory, verdict.status);
        };
        sweep.interrupted = study->compute(0, count, sink, progress, &is_interrupted).interrupted;
        sweep.warnings = in_algebra([&] {
            std::vector<std::string> warnings = warnings_of(*study, worst);
            bool any_ends = false;
            for (std::size_t i = 0; i < sweep.stop.size(); ++i)
                any_ends = any_ends || (sweep.stop[i] == 0 && sweep.status[i] == LOBATTO_OK);
            if (!study->first_setting().steps.reaches_end && !sweep.interrupted && any_ends)
                warnings.emplace_back(
                    "the end time is not a multiple of the step: the runs end at the last multiple before it");
            for (std::string& warning : study->end()) warnings.push_back(std::move(warning));
            return warnings;
        });
        return sweep;
    });
}

}  // namespace lobatto::api
