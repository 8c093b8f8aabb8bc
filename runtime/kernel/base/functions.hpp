// SPDX-License-Identifier: MIT
// Elementary functions of packs: every lane as if it were alone. C++17, no allocation.
//
// For double: one path without branches, polynomials in Estrin's order (a step waits for their latency), and the
// library for lanes beyond the path's range. float is computed in double and rounded. long double and __float128 are
// the library's. Accuracy and speed: docs/adr/0007-vector-functions.md, measured by bench/functions.cpp.
#ifndef LOBATTO_KERNEL_FUNCTIONS_HPP
#define LOBATTO_KERNEL_FUNCTIONS_HPP

#include "numbers.hpp"
#include "pack.hpp"

namespace lobatto {

namespace functions {

template <int width>
using Doubles = Pack<double, width>;
template <int width>
using Words = Bits<double, width>;
template <int width>
using Where = Mask<double, width>;

constexpr double integer_shift = 6755399441055744.0;     // 1.5 * 2^52: adding it rounds to an integer, in the last bits
constexpr double ln2_high = 6.93147180369123816490e-01;  // 33 bits: its products with exponents are exact
constexpr double ln2_low = 1.90821492927058770002e-10;
constexpr double reduced_below = 823549.0;  // 2^19 pi/2
constexpr std::int64_t sign_bit = std::numeric_limits<std::int64_t>::min();

// The magnitude of x with the sign of y.
template <int width>
LOBATTO_INLINE Doubles<width> with_sign_of(const Doubles<width>& y, const Doubles<width>& magnitude) {
    return from_bits(bits(magnitude) | (bits(y) & Words<width>(sign_bit)));
}

// `value` where the path without branches holds, the library's function of x (and y) elsewhere.
template <class Function>
[[gnu::noinline, gnu::cold]] void by_library(int width, const double* beyond, const double* x, const double* y,
                                             double* values, Function function) {
    for (int i = 0; i < width; ++i)
        if (beyond[i] != 0) values[i] = function(x[i], y[i]);
}
template <int width, class Function>
LOBATTO_INLINE Doubles<width> unless(const Where<width>& holds, const Doubles<width>& x, const Doubles<width>& y,
                                     const Doubles<width>& value, Function function) {
    if (__builtin_expect(all(holds), 1)) return value;
    double beyond[width], first[width], second[width], values[width];
    select(holds, 0.0, 1.0).store(beyond);
    x.store(first);
    y.store(second);
    value.store(values);
    by_library(width, beyond, first, second, values, function);
    return Doubles<width>::load(values);
}

// The minimax polynomials published with FDLIBM, of degree 13 and 14 on [-pi/4, pi/4], with z = r^2 and z2 = z^2:
//     sin r = r - z r sine_series,   cos r = 1 - z/2 + z2 cosine_series.
template <int width>
LOBATTO_INLINE Doubles<width> sine_series(const Doubles<width>& z, const Doubles<width>& z2) {
    using P = Doubles<width>;
    return fused(z2,
                 fused(z2, fused(z, P(-1.58969099521155010221e-10), P(2.50507602534068634195e-08)),
                       fused(z, P(-2.75573137070700676789e-06), P(1.98412698298579493134e-04))),
                 fused(z, P(-8.33333333332248946124e-03), P(1.66666666666666324348e-01)));
}
template <int width>
LOBATTO_INLINE Doubles<width> cosine_series(const Doubles<width>& z, const Doubles<width>& z2) {
    using P = Doubles<width>;
    return fused(z2,
                 fused(z2, fused(z, P(-1.13596475577881948265e-11), P(2.08757232129817482790e-09)),
                       fused(z, P(-2.75573143513906633035e-07), P(2.48015872894767294178e-05))),
                 fused(z, P(-1.38888888888741095749e-03), P(4.16666666666666019037e-02)));
}

// x = k pi/2 + r - excess with |r| <= pi/4, and the sine and cosine of r - excess; the last bits of `quadrant` are k's.
// For |x| < 2^19 pi/2.
//
// With pi/2 = a + b + c (53 bits each) x - k a is exact with FMA, and so is what rounding it to r loses. Without FMA
// the parts have 33, 33 and 53 bits, so that the first two products are exact. Then the polynomials; `excess` is ready
// before they are.
template <int width>
struct Reduced {
    Doubles<width> sine, cosine;
    Words<width> quadrant;

