// SPDX-License-Identifier: GPL-2.0-or-later
// Many trajectories that the caller takes forward together.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "library/opened_sweep.hpp"
#include "runtime/run/ensemble/side_by_side.hpp"
#include "runtime/run/other_velocity.hpp"

namespace lobatto::api {

namespace {

// As many as go side by side, with their parameters; those that are left over repeat the last.
struct Lanes {
    std::unique_ptr<Trajectories> trajectories;
    std::size_t first, count;  // of the ensemble
    std::vector<double> parameters, q, p;
    std::vector<std::int32_t> status;
    std::vector<std::int64_t> steps_done, iterations;
};

// The scene without what is of whole motions; InputError where an ensemble cannot do what is asked for.
Scene scene_for(const Scene& scene, const Settings& settings) {
    return in_algebra([&] {
        const lobatto::Scene chosen = with_method(scene, settings);
        if (chosen.clock || chosen.may_end_early())
            throw InputError(fmt::format(
                "{}: the trajectories of an ensemble are all at one time, but {}; leave it out, or take sweep()",
                chosen.path,
                !chosen.clock               ? chosen.run.stops.empty() ? "a wall has rest" : "the scene has stops"
                : scene.parts().scene.clock ? "the scene has a clock"
                                            : "the settings ask for a clock"));
        if (chosen.method.numbers != Precision::double_)
            throw InputError(chosen.path + ": ensembles are computed in double; leave `numbers` out, or take sweep()");
        const auto parts = shared_in_algebra(new Scene::Parts(scene.parts()));
        parts->scene.outputs.kept.clear();
        return Scene(parts);
    });
}

OpenedSweep study_of(const Scene& scene, const Starts& starts, const Settings& settings) {
    SweepOptions options;
    static_cast<Settings&>(options) = settings;
    options.measure = false;
    options.threads = 1;  // the caller's
    if (starts.count == 0)
        throw InputError(scene.path() + ": an ensemble has one trajectory at least; there are 0 starts");
    return open_sweep(scene_for(scene, settings), request_of(starts), options);
}

}  // namespace

struct Ensemble::Parts {
    OpenedSweep study;
    std::vector<Variable> parameters;  // as the scene has them
    std::vector<Required> required;
    std::vector<double> step;
    std::int64_t steps = 0;  // taken
    std::vector<Lanes> lanes;
    std::vector<double> q, p;
    std::vector<int> status;

    Parts(const Scene& scene, const Starts& starts, const Settings& settings)
        : study(study_of(scene, starts, settings)),
          parameters(in_algebra([&] { return parameters_of(study->scene()); })),
          required(in_algebra([&] { return required_of(study->scene()); })),
          step{request().step},
          q(starts.count * n()),
          p(starts.count * n()),
          status(starts.count) {
        LoadedStepper<double> stepper(kernel());
        EnsembleStart start;
        std::vector<int> refused(starts.count);
        const auto width = static_cast<std::size_t>(std::max(kernel()->lanes, 1));
        for (std::size_t first = 0; first < starts.count; first += width) {
            Lanes& side_by_side = lanes.emplace_back();
            if (kernel()->lanes > 0)
                side_by_side.trajectories = std::make_unique<LaneTrajectories>(kernel());
            else
                side_by_side.trajectories = std::make_unique<SingleTrajectory>(kernel(), request());
            side_by_side.first = first;
            side_by_side.count = std::min(width, starts.count - first);
            side_by_side.status.resize(width);
            side_by_side.steps_done.resize(width);
            side_by_side.iterations.resize(width);
            for (std::size_t lane = 0; lane < width; ++lane) {
                if (lane < side_by_side.count) refused[first + lane] = begin(first + lane, stepper, start);
                const auto put = [](const std::vector<double>& from, std::vector<double>& to) {
                    to.insert(to.end(), from.begin(), from.end());
                };
                put(start.parameters, side_by_side.parameters);
                put(start.q, side_by_side.q);
                put(start.rate, side_by_side.p);
            }
            restart(side_by_side);
        }
        for (std::size_t index = 0; index < refused.size(); ++index)
            if (refused[index] != LOBATTO_OK) status[index] = refused[index];
    }

    const lobatto::Kernel& kernel() const { return *study->first_setting().kernel; }
    const EnsembleRequest& request() const { return study->first_setting().request; }
    std::size_t n() const { return study->scene().coordinates.size(); }
    double time() const { return request().time + static_cast<double>(steps) * step[0]; }

