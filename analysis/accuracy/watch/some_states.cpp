// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/watch/some_states.hpp"

#include <algorithm>
#include <cmath>

namespace lobatto {

namespace {

// Bijective, and in no way regular (S. Vigna's splitmix64); 0 stays 0.
std::uint64_t scrambled(std::int64_t number) {
    std::uint64_t z = static_cast<std::uint64_t>(number) * 0x9e3779b97f4a7c15;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
}

}  // namespace

void SomeStates::observe(std::int64_t number, const double* row, std::size_t columns) {
    const std::uint64_t place = scrambled(number);
    if (states_.size() == most_) {
        if (place > states_.rbegin()->first) return;
        states_.erase(std::prev(states_.end()));
    }
    states_.emplace(place, State{number, {row, row + columns}});
}

std::vector<SomeStates::State> SomeStates::scattered() const {
    std::vector<State> all;
    for (const auto& [place, state] : states_) all.push_back(state);
    return all;
}

std::vector<SomeStates::State> SomeStates::in_order() const {
    std::vector<State> all = scattered();
    std::sort(all.begin(), all.end(), [](const State& a, const State& b) { return a.number < b.number; });
    return all;
}

void SomeStates::save(std::vector<double>& to) const {
    for (const auto& [place, state] : states_) {
        to.push_back(static_cast<double>(state.number));
        to.insert(to.end(), state.row.begin(), state.row.end());
    }
}

void SomeStates::restore(const double* from, const double* end, std::size_t columns) {
    for (; end - from > static_cast<std::ptrdiff_t>(columns); from += 1 + columns)
        observe(std::llround(*from), from + 1, columns);
}

}  // namespace lobatto
