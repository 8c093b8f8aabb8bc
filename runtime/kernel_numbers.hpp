// SPDX-License-Identifier: MIT
// Numbers: what the number types of kernels need, and their elementary functions. C++17, no allocation.
#ifndef LOBATTO_KERNEL_NUMBERS_HPP
#define LOBATTO_KERNEL_NUMBERS_HPP

#include <cmath>
#include <cstdint>
#include <limits>
#ifdef LOBATTO_USE_FLOAT128
#include <quadmath.h>
#endif

namespace lobatto {

template <class real>
struct Limits {
    static constexpr real epsilon = std::numeric_limits<real>::epsilon();
    static constexpr real smallest = std::numeric_limits<real>::min();
    static constexpr real largest = std::numeric_limits<real>::max();
    static constexpr real root_epsilon = sizeof(real) == 4   ? real(1.0 / 4096)           // 2^-12
                                         : sizeof(real) == 8 ? real(1.0 / 134217728)      // 2^-27
                                                             : real(1.0 / 8589934592.0);  // 2^-33
};

using std::acos;
using std::asin;
using std::atan;
using std::cosh;
using std::exp;
using std::fabs;
using std::log;
using std::pow;
using std::sinh;
using std::sqrt;
using std::tan;
using std::tanh;

#ifdef LOBATTO_USE_FLOAT128
template <>
struct Limits<__float128> {
    static constexpr __float128 epsilon = __float128(1) / (__float128(1ull << 56) * __float128(1ull << 56));  // 2^-112
    static constexpr __float128 smallest = __float128(std::numeric_limits<long double>::min());
    static constexpr __float128 largest = __float128(std::numeric_limits<long double>::max());
    static constexpr __float128 root_epsilon = __float128(1) / __float128(1ull << 57);
};
inline __float128 acos(__float128 x) {
    return acosq(x);
}
inline __float128 asin(__float128 x) {
    return asinq(x);
}
inline __float128 atan(__float128 x) {
    return atanq(x);
}
inline __float128 cos(__float128 x) {
    return cosq(x);
}
inline __float128 cosh(__float128 x) {
    return coshq(x);
}
inline __float128 exp(__float128 x) {
    return expq(x);
}
inline __float128 fabs(__float128 x) {
    return fabsq(x);
}
inline __float128 log(__float128 x) {
    return logq(x);
}
inline __float128 pow(__float128 x, __float128 y) {
    return powq(x, y);
}
inline __float128 sin(__float128 x) {
    return sinq(x);
}
inline __float128 sinh(__float128 x) {
    return sinhq(x);
}
inline __float128 sqrt(__float128 x) {
    return sqrtq(x);
}
inline __float128 tan(__float128 x) {
    return tanq(x);
}
inline __float128 tanh(__float128 x) {
    return tanhq(x);
}
#endif

inline float sin(float x) {
    return std::sin(x);
}
inline float cos(float x) {
    return std::cos(x);
}
inline long double sin(long double x) {
    return std::sin(x);
}
inline long double cos(long double x) {
    return std::cos(x);
}

// Sine and cosine of one argument together.
template <class real>
inline void sincos(real x, real& sine, real& cosine) {
    sine = sin(x);
    cosine = cos(x);
}

// The same for double, up to |x| < 2^19 pi/2: reduction by pi/2 in three parts (33 + 33 + 53 bits, so that k * part is
// exact for |k| < 2^20 in the first two), kept as a sum of two doubles, then the minimax polynomials of degree 13 and
// 14 on
// [-pi/4, pi/4] published with FDLIBM. Measured: at most 0.77 ulp for |x| < 10^4 and 0.87 beyond, but 1.07 at some of
// the doubles nearest the multiples of pi/2. Uses no FMA, so that every processor and compiler gives the same bits.
inline void sincos(double x, double& sine, double& cosine) {
    if (!(fabs(x) < 823549.0)) {
        sine = std::sin(x);
        cosine = std::cos(x);
        return;
    }
    constexpr double shift = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer
    const double shifted = x * 0.63661977236758134308 + shift;
    const double k = shifted - shift;
    const std::int64_t quadrant = static_cast<std::int64_t>(k);
    const double r1 = x - k * 1.57079632673412561417e+00;  // exact: the part has 33 bits
    const double t = k * 6.07710050630396597660e-11;       // exact: the next 33 bits
    const double r2 = r1 - t;
    const double back = r1 - r2;
    const double lost = (back - t) + (r1 - (r2 + back));       // what r1 - t lost
    const double low = lost - k * 2.02226624879595063154e-21;  // the last 53 bits; the reduced argument is r2 + low
    // Polynomials in Estrin's order: their latency is what a step waits for, and `low` is ready before they are.
    const double z = r2 * r2;
    const double z2 = z * z;
    const double z4 = z2 * z2;
    const double s =
        (8.33333333332248946124e-03 + z * -1.98412698298579493134e-04) +
        (z2 * (2.75573137070700676789e-06 + z * -2.50507602534068634195e-08) + z4 * 1.58969099521155010221e-10);
    const double cube = z * r2;
    const double sixth = cube * 1.66666666666666324348e-01;
    const double sine_reduced = r2 - (sixth - (cube * (z * s) + (low - 0.5 * (z * low))));
    const double c = (4.16666666666666019037e-02 + z * -1.38888888888741095749e-03) +
                     (z2 * (2.48015872894767294178e-05 + z * -2.75573143513906633035e-07) +
                      z4 * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11));
    const double half = 0.5 * z;
    const double rest = 1.0 - half;
    const double cosine_reduced = rest + (((1.0 - rest) - half) + (z2 * c - low * (r2 - sixth)));
    const bool swap = (quadrant & 1) != 0;
    const double a = swap ? cosine_reduced : sine_reduced;
    const double b = swap ? sine_reduced : cosine_reduced;
    sine = (quadrant & 2) != 0 ? -a : a;
    cosine = ((quadrant + 1) & 2) != 0 ? -b : b;
}

// Sine and cosine alone; for double half of the pair above, so that a lone sine has the same bits.
inline double sin(double x) {
    double sine, cosine;
    sincos(x, sine, cosine);
    return sine;
}
inline double cos(double x) {
    double sine, cosine;
    sincos(x, sine, cosine);
    return cosine;
}

template <class... reals>
inline bool is_finite(reals... x) {
    return ((x - x == reals(0)) && ...);
}

// a b + c rounded once on every target, for error-free products; slow where the target has no FMA.
inline float rounded_once(float a, float b, float c) {
    return std::fma(a, b, c);
}
inline double rounded_once(double a, double b, double c) {
    return std::fma(a, b, c);
}
inline long double rounded_once(long double a, long double b, long double c) {
    return std::fma(a, b, c);
}
#ifdef LOBATTO_USE_FLOAT128
inline __float128 rounded_once(__float128 a, __float128 b, __float128 c) {
    return fmaq(a, b, c);
}
#endif
}  // namespace lobatto

#endif