    // A start with its momenta, which are not numbers if it is refused.
    lobatto_status begin(std::size_t index, LoadedStepper<double>& stepper, EnsembleStart& start) const {
        study->starts().start(static_cast<std::int64_t>(index), start);
        if (!request().from_velocities) return LOBATTO_OK;
        std::vector<double> p(start.rate.size(), std::nan(""));
        lobatto_status result = stepper.prepare(start.parameters, step[0]);
        if (result == LOBATTO_OK) {
            const std::vector<double> momentum = stepper.momentum(request().time, start.q, start.rate);
            if (other_velocity(stepper, request().time, start.q, start.rate, momentum).empty())
                p = momentum;
            else
                result = LOBATTO_SINGULAR_MASS;
        }
        start.rate = p;
        return result;
    }

    void restart(Lanes& side_by_side) {
        std::fill(side_by_side.status.begin(), side_by_side.status.end(), LOBATTO_OK);
        side_by_side.trajectories->prepare(side_by_side.parameters, step, side_by_side.status.data());
        side_by_side.trajectories->start(time(), side_by_side.q, side_by_side.p, side_by_side.status.data());
        hand_out(side_by_side);
    }
    // One that has failed before stays as it was.
    void hand_out(const Lanes& side_by_side) {
        for (std::size_t lane = 0; lane < side_by_side.count; ++lane) {
            const std::size_t index = side_by_side.first + lane;
            if (status[index] != 0) continue;
            status[index] = side_by_side.status[lane];
            const auto copy = [&](const std::vector<double>& from, std::vector<double>& to) {
                std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(lane * n()), n(),
                            to.begin() + static_cast<std::ptrdiff_t>(index * n()));
            };
            copy(side_by_side.q, q);
            copy(side_by_side.p, p);
        }
    }

    void advance(std::int64_t count) {
        for (Lanes& side_by_side : lanes) {
            const auto goes_on = [](std::int32_t one) { return one == LOBATTO_OK; };
            if (std::none_of(side_by_side.status.begin(), side_by_side.status.end(), goes_on)) continue;
            side_by_side.trajectories->advance(request(), count, side_by_side.status.data(),
                                               side_by_side.steps_done.data(), side_by_side.iterations.data());
            side_by_side.trajectories->state(side_by_side.q, side_by_side.p);
            hand_out(side_by_side);
        }
        steps += count;
    }

    // Values that one of the trajectories may not have change nothing.
    void set(std::size_t parameter, const double* values) {
        const auto all = static_cast<std::size_t>(kernel()->parameters);
        for (const Lanes& side_by_side : lanes)
            for (std::size_t lane = 0; lane < side_by_side.count; ++lane) {
                if (status[side_by_side.first + lane] != LOBATTO_OK) continue;
                const auto begin = side_by_side.parameters.begin() + static_cast<std::ptrdiff_t>(lane * all);
                std::vector<double> changed(begin, begin + static_cast<std::ptrdiff_t>(all));
                changed[parameter] = values[side_by_side.first + lane];
                check_change(required, changed, parameter, 1);
            }
        for (Lanes& side_by_side : lanes) {
            for (std::size_t lane = 0; lane < side_by_side.status.size(); ++lane)
                side_by_side.parameters[lane * all + parameter] =
                    values[side_by_side.first + std::min(lane, side_by_side.count - 1)];
            restart(side_by_side);
        }
    }
};

Ensemble::Ensemble(const Scene& scene, const Starts& starts, const Settings& settings)
    : parts_(guarded([&] { return std::make_unique<Parts>(scene, starts, settings); })) {}
Ensemble::Ensemble(Ensemble&&) noexcept = default;
Ensemble& Ensemble::operator=(Ensemble&&) noexcept = default;
Ensemble::~Ensemble() = default;

std::size_t Ensemble::count() const {
    return parts_->status.size();
}
std::size_t Ensemble::coordinates() const {
    return parts_->n();
}
double Ensemble::step_size() const {
    return parts_->step[0];
}
double Ensemble::t() const {
    return parts_->time();
}
const double* Ensemble::q() const {
    return parts_->q.data();
}
const double* Ensemble::p() const {
    return parts_->p.data();
}
const std::vector<int>& Ensemble::status() const {
    return parts_->status;
}

void Ensemble::advance(std::int64_t steps) {
    guarded([&] {
        if (steps < 0) throw InputError(fmt::format("advance: {} is no number of steps", steps));
        parts_->advance(steps);
    });
}

void Ensemble::set(const std::string& name, const double* values) {
    guarded([&] { parts_->set(index_of(parts_->parameters, name), values); });
}

}  // namespace lobatto::api
