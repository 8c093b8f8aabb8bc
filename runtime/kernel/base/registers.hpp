// SPDX-License-Identifier: MIT
// The vector registers of the target, and what one instruction does with them.
#ifndef LOBATTO_KERNEL_REGISTERS_HPP
#define LOBATTO_KERNEL_REGISTERS_HPP

#include <cstdint>
#include <utility>

#include "numbers.hpp"

#ifdef __CUDACC__
#define LOBATTO_INLINE __host__ __device__ __forceinline__
#define LOBATTO_FORMULA
#else
#define LOBATTO_INLINE [[gnu::always_inline]] inline
#define LOBATTO_FORMULA __attribute__((always_inline))  // behind the parameters of a function object
#endif

namespace lobatto {

// The registers of the target.
#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
constexpr int register_bytes = 64;
#elif defined(__AVX__)
constexpr int register_bytes = 32;
#else
constexpr int register_bytes = 16;
#endif

// How many numbers a register holds: one of the types that vector instructions do not know.
template <class real>
constexpr int native_lanes = 1;
template <>
inline constexpr int native_lanes<float> = register_bytes / 4;
template <>
inline constexpr int native_lanes<double> = register_bytes / 8;

// One register, or a part of one: a compiler's vector. A comparison of two gives integers of the same size, -1 where it
// holds and 0 elsewhere. One lane is the plain number, and its comparison a bool.
template <class real, int lanes>
struct Register {
    typedef real Values __attribute__((vector_size(lanes * sizeof(real))));
    using Truths = decltype(Values{} < Values{});
    using Integers = Truths;
    using Natural = std::conditional_t<sizeof(real) == 8, std::uint64_t, std::uint32_t>;
    typedef Natural Naturals __attribute__((vector_size(lanes * sizeof(real))));
};
template <class real>
struct Register<real, 1> {
    using Values = real;
    using Truths = bool;
    using Integers = void;  // of numbers whose bits nobody asks for
    using Naturals = void;
};
template <>
struct Register<float, 1> {
    using Values = float;
    using Truths = bool;
    using Integers = std::int32_t;
    using Naturals = std::uint32_t;
};
template <>
struct Register<double, 1> {
    using Values = double;
    using Truths = bool;
    using Integers = std::int64_t;
    using Naturals = std::uint64_t;
};

// a b + c, rounded once where the target has fused multiply-add (FMA) and twice elsewhere.
template <class real>
LOBATTO_INLINE real fused(real a, real b, real c) {
    return a * b + c;
}
#if defined(__FMA__) || defined(__FP_FAST_FMA) || defined(__aarch64__) || defined(__CUDACC__)
LOBATTO_INLINE float fused(float a, float b, float c) {
    return LOBATTO_LIBRARY(fmaf)(a, b, c);
}
LOBATTO_INLINE double fused(double a, double b, double c) {
    return LOBATTO_LIBRARY(fma)(a, b, c);
}
constexpr bool has_fused = true;
#else
constexpr bool has_fused = false;
#endif

// What one instruction does with a register although the language has no word for it.
namespace registers {

template <class Values>
LOBATTO_INLINE Values fused(Values a, Values b, Values c) {
    if constexpr (has_fused) {
        Values result{};
        for (unsigned i = 0; i < sizeof(Values) / sizeof(a[0]); ++i) result[i] = lobatto::fused(a[i], b[i], c[i]);
        return result;
    } else {
        return a * b + c;
    }
}
template <class Values>
LOBATTO_INLINE Values square_root(Values a) {
    Values result{};
    for (unsigned i = 0; i < sizeof(Values) / sizeof(a[0]); ++i) result[i] = lobatto::sqrt(a[i]);
    return result;
}
template <class Truths>
LOBATTO_INLINE bool any(Truths truths) {
    bool result = false;
    for (unsigned i = 0; i < sizeof(Truths) / sizeof(truths[0]); ++i) result |= truths[i] != 0;
    return result;
}

template <class Truths>
LOBATTO_INLINE bool all(Truths truths) {
    bool result = true;
    for (unsigned i = 0; i < sizeof(Truths) / sizeof(truths[0]); ++i) result &= truths[i] != 0;
    return result;
}

// x86: g++ does not find these instructions in the loops above.
#define LOBATTO_ROOT(type, root)              \
    LOBATTO_INLINE type square_root(type a) { \
        return root(a);                       \
    }
#define LOBATTO_SIGNS(real, width, type, signs)                     \
    LOBATTO_INLINE bool any(Register<real, width>::Truths truths) { \
        return signs((type)truths) != 0;                            \
    }                                                               \
    LOBATTO_INLINE bool all(Register<real, width>::Truths truths) { \
        return signs((type)truths) == (1 << (width)) - 1;           \
    }
#if defined(__SSE2__) && !defined(__CUDACC__)
using Double2 = Register<double, 2>::Values;
using Float4 = Register<float, 4>::Values;
LOBATTO_ROOT(Double2, __builtin_ia32_sqrtpd)
LOBATTO_ROOT(Float4, __builtin_ia32_sqrtps)
LOBATTO_SIGNS(double, 2, Double2, __builtin_ia32_movmskpd)
LOBATTO_SIGNS(float, 4, Float4, __builtin_ia32_movmskps)
#endif
#if defined(__AVX__) && !defined(__CUDACC__)
using Double4 = Register<double, 4>::Values;
using Float8 = Register<float, 8>::Values;
LOBATTO_ROOT(Double4, __builtin_ia32_sqrtpd256)
LOBATTO_ROOT(Float8, __builtin_ia32_sqrtps256)
LOBATTO_SIGNS(double, 4, Double4, __builtin_ia32_movmskpd256)
LOBATTO_SIGNS(float, 8, Float8, __builtin_ia32_movmskps256)
#endif
#if defined(__FMA__) && defined(__SSE2__) && !defined(__CUDACC__)
LOBATTO_INLINE Double2 fused(Double2 a, Double2 b, Double2 c) {
    return __builtin_ia32_vfmaddpd(a, b, c);
}
LOBATTO_INLINE Float4 fused(Float4 a, Float4 b, Float4 c) {
    return __builtin_ia32_vfmaddps(a, b, c);
}
LOBATTO_INLINE Double4 fused(Double4 a, Double4 b, Double4 c) {
    return __builtin_ia32_vfmaddpd256(a, b, c);
}
LOBATTO_INLINE Float8 fused(Float8 a, Float8 b, Float8 c) {
    return __builtin_ia32_vfmaddps256(a, b, c);
}
#endif
#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__)
constexpr int current_rounding = 4;
using Double8 = Register<double, 8>::Values;
using Float16 = Register<float, 16>::Values;
typedef long long Long8 __attribute__((vector_size(64)));  // not the long of the comparisons
LOBATTO_INLINE Double8 fused(Double8 a, Double8 b, Double8 c) {
    return __builtin_ia32_vfmaddpd512_mask(a, b, c, static_cast<unsigned char>(-1), current_rounding);
}
LOBATTO_INLINE Float16 fused(Float16 a, Float16 b, Float16 c) {
    return __builtin_ia32_vfmaddps512_mask(a, b, c, static_cast<unsigned short>(-1), current_rounding);
}
#ifdef __clang__
LOBATTO_INLINE Double8 square_root(Double8 a) {
    return __builtin_ia32_sqrtpd512(a, current_rounding);
}
LOBATTO_INLINE Float16 square_root(Float16 a) {
    return __builtin_ia32_sqrtps512(a, current_rounding);
}
#else
LOBATTO_INLINE Double8 square_root(Double8 a) {
    return __builtin_ia32_sqrtpd512_mask(a, a, static_cast<unsigned char>(-1), current_rounding);
}
LOBATTO_INLINE Float16 square_root(Float16 a) {
    return __builtin_ia32_sqrtps512_mask(a, a, static_cast<unsigned short>(-1), current_rounding);
}
#endif
LOBATTO_SIGNS(double, 8, Long8, __builtin_ia32_cvtq2mask512)
using Truths16 = Register<float, 16>::Truths;
LOBATTO_SIGNS(float, 16, Truths16, __builtin_ia32_cvtd2mask512)
#endif
#undef LOBATTO_ROOT
#undef LOBATTO_SIGNS

}  // namespace registers

// What Pack does with its registers; of numbers that are a class, they say it themselves (base/double_double.hpp).
template <class real, int lanes>
struct RegisterOperations {
    using Values = typename Register<real, lanes>::Values;
    using Truths = typename Register<real, lanes>::Truths;

