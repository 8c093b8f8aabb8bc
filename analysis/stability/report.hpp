// SPDX-License-Identifier: GPL-2.0-or-later
// What there is to know of the stability of a scene's steps: exactly, and measured on its kernel.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "analysis/overrides.hpp"
#include "generator/mechanics/derivation.hpp"
#include "generator/method/stability.hpp"
#include "runtime/build/library.hpp"

namespace lobatto {

// One independent oscillator of a linear system, x'' = -squared_frequency x.
struct Mode {
    double squared_frequency = 0;  // negative: the motion itself grows
    double z = 0;                  // h^2 times it
    double rate = 0;               // ln of the growth in a step, from the member's exact trace
    bool at_limit = false;         // |trace| = 2 to rounding: states grow in proportion to the number of steps
    bool free = false;             // squared_frequency is 0, and nothing pulls anywhere along the motion
    bool stable() const { return squared_frequency > 0 && rate == 0 && !at_limit; }
};

// ln of the growth in a step, measured; what is below the floor may be left of the start.
struct MeasuredRate {
    double value = 0, floor = 0;
};

// A linear system: the scene's own, or a nonlinear one's about an equilibrium.
struct PointReport {
    Eigen::VectorXd q;                       // n; of a linear system nothing depends on it
    std::optional<std::vector<Mode>> modes;  // ascending; nothing where there is an obstacle to it
    std::string obstacle;                    // of LinearSystem
    double exact_rate = 0;                   // ln of the growth of the motion itself in a time h
    std::optional<MeasuredRate> kernel_rate;
};

// Along the scene's own motion.
struct TrajectoryReport {
    std::int64_t steps = 0, most_steps = 0, steps_done = 0;      // of the scene; run at most; run
    std::int64_t states = 0, frequencies_at = 0, looked_at = 0;  // kept; with known frequencies; with eigenvalues
    std::optional<double> thrown_at;            // from then on states are left out: the step throws the motion away
    double largest_z = 0, largest_z_time = 0;   // h^2 times the largest squared frequency; 0: nothing oscillates
    std::int64_t parting = 0;                   // steps with an eigenvalue above 1, of those looked at
    double rate = 0, exact_rate = 0, time = 0;  // the largest ln |eigenvalue| of a step; of the motion there; when
    double excess = 0, excess_time = 0;         // the largest difference of the two, and when
};

// Of nonlinear separable systems: how much along the scene's motion H varies, and what backward error analysis says
// that the steps keep better (D37).
struct EnergyReport {
    int order = 0;
    bool too_long = false;                         // the formula: nothing else is known
    double variation = 0, modified_variation = 0;  // greatest minus least value: of H, of H + h^order H_order
    double size = 0;                               // the largest |H|
};

struct StabilityReport {
    Derivation derivation;  // of the scene with its overrides
    Kernel kernel;
    std::vector<double> parameters;
    double step = 0;
    Stability member;
    std::vector<PointReport> points;             // of a linear system one
    std::optional<TrajectoryReport> trajectory;  // of nonlinear systems
    std::optional<EnergyReport> energy;
};

// Derives, compiles and runs. InputError, ComputationError, MachineError.
StabilityReport stability_report(Scene scene, const Overrides& overrides);

// ln of the growth of a linear system's steps of size h, by running the kernel; of others by the eigenvalues of the
// kernel's step at q. Linear steps are taken until a rate as small as `expected` shows, as far as that is possible.
std::optional<MeasuredRate> measured_rate_at(const StabilityReport& report, const Eigen::VectorXd& q, double step,
                                             double expected = 0);

// The largest rate of a linear system's modes when the step is `factor` times the report's.
double largest_rate(const StabilityReport& report, const std::vector<Mode>& modes, double factor);

}  // namespace lobatto
