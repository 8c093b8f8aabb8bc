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

// Sine and cosine of one argument together. Those of double are in kernel_functions.hpp.
template <class real>
inline void sincos(real x, real& sine, real& cosine) {
    sine = sin(x);
    cosine = cos(x);
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
