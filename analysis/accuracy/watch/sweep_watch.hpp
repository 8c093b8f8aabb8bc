// SPDX-License-Identifier: GPL-2.0-or-later
// Whether the trajectories of a sweep stayed with their Lagrangian, as EnergyWatch tells it of a run; and whether their
// steps lie beyond the linear stability limit.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "generator/emit/kernel.hpp"
#include "generator/mechanics/outline.hpp"
#include "runtime/run/ensemble/ensemble.hpp"

namespace lobatto {

class SweepWatch {
public:
    // What is handed over outlives it. Systems that EnergyWatch can watch; of others nothing is told.
    SweepWatch(const Outline& outline, const KernelSource& source, const Kernel& kernel,
               const EnsembleRequest& request);
    // Whether the energy of this one, which reached the end, is off by as much as the motion has. Those where the
    // kinetic energies of both ends leave that open are run once more by themselves, as `lobatto run` does it.
    bool departs(const EnsembleTrajectory& trajectory);

    // Looks for the largest frequency at the start and at the last kept state; of the first 1000 trajectories, of up to
    // 64 coordinates.
    void observe(const EnsembleTrajectory& trajectory);
    // Of the steps looked at, as a sentence; empty where none is beyond the limit.
    std::string warning() const;

private:
    bool run_again(const EnsembleTrajectory& trajectory);
    bool prepare(const EnsembleTrajectory& trajectory);

    Outline outline_;
    const KernelSource& source_;
    const EnsembleRequest& request_;
    Kernel kernel_;                // in double
    std::optional<Kernel> alone_;  // for one trajectory; compiled when the first is run again
    bool watches_;
    LoadedStepper<double> stepper_;
    EnsembleStart start_;
    std::vector<double> p_;  // of the start
    int looks_ = 0;
    double radians_ = 0;  // h omega, the largest met
    std::int64_t trajectory_ = 0;
};

}  // namespace lobatto
