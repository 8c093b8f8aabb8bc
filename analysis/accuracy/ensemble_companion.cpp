// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/ensemble_companion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/accuracy/amplitude.hpp"
#include "analysis/accuracy/companion.hpp"

namespace lobatto {

namespace {

constexpr std::int64_t numbers_at_once = 1 << 20;  // of companions that are computed together

const double unknown = std::numeric_limits<double>::quiet_NaN();

}  // namespace

EnsembleCompanion::EnsembleCompanion(const Derivation& derivation, const Kernel& kernel, const EnsembleRequest& request)
    : derivation_(derivation),
      kernel_(kernel),
      request_(request),
      groups_(amplitude_groups(derivation.scene)),
      order_(derivation.quadrature.order()) {}

void EnsembleCompanion::compute(std::int64_t first) {
    const auto n = static_cast<std::int64_t>(groups_.size());
    const std::int64_t every = request_.every == 0 ? request_.steps : std::min(request_.every, request_.steps),
                       rows = request_.steps / every + 1,
                       count = std::min(std::max<std::int64_t>(numbers_at_once / ((4 + 2 * rows) * n), 64),
                                        request_.count - first);
    first_ = first;
    known_.assign(static_cast<std::size_t>(count), {});
    const std::int64_t whole = request_.steps / every * every;
    take(0, whole, every);
    if (whole < request_.steps) take(whole, request_.steps - whole, request_.steps - whole);
}

void EnsembleCompanion::take(std::int64_t begin, std::int64_t steps, std::int64_t every) {
    const std::size_t n = groups_.size();
    EnsembleRequest companion = request_;
    companion.count = std::ssize(known_);
    companion.start = [&](std::int64_t index, EnsembleStart& start) {
        request_.start(first_ + index, start);
        const std::vector<double>& rows = known_[static_cast<std::size_t>(index)].rows;
        if (begin == 0) {
            for (double& x : start.q)
                if (x != 0) x = beside(x);
        } else if (rows.size() >= 2 * n) {
            const auto last = rows.end() - static_cast<std::ptrdiff_t>(2 * n);
            start.q.assign(last, last + static_cast<std::ptrdiff_t>(n));
            start.rate.assign(last + static_cast<std::ptrdiff_t>(n), rows.end());
        }
    };
    companion.from_velocities = request_.from_velocities && begin == 0;
    companion.time = time_after(request_, begin);
    const bool is_clocked = request_.arrivals.interval != 0;  // then both arrive at the same times
    const std::int64_t taken = is_clocked ? every : companion_steps(every);
    companion.step = is_clocked ? request_.step / clocked_ratio
                                : request_.step * static_cast<double>(every) / static_cast<double>(taken);
    companion.steps = steps / every * taken;
    companion.every = taken;
    companion.counts = nullptr;
    companion.progress = nullptr;
    companion.sink = [&](const EnsembleTrajectory& trajectory) {
        Known& known = known_[static_cast<std::size_t>(trajectory.index)];
        if (begin == 0 || known.status == LOBATTO_OK) known.status = trajectory.status;
        for (std::int64_t i = 0; i < trajectory.kept.count; ++i) {
            const double* const row = trajectory.kept.rows + i * trajectory.kept.columns + 1;
            widen_to(known.least, known.most, row, 2 * n);
            if (i > 0) known.rows.insert(known.rows.end(), row, row + 2 * n);
        }
    };
    if (integrate(kernel_, companion).interrupted) known_.clear();
}

bool EnsembleCompanion::goes_alone(const EnsembleStart& start) {
    if (derivation_.system.autonomous) return false;
    if (request_.every < fewest_driven_steps && request_.every > 0) return true;
    if (start.parameters == pulse_parameters_ && !start.parameters.empty()) return has_pulses_;
    pulse_parameters_ = start.parameters;
    const double end = request_.time + static_cast<double>(request_.steps) * request_.step;
    has_pulses_ =
        !find_pulses(derivation_.system, start.parameters, request_.time, end, std::fabs(request_.step)).empty();
    return has_pulses_;
}

// As of a run: companions take short steps at pulses, each at its own.
EnsembleCompanion::Error EnsembleCompanion::alone(const EnsembleTrajectory& trajectory,
                                                  const EnsembleStart& start) const {
    TrajectoryRequest request;
    request.parameters = start.parameters;
    request.q = start.q;
    LoadedStepper<double> stepper(kernel_);
    if (stepper.prepare(start.parameters, request_.step) != LOBATTO_OK) return {unknown, true};
    request.p = request_.from_velocities ? stepper.momentum(request_.time, start.q, start.rate) : start.rate;
    request.time = request_.time;
    request.step = request_.step;
    request.steps = request_.steps;
    request.every = request_.every == 0 ? request_.steps : request_.every;
    request.tolerance = request_.tolerance;
    Companion companion(derivation_, kernel_, request);
    companion.observe(trajectory.kept);
    TrajectoryResult result;
    result.steps_done = request_.steps;
    result.time = request_.time + static_cast<double>(request_.steps) * request_.step;
    const std::optional<MeasuredError> error = companion.finish(result);
    if (!error || error->companion_stopped) return {unknown, true};
    return {error->end, error->is_lost()};
}

EnsembleCompanion::Error EnsembleCompanion::of(const EnsembleTrajectory& trajectory) {
    if (request_.steps == 0) return {0, false};
    EnsembleStart start;
    start.parameters.resize(static_cast<std::size_t>(kernel_->parameters));
    start.q.resize(groups_.size());
    start.rate.resize(groups_.size());
    request_.start(trajectory.index, start);
    if (goes_alone(start)) return alone(trajectory, start);
    if (known_.empty() || trajectory.index >= first_ + std::ssize(known_)) compute(trajectory.index);
    const std::int64_t place = trajectory.index - first_;
    if (place >= std::ssize(known_)) return {unknown, false};  // interrupted
    Known& known = known_[static_cast<std::size_t>(place)];
    if (known.status != LOBATTO_OK) return {unknown, true};
    const std::size_t n = groups_.size();
    const Records& kept = trajectory.kept;
    for (std::int64_t i = 0; i < kept.count; ++i)
        widen_to(known.least, known.most, kept.rows + i * kept.columns + 1, 2 * n);
    const std::vector<double> amplitude = amplitudes_of(known.least, known.most, groups_);
    const std::int64_t every = request_.every == 0 ? request_.steps : std::min(request_.every, request_.steps),
                       comparisons = std::ssize(known.rows) / static_cast<std::int64_t>(2 * n),
                       skipped = kept.count - comparisons;  // the start, if it is kept
    const double ratio = request_.arrivals.interval != 0
                             ? clocked_ratio
                             : static_cast<double>(companion_steps(every)) / static_cast<double>(every),
                 of_run = 1 / (1 - std::pow(ratio, -order_));
    Error error{0, false};
    double largest = 0;
    for (std::int64_t j = 0; j < comparisons; ++j) {
        const double* const run = kept.rows + (skipped + j) * kept.columns + 1;
        const double* const companion = known.rows.data() + j * static_cast<std::int64_t>(2 * n);
        error.relative = 0;
        for (std::size_t i = 0; i < 2 * n; ++i) {
            if (!(amplitude[i] > 0)) continue;
            const double difference = std::fabs(run[i] - companion[i]) / amplitude[i];
            if (i < n) error.relative = std::fmax(error.relative, of_run * difference);
            error.lost = error.lost || !(difference < out_of_step);
        }
        largest = std::fmax(largest, error.relative);
    }
    if (largest > by_chance) error.relative = largest;
    return error;
}

}  // namespace lobatto
