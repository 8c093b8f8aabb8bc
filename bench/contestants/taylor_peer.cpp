// SPDX-License-Identifier: GPL-2.0-or-later
// Our own implementation of Taylor's method as a contestant, in a file of its own for the compiler options that suit
// it; compiled by clang++ a second time where that is installed.
#include <memory>

#include "bench/contestants/contestant.hpp"
#include "bench/peers/taylor.hpp"

namespace lobatto::bench {

namespace {

#ifdef LOBATTO_BENCH_BY_CLANG
const char* const method = "Taylor series, by clang++";
#else
const char* const method = "Taylor series";
#endif

// Eight trajectories side by side, what is left one by one; chains all one by one, eight masses side by side: faster.
template <class Type>
Contestant taylor(const Problem& problem) {
    const auto single = std::make_shared<Expansion<Type, double>>();
    const auto eight = std::make_shared<Expansion<Type, Eight>>();
    const auto run = [=, until = problem.until](double setting, std::vector<Trajectory>& trajectories) {
        Effort all{true, 0, 0};
        const auto take = [&](auto& x, std::size_t first, int lanes) {
            constexpr int n = Type::coordinates;
            for (int lane = 0; lane < lanes; ++lane)
                for (int k = 0; k < n; ++k) {
                    put(x, k, lane, trajectories[first + lane].q[k]);
                    put(x, n + k, lane, trajectories[first + lane].p[k]);
                }
            const long steps = integrate_taylor(x, until, setting).steps;
            for (int lane = 0; lane < lanes; ++lane)
                for (int k = 0; k < n; ++k) {
                    trajectories[first + lane].q[k] = get(x, k, lane);
                    trajectories[first + lane].p[k] = get(x, n + k, lane);
                }
            all.good = all.good && steps >= 0;
            all.steps += steps;
        };
        std::size_t first = 0;
        if constexpr (!std::is_same_v<Type, Chain>)
            for (; first + 8 <= trajectories.size(); first += 8) take(*eight, first, 8);
        for (; first < trajectories.size(); ++first) take(*single, first, 1);
        return all;
    };
    return {method, 0, false, false, Ladder::tolerance, run};
}

}  // namespace

#ifdef LOBATTO_BENCH_BY_CLANG
Contestants taylor_peer_by_clang(const Problem& problem) {
#else
Contestants taylor_peer(const Problem& problem) {
#endif
    return with_type_of(problem, [&](auto type) -> Contestants { return {taylor<decltype(type)>(problem)}; });
}

}  // namespace lobatto::bench