    LOBATTO_INLINE explicit Reduced(const Doubles<width>& x) {
        using P = Doubles<width>;
        const P shifted = fused(x, P(0.63661977236758134308), P(integer_shift));
        const P k = shifted - integer_shift;
        quadrant = bits(shifted);
        P r, excess;
        if constexpr (has_fused) {
            constexpr double a = 0x1.921fb54442d18p+0, b = 0x1.1a62633145c07p-54, c = -0x1.f1976b7ed8fbcp-110;
            const P first = fused(k, P(-a), x);
            r = fused(k, P(-b), first);
            const P d = r - first;
            excess = fused(k, P(c), fused(k, P(b), d) + (r - (first + d)));
        } else {
            const P first = x - k * 1.57079632673412561417e+00;
            const P t = k * 6.07710050630396597660e-11;
            r = first - t;
            const P back = first - r;
            excess = k * 2.02226624879595063154e-21 - ((back - t) + (first - (r + back)));
        }
        const P z = r * r;
        const P z2 = z * z;
        const P cube = z * r;
        const P rest = fused(z, P(-0.5), P(1.0));                   // nearly the cosine, and the slope of the sine
        sine = r - fused(cube, sine_series(z, z2), excess * rest);  // -0 for -0
        P slope = r;  // minus that of the cosine; without FMA `excess` may be ten units in the last place of r
        if constexpr (!has_fused) slope = r - cube * 1.66666666666666324348e-01;
        cosine = rest + fused(z2, cosine_series(z, z2), fused(excess, slope, fused(z, P(-0.5), 1.0 - rest)));
    }
};

// The bit that negates a sine of this quadrant.
template <int width>
LOBATTO_INLINE Words<width> sign_of(const Words<width>& quadrant) {
    return (quadrant << 62) & Words<width>(sign_bit);
}

template <int width>
LOBATTO_INLINE void sincos(const Doubles<width>& x, Doubles<width>& sine, Doubles<width>& cosine) {
    const Reduced<width> reduced(x);
    const Where<width> swap = is_odd(reduced.quadrant);
    const Doubles<width> s = select(swap, reduced.cosine, reduced.sine);
    const Doubles<width> c = select(swap, reduced.sine, reduced.cosine);
    const Where<width> holds = fabs(x) < reduced_below;
    sine = unless(holds, x, x, from_bits(bits(s) ^ sign_of(reduced.quadrant)),
                  [](double a, double) { return __builtin_sin(a); });
    cosine = unless(holds, x, x, from_bits(bits(c) ^ sign_of(reduced.quadrant + Words<width>(1))),
                    [](double a, double) { return __builtin_cos(a); });
}
// One alone has the bits it has in the pair.
template <int width>
LOBATTO_INLINE Doubles<width> sin(const Doubles<width>& x) {
    const Reduced<width> reduced(x);
    const Doubles<width> sine = select(is_odd(reduced.quadrant), reduced.cosine, reduced.sine);
    return unless(fabs(x) < reduced_below, x, x, from_bits(bits(sine) ^ sign_of(reduced.quadrant)),
                  [](double a, double) { return __builtin_sin(a); });
}
template <int width>
LOBATTO_INLINE Doubles<width> cos(const Doubles<width>& x) {
    const Reduced<width> reduced(x);
    const Doubles<width> cosine = select(is_odd(reduced.quadrant), reduced.sine, reduced.cosine);
    return unless(fabs(x) < reduced_below, x, x, from_bits(bits(cosine) ^ sign_of(reduced.quadrant + Words<width>(1))),
                  [](double a, double) { return __builtin_cos(a); });
}
template <int width>
LOBATTO_INLINE Doubles<width> tan(const Doubles<width>& x) {
    const Reduced<width> reduced(x);
    const Where<width> swap = is_odd(reduced.quadrant);
    const Doubles<width> quotient =
        select(swap, reduced.cosine, reduced.sine) / select(swap, reduced.sine, reduced.cosine);
    return unless(fabs(x) < reduced_below, x, x, from_bits(bits(quotient) ^ (reduced.quadrant << 63)),
                  [](double a, double) { return __builtin_tan(a); });
}

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
    return unless(is_normal_positive(x), x, x, value, [](double a, double) { return __builtin_log(a); });
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
    return unless(holds, x, y, e.value(0.0), [](double a, double b) { return __builtin_pow(a, b); });
}

// atan |x| = atan c + atan((|x| - c) / (1 + c |x|)), c = 0, 1/2, 1, 3/2 or infinity; polynomial and constants as
// published with FDLIBM.
template <int width>
LOBATTO_INLINE Doubles<width> atan(const Doubles<width>& x) {
    using P = Doubles<width>;
    const P y = fabs(x);
    P upper = y, lower = 1.0, high = 0.0, low = 0.0;
    const auto from = [&](double bound, const P& numerator, const P& denominator, double angle, double angle_low)
        __attribute__((always_inline)) {
        const Where<width> above = y >= bound;
        upper = select(above, numerator, upper);
        lower = select(above, denominator, lower);
        high = select(above, P(angle), high);
        low = select(above, P(angle_low), low);
    };
    from(0.4375, 2.0 * y - 1.0, 2.0 + y, 4.63647609000806093515e-01, 2.26987774529616870924e-17);
    from(0.6875, y - 1.0, y + 1.0, 7.85398163397448278999e-01, 3.06161699786838301793e-17);
    from(1.1875, y - 1.5, fused(y, P(1.5), P(1.0)), 9.82793723247329054082e-01, 1.39033110312309984516e-17);
    from(2.4375, P(-1.0), y, 1.57079632679489655800e+00, 6.12323399573676603587e-17);
    const P t = upper / lower;
    const P z = t * t;
    const P w = z * z;
    const P w2 = w * w;
    const P tail = fused(w2 * w2,
                         fused(w, P(1.62858201153657823623e-02),
                               fused(z, P(-3.65315727442169155270e-02), P(4.97687799461593236017e-02))),
                         fused(w2,
                               fused(w, fused(z, P(-5.83357013379057348645e-02), P(6.66107313738753120669e-02)),
                                     fused(z, P(-7.69187620504482999495e-02), P(9.09088713343650656196e-02))),
                               fused(w, fused(z, P(-1.11111104054623557880e-01), P(1.42857142725034663711e-01)),
                                     fused(z, P(-1.99999999998764832476e-01), P(3.33333333333329318027e-01)))));
    return with_sign_of(x, high - (fused(t * z, tail, -low) - t));
}

// asin x = x + x R(x^2) for |x| < 1/2, R as published with FDLIBM, else pi/2 - 2 asin sqrt((1 - |x|) / 2).
template <int width>
struct Arc {
    Where<width> large;         // |x| >= 1/2, where the following belong to
    Doubles<width> root;        // sqrt((1 - |x|) / 2), else |x|
    Doubles<width> head, rest;  // root = head + rest, head of 21 bits
    Doubles<width> R;