    LOBATTO_INLINE static Values spread(const real& x) { return x - Values{}; }  // x - 0 keeps -0
    LOBATTO_INLINE static real lane(const Values& values, int i) {
        if constexpr (lanes == 1)
            return values;
        else
            return values[i];
    }
    LOBATTO_INLINE static void set(Values& values, int i, const real& x) {
        if constexpr (lanes == 1)
            values = x;
        else
            values[i] = x;
    }
    LOBATTO_INLINE static Values load(const real* from) {
        Values values;
        __builtin_memcpy(&values, from, sizeof values);
        return values;
    }
    LOBATTO_INLINE static void store(const Values& values, real* to) { __builtin_memcpy(to, &values, sizeof values); }
    LOBATTO_INLINE static Values choose(const Truths& where, const Values& a, const Values& b) { return where ? a : b; }
    LOBATTO_INLINE static Values fused(const Values& a, const Values& b, const Values& c) {
        if constexpr (lanes == 1)
            return lobatto::fused(a, b, c);
        else
            return registers::fused(a, b, c);
    }
    LOBATTO_INLINE static Values square_root(const Values& a) {
        if constexpr (lanes == 1)
            return lobatto::sqrt(a);
        else
            return registers::square_root(a);
    }
    LOBATTO_INLINE static Values magnitude(const Values& a) {
        if constexpr (lanes == 1) {
            return lobatto::fabs(a);
        } else {
            using Integers = typename Register<real, lanes>::Integers;
            return (Values)((Integers)a & ~(Integers)spread(real(-0.0)));
        }
    }
    // The first (0) or second (1) half of the lanes.
    LOBATTO_INLINE static auto half(const Values& values, int which) {
        return half(values, which, std::make_integer_sequence<int, lanes / 2>());
    }

private:
    template <int... i>
    LOBATTO_INLINE static auto half(const Values& values, int which, std::integer_sequence<int, i...>) {
        typename Register<real, lanes / 2>::Values result;
        if constexpr (lanes == 2) {
            result = values[which];
        } else {
            result = which == 0 ? __builtin_shufflevector(values, values, i...)
                                : __builtin_shufflevector(values, values, (i + lanes / 2)...);
        }
        return result;
    }
};

}  // namespace lobatto

#endif
