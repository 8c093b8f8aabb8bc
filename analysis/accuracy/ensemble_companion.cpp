// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/ensemble_companion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/accuracy/amplitude.hpp"

namespace lobatto {

namespace {

constexpr std::int64_t numbers_at_once = 1 << 20;  // of companions that are computed together
constexpr std::int64_t rows_for_amplitude = 64;

}  // namespace

EnsembleCompanion::EnsembleCompanion(const Derivation& derivation, const Kernel& kernel, const EnsembleRequest& request)
    : kernel_(kernel),
      request_(request),
      groups_(amplitude_groups(derivation.scene)),
      order_(derivation.quadrature.order()),
      taken_(request.steps + (request.steps + 1) / 2) {}

void EnsembleCompanion::compute(std::int64_t first) {
    const auto n = static_cast<std::int64_t>(groups_.size());
    first_ = first;
    known_.clear();
    EnsembleRequest companion = request_;
    companion.count = std::min(std::max<std::int64_t>(numbers_at_once / (6 * n), 64), request_.count - first);
    companion.start = [&](std::int64_t index, EnsembleStart& start) {
        request_.start(first + index, start);
        for (double& x : start.q)
            if (x != 0) x = beside(x);
    };
    companion.step = request_.step * static_cast<double>(request_.steps) / static_cast<double>(taken_);
    companion.steps = taken_;
    companion.every = std::max<std::int64_t>(1, taken_ / rows_for_amplitude);
    companion.counts = nullptr;
    companion.progress = nullptr;
    companion.sink = [&](const EnsembleTrajectory& trajectory) {
        Known& known = known_.emplace_back();
        known.status = trajectory.status;
        for (std::int64_t i = 0; i < trajectory.kept.count; ++i)
            widen_to(known.least, known.most, trajectory.kept.rows + i * trajectory.kept.columns + 1,
                     static_cast<std::size_t>(2 * n));
        const double* const last = trajectory.kept.rows + (trajectory.kept.count - 1) * trajectory.kept.columns + 1;
        known.end.assign(last, last + 2 * n);
    };
    integrate(kernel_, companion);
}

EnsembleCompanion::Error EnsembleCompanion::of(const EnsembleTrajectory& trajectory) {
    const double unknown = std::numeric_limits<double>::quiet_NaN();
    if (request_.steps == 0) return {0, false};
    if (known_.empty() || trajectory.index >= first_ + std::ssize(known_)) compute(trajectory.index);
    const std::int64_t place = trajectory.index - first_;
    if (place >= std::ssize(known_)) return {unknown, false};  // interrupted
    Known& known = known_[static_cast<std::size_t>(place)];
    if (known.status != LOBATTO_OK) return {unknown, true};
    const std::size_t n = groups_.size();
    for (std::int64_t i = 0; i < trajectory.kept.count; ++i)
        widen_to(known.least, known.most, trajectory.kept.rows + i * trajectory.kept.columns + 1, 2 * n);
    const std::vector<double> amplitude = amplitudes_of(known.least, known.most, groups_);
    const double* const end = trajectory.kept.rows + (trajectory.kept.count - 1) * trajectory.kept.columns + 1;
    const double ratio = static_cast<double>(taken_) / static_cast<double>(request_.steps),
                 of_run = 1 / (1 - std::pow(ratio, -order_));
    Error error{0, false};
    for (std::size_t i = 0; i < 2 * n; ++i) {
        if (!(amplitude[i] > 0)) continue;
        const double difference = std::fabs(end[i] - known.end[i]) / amplitude[i];
        if (i < n) error.relative = std::fmax(error.relative, of_run * difference);
        error.lost = error.lost || !(difference < out_of_step);
    }
    return error;
}

}  // namespace lobatto
