// SPDX-License-Identifier: GPL-2.0-or-later
// A run that is ready to go: derived, compiled, its start accepted, with all that looks at its states. `lobatto run`
// writes what comes out of it into files, run() of lobatto.hpp keeps it in memory.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/accuracy/judged_run.hpp"
#include "library/parts.hpp"

namespace lobatto::api {

class OpenedRun {
public:
    // Throws Error, like all of it.
    OpenedRun(const Scene& scene, const RunOptions& options, Shortcuts shortcuts = Shortcuts::all);
    OpenedRun(const OpenedRun&) = delete;
    OpenedRun& operator=(const OpenedRun&) = delete;

    const PreparedRun& prepared() const { return parts_->prepared; }
    const lobatto::Scene& scene() const { return parts_->prepared.scene; }  // with its method and values
    const TrajectoryRequest& request() const { return parts_->request; }
    const RunObservers& observers() const { return *parts_->observers; }

    // Goes on from where an earlier run was, whose observers had kept this. What is handed over outlives the run.
    void resume(const Halfway& halfway, const std::map<std::string, std::vector<double>>& observers);

    // Who hears what comes out of the run, on the thread that called go().
    struct Listeners {
        std::function<void(const Records&)> states;
        std::function<void(const EventRecords&)> events;   // where the scene watches for some
        std::function<void(const Halfway&)> checkpoint;    // none: nobody asks for it
        std::function<void(std::int64_t steps)> progress;  // about ten times a second; none
        const volatile int* interrupted = nullptr;         // not 0: the run ends
    };
    const TrajectoryResult& go(const Listeners& listeners);
    // What is to be said of it, once it has ended. waits: asked some times a second, whether to wait for its companion.
    RunVerdict verdict(const std::function<bool()>& waits = {});

private:
    struct Parts {
        PreparedRun prepared;
        TrajectoryRequest request{};
        std::optional<RunObservers> observers{};
        TrajectoryResult result{};
    };
    struct Destroy {
        void operator()(Parts* parts) const;
    };
    std::unique_ptr<Parts, Destroy> parts_;
    bool beyond_horizon_;
};

}  // namespace lobatto::api
