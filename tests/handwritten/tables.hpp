// SPDX-License-Identifier: GPL-2.0-or-later
// The tables of a general kernel, computed here from nodes and control points alone: a second way beside the
// generator's.
#pragma once

#include "runtime/kernel/kernel.hpp"

namespace lobatto {

template <class number>
constexpr number square_root(number x) {
    number y = x;
    for (int i = 0; i < 60; ++i) y = (y + x / y) / 2;
    return y;
}

// Nodes and weights; `kappa`: Lobatto's, whose momenta of cyclic coordinates vary within a step.
template <class number, int r, int m, bool kappa>
struct GalerkinValues {
    number c[r]{}, b[r]{}, control[m + 1]{};
    number B[r * (m + 1)]{}, D[r * (m + 1)]{}, extrapolation[(m + 1) * (m + 1)]{}, legendre_polynomial[r]{};

    constexpr void complete() {
        number ignored[m + 1]{};
        for (int i = 0; i < r; ++i) lagrange<m + 1>(control, c[i], B + i * (m + 1), D + i * (m + 1));
        for (int j = 0; j <= m; ++j) lagrange<m + 1>(control, 1 + control[j], extrapolation + j * (m + 1), ignored);
        if (!kappa) return;
        for (int i = 0; i < r; ++i) {  // (k + 1) P_k+1 = (2 k + 1) x P_k - k P_k-1
            number x = 2 * c[i] - 1, before = 1, now = x;
            for (int k = 1; k < r - 1; ++k) {
                const number next = (number(2 * k + 1) * x * now - number(k) * before) / number(k + 1);
                before = now;
                now = next;
            }
            legendre_polynomial[i] = now;
        }
    }
};

template <class number>
constexpr GalerkinValues<number, 4, 3, true> lobatto_four() {
    GalerkinValues<number, 4, 3, true> t{};
    const number inner = (1 - 1 / square_root(number(5))) / 2;
    const number c[4] = {0, inner, 1 - inner, 1},
                 b[4] = {number(1) / 12, number(5) / 12, number(5) / 12, number(1) / 12};
    for (int i = 0; i < 4; ++i) {
        t.c[i] = t.control[i] = c[i];
        t.b[i] = b[i];
    }
    t.complete();
    for (int i = 0; i < 16; ++i) t.B[i] = i % 5 == 0 ? number(1) : number(0);  // exactly
    return t;
}

template <class number>
constexpr GalerkinValues<number, 2, 2, false> gauss_two() {
    GalerkinValues<number, 2, 2, false> t{};
    const number shift = 1 / square_root(number(12));
    t.c[0] = number(1) / 2 - shift;
    t.c[1] = number(1) / 2 + shift;
    t.b[0] = t.b[1] = number(1) / 2;
    t.control[1] = number(1) / 2;
    t.control[2] = 1;
    t.complete();
    return t;
}

template <class number, class Values, const Values& values, int r, int m, int order_>
struct StaticTables {
    static constexpr int nodes = r, controls = m + 1, order = order_;
    static constexpr const number *c = values.c, *b = values.b, *control = values.control, *B = values.B, *D = values.D,
                                  *extrapolation = values.extrapolation,
                                  *legendre_polynomial = values.legendre_polynomial;
};
template <class number>
constexpr GalerkinValues<number, 4, 3, true> lobatto_four_values = lobatto_four<number>();
template <class number>
constexpr GalerkinValues<number, 2, 2, false> gauss_two_values = gauss_two<number>();

template <class number>
using LobattoFour = StaticTables<number, GalerkinValues<number, 4, 3, true>, lobatto_four_values<number>, 4, 3, 6>;
template <class number>
using GaussTwo = StaticTables<number, GalerkinValues<number, 2, 2, false>, gauss_two_values<number>, 2, 2, 4>;

// The tables of a separable kernel with four points: Lobatto's, or Gauss's two between the ends.
template <class number>
struct SeparableTables {
    number c[4]{}, b[4]{}, A[4]{}, E[8]{};
    constexpr void complete() {
        number ignored[4]{};
        for (int i = 0; i < 2; ++i) lagrange<4>(c, 1 + c[i + 1], E + 4 * i, ignored);
    }
};
template <class number>
constexpr SeparableTables<number> separable_lobatto_four() {
    SeparableTables<number> t{};
    const number root5 = square_root(number(5));
    for (int i = 0; i < 4; ++i) {
        t.c[i] = lobatto_four_values<number>.c[i];
        t.b[i] = lobatto_four_values<number>.b[i];
    }
    t.A[0] = t.A[3] = number(1) / 60;
    t.A[1] = (11 - 5 * root5) / 120;
    t.A[2] = (11 + 5 * root5) / 120;
    t.complete();
    return t;
}
template <class number>
constexpr SeparableTables<number> separable_gauss_two() {
    SeparableTables<number> t{};
    const number shift = square_root(number(3)) / 6, quarter = number(1) / 4;
    for (int i = 0; i < 2; ++i) {
        t.c[i + 1] = gauss_two_values<number>.c[i];
        t.b[i + 1] = number(1) / 2;
    }
    t.c[3] = 1;
    const number a[4] = {quarter, quarter - shift, quarter + shift, quarter};
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j) t.A[2 * i + j] = a[2 * i] * a[j] + a[2 * i + 1] * a[2 + j];
    t.complete();
    return t;
}
template <class number, const SeparableTables<number>& values, int order_>
struct StaticSeparableTables {
    static constexpr int points = 4, order = order_;
    static constexpr const number *c = values.c, *b = values.b, *A = values.A, *E = values.E;
};
template <class number>
constexpr SeparableTables<number> separable_lobatto_values = separable_lobatto_four<number>();
template <class number>
constexpr SeparableTables<number> separable_gauss_values = separable_gauss_two<number>();

template <class number>
using SeparableLobattoFour = StaticSeparableTables<number, separable_lobatto_values<number>, 6>;
template <class number>
using SeparableGaussTwo = StaticSeparableTables<number, separable_gauss_values<number>, 4>;

// What every kernel written by hand has.
struct HandwrittenKernel : KernelDefaults {
    static constexpr const char* digest = "0123456789abcdef";
    static constexpr const char* method = "by hand";
    static constexpr bool has_energy = true, has_tangent = true, any_number = false, uses_hessian = true;
};

}  // namespace lobatto
