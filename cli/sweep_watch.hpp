// SPDX-License-Identifier: GPL-2.0-or-later
// Whether the trajectories of a sweep stayed with their Lagrangian, as EnergyWatch tells it of a run.
#pragma once

#include "generator/pipeline.hpp"
#include "runtime/ensemble.hpp"

namespace lobatto {

class SweepWatch {
public:
    // What is handed over outlives it. Systems that EnergyWatch can watch; of others nothing is told.
    SweepWatch(const Derivation& derivation, const Kernel& kernel, const EnsembleRequest& request);
    // Whether the energy of this one, which reached the end, is off by as much as the motion has. Those where the
    // kinetic energies of both ends leave that open are run once more by themselves.
    bool departs(const EnsembleTrajectory& trajectory);

private:
    bool run_again();

    const Derivation& derivation_;
    const EnsembleRequest& request_;
    Kernel kernel_;
    bool watches_;
    LoadedStepper<double> stepper_;
    EnsembleStart start_;
    std::vector<double> p_;  // of the start
};

}  // namespace lobatto
