// SPDX-License-Identifier: GPL-2.0-or-later
// A run that knows what it is worth: its kernel, what looks at its states, its measured error, whether it left its
// motion.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/accuracy/companion/companion.hpp"
#include "analysis/accuracy/formulas/domains.hpp"
#include "analysis/accuracy/formulas/walls_together.hpp"
#include "analysis/accuracy/step_judge.hpp"
#include "analysis/accuracy/watch/energy_watch.hpp"
#include "analysis/accuracy/watch/watch.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "generator/mechanics/outline.hpp"

namespace lobatto {

// A scene, ready to run: its kernel compiled, its start in numbers.
struct PreparedRun {
    Scene scene;
    Outline outline;
    bool derived_from_cache;
    KernelSource source;
    Compiled compiled;
    Kernel kernel;                // in the scene's numbers
    Kernel plain;                 // the same in double, for what looks at states in doubles
    std::optional<Kernel> finer;  // the same in finer numbers, for a companion that computes in these
    Steps steps;
    double derivation_seconds;
};

// The overrides are applied after the derivation: one kernel serves all values. `general`: with no shortcut.
// `companion`: the method in finer numbers, for a companion that computes in these.
// Throws InputError, ComputationError, MachineError.
PreparedRun prepare_run(Scene scene, const Overrides& overrides, Shortcuts shortcuts = Shortcuts::all,
                        std::optional<Method> companion = {});

// That a run which went on to its end ends before the time that was asked for. Empty: it does not.
std::string ends_early(const PreparedRun& run, const TrajectoryResult& result);

// All that looks at the states of a run, and what each of them has to keep for a later run that goes on.
class RunObservers {
public:
    // What a checkpoint must have; one of an earlier version has no "walls together".
    static inline const std::vector<std::string> names = {"counts",       "watch",     "step judge",
                                                          "energy watch", "companion", "left domain"};

    // `measures`: whether a companion runs beside it.
    RunObservers(const PreparedRun& run, const LoadedStepper<double>& stepper, const TrajectoryRequest& request,
                 const std::vector<double>& velocity, bool measures)
        : watch(run.scene, run.outline.closed_solution, stepper, velocity),
          judge(run.scene),
          energy(run.outline, run.plain),
          domains(run.scene, run.outline.system),
          walls(run.scene, stepper, request),
          parameters(request.parameters),
          counts(1 + run.scene.reported().size(), 0) {
        if (!measures) return;
        TrajectoryRequest beside = request;
        if (run.finer) add_digits(beside, run.scene, *run.finer);
        companion.emplace(run.outline, run.finer.value_or(run.kernel), beside, run.kernel->epsilon);
    }

    void observe(const Records& records) {
        watch.observe(records);
        judge.observe(records);
        energy.observe(records);
        if (companion) companion->observe(records);
        if (left_domain.empty())
            if (const std::int64_t i = domains.left_at(parameters, records); i >= 0)
                left_domain.assign(records.rows + i * records.columns, records.rows + (i + 1) * records.columns);
        counts[0] += static_cast<double>(records.count);
    }
    void observe(const EventRecords& records) {
        walls.observe(records);
        for (std::int64_t i = 0; i < records.count; ++i)
            ++counts[1 + static_cast<std::size_t>(records.rows[i * records.columns])];
    }

    std::map<std::string, std::vector<double>> save() const {
        return {{"counts", counts},
                {"watch", watch.save()},
                {"step judge", judge.save()},
                {"energy watch", energy.save()},
                {"companion", companion ? companion->save() : std::vector<double>()},
                {"left domain", left_domain},
                {"walls together", walls.save()}};
    }
    void restore(const std::map<std::string, std::vector<double>>& saved) {
        counts = saved.at("counts");
        watch.restore(saved.at("watch"));
        judge.restore(saved.at("step judge"));
        energy.restore(saved.at("energy watch"));
        if (companion && !companion->restore(saved.at("companion"))) {
            companion.reset();
            began_unmeasured = true;
        }
        left_domain = saved.at("left domain");
        if (const auto at = saved.find("walls together"); at != saved.end()) walls.restore(at->second);
    }

    Watch watch;
    StepJudge judge;
    EnergyWatch energy;
    std::optional<Companion> companion;
    std::optional<MeasuredError> error;  // of the companion, once it has ended
    bool ended_by_caller = false;        // it was not waited for
    bool began_unmeasured = false;       // in an earlier part of the run, so that nothing can be compared
    Domains domains;
    WallsTogether walls;
    std::vector<double> parameters;
    std::vector<double> left_domain;  // t, q, p: the first state where a formula has no value
    std::vector<double> counts;       // of the states, and of each kind of event
};

// What is to be said of a run that has ended.
struct RunVerdict {
    std::optional<MeasuredError> error;  // where a companion ran beside it
    std::vector<std::string> warnings;   // without full stops
    std::string failure;                 // what went wrong, and what to try; empty: nothing. The scene stands before it
};
// `accepts_lost`: an error as large as the motion is no failure.
RunVerdict verdict_of(const PreparedRun& run, const TrajectoryRequest& request, const TrajectoryResult& result,
                      RunObservers& observers, bool accepts_lost);

}  // namespace lobatto
