// SPDX-License-Identifier: GPL-2.0-or-later
// A few states of a motion, of all its times.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

namespace lobatto {

// Chosen as if at random, by scrambled numbers: equal distances could go along with the motion's own rhythm, so that
// all of them are at one place, perhaps at rest. The first one, number 0, is always among them.
class SomeStates {
public:
    struct State {
        std::int64_t number;
        std::vector<double> row;  // t, q, p
    };

    explicit SomeStates(std::size_t most) : most_(most) {}

    void observe(std::int64_t number, const double* row, std::size_t columns);
    bool empty() const { return states_.empty(); }
    std::vector<State> in_order() const;   // of their numbers
    std::vector<State> scattered() const;  // the first of these are of all times, too

    // As numbers, 1 + columns for each.
    void save(std::vector<double>& to) const;
    void restore(const double* from, const double* end, std::size_t columns);

private:
    std::size_t most_;
    std::map<std::uint64_t, State> states_;  // by scrambled numbers: those with the smallest
};

}  // namespace lobatto
