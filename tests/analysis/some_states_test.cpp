// SPDX-License-Identifier: GPL-2.0-or-later
// Some states of a run: the first and later ones, spread over all times without a rhythm.
#include "analysis/accuracy/watch/some_states.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace lobatto;

TEST_CASE("some states are of all times and of no rhythm, and so are the first of them") {
    for (const std::int64_t seen : {80, 1000}) {
        SomeStates some(16);
        for (std::int64_t number = 0; number < seen; ++number) {
            const double row[] = {static_cast<double>(number), 0, 0};
            some.observe(number, row, 3);
        }
        const std::vector<SomeStates::State> states = some.scattered();
        REQUIRE(states.size() == 16);
        CHECK(states[0].number == 0);
        const auto late = [&](const SomeStates::State& state) { return state.number >= seen / 2; };
        const auto of_first = std::count_if(states.begin() + 1, states.begin() + 9, late);
        CHECK(of_first > 0);
        CHECK(of_first < 8);
        for (const std::int64_t period : {2, 3, 4})
            for (std::int64_t phase = 0; phase < period; ++phase)
                CHECK(std::any_of(states.begin(), states.end(),
                                  [&](const SomeStates::State& state) { return state.number % period == phase; }));
        const std::vector<SomeStates::State> in_order = some.in_order();
        CHECK(std::is_sorted(in_order.begin(), in_order.end(),
                             [](const auto& a, const auto& b) { return a.number < b.number; }));
        std::vector<double> saved;
        some.save(saved);
        SomeStates again(16);
        again.restore(saved.data(), saved.data() + saved.size(), 3);
        CHECK(again.in_order().back().number == in_order.back().number);
    }
}