    LOBATTO_INLINE explicit Arc(const Doubles<width>& x) {
        using P = Doubles<width>;
        const P y = fabs(x);
        large = y >= 0.5;
        const P z = select(large, fused(y, P(-0.5), P(0.5)), y * y);
        root = select(large, sqrt(z), y);
        head = from_bits(bits(root) & Words<width>(-(std::int64_t(1) << 32)));
        rest = (z - head * head) / (root + head + std::numeric_limits<double>::min());
        const P z2 = z * z;
        const P numerator = fused(z2 * z2, fused(z, P(3.47933107596021167570e-05), P(7.91534994289814532176e-04)),
                                  fused(z2, fused(z, P(-4.00555345006794114027e-02), P(2.01212532134862925881e-01)),
                                        fused(z, P(-3.25565818622400915405e-01), P(1.66666666666666657415e-01))));
        const P denominator = fused(z2,
                                    fused(z2, P(7.70381505559019352791e-02),
                                          fused(z, P(-6.88283971605453293030e-01), P(2.02094576023350569471e+00))),
                                    fused(z, P(-2.40339491173441421878e+00), P(1.0)));
        R = z * (numerator / denominator);
    }
};
constexpr double half_pi = 1.57079632679489655800e+00, half_pi_low = 6.12323399573676603587e-17;

template <int width>
LOBATTO_INLINE Doubles<width> asin(const Doubles<width>& x) {
    using P = Doubles<width>;
    const Arc<width> arc(x);
    const P small = fused(arc.root, arc.R, arc.root);
    const P far = (half_pi_low - 2.0 * arc.rest) - 2.0 * (arc.root * arc.R);
    const P half = 0.5 * half_pi;  // pi/4 twice, so that the first difference is exact
    return with_sign_of(x, select(arc.large, half + ((half - 2.0 * arc.head) + far), small));
}
template <int width>
LOBATTO_INLINE Doubles<width> acos(const Doubles<width>& x) {
    using P = Doubles<width>;
    const Arc<width> arc(x);
    const P t = arc.root * arc.R;
    const P small = half_pi - (x - (half_pi_low - with_sign_of(x, t)));
    const P near_one = 2.0 * (arc.head + (arc.rest + t));
    const P near_minus_one = 2.0 * (half_pi - (arc.root + (t - half_pi_low)));
    return select(arc.large, select(x < 0.0, near_minus_one, near_one), small);
}

template <int width>
LOBATTO_INLINE Pack<double, width> widened(const Pack<float, width>& x) {
    float from[width];
    double to[width];
    x.store(from);
    for (int i = 0; i < width; ++i) to[i] = static_cast<double>(from[i]);
    return Pack<double, width>::load(to);
}
template <int width>
LOBATTO_INLINE Pack<float, width> narrowed(const Pack<double, width>& x) {
    double from[width];
    float to[width];
    x.store(from);
    for (int i = 0; i < width; ++i) to[i] = static_cast<float>(from[i]);
    asm("" : "+m"(to));  // g++ 12 leaves out this rounding of two lanes where a widening follows
    return Pack<float, width>::load(to);
}

// Register by register: the constants of a function fill too many registers for two at a time.
template <int width>
LOBATTO_INLINE Doubles<Doubles<width>::lanes> single(const Doubles<width>& x, int i) {
    return Doubles<Doubles<width>::lanes>::of(LOBATTO_EACH() { return x.part[i]; });
}

}  // namespace functions

