// SPDX-License-Identifier: GPL-2.0-or-later
// The exact step of a linear system with one coordinate: a continued fraction.
#include "generator/method/propagation.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using GiNaC::numeric;

// Write the path as a Legendre series, q(theta) = sum_{n <= r} x_n P_n(2 theta - 1), and its slope as
// (q1 - q0) + sum_{n=1}^{r-1} 2 (2 n + 1) y_n P_n with y_0 = (q1 - q0)/2, y_r = 0; then x_n = y_{n-1} - y_{n+1} for
// n >= 1 and x_0 = (q0 + q1)/2 - y_1. Both rules are exact for products of degree 2 r - 1, so that the action of a step
// is a sum of squares, in units of m/h,
//     L_d = 1/2 sum_{n=0}^{r-1} 4 (2 n + 1) y_n^2 - z/2 sum_{n=0}^{r} w_n x_n^2,   w_n = 1/(2 n + 1) for n < r,
//     w_r = sum_i b_i P_r(2 c_i - 1)^2 = 1/r (Lobatto), 0 (Gauss):
// two chains of springs, one of mean and y_1, y_3, ..., one of y_0, y_2, ... . Springs in series add their reciprocals.
// Eliminating the chains from their far ends leaves, with t_n = x^2/(2 n + 1 - t_{n+1}) and x^2 = z/4,
//     L_d = -4 A mean^2/2 + T (q1 - q0)^2/2,   A = t_0,   T = 1 - t_1,   t_r = x^2 w_r or 0:
// x^2 w_r in the chain that contains x_r (A for even r, T for odd), 0 in the other. As r grows A and T tend to x tan x
// and x cot x. From p0 = -dL_d/dq0, p1 = dL_d/dq1:
//     q1 = ((T - A) q0 + (h/m) p0) / (T + A),   p1 = (-4 A T (m/h) q0 + (T - A) p0) / (T + A).
struct Fraction {
    ex above, below;  // t_0 = x^2 below/above, 1 - t_1 = above/below: the denominators of t_0 and t_1
};

Fraction fraction(int r, const numeric& end, const ex& z) {
    ex numerator = end, denominator = 1, below = 1;  // t_n = x^2 numerator/denominator, from n = r down
    for (int n = r - 1; n >= 0; --n) {
        below = denominator;
        denominator = ((2 * n + 1) * denominator - z / 4 * numerator).expand();
        numerator = below;
    }
    return {denominator, below};
}

// Kicks and drifts are linear in turn, in q and (h/m) p: kick (h/m) p -= z b q, drift q += a (h/m) p.
Propagation propagation_of_composition(const Quadrature& quadrature) {
    Propagation result;
    const ex z = result.z;
    // Rows q and (h/m) p of the states that begin as (1, 0) and (0, 1).
    ex q[2] = {1, 0}, p[2] = {0, 1};
    for (std::size_t i = 0; i < quadrature.c.size(); ++i)
        for (int k = 0; k < 2; ++k) {
            p[k] = (p[k] - z * quadrature.b[i] * q[k]).expand();
            if (i + 1 < quadrature.c.size()) q[k] = (q[k] + (quadrature.c[i + 1] - quadrature.c[i]) * p[k]).expand();
        }
    result.delta = 1;
    result.a = q[0];
    result.b = p[0];
    result.c = q[1];
    result.e_q = ((1 - result.a) / z).expand();
    result.e_p = (-result.b / z).expand();
    return result;
}

}  // namespace

Propagation propagation(const Quadrature& quadrature) {
    if (quadrature.is_explicit()) return propagation_of_composition(quadrature);
    const bool lobatto = quadrature.method.family == Family::lobatto;
    const int r = quadrature.method.points - (lobatto ? 1 : 0);  // degree of the path
    Propagation result;
    const ex z = result.z;
    const numeric end = lobatto ? numeric(1, r) : numeric(0);
    const Fraction A = fraction(r, r % 2 == 0 ? end : 0, z), T = fraction(r, r % 2 == 1 ? end : 0, z);
    // Consecutive denominators have no common factor, so neither have these.
    const ex stretch = (A.above * T.above).expand(), pull = (z / 4 * A.below * T.below).expand();
    const ex scale = stretch.subs(z == 0);  // delta(0) = 1
    result.delta = ((stretch + pull) / scale).expand();
    result.a = ((stretch - pull) / scale).expand();
    result.b = (-z * A.below * T.above / scale).expand();
    result.c = (A.above * T.below / scale).expand();
    // A constant force moves the centre to f/k.
    result.e_q = ((result.delta - result.a) / z).expand();
    result.e_p = (-result.b / z).expand();
    return result;
}

}  // namespace lobatto
