// SPDX-License-Identifier: MIT
// The mass matrix of a node, as velocities need it: full, diagonal, or M = m(q) M0 with a constant M0 (K::scaled_mass),
// of which the node has 1/m alone.
#ifndef LOBATTO_KERNEL_NODE_MASS_HPP
#define LOBATTO_KERNEL_NODE_MASS_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"

namespace lobatto {

// M = L D L^T of a symmetric matrix, in place: L below the diagonal, 1/D on it. No pivoting: a mass matrix is positive
// definite as a rule, and where it is not, what fails shows as not finite or not converging.
template <int n, class V>
LOBATTO_INLINE void factor_symmetric(V* M) {
#pragma GCC unroll 8
    for (int k = 0; k < n; ++k) {
        V row[n];  // L_kj D_j
        V pivot = M[k * n + k];
#pragma GCC unroll 8
        for (int j = 0; j < k; ++j) {
            row[j] = M[k * n + j];
#pragma GCC unroll 8
            for (int l = 0; l < j; ++l) row[j] = fused(-row[l], M[j * n + l], row[j]);
            M[k * n + j] = row[j] * M[j * n + j];
            pivot = fused(-row[j], M[k * n + j], pivot);
        }
        M[k * n + k] = V(real_of<V>(1)) / pivot;
    }
}
template <int n, class V>
LOBATTO_INLINE void solve_symmetric(const V* M, V* x) {
#pragma GCC unroll 8
    for (int k = 1; k < n; ++k)
#pragma GCC unroll 8
        for (int j = 0; j < k; ++j) x[k] = fused(-M[k * n + j], x[j], x[k]);
    for (int k = n - 1; k >= 0; --k) {
        x[k] *= M[k * n + k];
#pragma GCC unroll 8
        for (int j = k + 1; j < n; ++j) x[k] = fused(-M[j * n + k], x[j], x[k]);
    }
}

// No two velocities are multiplied.
template <class K>
constexpr bool has_diagonal_mass() {
    for (int e = 0; e < K::mass_entries; ++e)
        if (K::mass_row[e] != K::mass_column[e]) return false;
    return true;
}
// Nodes have no matrix at all: there may be any number of coordinates.
template <class K>
constexpr bool has_light_mass() {
    return K::scaled_mass && has_diagonal_mass<K>();
}

// V: the values of a node, or of nodes side by side; T: those of a trajectory.
template <class K, class T, class V>
struct NodeMass {
    using real = typename K::real;
    static constexpr int n = K::coordinates;
    static constexpr bool is_diagonal = has_diagonal_mass<K>(), is_scaled = K::scaled_mass,
                          is_full = !is_diagonal && !is_scaled;
    static constexpr int given = is_scaled ? 1 : K::mass_entries;         // values that K::stage gives of a node
    static constexpr int room = is_scaled ? 1 : is_diagonal ? n : n * n;  // values that are kept of it
    static constexpr int shapes = !is_scaled ? 1 : is_diagonal ? n : n * n;

    // Where the entries that K::stage gives stand in what is kept.
    struct Places {
        int of[given]{};
        constexpr Places() {
            for (int e = 0; e < given; ++e)
                of[e] = is_diagonal ? K::mass_row[e] : K::mass_row[e] * n + K::mass_column[e];
        }
    };

    T shape[shapes], inverse_shape[shapes];  // M0 and its inverse, where masses are scaled

    // M0 from M at some place.
    template <class Given>
    void begin(const Given& k, real time, const real* q, const real* velocity, int lane) {
        if constexpr (is_scaled) {
            real p[n], M[K::mass_entries], whole[n * n] = {}, column[n];
            Formulas<K>::legendre(k, time, q, velocity, p, M);
            for (int e = 0; e < K::mass_entries; ++e) whole[K::mass_row[e] * n + K::mass_column[e]] = M[e] / M[0];
            if constexpr (is_diagonal) {
                for (int c = 0; c < n; ++c) {
                    set_lane(shape[c], lane, whole[c * n + c]);
                    set_lane(inverse_shape[c], lane, real(1) / whole[c * n + c]);
                }
            } else {
                for (int i = 0; i < n * n; ++i) set_lane(shape[i], lane, whole[i]);
                factor_symmetric<n>(whole);
                for (int c = 0; c < n; ++c) {
                    for (int i = 0; i < n; ++i) column[i] = i == c ? real(1) : real(0);
                    solve_symmetric<n>(whole, column);
                    for (int i = 0; i < n; ++i) set_lane(inverse_shape[i * n + c], lane, column[i]);
                }
            }
        }
    }

    // M0 d, or d where masses are not scaled.
    LOBATTO_INLINE void momentum_of(const T* d, T* p) const {
        for (int i = 0; i < n; ++i)
            if constexpr (!is_scaled) {
                p[i] = d[i];
            } else if constexpr (is_diagonal) {
                p[i] = shape[i] * d[i];
            } else {
                p[i] = T(real(0));
                for (int j = 0; j < n; ++j) p[i] = fused(shape[i * n + j], d[j], p[i]);
            }
    }

    // What is kept of a node's mass matrix, of what K::stage gives.
    LOBATTO_INLINE static void take(const V* packed, V* M) {
        static constexpr Places place{};
        if constexpr (is_scaled) {
            M[0] = packed[0];
        } else if constexpr (is_diagonal) {
            for (int e = 0; e < given; ++e) M[place.of[e]] = V(real(1)) / packed[e];
        } else {
#pragma GCC unroll 8
            for (int i = 0; i < n * n; ++i) M[i] = V(real(0));
            for (int e = 0; e < given; ++e) M[place.of[e]] = packed[e];
            factor_symmetric<n>(M);
        }
    }

    // x <- M^-1 x.
    LOBATTO_INLINE void solve(const V* M, V* x) const {
        if constexpr (is_full) {
            solve_symmetric<n>(M, x);
        } else if constexpr (is_diagonal) {
            for (int c = 0; c < n; ++c)
                if constexpr (is_scaled)
                    x[c] *= M[0] * V(inverse_shape[c]);
                else
                    x[c] *= M[c];
        } else {
            V scaled[n];
            for (int c = 0; c < n; ++c) scaled[c] = M[0] * x[c];
            for (int i = 0; i < n; ++i) {
                x[i] = V(inverse_shape[i * n]) * scaled[0];
                for (int j = 1; j < n; ++j) x[i] = fused(V(inverse_shape[i * n + j]), scaled[j], x[i]);
            }
        }
    }
};

}  // namespace lobatto

#endif
