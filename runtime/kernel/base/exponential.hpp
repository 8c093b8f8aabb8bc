// SPDX-License-Identifier: MIT
// Exponential, logarithm, powers and hyperbolic functions of packs.
#ifndef LOBATTO_KERNEL_EXPONENTIAL_HPP
#define LOBATTO_KERNEL_EXPONENTIAL_HPP

#include "functions.hpp"
#include "numbers.hpp"
#include "pack.hpp"

namespace lobatto {

namespace functions {

constexpr double ln2_high = 6.93147180369123816490e-01;  // 33 bits: its products with exponents are exact
constexpr double ln2_low = 1.90821492927058770002e-10;

// x + low = k ln 2 + r with |r| <= ln(2)/2, and e^(x + low) = 2^k (1 + r + tail). The polynomial interpolates (e^r - 1
// - r - r^2/2) / r^3 at ten Chebyshev points of the interval: within 7e-19 of e^r.
template <int width>
struct Exponential {
    Doubles<width> k, r, tail;

    LOBATTO_INLINE explicit Exponential(const Doubles<width>& x, const Doubles<width>& low = 0.0) {
        using P = Doubles<width>;
        k = fused(x, P(1.4426950408889634), P(integer_shift)) - integer_shift;
        const P first = fused(k, P(-ln2_high), x);  // exact
        const P second = fused(k, P(-ln2_low), low);
        r = first + second;
        const P lost = (first - r) + second;
        const P z = r * r;
        const P z2 = z * z;
        const P start = fused(z, fused(r, P(0.0083333333333300615), P(0.041666666666666664)),
                              fused(r, P(0.16666666666666669), P(0.5)));
        const P middle = fused(z, fused(r, P(2.7557268459997064e-06), P(2.4801587317144498e-05)),
                               fused(r, P(0.00019841269863053618), P(0.0013888888888886552)));
        const P end =
            fused(z, P(2.0911236630261545e-09), fused(r, P(2.510038549551032e-08), P(2.7557282969549951e-07)));
        tail = fused(z, fused(z2 * z2, end, fused(z2, middle, start)), lost);
    }
    // 2^(k + more) (1 + r + tail), |k + more| <= 2100, by two factors.
    LOBATTO_INLINE Doubles<width> value(double more) const {
        using P = Doubles<width>;
        using W = Words<width>;
        const P whole = k + more;
        const P shifted = fused(whole, P(0.5), P(integer_shift));
        const P rest = (whole - (shifted - integer_shift)) + integer_shift;
        const P factor = from_bits((bits(shifted) + W(1023)) << 52);
        return fused(factor, r + tail, factor) * from_bits((bits(rest) + W(1023)) << 52);
    }
};

template <int width>
LOBATTO_INLINE Doubles<width> exp(const Doubles<width>& x) {
    using P = Doubles<width>;
    const P inside = maximum(P(-746.0), minimum(P(710.0), x));  // keeps NaN
    const Exponential<width> e(inside);
    return e.value(0.0);
}

// e^x - 1 for |x| < 700.
template <int width>
LOBATTO_INLINE Doubles<width> less_one(const Exponential<width>& e) {
    using P = Doubles<width>;
    const P scale = from_bits((bits(e.k + integer_shift) + Words<width>(1023)) << 52);
    const P whole = scale - 1.0;
    const P part = scale * e.r;
    const P high = whole + part;
    return high + fused(scale, e.tail, (whole - high) + part);
}

template <int width>
LOBATTO_INLINE Doubles<width> cosh(const Doubles<width>& x) {
    using P = Doubles<width>;
    const Exponential<width> e(minimum(P(712.0), fabs(x)));
    const P half = e.value(-1.0);  // e^|x| / 2
    return half + 0.25 / half;
}
template <int width>
LOBATTO_INLINE Doubles<width> sinh(const Doubles<width>& x) {
    using P = Doubles<width>;
    const Exponential<width> e(minimum(P(712.0), fabs(x)));
    const P half = e.value(-1.0);
    const P E = less_one(e);
    const P value = select(e.k < 32.0, 0.5 * (E + E / (E + 1.0)), half);
    return with_sign_of(x, value);
}
// tanh y = E / (E + 2) = 1 - 2 / (E + 2), E = e^(2y) - 1.
template <int width>
LOBATTO_INLINE Doubles<width> tanh(const Doubles<width>& x) {
    using P = Doubles<width>;
    const P y = minimum(P(32.0), fabs(x));
    const P E = less_one(Exponential<width>(2.0 * y));
    const Where<width> large = y > 0.75;
    const P quotient = select(large, P(-2.0), E) / (E + 2.0);
    return with_sign_of(x, select(large, 1.0 + quotient, quotient));
}

// x = 2^k m, sqrt(1/2) <= m < sqrt(2), for normal positive x.
template <int width>
struct Split {
    Doubles<width> k, m;

