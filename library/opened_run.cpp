// SPDX-License-Identifier: GPL-2.0-or-later
#include "library/opened_run.hpp"

#include <thread>

#include "analysis/columns.hpp"

namespace lobatto::api {

OpenedRun::OpenedRun(const Scene& scene, const RunOptions& options, bool general)
    : prepared_(in_algebra([&] { return prepare_run(with_method(scene, options), overrides_of(options), general); })),
      beyond_horizon_(options.beyond_horizon) {
    in_algebra([&] {
        LoadedStepper<double> stepper(prepared_.plain);
        request_ = request_of(prepared_.scene, prepared_.steps.count, stepper);
        add_digits(request_, prepared_.scene, prepared_.kernel);
        request_.formulas = columns_of(prepared_.scene, request_, &algebra());
        std::vector<double> velocity;
        stepper.velocity(request_.time, request_.q, request_.p, velocity);  // it has one: the start was accepted
        observers_.emplace(prepared_, stepper, request_, velocity, options.measure);
    });
}

void OpenedRun::resume(const Halfway& halfway, const std::map<std::string, std::vector<double>>& observers) {
    observers_->restore(observers);
    request_.from = &halfway;
}

const TrajectoryResult& OpenedRun::go(const Listeners& listeners) {
    return guarded([&]() -> const TrajectoryResult& {
        request_.sink = [&](const Records& records) {
            listeners.states(records);
            observers_->observe(records);
        };
        if (!prepared_.scene.reported().empty())
            request_.events = [&](const EventRecords& records) {
                listeners.events(records);
                observers_->observe(records);
            };
        request_.checkpoint = listeners.checkpoint;
        request_.progress = listeners.progress;
        request_.interrupted = listeners.interrupted;
        if (observers_->companion && std::thread::hardware_concurrency() > 1) observers_->companion->start();
        result_ = integrate(prepared_.kernel, request_);
        observers_->watch.look_at_end(result_);
        return result_;
    });
}

RunVerdict OpenedRun::verdict() {
    return in_algebra([&] { return verdict_of(prepared_, request_, result_, *observers_, beyond_horizon_); });
}

}  // namespace lobatto::api
