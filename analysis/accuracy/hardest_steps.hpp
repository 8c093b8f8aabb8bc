// SPDX-License-Identifier: GPL-2.0-or-later
// The steps in which a motion changes most, as in a close encounter: one of them may decide how large the error is.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "analysis/accuracy/error_estimate.hpp"

namespace lobatto {

// Looks at kept states go by. For each position, each momentum and the energy: the state before the largest change.
// Coordinates of which there are many share places.
template <class real>
class HardestSteps {
public:
    HardestSteps();
    void observe(const std::vector<real>& state, real energy);  // not a number: it is not known
    States<real> states() const;                                // in the order of time, each once

    // What it has seen so far, for a later run that goes on: `columns` a state.
    std::vector<real> save() const;
    void restore(const std::vector<real>& seen, std::size_t columns);

private:
    struct Place {
        real change = 0;
        std::vector<real> state;
    };
    std::vector<Place> places_;
    std::vector<real> before_;
    real energy_before_ = 0;
};

// What single steps show.
struct SingleSteps {
    double error = 0;                  // the largest difference of a step and two of half its length
    std::optional<double> unresolved;  // time of the first step that half its length would take elsewhere, or that
                                       // jumps over a singularity: the motion on the way is not the one that it takes
};

// Of one step from each of `states`; of kept ones, which are `every` steps apart, the last at `end`, the one of these
// steps that goes furthest. `stepper` is prepared with `step`, and its trajectory is lost; errors are relative to
// `scale`; infinite: that number does not count.
template <class real>
SingleSteps single_steps(LoadedStepper<real>& stepper, const States<real>& states, std::int64_t every, real end,
                         const std::vector<real>& parameters, real step, const std::vector<double>& scale);

}  // namespace lobatto
