// SPDX-License-Identifier: MIT
// Elementary functions of DoubleDouble, alone and in the lanes of Packs, to 31 digits (double_double_test.cpp
// measures).
//
// Series after a reduction of the argument, or one Newton step from the function of doubles. A function is called, not
// put in place: it is a few hundred operations long. Where a double's function is infinite or not a number, so is this.
#ifndef LOBATTO_KERNEL_DOUBLE_DOUBLE_FUNCTIONS_HPP
#define LOBATTO_KERNEL_DOUBLE_DOUBLE_FUNCTIONS_HPP

#include <cstdint>

#include "arc.hpp"
#include "double_double.hpp"
#include "exponential.hpp"
#include "numbers.hpp"
#include "pack.hpp"
#include "trigonometry.hpp"

// Functions that are long, so that they are called, and those that are seldom called. nvcc decides for itself.
#ifdef __CUDACC__
#define LOBATTO_CALLED LOBATTO_DEVICE inline
#define LOBATTO_RARE LOBATTO_DEVICE
#else
#define LOBATTO_CALLED [[gnu::noinline]] inline
#define LOBATTO_RARE [[gnu::noinline, gnu::cold]]
#endif

namespace lobatto {

namespace functions {

template <int width>
using DoubleDoublePack = Pack<DoubleDouble, width>;

// 1/k!
struct ReciprocalFactorials {
    DoubleDouble values[31]{};
    constexpr ReciprocalFactorials() {
        DoubleDouble factorial = 1;
        for (int k = 0; k < 31; ++k) {
            if (k > 0) factorial *= k;
            values[k] = 1 / factorial;
        }
    }
};

// x^first / first! + x^(first + by) / (first + by)! + ..., over x^first: `exact` terms to 106 bits, the others, which
// are below 2^-53 of the sum, to 53. `sign`: of each further term. z = x^by.
template <int first, int by, int exact, int others, int sign, int width>
LOBATTO_INLINE DoubleDoublePack<width> series(const DoubleDoublePack<width>& z) {
    using P = Doubles<width>;
    using X = DoubleDoublePack<width>;
    static constexpr ReciprocalFactorials table{};  // in here: a device has no address of one outside
    const auto& terms = table.values;
    const auto signed_part = [](int i, double x) { return sign < 0 && i % 2 == 1 ? -x : x; };
    const P approximate = high_part(z);
    P rest = P(0.0);
#pragma GCC unroll 8
    for (int i = exact + others - 1; i >= exact; --i)
        rest = fused(rest, approximate, P(signed_part(i, terms[first + by * i].high)));
    X sum = of_parts(rest, P(0.0));
#pragma GCC unroll 16
    for (int i = exact - 1; i >= 0; --i) {
        const DoubleDouble term = terms[first + by * i];
        sum = fused(sum, z, X(DoubleDouble(signed_part(i, term.high), signed_part(i, term.low))));
    }
    return sum;
}

// 2^k for whole k, -1022 <= k <= 1023.
template <int width>
LOBATTO_INLINE Doubles<width> power_of_two(const Doubles<width>& k) {
    return from_bits((bits(k + integer_shift) + Words<width>(1023)) << 52);
}
// x 2^k for whole k, |k| <= 2040.
template <int width>
LOBATTO_INLINE DoubleDoublePack<width> scaled(const DoubleDoublePack<width>& x, const Doubles<width>& k) {
    using P = Doubles<width>;
    const P half = fused(k, P(0.5), P(integer_shift)) - integer_shift;
    const P a = power_of_two(half), b = power_of_two(k - half);
    const P high = high_part(x) * a * b;
    const auto is_finite = fabs(high) <= std::numeric_limits<double>::max();
    return of_parts(high, select(is_finite, low_part(x) * a * b, P(0.0)));
}

// Where `holds`, a; elsewhere b without a rest: the function of doubles, where it is infinite or not a number.
template <int width>
LOBATTO_INLINE DoubleDoublePack<width> where(const Where<width>& holds, const DoubleDoublePack<width>& a,
                                             const Doubles<width>& b) {
    return of_parts(select(holds, high_part(a), b), select(holds, low_part(a), Doubles<width>(0.0)));
}
template <int width>
LOBATTO_INLINE Where<width> is_number(const Doubles<width>& x) {
    return fabs(x) <= std::numeric_limits<double>::max();
}

// ---------------------------------------------------------------------------------------------------------------------
// Exponentials
// ---------------------------------------------------------------------------------------------------------------------

// x = k ln 2 + r, |r| <= ln(2)/2 and a bit; e^r - 1 by its series at r/64, then (1 + s)^2 - 1 = s (2 + s) six times.
template <int width>
struct WideExponential {
    Doubles<width> k;
    DoubleDoublePack<width> less_one;  // e^r - 1

