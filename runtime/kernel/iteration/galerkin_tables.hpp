// SPDX-License-Identifier: MIT
// The tables of the Galerkin equations (D35) for one length of step, in the layout of the nodes: a trajectory's in the
// lanes of Packs, an ensemble's one after another. All trajectories with equal steps share them.
#ifndef LOBATTO_KERNEL_GALERKIN_TABLES_HPP
#define LOBATTO_KERNEL_GALERKIN_TABLES_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "stage_map.hpp"

namespace lobatto {

// A' of a kernel's nodes.
template <class K>
struct MomentumIntegration {
    static constexpr int r = K::nodes;
    typename K::real entry[r][r]{};

    constexpr MomentumIntegration() {
        for (int i = 0; i < r; ++i)
            for (int j = 0; j < r; ++j)
                entry[i][j] = K::b[j] * (typename K::real(1) - K::integration[j * r + i] / K::b[i]);
    }
};
template <class K, bool computed_at_start = is_many_digits<typename K::real>>
constexpr MomentumIntegration<K> momentum_integration{};
template <class K>
inline const MomentumIntegration<K> momentum_integration<K, true>{};  // MPFR is no part of the compiler

template <class K, class T>
struct GalerkinTables {
    using real = typename K::real;
    static constexpr int r = K::nodes;
    using Layout = NodeLayout<real, T, r - 1, node_lanes<real>>;  // r nodes
    using V = typename Layout::V;
    static constexpr bool in_lanes = Layout::in_lanes;
    static constexpr int width = Layout::width, parts = Layout::parts_of(r);

    static constexpr bool has_kappa() {
        for (int i = 0; i < r; ++i)
            if (K::legendre_polynomial[i] != real(0)) return true;
        return false;
    }

    V position_map[r][parts], momentum_map[r][parts];  // h A and h A', a column for each node
    V weight[parts], legendre[parts];                  // h b and pi; zero in lanes to spare
    V on_legendre[parts];                              // b pi / sum b pi^2; likewise
    V ahead[r][parts], node_time[parts];
    T h{};
    real tolerance{};  // of increments, relative; 0: to rounding

    // Steps may be of a length of their own in each lane.
    void prepare(const T& step) {
        h = step;
        real square = real(0);
        for (int i = 0; i < r; ++i) square += K::b[i] * K::legendre_polynomial[i] * K::legendre_polynomial[i];
        for (int i = 0; i < parts * width; ++i) {
            const bool is_node = i < r;
            const int node = is_node ? i : r - 1;
            for (int j = 0; j < r; ++j) {
                put(position_map[j], i, h * T(K::integration[node * r + j]));
                put(momentum_map[j], i, h * T(momentum_integration<K>.entry[node][j]));
                put(ahead[j], i, T(K::ahead[node * r + j]));
            }
            put(node_time, i, h * T(K::c[node]));
            put(weight, i, is_node ? h * T(K::b[node]) : T(real(0)));
            put(legendre, i, T(K::legendre_polynomial[node]));
            put(on_legendre, i,
                T(is_node && has_kappa() ? K::b[node] * K::legendre_polynomial[node] / square : real(0)));
        }
    }

private:
    static void put(V* values, int i, const T& x) {
        if constexpr (in_lanes)
            set_lane(values[i / width], i % width, x);
        else
            values[i] = x;
    }
};

}  // namespace lobatto

#endif
