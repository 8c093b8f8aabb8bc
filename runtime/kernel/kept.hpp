// SPDX-License-Identifier: MIT
// What is kept of a trajectory instead of its states: a number that is made from one state after another.
#ifndef LOBATTO_KERNEL_KEPT_HPP
#define LOBATTO_KERNEL_KEPT_HPP

#include <cstdint>
#include <limits>

#include "base/numbers.hpp"

namespace lobatto {

// The time of the first event, and the number of events; the largest, the least, the mean and the last value of a
// formula. Means are taken by the trapezoidal rule.
enum class Kept : std::int32_t { first, count, max, min, mean, last };

struct KeptNumber {
    double value, before;  // before: of the formula, at the last state

    static constexpr double none = std::numeric_limits<double>::quiet_NaN();

    LOBATTO_DEVICE void begin(Kept of) {
        value = of == Kept::count || of == Kept::mean ? 0 : none;
        before = none;
    }
    // Of the formula at the next state; `passed`: the time since the state before, unless this is the first. What was
    // not a number once stays so.
    LOBATTO_DEVICE void observe(Kept of, double its_value, double passed, bool is_first) {
        if (of == Kept::last || its_value != its_value) value = its_value;
        const bool is_none = !is_first && value != value;
        if (of == Kept::max && !(value >= its_value) && !is_none) value = its_value;
        if (of == Kept::min && !(value <= its_value) && !is_none) value = its_value;
        if (of == Kept::mean && !is_first) value += passed * (its_value + before) / 2;
        before = its_value;
    }
    LOBATTO_DEVICE void observe_event(Kept of, double time) {
        if (of == Kept::count) ++value;
        if (of == Kept::first && value != value) value = time;
    }
    // After the time `passed` in all. Not a number: an event that did not happen.
    LOBATTO_DEVICE double result(Kept of, double passed) const {
        if (of != Kept::mean) return value;
        return passed != 0 ? value / passed : before;
    }
};

}  // namespace lobatto

#endif