#define LOBATTO_FUNCTION(name)                                                                         \
    template <class real, int width>                                                                   \
    LOBATTO_INLINE Pack<real, width> name(const Pack<real, width>& x) {                                \
        if constexpr (std::is_same_v<real, double>)                                                    \
            return x.of(LOBATTO_EACH(i) { return functions::name(functions::single(x, i)).part[0]; }); \
        else if constexpr (std::is_same_v<real, float>)                                                \
            return functions::narrowed(name(functions::widened(x)));                                   \
        else                                                                                           \
            return x.of(LOBATTO_EACH(i) { return lobatto::name(x.part[i]); });                         \
    }
LOBATTO_FUNCTION(sin)
LOBATTO_FUNCTION(cos)
LOBATTO_FUNCTION(tan)
LOBATTO_FUNCTION(exp)
LOBATTO_FUNCTION(log)
LOBATTO_FUNCTION(sinh)
LOBATTO_FUNCTION(cosh)
LOBATTO_FUNCTION(tanh)
LOBATTO_FUNCTION(asin)
LOBATTO_FUNCTION(acos)
LOBATTO_FUNCTION(atan)
#undef LOBATTO_FUNCTION

template <class real, int width>
LOBATTO_INLINE void sincos(const Pack<real, width>& x, Pack<real, width>& sine, Pack<real, width>& cosine) {
    if constexpr (std::is_same_v<real, double>) {
        sine = x.of(LOBATTO_EACH(i) {
            Pack<double, Pack<double, width>::lanes> one_sine, one_cosine;
            functions::sincos(functions::single(x, i), one_sine, one_cosine);
            cosine.part[i] = one_cosine.part[0];
            return one_sine.part[0];
        });
    } else if constexpr (std::is_same_v<real, float>) {
        Pack<double, width> wide_sine, wide_cosine;
        sincos(functions::widened(x), wide_sine, wide_cosine);
        sine = functions::narrowed(wide_sine);
        cosine = functions::narrowed(wide_cosine);
    } else {
        sine = sin(x);
        cosine = cos(x);
    }
}

template <class real, int width>
LOBATTO_INLINE Pack<real, width> pow(const Pack<real, width>& x, const Pack<real, width>& y) {
    if constexpr (std::is_same_v<real, double>)
        return x.of(
            LOBATTO_EACH(i) { return functions::pow(functions::single(x, i), functions::single(y, i)).part[0]; });
    else if constexpr (std::is_same_v<real, float>)
        return functions::narrowed(pow(functions::widened(x), functions::widened(y)));
    else
        return Pack<real, width>::of(LOBATTO_EACH(i) { return lobatto::pow(x.part[i], y.part[i]); });
}
template <class real, int width>
LOBATTO_INLINE Pack<real, width> pow(const Pack<real, width>& x, real_of<Pack<real, width>> y) {
    return pow(x, Pack<real, width>(y));
}
template <class real, int width>
LOBATTO_INLINE Pack<real, width> pow(real_of<Pack<real, width>> x, const Pack<real, width>& y) {
    return pow(Pack<real, width>(x), y);
}

// Sine and cosine of one double: a pack of one lane, so that a lone trajectory and a lane of many have the same bits.
template <class real>
inline Only<real, double> sin(real x) {
    return sin(Pack<double, 1>(x))[0];
}
template <class real>
inline Only<real, double> cos(real x) {
    return cos(Pack<double, 1>(x))[0];
}
inline void sincos(double x, double& sine, double& cosine) {
    Pack<double, 1> one_sine, one_cosine;
    sincos(Pack<double, 1>(x), one_sine, one_cosine);
    sine = one_sine[0];
    cosine = one_cosine[0];
}

}  // namespace lobatto

#endif
