// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/watch/sweep_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/accuracy/watch/energy_watch.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "analysis/stability/limit.hpp"
#include "runtime/error.hpp"
#include "runtime/measure/frequency.hpp"

namespace lobatto {

namespace {

constexpr double doubtful = 0.5;  // of the kinetic energy
constexpr int most_looks = 1000;
constexpr std::size_t most_coordinates = 64;

// H(q, p) - H(q, at rest); 0 where there is none.
double kinetic_energy(const LoadedStepper<double>& stepper, double time, const std::vector<double>& q,
                      const std::vector<double>& p) {
    double whole = 0, resting = 0;
    const std::vector<double> at_rest = stepper.momentum(time, q, std::vector<double>(q.size(), 0.0));
    const bool has_both =
        stepper.energy(time, q, p, whole) == LOBATTO_OK && stepper.energy(time, q, at_rest, resting) == LOBATTO_OK;
    const double kinetic = has_both ? std::fabs(whole - resting) : 0;
    return std::isfinite(kinetic) ? kinetic : 0;
}

}  // namespace

SweepWatch::SweepWatch(const Outline& outline, const KernelSource& source, const Kernel& kernel,
                       const EnsembleRequest& request)
    : outline_(outline),
      source_(source),
      request_(request),
      kernel_(kernel),
      watches_(kernel->has_energy != 0 && EnergyWatch::can_watch(outline)),
      stepper_(kernel) {}

bool SweepWatch::departs(const EnsembleTrajectory& trajectory) {
    if (!watches_ || trajectory.energy_error_largest == 0) return false;
    if (!prepare(trajectory)) return false;
    const double* const row = trajectory.kept.rows + (trajectory.kept.count - 1) * trajectory.kept.columns;
    const double* const middle = row + 1 + start_.q.size();
    const double kinetic = std::max(kinetic_energy(stepper_, request_.time, start_.q, p_),
                                    kinetic_energy(stepper_, row[0], {row + 1, middle}, {middle, middle + p_.size()}));
    return !(trajectory.energy_error_largest < doubtful * kinetic) && run_again(trajectory);
}

bool SweepWatch::prepare(const EnsembleTrajectory& trajectory) {
    request_.start(trajectory.index, start_);
    if (stepper_.prepare(start_.parameters, request_.step) != LOBATTO_OK) return false;
    p_ = request_.from_velocities ? stepper_.momentum(request_.time, start_.q, start_.rate) : start_.rate;
    return true;
}

void SweepWatch::observe(const EnsembleTrajectory& trajectory) {
    const std::size_t n = outline_.system.q.size();
    // With a clock h is a time of the clock, and frequencies are of the physical time. A force that jumps near an end
    // has no frequency.
    if (outline_.scene.clock || !outline_.scene.switches.empty() || n > most_coordinates || looks_ == most_looks ||
        !prepare(trajectory))
        return;
    ++looks_;
    const double* const row = trajectory.kept.rows + (trajectory.kept.count - 1) * trajectory.kept.columns;
    const std::vector<double> q(row + 1, row + 1 + n), p(row + 1 + n, row + 1 + 2 * n);
    std::vector<double> scale;
    for (std::size_t i = 0; i < 2 * n; ++i) {
        const double size = std::max(std::fabs(i < n ? start_.q[i] : p_[i - n]), std::fabs(row[1 + i]));
        scale.push_back(size > 0 && std::isfinite(size) ? size : 1);
    }
    for (const double omega : {largest_frequency_near(stepper_, request_.time, start_.q, p_, scale),
                               largest_frequency_near(stepper_, row[0], q, p, scale)})
        if (const double radians = std::fabs(request_.step) * omega; radians > radians_) {
            radians_ = radians;
            trajectory_ = trajectory.index;
        }
}

std::string SweepWatch::warning() const {
    const double limit = radians_ > 0 ? stability_limit(outline_.quadrature, radians_) : radians_;
    if (!(radians_ > limit)) return "";
    return fmt::format(
        "the step is beyond the linear stability limit, at most in trajectory {}: h omega = {:.4g} is more than "
        "{:.4g}, "
        "omega the largest frequency at starts and ends. Take a step below {:.2g} times this one, or Gauss, which has "
        "no "
        "limit",
        trajectory_, radians_, limit, part_below(limit, radians_));
}

bool SweepWatch::run_again(const EnsembleTrajectory& trajectory) {
    if (!alone_) {
        try {
            alone_ = kernel_of(source_, Precision::double_);
        } catch (const MachineError&) {  // what the sweep has computed is not lost for want of a compiler
            alone_ = kernel_;
        }
    }
    TrajectoryRequest again;
    again.parameters = start_.parameters;
    again.q = start_.q;
    again.p = p_;
    again.time = request_.time;
    again.step = request_.step;
    again.tolerance = request_.tolerance;
    again.steps = trajectory.steps_done;
    again.arrivals = request_.arrivals;
    again.arrivals.keeps_chain = again.arrivals.interval != 0;
    again.interrupted = request_.interrupted;
    EnergyWatch watch(outline_, *alone_);
    // The mean kinetic energy while it is as right as that in lanes.
    double sum = 0, energy_start = 0;
    std::int64_t states = 0;
    again.sink = [&](const Records& records) {
        watch.observe(records);
        for (std::int64_t i = 0; i < records.count; ++i) {
            if (states == 0) energy_start = records.energy[i];
            if (!(std::fabs(records.energy[i] - energy_start) <= trajectory.energy_error_largest)) continue;
            const double* const row = records.rows + i * records.columns;
            const double* const middle = row + 1 + start_.q.size();
            sum += kinetic_energy(stepper_, row[0], {row + 1, middle}, {middle, middle + p_.size()});
            ++states;
        }
    };
    const TrajectoryResult result = integrate(*alone_, again);
    if (result.interrupted) return false;
    // It may go on in lanes where alone it cannot, for the iterations of a step begin elsewhere.
    if (result.status != LOBATTO_OK)
        return !(trajectory.energy_error_largest < doubtful * sum / static_cast<double>(states));
    return !watch.departure(outline_, *alone_, again).empty();
}

}  // namespace lobatto
