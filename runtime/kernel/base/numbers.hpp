// SPDX-License-Identifier: MIT
// Numbers: what the number types of kernels need, and their elementary functions. C++17, no allocation.
#ifndef LOBATTO_KERNEL_NUMBERS_HPP
#define LOBATTO_KERNEL_NUMBERS_HPP
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__) || __FINITE_MATH_ONLY__ + 0 > 0
#error "-Ofast and -ffast-math give wrong motions: compile kernels without them"
#endif
#include <cstdint>
#include <limits>
#include <type_traits>
#ifdef LOBATTO_USE_FLOAT128
#include <quadmath.h>
#endif

// In front of functions that a lane's step calls: with nvcc they are for the device too (device_lanes.hpp). There what
// has a lane's arrays must be in line, so that they are registers: LOBATTO_LANE, and LOBATTO_APART, which elsewhere is
// a function by itself. LOBATTO_LIBRARY(f): a function of the C library, which nvcc knows by its own name.
#ifdef __CUDACC__
#define LOBATTO_DEVICE __host__ __device__
#define LOBATTO_LANE __host__ __device__ __forceinline__
#define LOBATTO_APART __host__ __device__ __forceinline__
#define LOBATTO_LIBRARY(f) ::f
#else
#define LOBATTO_DEVICE
#define LOBATTO_LANE
#define LOBATTO_APART [[gnu::noinline]]
#define LOBATTO_LIBRARY(f) __builtin_##f
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

// Whether a type is one of base/many_digits.hpp.
template <class real>
constexpr bool is_many_digits = false;

// The C library's functions by the names that the compiler knows them by: <cmath> would take longer to read than all of
// this support. Templates of one type, so that the library's own functions come first where both are in sight. Sine and
// cosine of double are in base/trigonometry.hpp.
template <class real, class type>
using Only = std::enable_if_t<std::is_same_v<real, type>, real>;
#define LOBATTO_FUNCTION(type, f, suffix)              \
    template <class real>                              \
    LOBATTO_DEVICE inline Only<real, type> f(real x) { \
        return LOBATTO_LIBRARY(f##suffix)(x);          \
    }
#define LOBATTO_FUNCTIONS(type, suffix)                                                       \
    LOBATTO_FUNCTION(type, acos, suffix)                                                      \
    LOBATTO_FUNCTION(type, asin, suffix)                                                      \
    LOBATTO_FUNCTION(type, atan, suffix)                                                      \
    LOBATTO_FUNCTION(type, cosh, suffix)                                                      \
    LOBATTO_FUNCTION(type, exp, suffix)                                                       \
    LOBATTO_FUNCTION(type, fabs, suffix)                                                      \
    LOBATTO_FUNCTION(type, log, suffix)                                                       \
    LOBATTO_FUNCTION(type, sinh, suffix)                                                      \
    LOBATTO_FUNCTION(type, sqrt, suffix)                                                      \
    LOBATTO_FUNCTION(type, tan, suffix)                                                       \
    LOBATTO_FUNCTION(type, tanh, suffix)                                                      \
    template <class real>                                                                     \
    LOBATTO_DEVICE inline Only<real, type> pow(real x, Only<real, type> y) {                  \
        return LOBATTO_LIBRARY(pow##suffix)(x, y);                                            \
    }                                                                                         \
    /* x y + z rounded once on every target, for error-free products; slow without an FMA. */ \
    LOBATTO_DEVICE inline type rounded_once(type x, type y, type z) {                         \
        return LOBATTO_LIBRARY(fma##suffix)(x, y, z);                                         \
    }
LOBATTO_FUNCTIONS(float, f)
LOBATTO_FUNCTIONS(double, )
#ifndef __CUDACC__
LOBATTO_FUNCTIONS(long double, l)
#endif
LOBATTO_FUNCTION(float, sin, f)
LOBATTO_FUNCTION(float, cos, f)
#ifndef __CUDACC__
LOBATTO_FUNCTION(long double, sin, l)
LOBATTO_FUNCTION(long double, cos, l)
#endif
#undef LOBATTO_FUNCTIONS
#undef LOBATTO_FUNCTION

#ifdef LOBATTO_USE_FLOAT128
template <>
struct Limits<__float128> {
    static constexpr __float128 epsilon = __float128(1) / (__float128(1ull << 56) * __float128(1ull << 56));  // 2^-112
    static constexpr __float128 smallest = __float128(std::numeric_limits<long double>::min());
    static constexpr __float128 largest = __float128(std::numeric_limits<long double>::max());
    static constexpr __float128 root_epsilon = __float128(1) / __float128(1ull << 57);
};
#define LOBATTO_FUNCTION(f)             \
    inline __float128 f(__float128 x) { \
        return f##q(x);                 \
    }
LOBATTO_FUNCTION(acos)
LOBATTO_FUNCTION(asin)
LOBATTO_FUNCTION(atan)
LOBATTO_FUNCTION(cos)
LOBATTO_FUNCTION(cosh)
LOBATTO_FUNCTION(exp)
LOBATTO_FUNCTION(fabs)
LOBATTO_FUNCTION(log)
LOBATTO_FUNCTION(sin)
LOBATTO_FUNCTION(sinh)
LOBATTO_FUNCTION(sqrt)
LOBATTO_FUNCTION(tan)
LOBATTO_FUNCTION(tanh)
#undef LOBATTO_FUNCTION
inline __float128 pow(__float128 x, __float128 y) {
    return powq(x, y);
}
inline __float128 rounded_once(__float128 x, __float128 y, __float128 z) {
    return fmaq(x, y, z);
}
#endif

// Sine and cosine of one argument together. Those of double are in base/trigonometry.hpp.
template <class real>
LOBATTO_DEVICE inline void sincos(real x, real& sine, real& cosine) {
    sine = sin(x);
    cosine = cos(x);
}

template <class... reals>
LOBATTO_DEVICE inline bool is_finite(reals... x) {
    return ((x - x == reals(0)) && ...);
}

}  // namespace lobatto

#endif
