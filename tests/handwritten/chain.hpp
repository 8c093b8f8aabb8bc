// SPDX-License-Identifier: GPL-2.0-or-later
// The chain of Fermi, Pasta, Ulam and Tsingou between two walls, by hand, with loops over its coordinates.
//
//     L = sum_i x_i'^2/2 - sum_{i=0}^{n} (d_i^2/2 + beta d_i^4/4),  d_i = x_{i+1} - x_i,  x_0 = x_{n+1} = 0
// beta = 0: linear. Absorbed: the part without beta.
#pragma once

#include "runtime/kernel/kernel.hpp"
#include "tests/handwritten/tables.hpp"

namespace lobatto {

template <int n>
struct TridiagonalTables {
    int entry_row[3 * n - 2]{}, entry_column[3 * n - 2]{}, position[n]{};
    constexpr TridiagonalTables() {
        int e = 0;
        for (int i = 0; i < n; ++i) {
            position[i] = n - 1 - i;  // backwards, so that the order is not the coordinates' own
            for (int j = i > 0 ? i - 1 : 0; j < n && j <= i + 1; ++j, ++e) {
                entry_row[e] = i;
                entry_column[e] = j;
            }
        }
    }
};
template <int n>
constexpr TridiagonalTables<n> tridiagonal{};

enum class Chain { newton, absorbed, linear };

template <class number, class Tables, int n, Chain chain>
struct HandwrittenChain : HandwrittenKernel, Tables {
    using real = number;
    static constexpr const char* name = "handwritten_chain";
    static constexpr int coordinates = n, parameter_count = 1;
    static constexpr Form form = Form::separable;
    static constexpr bool autonomous = true, linear = chain == Chain::linear, absorbed = chain == Chain::absorbed;
    static constexpr bool has_tangent = n <= 8;
    static constexpr int unknowns = n * (Tables::points - 2);
    static constexpr int entries = 3 * n - 2;
    static constexpr const int *entry_row = tridiagonal<n>.entry_row, *entry_column = tridiagonal<n>.entry_column,
                               *position = tridiagonal<n>.position;
    static constexpr int group_count = 1, group_first[2] = {0, n}, group_bandwidth[1] = {1};
    static inline long nodes_evaluated = 0;  // with their second derivatives

    struct Parameters {
        real beta = 0.3;
    };
    static real& parameter(Parameters& p, int) { return p.beta; }
    using Coefficients = Parameters;
    static Status prepare(const Parameters& p, real, Coefficients& k) {
        k = p;
        return Status::ok;
    }

    static real stretch(const real* q, int i) { return (i < n ? q[i] : real(0)) - (i > 0 ? q[i - 1] : real(0)); }
    static void minus_acceleration(const Coefficients& k, const real* q, real* W) {
        real before = stretch(q, 0);
        before += k.beta * before * before * before;
        for (int i = 0; i < n; ++i) {
            real after = stretch(q, i + 1);
            after += k.beta * after * after * after;
            W[i] = before - after;
            before = after;
        }
    }
    static void second(real beta, const real* q, real* S) {
        int e = 0;
        const auto stiffness = [&](int i) { return 1 + 3 * beta * stretch(q, i) * stretch(q, i); };
        for (int i = 0; i < n; ++i) {
            if (i > 0) S[e++] = -stiffness(i);
            S[e++] = stiffness(i) + stiffness(i + 1);
            if (i + 1 < n) S[e++] = -stiffness(i + 1);
        }
    }
    static void node(const Coefficients& k, const real* q, real* W, real* S) {
        ++nodes_evaluated;
        minus_acceleration(k, q, W);
        second(k.beta, q, S);
    }
    static void quadratic_part(const Coefficients&, real* S0) {
        const real none[n] = {};
        second(0, none, S0);
    }
    static void momentum(const Coefficients&, const real* v, real* p) {
        for (int i = 0; i < n; ++i) p[i] = v[i];
    }
    static void velocity(const Coefficients& k, const real* p, real* v) { momentum(k, p, v); }
    static real energy(const Coefficients& k, const real* q, const real* p) {
        real sum = 0;
        for (int i = 0; i < n; ++i) sum += p[i] * p[i] / 2;
        for (int i = 0; i <= n; ++i) {
            const real d = stretch(q, i), d2 = d * d;
            sum += d2 / 2 + k.beta * d2 * d2 / 4;
        }
        return sum;
    }
};

}  // namespace lobatto
