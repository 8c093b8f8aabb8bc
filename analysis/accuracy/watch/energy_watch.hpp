// SPDX-License-Identifier: GPL-2.0-or-later
// Whether a run stayed with its Lagrangian: the first state whose energy, which the motion conserves, is far off.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/accuracy/watch/some_states.hpp"
#include "generator/mechanics/outline.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

class EnergyWatch {
public:
    // Systems without time and forces, of up to 64 coordinates. Their kernels need an energy, whether the scene asks
    // for it or not.
    static bool can_watch(const Outline& outline);
    EnergyWatch(const Outline& outline, const Kernel& kernel);
    // Looks at the kept states go by: some of all times, and those where the energy error has doubled.
    void observe(const Records& records);

    // What it has observed so far, for a run that continues.
    std::vector<double> save() const;
    void restore(const std::vector<double>& saved);

    // The first such state, where the energy is off by half of the mean kinetic energy, and by more than rounding of
    // the positions explains, or not real: no path of this Lagrangian goes there. What to tell of it, as of any stop;
    // empty: there is none.
    // `jumps`: whether the Lagrangian was seen to jump (jumps_of).
    std::string departure(const Outline& outline, const Kernel& kernel, const TrajectoryRequest& request,
                          bool jumps = false) const;

private:
    using States = std::vector<std::vector<double>>;  // t, q, p

    bool watches_;
    std::size_t columns_;
    std::int64_t rows_a_step_;  // the energies of states between the steps are not conserved as well
    std::int64_t seen_ = 0;
    double energy_start_ = 0, energy_error_ = 0;
    bool lost_ = false;  // an energy in double that is no number
    SomeStates some_;
    States leaving_;  // the first is the start
    States rows_of_some() const;
};

}  // namespace lobatto
