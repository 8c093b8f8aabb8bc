// SPDX-License-Identifier: GPL-2.0-or-later
// The steps in which a motion changes most, as in a close encounter: one of them may decide how large the error is.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "analysis/stepping.hpp"

namespace lobatto {

// Looks at kept states go by. For each position, each momentum and the energy: the state before the largest change.
// Coordinates of which there are many share places.
class HardestSteps {
public:
    HardestSteps();
    void observe(const std::vector<double>& state, double energy);  // not a number: it is not known
    States<double> states() const;                                  // in the order of time, each once

    // What it has observed so far, for a run that continues: `columns` a state.
    std::vector<double> save() const;
    void restore(const std::vector<double>& saved, std::size_t columns);

private:
    struct Place {
        double change = 0;
        std::vector<double> state;
    };
    std::vector<Place> places_;
    std::vector<double> before_;
    double energy_before_ = 0;
};

// The time of the first step that two shorter ones would take elsewhere, or that jumps over a singularity: the motion
// on the way is not the one that it takes. Of one step from each of `states`; of kept ones, which are `every` steps
// apart, the last at `end`, the one of these steps that goes furthest. `stepper` is prepared with `step`, and its
// trajectory is lost; distances are relative to `scale`; infinite: that number does not count.
std::optional<double> first_unresolved(LoadedStepper<double>& stepper, const States<double>& states, std::int64_t every,
                                       double end, const std::vector<double>& parameters, double step,
                                       const std::vector<double>& scale);

}  // namespace lobatto
