// SPDX-License-Identifier: MIT
// What one step of a system with constant mass adds to first order: its tangent map without the identity (D24, D40).
#ifndef LOBATTO_KERNEL_TANGENT_HPP
#define LOBATTO_KERNEL_TANGENT_HPP

#include "../base/contract.hpp"
#include "../base/dense.hpp"
#include "../base/numbers.hpp"

namespace lobatto {

// S = M^-1 V'' of one node from its stored entries to a full n x n matrix.
template <class K>
inline void expand_entries(const typename K::real* entries, typename K::real* S) {
    for (int i = 0; i < K::coordinates * K::coordinates; ++i) S[i] = typename K::real(0);
    for (int e = 0; e < K::entries; ++e) S[K::entry_row[e] * K::coordinates + K::entry_column[e]] = entries[e];
}

// What a kick u += length W(q) and a drift q += length u of explicit steps (D40) add to E, as in increment_of_step; W0
// may be null.
template <class K>
inline void kick_increment(typename K::real length, const typename K::real* entries, const typename K::real* W0,
                           typename K::real* E) {
    using real = typename K::real;
    constexpr int n = K::coordinates, columns = 2 * n + 1;
    for (int e = 0; e < K::entries; ++e) {
        const real* const from = E + K::entry_column[e] * columns;
        real* const to = E + (n + K::entry_row[e]) * columns;
        for (int c = 0; c < columns; ++c)
            to[c] += length * (entries[e] * ((c == K::entry_column[e] ? real(1) : real(0)) + from[c]));
    }
    for (int k = 0; k < n && W0 != nullptr; ++k) E[(n + k) * columns + 2 * n] += length * W0[k];
}
template <class K>
inline void drift_increment(typename K::real length, typename K::real* E) {
    using real = typename K::real;
    constexpr int n = K::coordinates, columns = 2 * n + 1;
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c)
            E[k * columns + c] += length * ((c == n + k ? real(1) : real(0)) + E[(n + k) * columns + c]);
}

// What one step adds, in (q, u), from the S of the s nodes: E = T - I with T the tangent map (D24). E: 2n x (2n + 1);
// its last column is the image of the constant acceleration W0 when S does not depend on q, that is, the shift of a
// linear system with forces at q = 0. E is small for a small step and keeps its digits there, T would not.
template <class K>
inline bool increment_of_step(typename K::real h, const typename K::real* S, const typename K::real* W0,
                              typename K::real* E) {
    using real = typename K::real;
    constexpr int n = K::coordinates, s = K::points, m = s - 2, N = n * m, columns = 2 * n + 1;
    real v[n * columns], X[(N > 0 ? N : 1) * columns], J[N > 0 ? N * N : 1];
    const auto unit = [](int k, int column) { return k == column ? real(1) : real(0); };
    // force(node, values): M^-1 (V'' values + V'(0)) for column c of the values
    const auto force = [&](int node, const real* values, int k, int column) {
        real sum = column == 2 * n ? W0[k] : real(0);
        for (int l = 0; l < n; ++l) sum += S[(node * n + k) * n + l] * values[l * columns + column];
        return sum;
    };
    real q0[n * columns];
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c) q0[k * columns + c] = unit(k, c);
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c) v[k * columns + c] = unit(k + n, c) - h * K::b[0] * force(0, q0, k, c);
    for (int i = 0; i < m; ++i)
        for (int k = 0; k < n; ++k)
            for (int c = 0; c < columns; ++c) {
                real sum = q0[k * columns + c] + h * K::c[i + 1] * v[k * columns + c];
                if (c == 2 * n)
                    for (int j = 0; j < m; ++j) sum -= h * h * K::A[i * m + j] * W0[k];
                X[(i * n + k) * columns + c] = sum;
            }
    for (int i = 0; i < m; ++i)
        for (int j = 0; j < m; ++j)
            for (int k = 0; k < n; ++k)
                for (int l = 0; l < n; ++l)
                    J[(i * n + k) * N + j * n + l] =
                        (i == j && k == l ? real(1) : real(0)) + h * h * K::A[i * m + j] * S[((j + 1) * n + k) * n + l];
    if constexpr (N > 0) {
        if (!solve<N, columns>(J, X)) return false;
    }
    real* const dq = E;
    real* const du = E + n * columns;
    real q1[n * columns];
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c) {
            real position = h * v[k * columns + c];
            real rate = -(h * K::b[0] * force(0, q0, k, c));
            for (int j = 0; j < m; ++j) {
                const real w = force(j + 1, X + j * n * columns, k, c);
                position -= h * h * (K::b[j + 1] * (real(1) - K::c[j + 1])) * w;
                rate -= h * K::b[j + 1] * w;
            }
            dq[k * columns + c] = position;
            du[k * columns + c] = rate;
            q1[k * columns + c] = q0[k * columns + c] + position;
        }
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c) du[k * columns + c] -= h * K::b[s - 1] * force(s - 1, q1, k, c);
    return true;
}

// T = I + E without the last column of E.
template <class K>
inline void add_identity(const typename K::real* E, typename K::real* T) {
    using real = typename K::real;
    constexpr int size = 2 * K::coordinates;
    for (int r = 0; r < size; ++r)
        for (int c = 0; c < size; ++c) T[r * size + c] = (r == c ? real(1) : real(0)) + E[r * (size + 1) + c];
}

// From (q, u) to (q, p): rows of u and columns of u are multiplied by M and M^-1; the identity stays. T: 2n x (2n + 1).
template <class K>
inline void to_momentum(const typename K::Coefficients& k, typename K::real* T) {
    using real = typename K::real;
    constexpr int n = K::coordinates, columns = 2 * n + 1;
    real column[n], image[n];
    for (int c = 0; c < columns; ++c) {
        for (int i = 0; i < n; ++i) column[i] = T[(n + i) * columns + c];
        K::momentum(k, column, image);
        for (int i = 0; i < n; ++i) T[(n + i) * columns + c] = image[i];
    }
    // T M^-1 row by row: M is symmetric, so a row times M^-1 is M^-1 applied to the row.
    for (int r = 0; r < 2 * n; ++r) {
        K::velocity(k, T + r * columns + n, image);
        for (int i = 0; i < n; ++i) T[r * columns + n + i] = image[i];
    }
}

}  // namespace lobatto

#endif
