// SPDX-License-Identifier: MIT
// Sine, cosine and tangent of packs, and sine and cosine together.
#ifndef LOBATTO_KERNEL_TRIGONOMETRY_HPP
#define LOBATTO_KERNEL_TRIGONOMETRY_HPP

#include "functions.hpp"
#include "numbers.hpp"
#include "pack.hpp"

namespace lobatto {

namespace functions {

constexpr double reduced_below = 823549.0;  // 2^19 pi/2

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
                  [](double a, double) { return LOBATTO_LIBRARY(sin)(a); });
    cosine = unless(holds, x, x, from_bits(bits(c) ^ sign_of(reduced.quadrant + Words<width>(1))),
                    [](double a, double) { return LOBATTO_LIBRARY(cos)(a); });
}
// One alone has the bits it has in the pair.
template <int width>
LOBATTO_INLINE Doubles<width> sin(const Doubles<width>& x) {
    const Reduced<width> reduced(x);
    const Doubles<width> sine = select(is_odd(reduced.quadrant), reduced.cosine, reduced.sine);
    return unless(fabs(x) < reduced_below, x, x, from_bits(bits(sine) ^ sign_of(reduced.quadrant)),
                  [](double a, double) { return LOBATTO_LIBRARY(sin)(a); });
}
template <int width>
LOBATTO_INLINE Doubles<width> cos(const Doubles<width>& x) {
    const Reduced<width> reduced(x);
    const Doubles<width> cosine = select(is_odd(reduced.quadrant), reduced.sine, reduced.cosine);
    return unless(fabs(x) < reduced_below, x, x, from_bits(bits(cosine) ^ sign_of(reduced.quadrant + Words<width>(1))),
                  [](double a, double) { return LOBATTO_LIBRARY(cos)(a); });
}
template <int width>
LOBATTO_INLINE Doubles<width> tan(const Doubles<width>& x) {
    const Reduced<width> reduced(x);
    const Where<width> swap = is_odd(reduced.quadrant);
    const Doubles<width> quotient =
        select(swap, reduced.cosine, reduced.sine) / select(swap, reduced.sine, reduced.cosine);
    return unless(fabs(x) < reduced_below, x, x, from_bits(bits(quotient) ^ (reduced.quadrant << 63)),
                  [](double a, double) { return LOBATTO_LIBRARY(tan)(a); });
}

}  // namespace functions

LOBATTO_FUNCTION(sin)
LOBATTO_FUNCTION(cos)
LOBATTO_FUNCTION(tan)

template <class real, int width>
LOBATTO_INLINE void sincos(const Pack<real, width>& x, Pack<real, width>& sine, Pack<real, width>& cosine) {
    if constexpr (std::is_same_v<real, double>) {
        constexpr int count = Pack<double, width>::count;
        Pack<double, Pack<double, width>::lanes> one_sine, one_cosine;
        LOBATTO_EACH(functions::sincos(functions::single(x, i), one_sine, one_cosine), sine.part[i] = one_sine.part[0],
                     cosine.part[i] = one_cosine.part[0]);
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

// Sine and cosine of one double: a pack of one lane, so that a lone trajectory and a lane of many have the same bits.
LOBATTO_DEVICE inline void sincos(double x, double& sine, double& cosine) {
    Pack<double, 1> one_sine, one_cosine;
    sincos(Pack<double, 1>(x), one_sine, one_cosine);
    sine = one_sine[0];
    cosine = one_cosine[0];
}
template <class real>
LOBATTO_DEVICE inline Only<real, double> sin(real x) {
    real sine, cosine;
    sincos(x, sine, cosine);
    return sine;
}
template <class real>
LOBATTO_DEVICE inline Only<real, double> cos(real x) {
    real sine, cosine;
    sincos(x, sine, cosine);
    return cosine;
}

}  // namespace lobatto

#endif