    LOBATTO_INLINE explicit Split(const Doubles<width>& x) {
        using W = Words<width>;
        constexpr std::int64_t root_half = 0x3fe6a09e667f3bcd, one = 0x3ff0000000000000;
        const W biased = (bits(x) + W(one - root_half)) >> 52;  // k + 1023
        m = from_bits((bits(x) - (biased << 52)) + W(one));
        k = from_bits(biased | W(0x4330000000000000)) - (4503599627370496.0 + 1023.0);  // 2^52 + its last bits
    }
};

// Where log and pow take the path without branches: normal positive numbers.
template <int width>
LOBATTO_INLINE Where<width> is_normal_positive(const Doubles<width>& x) {
    return (x >= std::numeric_limits<double>::min()) & (x <= std::numeric_limits<double>::max());
}

// log(1 + f) = f - f^2/2 + s (f^2/2 + R(s^2)), s = f / (2 + f); R as published with FDLIBM.
template <int width>
LOBATTO_INLINE Doubles<width> log(const Doubles<width>& x) {
    using P = Doubles<width>;
    const Split<width> split(x);
    const P f = split.m - 1.0;
    const P s = f / (2.0 + f);
    const P half = (0.5 * f) * f;
    const P z = s * s;
    const P z2 = z * z;
    const P R = z * fused(z2,
                          fused(z2,
                                fused(z2, P(1.479819860511658591e-01),
                                      fused(z, P(1.531383769920937332e-01), P(1.818357216161805012e-01))),
                                fused(z, P(2.222219843214978396e-01), P(2.857142874366239149e-01))),
                          fused(z, P(3.999999999940941908e-01), P(6.666666666666735130e-01)));
    const P value = fused(split.k, P(ln2_high), f - (half - fused(s, half + R, split.k * ln2_low)));
    return unless(is_normal_positive(x), x, x, value, [](double a, double) { return LOBATTO_LIBRARY(log)(a); });
}

// high + low = a b.
template <int width>
LOBATTO_INLINE void product(const Doubles<width>& a, const Doubles<width>& b, Doubles<width>& high,
                            Doubles<width>& low) {
    high = a * b;
    if constexpr (has_fused) {
        low = fused(a, b, -high);
    } else {  // Dekker's, by halves of 26 bits
        constexpr double cut = 134217729.0;
        const Doubles<width> a_cut = a * cut, b_cut = b * cut;
        const Doubles<width> a1 = a_cut - (a_cut - a), b1 = b_cut - (b_cut - b);
        const Doubles<width> a2 = a - a1, b2 = b - b1;
        low = ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2;
    }
}

// e^(y log x) with log x as a sum of two numbers, within 2^-64 of it: log m = 2 (s + s^3/3 + s^5 q(s^2)), s = (m - 1) /
// (m + 1); q interpolates at eight Chebyshev points. Signs, zeros and infinities are the library's.
template <int width>
LOBATTO_INLINE Doubles<width> pow(const Doubles<width>& x, const Doubles<width>& y) {
    using P = Doubles<width>;
    const Split<width> split(x);
    const P f = split.m - 1.0;
    const P d = split.m + 1.0;
    const P d_low = split.m - (d - 1.0);
    const P s = f / d;
    P back, back_low;
    product(s, d, back, back_low);
    const P s_low = (((f - back) - back_low) - s * d_low) / d;
    P z, z_low, cube, cube_low, third, third_low;
    product(s, s, z, z_low);
    z_low = fused(s + s, s_low, z_low);
    product(s, z, cube, cube_low);
    cube_low = cube_low + fused(s, z_low, s_low * z);
    constexpr double two_thirds = 0x1.5555555555555p-1, two_thirds_low = 0x1.5555555555555p-55;
    product(cube, P(two_thirds), third, third_low);
    third_low = third_low + fused(cube, P(two_thirds_low), cube_low * two_thirds);
    const P z2 = z * z;
    const P q = fused(z2 * z2,
                      fused(z2, fused(z, P(0.11723603624164688), P(0.11706195689742356)),
                            fused(z, P(0.13334806212106742), P(0.15384594934597778))),
                      fused(z2, fused(z, P(0.18181818335654162), P(0.22222222221654733)),
                            fused(z, P(0.28571428571429369), P(0.40000000000000002))));
    const P fifth = (cube * z) * q;
    // Sums whose first term is the larger one, or zero.
    const P first = split.k * ln2_high, twice = s + s;  // exact
    const P high = first + twice;
    const P sum = high + third;
    const P low = (((first - high) + twice) + ((high - sum) + third)) +
                  (fused(split.k, P(ln2_low), s_low + s_low) + (third_low + fifth));
    const P log_high = sum + low;
    const P log_low = (sum - log_high) + low;
    P exponent, exponent_low;
    product(y, log_high, exponent, exponent_low);
    exponent_low = fused(y, log_low, exponent_low);
    const Where<width> holds = is_normal_positive(x) & (fabs(y) < 0x1p+64) & (fabs(exponent) < 745.0);
    const Exponential<width> e(exponent, exponent_low);
    return unless(holds, x, y, e.value(0.0), [](double a, double b) { return LOBATTO_LIBRARY(pow)(a, b); });
}

}  // namespace functions

LOBATTO_FUNCTION(exp)
LOBATTO_FUNCTION(log)
LOBATTO_FUNCTION(sinh)
LOBATTO_FUNCTION(cosh)
LOBATTO_FUNCTION(tanh)

template <class real, int width>
LOBATTO_INLINE Pack<real, width> pow(const Pack<real, width>& x, const Pack<real, width>& y) {
    using Numbers = Pack<real, width>;
    constexpr int count = Numbers::count;
    if constexpr (std::is_same_v<real, double>) {
        LOBATTO_PARTS(Numbers, functions::pow(functions::single(x, i), functions::single(y, i)).part[0]);
    } else if constexpr (std::is_same_v<real, float>) {
        return functions::narrowed(pow(functions::widened(x), functions::widened(y)));
    } else {
        LOBATTO_PARTS(Numbers, lobatto::pow(x.part[i], y.part[i]));
    }
}
template <class real, int width>
LOBATTO_INLINE Pack<real, width> pow(const Pack<real, width>& x, real_of<Pack<real, width>> y) {
    return pow(x, Pack<real, width>(y));
}
template <class real, int width>
LOBATTO_INLINE Pack<real, width> pow(real_of<Pack<real, width>> x, const Pack<real, width>& y) {
    return pow(Pack<real, width>(x), y);
}

}  // namespace lobatto

#endif
