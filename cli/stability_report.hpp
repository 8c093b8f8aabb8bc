// SPDX-License-Identifier: GPL-2.0-or-later
// What there is to know of the stability of a scene's steps: exactly, and measured on its kernel.
#pragma once

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "cli/overrides.hpp"
#include "generator/pipeline.hpp"
#include "generator/stability.hpp"
#include "runtime/library.hpp"

namespace lobatto {

// One independent oscillator of a linear system, x'' = -squared_frequency x.
struct Mode {
    double squared_frequency = 0;  // negative: the motion itself runs away
    double z = 0;                  // h^2 times it
    double rate = 0;               // ln of the growth in a step, from the member's exact trace
};

// A linear system: the scene's own, or a nonlinear one's about an equilibrium.
struct PointReport {
    Eigen::VectorXd q;                       // n; of a linear system nothing depends on it
    std::optional<std::vector<Mode>> modes;  // ascending; nothing where there is an obstacle to it
    std::string obstacle;                    // of LinearSystem
    double exact_rate = 0;                   // ln of the growth of the motion itself in a time h
    std::optional<double> kernel_rate;       // ln of the growth in a step, measured
};

// Along the scene's own motion.
struct TrajectoryReport {
    std::int64_t steps = 0, steps_done = 0, looked_at = 0;
    double largest_z = 0, largest_z_time = 0;   // h^2 times the largest squared frequency; 0: none was found
    std::int64_t parting = 0;                   // steps with an eigenvalue above 1, of those looked at
    double rate = 0, exact_rate = 0, time = 0;  // the largest ln |eigenvalue| of a step; of the motion there; when
    double excess = 0, excess_time = 0;         // the largest difference of the two, and when
};

// Of nonlinear separable systems: how much along the scene's motion H varies, and what backward error analysis says
// that the steps keep better (D37).
struct EnergyReport {
    int order = 0;
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
// kernel's step at q.
std::optional<double> measured_rate_at(const StabilityReport& report, const Eigen::VectorXd& q, double step);
// What is below this of such a measurement may be left of the start.
double measured_floor(const StabilityReport& report);

// The largest rate of a linear system's modes when the step is `factor` times the report's.
double largest_rate(const StabilityReport& report, const std::vector<Mode>& modes, double factor);

}  // namespace lobatto
