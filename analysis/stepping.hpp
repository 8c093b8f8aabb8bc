// SPDX-License-Identifier: GPL-2.0-or-later
// A stepper moved between rows of t, q, p.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "runtime/build/library.hpp"

namespace lobatto {

// Rows of t, q, p.
template <class real>
using States = std::vector<std::vector<real>>;

template <class real>
lobatto_status start_at(LoadedStepper<real>& stepper, const std::vector<real>& state) {
    const auto begin = state.begin() + 1, middle = begin + (state.end() - begin) / 2;
    return stepper.start(state[0], {begin, middle}, {middle, state.end()});
}

// From where `stepper` is; nothing when a step fails.
template <class real>
std::vector<real> state_after(LoadedStepper<real>& stepper, std::int64_t steps) {
    lobatto_advance call{};
    call.steps = steps;
    if (stepper.advance(call) != LOBATTO_OK) return {};
    std::vector<real> state(1), q, p;
    stepper.state(state[0], q, p);
    state.insert(state.end(), q.begin(), q.end());
    state.insert(state.end(), p.begin(), p.end());
    return state;
}

// The largest |x_k - y_k| / scale_k of positions and momenta; not a number where one is none.
template <class real>
double distance(const std::vector<real>& x, const std::vector<real>& y, const std::vector<double>& scale) {
    double largest = 0;
    for (std::size_t k = 0; k < scale.size(); ++k) {
        const double here = std::fabs(static_cast<double>(x[1 + k] - y[1 + k])) / scale[k];
        if (!(here <= largest)) largest = here;
    }
    return largest;
}

}  // namespace lobatto
