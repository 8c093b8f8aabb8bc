// SPDX-License-Identifier: GPL-2.0-or-later
// What is said of each trajectory of a sweep when it has ended: whether it failed, and its error.
#pragma once

#include <array>
#include <mutex>
#include <optional>
#include <string>

#include "analysis/accuracy/companion/ensemble_companion.hpp"
#include "analysis/accuracy/formulas/constant_masses.hpp"
#include "analysis/accuracy/formulas/domains.hpp"
#include "analysis/accuracy/watch/sweep_watch.hpp"
#include "generator/emit/kernel.hpp"
#include "generator/mechanics/outline.hpp"
#include "runtime/run/ensemble/ensemble.hpp"

namespace lobatto {

// How a trajectory of a sweep ended: a lobatto_status, or one of those that judges add in places that are free.
enum SweepStatus { departed = 7, unresolved = 8, undefined = 10 };
// In words, by number.
constexpr std::array sweep_statuses = {"reached the end",
                                       "not converged",
                                       "not finite",
                                       "singular Jacobian",
                                       "singular mass matrix",
                                       "t + h equals t or the clock is 0",
                                       "not supported by the kernel",
                                       "energy off: beyond stability, or past a singularity",
                                       "not resolved: the error is as large as the motion",
                                       "start off the constraints or behind a wall",
                                       "a formula has no value there",
                                       "stopped",
                                       "impacts accumulate"};
static_assert(sweep_statuses.size() == LOBATTO_STATUSES);

struct Verdict {
    int status = LOBATTO_OK;
    double error = 0;          // at the end, relative to the amplitude; not a number: not measured
    bool interrupted = false;  // before all was known of the trajectory
};

// Judges the trajectories, in their order: by their energies, by their companions, by where formulas have values.
class Judges {
public:
    // What is handed over outlives it. `plain`, `plain_kernel`: in double. `measures`: errors, by companions;
    // `accepts_lost`: trajectories of which nothing is left are no failures.
    Judges(const Scene& scene, const Outline& outline, const KernelSource& plain, const Kernel& plain_kernel,
           const Kernel& kernel, const EnsembleRequest& request, bool measures, bool accepts_lost,
           std::recursive_mutex& algebra);

    Verdict judge(const EnsembleTrajectory& trajectory);

    // Of the steps that were looked at; empty: nothing.
    std::string warning() const { return watch_.warning(); }
    // Trajectories whose kinetic energy is not positive, and what is so of the first.
    struct NotPositive {
        std::int64_t count = 0, first = -1;
        std::string complaint;
    };
    const NotPositive& not_positive() const { return not_positive_; }

private:
    bool is_defined(const EnsembleTrajectory& trajectory, const EnsembleStart& start) const;
    void look_at_masses(std::int64_t trajectory, const std::vector<double>& parameters);

    const EnsembleRequest& request_;
    SweepWatch watch_;
    Domains domains_;
    ConstantMasses masses_;
    NotPositive not_positive_;
    std::optional<EnsembleCompanion> companion_;
    bool accepts_lost_;
    std::recursive_mutex& algebra_;  // formulas, which threads that make starts may evaluate too
};

}  // namespace lobatto
