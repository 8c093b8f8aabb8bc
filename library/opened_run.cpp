// SPDX-License-Identifier: GPL-2.0-or-later
#include "library/opened_run.hpp"

#include <thread>

#include "analysis/columns.hpp"

namespace lobatto::api {

void OpenedRun::Destroy::operator()(Parts* parts) const {
    if (parts->observers && parts->observers->companion)
        parts->observers->companion->end();  // its thread may wait for the lock
    DestroyInAlgebra()(parts);
}

OpenedRun::OpenedRun(const Scene& scene, const RunOptions& options, bool general)
    : beyond_horizon_(options.beyond_horizon) {
    in_algebra([&] {
        parts_.reset(new Parts{prepare_run(with_method(scene, options), overrides_of(options), general)});
        const PreparedRun& prepared = parts_->prepared;
        TrajectoryRequest& request = parts_->request;
        LoadedStepper<double> stepper(prepared.plain);
        request = request_of(prepared.scene, prepared.steps.count, stepper);
        add_digits(request, prepared.scene, prepared.kernel);
        request.formulas = columns_of(prepared.scene, request, &algebra());
        std::vector<double> velocity;
        stepper.velocity(request.time, request.q, request.p, velocity);  // it has one: the start was accepted
        parts_->observers.emplace(prepared, stepper, request, velocity, options.measure);
    });
}

void OpenedRun::resume(const Halfway& halfway, const std::map<std::string, std::vector<double>>& observers) {
    parts_->observers->restore(observers);
    parts_->request.from = &halfway;
}

const TrajectoryResult& OpenedRun::go(const Listeners& listeners) {
    return guarded([&]() -> const TrajectoryResult& {
        parts_->request.sink = [&](const Records& records) {
            listeners.states(records);
            parts_->observers->observe(records);
        };
        if (!parts_->prepared.scene.reported().empty())
            parts_->request.events = [&](const EventRecords& records) {
                listeners.events(records);
                parts_->observers->observe(records);
            };
        parts_->request.checkpoint = listeners.checkpoint;
        parts_->request.progress = listeners.progress;
        parts_->request.interrupted = listeners.interrupted;
        if (parts_->observers->companion && std::thread::hardware_concurrency() > 1)
            parts_->observers->companion->start();
        parts_->result = integrate(parts_->prepared.kernel, parts_->request);
        parts_->observers->watch.look_at_end(parts_->result);
        return parts_->result;
    });
}

RunVerdict OpenedRun::verdict() {
    return in_algebra([&] {
        return verdict_of(parts_->prepared, parts_->request, parts_->result, *parts_->observers, beyond_horizon_);
    });
}

}  // namespace lobatto::api
