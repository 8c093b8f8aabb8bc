// SPDX-License-Identifier: GPL-2.0-or-later
// A scene as a request for a trajectory.
#include "analysis/motion.hpp"

#include <fmt/format.h>

#include <cmath>

#include "analysis/exact_start.hpp"
#include "runtime/error.hpp"
#include "runtime/run/other_velocity.hpp"
#include "runtime/run/parts.hpp"

namespace lobatto {

namespace {

// Times at which a run with a clock is compared with its companion, where the scene names none: no part of times that
// one writes, so that a motion is not always met at the same place.
constexpr int arrivals_of_run = 61;

}  // namespace

Arrivals arrivals_of(const Scene& scene, std::int64_t count) {
    if (!scene.clock || count == 0) return {};
    Arrivals arrivals;
    arrivals.end = scene.evaluate(scene.run.until, "the end time").to_double();
    arrivals.interval = scene.evaluate(scene.outputs.interval, "the time between states").to_double();
    arrivals.keeps_chain = arrivals.interval == 0;
    if (arrivals.keeps_chain) {
        arrivals.interval = arrivals.end / static_cast<double>(count);
        // The last arrival is the end itself: a rounding beyond it is cut off, one before it would stay.
        if (arrivals.interval * static_cast<double>(count) < arrivals.end)
            arrivals.interval = std::nextafter(arrivals.interval, arrivals.end);
    }
    return arrivals;
}

GiNaC::numeric step_of(const Scene& scene, const Overrides& overrides) {
    const GiNaC::numeric step = scene.evaluate(scene.run.step, "the step");
    if (!step.is_positive()) {
        throw InputError(fmt::format("{}: the step must be positive, but is {:.6g}",
                                     overrides.step.empty() ? scene.path : "--step", step.to_double()));
    }
    const double size = step.to_double();
    if (!(size >= 1e-152 && size <= 1e152)) {
        throw InputError(fmt::format(
            "{}: the step must be between 1e-152 and 1e152, because its square stands in the formulas, but is {:.6g}; "
            "choose another unit of time",
            overrides.step.empty() ? scene.path : "--step", size));
    }
    return step;
}

Steps steps_of(const Scene& scene, const Overrides& overrides) {
    const GiNaC::numeric step = step_of(scene, overrides), until = scene.evaluate(scene.run.until, "the end time");
    if (until.is_negative()) {
        throw InputError(fmt::format("{}: the end time must not be negative, but is {:.6g}",
                                     overrides.until.empty() ? scene.path : "--until", until.to_double()));
    }
    if (scene.clock) {
        const GiNaC::numeric interval = scene.evaluate(scene.outputs.interval, "the time between states");
        const double count = interval.is_zero() ? arrivals_of_run : std::ceil((until / interval).to_double() - 1e-9);
        if (!(count < 9e15))
            throw InputError(fmt::format("{}: {:.3g} states are too many to count; make the time between them larger",
                                         scene.path, count));
        return {until.is_zero() ? 0 : static_cast<std::int64_t>(count), true};
    }
    const double ratio = (until / step).to_double();
    if (!(ratio < 9e15))
        throw InputError(fmt::format(
            "{}: {:.3g} steps are too many to count; make the step larger or the end time smaller", scene.path, ratio));
    const double nearest = std::round(ratio);
    const bool reaches_end = std::fabs(ratio - nearest) <= 1e-9;
    return {static_cast<std::int64_t>(reaches_end ? nearest : std::floor(ratio)), reaches_end};
}

Steps steps_of_run(const Scene& scene, const Overrides& overrides) {
    const Steps steps = steps_of(scene, overrides);
    const double until = scene.evaluate(scene.run.until, "the end time").to_double();
    if (steps.count == 0 && until > 0) {
        const std::string what = fmt::format(
            "the step {:.6g} is longer than the run, which ends at {:.6g}, so that not one step would be "
            "taken; make the step smaller or the end time later",
            scene.evaluate(scene.run.step, "the step").to_double(), until);
        if (overrides.step.empty() && overrides.until.empty()) scene.source.fail(scene.run.step_at, what);
        throw InputError((overrides.step.empty() ? "--until: " : "--step: ") + what);
    }
    return steps;
}

void add_digits(TrajectoryRequest& request, const Scene& scene, const Kernel& kernel) {
    if (kernel->real_kind == LOBATTO_DOUBLE) return;
    NumberStepper stepper(kernel);
    const auto whole = [&](const std::vector<GiNaC::numeric>& values) { return parts_of(values, stepper.parts()); };
    const ExactStart start(scene);
    request.whole_parameters = whole(start.parameters);
    request.whole_step = whole({scene.evaluate(scene.run.step, "the step")});
    request.whole_q = whole(start.q);
    request.whole_p = whole(start.rate);
    if (start.from_velocity && stepper.prepare(request.whole_parameters, request.whole_step) == LOBATTO_OK)
        request.whole_p = stepper.momentum(as_parts({request.time}, stepper.parts()), request.whole_q, request.whole_p);
}

TrajectoryRequest request_of(const Scene& scene, std::int64_t steps, LoadedStepper<double>& stepper) {
    TrajectoryRequest request;
    const ExactStart start(scene);
    const auto rounded = [](const std::vector<GiNaC::numeric>& values) {
        std::vector<double> numbers;
        for (const GiNaC::numeric& value : values) numbers.push_back(value.to_double());
        return numbers;
    };
    request.parameters = rounded(start.parameters);
    request.q = rounded(start.q);
    request.p = rounded(start.rate);
    request.step = scene.evaluate(scene.run.step, "the step").to_double();
    request.steps = steps;
    request.tolerance = scene.method.tolerance;
    request.arrivals = arrivals_of(scene, steps);
    request.every = scene.outputs.every;
    request.dense = scene.outputs.dense;
    if (scene.outputs.multipliers) request.multipliers = static_cast<int>(scene.constraints.size());

    TrajectoryResult none;
    none.status = stepper.prepare(request.parameters, request.step);
    if (none.status == LOBATTO_OK) {
        if (start.from_velocity)
            request.p = momentum_of_start(stepper, request.time, request.q, request.p, scene.path + ": ");
        none.status = stepper.start(request.time, request.q, request.p);
        if (none.status == LOBATTO_OK && scene.has_time_coordinate())  // the kernel knows its momentum
            stepper.state(request.time, request.q, request.p);
    }
    none.q = request.q;
    none.p = request.p;
    if (none.status != LOBATTO_OK)
        throw ComputationError(fmt::format("{}: {}", scene.path, explain_stop(none, request)));
    return request;
}

}  // namespace lobatto
