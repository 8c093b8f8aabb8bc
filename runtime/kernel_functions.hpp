// SPDX-License-Identifier: MIT
// Elementary functions of packs: every lane as if it were alone. C++17, no allocation.
#ifndef LOBATTO_KERNEL_FUNCTIONS_HPP
#define LOBATTO_KERNEL_FUNCTIONS_HPP

#include "kernel_numbers.hpp"
#include "kernel_pack.hpp"

namespace lobatto {

constexpr double reduced_below = 823549.0;  // 2^19 pi/2

// Replaces the values of the arguments beyond by the library's.
[[gnu::noinline, gnu::cold]] inline void sincos_beyond(int count, const double* x, double* sine, double* cosine) {
    for (int i = 0; i < count; ++i)
        if (!(fabs(x[i]) < reduced_below)) {
            sine[i] = std::sin(x[i]);
            cosine[i] = std::cos(x[i]);
        }
}

// Sine and cosine, up to |x| < 2^19 pi/2 without a branch; lanes beyond by the library.
//
// With k = round(2x/pi) and pi/2 = a + b + c (53 bits each), r = x - k a is exact with FMA. Without FMA the parts have
// 33, 33 and 53 bits, so that the first two products are exact. The reduced argument is kept as a sum of two numbers, r
// + low. Then the minimax polynomials of degree 13 and 14 on [-pi/4, pi/4] published with FDLIBM, in Estrin's order:
// their latency is what a step waits for, and `low` is ready before they are.
template <int width>
LOBATTO_INLINE void sincos(const Pack<double, width>& x, Pack<double, width>& sine, Pack<double, width>& cosine) {
    using P = Pack<double, width>;
    constexpr double shift = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer
    const P shifted = fused(x, P(0.63661977236758134308), P(shift));
    const P k = shifted - shift;
    const Bits<double, width> quadrant = bits(shifted);
    P r, low;
    if constexpr (has_fused) {
        constexpr double a = 0x1.921fb54442d18p+0, b = 0x1.1a62633145c07p-54, c = -0x1.f1976b7ed8fbcp-110;
        const P first = fused(k, P(-a), x);  // exact
        r = fused(k, P(-b), first);
        const P d = first - r;
        low = fused(k, P(-c), fused(k, P(-b), d) + ((first - d) - r));  // what r lost, exact but for c
    } else {
        const P first = x - k * 1.57079632673412561417e+00;  // exact
        const P t = k * 6.07710050630396597660e-11;          // exact
        r = first - t;
        const P back = first - r;
        low = ((back - t) + (first - (r + back))) - k * 2.02226624879595063154e-21;
    }
    const P z = r * r;
    const P z2 = z * z;
    const P cube = z * r;
    const P s = fused(z2,
                      fused(z2, fused(z, P(1.58969099521155010221e-10), P(-2.50507602534068634195e-08)),
                            fused(z, P(2.75573137070700676789e-06), P(-1.98412698298579493134e-04))),
                      fused(z, P(8.33333333332248946124e-03), P(-1.66666666666666324348e-01)));
    const P rest = fused(z, P(-0.5), P(1.0));  // cosine and slope of sine
    const P sine_reduced = r + fused(cube, s, low * rest);
    const P c = fused(z2,
                      fused(z2, fused(z, P(-1.13596475577881948265e-11), P(2.08757232129817482790e-09)),
                            fused(z, P(-2.75573143513906633035e-07), P(2.48015872894767294178e-05))),
                      fused(z, P(-1.38888888888741095749e-03), P(4.16666666666666019037e-02)));
    P slope = -r;  // of cosine; without FMA `low` may be ten units in the last place of r, and needs it better
    if constexpr (!has_fused) slope = cube * 1.66666666666666324348e-01 - r;
    const P cosine_reduced = rest + fused(z2, c, fused(low, slope, fused(z, P(-0.5), 1.0 - rest)));
    const Mask<double, width> swap = is_odd(quadrant);
    using B = Bits<double, width>;
    const B sign = std::numeric_limits<std::int64_t>::min();
    sine = from_bits(bits(select(swap, cosine_reduced, sine_reduced)) ^ ((quadrant << 62) & sign));
    cosine = from_bits(bits(select(swap, sine_reduced, cosine_reduced)) ^ (((quadrant + B(1)) << 62) & sign));
    if (__builtin_expect(!all(fabs(x) < reduced_below), 0)) {
        double arguments[width], sines[width], cosines[width];
        x.store(arguments);
        sine.store(sines);
        cosine.store(cosines);
        sincos_beyond(width, arguments, sines, cosines);
        sine = Pack<double, width>::load(sines);
        cosine = Pack<double, width>::load(cosines);
    }
}
template <int width>
LOBATTO_INLINE Pack<double, width> sin(const Pack<double, width>& x) {
    Pack<double, width> sine, cosine;
    sincos(x, sine, cosine);
    return sine;
}
template <int width>
LOBATTO_INLINE Pack<double, width> cos(const Pack<double, width>& x) {
    Pack<double, width> sine, cosine;
    sincos(x, sine, cosine);
    return cosine;
}

}  // namespace lobatto

#endif