    LOBATTO_INLINE explicit WideExponential(const DoubleDoublePack<width>& x) {
        using P = Doubles<width>;
        using X = DoubleDoublePack<width>;
        // ln 2 in three parts: 42 bits, whose products with k are exact, then 53 and 53.
        constexpr double a = 0x1.62e42fefa38p-1, b = 0x1.ef35793c7673p-45, c = 0x1.f97b57a079a19p-103;
        const P high = high_part(x), inside = maximum(P(-1400.0), minimum(P(1400.0), high));  // keeps NaN
        const P low = select(inside == high, low_part(x), P(0.0));
        k = fused(inside, P(1.4426950408889634), P(integer_shift)) - integer_shift;
        X r = accurate_sum(exact_sum(inside - k * a, low), exact_product(k, P(-b)));
        r = accurate_sum(r, of_parts(k * -c, P(0.0)));
        r = 0x1p-6 * r;
        X s = fused(r * r, series<2, 1, 5, 6, 1>(r), r);
        for (int i = 0; i < 6; ++i) s = fused(s, s, 2.0 * s);
        less_one = s;
    }
};

}  // namespace functions

template <int width>
LOBATTO_CALLED Pack<DoubleDouble, width> exp(const Pack<DoubleDouble, width>& x) {
    const functions::WideExponential<width> e(x);
    return functions::scaled(accurate_sum(Pack<DoubleDouble, width>(1.0), e.less_one), e.k);
}

namespace functions {

// e^x - 1, for |x| < 700.
template <int width>
LOBATTO_CALLED DoubleDoublePack<width> exponential_less_one(const DoubleDoublePack<width>& x) {
    using P = Doubles<width>;
    const WideExponential<width> e(x);
    const P scale = power_of_two(e.k);
    return accurate_sum(exact_sum(scale, P(-1.0)),
                        of_parts(high_part(e.less_one) * scale, low_part(e.less_one) * scale));
}

// log x for x between the smallest normal number and the largest: y0 + log(1 + t), t = x e^-y0 - 1, y0 that of doubles.
template <int width>
LOBATTO_CALLED DoubleDoublePack<width> log_of_positive(const DoubleDoublePack<width>& x) {
    using P = Doubles<width>;
    using X = DoubleDoublePack<width>;
    const P y0 = lobatto::log(high_part(x));
    const WideExponential<width> e(of_parts(-y0, P(0.0)));
    // Near x = 1 without the loss of digits that 1 + (e^-y0 - 1) would bring.
    const X near = accurate_sum(accurate_sum(x, X(-1.0)), x * e.less_one);
    const X far = accurate_sum(scaled(x, e.k) * accurate_sum(X(1.0), e.less_one), X(-1.0));
    const auto is_near = e.k == 0.0;
    const X t =
        of_parts(select(is_near, high_part(near), high_part(far)), select(is_near, low_part(near), low_part(far)));
    const P first = high_part(t);
    return accurate_sum(accurate_sum(of_parts(y0, P(0.0)), t), of_parts(first * (-0.5 * first), P(0.0)));
}

}  // namespace functions

template <int width>
LOBATTO_CALLED Pack<DoubleDouble, width> log(const Pack<DoubleDouble, width>& x) {
    const auto high = high_part(x);
    return functions::where(functions::is_normal_positive(high), functions::log_of_positive(x), lobatto::log(high));
}

// sinh y = (E + E / (E + 1)) / 2, E = e^y - 1; cosh y = (e^y + e^-y) / 2; tanh y = E / (E + 2), E = e^(2y) - 1.
template <int width>
LOBATTO_CALLED Pack<DoubleDouble, width> sinh(const Pack<DoubleDouble, width>& x) {
    using X = Pack<DoubleDouble, width>;
    const X y = fabs(x);
    const X E = functions::exponential_less_one(minimum(y, X(600.0)));
    const X small = 0.5 * (E + E / (E + 1.0));
    const functions::WideExponential<width> e(y);
    const X large = functions::scaled(e.less_one + 1.0, e.k - 1.0);
    const X value = select(y < 100.0, small, large);
    const auto high = high_part(x);
    return functions::where(functions::is_number(high), select(x < 0.0, -value, value), high);
}
template <int width>
LOBATTO_CALLED Pack<DoubleDouble, width> cosh(const Pack<DoubleDouble, width>& x) {
    using X = Pack<DoubleDouble, width>;
    const functions::WideExponential<width> e(fabs(x));
    const X half = functions::scaled(e.less_one + 1.0, e.k - 1.0);
    const X value = select(half < 1e20, half + 0.25 / minimum(half, X(1e20)), half);
    return functions::where(functions::is_number(high_part(half)), value, high_part(half));
}
template <int width>
LOBATTO_CALLED Pack<DoubleDouble, width> tanh(const Pack<DoubleDouble, width>& x) {
    using X = Pack<DoubleDouble, width>;
    const X y = fabs(x);
    const X E = functions::exponential_less_one(2.0 * minimum(y, X(40.0)));
    const X value = E / (E + 2.0);
    const auto high = high_part(x);
    return functions::where(high == high, select(x < 0.0, -value, value), high);
}

namespace functions {

// x^y for normal positive x: with x = 2^k m, k y = n + f, n whole: 2^n e^(f ln 2 + y log m). Errs by some
// (3 + |y| / 2) u^2.
template <int width>
LOBATTO_CALLED DoubleDoublePack<width> power_of_positive(const DoubleDoublePack<width>& x,
                                                         const DoubleDoublePack<width>& y) {
    using P = Doubles<width>;
    using X = DoubleDoublePack<width>;
    constexpr DoubleDouble ln2(0x1.62e42fefa39efp-1, 0x1.abc9e3b39803fp-56);
    const Split<width> split(high_part(x));
    const X m = scaled(x, -split.k);
    const X whole = exact_product(high_part(y), split.k);
    const P n = (high_part(whole) + integer_shift) - integer_shift;
    const X f = accurate_sum(exact_sum(high_part(whole) - n, low_part(whole)), exact_product(low_part(y), split.k));
    const WideExponential<width> e(fused(f, X(ln2), y * log_of_positive(m)));
    const P exponent = maximum(P(-2000.0), minimum(P(2000.0), e.k + n));
    return scaled(accurate_sum(X(1.0), e.less_one), exponent);
}

// One lane where the path above does not hold.
LOBATTO_RARE inline DoubleDouble power_beyond(const DoubleDouble& x, const DoubleDouble& y) {
    const double value = LOBATTO_LIBRARY(pow)(x.high, y.high);
    const bool is_whole = LOBATTO_LIBRARY(rint)(y.high) == y.high && LOBATTO_LIBRARY(rint)(y.low) == y.low;
    if (!(x.high < 0) || !is_whole || !(value - value == 0)) return {value, 0.0};
    const DoubleDouble magnitude = power_of_positive(Pack<DoubleDouble, 1>(-x), Pack<DoubleDouble, 1>(y))[0];
    return value < 0 ? -magnitude : magnitude;
}

}  // namespace functions

template <int width>
LOBATTO_CALLED Pack<DoubleDouble, width> pow(const Pack<DoubleDouble, width>& x, const Pack<DoubleDouble, width>& y) {
    const auto high = high_part(x);
    const auto holds = functions::is_normal_positive(high) & (fabs(high_part(y)) < 1e6);
    Pack<DoubleDouble, width> value = functions::power_of_positive(x, y);
    if (__builtin_expect(all(holds), 1)) return value;
    for (int lane = 0; lane < width; ++lane)
        if (!holds[lane]) value.set(lane, functions::power_beyond(x[lane], y[lane]));
    return value;
}
template <int width>
LOBATTO_INLINE Pack<DoubleDouble, width> pow(const Pack<DoubleDouble, width>& x, const DoubleDouble& y) {
    return pow(x, Pack<DoubleDouble, width>(y));
}
template <int width>
LOBATTO_INLINE Pack<DoubleDouble, width> pow(const DoubleDouble& x, const Pack<DoubleDouble, width>& y) {
    return pow(Pack<DoubleDouble, width>(x), y);
}

// ---------------------------------------------------------------------------------------------------------------------
// Sine, cosine, tangent
// ---------------------------------------------------------------------------------------------------------------------

namespace functions {

constexpr double wide_reduced_below = 0x1p40;
LOBATTO_INLINE constexpr DoubleDouble wide_half_pi() {
    return {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
}

// 2/pi in words of 64 bits, 1408 in all.
struct TwoOverPi {
    std::uint64_t word[22] = {0xa2f9836e4e441529, 0xfc2757d1f534ddc0, 0xdb6295993c439041, 0xfe5163abdebbc561,
                              0xb7246e3a424dd2e0, 0x06492eea09d1921c, 0xfe1deb1cb129a73e, 0xe88235f52ebb4484,
                              0xe99c7026b45f7e41, 0x3991d639835339f4, 0x9c845f8bbdf9283b, 0x1ff897ffde05980f,
                              0xef2f118b5a0a6d1f, 0x6d367ecf27cb09b7, 0x4f463f669e5fea2d, 0x7527bac7ebe5f17b,
                              0x3d0739f78a5292ea, 0x6bfb5fb11f8d5d08, 0x56033046fc7b6bab, 0xf0cfbc209af4361d,
                              0xa9e391615ee61b08, 0x6599855f14a06840};
};

// turns += x 2/pi modulo 4, in units of 2^-256: five words, the last one of whole quarters (M. Payne and R. Hanek
// 1983).
LOBATTO_RARE inline void add_quarters(double x, std::uint64_t* turns) {
    constexpr TwoOverPi two_over_pi{};
    int exponent = 0;
    const double fraction = LOBATTO_LIBRARY(frexp)(LOBATTO_LIBRARY(fabs)(x), &exponent);
    const auto m = static_cast<std::uint64_t>(fraction * 0x1p53);
    exponent -= 53;  // |x| = m 2^exponent
    // Word i of 2/pi 2^exponent modulo 2^64, in units of 2^-256; bit 0 of word 0 is bit 256 + exponent of 2/pi.
    const auto word_at = [&](int bit) {  // 64 bits of 2/pi, the last of them number `bit` after the point
        std::uint64_t word = 0;
        const int first = bit - 64;  // bits first + 1 ... bit
        for (int part = 0; part < 2; ++part) {
            const int index = (first >= 0 ? first / 64 : -((63 - first) / 64)) + part,
                      shift = first - (index - part) * 64;
            const std::uint64_t value = index >= 0 && index < 22 ? two_over_pi.word[index] : 0;
            word |= part == 0 ? value << shift : shift > 0 ? value >> (64 - shift) : 0;
        }
        return word;
    };
    __extension__ typedef unsigned __int128 Wide;
    Wide carry = 0, difference = 0;
    for (int i = 0; i < 5; ++i) {
        carry += static_cast<Wide>(m) * word_at(256 + exponent - 64 * i);
        const auto word = static_cast<std::uint64_t>(carry);
        carry >>= 64;
        const Wide sum =
            x < 0 ? static_cast<Wide>(turns[i]) - word - difference : static_cast<Wide>(turns[i]) + word + difference;
        turns[i] = static_cast<std::uint64_t>(sum);
        difference = (sum >> 64) & 1;
    }
}

// One lane beyond the range of the quick reduction: x = quadrant pi/2 + r.
LOBATTO_RARE inline DoubleDouble reduced_far(const DoubleDouble& x, std::int64_t& quadrant) {
    std::uint64_t turns[5] = {};
    add_quarters(x.high, turns);
    if (x.low != 0) add_quarters(x.low, turns);
    quadrant = static_cast<std::int64_t>(turns[4]);
    const bool beyond_half = turns[3] >> 63 != 0;
    if (beyond_half) ++quadrant;
    // From the last word on, so that the sum loses nothing of what is small; words by halves, which are doubles.
    DoubleDouble fraction = 0;
    const auto add_half = [&](double half, double unit) {
        fraction = two_fold::accurate_sum(fraction, DoubleDouble(half * unit));
    };
    double unit = 0x1p-256;
    for (int i = 0; i < 3; ++i, unit *= 0x1p64) {
        add_half(static_cast<double>(turns[i] & 0xffffffffu), unit);
        add_half(static_cast<double>(turns[i] >> 32), unit * 0x1p32);
    }
    // The first word, less one where it is beyond a half.
    const double low = static_cast<double>(turns[3] & 0xffffffffu), high = static_cast<double>(turns[3] >> 32);
    const DoubleDouble part = two_fold::accurate_sum(DoubleDouble((beyond_half ? high - 0x1p32 : high) * 0x1p-32),
                                                     DoubleDouble(low * 0x1p-64));
    return wide_half_pi() * two_fold::accurate_sum(part, fraction);
}

// x = k pi/2 + r, |r| <= pi/4 and a bit; sine and cosine of r by their series.
template <int width>
struct WideReduced {
    DoubleDoublePack<width> sine, cosine;
    Words<width> quadrant;

    LOBATTO_INLINE explicit WideReduced(const DoubleDoublePack<width>& x) {
        using P = Doubles<width>;
        using X = DoubleDoublePack<width>;
        constexpr double a = 0x1.921fb54442d18p+0, b = 0x1.1a62633145c07p-54, c = -0x1.f1976b7ed8fbcp-110,
                         d = 0x1.4cf98e804177dp-164;
        const P high = high_part(x), low = low_part(x);
        const P shifted = fused(high, P(0.63661977236758134308), P(integer_shift));
        const P k = shifted - integer_shift;
        quadrant = bits(shifted);
        // high - k a is exact; then what follows from the largest to the smallest, with all that rounding loses.
        const X first = exact_product(k, P(-a)), second = exact_product(k, P(-b)), third = exact_product(k, P(-c));
        const X with_low = exact_sum(high + high_part(first), low);
        const X with_rest = exact_sum(high_part(with_low), low_part(first));
        const X with_second = exact_sum(high_part(with_rest), high_part(second));
        X rest = accurate_sum(exact_sum(low_part(with_second), low_part(second)), third);
        rest = accurate_sum(rest, exact_sum(low_part(with_low), low_part(with_rest)));
        rest = accurate_sum(rest, of_parts(k * -d, P(0.0)));
        X r = accurate_sum(of_parts(high_part(with_second), P(0.0)), rest);
        const auto holds = fabs(high) < wide_reduced_below;
        if (__builtin_expect(!all(holds), 0)) leave(x, r);
        const X z = r * r;
        sine = fused(r * z, -series<3, 2, 8, 5, -1>(z), r);
        cosine = fused(z * z, series<4, 2, 8, 5, -1>(z), fused(X(-0.5), z, X(1.0)));
    }

private:
    LOBATTO_RARE void leave(const DoubleDoublePack<width>& x, DoubleDoublePack<width>& r) {
        double shifted[width];
        from_bits(quadrant).store(shifted);
        for (int lane = 0; lane < width; ++lane) {
            const DoubleDouble here = x[lane];
            if (LOBATTO_LIBRARY(fabs)(here.high) < wide_reduced_below) continue;
            if (!(here.high - here.high == 0)) {
                r.set(lane, DoubleDouble(here.high - here.high, 0.0));
                continue;
            }
            std::int64_t number = 0;
            r.set(lane, reduced_far(here, number));
            shifted[lane] = integer_shift + static_cast<double>(number & 3);
        }
        quadrant = bits(Doubles<width>::load(shifted));
    }
};

// Negated where the bit of the quadrant is set.
template <int width>
LOBATTO_INLINE DoubleDoublePack<width> with_sign(const Words<width>& sign, const DoubleDoublePack<width>& x) {
    return of_parts(from_bits(bits(high_part(x)) ^ sign), from_bits(bits(low_part(x)) ^ sign));
}
template <int width>
LOBATTO_INLINE DoubleDoublePack<width> chosen(const Where<width>& where, const DoubleDoublePack<width>& a,
                                              const DoubleDoublePack<width>& b) {
    return of_parts(select(where, high_part(a), high_part(b)), select(where, low_part(a), low_part(b)));
}

}  // namespace functions

template <int width>
LOBATTO_CALLED void sincos(const Pack<DoubleDouble, width>& x, Pack<DoubleDouble, width>& sine,
                           Pack<DoubleDouble, width>& cosine) {
    const functions::WideReduced<width> r(x);
    const auto swap = is_odd(r.quadrant);
    sine = functions::with_sign(functions::sign_of(r.quadrant), functions::chosen(swap, r.cosine, r.sine));
    cosine = functions::with_sign(functions::sign_of(r.quadrant + functions::Words<width>(1)),
                                  functions::chosen(swap, r.sine, r.cosine));
}
template <int width>
LOBATTO_INLINE Pack<DoubleDouble, width> sin(const Pack<DoubleDouble, width>& x) {
    Pack<DoubleDouble, width> sine, cosine;
    sincos(x, sine, cosine);
    return sine;
}
template <int width>
LOBATTO_INLINE Pack<DoubleDouble, width> cos(const Pack<DoubleDouble, width>& x) {
    Pack<DoubleDouble, width> sine, cosine;
    sincos(x, sine, cosine);
    return cosine;
}
template <int width>
LOBATTO_INLINE Pack<DoubleDouble, width> tan(const Pack<DoubleDouble, width>& x) {
    Pack<DoubleDouble, width> sine, cosine;
    sincos(x, sine, cosine);
    return sine / cosine;
}

// ---------------------------------------------------------------------------------------------------------------------
// Their inverses: with y0 the function of doubles and d = y - y0, sin d from the addition theorem
// ---------------------------------------------------------------------------------------------------------------------

namespace functions {

// y0 + asin(s), |s| < 1e-7.
template <int width>
LOBATTO_INLINE DoubleDoublePack<width> turned(const Doubles<width>& y0, const DoubleDoublePack<width>& s) {
    using P = Doubles<width>;
    const P first = high_part(s);
    return accurate_sum(of_parts(y0, P(0.0)), accurate_sum(s, of_parts(first * (first * first * (1.0 / 6)), P(0.0))));
}
// sqrt((1 - x) (1 + x)), |x| <= 1.
template <int width>
LOBATTO_INLINE DoubleDoublePack<width> complement(const DoubleDoublePack<width>& x) {
    using X = DoubleDoublePack<width>;
    return sqrt(accurate_sum(X(1.0), -x) * accurate_sum(X(1.0), x));
}
// The angle near y0 of this sine and cosine.
template <int width>
LOBATTO_INLINE DoubleDoublePack<width> inverse(const Doubles<width>& y0, const DoubleDoublePack<width>& sine,
                                               const DoubleDoublePack<width>& cosine) {
    DoubleDoublePack<width> sine0, cosine0;
    sincos(of_parts(y0, Doubles<width>(0.0)), sine0, cosine0);
    return where(y0 == y0, turned(y0, accurate_sum(sine * cosine0, -(cosine * sine0))), y0);
}

}  // namespace functions

template <int width>
LOBATTO_CALLED Pack<DoubleDouble, width> asin(const Pack<DoubleDouble, width>& x) {
    return functions::inverse(lobatto::asin(high_part(x)), x, functions::complement(x));
}
template <int width>
LOBATTO_CALLED Pack<DoubleDouble, width> acos(const Pack<DoubleDouble, width>& x) {
    return functions::inverse(lobatto::acos(high_part(x)), functions::complement(x), x);
}
// Of 1/x where |x| > 1.
template <int width>
LOBATTO_CALLED Pack<DoubleDouble, width> atan(const Pack<DoubleDouble, width>& x) {
    using X = Pack<DoubleDouble, width>;
    const auto high = high_part(x);
    const auto far = fabs(high) > 1.0, is_finite = functions::is_number(high);
    const X inverse = functions::where(is_finite, 1.0 / x, functions::Doubles<width>(0.0));
    const X t = functions::chosen(far, inverse, x);
    const auto y0 = lobatto::atan(high_part(t));
    X sine, cosine;
    sincos(of_parts(y0, functions::Doubles<width>(0.0)), sine, cosine);
    const X d = accurate_sum(t * cosine, -sine) / fused(t, sine, cosine);
    const X near = functions::turned(y0, d);
    const X quarter = select(x < 0.0, X(-functions::wide_half_pi()), X(functions::wide_half_pi()));
    const X value = functions::chosen(far, accurate_sum(quarter, -near), near);
    return functions::where(high == high, value, high);
}

// As that of doubles.
template <int width>
LOBATTO_CALLED Pack<DoubleDouble, width> atan2(const Pack<DoubleDouble, width>& y, const Pack<DoubleDouble, width>& x) {
    using X = Pack<DoubleDouble, width>;
    const X up = fabs(y), along = fabs(x);
    const auto steep = up > along, behind = x < 0.0;
    const X near = atan(select(steep, along, up) / select(steep, up, along));
    const X half = X(functions::wide_half_pi()), none = X(0.0);
    const X axis = select(steep, half, select(behind, half + half, none));
    const X turned = select(steep, select(behind, near, -near), select(behind, -near, near));
    const X angle = accurate_sum(axis, turned);
    return select(y < 0.0, -angle, angle);
}

// Of one number: a pack of one lane, so that a lone trajectory and a lane of many have the same bits.
#define LOBATTO_OF_ONE(f)                                  \
    LOBATTO_INLINE DoubleDouble f(const DoubleDouble& x) { \
        return f(Pack<DoubleDouble, 1>(x))[0];             \
    }
LOBATTO_OF_ONE(acos)
LOBATTO_OF_ONE(asin)
LOBATTO_OF_ONE(atan)
LOBATTO_OF_ONE(cos)
LOBATTO_OF_ONE(cosh)
LOBATTO_OF_ONE(exp)
LOBATTO_OF_ONE(log)
LOBATTO_OF_ONE(sin)
LOBATTO_OF_ONE(sinh)
LOBATTO_OF_ONE(tan)
LOBATTO_OF_ONE(tanh)
#undef LOBATTO_OF_ONE
LOBATTO_INLINE DoubleDouble pow(const DoubleDouble& x, const DoubleDouble& y) {
    return pow(Pack<DoubleDouble, 1>(x), Pack<DoubleDouble, 1>(y))[0];
}
LOBATTO_INLINE DoubleDouble atan2(const DoubleDouble& y, const DoubleDouble& x) {
    return atan2(Pack<DoubleDouble, 1>(y), Pack<DoubleDouble, 1>(x))[0];
}
LOBATTO_INLINE void sincos(const DoubleDouble& x, DoubleDouble& sine, DoubleDouble& cosine) {
    Pack<DoubleDouble, 1> one_sine, one_cosine;
    sincos(Pack<DoubleDouble, 1>(x), one_sine, one_cosine);
    sine = one_sine[0];
    cosine = one_cosine[0];
}

}  // namespace lobatto

#undef LOBATTO_CALLED
#undef LOBATTO_RARE

#endif
