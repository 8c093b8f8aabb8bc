// SPDX-License-Identifier: GPL-2.0-or-later
// Watches the kept states of a run and measures them against all that is known of the system in closed form.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "generator/mechanics/derivation.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

class Watch {
public:
    // The stepper is prepared; `velocity` is the initial one.
    Watch(const Scene& scene, const std::optional<ClosedSolution>& closed, const LoadedStepper<double>& stepper,
          const std::vector<double>& velocity);

    void observe(const Records& records);
    void look_at_end(const TrajectoryResult& result);  // whatever was skipped: the last state is compared

    // The largest |H_d - H_d(0)| / |H_d(0)|, of linear systems; nothing where H_d is rounding.
    std::optional<double> discrete_error() const;
    std::optional<double> position_error() const;  // largest |q - exact q|, where the solution is known in closed form
    // What it has observed so far, for a run that continues.
    std::vector<double> save() const;
    void restore(const std::vector<double>& saved);

    bool is_elliptic() const { return closed_ && closed_->kind == ClosedSolution::Kind::pendulum; }

private:
    void compare(double time, double q);

    std::int64_t between_ = 0;  // states between two steps
    std::optional<ClosedSolution> closed_;
    long double omega_squared_ = 0, q0_ = 0, velocity0_ = 0;
    double position_error_ = 0;
    std::int64_t seen_ = 0, compared_ = 0, stride_ = 1;

    std::optional<DiscreteEnergy> discrete_;
    double discrete_start_ = 0, discrete_error_ = 0;
};

}  // namespace lobatto
