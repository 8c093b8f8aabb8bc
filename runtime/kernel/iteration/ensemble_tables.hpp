// SPDX-License-Identifier: MIT
// The tables of an ensemble of a separable system: its stage map, and what the increments of its iterations are
// measured against. Lanes of one length of step share them.
#ifndef LOBATTO_KERNEL_ENSEMBLE_TABLES_HPP
#define LOBATTO_KERNEL_ENSEMBLE_TABLES_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "stage_map.hpp"

namespace lobatto {

template <class K, class T>
struct EnsembleTables : StageMap<K, T> {
    using real = typename K::real;
    using Tables = StageMap<K, T>;
    using Tables::n, Tables::m, Tables::absorbs, Tables::maps, Tables::parts, Tables::h, Tables::diagonal,
        Tables::node_time, Tables::weight, Tables::arrival;

    // Of increments: the square that is small enough, and what they are measured against at least, a part of the
    // position's size and a number.
    struct Measure {
        real enough, part, least;
    };

    // The same for all trajectories of one step size. Where a trajectory's numbers are taken into the map, it is so of
    // those with the same parameters.
    struct Shared {
        typename Tables::Map map[maps];
        std::conditional_t<absorbs, T[n], Nothing> diagonal;
        T reach;
        T node_time[parts], weight[parts], arrival[parts];
        real h;
        Measure settled, near;
    };

    T reach;  // root of the sum of squares of a row of M, the largest
    Measure settled, near;

    void prepare(const typename K::Coefficients& k, real step, int lane) {
        Tables::prepare(k, step, lane);
        real largest = real(0);
        for (int c = 0; c < maps; ++c)
            for (int i = 0; i < m; ++i) {
                real squares = real(0);
                for (int j = 0; j < m; ++j) {
                    const real entry = lane_of(this->map[c].inner[j][i], lane);
                    squares += entry * entry;
                }
                largest = maximum(largest, squares);
            }
        set_lane(reach, lane, sqrt(largest));
    }

    // Increments of positions are measured against what a coordinate moves by in a step. They count as nothing when
    // they are `tolerance` (0: rounding), and S as constant when they are its root.
    void set_tolerance(real tolerance) {
        const real small = maximum(tolerance, Limits<real>::epsilon);
        const real linear = maximum(Limits<real>::root_epsilon, sqrt(tolerance));
        constexpr real floor = Limits<real>::epsilon / Limits<real>::root_epsilon;
        settled = {small * small, maximum(floor, Limits<real>::epsilon / small), Limits<real>::smallest / small};
        near = {linear * linear, maximum(floor, real(8) * Limits<real>::epsilon / linear),
                real(8) * Limits<real>::smallest / linear};
    }

    Shared shared() const {
        Shared all{};
        for (int c = 0; c < maps; ++c) all.map[c] = this->map[c];
        if constexpr (absorbs)
            for (int c = 0; c < n; ++c) all.diagonal[c] = diagonal[c];
        all.reach = reach;
        for (int i = 0; i < parts; ++i) {
            all.node_time[i] = node_time[i];
            all.weight[i] = weight[i];
            all.arrival[i] = arrival[i];
        }
        all.h = h;
        all.settled = settled;
        all.near = near;
        return all;
    }
    template <bool alike>
    LOBATTO_INLINE void take(const Shared& all) {
        if constexpr (alike || !absorbs) {
            for (int c = 0; c < maps; ++c) this->map[c] = all.map[c];
            reach = all.reach;
        }
        if constexpr (alike && absorbs)
            for (int c = 0; c < n; ++c) diagonal[c] = all.diagonal[c];
        for (int i = 0; i < parts; ++i) {
            node_time[i] = all.node_time[i];
            weight[i] = all.weight[i];
            arrival[i] = all.arrival[i];
        }
        h = all.h;
        settled = all.settled;
        near = all.near;
    }
};

}  // namespace lobatto

#endif
