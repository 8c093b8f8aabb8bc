// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/sweep_watch.hpp"

#include <algorithm>
#include <cmath>

#include "cli/energy_watch.hpp"

namespace lobatto {

namespace {

constexpr double doubtful = 0.5;  // of the kinetic energy

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

SweepWatch::SweepWatch(const Derivation& derivation, const Kernel& kernel, const EnsembleRequest& request)
    : derivation_(derivation),
      request_(request),
      kernel_(kernel),
      watches_(kernel->has_energy != 0 && EnergyWatch::can_watch(derivation)),
      stepper_(kernel) {}

bool SweepWatch::departs(const EnsembleTrajectory& trajectory) {
    if (!watches_ || trajectory.energy_error_largest == 0) return false;
    request_.start(trajectory.index, start_);
    if (stepper_.prepare(start_.parameters, request_.step) != LOBATTO_OK) return false;
    p_ = request_.from_velocities ? stepper_.momentum(request_.time, start_.q, start_.rate) : start_.rate;
    const double* const row = trajectory.kept.rows + (trajectory.kept.count - 1) * trajectory.kept.columns;
    const double* const middle = row + 1 + start_.q.size();
    const double kinetic = std::max(kinetic_energy(stepper_, request_.time, start_.q, p_),
                                    kinetic_energy(stepper_, row[0], {row + 1, middle}, {middle, middle + p_.size()}));
    return !(trajectory.energy_error_largest < doubtful * kinetic) && run_again();
}

bool SweepWatch::run_again() {
    TrajectoryRequest again;
    again.parameters = start_.parameters;
    again.q = start_.q;
    again.p = p_;
    again.time = request_.time;
    again.step = request_.step;
    again.tolerance = request_.tolerance;
    again.steps = request_.steps;
    again.interrupted = request_.interrupted;
    EnergyWatch watch(derivation_, kernel_);
    again.sink = [&](const Records& records) { watch.look(records); };
    return integrate(kernel_, again).status == LOBATTO_OK && !watch.departure(derivation_, kernel_, again).empty();
}

}  // namespace lobatto
