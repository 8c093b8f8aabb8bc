// SPDX-License-Identifier: GPL-2.0-or-later
#include "library/opened_run.hpp"

#include <fmt/format.h>

#include <thread>

#include "analysis/columns.hpp"

namespace lobatto::api {

void OpenedRun::Destroy::operator()(Parts* parts) const {
    if (parts->observers && parts->observers->companion)
        parts->observers->companion->end();  // its thread may wait for the lock
    DestroyInAlgebra()(parts);
}

namespace {

// Of the companion, if it computes in other numbers than the run. InputError for what it cannot have.
std::optional<Method> companion_method(const lobatto::Scene& scene, const RunOptions& options) {
    if (options.companion.empty()) return {};
    const auto fail = [](const std::string& why) { throw lobatto::InputError("--companion: " + why); };
    if (!options.measure) fail("a run without a measured error has no companion; leave one of the two out");
    const std::optional<Precision> numbers = precision_of(options.companion);
    if (!numbers) fail("unknown numbers; there are " + precision_list());
    if (rounding_of(*numbers) >= rounding_of(scene.method.numbers))
        fail(fmt::format("the run itself computes in {}; a companion needs finer numbers{}",
                         precision_name(scene.method.numbers),
                         scene.method.numbers < Precision::double_double ? ", such as double-double" : ""));
    if (scene.clock) fail("with a clock the companion has the numbers of the run; leave it out, or give --clock none");
    Method method = scene.method;
    method.numbers = *numbers;
    method.arithmetic = StepArithmetic::plain;  // finer numbers have digits to spare
    if (const std::string reason = reason_against_numbers(method); !reason.empty()) fail(reason);
    need_digits_for(*numbers);
    return method;
}

}  // namespace

OpenedRun::OpenedRun(const Scene& scene, const RunOptions& options, Shortcuts shortcuts)
    : beyond_horizon_(options.beyond_horizon) {
    in_algebra([&] {
        const lobatto::Scene chosen = with_method(scene, options);
        parts_.reset(
            new Parts{prepare_run(chosen, overrides_of(options), shortcuts, companion_method(chosen, options))});
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
        parts_->request.progress = {};  // the listeners may be gone from now on
        parts_->observers->watch.look_at_end(parts_->result);
        return parts_->result;
    });
}

RunVerdict OpenedRun::verdict(const std::function<bool()>& waits) {
    RunObservers& observers = *parts_->observers;
    if (observers.companion)
        guarded([&] {  // others may work with formulas meanwhile
            observers.error = observers.companion->finish(parts_->result, [&] {
                observers.ended_by_caller = observers.ended_by_caller || (waits && !waits());
                return !observers.ended_by_caller;
            });
        });
    return in_algebra([&] {
        return verdict_of(parts_->prepared, parts_->request, parts_->result, *parts_->observers, beyond_horizon_);
    });
}

}  // namespace lobatto::api
