// SPDX-License-Identifier: MIT
// Numbers: what the number types of kernels need, and their elementary functions. C++17, no allocation.
#ifndef LOBATTO_KERNEL_NUMBERS_HPP
#define LOBATTO_KERNEL_NUMBERS_HPP

#include <cstdint>
#include <limits>
#include <type_traits>
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

// The C library's functions by the names that the compiler knows them by: <cmath> would take longer to read than all of
// this support. Templates of one type, so that the library's own functions come first where both are in sight. Sine and
// cosine of double are in base/trigonometry.hpp.
template <class real, class type>
using Only = std::enable_if_t<std::is_same_v<real, type>, real>;
#define LOBATTO_FUNCTION(type, f, suffix) \
    template <class real>                 \
    inline Only<real, type> f(real x) {   \
        return __builtin_##f##suffix(x);  \
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
    inline Only<real, type> pow(real x, Only<real, type> y) {                                 \
        return __builtin_pow##suffix(x, y);                                                   \
    }                                                                                         \
    /* x y + z rounded once on every target, for error-free products; slow without an FMA. */ \
    inline type rounded_once(type x, type y, type z) {                                        \
        return __builtin_fma##suffix(x, y, z);                                                \
    }
LOBATTO_FUNCTIONS(float, f)
LOBATTO_FUNCTIONS(double, )
LOBATTO_FUNCTIONS(long double, l)
LOBATTO_FUNCTION(float, sin, f)
LOBATTO_FUNCTION(float, cos, f)
LOBATTO_FUNCTION(long double, sin, l)
LOBATTO_FUNCTION(long double, cos, l)
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
inline void sincos(real x, real& sine, real& cosine) {
    sine = sin(x);
    cosine = cos(x);
}

template <class... reals>
inline bool is_finite(reals... x) {
    return ((x - x == reals(0)) && ...);
}

}  // namespace lobatto

#endif
// Pack<real, width>: `width` numbers side by side in vector registers, computed with as one. C++17, no allocation.
//
// A plain number is a pack of one lane: lanes_of, real_of, select, any, all, fused, minimum, maximum, sum and largest
// know both, so that a function template serves one state and many.
#ifndef LOBATTO_KERNEL_PACK_HPP
#define LOBATTO_KERNEL_PACK_HPP

#include <cstdint>
#include <type_traits>
#include <utility>

#define LOBATTO_INLINE [[gnu::always_inline]] inline
#define LOBATTO_FORMULA __attribute__((always_inline))  // behind the parameters of a function object

// An expression for each register i of a pack, which has `count` of them, at most eight. It is text, not a function of
// i: the compiler's time goes with the number of functions.
#define LOBATTO_REGISTER(number, ...) \
    if constexpr (number < count) {   \
        constexpr int i = number;     \
        __VA_ARGS__;                  \
    }
#define LOBATTO_EACH(...)            \
    LOBATTO_REGISTER(0, __VA_ARGS__) \
    LOBATTO_REGISTER(1, __VA_ARGS__) \
    LOBATTO_REGISTER(2, __VA_ARGS__) \
    LOBATTO_REGISTER(3, __VA_ARGS__) \
    LOBATTO_REGISTER(4, __VA_ARGS__) \
    LOBATTO_REGISTER(5, __VA_ARGS__) \
    LOBATTO_REGISTER(6, __VA_ARGS__) \
    LOBATTO_REGISTER(7, __VA_ARGS__)
// Returns the Result whose register i is the expression.
#define LOBATTO_PARTS(Result, ...)               \
    Result result;                               \
    LOBATTO_EACH(result.part[i] = (__VA_ARGS__)) \
    return result
#define LOBATTO_OPERATOR(Given, Result, operation)                                    \
    LOBATTO_INLINE friend Result operator operation(const Given& a, const Given& b) { \
        LOBATTO_PARTS(Result, typename Result::Part(a.part[i] operation b.part[i]));  \
    }

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
#if defined(__FMA__) || defined(__FP_FAST_FMA) || defined(__aarch64__)
LOBATTO_INLINE float fused(float a, float b, float c) {
    return __builtin_fmaf(a, b, c);
}
LOBATTO_INLINE double fused(double a, double b, double c) {
    return __builtin_fma(a, b, c);
}
constexpr bool has_fused = true;
#else
LOBATTO_INLINE float fused(float a, float b, float c) {
    return a * b + c;
}
LOBATTO_INLINE double fused(double a, double b, double c) {
    return a * b + c;
}
constexpr bool has_fused = false;
#endif
LOBATTO_INLINE long double fused(long double a, long double b, long double c) {
    return a * b + c;
}
#ifdef LOBATTO_USE_FLOAT128
LOBATTO_INLINE __float128 fused(__float128 a, __float128 b, __float128 c) {
    return a * b + c;
}
#endif

// The names of packs, for plain numbers.
LOBATTO_INLINE bool any(bool truth) {
    return truth;
}
LOBATTO_INLINE bool all(bool truth) {
    return truth;
}
template <class T>
LOBATTO_INLINE T select(bool truth, const T& a, const T& b) {
    return truth ? a : b;
}
template <class real>
LOBATTO_INLINE real minimum(real a, real b) {
    return a < b ? a : b;
}
template <class real>
LOBATTO_INLINE real maximum(real a, real b) {
    return a > b ? a : b;
}
template <class real>
LOBATTO_INLINE real sum(real x) {
    return x;
}
template <class real>
LOBATTO_INLINE real largest(real x) {
    return x;
}

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
        return signs((type)truths) == (1 << width) - 1;             \
    }
#ifdef __SSE2__
using Double2 = Register<double, 2>::Values;
using Float4 = Register<float, 4>::Values;
LOBATTO_ROOT(Double2, __builtin_ia32_sqrtpd)
LOBATTO_ROOT(Float4, __builtin_ia32_sqrtps)
LOBATTO_SIGNS(double, 2, Double2, __builtin_ia32_movmskpd)
LOBATTO_SIGNS(float, 4, Float4, __builtin_ia32_movmskps)
#endif
#ifdef __AVX__
using Double4 = Register<double, 4>::Values;
using Float8 = Register<float, 8>::Values;
LOBATTO_ROOT(Double4, __builtin_ia32_sqrtpd256)
LOBATTO_ROOT(Float8, __builtin_ia32_sqrtps256)
LOBATTO_SIGNS(double, 4, Double4, __builtin_ia32_movmskpd256)
LOBATTO_SIGNS(float, 8, Float8, __builtin_ia32_movmskps256)
#endif
#if defined(__FMA__) && defined(__SSE2__)
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
#if __has_builtin(__builtin_shufflevector)
            result = which == 0 ? __builtin_shufflevector(values, values, i...)
                                : __builtin_shufflevector(values, values, (i + lanes / 2)...);
#else
            ((result[i] = values[which * lanes / 2 + i]), ...);
#endif
        }
        return result;
    }
};

// width / lanes registers of `lanes` numbers each.
template <class real, int width>
struct PackShape {
    static_assert(width >= 1 && (width & (width - 1)) == 0, "the width of a pack is a power of two");
    static constexpr int lanes = width < native_lanes<real> ? width : native_lanes<real>;
    static constexpr int count = width / lanes;
    static_assert(count <= 8, "a pack has at most eight registers");
};

// Which lanes: what comparisons of packs give.
template <class real, int width>
struct Mask;

// The bits of a pack's numbers, as integers: for exponents, signs and quadrants.
template <class real, int width>
struct Bits;

// The first (0) or second (1) half of the registers.
template <class Half, class Whole>
LOBATTO_INLINE Half registers_of(const Whole& whole, int which) {
    constexpr int count = Half::count;
    LOBATTO_PARTS(Half, whole.part[which * count + i]);
}

template <class real, int width>
struct Pack {
    static constexpr int lanes = PackShape<real, width>::lanes, count = PackShape<real, width>::count;
    using Part = typename Register<real, lanes>::Values;
    using Truths = Mask<real, width>;
    using Operations = RegisterOperations<real, lanes>;

    Part part[count];

    Pack() = default;
    // One register at a time: g++ keeps a Pack in registers only while it is not copied as a whole.
    LOBATTO_INLINE Pack(const Pack& other) { LOBATTO_EACH(part[i] = other.part[i]); }
    LOBATTO_INLINE Pack& operator=(const Pack& other) {
        LOBATTO_EACH(part[i] = other.part[i]);
        return *this;
    }
    LOBATTO_INLINE Pack(const real& x) { LOBATTO_EACH(part[i] = Operations::spread(x)); }
    // From a literal, where numbers are a class.
    template <class Number, class = std::enable_if_t<std::is_class_v<real> && std::is_arithmetic_v<Number>>>
    LOBATTO_INLINE Pack(Number x) : Pack(real(x)) {}

    LOBATTO_INLINE static Pack load(const real* from) {
        Pack result;
        LOBATTO_EACH(result.part[i] = Operations::load(from + i * lanes));
        return result;
    }
    LOBATTO_INLINE void store(real* to) const { LOBATTO_EACH(Operations::store(part[i], to + i * lanes)); }

    LOBATTO_INLINE real operator[](int lane) const { return Operations::lane(part[lane / lanes], lane % lanes); }
    LOBATTO_INLINE void set(int lane, const real& x) { Operations::set(part[lane / lanes], lane % lanes, x); }

    LOBATTO_INLINE Pack operator-() const { LOBATTO_PARTS(Pack, -part[i]); }
    LOBATTO_INLINE Pack& operator+=(const Pack& b) { return *this = *this + b; }
    LOBATTO_INLINE Pack& operator-=(const Pack& b) { return *this = *this - b; }
    LOBATTO_INLINE Pack& operator*=(const Pack& b) { return *this = *this * b; }
    LOBATTO_INLINE Pack& operator/=(const Pack& b) { return *this = *this / b; }
    LOBATTO_OPERATOR(Pack, Pack, +);
    LOBATTO_OPERATOR(Pack, Pack, -);
    LOBATTO_OPERATOR(Pack, Pack, *);
    LOBATTO_OPERATOR(Pack, Pack, /);
    LOBATTO_OPERATOR(Pack, Truths, <);
    LOBATTO_OPERATOR(Pack, Truths, <=);
    LOBATTO_OPERATOR(Pack, Truths, >);
    LOBATTO_OPERATOR(Pack, Truths, >=);
    LOBATTO_OPERATOR(Pack, Truths, ==);
    LOBATTO_OPERATOR(Pack, Truths, !=);

    LOBATTO_INLINE friend Pack fused(const Pack& a, const Pack& b, const Pack& c) {
        LOBATTO_PARTS(Pack, Operations::fused(a.part[i], b.part[i], c.part[i]));
    }
    LOBATTO_INLINE friend Pack minimum(const Pack& a, const Pack& b) { return select(a < b, a, b); }
    LOBATTO_INLINE friend Pack maximum(const Pack& a, const Pack& b) { return select(a > b, a, b); }

    LOBATTO_INLINE friend Bits<real, width> bits(const Pack& a) {
        Bits<real, width> result;
        LOBATTO_EACH(__builtin_memcpy(&result.part[i], &a.part[i], sizeof(Part)));
        return result;
    }

    // Over the lanes, by halves: (0 + 2) + (1 + 3) for four.
    LOBATTO_INLINE friend real sum(const Pack& a) {
        if constexpr (width == 1)
            return a.part[0];
        else
            return sum(a.half(0) + a.half(1));
    }
    LOBATTO_INLINE friend real largest(const Pack& a) {
        if constexpr (width == 1)
            return a.part[0];
        else
            return largest(maximum(a.half(0), a.half(1)));
    }

    // The first (0) or second (1) half of the lanes.
    LOBATTO_INLINE Pack<real, (width > 1 ? width / 2 : 1)> half(int which) const {
        using Half = Pack<real, (width > 1 ? width / 2 : 1)>;
        if constexpr (count > 1) {
            return registers_of<Half>(*this, which);
        } else if constexpr (width > 1) {
            Half result;
            result.part[0] = Operations::half(part[0], which);
            return result;
        } else {
            return *this;
        }
    }
};

template <class real, int width>
struct Mask {
    static constexpr int lanes = PackShape<real, width>::lanes, count = PackShape<real, width>::count;
    using Part = typename Register<real, lanes>::Truths;
    using Numbers = Pack<real, width>;

    Part part[count];

    Mask() = default;
    LOBATTO_INLINE Mask(bool truth) {
        if constexpr (lanes == 1) {
            LOBATTO_EACH(part[i] = truth);
        } else {
            LOBATTO_EACH(part[i] = Part{} - truth);
        }
    }

    LOBATTO_INLINE bool operator[](int lane) const {
        if constexpr (lanes == 1)
            return part[lane];
        else
            return part[lane / lanes][lane % lanes] != 0;
    }
    LOBATTO_INLINE void set(int lane, bool truth) {
        if constexpr (lanes == 1)
            part[lane] = truth;
        else
            part[lane / lanes][lane % lanes] = truth ? -1 : 0;
    }

    LOBATTO_INLINE Mask operator!() const {
        if constexpr (lanes == 1) {
            LOBATTO_PARTS(Mask, !part[i]);
        } else {
            LOBATTO_PARTS(Mask, ~part[i]);
        }
    }
    LOBATTO_OPERATOR(Mask, Mask, &);
    LOBATTO_OPERATOR(Mask, Mask, |);

    LOBATTO_INLINE friend bool any(const Mask& a) {
        Part joined = a.part[0];
        LOBATTO_EACH(joined = Part(joined | a.part[i]));
        if constexpr (lanes == 1)
            return joined;
        else
            return registers::any(joined);
    }
    LOBATTO_INLINE friend bool all(const Mask& a) {
        Part common = a.part[0];
        LOBATTO_EACH(common = Part(common & a.part[i]));
        if constexpr (lanes == 1)
            return common;
        else
            return registers::all(common);
    }

    // a where the mask holds, b elsewhere.
    LOBATTO_INLINE friend Numbers select(const Mask& mask, const Numbers& a, const Numbers& b) {
        LOBATTO_PARTS(Numbers, Numbers::Operations::choose(mask.part[i], a.part[i], b.part[i]));
    }
};

template <class real, int width>
struct Bits {
    static constexpr int lanes = PackShape<real, width>::lanes, count = PackShape<real, width>::count;
    using Part = typename Register<real, lanes>::Integers;
    using Naturals = typename Register<real, lanes>::Naturals;
    using Integer = typename Register<real, 1>::Integers;
    using Numbers = Pack<real, width>;
    using Truths = Mask<real, width>;

    Part part[count];

    Bits() = default;
    LOBATTO_INLINE Bits(Integer x) { LOBATTO_EACH(part[i] = Part{} + x); }
    LOBATTO_OPERATOR(Bits, Bits, +);
    LOBATTO_OPERATOR(Bits, Bits, -);
    LOBATTO_OPERATOR(Bits, Bits, &);
    LOBATTO_OPERATOR(Bits, Bits, |);
    LOBATTO_OPERATOR(Bits, Bits, ^);
    LOBATTO_INLINE Bits operator~() const { LOBATTO_PARTS(Bits, ~part[i]); }
    LOBATTO_INLINE friend Bits operator<<(const Bits& a, int places) {
        LOBATTO_PARTS(Bits, (Part)((Naturals)a.part[i] << places));
    }

    LOBATTO_INLINE friend Bits operator>>(const Bits& a, int places) {  // zeros come in
        LOBATTO_PARTS(Bits, (Part)((Naturals)a.part[i] >> places));
    }

    // The numbers of these bits.
    LOBATTO_INLINE friend Numbers from_bits(const Bits& a) {
        Numbers result;
        LOBATTO_EACH(__builtin_memcpy(&result.part[i], &a.part[i], sizeof(Part)));
        return result;
    }
    // Where the last bit is set.
    LOBATTO_INLINE friend Truths is_odd(const Bits& a) {
        constexpr int top = 8 * sizeof(Integer) - 1;
        LOBATTO_PARTS(Truths, (Part)((Naturals)a.part[i] << top) < 0);
    }
};

// These two, like the functions of base/trigonometry.hpp and its kin, are also found by their full names lobatto::sqrt,
// lobatto::fabs.
template <class real, int width>
LOBATTO_INLINE Pack<real, width> sqrt(const Pack<real, width>& a) {
    using Numbers = Pack<real, width>;
    constexpr int count = Numbers::count;
    LOBATTO_PARTS(Numbers, Numbers::Operations::square_root(a.part[i]));
}
template <class real, int width>
LOBATTO_INLINE Pack<real, width> fabs(const Pack<real, width>& a) {
    using Numbers = Pack<real, width>;
    constexpr int count = Numbers::count;
    LOBATTO_PARTS(Numbers, Numbers::Operations::magnitude(a.part[i]));
}

// a b + c of plain numbers, of Packs, or of both: for emitted formulas, whose kernel may bear any name.
template <class A, class B, class C>
LOBATTO_INLINE auto fused_sum(const A& a, const B& b, const C& c) {
    return fused(a, b, c);
}

// How many lanes a type has, and of which number.
template <class T>
constexpr int lanes_of = 1;
template <class real, int width>
constexpr int lanes_of<Pack<real, width>> = width;

template <class T>
struct RealOf {
    using type = T;
};
template <class real, int width>
struct RealOf<Pack<real, width>> {
    using type = real;
};
template <class T>
using real_of = typename RealOf<T>::type;

// One lane of a value, which may be a plain number.
template <class real, int width>
inline void set_lane(Pack<real, width>& value, int lane, real x) {
    value.set(lane, x);
}
template <class real>
inline void set_lane(real& value, int, real x) {
    value = x;
}
template <class real, int width>
inline real lane_of(const Pack<real, width>& value, int lane) {
    return value[lane];
}
template <class real>
inline real lane_of(const real& value, int) {
    return value;
}

}  // namespace lobatto

#endif
// What the elementary functions of packs share; they are in trigonometry.hpp, exponential.hpp and arc.hpp. Every lane
// is as if it were alone. C++17, no allocation.
//
// For double: one path without branches, polynomials in Estrin's order (a step waits for their latency), and the
// library for lanes beyond the path's range. float is computed in double and rounded. long double and __float128 are
// the library's. Accuracy and speed: docs/measurements/vector_functions.md, measured by bench/functions.cpp.
#ifndef LOBATTO_KERNEL_FUNCTIONS_HPP
#define LOBATTO_KERNEL_FUNCTIONS_HPP

namespace lobatto {

namespace functions {

template <int width>
using Doubles = Pack<double, width>;
template <int width>
using Words = Bits<double, width>;
template <int width>
using Where = Mask<double, width>;

constexpr double integer_shift = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to an integer, in the last bits
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
    Doubles<Doubles<width>::lanes> one;
    one.part[0] = x.part[i];
    return one;
}

}  // namespace functions

// The function of packs of any number type from that of doubles.
#define LOBATTO_FUNCTION(name)                                                        \
    template <class real, int width>                                                  \
    LOBATTO_INLINE Pack<real, width> name(const Pack<real, width>& x) {               \
        using Numbers = Pack<real, width>;                                            \
        constexpr int count = Numbers::count;                                         \
        if constexpr (std::is_same_v<real, double>) {                                 \
            LOBATTO_PARTS(Numbers, functions::name(functions::single(x, i)).part[0]); \
        } else if constexpr (std::is_same_v<real, float>) {                           \
            return functions::narrowed(name(functions::widened(x)));                  \
        } else {                                                                      \
            LOBATTO_PARTS(Numbers, lobatto::name(x.part[i]));                         \
        }                                                                             \
    }

}  // namespace lobatto

#endif
// Sine, cosine and tangent of packs, and sine and cosine together.
#ifndef LOBATTO_KERNEL_TRIGONOMETRY_HPP
#define LOBATTO_KERNEL_TRIGONOMETRY_HPP

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
inline void sincos(double x, double& sine, double& cosine) {
    Pack<double, 1> one_sine, one_cosine;
    sincos(Pack<double, 1>(x), one_sine, one_cosine);
    sine = one_sine[0];
    cosine = one_cosine[0];
}
template <class real>
inline Only<real, double> sin(real x) {
    real sine, cosine;
    sincos(x, sine, cosine);
    return sine;
}
template <class real>
inline Only<real, double> cos(real x) {
    real sine, cosine;
    sincos(x, sine, cosine);
    return cosine;
}

}  // namespace lobatto

#endif
// Exponential, logarithm, powers and hyperbolic functions of packs.
#ifndef LOBATTO_KERNEL_EXPONENTIAL_HPP
#define LOBATTO_KERNEL_EXPONENTIAL_HPP

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
// Inverse sine, cosine and tangent of packs.
#ifndef LOBATTO_KERNEL_ARC_HPP
#define LOBATTO_KERNEL_ARC_HPP

namespace lobatto {

namespace functions {

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

}  // namespace functions

LOBATTO_FUNCTION(asin)
LOBATTO_FUNCTION(acos)
LOBATTO_FUNCTION(atan)

}  // namespace lobatto

#endif
// DoubleDouble: a number of 106 bits as the sum of two doubles, alone and in the lanes of Packs. C++17, no allocation.
//
// Formula numbers (D..) refer to docs/derivation.md. high is the sum rounded to double, low the rest (D50). With u =
// 2^-53 products, quotients and roots err by at most some 10 u^2, sums by 2 u^2 (|a| + |b|): (T. J. Dekker 1971; M.
// Joldes, J.-M. Muller and V. Popescu 2017). The range is that of double; below 2^-916 the digits of low get lost. What
// overflows is infinite or not a number, and stays so.
#ifndef LOBATTO_KERNEL_DOUBLE_DOUBLE_HPP
#define LOBATTO_KERNEL_DOUBLE_DOUBLE_HPP

#include <type_traits>

namespace lobatto {

// Of doubles, and of registers of doubles: T.
namespace two_fold {

// a b + c, rounded once; only where the target has it.
LOBATTO_INLINE double fused_once(double a, double b, double c) {
    return lobatto::fused(a, b, c);
}
template <class T>
LOBATTO_INLINE T fused_once(const T& a, const T& b, const T& c) {
    return registers::fused(a, b, c);
}
// A product that the compiler must not contract with a sum: g++ 12 does (VEC_FMADDSUB), even with -ffp-contract=off.
template <class T>
LOBATTO_INLINE void keep_rounded([[maybe_unused]] T& product) {
#if defined(__x86_64__)
    asm("" : "+x"(product));
#elif defined(__aarch64__)
    asm("" : "+w"(product));
#endif
}
// a b + c, rounded once or twice.
template <class T>
LOBATTO_INLINE constexpr T fused(const T& a, const T& b, const T& c) {
    if constexpr (has_fused) {
        if (!__builtin_is_constant_evaluated()) return fused_once(a, b, c);
    }
    return a * b + c;
}

// s + e = a + b, s the rounded sum (D. E. Knuth).
template <class T>
LOBATTO_INLINE constexpr void add(const T& a, const T& b, T& s, T& e) {
    s = a + b;
    const T part = s - a;
    e = (a - (s - part)) + (b - part);
}
// The same where |a| >= |b|, or a is zero.
template <class T>
LOBATTO_INLINE constexpr void add_smaller(const T& a, const T& b, T& s, T& e) {
    s = a + b;
    e = b - (s - a);
}
// p + e = a b, p the rounded product (T. J. Dekker, with G. W. Veltkamp's splitting; by FMA where there is one).
template <class T>
LOBATTO_INLINE constexpr void multiply(const T& a, const T& b, T& p, T& e) {
    p = a * b;
    if constexpr (has_fused) {
        if (!__builtin_is_constant_evaluated()) {
            keep_rounded(p);
            e = fused_once(a, b, -p);
            return;
        }
    }
    const T shifted_a = a * 134217729.0, shifted_b = b * 134217729.0;  // 2^27 + 1
    const T a1 = shifted_a - (shifted_a - a), b1 = shifted_b - (shifted_b - b);
    const T a2 = a - a1, b2 = b - b1;
    e = ((a1 * b1 - p) + (a1 * b2 + a2 * b1)) + a2 * b2;
}

// X: DoubleDouble or DoubleDoubles. high + low, |high| >= |low|.
template <class X, class T>
LOBATTO_INLINE constexpr X joined(const T& high, const T& low) {
    X x{};
    add_smaller(high, low, x.high, x.low);
    return x;
}

template <class X>
LOBATTO_INLINE constexpr X sum(const X& a, const X& b) {
    using T = typename X::Part;
    T s{}, e{};
    add(a.high, b.high, s, e);
    return joined<X>(s, e + (a.low + b.low));
}
// Errs by 3 u^2 |a + b|, also where digits cancel.
template <class X>
LOBATTO_INLINE constexpr X accurate_sum(const X& a, const X& b) {
    using T = typename X::Part;
    T s{}, e{}, t{}, f{};
    add(a.high, b.high, s, e);
    add(a.low, b.low, t, f);
    const X first = joined<X>(s, e + t);
    return joined<X>(first.high, first.low + f);
}
template <class X>
LOBATTO_INLINE constexpr X product(const X& a, const X& b) {
    using T = typename X::Part;
    T p{}, e{};
    multiply(a.high, b.high, p, e);
    return joined<X>(p, fused(a.high, b.low, fused(a.low, b.high, e)));
}
template <class X, class T>
LOBATTO_INLINE constexpr X product_by_part(const X& a, const T& b) {
    T p{}, e{};
    multiply(a.high, b, p, e);
    return joined<X>(p, fused(a.low, b, e));
}
// a b + c
template <class X>
LOBATTO_INLINE constexpr X product_and_sum(const X& a, const X& b, const X& c) {
    using T = typename X::Part;
    T p{}, e{}, s{}, f{};
    multiply(a.high, b.high, p, e);
    const T rest = fused(a.high, b.low, fused(a.low, b.high, e + c.low));
    add(c.high, p, s, f);
    return joined<X>(s, f + rest);
}
template <class X>
LOBATTO_INLINE constexpr X quotient(const X& a, const X& b) {
    using T = typename X::Part;
    const T inverse = 1.0 / b.high;
    const T first = a.high * inverse;
    T p{}, e{};
    multiply(first, b.high, p, e);
    const T rest = ((a.high - p) - e) + (a.low - first * b.low);
    return joined<X>(first, rest * inverse);
}
// A. H. Karp and P. Markstein 1997. `root`: of a.high.
template <class X, class T>
LOBATTO_INLINE constexpr X square_root(const X& a, const T& root) {
    T p{}, e{};
    multiply(root, root, p, e);
    const T rest = ((a.high - p) - e) + a.low;
    return joined<X>(root, rest / (root + root));
}

template <class X>
using Truth = decltype(typename X::Part() < typename X::Part());

// The operators of X. Friends, so that plain numbers turn into X by themselves.
template <class X>
struct Operators {
    LOBATTO_INLINE friend constexpr X operator-(const X& a) { return X(-a.high, -a.low); }
    LOBATTO_INLINE friend constexpr X operator+(const X& a, const X& b) { return sum(a, b); }
    LOBATTO_INLINE friend constexpr X operator-(const X& a, const X& b) { return sum(a, -b); }
    LOBATTO_INLINE friend constexpr X operator*(const X& a, const X& b) { return product(a, b); }
    LOBATTO_INLINE friend constexpr X operator/(const X& a, const X& b) { return quotient(a, b); }
    LOBATTO_INLINE friend constexpr X& operator+=(X& a, const X& b) { return a = a + b; }
    LOBATTO_INLINE friend constexpr X& operator-=(X& a, const X& b) { return a = a - b; }
    LOBATTO_INLINE friend constexpr X& operator*=(X& a, const X& b) { return a = a * b; }
    LOBATTO_INLINE friend constexpr X& operator/=(X& a, const X& b) { return a = a / b; }
    LOBATTO_INLINE friend constexpr auto operator<(const X& a, const X& b) {
        return Truth<X>((a.high < b.high) | ((a.high == b.high) & (a.low < b.low)));
    }
    LOBATTO_INLINE friend constexpr auto operator<=(const X& a, const X& b) {
        return Truth<X>((a.high < b.high) | ((a.high == b.high) & (a.low <= b.low)));
    }
    LOBATTO_INLINE friend constexpr auto operator>(const X& a, const X& b) { return b < a; }
    LOBATTO_INLINE friend constexpr auto operator>=(const X& a, const X& b) { return b <= a; }
    LOBATTO_INLINE friend constexpr auto operator==(const X& a, const X& b) {
        return Truth<X>((a.high == b.high) & (a.low == b.low));
    }
    LOBATTO_INLINE friend constexpr auto operator!=(const X& a, const X& b) {
        return Truth<X>((a.high != b.high) | (a.low != b.low));
    }
    // By a plain number: exact for powers of two, and cheaper.
    LOBATTO_INLINE friend constexpr X operator*(const X& a, double b) {
        return product_by_part(a, typename X::Part{} + b);
    }
    LOBATTO_INLINE friend constexpr X operator*(double a, const X& b) { return b * a; }
};

}  // namespace two_fold

struct DoubleDouble : two_fold::Operators<DoubleDouble> {
    using Part = double;
    double high, low;

    DoubleDouble() = default;
    LOBATTO_INLINE constexpr DoubleDouble(double h, double l) : high(h), low(l) {}
    template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
    LOBATTO_INLINE constexpr DoubleDouble(Number x) : high(static_cast<double>(x)), low(rest_of(x, high)) {}
    template <class Number, class = std::enable_if_t<!std::is_class_v<Number>>>
    LOBATTO_INLINE constexpr explicit operator Number() const {
        return static_cast<Number>(high) + static_cast<Number>(low);
    }

private:
    template <class Number>
    static constexpr double rest_of(Number x, double high) {
        if constexpr (std::is_floating_point_v<Number> && sizeof(Number) <= sizeof(double))
            return 0.0;
        else
            return static_cast<double>(x - static_cast<Number>(high));
    }
};

// Registers side by side: of the high parts, and of the low ones.
template <class T>
struct DoubleDoubles : two_fold::Operators<DoubleDoubles<T>> {
    using Part = T;
    T high, low;

    DoubleDoubles() = default;
    LOBATTO_INLINE DoubleDoubles(const T& h, const T& l) : high(h), low(l) {}
    // One register at a time, as Pack.
    LOBATTO_INLINE DoubleDoubles(const DoubleDoubles& other) : high(other.high), low(other.low) {}
    LOBATTO_INLINE DoubleDoubles& operator=(const DoubleDoubles& other) {
        high = other.high;
        low = other.low;
        return *this;
    }
};

template <int lanes>
struct Register<DoubleDouble, lanes> {
    using Doubles = typename Register<double, lanes>::Values;
    using Values = DoubleDoubles<Doubles>;
    using Truths = typename Register<double, lanes>::Truths;
    using Integers = void;
    using Naturals = void;
};
template <>
struct Register<DoubleDouble, 1> {
    using Values = DoubleDouble;
    using Truths = bool;
    using Integers = void;
    using Naturals = void;
};
template <>
inline constexpr int native_lanes<DoubleDouble> = native_lanes<double>;

template <>
struct Limits<DoubleDouble> {
    static constexpr DoubleDouble epsilon = DoubleDouble(0x1p-104, 0.0);
    static constexpr DoubleDouble smallest = DoubleDouble(0x1p-916, 0.0);
    static constexpr DoubleDouble largest = DoubleDouble(0x1p990, 0.0);  // products of larger ones may overflow inside
    static constexpr DoubleDouble root_epsilon = DoubleDouble(0x1p-52, 0.0);
};

// What Pack does with a register, for two of them.
template <int lanes>
struct RegisterOperations<DoubleDouble, lanes> {
    using Part = RegisterOperations<double, lanes>;
    using Values = typename Register<DoubleDouble, lanes>::Values;
    using Truths = typename Register<DoubleDouble, lanes>::Truths;

    LOBATTO_INLINE static Values spread(const DoubleDouble& x) { return {Part::spread(x.high), Part::spread(x.low)}; }
    LOBATTO_INLINE static DoubleDouble lane(const Values& values, int i) {
        return {Part::lane(values.high, i), Part::lane(values.low, i)};
    }
    LOBATTO_INLINE static void set(Values& values, int i, const DoubleDouble& x) {
        Part::set(values.high, i, x.high);
        Part::set(values.low, i, x.low);
    }
    LOBATTO_INLINE static Values load(const DoubleDouble* from) {
        Values values;
        for (int i = 0; i < lanes; ++i) set(values, i, from[i]);
        return values;
    }
    LOBATTO_INLINE static void store(const Values& values, DoubleDouble* to) {
        for (int i = 0; i < lanes; ++i) to[i] = lane(values, i);
    }
    LOBATTO_INLINE static Values choose(const Truths& where, const Values& a, const Values& b) {
        return {Part::choose(where, a.high, b.high), Part::choose(where, a.low, b.low)};
    }
    LOBATTO_INLINE static Values fused(const Values& a, const Values& b, const Values& c) {
        return two_fold::product_and_sum(a, b, c);
    }
    LOBATTO_INLINE static Values square_root(const Values& a) {
        const auto root = Part::square_root(a.high), zero = Part::spread(0.0);
        const Values value = two_fold::square_root(a, root);
        // Roots of zero and of infinity have no rest.
        const auto has_rest = Truths((root > zero) & (root <= Part::spread(std::numeric_limits<double>::max())));
        return {Part::choose(has_rest, value.high, root), Part::choose(has_rest, value.low, zero)};
    }
    LOBATTO_INLINE static Values magnitude(const Values& a) {
        const auto positive = a.high >= Part::spread(0.0);
        return {Part::magnitude(a.high), Part::choose(positive, a.low, -a.low)};
    }
    LOBATTO_INLINE static auto half(const Values& values, int which) {
        return typename Register<DoubleDouble, lanes / 2>::Values{Part::half(values.high, which),
                                                                  Part::half(values.low, which)};
    }
};

LOBATTO_INLINE DoubleDouble fused(const DoubleDouble& a, const DoubleDouble& b, const DoubleDouble& c) {
    return two_fold::product_and_sum(a, b, c);
}
LOBATTO_INLINE DoubleDouble fabs(const DoubleDouble& x) {
    return RegisterOperations<DoubleDouble, 1>::magnitude(x);
}
LOBATTO_INLINE DoubleDouble sqrt(const DoubleDouble& x) {
    return RegisterOperations<DoubleDouble, 1>::square_root(x);
}

// By a plain number: cheaper.
template <int width>
LOBATTO_INLINE Pack<DoubleDouble, width> operator*(double a, const Pack<DoubleDouble, width>& b) {
    using X = Pack<DoubleDouble, width>;
    constexpr int count = X::count;
    LOBATTO_PARTS(X, a * b.part[i]);
}
template <int width>
LOBATTO_INLINE Pack<DoubleDouble, width> operator*(const Pack<DoubleDouble, width>& a, double b) {
    return b * a;
}

// A number of an emitted formula, whose values may be asked for in double.
template <class T>
LOBATTO_INLINE constexpr real_of<T> literal(double high, double low) {
    if constexpr (std::is_same_v<real_of<T>, DoubleDouble>)
        return {high, low};
    else
        return static_cast<real_of<T>>(high);
}

// The parts of numbers in lanes, and back.
template <int width>
LOBATTO_INLINE Pack<double, width> high_part(const Pack<DoubleDouble, width>& x) {
    using P = Pack<double, width>;
    constexpr int count = P::count;
    LOBATTO_PARTS(P, x.part[i].high);
}
template <int width>
LOBATTO_INLINE Pack<double, width> low_part(const Pack<DoubleDouble, width>& x) {
    using P = Pack<double, width>;
    constexpr int count = P::count;
    LOBATTO_PARTS(P, x.part[i].low);
}
template <int width>
LOBATTO_INLINE Pack<DoubleDouble, width> of_parts(const Pack<double, width>& high, const Pack<double, width>& low) {
    using X = Pack<DoubleDouble, width>;
    constexpr int count = X::count;
    LOBATTO_PARTS(X, typename X::Part(high.part[i], low.part[i]));
}
template <int width>
LOBATTO_INLINE Pack<DoubleDouble, width> exact_sum(const Pack<double, width>& a, const Pack<double, width>& b) {
    using X = Pack<DoubleDouble, width>;
    constexpr int count = X::count;
    X result;
    LOBATTO_EACH(two_fold::add(a.part[i], b.part[i], result.part[i].high, result.part[i].low));
    return result;
}
template <int width>
LOBATTO_INLINE Pack<DoubleDouble, width> exact_product(const Pack<double, width>& a, const Pack<double, width>& b) {
    using X = Pack<DoubleDouble, width>;
    constexpr int count = X::count;
    X result;
    LOBATTO_EACH(two_fold::multiply(a.part[i], b.part[i], result.part[i].high, result.part[i].low));
    return result;
}
template <int width>
LOBATTO_INLINE Pack<DoubleDouble, width> accurate_sum(const Pack<DoubleDouble, width>& a,
                                                      const Pack<DoubleDouble, width>& b) {
    using X = Pack<DoubleDouble, width>;
    constexpr int count = X::count;
    LOBATTO_PARTS(X, two_fold::accurate_sum(a.part[i], b.part[i]));
}

}  // namespace lobatto

#endif
// Elementary functions of DoubleDouble, alone and in the lanes of Packs, to 31 digits (double_double_test.cpp
// measures).
//
// Series after a reduction of the argument, or one Newton step from the function of doubles. A function is called, not
// put in place: it is a few hundred operations long. Where a double's function is infinite or not a number, so is this.
#ifndef LOBATTO_KERNEL_DOUBLE_DOUBLE_FUNCTIONS_HPP
#define LOBATTO_KERNEL_DOUBLE_DOUBLE_FUNCTIONS_HPP

#include <cstdint>

#define LOBATTO_CALLED [[gnu::noinline]] inline

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
constexpr ReciprocalFactorials reciprocal_factorial{};

// x^first / first! + x^(first + by) / (first + by)! + ..., over x^first: `exact` terms to 106 bits, the others, which
// are below 2^-53 of the sum, to 53. `sign`: of each further term. z = x^by.
template <int first, int by, int exact, int others, int sign, int width>
LOBATTO_INLINE DoubleDoublePack<width> series(const DoubleDoublePack<width>& z) {
    using P = Doubles<width>;
    using X = DoubleDoublePack<width>;
    const auto& terms = reciprocal_factorial.values;
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
[[gnu::noinline, gnu::cold]] inline DoubleDouble power_beyond(const DoubleDouble& x, const DoubleDouble& y) {
    const double value = __builtin_pow(x.high, y.high);
    const bool is_whole = __builtin_rint(y.high) == y.high && __builtin_rint(y.low) == y.low;
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
constexpr DoubleDouble wide_half_pi(0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54);

// 2/pi in words of 64 bits, 1408 in all.
constexpr std::uint64_t two_over_pi[] = {0xa2f9836e4e441529, 0xfc2757d1f534ddc0, 0xdb6295993c439041, 0xfe5163abdebbc561,
                                         0xb7246e3a424dd2e0, 0x06492eea09d1921c, 0xfe1deb1cb129a73e, 0xe88235f52ebb4484,
                                         0xe99c7026b45f7e41, 0x3991d639835339f4, 0x9c845f8bbdf9283b, 0x1ff897ffde05980f,
                                         0xef2f118b5a0a6d1f, 0x6d367ecf27cb09b7, 0x4f463f669e5fea2d, 0x7527bac7ebe5f17b,
                                         0x3d0739f78a5292ea, 0x6bfb5fb11f8d5d08, 0x56033046fc7b6bab, 0xf0cfbc209af4361d,
                                         0xa9e391615ee61b08, 0x6599855f14a06840};

// turns += x 2/pi modulo 4, in units of 2^-256: five words, the last one of whole quarters (M. Payne and R. Hanek
// 1983).
[[gnu::noinline, gnu::cold]] inline void add_quarters(double x, std::uint64_t* turns) {
    int exponent = 0;
    const double fraction = __builtin_frexp(__builtin_fabs(x), &exponent);
    const auto m = static_cast<std::uint64_t>(fraction * 0x1p53);
    exponent -= 53;  // |x| = m 2^exponent
    // Word i of 2/pi 2^exponent modulo 2^64, in units of 2^-256; bit 0 of word 0 is bit 256 + exponent of 2/pi.
    const auto word_at = [](int bit) {  // 64 bits of 2/pi, the last of them number `bit` after the point
        std::uint64_t word = 0;
        const int first = bit - 64;  // bits first + 1 ... bit
        for (int part = 0; part < 2; ++part) {
            const int index = (first >= 0 ? first / 64 : -((63 - first) / 64)) + part,
                      shift = first - (index - part) * 64;
            const std::uint64_t value = index >= 0 && index < 22 ? two_over_pi[index] : 0;
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
[[gnu::noinline, gnu::cold]] inline DoubleDouble reduced_far(const DoubleDouble& x, std::int64_t& quadrant) {
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
    return wide_half_pi * two_fold::accurate_sum(part, fraction);
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
    [[gnu::noinline, gnu::cold]] void leave(const DoubleDoublePack<width>& x, DoubleDoublePack<width>& r) {
        double shifted[width];
        from_bits(quadrant).store(shifted);
        for (int lane = 0; lane < width; ++lane) {
            const DoubleDouble here = x[lane];
            if (__builtin_fabs(here.high) < wide_reduced_below) continue;
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
    const X quarter = select(x < 0.0, X(-functions::wide_half_pi), X(functions::wide_half_pi));
    const X value = functions::chosen(far, accurate_sum(quarter, -near), near);
    return functions::where(high == high, value, high);
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
LOBATTO_INLINE void sincos(const DoubleDouble& x, DoubleDouble& sine, DoubleDouble& cosine) {
    Pack<DoubleDouble, 1> one_sine, one_cosine;
    sincos(Pack<DoubleDouble, 1>(x), one_sine, one_cosine);
    sine = one_sine[0];
    cosine = one_cosine[0];
}

}  // namespace lobatto

#undef LOBATTO_CALLED

#endif
// Sines and cosines of a formula's angles from those of angles near them, without reduction of the argument.
//
// By the addition theorems, with delta = x - x0,
//     sin x = sin x0 + (cos x0 sin delta + sin x0 (cos delta - 1)),
//     cos x = cos x0 + (cos x0 (cos delta - 1) - sin x0 sin delta),
// where |delta| <= pi/4, which is as far as the polynomials of base/trigonometry.hpp reach. The error is absolute:
// below 2.1 units of 2^-53 (tests/runtime/kernel/vector_functions_test.cpp). A function of a kernel that holds `angles`
// of them (node or stage, see base/contract.hpp) asks its last argument for each, by its number: AnglesAnew, AnglesKept
// or AnglesNear.
#ifndef LOBATTO_KERNEL_ANGLES_HPP
#define LOBATTO_KERNEL_ANGLES_HPP

namespace lobatto {

// By the full functions.
struct AnglesAnew {
    template <class T>
    LOBATTO_INLINE void sincos(int, const T& x, T& sine, T& cosine) const {
        lobatto::sincos(x, sine, cosine);
    }
};

template <class T>
struct Angle {
    T x, sine, cosine;
};

// By the full functions; what they gave is kept.
template <class T>
struct AnglesKept {
    Angle<T>* angles;

    LOBATTO_INLINE void sincos(int i, const T& x, T& sine, T& cosine) const {
        lobatto::sincos(x, sine, cosine);
        angles[i] = {x, sine, cosine};
    }
};

namespace functions {

constexpr double near_below = 0.7853981633974483;  // pi/4

// x, in the lanes that are too far from `angle`, takes its place there.
template <class T>
[[gnu::noinline, gnu::cold]] void recentre(Angle<T>& angle, const T& x) {
    const auto near = fabs(x - angle.x) <= near_below;  // not where one of them is not a number
    T sine, cosine;
    lobatto::sincos(x, sine, cosine);
    angle.x = select(near, angle.x, x);
    angle.sine = select(near, angle.sine, sine);
    angle.cosine = select(near, angle.cosine, cosine);
}

// The sine and cosine of x0 + delta from those of x0.
template <int width>
LOBATTO_INLINE void turn(const Doubles<width>& delta, const Doubles<width>& sine0, const Doubles<width>& cosine0,
                         Doubles<width>& sine, Doubles<width>& cosine) {
    using P = Doubles<width>;
    const P z = delta * delta;
    const P z2 = z * z;
    const P rise = fused(-(z * delta), sine_series(z, z2), delta);  // sin delta
    const P fall = fused(z2, cosine_series(z, z2), z * -0.5);       // cos delta - 1
    sine = sine0 + fused(cosine0, rise, sine0 * fall);
    cosine = cosine0 + fused(-sine0, rise, cosine0 * fall);
}

}  // namespace functions

// From the angles kept, T = Pack<double, width>; where one is beyond pi/4, its place is taken.
template <class T>
struct AnglesNear {
    Angle<T>* angles;

    LOBATTO_INLINE void sincos(int number, const T& x, T& sine, T& cosine) const {
        Angle<T>& near = angles[number];
        T delta = x - near.x;
        if (__builtin_expect(!all(fabs(delta) <= functions::near_below), 0)) {
            functions::recentre(near, x);
            delta = x - near.x;
        }
        using functions::single;
        constexpr int count = T::count;
        Pack<double, T::lanes> one_sine, one_cosine;
        LOBATTO_EACH(
            functions::turn(single(delta, i), single(near.sine, i), single(near.cosine, i), one_sine, one_cosine),
            sine.part[i] = one_sine.part[0], cosine.part[i] = one_cosine.part[0]);
    }
};

// Room for the `count` angles of each of `places`: none where there are none.
template <class T, int places, int count>
struct AngleTable {
    Angle<T> angles[places * count];

    Angle<T>* of(int place) { return angles + place * count; }
};
template <class T, int places>
struct AngleTable<T, places, 0> {};

}  // namespace lobatto

#endif
// entry_row and entry_column of a kernel (contract.hpp) whose matrix has no zeros and is too large for tables.
#ifndef LOBATTO_KERNEL_FULL_MATRIX_HPP
#define LOBATTO_KERNEL_FULL_MATRIX_HPP

namespace lobatto {

// Entries row by row.
template <int columns>
struct RowOfFull {
    constexpr int operator[](int entry) const { return entry / columns; }
};

template <int columns>
struct ColumnOfFull {
    constexpr int operator[](int entry) const { return entry % columns; }
};

}  // namespace lobatto

#endif
// What an emitted kernel K provides: static functions, the formulas of one scene, and constants (concept.hpp checks).
//
// Every kernel: real; name, digest, method; coordinates (n), order, parameter_count, Parameters, parameter();
// Coefficients, prepare(); form; and these claims, all constexpr:
//   autonomous   no formula depends on time; otherwise `real time` follows `k` in every function that takes `k` and q
//   linear       the second derivatives are constant, so that one correction solves a step
//   has_energy, has_tangent   whether energies and tangent maps are compiled
//   events       how many; event(k, q, velocity, value) gives all their values, event_direction[] is 1 for rising, -1
//                for falling, 0 for both. More of them: steppers/events.hpp
// Form::linear_map and Form::separable: is_explicit; of splitting methods they have c, b and drift_length[s - 1], the
//   way between nodes, and neither A nor E nor what orders unknowns.
// Form::linear_map: energy(k, q, p), momentum(k, velocity, p), velocity(k, p, velocity), minus_acceleration(k, q, W),
//   node(k, q, W, S), propagate(k, q, p, q1, p1).
// Form::separable: the first five of these; points (s, both ends included), c, b, A (interior); entries, entry_row,
//   entry_column of S; unknowns, N = n (s - 2); E[(s - 2) * s] extrapolates (D15); the tables of base/solve.hpp order
//   the unknowns; `neighbours` says that acceleration can go SideBySide (base/rows.hpp; with row_reach, how far its
//   rows reach, immediate, that it can go Immediate, and unit_masses), and `absorbed` says that quadratic_part(k, S0)
//   gives a constant part of S to iterate with; `clean` that steps are those of steppers/clean.hpp. Gauss's nodes stand
//   between two ends of weight zero. `diagonal_part`: the constant part of S, from quadratic_part, is diagonal, D, and
//   taken into the stage map; `has_remainder`: remainder(k, q, R) gives W - D q.
// Form::general: see steppers/general.hpp. `clocked` says that its Lagrangian is one in the time tau of a clock,
//   clock(k, q) = dt/dtau (steppers/clocked.hpp). `constraints` says how many constraints phi(q, t) = 0 there are;
//   constraint(k, q, phi, phi_t, G) gives them, dphi/dt at fixed q, and the constraint_entries of G = dphi/dq;
//   multiplier_terms(k, q, velocity, r, s) what multipliers follow from; `constant_mass` that M is constant and forces
//   hold no velocity. `angles`: how many sines and cosines `stage` takes as a last argument (base/angles.hpp).
#ifndef LOBATTO_KERNEL_CONTRACT_HPP
#define LOBATTO_KERNEL_CONTRACT_HPP

#include <cstdint>
#include <type_traits>
#include <utility>

namespace lobatto {

// The outcome of preparing or stepping; the same values as lobatto_status in abi.h.
enum class Status : std::int32_t {
    ok = 0,
    not_converged = 1,
    not_finite = 2,
    singular_jacobian = 3,
    singular_mass = 4,
    time_stands_still = 5,
    unsupported = 6,
    off_constraints = 9,
    stopped = 11,
    impacts_accumulate = 12
};

// The same values as lobatto_form in abi.h.
enum class Form : std::int32_t { linear_map = 0, separable = 1, general = 2 };

// K's functions with a time for all of them: it is passed on where the kernel depends on it.
#define LOBATTO_WITH_TIME(name)                                                                 \
    template <class Given, class Time, class... Rest>                                           \
    LOBATTO_INLINE static auto name(const Given& k, [[maybe_unused]] Time time, Rest... rest) { \
        if constexpr (K::autonomous)                                                            \
            return K::name(k, rest...);                                                         \
        else                                                                                    \
            return K::name(k, time, rest...);                                                   \
    }
template <class K>
struct Formulas {
    LOBATTO_WITH_TIME(node)
    LOBATTO_WITH_TIME(minus_acceleration)
    LOBATTO_WITH_TIME(remainder)
    LOBATTO_WITH_TIME(slope)
    LOBATTO_WITH_TIME(slopes)
    LOBATTO_WITH_TIME(stage)
    LOBATTO_WITH_TIME(legendre)
    LOBATTO_WITH_TIME(momentum)  // of Form::general
    LOBATTO_WITH_TIME(event)
    LOBATTO_WITH_TIME(impact)
    LOBATTO_WITH_TIME(reset)
    LOBATTO_WITH_TIME(energy)
    LOBATTO_WITH_TIME(clock)
    LOBATTO_WITH_TIME(constraint)
    LOBATTO_WITH_TIME(multiplier_terms)
    // Along rows of coordinates, in the way How (base/rows.hpp).
    template <class How, class Given, class Time, class Position, class Slope>
    LOBATTO_INLINE static void along_rows(const Given& k, [[maybe_unused]] Time time, Position position, Slope slope) {
        if constexpr (K::autonomous)
            K::template minus_acceleration<How>(k, position, slope);
        else
            K::template minus_acceleration<How>(k, time, position, slope);
    }
};
#undef LOBATTO_WITH_TIME

// How steps are taken: the equations of inner nodes solved, round-off-clean (steppers/clean.hpp), kicks and drifts in
// turn (steppers/splitting.hpp), equally long in the time of a clock (steppers/clocked.hpp).
enum class Stepping { solved, clean, composition, clocked };
template <class K>
constexpr Stepping stepping_of() {
    if constexpr (K::form == Form::separable)
        return K::clean ? Stepping::clean : K::is_explicit ? Stepping::composition : Stepping::solved;
    else if constexpr (K::form == Form::general)
        return K::clocked ? Stepping::clocked : Stepping::solved;
    else
        return Stepping::solved;
}
template <class K>
constexpr bool is_clean() {
    return stepping_of<K>() == Stepping::clean;
}

template <class K>
constexpr bool is_clocked() {
    return stepping_of<K>() == Stepping::clocked;
}

// Systems with constant mass have none: what pulls on coordinates is of the general form.
template <class K>
constexpr int constraints_of() {
    if constexpr (K::form == Form::general)
        return K::constraints;
    else
        return 0;
}

// Whether a coordinate may move as soon as its acceleration is known.
template <class K>
constexpr bool moves_immediately() {
    if constexpr (K::neighbours && stepping_of<K>() == Stepping::composition)
        return K::immediate;
    else
        return false;
}

// The most coordinates whose mass matrix is treated as a full one.
constexpr int most_full = 16;

// Zero when all are finite, not a number otherwise.
template <class real>
inline real not_finite_part(const real* x, int count) {
    real sum = real(0);
    for (int i = 0; i < count; ++i) sum += x[i] - x[i];
    return sum;
}

// What the steppers of all forms carry.
template <class K>
struct Motion {
    using real = typename K::real;
    static constexpr int n = K::coordinates;
    static constexpr int event_room = K::events > 0 ? K::events : 1;

    typename K::Coefficients coefficients{};  // values of parameters and step size
    real step_size{};                         // h
    real start_time{};
    std::int64_t steps{};             // since start: the time is start_time + steps * h
    real tolerance{};                 // of increments, relative; the iteration of a step ends there, or at rounding
    real q[n]{};                      // position
    std::int32_t iterations{};        // of the last step
    real increment{};                 // last increment that was measured, relative to the displacement of its step
    real event_values[event_room]{};  // the last of each that was not zero (steppers/events.hpp)

    real time() const { return start_time + real(steps) * step_size; }
    real next_time() const { return start_time + real(steps + 1) * step_size; }
    bool time_stands_still() const { return next_time() == time(); }

    // One step of `local`, a copy of this stepper, from (q, p) at `time` to (q1, p1).
    template <class S>
    static Status step_from(S& local, real time, const real* position, const real* momentum, real* q1, real* p1) {
        Status status = local.start(time, position, momentum);
        if (status == Status::ok) status = local.step();
        if (status != Status::ok) return status;
        for (int k = 0; k < n; ++k) q1[k] = local.q[k];
        local.momentum(p1);
        return status;
    }
};

// One trajectory of kernel K. Usage: prepare, start, then step as often as wanted. Not thread-safe; copy freely. A step
// that fails leaves the state of the last good one.
template <class K, Form form = K::form, Stepping stepping = stepping_of<K>()>
struct Stepper;

// K for a trajectory that leaves the lanes for a step: by Newton's iteration, so that no other is compiled.
template <class K>
struct NewtonOnly : K {
    static constexpr bool any_number = false;
};
template <class K>
using FallbackKernel = std::conditional_t<stepping_of<K>() == Stepping::composition, K, NewtonOnly<K>>;
template <class K>
using ScalarFallback = Stepper<FallbackKernel<K>>;

// Fixed-point iteration along the nodes (iteration/fixed_point.hpp), or along coordinates (iteration/neighbours.hpp).
template <class K, bool neighbours>
struct FixedPointOf;

// How the lanes of each form move by one step: start(single, p, lane) takes the state of a Stepper over, step(k, time,
// active) moves the active lanes, and answers which have moved; position(c) and momentum(single, lane, p) read.
template <class K, class T, Form form = K::form, Stepping stepping = stepping_of<K>()>
struct LaneStepper;

// A system with constant mass, whose velocity is kept beside its position.
template <class K>
struct ConstantMass : Motion<K> {
    using typename Motion<K>::real;
    using Motion<K>::n, Motion<K>::coefficients;
    real u[n]{};  // M^-1 p

    // Begins at (q, p); W: M^-1 grad V there.
    Status begin(real time, const real* position, const real* momentum, real* W) {
        this->start_time = time;
        this->steps = 0;
        for (int k = 0; k < n; ++k) this->q[k] = position[k];
        K::velocity(coefficients, momentum, u);
        Formulas<K>::minus_acceleration(coefficients, time, static_cast<const real*>(this->q), W);
        if constexpr (K::events > 0) Formulas<K>::event(coefficients, time, this->q, u, this->event_values);
        const real sum = time + not_finite_part(position, n) + not_finite_part(momentum, n) + not_finite_part(W, n);
        return is_finite(sum) ? Status::ok : Status::not_finite;
    }

    void momentum(real* p) const { K::momentum(coefficients, u, p); }
    Status energy(real time, const real* position, const real* momentum, real* value) const {
        if constexpr (K::has_energy) {
            *value = Formulas<K>::energy(coefficients, time, position, momentum);
            return Status::ok;
        } else {
            (void)time, (void)position, (void)momentum, (void)value;
            return Status::unsupported;
        }
    }
    void momentum(real, const real*, const real* velocity, real* momentum) const {
        K::momentum(coefficients, velocity, momentum);
    }
    Status velocity(real, const real*, const real* momentum, real* velocity) const {
        K::velocity(coefficients, momentum, velocity);
        return Status::ok;
    }
    // dL/dv = M v and dL/dq + F = -M W.
    void slopes(real time, const real* position, const real* velocity, real* Lv, real* Lq) const {
        real W[n];
        Formulas<K>::minus_acceleration(coefficients, time, position, +W);
        for (int k = 0; k < n; ++k) W[k] = -W[k];
        K::momentum(coefficients, velocity, Lv);
        K::momentum(coefficients, static_cast<const real*>(W), Lq);
    }
};

// When to try iterations: at once; after they failed, 1, 2, 4, ... 64 steps later, which Newton's iteration takes.
struct Pause {
    std::int32_t left{};   // steps
    std::int32_t next{1};  // how many, the next time that iterations fail

    // Once a step: whether the pause is over with it.
    bool count_down() { return left == 0 || --left == 0; }
    void succeed() { next = 1; }
    void fail() {
        left = next;
        next = next < 64 ? 2 * next : 64;
    }
};

// Room for a step's arrays: on the stack while they are few, else in the stepper. In line, so that they are registers
// where there are enough, and what the step refers to need not lie in memory for a call.
template <class Arrays>
struct Workspace {
    struct Nothing {};
    static constexpr bool is_large = sizeof(Arrays) > 16384;
    mutable std::conditional_t<is_large, Arrays, Nothing> kept{};

    template <class Use>
    LOBATTO_INLINE auto with(const Use& use) const {
        if constexpr (is_large) {
            return use(kept);
        } else {
            Arrays local;
            return use(local);
        }
    }
};

// Lagrange's polynomials over the points, l_j(theta) and l_j'(theta).
template <int count, class real>
constexpr void lagrange(const real* points, real theta, real* value, real* slope) {
    for (int j = 0; j < count; ++j) {
        value[j] = real(1);
        slope[j] = real(0);
        for (int l = 0; l < count; ++l) {
            if (l == j) continue;
            const real scale = real(1) / (points[j] - points[l]);
            slope[j] = (slope[j] * (theta - points[l]) + value[j]) * scale;
            value[j] *= (theta - points[l]) * scale;
        }
    }
}

}  // namespace lobatto

#endif
// Linear equations: small dense ones, and those of the stages, in independent groups, each banded or dense.
#ifndef LOBATTO_KERNEL_SOLVE_HPP
#define LOBATTO_KERNEL_SOLVE_HPP

#include <cstdint>
#include <type_traits>

namespace lobatto {

// Of a pivot, or of a determinant: neither it nor its reciprocal is zero, infinite or not a number.
template <class real>
inline bool is_reciprocal(real inverse) {
    return is_finite(inverse) && inverse != real(0);
}

// A X = B with A of size x size and B of size x columns, both row-major and overwritten; X ends in B. Gaussian
// elimination with partial pivoting. False when a pivot is zero or not finite.
template <int size, int columns, class real>
inline bool solve(real* A, real* B) {
    for (int k = 0; k < size; ++k) {
        int pivot = k;
        for (int i = k + 1; i < size; ++i) {
            if (fabs(A[i * size + k]) > fabs(A[pivot * size + k])) pivot = i;
        }
        if (pivot != k) {
            for (int j = k; j < size; ++j) {
                const real swapped = A[k * size + j];
                A[k * size + j] = A[pivot * size + j];
                A[pivot * size + j] = swapped;
            }
            for (int j = 0; j < columns; ++j) {
                const real swapped = B[k * columns + j];
                B[k * columns + j] = B[pivot * columns + j];
                B[pivot * columns + j] = swapped;
            }
        }
        const real inverse = real(1) / A[k * size + k];
        if (!is_reciprocal(inverse)) return false;
        for (int i = k + 1; i < size; ++i) {
            const real factor = A[i * size + k] * inverse;
            if (factor == real(0)) continue;
            for (int j = k + 1; j < size; ++j) A[i * size + j] -= factor * A[k * size + j];
            for (int j = 0; j < columns; ++j) B[i * columns + j] -= factor * B[k * columns + j];
        }
    }
    for (int k = size - 1; k >= 0; --k) {
        for (int j = 0; j < columns; ++j) {
            real sum = B[k * columns + j];
            for (int i = k + 1; i < size; ++i) sum -= A[k * size + i] * B[i * columns + j];
            B[k * columns + j] = sum / A[k * size + k];
        }
    }
    return true;
}

// LU factors with partial pivoting, in place, A row-major. The inverses of the pivots stand on the diagonal, the
// multipliers where elimination left them, rows are exchanged from the pivot's column on. False when a pivot is zero or
// not finite. `size` is an integer, or a std::integral_constant where the compiler may unroll.
template <class real, class Size>
inline bool factor_dense(real* A, std::int32_t* pivots, Size size) {
    for (int k = 0; k < size; ++k) {
        int pivot = k;
        real largest = fabs(A[k * size + k]);
        for (int i = k + 1; i < size; ++i) {
            const real candidate = fabs(A[i * size + k]);
            if (candidate > largest) {
                largest = candidate;
                pivot = i;
            }
        }
        pivots[k] = pivot;
        if (pivot != k) {
            for (int j = k; j < size; ++j) {
                const real swapped = A[k * size + j];
                A[k * size + j] = A[pivot * size + j];
                A[pivot * size + j] = swapped;
            }
        }
        const real inverse = real(1) / A[k * size + k];
        if (!is_reciprocal(inverse)) return false;
        A[k * size + k] = inverse;
        for (int i = k + 1; i < size; ++i) {
            const real factor = A[i * size + k] * inverse;
            A[i * size + k] = factor;
            for (int j = k + 1; j < size; ++j) A[i * size + j] -= factor * A[k * size + j];
        }
    }
    return true;
}

template <class real, class Size>
inline void solve_dense(const real* LU, const std::int32_t* pivots, real* x, Size size) {
    for (int k = 0; k < size; ++k) {
        const real head = x[pivots[k]];
        x[pivots[k]] = x[k];
        x[k] = head;
        for (int i = k + 1; i < size; ++i) x[i] -= LU[i * size + k] * head;
    }
    for (int k = size - 1; k >= 0; --k) {
        x[k] *= LU[k * size + k];
        for (int i = 0; i < k; ++i) x[i] -= LU[i * size + k] * x[k];
    }
}

// The same for a matrix with `band` diagonals on either side. Row i holds the columns i - band ... i + 2 band, the last
// `band` of them for what exchanges of rows bring in; entries outside the matrix are not touched.
template <class real, class Size, class Band>
inline bool factor_band(real* A, std::int32_t* pivots, Size size, Band band) {
    const int width = 3 * band + 1;
    int reach = 0;  // the last column that row k has entries in
    for (int k = 0; k < size; ++k) {
        const int last = k + band < size ? k + band : size - 1;
        real* const row = A + k * width + band - k;  // row[j] is A_kj
        int pivot = k;
        real largest = fabs(row[k]);
        for (int i = k + 1; i <= last; ++i) {
            const real candidate = fabs(A[i * width + k - i + band]);
            if (candidate > largest) {
                largest = candidate;
                pivot = i;
            }
        }
        pivots[k] = pivot;
        if (pivot + band > reach) reach = pivot + band < size ? pivot + band : size - 1;
        if (pivot != k) {
            real* const other = A + pivot * width + band - pivot;
            for (int j = k; j <= reach; ++j) {
                const real swapped = row[j];
                row[j] = other[j];
                other[j] = swapped;
            }
        }
        const real inverse = real(1) / row[k];
        if (!is_reciprocal(inverse)) return false;
        row[k] = inverse;
        for (int i = k + 1; i <= last; ++i) {
            real* const below = A + i * width + band - i;
            const real factor = below[k] * inverse;
            below[k] = factor;
            if (factor == real(0)) continue;
            for (int j = k + 1; j <= reach; ++j) below[j] -= factor * row[j];
        }
    }
    return true;
}

template <class real, class Size, class Band>
inline void solve_band(const real* LU, const std::int32_t* pivots, real* x, Size size, Band band) {
    const int width = 3 * band + 1;
    for (int k = 0; k < size; ++k) {
        const int last = k + band < size ? k + band : size - 1;
        const real head = x[pivots[k]];
        x[pivots[k]] = x[k];
        x[k] = head;
        for (int i = k + 1; i <= last; ++i) x[i] -= LU[i * width + k - i + band] * head;
    }
    for (int k = size - 1; k >= 0; --k) {
        const int last = k + 2 * band < size ? k + 2 * band : size - 1;
        const real* const row = LU + k * width + band - k;
        real sum = x[k];
        for (int j = k + 1; j <= last; ++j) sum -= row[j] * x[j];
        x[k] = sum * row[k];
    }
}

// How the unknowns of the stages lie: `per` of each block (an active coordinate) side by side, the blocks in the
// kernel's order, and `extra` single ones last, which couple to all and make it one dense group. The kernel's tables:
//   position[a]           place of coordinate a in the order
//   group_count, group_first[group_count + 1]   independent groups, as ranges of places
//   group_bandwidth[g]    the largest distance between the places of two coupled coordinates
template <class K, int blocks_, int per_, int extra>
struct Grouped {
    static constexpr int blocks = blocks_, per = per_, size = blocks * per + extra;
    static constexpr int groups = extra > 0 ? 1 : K::group_count;
    static constexpr int first(int group) { return extra > 0 ? 0 : K::group_first[group] * per; }
    static constexpr int count(int group) {
        return extra > 0 ? size : (K::group_first[group + 1] - K::group_first[group]) * per;
    }
    static constexpr int band(int group) { return extra > 0 ? size : K::group_bandwidth[group] * per + per - 1; }
    // The unknown j of block u; the extra ones are blocks of one.
    static constexpr int index(int u, int j) {
        return (u < blocks ? K::position[u] * per : blocks * (per - 1) + u) + j;
    }
};

// One dense group without an order.
template <int size_>
struct Whole {
    static constexpr int blocks = size_, per = 1, size = size_, groups = 1;
    static constexpr int first(int) { return 0; }
    static constexpr int count(int) { return size; }
    static constexpr int band(int) { return size; }
    static constexpr int index(int u, int) { return u; }
};

template <class Layout>
constexpr bool group_is_dense(int group) {
    return 3 * Layout::band(group) >= Layout::count(group);
}

// Where the block rows begin in memory: entry (u, j; column) at corner[u] + j * stride[u] + column.
template <class Layout>
struct Places {
    int corner[Layout::blocks > 0 ? Layout::blocks : 1]{}, stride[Layout::blocks > 0 ? Layout::blocks : 1]{};
    int offset[Layout::groups + 1]{};  // of the groups' storage
    constexpr Places() {
        for (int g = 0; g < Layout::groups; ++g)
            offset[g + 1] =
                offset[g] + Layout::count(g) * (group_is_dense<Layout>(g) ? Layout::count(g) : 3 * Layout::band(g) + 1);
        for (int u = 0; u < Layout::blocks; ++u) {
            const int row = Layout::index(u, 0);
            int g = 0, beyond = Layout::groups;
            while (beyond - g > 1) {
                const int middle = (g + beyond) / 2;
                (Layout::first(middle) <= row ? g : beyond) = middle;
            }
            const int first = Layout::first(g), band = Layout::band(g);
            stride[u] = group_is_dense<Layout>(g) ? Layout::count(g) : 3 * band;
            corner[u] = offset[g] + (group_is_dense<Layout>(g) ? 0 : band) + (row - first) * stride[u] - first;
        }
    }
};
template <class Layout>
constexpr Places<Layout> places{};

// A matrix of such unknowns, then its factors.
template <class real, class Layout>
struct GroupedMatrix {
    static constexpr int size = Layout::size;
    static constexpr int storage = places<Layout>.offset[Layout::groups];
    real values[storage];
    std::int32_t pivots[size];

    void clear() {
        for (int i = 0; i < storage; ++i) values[i] = real(0);
    }
    // Row: unknown j of block u; column: unknown k of block v.
    real& operator()(int u, int j, int v, int k) {
        if constexpr (Layout::groups == 1 && group_is_dense<Layout>(0))
            return values[Layout::index(u, j) * size + Layout::index(v, k)];
        else
            return values[places<Layout>.corner[u] + j * places<Layout>.stride[u] + Layout::index(v, k)];
    }

    bool factor() {
        if constexpr (Layout::groups == 1) {
            constexpr std::integral_constant<int, size> all{};
            if constexpr (group_is_dense<Layout>(0))
                return factor_dense(values, pivots, all);
            else
                return factor_band(values, pivots, all, std::integral_constant<int, Layout::band(0)>{});
        } else {
            for (int g = 0; g < Layout::groups; ++g) {
                real* const A = values + places<Layout>.offset[g];
                std::int32_t* const exchanged = pivots + Layout::first(g);
                if (!(group_is_dense<Layout>(g) ? factor_dense(A, exchanged, Layout::count(g))
                                                : factor_band(A, exchanged, Layout::count(g), Layout::band(g))))
                    return false;
            }
            return true;
        }
    }

    // x becomes the solution.
    void solve(real* x) const {
        if constexpr (Layout::groups == 1) {
            constexpr std::integral_constant<int, size> all{};
            if constexpr (group_is_dense<Layout>(0))
                solve_dense(values, pivots, x, all);
            else
                solve_band(values, pivots, x, all, std::integral_constant<int, Layout::band(0)>{});
        } else {
            for (int g = 0; g < Layout::groups; ++g) {
                const real* const LU = values + places<Layout>.offset[g];
                const std::int32_t* const exchanged = pivots + Layout::first(g);
                if (group_is_dense<Layout>(g))
                    solve_dense(LU, exchanged, x + Layout::first(g), Layout::count(g));
                else
                    solve_band(LU, exchanged, x + Layout::first(g), Layout::count(g), Layout::band(g));
            }
        }
    }
};

}  // namespace lobatto

#endif
// Packs of neighbouring coordinates: shifts by lanes, parts of a pack, and a rough inverse.
#ifndef LOBATTO_KERNEL_SHIFTS_HPP
#define LOBATTO_KERNEL_SHIFTS_HPP

#include <utility>

namespace lobatto {

#if defined(__AVX512F__) && defined(__AVX512DQ__) && defined(__AVX512VL__) && !defined(__clang__)
namespace registers {

// g++ takes a general permutation, with its indices in a register, for what is a shift of two registers.
#define LOBATTO_SHIFTS 1
template <int places>
LOBATTO_INLINE Double8 moved_on(Double8 before, Double8 values) {
    return (Double8)__builtin_ia32_alignq512_mask((Long8)values, (Long8)before, 8 - places, (Long8)values,
                                                  static_cast<unsigned char>(-1));
}
template <int places>
LOBATTO_INLINE Float16 moved_on(Float16 before, Float16 values) {
    typedef int Int16 __attribute__((vector_size(64)));
    return (Float16)__builtin_ia32_alignd512_mask((Int16)values, (Int16)before, 16 - places, (Int16)values,
                                                  static_cast<unsigned short>(-1));
}

}  // namespace registers
#endif

// The last `places` lanes of `before` and then the first of `values`: a step of `places` to the right. One register.
template <int places, class real, int width, int... lanes>
LOBATTO_INLINE Pack<real, width> moved_on(const Pack<real, width>& before, const Pack<real, width>& values,
                                          std::integer_sequence<int, lanes...>) {
    Pack<real, width> result;
#ifdef LOBATTO_SHIFTS
    if constexpr (width * sizeof(real) == 64) {
        result.part[0] = registers::moved_on<places>(before.part[0], values.part[0]);
        return result;
    }
#endif
#if __has_builtin(__builtin_shufflevector)
    result.part[0] = __builtin_shufflevector(before.part[0], values.part[0], (width - places + lanes)...);
#else
    ((result.part[0][lanes] = lanes < places ? before.part[0][(width - places + lanes) % width]
                                             : values.part[0][(lanes - places + width) % width]),
     ...);
#endif
    return result;
}
template <int places, class real, int width>
LOBATTO_INLINE Pack<real, width> moved_on(const Pack<real, width>& before, const Pack<real, width>& values) {
    static_assert(places >= 0 && places <= width && Pack<real, width>::count == 1);
    if constexpr (places == 0)
        return values;
    else if constexpr (places == width)
        return before;
    else
        return moved_on<places>(before, values, std::make_integer_sequence<int, width>());
}

// x in one lane; zero in the others.
template <int lane, int width, class real>
LOBATTO_INLINE Pack<real, width> only_lane(real x) {
    Pack<real, width> result = Pack<real, width>(real(0));
    result.set(lane, x);
    return result;
}

// The first `count` lanes; zero in the others.
template <class real, int width, int... lanes>
LOBATTO_INLINE Pack<real, width> first_lanes(const Pack<real, width>& values, int count,
                                             std::integer_sequence<int, lanes...>) {
    const real numbers[width] = {real(lanes)...};
    return select(Pack<real, width>::load(numbers) < Pack<real, width>(real(count)), values,
                  Pack<real, width>(real(0)));
}
template <class real, int width>
LOBATTO_INLINE Pack<real, width> first_lanes(const Pack<real, width>& values, int count) {
    return first_lanes(values, count, std::make_integer_sequence<int, width>());
}

// 1/x for x from the smallest normal number to a quarter of the largest, within a seventh of it: the exponent with its
// sign changed, and the significand drawn as a line.
template <class real, int width>
LOBATTO_INLINE Pack<real, width> rough_inverse(const Pack<real, width>& x) {
    using Integer = typename Bits<real, width>::Integer;
    constexpr Integer line = sizeof(real) == 8 ? Integer(0x7fde623822fc16e6) : Integer(0x7ef311c7);
    return from_bits(Bits<real, width>(line) - bits(x));
}

// A Pack at a time.
template <int count, class real>
LOBATTO_INLINE void copy_lanes(const real* from, real* to) {
    using V = Pack<real, native_lanes<real>>;
    int i = 0;
    for (; i + lanes_of<V> <= count; i += lanes_of<V>) V::load(from + i).store(to + i);
    for (; i < count; ++i) to[i] = from[i];
}

}  // namespace lobatto

#endif
// Going through the rows of a repeated formula: one after another, or those of neighbouring coordinates side by side in
// the lanes of Packs, in memory or in registers.
//
// In lanes arrays of coordinates have room for room_of<K> numbers: whole Packs and two to spare, where formulas may
// read what does not matter and write zeros.
#ifndef LOBATTO_KERNEL_ROWS_HPP
#define LOBATTO_KERNEL_ROWS_HPP

#include <limits>
#include <type_traits>
#include <utility>

namespace lobatto {

// What an array of coordinates, a pointer or anything with [], holds.
template <class Array>
using element_of = std::decay_t<decltype(std::declval<const Array&>()[0])>;

// Rows of a repeated formula: its variables x, and what it gives for each, to be added to W, or taken away from it. V:
// a number, of one row; or, `in_lanes`, a Pack of `count` rows that follow one another from `row` on.
template <class V, int variables, bool in_lanes>
struct FormulaRows {
    V x[variables], result[variables]{};
    bool takes[variables]{};  // known to the compiler
    int row, count;

    // A coefficient, of which the table has one value a row.
    template <class number>
    LOBATTO_INLINE auto of(const number* table) const {
        if constexpr (!in_lanes) {
            return table[row];
        } else {
            if (count == lanes_of<V>) return V::load(table + row);
            number first[lanes_of<V>]{};
            for (int i = 0; i < count; ++i) first[i] = table[row + i];
            return V::load(first);
        }
    }
};

// Shorter runs of rows are not worth a Pack.
constexpr int long_run = 8;

// Where the ends of a chain are fixed: rows of two neighbours go on beyond its first coordinate, or its last, with zero
// in the place of the coordinate that is not there.
constexpr int free_ends = 0, fixed_before = 1, fixed_behind = 2;

// The coordinates of one node in registers, a Pack of neighbours each; beyond the last there are zeros.
template <class V, int parts>
struct Registers {
    using real = real_of<V>;
    V* part;

    LOBATTO_INLINE real operator[](int place) const { return part[place / lanes_of<V>][place % lanes_of<V>]; }
    LOBATTO_INLINE void add(int place, real x) const {
        V one = V(real(0));
        one.set(place % lanes_of<V>, x);
        part[place / lanes_of<V>] += one;
    }
};

// A V of an array of coordinates: those from `at` on, a multiple of V's lanes where they are in registers.
template <class V, class number>
LOBATTO_INLINE V load_from(const number* array, int at) {
    if constexpr (std::is_same_v<V, number>)
        return array[at];
    else
        return V::load(array + at);
}
template <class V, int parts>
LOBATTO_INLINE V load_from(Registers<V, parts> array, int at) {
    return at < parts * lanes_of<V> ? array.part[at / lanes_of<V>] : V(real_of<V>(0));
}
template <class V, class number>
LOBATTO_INLINE void store_to(number* array, int at, const V& value) {
    if constexpr (std::is_same_v<V, number>)
        array[at] = value;
    else
        value.store(array + at);
}
template <class V, int parts>
LOBATTO_INLINE void store_to(Registers<V, parts> array, int at, const V& value) {
    if (at < parts * lanes_of<V>) array.part[at / lanes_of<V>] = value;
}
template <class number>
LOBATTO_INLINE void add_to(number* array, int place, const number& x) {
    array[place] += x;
}
template <class V, int parts>
LOBATTO_INLINE void add_to(Registers<V, parts> array, int place, real_of<V> x) {
    array.add(place, x);
}
template <class Array>
constexpr bool are_registers = false;
template <class V, int parts>
constexpr bool are_registers<Registers<V, parts>> = true;

// f(0), f(width), ... up to `count`, which the compiler knows, each written out.
template <int width, class F>
LOBATTO_INLINE void written_out(int count, const F& f) {
#pragma GCC unroll 32
    for (int at = 0; at < count; at += width) f(at);
}

// Going through rows of formulas. `indices` has the `variables` of each row; a run is rows whose variables are those of
// the row before plus one. All runs of more than one row have the same distances between the variables of a row. With
// fixed ends there is one run, over all coordinates, of rows of two neighbours.
template <int variables, const auto& indices, int fixed_ends = free_ends>
struct RowLoop {
    // How far variable j is behind the first.
    static constexpr int least() {
        int first = indices[0];
        for (int j = 1; j < variables; ++j) first = indices[j] < first ? indices[j] : first;
        return first - indices[0];
    }
    static constexpr int offset(int j) { return indices[j] - indices[0] - least(); }
    static constexpr int farthest_within(int width) {
        int farthest = 0;
        for (int j = 0; j < variables; ++j)
            if (offset(j) <= width && offset(j) > farthest) farthest = offset(j);
        return farthest;
    }

    static constexpr int reach() { return farthest_within(std::numeric_limits<int>::max()); }

    // Adds to W (or sets it) what `count` rows from `begin` on give, as many at a time as V has lanes for them. What
    // variable j receives belongs offset(j) places behind what the first receives: those lanes move on from one V to
    // the next, so that each place of W is written once. Those that are far away are added where they belong.
    template <class V, bool adds, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void run(int begin, int count, Position q, Slope W, const Formula& formula) {
        using number = real_of<V>;
        constexpr bool in_lanes = !std::is_same_v<V, element_of<Position>>;
        constexpr int width = in_lanes ? lanes_of<V> : 1;
        constexpr std::make_integer_sequence<int, variables> every{};
        static_assert(fixed_ends == free_ends || (variables == 2 && offset(0) + offset(1) == 1));
        const int first = indices[begin * variables] + least();
        constexpr bool overlaps = farthest_within(width) > 0;  // what is loaded for one V serves the next too
        V before[variables], here = load_from<V>(q, first);
        bool takes[variables]{};
        for (int j = 0; j < variables; ++j) before[j] = V(number(0));
        if constexpr ((fixed_ends & fixed_before) != 0) before_first<V, in_lanes>(begin, here, formula, before);
        const auto add = [&](int r, auto is_whole) LOBATTO_FORMULA {
            const int at = first + r;
            FormulaRows<V, variables, in_lanes> rows;
            rows.row = begin + r;
            rows.count = is_whole ? width : count - r;
            if constexpr (!overlaps) here = load_from<V>(q, at);
            V there = here;
            if constexpr (overlaps) {
                // One by one, no zero stands behind the last coordinate.
                if constexpr (in_lanes || is_whole || (fixed_ends & fixed_behind) == 0)
                    there = load_from<V>(q, at + width);
                else
                    there = V(number(0));
            }
            each(every, [&](auto j) LOBATTO_FORMULA {
                if constexpr (offset(j) > width)
                    rows.x[j] = load_from<V>(q, at + offset(j));
                else
                    rows.x[j] = further<width, offset(j)>(here, there);
            });
            here = there;
            formula(rows);
            V sum = V(number(0));
            if constexpr (adds) sum = load_from<V>(W, at);
            each(every, [&](auto j) LOBATTO_FORMULA {
                V& result = rows.result[j];
                if constexpr (in_lanes) {
                    // The row at the fixed end gives to its first variable only.
                    constexpr bool is_end = (fixed_ends & fixed_behind) != 0 && offset(j) > 0;
                    if constexpr (!is_whole) result = first_lanes(result, count - (is_end ? 1 : 0) - r);
                }
                takes[j] = rows.takes[j];
                if constexpr (offset(j) > width)
                    store_to(W, at + offset(j), joined(load_from<V>(W, at + offset(j)), result, takes[j]));
                else if constexpr (!adds && j == 0)
                    sum = sign(passed_on<width, offset(j)>(before[j], result), takes[j]);
                else
                    sum = joined(sum, passed_on<width, offset(j)>(before[j], result), takes[j]);
                before[j] = result;
            });
            store_to(W, at, sum);
        };
        constexpr bool last_apart = !in_lanes && (fixed_ends & fixed_behind) != 0;
        const int whole = last_apart ? count - 1 : count / width * width;
        if constexpr (are_registers<Position>)
            written_out<width>(whole, [&](int r) LOBATTO_FORMULA { add(r, std::true_type()); });
        else
            for (int r = 0; r < whole; r += width) add(r, std::true_type());
        int behind = whole;
        if constexpr (in_lanes || last_apart) {
            if (whole < count) {
                add(whole, std::false_type());
                behind += width;
            }
        }
        if ((fixed_ends & fixed_behind) == 0 && behind < count + farthest_within(width)) {
            V sum = V(number(0));
            if constexpr (adds) sum = load_from<V>(W, first + behind);
            each(every, [&](auto j) LOBATTO_FORMULA {
                if constexpr (offset(j) > 0 && offset(j) <= width)
                    sum = joined(sum, passed_on<width, offset(j)>(before[j], V(number(0))), takes[j]);
            });
            store_to(W, first + behind, sum);
        }
    }

    template <class number, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void one_row(int row, Position q, Slope W, const Formula& formula) {
        FormulaRows<number, variables, false> one;
        one.row = row;
        one.count = 1;
        for (int j = 0; j < variables; ++j) one.x[j] = q[indices[row * variables + j]];
        formula(one);
        for (int j = 0; j < variables; ++j) add_to(W, indices[row * variables + j], sign(one.result[j], one.takes[j]));
    }

    // The rows at the fixed ends of a chain of `count` coordinates, by themselves.
    template <class number, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void end_rows(int count, Position q, Slope W, const Formula& formula) {
        const auto end_row = [&](int place, bool is_behind) LOBATTO_FORMULA {
            FormulaRows<number, variables, false> one;
            one.row = 0;
            one.count = 1;
            for (int j = 0; j < variables; ++j) one.x[j] = (offset(j) == 0) == is_behind ? q[place] : number(0);
            formula(one);
            for (int j = 0; j < variables; ++j)
                if ((offset(j) == 0) == is_behind) add_to(W, place, sign(one.result[j], one.takes[j]));
        };
        if constexpr ((fixed_ends & fixed_before) != 0) end_row(0, false);
        if constexpr ((fixed_ends & fixed_behind) != 0) end_row(count - 1, true);
    }

    // The one run, with the rows at the fixed ends where they are rows as others are.
    template <class V, bool adds, const auto& runs, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void entire(Position q, Slope W, const Formula& formula) {
        run<V, adds>(runs[0], runs[1] + ((fixed_ends & fixed_behind) != 0 ? 1 : 0), q, W, formula);
    }

    // All runs of `runs`, pairs (first row, how many).
    template <class V, const auto& runs, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void all(Position q, Slope W, const Formula& formula) {
        static_assert(fixed_ends == free_ends);
        constexpr int run_count = sizeof(runs) / sizeof(runs[0]) / 2;
        if constexpr (are_registers<Position>) {
            each(std::make_integer_sequence<int, run_count>(), [&](auto i) LOBATTO_FORMULA {
                constexpr int begin = runs[2 * decltype(i)::value], count = runs[2 * decltype(i)::value + 1];
                if constexpr (count >= long_run)
                    run<V, true>(begin, count, q, W, formula);
                else
                    written_out<1>(count,
                                   [&](int r) LOBATTO_FORMULA { one_row<real_of<V>>(begin + r, q, W, formula); });
            });
        } else {
            for (int i = 0; i < run_count; ++i) {
                const int begin = runs[2 * i], count = runs[2 * i + 1];
                if (count >= long_run)
                    run<V, true>(begin, count, q, W, formula);
                else
                    for (int row = begin; row < begin + count; ++row) one_row<element_of<Position>>(row, q, W, formula);
            }
        }
    }

private:
    // What the row at the fixed end before coordinate `here` gives, in the last lane.
    template <class V, bool in_lanes, class Formula>
    LOBATTO_INLINE static void before_first(int begin, const V& here, const Formula& formula, V* before) {
        using number = real_of<V>;
        constexpr int width = in_lanes ? lanes_of<V> : 1;
        FormulaRows<V, variables, in_lanes> rows;
        rows.row = begin;
        rows.count = width;
        for (int j = 0; j < variables; ++j)
            rows.x[j] = offset(j) == 0 ? V(number(0)) : passed_on<width, width - 1>(V(number(0)), here);
        formula(rows);
        for (int j = 0; j < variables; ++j) before[j] = rows.result[j];
    }
    template <class V>
    LOBATTO_INLINE static V sign(const V& given, bool takes) {
        return takes ? -given : given;
    }
    template <class V>
    LOBATTO_INLINE static V joined(const V& sum, const V& given, bool takes) {
        return takes ? sum - given : sum + given;
    }
    // f(0), f(1), ... of numbers known to the compiler.
    template <class F, int... numbers>
    LOBATTO_INLINE static void each(std::integer_sequence<int, numbers...>, const F& f) {
        (f(std::integral_constant<int, numbers>()), ...);
    }
    template <int width, int places, class V>
    LOBATTO_INLINE static V passed_on(const V& before, const V& values) {
        if constexpr (places == 0)
            return values;
        else if constexpr (places == width)
            return before;
        else
            return moved_on<places>(before, values);
    }
    // `places` further on than `here`, behind which `there` stands.
    template <int width, int places, class V>
    LOBATTO_INLINE static V further(const V& here, const V& there) {
        return passed_on<width, width - places>(here, there);
    }
};

// How an emitted kernel goes through its rows: one after another, for any type of number,
struct OneByOne {
    template <int count, class number>
    static void clear(number* W) {
        for (int i = 0; i < count; ++i) W[i] = number(0);
    }
    template <int count, class number, class Factor>
    static void scale(number* W, const Factor* factor) {
        for (int i = 0; i < count; ++i) W[i] *= factor[i];
    }
    template <int place, class number>
    static number& at(number* W) {
        return W[place];
    }
    // `runs`: pairs (first row, how many).
    template <int count, int variables, const auto& indices, const auto& runs, int fixed_ends = free_ends, class number,
              class Formula>
    LOBATTO_INLINE static void add_rows(const number* q, number* W, const Formula& formula) {
        RowLoop<variables, indices>::template all<number, runs>(q, W, formula);
        RowLoop<variables, indices, fixed_ends>::template end_rows<number>(count, q, W, formula);
    }
    // The same where the rows are one run that reaches all of W, of `count`, on which nothing stands yet.
    template <int count, int variables, const auto& indices, const auto& runs, int fixed_ends = free_ends, class number,
              class Formula>
    LOBATTO_INLINE static void set_rows(const number* q, number* W, const Formula& formula) {
        if constexpr (RowLoop<variables, indices>::reach() <= 1) {
            RowLoop<variables, indices, fixed_ends>::template entire<number, false, runs>(q, W, formula);
        } else {
            clear<count>(W);
            add_rows<count, variables, indices, runs, fixed_ends>(q, W, formula);
        }
    }
};

// or the same where each entry of W is given away as soon as it is known, with its coordinate no longer needed
// (K::immediate); masses are the receiver's,
struct Immediate {
    template <int count, int variables, const auto& indices, const auto& runs, int fixed_ends = free_ends, class number,
              class Receiver, class Formula>
    LOBATTO_INLINE static void set_rows(const number* q, Receiver W, const Formula& formula) {
        static_assert(RowLoop<variables, indices>::reach() <= 1);
        RowLoop<variables, indices, fixed_ends>::template entire<number, false, runs>(q, W, formula);
    }
    template <int, class Receiver, class Factor>
    LOBATTO_INLINE static void scale(Receiver, const Factor*) {}
};

// or those of a run side by side in a Pack:
struct InLanes {
    template <class real>
    using NativePack = Pack<real, native_lanes<real>>;

    template <class real>
    static NativePack<real> pack_of(real*);
    template <class V, int parts>
    static V pack_of(Registers<V, parts>);

    template <int count, int variables, const auto& indices, const auto& runs, int fixed_ends = free_ends,
              class Position, class Slope, class Formula>
    LOBATTO_INLINE static void add_rows(Position q, Slope W, const Formula& formula) {
        using V = decltype(pack_of(W));
        if constexpr (fixed_ends != free_ends)
            RowLoop<variables, indices, fixed_ends>::template entire<V, true, runs>(q, W, formula);
        else
            RowLoop<variables, indices>::template all<V, runs>(q, W, formula);
    }
    template <int count, int variables, const auto& indices, const auto& runs, int fixed_ends = free_ends,
              class Position, class Slope, class Formula>
    LOBATTO_INLINE static void set_rows(Position q, Slope W, const Formula& formula) {
        RowLoop<variables, indices, fixed_ends>::template entire<decltype(pack_of(W)), false, runs>(q, W, formula);
    }
};

// for plain numbers in arrays with room,
struct SideBySide : InLanes {
    template <int count, class real>
    LOBATTO_INLINE static void clear(real* W) {
        for (int i = 0; i < count; i += native_lanes<real>) NativePack<real>(real(0)).store(W + i);
    }
    template <int count, class real>
    LOBATTO_INLINE static void scale(real* W, const real* factor) {
        using V = NativePack<real>;
        int i = 0;
        for (; i + lanes_of<V> <= count; i += lanes_of<V>) (V::load(W + i) * V::load(factor + i)).store(W + i);
        for (; i < count; ++i) W[i] *= factor[i];
    }
    // One number of W, as a part of its Pack: what has just been stored as a whole is loaded as a whole.
    template <class real, int place>
    struct Place {
        real* W;
        LOBATTO_INLINE void operator+=(real x) const {
            constexpr int lane = place % native_lanes<real>;
            using V = NativePack<real>;
            (V::load(W + place - lane) + only_lane<lane, lanes_of<V>>(x)).store(W + place - lane);
        }
    };
    template <int place, class real>
    LOBATTO_INLINE static Place<real, place> at(real* W) {
        return {W};
    }
};

// or in registers, all written out.
struct WrittenOut : InLanes {
    template <int count, class V, int parts>
    LOBATTO_INLINE static void clear(Registers<V, parts> W) {
        written_out<1>(parts, [&](int i) LOBATTO_FORMULA { W.part[i] = V(real_of<V>(0)); });
    }
    template <int count, class V, int parts>
    LOBATTO_INLINE static void scale(Registers<V, parts> W, const real_of<V>* factor) {
        written_out<lanes_of<V>>(count / lanes_of<V> * lanes_of<V>,
                                 [&](int at) LOBATTO_FORMULA { W.part[at / lanes_of<V>] *= V::load(factor + at); });
        if constexpr (count % lanes_of < V >> 0) {
            real_of<V> rest[lanes_of<V>]{};
            for (int i = 0; i < count % lanes_of<V>; ++i) rest[i] = factor[count / lanes_of<V> * lanes_of<V> + i];
            W.part[parts - 1] *= V::load(rest);
        }
    }
    template <class Slope, int place>
    struct Place {
        Slope W;
        LOBATTO_INLINE void operator+=(typename Slope::real x) const { W.add(place, x); }
    };
    template <int place, class Slope>
    LOBATTO_INLINE static Place<Slope, place> at(Slope W) {
        return {W};
    }
};

// How many numbers an array of coordinates holds.
template <class K>
constexpr int room_of = (K::coordinates / native_lanes<typename K::real> + 3) * native_lanes<typename K::real>;

}  // namespace lobatto

#endif
// What one step of a system with constant mass adds to first order: its tangent map without the identity (D24, D40).
#ifndef LOBATTO_KERNEL_TANGENT_HPP
#define LOBATTO_KERNEL_TANGENT_HPP

namespace lobatto {

// S = M^-1 V'' of one node from its stored entries to a full n x n matrix.
template <class K>
inline void expand_entries(const typename K::real* entries, typename K::real* S) {
    for (int i = 0; i < K::coordinates * K::coordinates; ++i) S[i] = typename K::real(0);
    for (int e = 0; e < K::entries; ++e) S[K::entry_row[e] * K::coordinates + K::entry_column[e]] = entries[e];
}

// What a kick u += length W(q) and a drift q += length u of explicit steps (D40) add to E, as in increment_of_step; W0
// may be null.
template <class K>
inline void kick_increment(typename K::real length, const typename K::real* entries, const typename K::real* W0,
                           typename K::real* E) {
    using real = typename K::real;
    constexpr int n = K::coordinates, columns = 2 * n + 1;
    for (int e = 0; e < K::entries; ++e) {
        const real* const from = E + K::entry_column[e] * columns;
        real* const to = E + (n + K::entry_row[e]) * columns;
        for (int c = 0; c < columns; ++c)
            to[c] += length * (entries[e] * ((c == K::entry_column[e] ? real(1) : real(0)) + from[c]));
    }
    for (int k = 0; k < n && W0 != nullptr; ++k) E[(n + k) * columns + 2 * n] += length * W0[k];
}
template <class K>
inline void drift_increment(typename K::real length, typename K::real* E) {
    using real = typename K::real;
    constexpr int n = K::coordinates, columns = 2 * n + 1;
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c)
            E[k * columns + c] += length * ((c == n + k ? real(1) : real(0)) + E[(n + k) * columns + c]);
}

// What one step adds, in (q, u), from the S of the s nodes: E = T - I with T the tangent map (D24). E: 2n x (2n + 1);
// its last column is the image of the constant acceleration W0 when S does not depend on q, that is, the shift of a
// linear system with forces at q = 0. E is small for a small step and keeps its digits there, T would not.
template <class K>
inline bool increment_of_step(typename K::real h, const typename K::real* S, const typename K::real* W0,
                              typename K::real* E) {
    using real = typename K::real;
    constexpr int n = K::coordinates, s = K::points, m = s - 2, N = n * m, columns = 2 * n + 1;
    real v[n * columns], X[(N > 0 ? N : 1) * columns], J[N > 0 ? N * N : 1];
    const auto unit = [](int k, int column) { return k == column ? real(1) : real(0); };
    // force(node, values): M^-1 (V'' values + V'(0)) for column c of the values
    const auto force = [&](int node, const real* values, int k, int column) {
        real sum = column == 2 * n ? W0[k] : real(0);
        for (int l = 0; l < n; ++l) sum += S[(node * n + k) * n + l] * values[l * columns + column];
        return sum;
    };
    real q0[n * columns];
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c) q0[k * columns + c] = unit(k, c);
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c) v[k * columns + c] = unit(k + n, c) - h * K::b[0] * force(0, q0, k, c);
    for (int i = 0; i < m; ++i)
        for (int k = 0; k < n; ++k)
            for (int c = 0; c < columns; ++c) {
                real sum = q0[k * columns + c] + h * K::c[i + 1] * v[k * columns + c];
                if (c == 2 * n)
                    for (int j = 0; j < m; ++j) sum -= h * h * K::A[i * m + j] * W0[k];
                X[(i * n + k) * columns + c] = sum;
            }
    for (int i = 0; i < m; ++i)
        for (int j = 0; j < m; ++j)
            for (int k = 0; k < n; ++k)
                for (int l = 0; l < n; ++l)
                    J[(i * n + k) * N + j * n + l] =
                        (i == j && k == l ? real(1) : real(0)) + h * h * K::A[i * m + j] * S[((j + 1) * n + k) * n + l];
    if constexpr (N > 0) {
        if (!solve<N, columns>(J, X)) return false;
    }
    real* const dq = E;
    real* const du = E + n * columns;
    real q1[n * columns];
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c) {
            real position = h * v[k * columns + c];
            real rate = -(h * K::b[0] * force(0, q0, k, c));
            for (int j = 0; j < m; ++j) {
                const real w = force(j + 1, X + j * n * columns, k, c);
                position -= h * h * (K::b[j + 1] * (real(1) - K::c[j + 1])) * w;
                rate -= h * K::b[j + 1] * w;
            }
            dq[k * columns + c] = position;
            du[k * columns + c] = rate;
            q1[k * columns + c] = q0[k * columns + c] + position;
        }
    for (int k = 0; k < n; ++k)
        for (int c = 0; c < columns; ++c) du[k * columns + c] -= h * K::b[s - 1] * force(s - 1, q1, k, c);
    return true;
}

// T = I + E without the last column of E.
template <class K>
inline void add_identity(const typename K::real* E, typename K::real* T) {
    using real = typename K::real;
    constexpr int size = 2 * K::coordinates;
    for (int r = 0; r < size; ++r)
        for (int c = 0; c < size; ++c) T[r * size + c] = (r == c ? real(1) : real(0)) + E[r * (size + 1) + c];
}

// From (q, u) to (q, p): rows of u and columns of u are multiplied by M and M^-1; the identity stays. T: 2n x (2n + 1).
template <class K>
inline void to_momentum(const typename K::Coefficients& k, typename K::real* T) {
    using real = typename K::real;
    constexpr int n = K::coordinates, columns = 2 * n + 1;
    real column[n], image[n];
    for (int c = 0; c < columns; ++c) {
        for (int i = 0; i < n; ++i) column[i] = T[(n + i) * columns + c];
        K::momentum(k, column, image);
        for (int i = 0; i < n; ++i) T[(n + i) * columns + c] = image[i];
    }
    // T M^-1 row by row: M is symmetric, so a row times M^-1 is M^-1 applied to the row.
    for (int r = 0; r < 2 * n; ++r) {
        K::velocity(k, T + r * columns + n, image);
        for (int i = 0; i < n; ++i) T[r * columns + n + i] = image[i];
    }
}

}  // namespace lobatto

#endif
// When an iteration ends: the convergence rules of all of them.
//
// An increment e is the size of what an iteration moves positions by, relative to their measure; e_before is the one
// before it. Increments below `enough` are rounding, or the tolerance that was asked for.
#ifndef LOBATTO_KERNEL_CONVERGENCE_HPP
#define LOBATTO_KERNEL_CONVERGENCE_HPP

namespace lobatto {

// What an iteration may ask of its increments: from the evaluation after `judged_after` on they shrink to `percent` of
// the one before, or the iteration has failed; below `noise` times enough they need not.
template <int after = 3, int part = 80, int multiple = 16>
struct Pace {
    static constexpr int judged_after = after, percent = part, noise = multiple;
};
using NoisyPace = Pace<3, 80, 64>;

// Fixed-point iterations converge linearly: what is left to come is about e times e / e_before. T: a number, or a Pack
// with one trajectory in each lane. power 2: increments are kept as squares.
template <class T, int power = 1, class P = Pace<>>
struct Convergence {
    using real = real_of<T>;
    using Truth = decltype(T() < T());
    static constexpr int judged_after = P::judged_after;
    T enough;

    // The rest is small, or increments no longer shrink because they are rounding.
    LOBATTO_INLINE Truth reached(const T& e, const T& e_before) const {
        return either(either(e * e <= enough * e_before, is_small(e)), stagnates(e, e_before));
    }
    LOBATTO_INLINE Truth is_small(const T& e) const { return e <= enough; }
    LOBATTO_INLINE Truth stagnates(const T& e, const T& e_before) const {
        return both(is_noise(e), e >= raised(real(0.5)) * e_before);
    }
    LOBATTO_INLINE Truth is_noise(const T& e) const { return e <= raised(real(P::noise)) * enough; }
    // Whether more iterations are worth their time.
    LOBATTO_INLINE Truth contracts(const T& e, const T& e_before) const {
        return either(e < raised(real(P::percent) / real(100)) * e_before, is_noise(e));
    }

private:
    static constexpr real raised(real x) { return power == 2 ? x * x : x; }
    LOBATTO_INLINE static bool either(bool a, bool b) { return a || b; }
    LOBATTO_INLINE static bool both(bool a, bool b) { return a && b; }
    template <class Mask>
    LOBATTO_INLINE static Mask either(const Mask& a, const Mask& b) {
        return a | b;
    }
    template <class Mask>
    LOBATTO_INLINE static Mask both(const Mask& a, const Mask& b) {
        return a & b;
    }
};

// Newton's iteration converges quadratically, e_next = C e^2: it ends as soon as the next increment would be rounding.
// Increments that no longer shrink are rounding up to `noise` units of what they are computed from.
template <class real>
struct NewtonConvergence {
    static constexpr int iteration_limit = 40, noise = 64;

    static bool reached(int iteration, real e, real e_before) {
        return e <= Limits<real>::root_epsilon ||
               (iteration > 1 && e < e_before && (e / e_before) * (e / e_before) * e <= Limits<real>::epsilon);
    }
    static bool stagnates(int iteration, real e, real e_before) { return iteration > 2 && e >= real(0.5) * e_before; }
};

// With one Jacobian for all iterations increments shrink by a factor rho, and what is left to come is e rho / (1 -
// rho).
template <class real>
struct ChordConvergence {
    static constexpr int noise = 4;  // as above

    static bool reached(int iteration, real e, real e_before) {
        const real rho = e / e_before;
        return e == real(0) || (iteration > 1 && rho < real(1) && e * rho <= Limits<real>::epsilon * (real(1) - rho));
    }
    // Newton's iteration is cheaper.
    static bool is_slow(int iteration, real e, real e_before) { return iteration > 1 && e > real(0.1) * e_before; }
};

}  // namespace lobatto

#endif
// The numbers of the stage map that do not depend on the step size, from a kernel's tables c, b, A and E: what all
// iterations of systems with constant mass are made of. Formula numbers (D..) refer to docs/derivation.md.
#ifndef LOBATTO_KERNEL_STAGE_COEFFICIENTS_HPP
#define LOBATTO_KERNEL_STAGE_COEFFICIENTS_HPP

namespace lobatto {

// Rows: the inner nodes, for the stages (D12), then the end of the step (D16). Columns: of `map` and its row sums the
// inner nodes, of `before` the nodes of the step before, whose accelerations are extrapolated (D15).
template <class K>
struct StageCoefficients {
    using real = typename K::real;
    static constexpr int s = K::points, m = s - 2, columns = m > 0 ? m : 1;
    real map[m + 1][columns]{}, before[m + 1][s]{}, sum[m + 1]{};

    constexpr StageCoefficients() {
        for (int i = 0; i <= m; ++i)
            for (int j = 0; j < m; ++j) {
                map[i][j] = i < m ? K::A[i * m + j] : K::b[j + 1] * (real(1) - K::c[j + 1]);
                sum[i] += map[i][j];
                for (int l = 0; l < s; ++l) before[i][l] += map[i][j] * K::E[j * s + l];
            }
    }
};
template <class K>
constexpr StageCoefficients<K> stage_coefficients{};

}  // namespace lobatto

#endif
// The equations of one step of a system with constant mass, as Newton's iteration and the tests need them: the stages
// (D11 ... D15), their Jacobian (D13) and the end of the step (D16, D17). docs/derivation.md derives them.
//
// Arrays are node-major: Q[i * n + k] is coordinate k at interior node i. W = M^-1 (grad V - F), S = dW/dq.
#ifndef LOBATTO_KERNEL_STAGE_EQUATIONS_HPP
#define LOBATTO_KERNEL_STAGE_EQUATIONS_HPP

namespace lobatto {

// Loops over nodes and coordinates with the kernel's tables c, b, A and E.
template <class K>
struct StageEquations {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2, N = n * m;
    using Layout = Grouped<K, n, (m > 0 ? m : 1), 0>;
    using Matrix = GroupedMatrix<real, Layout>;
    real h;

    explicit StageEquations(real step_size) : h(step_size) {}

    // (D11) v = u - h b_1 W0 and base_i = q + h c_i v, i = 2 ... s.
    void drift(const real* q, const real* u, const real* W0, real* v, real* base) const {
        for (int k = 0; k < n; ++k) v[k] = u[k] - h * K::b[0] * W0[k];
        for (int i = 0; i < s - 1; ++i)
            for (int k = 0; k < n; ++k) base[i * n + k] = q[k] + h * K::c[i + 1] * v[k];
    }

    // (D14) Q_i = base_i - h^2 (sum_j A_ij) W0.
    void simple_start(const real* base, const real* W0, real* Q) const {
        for (int i = 0; i < m; ++i) {
            const real factor = h * h * stage_coefficients<K>.sum[i];
            for (int k = 0; k < n; ++k) Q[i * n + k] = base[i * n + k] - factor * W0[k];
        }
    }

    // (D15) Q_i = base_i - h^2 sum_j (A E)_ij W_before_j.
    void extrapolated_start(const real* base, const real* W_before, real* Q) const {
        for (int i = 0; i < m; ++i) {
            for (int k = 0; k < n; ++k) Q[i * n + k] = base[i * n + k];
            for (int j = 0; j < s; ++j) {
                const real factor = h * h * stage_coefficients<K>.before[i][j];
                for (int k = 0; k < n; ++k) Q[i * n + k] -= factor * W_before[j * n + k];
            }
        }
    }

    // (D12) F_i = Q_i - base_i + h^2 sum_j A_ij W_j.
    void residual(const real* base, const real* Q, const real* W, real* F) const {
        for (int i = 0; i < m; ++i) {
            for (int k = 0; k < n; ++k) F[i * n + k] = Q[i * n + k] - base[i * n + k];
            for (int j = 0; j < m; ++j) {
                const real factor = h * h * K::A[i * m + j];
                for (int k = 0; k < n; ++k) F[i * n + k] += factor * W[j * n + k];
            }
        }
    }

    // (D13) J = I + h^2 A (x) S into add(coordinate, node; coordinate, node), which begins at zero. The S of two nodes
    // are `stride` apart; 0: the same for all.
    template <class At>
    void assemble(const real* S, int stride, At&& at) const {
        for (int k = 0; k < n; ++k)
            for (int i = 0; i < m; ++i) at(k, i, k, i) += real(1);
        for (int e = 0; e < K::entries; ++e)
            for (int i = 0; i < m; ++i)
                for (int j = 0; j < m; ++j)
                    at(K::entry_row[e], i, K::entry_column[e], j) += h * h * K::A[i * m + j] * S[j * stride + e];
    }
    void jacobian(const real* S, real* J) const {
        for (int i = 0; i < N * N; ++i) J[i] = real(0);
        assemble(S, K::entries, [&](int k, int i, int l, int j) -> real& { return J[(i * n + k) * N + j * n + l]; });
    }

    bool factor(const real* S, int stride, Matrix& matrix) const {
        matrix.clear();
        assemble(S, stride, matrix);
        return matrix.factor();
    }

    // (D14) delta = -J^-1 F with J factored; `sorted` is room for N.
    void solve(const real* base, const real* Q, const real* W, const Matrix& matrix, real* delta, real* sorted) const {
        residual(base, Q, W, delta);
        for (int i = 0; i < N; ++i) delta[i] = -delta[i];
        solve_for(matrix, delta, sorted);
    }
    // delta <- J^-1 delta.
    static void solve_for(const Matrix& matrix, real* delta, real* sorted) {
        for (int k = 0; k < n; ++k)
            for (int i = 0; i < m; ++i) sorted[Layout::index(k, i)] = delta[i * n + k];
        matrix.solve(sorted);
        for (int k = 0; k < n; ++k)
            for (int i = 0; i < m; ++i) delta[i * n + k] = sorted[Layout::index(k, i)];
    }

    // W_j += S_j delta_j.
    void carry(const real* S, int stride, const real* delta, real* W) const {
        for (int j = 0; j < m; ++j)
            for (int e = 0; e < K::entries; ++e)
                W[j * n + K::entry_row[e]] += S[j * stride + e] * delta[j * n + K::entry_column[e]];
    }

    // (D16) q1 = base_s - h^2 sum_j b_j (1 - c_j) W_j.
    void arrive(const real* base, const real* W, real* q1) const {
        for (int k = 0; k < n; ++k) q1[k] = base[m * n + k];
        for (int j = 0; j < m; ++j) {
            const real factor = h * h * stage_coefficients<K>.map[m][j];
            for (int k = 0; k < n; ++k) q1[k] -= factor * W[j * n + k];
        }
    }

    // (D17) u1 = v - h sum_j b_j W_j - h b_s W1.
    void finish(const real* v, const real* W, const real* W1, real* u1) const {
        for (int k = 0; k < n; ++k) u1[k] = v[k] - h * K::b[s - 1] * W1[k];
        for (int j = 0; j < m; ++j)
            for (int k = 0; k < n; ++k) u1[k] -= h * K::b[j + 1] * W[j * n + k];
    }
};

}  // namespace lobatto

#endif
// Newton's iteration for the stage equations (D14), where the fixed-point iteration does not contract.
//
// Three cases: a linear system needs one correction; where V is nearly quadratic one Jacobian serves all iterations
// (a chord iteration); else each iteration has a Jacobian of its own.
#ifndef LOBATTO_KERNEL_NEWTON_HPP
#define LOBATTO_KERNEL_NEWTON_HPP

#include <type_traits>

namespace lobatto {

template <class K>
struct NewtonIteration {
    using real = typename K::real;
    using Stages = StageEquations<K>;
    using Matrix = typename Stages::Matrix;
    using Coefficients = typename K::Coefficients;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2, N = n * m;
    static constexpr int room = N > 0 ? N : 1, entry_room = K::entries > 0 ? K::entries : 1;
    using Rule = NewtonConvergence<real>;
    static constexpr bool is_frozen = N > 0 && (K::linear || K::absorbed);

    struct Arrays {
        real v[n], base[(s - 1) * n];        // what is known of a step before it is solved (D11)
        real Q[room], W[room], delta[room];  // at the interior nodes
        real S[(m > 0 ? m : 1) * entry_room];
        real inverse_scale[n], sorted[room];
        Matrix matrix;
    };
    struct Outcome {
        Status status;
        std::int32_t iterations;
        real increment;  // the last one, relative to the displacement within the step
    };

    Status prepare(const Coefficients& k, real h) {
        if constexpr (is_frozen) {
            frozen_.is_factored = false;
            if constexpr (K::linear) {
                real q[n] = {}, W[n];
                Formulas<K>::node(k, real(0), static_cast<const real*>(q), +W, +frozen_.S);
                factor(frozen_, h);
                return frozen_.usable ? Status::ok : Status::singular_jacobian;
            }
        }
        return Status::ok;
    }

    // Solves for a.Q and a.W, from the start value in a.Q; a.v and a.base are given. q and W0: at the start of the
    // step.
    Outcome solve(const Coefficients& k, real h, real time, const real* q, const real* W0, Arrays& a) {
        scale_increments(h, q, W0, a);
        Outcome outcome{Status::not_converged, 0, real(0)};
        if constexpr (is_frozen && K::linear) {
            correct_once(k, h, time, a, outcome);
        } else {
            if constexpr (is_frozen) {
                if (!frozen_.is_factored) {
                    K::quadratic_part(k, frozen_.S);
                    factor(frozen_, h);
                }
                if (frozen_.usable) chord(k, h, time, a, outcome);
            }
            if (outcome.status == Status::not_converged) newton(k, h, time, a, outcome);
        }
        return outcome;
    }

private:
    // The Jacobian with a constant S.
    struct Frozen {
        Matrix matrix;
        real S[entry_room];
        bool usable, is_factored;
    };
    struct Nothing {};

    static real node_time(real time, real h, int i) { return time + K::c[i + 1] * h; }

    template <class FrozenPart>
    static void factor(FrozenPart& part, real h) {
        part.usable = Stages(h).factor(part.S, 0, part.matrix);
        part.is_factored = true;
    }

    // The scale that increments of each coordinate are measured against: the displacement within the step, with the
    // rounding of the position as floor.
    static void scale_increments(real h, const real* q, const real* W0, Arrays& a) {
        constexpr real floor = Limits<real>::epsilon / Limits<real>::root_epsilon;
        for (int k = 0; k < n; ++k) {
            const real scale = fabs(h * a.v[k]) + fabs(h * (h * W0[k])) + floor * fabs(q[k]);
            a.inverse_scale[k] = scale > Limits<real>::smallest ? real(1) / scale : real(0);
        }
    }

    // Adds the increments to the positions; their largest size, or not a number.
    static real apply_increments(Arrays& a) {
        real e = real(0), sum = real(0);
        for (int i = 0; i < m; ++i)
            for (int k = 0; k < n; ++k) {
                const real d = fabs(a.delta[i * n + k]);
                real relative = d * a.inverse_scale[k];
                // A coordinate at rest that only the others move: its own displacement is the measure.
                if (a.inverse_scale[k] == real(0) && d > real(0)) relative = d / (d + fabs(a.Q[i * n + k]));
                e = relative > e ? relative : e;
                sum += relative;
            }
        for (int i = 0; i < N; ++i) a.Q[i] += a.delta[i];
        return is_finite(sum) ? e : sum - sum;
    }

    // Whether increments that no longer shrink are within `roundings` of what they are computed from: positions and
    // accelerations. S is that of the nodes, `stride` apart.
    static bool is_rounding(real h, const Arrays& a, const real* S, int stride, int roundings) {
        for (int i = 0; i < m; ++i) {
            real size[n];
            for (int k = 0; k < n; ++k) size[k] = fabs(a.W[i * n + k]);
            for (int e = 0; e < K::entries; ++e)
                size[K::entry_row[e]] += fabs(S[i * stride + e] * a.Q[i * n + K::entry_column[e]]);
            for (int k = 0; k < n; ++k) {
                const real sum = fabs(a.Q[i * n + k]) + fabs(a.base[i * n + k]) + h * h * size[k];
                if (!(fabs(a.delta[i * n + k]) <= real(roundings) * Limits<real>::epsilon * sum)) return false;
            }
        }
        return true;
    }

    // At the end the accelerations are carried to the final positions to first order, which errs by the same e^2 as the
    // positions.
    static void newton(const Coefficients& k, real h, real time, Arrays& a, Outcome& outcome) {
        const Stages stages(h);
        real previous = Limits<real>::largest;
        for (int iteration = 1; iteration <= Rule::iteration_limit; ++iteration) {
            for (int i = 0; i < m; ++i)
                Formulas<K>::node(k, node_time(time, h, i), static_cast<const real*>(a.Q + i * n), a.W + i * n,
                                  a.S + i * K::entries);
            ++outcome.iterations;
            if (!stages.factor(a.S, K::entries, a.matrix)) {
                outcome.status = why_singular(h, a.S);
                return;
            }
            stages.solve(a.base, a.Q, a.W, a.matrix, a.delta, a.sorted);
            const real e = outcome.increment = apply_increments(a);
            if (!is_finite(e)) {
                outcome.status = Status::not_finite;
                return;
            }
            if (K::linear || Rule::reached(iteration, e, previous) ||
                (Rule::stagnates(iteration, e, previous) && is_rounding(h, a, a.S, K::entries, Rule::noise))) {
                stages.carry(a.S, K::entries, a.delta, a.W);
                outcome.status = Status::ok;
                return;
            }
            previous = e;
        }
        outcome.status = Status::not_converged;
    }

    // Of entries h^2 S far beyond 1 / epsilon products overflow, and their matrix only looks singular.
    static Status why_singular(real h, const real* S) {
        for (int e = 0; e < m * K::entries; ++e) {
            const real entry = fabs(h * (h * S[e])) * Limits<real>::epsilon * Limits<real>::epsilon;
            if (!(entry <= real(1))) return Status::not_finite;
        }
        return Status::singular_jacobian;
    }

    // One increment with the frozen Jacobian; its size.
    real frozen_increment(const Coefficients& k, real h, real time, Arrays& a, Outcome& outcome) const {
        for (int i = 0; i < m; ++i)
            Formulas<K>::minus_acceleration(k, node_time(time, h, i), static_cast<const real*>(a.Q + i * n),
                                            a.W + i * n);
        ++outcome.iterations;
        Stages(h).solve(a.base, a.Q, a.W, frozen_.matrix, a.delta, a.sorted);
        return apply_increments(a);
    }

    // A linear system: the frozen Jacobian is the Jacobian.
    void correct_once(const Coefficients& k, real h, real time, Arrays& a, Outcome& outcome) const {
        outcome.status = is_finite(frozen_increment(k, h, time, a, outcome)) ? Status::ok : Status::not_finite;
        if (outcome.status == Status::ok) Stages(h).carry(frozen_.S, 0, a.delta, a.W);
    }

    // The frozen Jacobian holds the constant part of S only. Where that is too slow: not_converged.
    void chord(const Coefficients& k, real h, real time, Arrays& a, Outcome& outcome) const {
        using Chord = ChordConvergence<real>;
        real previous = Limits<real>::largest;
        for (int iteration = 1; iteration <= Rule::iteration_limit; ++iteration) {
            const real e = outcome.increment = frozen_increment(k, h, time, a, outcome);
            if (!is_finite(e)) {
                outcome.status = Status::not_finite;
                return;
            }
            const bool is_slow = Chord::is_slow(iteration, e, previous);
            if (Chord::reached(iteration, e, previous) || (is_slow && is_rounding(h, a, frozen_.S, 0, Chord::noise))) {
                Stages(h).carry(frozen_.S, 0, a.delta, a.W);
                outcome.status = Status::ok;
                return;
            }
            if (is_slow) return;
            previous = e;
        }
    }

    std::conditional_t<is_frozen, Frozen, Nothing> frozen_{};
};

}  // namespace lobatto

#endif
// The stage map of a separable system, its tables and its memory of the step before, in either of two layouts: the
// nodes of one trajectory in the lanes of Packs (iteration/fixed_point.hpp), or of an ensemble each value a Pack of
// trajectories, its nodes one after another (iteration/ensemble_fixed_point.hpp).
//
// Formula numbers (D..) refer to docs/derivation.md. With W = M^-1 (grad V - F) and the stage map A the equations are
//     Q_i = q + h c_i v - h^2 sum_j A_ij W(Q_j),    v = u - h b_1 W(q),    i = 2 ... s - 1
// Where the constant part of S = dW/dq is diagonal, D, it is taken into the map (D31): with P = (I + h^2 A D)^-1
//     Q = P (q + h c v) - h^2 P A (W - D Q)
#ifndef LOBATTO_KERNEL_STAGE_MAP_HPP
#define LOBATTO_KERNEL_STAGE_MAP_HPP

#include <type_traits>

namespace lobatto {

// How `count` values of nodes lie: in `parts` values of type V, Packs of at most `most` lanes. T: the number type of a
// trajectory's state.
template <class real, class T, int inner, int most = native_lanes<real>>
struct NodeLayout {
    static constexpr bool in_lanes = std::is_same_v<T, real>;
    static constexpr int padded(int values) {
        int lanes = 1;
        while (lanes < values) lanes *= 2;
        return lanes;
    }
    static constexpr int width = !in_lanes ? 1 : padded(inner + 1) < most ? padded(inner + 1) : most;
    using V = std::conditional_t<in_lanes, Pack<real, width>, T>;
    static constexpr int parts_of(int values) { return (values + width - 1) / width; }
    // The end of the step is iterated along with the inner nodes where that costs no further part.
    static constexpr bool with_end = width > 1 && parts_of(inner + 1) == parts_of(inner);
    static constexpr int count = inner + (with_end ? 1 : 0);
    static constexpr int parts = parts_of(count);
};

// Values of nodes one by one: a Pack's lanes in memory.
template <int parts, class V, class T>
inline void lay_flat(const V* values, int stride, T* flat) {
    for (int p = 0; p < parts; ++p) {
        if constexpr (std::is_same_v<V, T>)
            flat[p] = values[p * stride];
        else
            values[p * stride].store(flat + p * lanes_of<V>);
    }
}

// The nodes of one trajectory lie in registers of 32 bytes at most: a step waits for its longest chain of operations,
// and in wider ones divisions, roots and sums over the lanes answer later (docs/measurements/fixed_point_iteration.md).
template <class real>
constexpr int node_lanes =
    register_bytes > 32 && native_lanes<real> > 1 ? native_lanes<real> * 32 / register_bytes : native_lanes<real>;

struct Unit {};

template <class K, class T>
struct StageMap {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2, inner_room = m > 0 ? m : 1;
    using Layout = NodeLayout<real, T, m, node_lanes<real>>;
    using V = typename Layout::V;
    static constexpr bool in_lanes = Layout::in_lanes, with_end = Layout::with_end, absorbs = K::diagonal_part;
    static constexpr int width = Layout::width, count = Layout::count;
    static constexpr int parts = Layout::parts > 0 ? Layout::parts : 1;
    static constexpr int entries = K::entries > 0 ? K::entries : 1, maps = absorbs ? n : 1;
    using ActiveMask = decltype(T() < T());

    // The stage map and its kin, minus and with their powers of h; of each coordinate where D is absorbed.
    struct Map {
        V inner[inner_room][parts];  // -h^2 P A, a column for each inner node
        V before[s][parts];          // the same after the extrapolation of the step before (D15)
        V simple[parts];             // the row sums of the first
        V on_position[parts];        // P 1
        V on_velocity[parts];        // P h c
    };

    Map map[maps];
    V node_time[parts];               // h c
    V weight[parts], arrival[parts];  // -h b and -h^2 b (1 - c), for a trajectory's Packs; zero in lanes to spare
    std::conditional_t<absorbs, T[n], Unit> diagonal{};
    real h{};
    ActiveMask usable{};
    bool has_history{};
    T w[n * s];                                          // W at the nodes of the last step; the last of each at q
    std::conditional_t<absorbs, T[n * s], Unit> rest{};  // W - D q there

    // The tables of one trajectory; `lane` is its place in T.
    void prepare(const typename K::Coefficients& k, real step, int lane = 0) {
        h = step;
        has_history = false;
        real D[n] = {};
        if constexpr (absorbs) {
            real part[entries];
            K::quadratic_part(k, part);
            for (int e = 0; e < K::entries; ++e)
                if (K::entry_row[e] == K::entry_column[e]) D[K::entry_row[e]] = part[e];
            for (int c = 0; c < n; ++c) set_lane(diagonal[c], lane, D[c]);
        }
        bool good = true;
        for (int c = 0; c < maps; ++c) good = prepare_map(map[c], D[c], lane) && good;
        for (int i = 0; i < parts * width; ++i) {
            const bool inner = i < m, end = with_end && i == m;
            put(node_time, i, lane, h * K::c[(i < count ? i : count - 1) + 1]);
            put(weight, i, lane, inner || end ? -h * K::b[i + 1] : real(0));
            put(arrival, i, lane, inner ? -h * h * row(m, i) : real(0));
        }
        if constexpr (in_lanes)
            usable = good;
        else
            usable.set(lane, good);
    }

    // W at node i of the last step.
    T minus_acceleration(int i, int c) const { return w[c * s + i]; }

    // Begins at q with W(q) = W0.
    void begin(const real* q, const real* W0, int lane = 0) {
        has_history = false;
        for (int c = 0; c < n; ++c) {
            set_lane(w[c * s + s - 1], lane, W0[c]);
            if constexpr (absorbs) set_lane(rest[c * s + s - 1], lane, W0[c] - lane_of(diagonal[c], lane) * q[c]);
        }
    }

    // Takes over a step that was taken otherwise, into `lane`: minus_acceleration(i, c) and position(i, c) at node i.
    // All lanes have a memory from then on.
    template <class Acceleration, class Position>
    void recall(const Acceleration& minus_acceleration, const Position& position, int lane = 0) {
        has_history = true;
        for (int c = 0; c < n; ++c)
            for (int i = 0; i < s; ++i) {
                set_lane(w[c * s + i], lane, minus_acceleration(i, c));
                if constexpr (absorbs)
                    set_lane(rest[c * s + i], lane,
                             minus_acceleration(i, c) - lane_of(diagonal[c], lane) * position(i, c));
            }
    }

    const Map& map_of(int c) const { return map[absorbs ? c : 0]; }

    // Rows of the map: those of A, then the end of the step.
    static real row(int i, int j) { return stage_coefficients<K>.map[i][j]; }

private:
    static void put(V* values, int i, int lane, real x) {
        if constexpr (in_lanes)
            set_lane(values[i / width], i % width, x);
        else
            set_lane(values[i], lane, x);
    }

    bool prepare_map(Map& of, real D, int lane) const {
        if (m == 0) return true;  // nothing is solved
        constexpr int columns = m + s + 3;
        real J[inner_room * inner_room], X[(m + 1) * columns];
        for (int i = 0; i <= m; ++i) {
            real* const x = X + i * columns;
            for (int j = 0; j < m; ++j) x[j] = -h * h * row(i, j);
            for (int l = 0; l < s; ++l) x[m + l] = -h * h * stage_coefficients<K>.before[i][l];
            x[m + s] = -h * h * stage_coefficients<K>.sum[i];
            x[m + s + 1] = real(1);
            x[m + s + 2] = h * K::c[i + 1];
        }
        bool good = true;
        if (absorbs) {
            for (int i = 0; i < m; ++i)
                for (int j = 0; j < m; ++j) J[i * m + j] = (i == j ? real(1) : real(0)) + h * h * D * row(i, j);
            good = lobatto::solve<inner_room, columns>(J, X);
            // The end: its row of the map acts on D times the inner positions too.
            for (int i = 0; i < m; ++i)
                for (int j = 0; j < columns; ++j) X[m * columns + j] -= h * h * D * row(m, i) * X[i * columns + j];
        }
        for (int i = 0; i < parts * width; ++i) {
            const real* const x = X + (i < count ? i : count - 1) * columns;
            for (int j = 0; j < m; ++j) put(of.inner[j], i, lane, x[j]);
            for (int l = 0; l < s; ++l) put(of.before[l], i, lane, x[m + l]);
            put(of.simple, i, lane, x[m + s]);
            put(of.on_position, i, lane, x[m + s + 1]);
            put(of.on_velocity, i, lane, x[m + s + 2]);
            for (int j = 0; j < columns; ++j) good = good && is_finite(x[j]);
        }
        return good;
    }
};

}  // namespace lobatto

#endif
// The step of one separable system by iterations over its nodes: accelerations of all nodes at once, in the lanes of
// Packs, then the stage map (iteration/stage_map.hpp).
//
// Formula numbers (D..) refer to docs/derivation.md. An iteration, Q <- q + h c v - h^2 A W(Q), contracts like h^2 |A|
// |S|, S = dW/dq; once the increment e is below sqrt(epsilon), W(Q) + S (Q' - Q) stands for W(Q'), which errs by e^2,
// and the iterations that are left evaluate nothing. Where the constant part of S is taken into the map, they contract
// like what is left of S.
#ifndef LOBATTO_KERNEL_FIXED_POINT_HPP
#define LOBATTO_KERNEL_FIXED_POINT_HPP

#include <type_traits>

namespace lobatto {

// What takes a step before this iteration is tried: of kernels in DoubleDouble, iteration/refinement.hpp.
template <class K, class real = typename K::real>
struct RefinementOf {
    static constexpr bool exists = false;
    struct type {};
};

template <class K>
struct FixedPoint : StageMap<K, typename K::real> {
    using real = typename K::real;
    using Tables = StageMap<K, real>;
    using Tables::h, Tables::usable, Tables::has_history, Tables::w, Tables::rest, Tables::diagonal, Tables::node_time,
        Tables::weight, Tables::arrival, Tables::map_of, Tables::row;
    using Tables::n, Tables::s, Tables::m, Tables::with_end, Tables::absorbs, Tables::width, Tables::parts,
        Tables::entries;
    using typename Tables::V;
    static constexpr int evaluation_limit = 16, carried_limit = 24;

    struct Arrays {
        V base[parts * n], X[parts * n], W[parts * n], S[parts * entries], Y[parts * n], carried[parts * n];
        real flat[n * parts * width], rate[n], inverse_scale[n], inverse_linear[n];
    };

    real tolerance{};       // of increments, relative; 0: to rounding
    real evaluations;       // of the last step
    real increment;         // the last one of the last step, relative
    real twentieth_norm{};  // h^2 |A| / 20
    Workspace<Arrays> workspace;
    typename RefinementOf<K>::type refinement{};

    void prepare(const typename K::Coefficients& k, real step) {
        Tables::prepare(k, step);
        if constexpr (RefinementOf<K>::exists) refinement.prepare(k, step);
        real norm = real(0);
        for (int i = 0; i <= m; ++i) {
            real sum = real(0);
            for (int j = 0; j < m; ++j) sum += fabs(row(i, j));
            norm = sum > norm ? sum : norm;
        }
        twentieth_norm = h * h * norm / real(20);
    }

    // One step, h from `time`; false: it was not solved, and nothing has changed.
    bool step(const typename K::Coefficients& k, real time, real* q, real* u) {
        return workspace.with([&](Arrays& a) {
            if constexpr (RefinementOf<K>::exists)
                if (refinement.solve(k, *this, time, q, u, a)) return finish(k, time, q, u, a);
            return solve(k, time, q, u, a) && finish(k, time, q, u, a);
        });
    }

private:
    template <class>
    friend struct Refinement;

    // base + sum_j column_j r_j of one part.
    template <int terms>
    LOBATTO_INLINE static V sum_of(const V& base, const V (*column)[parts], int p, const real* r) {
        V even = base, odd = V(real(0));
#pragma GCC unroll 16
        for (int j = 0; j < terms; ++j) {
            V& sum = j % 2 == 0 ? even : odd;
            sum = fused(column[j][p], V(r[j]), sum);
        }
        return terms > 1 ? even + odd : even;
    }

    // One iteration: Y = base - h^2 P A r with r = W, or `carried` W + S (Y - X), minus D at the same place, unless W
    // is K's remainder. The size of what Y moved by; `displaced`: the same, in the measure for carrying.
    template <bool is_carried>
    LOBATTO_INLINE real iterate(Arrays& a, real& displaced) const {
        for (int p = 0; p < parts; ++p) {
            V r[n];
            if constexpr (is_carried)
                carry_over(a, p, r);
            else
                for (int c = 0; c < n; ++c) r[c] = a.W[p * n + c];
            for (int c = 0; c < n; ++c) {
                if constexpr (absorbs && !K::has_remainder)
                    r[c] = fused(-V(diagonal[c]), (is_carried ? a.Y : a.X)[p * n + c], r[c]);
                lay_flat<1>(&r[c], 1, a.flat + (c * parts + p) * width);
            }
        }
        V worst = V(real(0)), farthest = V(real(0));
        for (int c = 0; c < n; ++c)
            for (int p = 0; p < parts; ++p) {
                const V next = sum_of<m>(a.base[p * n + c], map_of(c).inner, p, a.flat + c * parts * width);
                V& Y = a.Y[p * n + c];
                const V moved = next - (is_carried ? Y : a.X[p * n + c]);
                Y = next;
                worst = maximum(worst, fabs(moved) * V(a.inverse_scale[c]));
                if constexpr (K::uses_hessian && !is_carried)
                    farthest = maximum(farthest, fabs(moved) * V(a.inverse_linear[c]));
            }
        displaced = largest(farthest);
        return largest(worst);
    }

    // W + S (Y - X) of one part.
    LOBATTO_INLINE void carry_over(const Arrays& a, int p, V* r) const {
        V moved[n];
        for (int c = 0; c < n; ++c) {
            moved[c] = a.Y[p * n + c] - a.X[p * n + c];
            r[c] = a.W[p * n + c];
        }
#pragma GCC unroll 16
        for (int e = 0; e < K::entries; ++e)
            r[K::entry_row[e]] = fused(a.S[p * entries + e], moved[K::entry_column[e]], r[K::entry_row[e]]);
    }

    LOBATTO_INLINE void evaluate(const typename K::Coefficients& k, real time, Arrays& a) const {
        for (int p = 0; p < parts; ++p)
            if constexpr (K::uses_hessian)
                Formulas<K>::node(k, V(time) + node_time[p], static_cast<const V*>(a.X + p * n), a.W + p * n,
                                  a.S + p * entries);
            else if constexpr (K::has_remainder)
                Formulas<K>::remainder(k, V(time) + node_time[p], static_cast<const V*>(a.X + p * n), a.W + p * n);
            else
                Formulas<K>::minus_acceleration(k, V(time) + node_time[p], static_cast<const V*>(a.X + p * n),
                                                a.W + p * n);
    }

    // A twentieth of h^2 |A| |S - D|, largest row sums. Fixed-point iterations contract by more than the norm says, but
    // the first ratio of two increments can be small by chance: no estimate goes below this.
    real least_rate(const Arrays& a) const {
        V worst = V(real(0));
        for (int p = 0; p < parts; ++p) {
            V sums[n];
            for (int c = 0; c < n; ++c) sums[c] = V(real(0));
            for (int e = 0; e < K::entries; ++e) {
                V entry = a.S[p * entries + e];
                if constexpr (absorbs) {
                    if (K::entry_row[e] == K::entry_column[e]) entry -= V(diagonal[K::entry_row[e]]);
                }
                sums[K::entry_row[e]] += fabs(entry);
            }
            for (int c = 0; c < n; ++c) worst = maximum(worst, sums[c]);
        }
        return twentieth_norm * largest(worst);
    }

    // The stage equations; a.carried: W at the nodes.
    bool solve(const typename K::Coefficients& k, real time, const real* q, const real* u, Arrays& a) {
        constexpr real floor = Limits<real>::epsilon / Limits<real>::root_epsilon;
        // Each coordinate has its own measures: increments as small as its rounding are so whatever the others do.
        const real small = maximum(tolerance, Limits<real>::epsilon);
        const real linear = maximum(Limits<real>::root_epsilon, sqrt(tolerance));  // where e^2 is no matter
        for (int c = 0; c < n; ++c) {
            const real W0 = w[c * s + s - 1];
            a.rate[c] = fused(-h * K::b[0], W0, u[c]);
            const real scale = fabs(h * a.rate[c]) + fabs(h * (h * W0)) + floor * fabs(q[c]);
            const real rounding = Limits<real>::epsilon * fabs(q[c]) + Limits<real>::smallest;
            a.inverse_scale[c] = real(1) / maximum(scale, real(1) / small * rounding);
            a.inverse_linear[c] = real(1) / maximum(scale, real(8) / linear * rounding);
        }
        for (int c = 0; c < n; ++c)
            for (int p = 0; p < parts; ++p) {
                const auto& of = map_of(c);
                const V base = fused(of.on_velocity[p], V(a.rate[c]), of.on_position[p] * V(q[c]));
                a.base[p * n + c] = base;
                const real* last;
                if constexpr (absorbs)
                    last = rest + c * s;
                else
                    last = w + c * s;
                a.X[p * n + c] =
                    has_history ? sum_of<s>(base, of.before, p, last) : fused(of.simple[p], V(last[s - 1]), base);
            }
        evaluations = real(0);
        if (!usable) return false;
        const Convergence<real> rule{small};
        real e_before = K::uses_hessian ? Limits<real>::largest : real(0);
        [[maybe_unused]] real least = real(0);
        for (int evaluation = 1; evaluation <= evaluation_limit; ++evaluation) {
            evaluate(k, time, a);
            evaluations += real(1);
            real displaced;
            const real e = iterate<false>(a, displaced);
            if (evaluation > rule.judged_after && !rule.contracts(e, e_before)) return false;
            if constexpr (K::uses_hessian) {
                if (evaluation == 1) least = least_rate(a);
                if (displaced <= linear) return carry(e, e_before, least, small, a);
            } else {
                // What is left, e times its ratio to the one before, is rounding; or it no longer shrinks.
                if (rule.reached(e, e_before)) {
                    settle(k, time, a);
                    increment = e;
                    return true;
                }
            }
            for (int i = 0; i < parts * n; ++i) a.X[i] = a.Y[i];
            e_before = e;
        }
        return false;
    }

    // W at the nodes Y.
    LOBATTO_INLINE void settle(const typename K::Coefficients& k, real time, Arrays& a) const {
        for (int p = 0; p < parts; ++p)
            Formulas<K>::minus_acceleration(k, V(time) + node_time[p], static_cast<const V*>(a.Y + p * n),
                                            a.carried + p * n);
    }

    // Fixed-point iterations with W + S (Y - X) in place of W(Y), until what is left of an increment, e times its ratio
    // to the one before, is rounding; then that is what W is at the nodes.
    LOBATTO_INLINE bool carry(real e, real e_before, real least, real small, Arrays& a) {
        const Convergence<real, 1, NoisyPace> rule{small};
        real ignored;
        bool still = !(e * e <= small * e_before && e * least <= small);
        for (int i = 0; i < carried_limit && still; ++i) {
            const real next = iterate<true>(a, ignored);
            const bool stands = next >= real(0.5) * e && next > real(0);  // rounding, or no convergence
            if (stands && !rule.is_noise(next)) return false;
            still = !stands && !(next * next <= small * e && next * least <= small);
            e = next;
        }
        increment = e;
        for (int p = 0; p < parts; ++p) carry_over(a, p, a.carried + p * n);
        return !still;
    }

    // (D16), (D17): the end of the step, each sum of increments rounded once; then the memory of the step.
    bool finish(const typename K::Coefficients& k, real time, real* q, real* u, Arrays& a) {
        real q1[n], u1[n], W1[n];
        for (int c = 0; c < n; ++c) {
            lay_flat<parts>(a.carried + c, n, a.flat + c * parts * width);
            V to_arrive = arrival[0] * a.carried[c], to_change = weight[0] * a.carried[c];
            for (int p = 1; p < parts; ++p) {
                to_arrive = fused(arrival[p], a.carried[p * n + c], to_arrive);
                to_change = fused(weight[p], a.carried[p * n + c], to_change);
            }
            q1[c] = q[c] + fused(h, a.rate[c], sum(to_arrive));
            u1[c] = sum(to_change);
        }
        if constexpr (with_end) {
            for (int c = 0; c < n; ++c) W1[c] = a.flat[c * parts * width + m];
        } else {
            Formulas<K>::minus_acceleration(k, time + h, static_cast<const real*>(q1), +W1);
        }
        real not_finite = real(0);
        for (int c = 0; c < n; ++c) {
            real change = fused(-h * K::b[0], w[c * s + s - 1], u1[c]);
            if constexpr (!with_end) change = fused(-h * K::b[s - 1], W1[c], change);
            u1[c] = u[c] + change;
            not_finite += (q1[c] - q1[c]) + (u1[c] - u1[c]) + (W1[c] - W1[c]);
        }
        if (not_finite != real(0)) return false;
        remember(q, u, q1, u1, W1, a);
        has_history = true;
        return true;
    }

    // The end of the step becomes the state, and its accelerations the memory.
    LOBATTO_INLINE void remember(real* q, real* u, const real* q1, const real* u1, const real* W1, const Arrays& a) {
        for (int c = 0; c < n; ++c) {
            real* const memory = w + c * s;
            const real* const flat = a.flat + c * parts * width;
            memory[0] = memory[s - 1];
            for (int j = 0; j < m; ++j) memory[j + 1] = flat[j];
            memory[s - 1] = W1[c];
            if constexpr (absorbs) {
                real* const r = rest + c * s;
                r[0] = r[s - 1];
                for (int j = 0; j < m; ++j)
                    r[j + 1] = flat[j] - diagonal[c] * lane_of(a.Y[(j / width) * n + c], j % width);
                r[s - 1] = W1[c] - diagonal[c] * q1[c];
            }
            q[c] = q1[c];
            u[c] = u1[c];
        }
    }
};

template <class K>
struct FixedPointOf<K, false> {
    using type = FixedPoint<K>;
};

}  // namespace lobatto

#endif
// The stage equations of one separable system in DoubleDouble, by iterative refinement: solved in double, then
// corrected by their residual in DoubleDouble (J. H. Wilkinson 1963).
//
// Formula numbers (D..) refer to docs/derivation.md. With X the solution in double and the residual (D51)
//     r = P (q + h c v) - h^2 P A (W(X) - D X) - X,
// computed in DoubleDouble, the correction d solves d = r - h^2 P A (S - D) d, S = dW/dq. It is as small as rounding of
// double, so that double is enough for it, and W(X + d) = W(X) + S d errs by d^2, which is rounding of DoubleDouble. So
// a step evaluates forces in DoubleDouble once, as a rule.
#ifndef LOBATTO_KERNEL_REFINEMENT_HPP
#define LOBATTO_KERNEL_REFINEMENT_HPP

#include <type_traits>

namespace lobatto {

// A table of a kernel, rounded to double.
template <int count>
struct RoundedTable {
    double values[count > 0 ? count : 1]{};
    constexpr explicit RoundedTable(const DoubleDouble* from) {
        for (int i = 0; i < count; ++i) values[i] = from[i].high;
    }
    constexpr double operator[](int i) const { return values[i]; }
};

// The kernel K in double.
template <class K>
struct Rounded : K {
    using real = double;
    using Values = typename K::template CoefficientsOf<double>;
    struct Coefficients : Values {
        double constant_part[K::entries > 0 ? K::entries : 1];  // of S
    };
    static constexpr RoundedTable<K::points> c{K::c}, b{K::b};
    static constexpr RoundedTable<(K::points - 2) * (K::points - 2)> A{K::A};
    static constexpr RoundedTable<(K::points - 2) * K::points> E{K::E};

    static Coefficients rounded(const typename K::Coefficients& k) {
        Coefficients result{};
        if constexpr (K::diagonal_part) {
            DoubleDouble part[K::entries];
            K::quadratic_part(k, part);
            for (int e = 0; e < K::entries; ++e) result.constant_part[e] = part[e].high;
        }
        if constexpr (!std::is_empty_v<Values>) {
            constexpr int size = sizeof(Values) / sizeof(double);
            static_assert(sizeof(k) == size * sizeof(DoubleDouble));
            const auto* const from = reinterpret_cast<const DoubleDouble*>(&k);
            auto* const to = reinterpret_cast<double*>(static_cast<Values*>(&result));
            for (int i = 0; i < size; ++i) to[i] = from[i].high;
        }
        return result;
    }
    static void quadratic_part(const Coefficients& k, double* S) {
        for (int e = 0; e < K::entries; ++e) S[e] = k.constant_part[e];
    }
};

template <class K>
struct Refinement {
    using Rough = Rounded<K>;
    using Iteration = FixedPoint<Rough>;
    using Fine = FixedPoint<K>;
    using V = typename Iteration::V;
    static constexpr int n = Iteration::n, s = Iteration::s, m = Iteration::m, parts = Iteration::parts,
                         width = Iteration::width, entries = Iteration::entries;
    static constexpr bool absorbs = Iteration::absorbs;
    static constexpr int refinement_limit = 3, correction_limit = 24;
    static constexpr double small = 0x1p-48;  // of a position: a correction whose square is rounding

    Iteration rough;
    typename Rough::Coefficients coefficients{};

    void prepare(const typename K::Coefficients& k, DoubleDouble step) {
        coefficients = Rough::rounded(k);
        rough.prepare(coefficients, step.high);
    }

    // a.Y the nodes, a.carried what W is there, a.rate as FixedPoint has it. False: not solved.
    bool solve(const typename K::Coefficients& k, Fine& fine, DoubleDouble time, const DoubleDouble* q,
               const DoubleDouble* u, typename Fine::Arrays& a) {
        if (!fine.usable) return false;
        recall(fine);
        double position[n], velocity[n], scale[n];
        for (int c = 0; c < n; ++c) {
            position[c] = q[c].high;
            velocity[c] = u[c].high;
            scale[c] = 1 / (__builtin_fabs(position[c]) + __builtin_fabs(rough.h * velocity[c]) +
                            std::numeric_limits<double>::min());
        }
        V X[parts * n], ignored[parts * n], S[parts * entries], r[parts * n], d[parts * n];
        rough.tolerance = 0;
        const bool found = rough.workspace.with([&](typename Iteration::Arrays& inner) {
            if (!rough.solve(coefficients, time.high, position, velocity, inner)) return false;
            for (int i = 0; i < parts * n; ++i) X[i] = inner.Y[i];
            return true;
        });
        if (!found) return false;
        fine.evaluations = DoubleDouble(rough.evaluations) + 1.0;
        fine.increment = rough.increment;
        for (int p = 0; p < parts; ++p)
            Formulas<Rough>::node(coefficients, V(time.high) + rough.node_time[p], static_cast<const V*>(X + p * n),
                                  ignored + p * n, S + p * entries);
        using Wide = typename Fine::V;
        for (int c = 0; c < n; ++c) {
            a.rate[c] = fused(-fine.h * K::b[0], fine.w[c * s + s - 1], u[c]);
            for (int p = 0; p < parts; ++p) {
                const auto& map = fine.map_of(c);
                a.base[p * n + c] = fused(map.on_velocity[p], Wide(a.rate[c]), map.on_position[p] * Wide(q[c]));
                a.X[p * n + c] = of_parts(X[p * n + c], V(0.0));
            }
        }
        for (int turn = 0; turn < refinement_limit; ++turn) {
            evaluate(k, fine, time, a);
            for (int c = 0; c < n; ++c)
                for (int p = 0; p < parts; ++p)
                    r[p * n + c] = high_part(Fine::template sum_of<m>(a.base[p * n + c], fine.map_of(c).inner, p,
                                                                      a.flat + c * parts * width) -
                                             a.X[p * n + c]);
            if (!correct(r, S, d)) return false;
            V worst = V(0.0);
            for (int p = 0; p < parts; ++p)
                for (int c = 0; c < n; ++c) worst = maximum(worst, fabs(d[p * n + c]) * V(scale[c]));
            const double size = largest(worst);
            if (!(size < 1)) return false;
            for (int i = 0; i < parts * n; ++i) a.Y[i] = a.X[i] + of_parts(d[i], V(0.0));
            if (size <= small) {
                settle(fine, S, d, a);
                return true;
            }
            for (int i = 0; i < parts * n; ++i) a.X[i] = a.Y[i];
        }
        return false;
    }

private:
    // The memory of the step before, from that of `fine`.
    void recall(const Fine& fine) {
        rough.has_history = fine.has_history;
        for (int i = 0; i < n * s; ++i) {
            rough.w[i] = fine.w[i].high;
            if constexpr (absorbs) rough.rest[i] = fine.rest[i].high;
        }
    }

    // a.W = W(X), or K's remainder, and a.flat = W - D X, node by node.
    LOBATTO_INLINE void evaluate(const typename K::Coefficients& k, const Fine& fine, DoubleDouble time,
                                 typename Fine::Arrays& a) const {
        using Wide = typename Fine::V;
        for (int p = 0; p < parts; ++p) {
            const Wide* const X = a.X + p * n;
            if constexpr (K::has_remainder)
                Formulas<K>::remainder(k, Wide(time) + fine.node_time[p], X, a.W + p * n);
            else
                Formulas<K>::minus_acceleration(k, Wide(time) + fine.node_time[p], X, a.W + p * n);
            for (int c = 0; c < n; ++c) {
                Wide r = a.W[p * n + c];
                if constexpr (absorbs && !K::has_remainder) r = fused(-Wide(fine.diagonal[c]), X[c], r);
                lay_flat<1>(&r, 1, a.flat + (c * parts + p) * width);
            }
        }
    }

    // S d, less D d where D is in the map.
    LOBATTO_INLINE void times_hessian(const V* S, const V* d, int p, bool less_diagonal, V* product) const {
        for (int c = 0; c < n; ++c) {
            product[c] = V(0.0);
            if constexpr (absorbs) {
                if (less_diagonal) product[c] = -V(rough.diagonal[c]) * d[p * n + c];
            }
        }
        for (int e = 0; e < K::entries; ++e)
            product[K::entry_row[e]] =
                fused(S[p * entries + e], d[p * n + K::entry_column[e]], product[K::entry_row[e]]);
    }

    // d = r - h^2 P A (S - D) d, by fixed-point iteration.
    bool correct(const V* r, const V* S, V* d) const {
        double flat[n * parts * width];
        for (int i = 0; i < parts * n; ++i) d[i] = r[i];
        double before = std::numeric_limits<double>::max();
        for (int turn = 0; turn < correction_limit; ++turn) {
            for (int p = 0; p < parts; ++p) {
                V product[n];
                times_hessian(S, d, p, true, product);
                for (int c = 0; c < n; ++c) lay_flat<1>(&product[c], 1, flat + (c * parts + p) * width);
            }
            V change = V(0.0), size = V(0.0);
            for (int c = 0; c < n; ++c)
                for (int p = 0; p < parts; ++p) {
                    V next = r[p * n + c];
                    for (int j = 0; j < m; ++j)
                        next = fused(rough.map_of(c).inner[j][p], V(flat[c * parts * width + j]), next);
                    change = maximum(change, fabs(next - d[p * n + c]));
                    size = maximum(size, fabs(next));
                    d[p * n + c] = next;
                }
            const double moved = largest(change);
            if (moved <= 0x1p-50 * largest(size)) return true;
            if (turn > 3 && !(moved < 0.8 * before)) return false;
            before = moved;
        }
        return false;
    }

    // a.carried = W(X) + S d.
    LOBATTO_INLINE void settle(const Fine& fine, const V* S, const V* d, typename Fine::Arrays& a) const {
        using Wide = typename Fine::V;
        for (int p = 0; p < parts; ++p) {
            V product[n];
            times_hessian(S, d, p, false, product);
            for (int c = 0; c < n; ++c) {
                Wide W = a.W[p * n + c];
                if constexpr (K::has_remainder) W = fused(Wide(fine.diagonal[c]), a.X[p * n + c], W);
                a.carried[p * n + c] = W + of_parts(product[c], V(0.0));
            }
        }
    }
};

template <class K>
struct RefinementOf<K, DoubleDouble> {
    static constexpr bool exists = true;
    using type = Refinement<K>;
};

}  // namespace lobatto

#endif
// The step of a large separable system whose terms join neighbouring coordinates, which lie in the lanes of Packs.
//
// The same iterations as in iteration/fixed_point.hpp, formula numbers (D..) of docs/derivation.md: accelerations W of
// all nodes, then the stage map. What is different is the layout: of each node all coordinates stand one after another,
// and every loop runs over them, so that the cost of a step is proportional to their number. Increments shrink by a
// factor rho in each iteration, so W at positions that moved by e at last errs by rho e: the iteration ends when that
// is rounding, or as much as is asked for, without an evaluation at the new positions.
#ifndef LOBATTO_KERNEL_NEIGHBOURS_HPP
#define LOBATTO_KERNEL_NEIGHBOURS_HPP

#include <type_traits>
#include <utility>

namespace lobatto {

// Whether the inner nodes of a step fit the registers of AVX-512, of which there are 32: these hold positions,
// accelerations and what is under way.
template <class K>
constexpr bool fits_registers() {
    using real = typename K::real;
    constexpr int width = native_lanes<real>, parts = (K::coordinates + width - 1) / width;
    if constexpr (K::neighbours)
        return width * sizeof(real) == 64 && parts * (K::points - 2) <= 16 && K::row_reach >= 0 &&
               K::row_reach <= width;
    else
        return false;
}

// One trajectory; its state, the memory of its last step, and room for the next. Most steps are quick ones: as many
// iterations as the last measurement found enough, and one test of the last increment, in registers, all written out,
// or in memory; to the same bits. A step that does not pass, and now and then one to measure with, is taken carefully:
// in memory, and every iteration measures its increments.
template <class K, bool in_registers = fits_registers<K>()>
struct NeighbourFixedPoint {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2;
    static_assert(m > 0);
    static constexpr int width = native_lanes<real>, room = room_of<K>, parts = (n + width - 1) / width;
    static constexpr int evaluation_limit = 16, longest_interval = 256, shortest_interval = 4;
    using V = Pack<real, width>;

    real before[m][s];           // -h^2 A E: from the accelerations of the step before (D15)
    real inner[m][m];            // -h^2 A
    real simple[m];              // the row sums of the latter
    real on_velocity[m];         // h c
    real weight[s], arrival[m];  // -h b and -h^2 b (1 - c)
    real h{};
    real tolerance{};      // of increments, relative; 0: to rounding
    real shrinking{};      // rho, as last measured; 0: never
    real measured_for{};   // the tolerance
    real noise{};          // increments to this tolerance that were rounding, and those up to twice as large
    int until_measured{};  // steps
    int interval{};        // between the last two measurements, in steps
    int expected{};        // iterations of a quick step; 0: unknown
    int late{};            // how many of the last quick steps, without a break, took more
    // Squares of increments that are small enough: on_rate v^2 + still, the latter as in the last careful step.
    real on_rate{};
    alignas(V) real still[room]{};
    bool has_history{};
    int now{}, then{1};                                            // the present, the beginning of the last step, of
    alignas(V) real q[3][room]{}, u[3][room]{}, w_end[3][room]{};  // position, velocity, W there
    int last{};                                                    // the last step, of
    alignas(V) real w[2][m * room]{};                              // W at the inner nodes
    int evaluations{};                                             // of the last step
    real increment{};                                              // the last one that was measured, relative

    // Of the step that is being solved: positions of the inner nodes, q + h c v, v, and what u changes by. In registers
    // also W and the end of the step, which otherwise are written where they belong.
    struct InMemory {
        alignas(V) real X[m * room]{}, base[m * room]{}, rate[room]{}, change[room]{};
    };
    struct InRegisters {
        V X[m * parts], base[m * parts], rate[parts], change[parts];
        V W[m * parts], q1[parts], W1[parts];
    };
    InMemory memory{};

    void prepare(const typename K::Coefficients&, real step_size) {
        h = step_size;
        forget();
        for (int i = 0; i < m; ++i) {
            for (int j = 0; j < m; ++j) inner[i][j] = -h * h * stage_coefficients<K>.map[i][j];
            for (int l = 0; l < s; ++l) before[i][l] = -h * h * stage_coefficients<K>.before[i][l];
            simple[i] = -h * h * stage_coefficients<K>.sum[i];
            arrival[i] = -h * h * stage_coefficients<K>.map[m][i];
            on_velocity[i] = h * K::c[i + 1];
        }
        for (int i = 0; i < s; ++i) weight[i] = -h * K::b[i];
    }

    // Begins at q and u, where W is W0.
    void begin(const real* position, const real* velocity, const real* W0) {
        forget();
        for (int c = 0; c < n; ++c) {
            q[now][c] = position[c];
            u[now][c] = velocity[c];
            w_end[now][c] = W0[c];
        }
    }

    // Position and velocity now.
    void state(real* position, real* velocity) const {
        copy_lanes<n>(q[now], position);
        copy_lanes<n>(u[now], velocity);
    }

    // W at node i of the last step.
    real minus_acceleration(int i, int c) const {
        return i == 0 ? w_end[then][c] : i < s - 1 ? w[last][(i - 1) * room + c] : w_end[now][c];
    }

    // Takes over a step that was taken otherwise: minus_acceleration_at(i, c) at node i.
    template <class Acceleration>
    void recall(const real* position, const real* velocity, const Acceleration& minus_acceleration_at) {
        begin(position, velocity, w_end[now]);
        has_history = true;
        for (int c = 0; c < n; ++c) {
            w_end[then][c] = minus_acceleration_at(0, c);
            for (int i = 0; i < m; ++i) w[last][i * room + c] = minus_acceleration_at(i + 1, c);
            w_end[now][c] = minus_acceleration_at(s - 1, c);
        }
    }

    // One step, h from `time`. False, and nothing has moved, where the iterations do not contract.
    bool step(const typename K::Coefficients& k, real time) {
        if (tolerance != measured_for) {
            until_measured = 0;
            noise = real(0);
        }
        int spent = 0;  // iterations of a quick step that was none
        if (expected > 0 && until_measured > 0) {
            bool good;
            if constexpr (in_registers) {
                InRegisters nodes;
                good = quick_step(nodes, k, time);
            } else {
                good = quick_step(memory, k, time);
            }
            if (good) {
                --until_measured;
                late = evaluations > expected ? late + 1 : 0;
                if (late > 3) expected = evaluations;
                return true;
            }
            spent = evaluations;
        }
        const bool good = careful_step(k, time);
        evaluations += spent;
        return good;
    }

private:
    void forget() {
        has_history = false;
        shrinking = noise = real(0);
        until_measured = interval = expected = late = 0;
    }
    int next() const { return 3 - now - then; }
    // The coordinates of node i in one of the arrays of a step.
    LOBATTO_INLINE static Registers<V, parts> row(V* nodes, int i = 0) { return {nodes + i * parts}; }
    LOBATTO_INLINE static real* row(real* nodes, int i = 0) { return nodes + i * room; }
    // W at inner node i, the position at the end and W there, of the step that is being solved.
    LOBATTO_INLINE Registers<V, parts> W_at(InRegisters& a, int i) { return row(a.W, i); }
    LOBATTO_INLINE real* W_at(InMemory&, int i) { return row(w[1 - last], i); }
    LOBATTO_INLINE Registers<V, parts> arrival_of(InRegisters& a) { return row(a.q1); }
    LOBATTO_INLINE real* arrival_of(InMemory&) { return q[next()]; }
    LOBATTO_INLINE Registers<V, parts> W_at_end(InRegisters& a) { return row(a.W1); }
    LOBATTO_INLINE real* W_at_end(InMemory&) { return w_end[next()]; }
    // f(at) for all parts, which begin at coordinate `at`.
    template <class Nodes, class F>
    LOBATTO_INLINE static void over_parts(const F& f) {
        if constexpr (std::is_same_v<Nodes, InRegisters>)
            written_out<width>(parts * width, f);
        else
            for (int at = 0; at < parts * width; at += width) f(at);
    }

    template <class How, class Row>
    LOBATTO_INLINE static void accelerate_here(const typename K::Coefficients& k, real time, Row position, Row W) {
        Formulas<K>::template along_rows<How>(k, time, position, W);
    }
    // In memory one copy of the formulas serves all nodes.
    static void accelerate(const typename K::Coefficients& k, real time, real* position, real* W) {
        accelerate_here<SideBySide>(k, time, position, W);
    }
    LOBATTO_INLINE static void accelerate(const typename K::Coefficients& k, real time, Registers<V, parts> position,
                                          Registers<V, parts> W) {
        accelerate_here<WrittenOut>(k, time, position, W);
    }
    template <class Nodes>
    LOBATTO_INLINE void accelerate_nodes(Nodes& a, const typename K::Coefficients& k, real time) {
#pragma GCC unroll 16
        for (int i = 0; i < m; ++i) accelerate(k, time + K::c[i + 1] * h, row(a.X, i), W_at(a, i));
    }

    // One iteration more than expected, or two, are no reason for a careful step.
    template <class Nodes>
    LOBATTO_INLINE bool quick_step(Nodes& a, const typename K::Coefficients& k, real time) {
        predict<true>(a);
        for (evaluations = 1;; ++evaluations) {
            accelerate_nodes(a, k, time);
            if (evaluations >= expected) {
                if (is_settled(a)) break;
                if (evaluations > expected + 1) return false;
            }
            iterate(a);
        }
        return finish(a, k, time);
    }
    bool careful_step(const typename K::Coefficients& k, real time) {
        if (has_history)
            predict<true>(memory);
        else
            predict<false>(memory);
        if (!solve(k, time)) return false;
        return finish(memory, k, time);
    }

    real bound() const {
        return maximum(tolerance, Limits<real>::epsilon);
    }
    // What increments are measured against beside the displacement of each coordinate in a step: the rounding of its
    // position, relative to the bound.
    real on_distance() const {
        return Limits<real>::epsilon / Limits<real>::root_epsilon + Limits<real>::epsilon / bound();
    }

    // The positions at the nodes from the accelerations of the step before.
    template <bool with_history, class Nodes>
    LOBATTO_INLINE void predict(Nodes& a) const {
        over_parts<Nodes>([&](int at) LOBATTO_FORMULA {
            const V Q = V::load(q[now] + at), W_now = V::load(w_end[now] + at);
            const V v = fused(V(weight[0]), W_now, V::load(u[now] + at));
            store_to(row(a.rate), at, v);
            V W[s];
            if constexpr (with_history) {
                W[0] = V::load(w_end[then] + at);
                for (int j = 0; j < m; ++j) W[j + 1] = V::load(w[last] + j * room + at);
                W[s - 1] = W_now;
            }
#pragma GCC unroll 16
            for (int i = 0; i < m; ++i) {
                V x = fused(V(on_velocity[i]), v, Q);
                store_to(row(a.base, i), at, x);
                if constexpr (with_history) {
#pragma GCC unroll 16
                    for (int j = 0; j < s; ++j) x = fused(V(before[i][j]), W[j], x);
                } else {
                    x = fused(V(simple[i]), W_now, x);
                }
                store_to(row(a.X, i), at, x);
            }
        });
    }

    // f(i, x): x = (q + h c v - h^2 A W)_i of all inner nodes, for the part that begins at coordinate `at`.
    template <class Nodes, class F>
    LOBATTO_INLINE void map_stages(Nodes& a, int at, const F& f) {
        V W[m];
#pragma GCC unroll 16
        for (int j = 0; j < m; ++j) W[j] = load_from<V>(W_at(a, j), at);
#pragma GCC unroll 16
        for (int i = 0; i < m; ++i) {
            V x = load_from<V>(row(a.base, i), at);
#pragma GCC unroll 16
            for (int j = 0; j < m; ++j) x = fused(V(inner[i][j]), W[j], x);
            f(i, x);
        }
    }
    template <class Nodes>
    LOBATTO_INLINE void iterate(Nodes& a) {
        over_parts<Nodes>([&](int at) LOBATTO_FORMULA {
            map_stages(a, at, [&](int i, const V& x) LOBATTO_FORMULA { store_to(row(a.X, i), at, x); });
        });
    }
    // What increments of coordinates that hardly move are measured against: the rounding of the largest displacement in
    // a step. A blow must not be followed down to the denormal numbers that run ahead of it.
    real least_distance() const {
        V most = V(real(0));
        over_parts<InMemory>([&](int at) LOBATTO_FORMULA { most = maximum(most, displacement(at)); });
        return Limits<real>::epsilon * minimum(largest(most), Limits<real>::largest / real(8));
    }
    LOBATTO_INLINE V displacement(int at) const {
        return V(fabs(h)) * (fabs(V::load(memory.rate + at)) + fabs(V(h) * V::load(w_end[now] + at)));
    }
    // An iteration and its increment: the largest of what it moves by, measured against the displacement of each
    // coordinate in a step, or what is `least`, with the rounding of its position as floor.
    real measured_iteration(InMemory& a, real least) {
        const V on_position = V(on_distance()), floor = V(least + Limits<real>::smallest);
        V worst = V(real(0));
        over_parts<InMemory>([&](int at) LOBATTO_FORMULA {
            V farthest = V(real(0));
            map_stages(a, at, [&](int i, const V& x) LOBATTO_FORMULA {
                const V moved = fabs(x - V::load(row(a.X, i) + at));
                farthest = i == 0 ? moved : maximum(farthest, moved);
                x.store(row(a.X, i) + at);
            });
            const V rounding = fused(on_position, fabs(V::load(q[now] + at)), floor);
            const V scale = minimum(displacement(at) + rounding, V(Limits<real>::largest / real(8)));
            worst = maximum(worst, farthest * rough_inverse(scale));
        });
        return largest(worst);
    }
    // Whether another iteration would move no coordinate by more than is small enough; in squares, which are the fewest
    // instructions, summed over the nodes. Of the differences only the signs are asked for.
    template <class Nodes>
    LOBATTO_INLINE bool is_settled(Nodes& a) {
        Bits<real, width> signs(0);
        over_parts<Nodes>([&](int at) LOBATTO_FORMULA {
            V moved = V(real(0));
            map_stages(a, at, [&](int i, const V& x) LOBATTO_FORMULA {
                const V d = x - load_from<V>(row(a.X, i), at);
                moved = i == 0 ? d * d : fused(d, d, moved);
            });
            const V rate = load_from<V>(row(a.rate), at);
            signs = signs | bits(fused(V(on_rate) * rate, rate, V::load(still + at)) - moved);
        });
        return !any(is_odd(signs >> (8 * static_cast<int>(sizeof(real)) - 1)));
    }
    // Makes increments of `enough` small enough, relative to what they are measured against by measured_iteration:
    // of which the next steps compute the part of the velocity anew. False where squares are too small or too large for
    // numbers: then no step is quick.
    bool settle_at(real enough, real least) {
        on_rate = (enough * h) * (enough * h);
        V most = V(real(0));
        over_parts<InMemory>([&](int at) LOBATTO_FORMULA {
            const V bent = fused(V(h * h), fabs(V::load(w_end[now] + at)), V(least));
            const V distance = V(enough) * fused(V(on_distance()), fabs(V::load(q[now] + at)), bent);
            (distance * distance).store(still + at);
            most = maximum(most, distance * distance);
        });
        const real farthest = least / Limits<real>::epsilon;  // displacement of a coordinate in a step
        return largest(most) > Limits<real>::smallest / Limits<real>::epsilon && is_finite(sum(most) + on_rate) &&
               farthest * farthest < Limits<real>::largest * Limits<real>::epsilon;
    }

    // The accelerations at the inner nodes of a careful step. Where rho is measured, increments themselves go down to
    // rounding: the last ratios are those of the errors that shrink most slowly.
    bool solve(const typename K::Coefficients& k, real time) {
        const bool measures = until_measured == 0;
        const real small = bound(), least = least_distance();
        const Convergence<real> rule{small};
        constexpr real trusted = real(0.015625);  // of rho, where this step has not shown it
        real e_before = real(0), measured = real(0), after[evaluation_limit + 1];  // so many iterations
        for (evaluations = 1; evaluations <= evaluation_limit; ++evaluations) {
            accelerate_nodes(memory, k, time);
            const real e = measured_iteration(memory, least);
            increment = after[evaluations] = e;
            if (e_before > real(256) * Limits<real>::epsilon) measured = maximum(measured, e / e_before);
            const real known = real(4) * maximum(measured, shrinking);  // 4: the motion changes rho
            const real rho = measures ? real(1) : measured > real(0) ? known : maximum(known, trusted);
            const bool is_rounding = e_before > real(0) && rule.stagnates(e, e_before);
            if (rho * e <= small || is_rounding) {
                if (measured > real(0)) shrinking = measures ? measured : maximum(measured, shrinking);
                real enough = shrinking > real(0) ? small / maximum(real(4) * shrinking, trusted) : small;
                if (is_rounding) noise = maximum(noise, minimum(real(2) * e, real(4) * small));
                enough = maximum(enough, noise);
                if (measures) {
                    measured_for = tolerance;
                    interval = minimum(maximum(4 * interval, shortest_interval), longest_interval);
                    until_measured = interval;
                    expected = 1;
                    while (expected < evaluations && after[expected] > enough) ++expected;
                } else {
                    until_measured = interval = shortest_interval;
                    expected = evaluations;
                }
                if (!settle_at(enough, least)) expected = 0;
                return true;
            }
            if (evaluations > rule.judged_after && e_before != real(0) && !rule.contracts(e, e_before)) return false;
            e_before = e;
        }
        return false;
    }

    // (D16), (D17): the end of the step, each sum of increments rounded once.
    template <class Nodes>
    LOBATTO_INLINE bool finish(Nodes& a, const typename K::Coefficients& k, real time) {
        constexpr bool stores = std::is_same_v<Nodes, InRegisters>;
        over_parts<Nodes>([&](int at) LOBATTO_FORMULA {
            V moved = V(h) * load_from<V>(row(a.rate), at), difference = V(weight[0]) * V::load(w_end[now] + at);
#pragma GCC unroll 16
            for (int j = 0; j < m; ++j) {
                const V W = load_from<V>(W_at(a, j), at);
                if constexpr (stores) W.store(w[1 - last] + j * room + at);
                moved = fused(V(arrival[j]), W, moved);
                difference = fused(V(weight[j + 1]), W, difference);
            }
            store_to(arrival_of(a), at, V::load(q[now] + at) + moved);
            store_to(row(a.change), at, difference);
        });
        accelerate(k, time + h, arrival_of(a), W_at_end(a));
        V not_finite = V(real(0));
        over_parts<Nodes>([&](int at) LOBATTO_FORMULA {
            const V W1 = load_from<V>(W_at_end(a), at), q1 = load_from<V>(arrival_of(a), at);
            const V u1 = V::load(u[now] + at) + fused(V(weight[s - 1]), W1, load_from<V>(row(a.change), at));
            u1.store(u[next()] + at);
            if constexpr (stores) {
                q1.store(q[next()] + at);
                W1.store(w_end[next()] + at);
            }
            not_finite = fused(V(real(0)), u1 + q1, not_finite);
        });
        if (any(not_finite != V(real(0)))) return false;
        then = std::exchange(now, next());
        last = 1 - last;
        has_history = true;
        return true;
    }
};

template <class K>
struct FixedPointOf<K, true> {
    using type = NeighbourFixedPoint<K>;
};

}  // namespace lobatto

#endif
// The step of a system with constraints, a constant mass matrix and forces without velocities, by fixed-point
// iteration: no equations larger than those of one node's constraints.
//
// With f = dL/dq + F, W_j = M^-1 (f_j + G_j^T Lambda_j) and the stage map A over all nodes but the last, (D45) is
//     Q_i = q + h c_i v + h^2 sum_j A_ij W_j,   phi(Q_i) = 0,   i = 1 ... m, j = 0 ... m - 1.
// An iteration evaluates f, phi and G at all nodes, in the lanes of Packs, then corrects the multipliers as if G were
// the same all along the step (D48),
//     Lambda <- Lambda - (h^2 A)^-1 phi B^-1,   B = G M^-1 G^T in the middle,
// and then the positions. It contracts like the turn of G within a step.
#ifndef LOBATTO_KERNEL_CONSTRAINED_FIXED_POINT_HPP
#define LOBATTO_KERNEL_CONSTRAINED_FIXED_POINT_HPP

namespace lobatto {

template <class K>
struct ConstrainedFixedPoint {
    using real = typename K::real;
    using Coefficients = typename K::Coefficients;
    static constexpr int n = K::coordinates, constraints = K::constraints, m = K::controls - 1, s = m + 1;
    static constexpr int slopes = K::constraint_entries, evaluation_limit = 40;
    using Layout = NodeLayout<real, real, m - 1, node_lanes<real>>;
    using V = typename Layout::V;
    static constexpr int width = Layout::width, parts = Layout::parts_of(m), lanes = parts * width;

    static constexpr bool is_diagonal() {
        for (int e = 0; e < K::mass_entries; ++e)
            if (K::mass_row[e] != K::mass_column[e]) return false;
        return true;
    }

    struct Arrays {
        V Q[parts * n], f[parts * n], phi[parts * constraints], phi_t[parts * constraints], G[parts * slopes],
            W[parts * n], pull[parts * constraints];
        real flat[n * lanes], off[constraints * lanes], inverse_scale[n], start_W[n];
        real start_f[n], start_phi[constraints], start_phi_t[constraints], start_G[slopes];
        real B[constraints * constraints];
        std::int32_t pivots[constraints];
    };

    real h{}, tolerance{};       // of increments, relative; 0: to rounding
    real inverse_mass[n * n]{};  // diagonal, or whole
    V move[m][parts]{};          // h^2 A, a column for each node but the last
    V drift[parts]{}, node_time[parts]{};
    V weight[parts]{};               // h b
    real back[m * m]{};              // (h^2 A)^-1
    real lambda[constraints * s]{};  // multipliers of the last step
    real w[n * s]{};                 // and W at its nodes
    real Y[n * m]{};                 // displacements at its nodes after the first
    real evaluations{}, increment{};
    bool has_history{}, usable{};
    Workspace<Arrays> workspace;

    void prepare(const Coefficients& k, real step) {
        h = step;
        has_history = false;
        real stiffness[m * m], map[m * s], zero[n] = {}, p[n], M[K::mass_entries];
        for (int j = 0; j < m; ++j) {
            for (int i = 1; i <= m; ++i) {
                real sum = real(0);
                for (int l = 0; l < s; ++l) sum += K::b[l] * K::D[l * s + j] * K::D[l * s + i];
                stiffness[j * m + i - 1] = -sum;
            }
            for (int i = 0; i <= m; ++i) map[j * s + i] = real(0);
            map[j * s + j] = h * (h * K::b[j]);
            map[j * s + m] = j == 0 ? h : real(0);
        }
        usable = solve<m, s>(stiffness, map);  // h^2 A, and h c
        real unit[m * m];
        for (int i = 0; i < m; ++i)
            for (int j = 0; j < m; ++j) {
                stiffness[i * m + j] = map[i * s + j];
                unit[i * m + j] = i == j ? real(1) : real(0);
            }
        usable = usable && solve<m, m>(stiffness, unit);
        for (int i = 0; i < m * m; ++i) back[i] = unit[i];
        for (int i = 0; i < lanes; ++i) {
            const int row = i < m ? i : m - 1;
            for (int j = 0; j < m; ++j) set_lane(move[j][i / width], i % width, map[row * s + j]);
            set_lane(drift[i / width], i % width, map[row * s + m]);
            set_lane(node_time[i / width], i % width, h * K::c[row + 1]);
            set_lane(weight[i / width], i % width, i < m ? h * K::b[i + 1] : real(0));
        }
        Formulas<K>::legendre(k, real(0), static_cast<const real*>(zero), static_cast<const real*>(zero), +p, +M);
        real mass[n * n];
        for (int i = 0; i < n * n; ++i) {
            mass[i] = real(0);
            inverse_mass[i] = i % (n + 1) == 0 ? real(1) : real(0);
        }
        for (int e = 0; e < K::mass_entries; ++e) mass[K::mass_row[e] * n + K::mass_column[e]] = M[e];
        usable = solve<n, n>(mass, inverse_mass) && usable;
    }

    void begin(const real*) { has_history = false; }
    template <class Velocity>
    void recall(const Velocity&) {
        has_history = false;
    }
    real displacement(int c, int j) const { return Y[c * m + j]; }

    // One step, h from `time`; false: it was not solved, and nothing has changed.
    bool step(const Coefficients& k, real time, real* q, real* p, bool) {
        return usable && workspace.with([&](Arrays& a) { return solve_step(k, time, q, p, a); });
    }

private:
    // x = M^-1 y.
    template <class T>
    LOBATTO_INLINE void divide_by_mass(const T* y, T* x) const {
        for (int c = 0; c < n; ++c) {
            x[c] = T(inverse_mass[c * n + c]) * y[c];
            if constexpr (!is_diagonal())
                for (int l = 0; l < n; ++l)
                    if (l != c) x[c] = fused(T(inverse_mass[c * n + l]), y[l], x[c]);
        }
    }
    // y + G^T lambda.
    template <class T>
    LOBATTO_INLINE static void add_pull(const T* G, const T* lambda, T* y) {
#pragma GCC unroll 16
        for (int e = 0; e < slopes; ++e)
            y[K::constraint_column[e]] = fused(G[e], lambda[K::constraint_row[e]], y[K::constraint_column[e]]);
    }
    // B = G M^-1 G^T, factored.
    bool factor(const real* G, real* B, std::int32_t* pivots) const {
        for (int c = 0; c < constraints; ++c) {
            real row[n] = {}, divided[n];
            for (int e = 0; e < slopes; ++e)
                if (K::constraint_row[e] == c) row[K::constraint_column[e]] += G[e];
            divide_by_mass(static_cast<const real*>(row), +divided);
            for (int d = 0; d < constraints; ++d) B[d * constraints + c] = real(0);
            for (int e = 0; e < slopes; ++e)
                B[K::constraint_row[e] * constraints + c] += G[e] * divided[K::constraint_column[e]];
        }
        return factor_dense(B, pivots, std::integral_constant<int, constraints>{});
    }

    void evaluate(const Coefficients& k, real time, Arrays& a) const {
        V rest[n], Lv[n];
        for (int c = 0; c < n; ++c) rest[c] = V(real(0));
        for (int part = 0; part < parts; ++part) {
            const V* const Q = a.Q + part * n;
            const V at = V(time) + node_time[part];
            Formulas<K>::slopes(k, at, Q, static_cast<const V*>(rest), +Lv, a.f + part * n);
            Formulas<K>::constraint(k, at, Q, a.phi + part * constraints, a.phi_t + part * constraints,
                                    a.G + part * slopes);
        }
    }

    // Multipliers of the nodes after the first, in lanes; the last node has none.
    void spread(const real* multipliers, Arrays& a) const {
        for (int c = 0; c < constraints; ++c)
            for (int i = 0; i < lanes; ++i)
                set_lane(a.pull[(i / width) * constraints + c], i % width,
                         i + 1 < m ? multipliers[c * s + i + 1] : real(0));
    }

    // W at all nodes but the last, then the positions; the largest increment, relative.
    real iterate(const real* q, const real* v, const real* multipliers, Arrays& a) const {
        real pull[constraints], y[n];
        for (int c = 0; c < constraints; ++c) pull[c] = multipliers[c * s];
        for (int c = 0; c < n; ++c) y[c] = a.start_f[c];
        add_pull(static_cast<const real*>(a.start_G), static_cast<const real*>(pull), +y);
        divide_by_mass(static_cast<const real*>(y), a.start_W);
        spread(multipliers, a);
        for (int part = 0; part < parts; ++part) {
            V force[n];
            for (int c = 0; c < n; ++c) force[c] = a.f[part * n + c];
            add_pull(static_cast<const V*>(a.G + part * slopes), static_cast<const V*>(a.pull + part * constraints),
                     +force);
            divide_by_mass(static_cast<const V*>(force), a.W + part * n);
        }
        V worst = V(real(0));
        for (int c = 0; c < n; ++c) {
            real* const flat = a.flat + c * lanes;
            lay_flat<parts>(a.W + c, n, flat);
            for (int part = 0; part < parts; ++part) {
                V next = fused(drift[part], V(v[c]), V(q[c]));
                next = fused(move[0][part], V(a.start_W[c]), next);
#pragma GCC unroll 16
                for (int j = 1; j < m; ++j) next = fused(move[j][part], V(flat[j - 1]), next);
                V& now = a.Q[part * n + c];
                worst = maximum(worst, fabs(next - now) * V(a.inverse_scale[c]));
                now = next;
            }
        }
        return largest(worst);
    }

    // Lambda <- Lambda - (h^2 A)^-1 phi B^-1.
    void correct(real* multipliers, Arrays& a) const {
        for (int c = 0; c < constraints; ++c) lay_flat<parts>(a.phi + c, constraints, a.off + c * lanes);
        for (int j = 0; j < m; ++j) {
            real x[constraints];
            for (int c = 0; c < constraints; ++c) {
                x[c] = real(0);
                for (int i = 0; i < m; ++i) x[c] += back[j * m + i] * a.off[c * lanes + i];
            }
            solve_dense(a.B, a.pivots, x, std::integral_constant<int, constraints>{});
            for (int c = 0; c < constraints; ++c) multipliers[c * s + j] -= x[c];
        }
    }

    bool solve_step(const Coefficients& k, real time, real* q, real* p, Arrays& a) {
        real v[n], multipliers[constraints * s];
        divide_by_mass(static_cast<const real*>(p), +v);
        begin_step(k, time, q, v, multipliers, a);
        set_measures(q, v, a);
        const real small = maximum(tolerance, Limits<real>::epsilon);
        const Convergence<real, 1, Pace<4, 70, 16>> rule{small};
        real e_before = Limits<real>::largest;
        evaluations = real(0);
        for (int evaluation = 1; evaluation <= evaluation_limit; ++evaluation) {
            evaluate(k, time, a);
            evaluations += real(1);
            if (evaluation == 1 && !factor_middle(a)) return false;
            correct(multipliers, a);
            const real e = iterate(q, v, multipliers, a);
            if (!is_finite(e) || (evaluation > rule.judged_after && !rule.contracts(e, e_before))) return false;
            if (evaluation > 1 && (rule.is_small(e) || rule.stagnates(e, e_before))) {
                increment = e;
                return finish(k, time, q, p, multipliers, a);
            }
            e_before = e;
        }
        return false;
    }

    bool factor_middle(Arrays& a) const {
        constexpr int middle = (m - 1) / 2;
        real G[slopes];
        for (int e = 0; e < slopes; ++e) G[e] = a.G[(middle / width) * slopes + e][middle % width];
        return factor(G, a.B, a.pivots);
    }

    // Formulas at the start; W and the multipliers continued from the last step, and positions with them.
    void begin_step(const Coefficients& k, real time, const real* q, const real* v, real* multipliers,
                    Arrays& a) const {
        real rest[n] = {}, Lv[n];
        Formulas<K>::slopes(k, time, q, static_cast<const real*>(rest), +Lv, a.start_f);
        Formulas<K>::constraint(k, time, q, a.start_phi, a.start_phi_t, a.start_G);
        const auto continued = [](const real* last, int j) {
            real sum = real(0);
            for (int i = 0; i < s; ++i) sum += K::extrapolation[j * s + i] * last[i];
            return sum;
        };
        for (int c = 0; c < constraints; ++c)
            for (int j = 0; j < s; ++j) multipliers[c * s + j] = has_history ? continued(lambda + c * s, j) : real(0);
        for (int c = 0; c < n; ++c) {
            real W[m];
            for (int j = 0; j < m; ++j) W[j] = has_history ? continued(w + c * s, j) : real(0);
            for (int part = 0; part < parts; ++part) {
                V next = fused(drift[part], V(v[c]), V(q[c]));
                for (int j = 0; j < m; ++j) next = fused(move[j][part], V(W[j]), next);
                a.Q[part * n + c] = next;
            }
        }
    }

    // What increments of each coordinate are measured by: its position, its way in the step, and how far the equations
    // it stands in move it when the coordinates beside it move by as much as they are measured by.
    void set_measures(const real* q, const real* v, Arrays& a) const {
        real own[n], joined[n] = {}, size[constraints] = {}, square[constraints] = {};
        const auto inverse = [&](int c) { return fabs(inverse_mass[c * n + c]); };
        for (int c = 0; c < n; ++c)
            own[c] = maximum(fabs(h * v[c]) + h * (h * inverse(c)) * fabs(a.start_f[c]), fabs(q[c]));
        for (int e = 0; e < slopes; ++e) {
            const int c = K::constraint_column[e];
            size[K::constraint_row[e]] += fabs(a.start_G[e]) * own[c];
            square[K::constraint_row[e]] += inverse(c) * (a.start_G[e] * a.start_G[e]);
        }
        for (int e = 0; e < slopes; ++e) {
            const int c = K::constraint_column[e], row = K::constraint_row[e];
            joined[c] += inverse(c) * fabs(a.start_G[e]) * (size[row] / maximum(square[row], Limits<real>::smallest));
        }
        for (int c = 0; c < n; ++c) a.inverse_scale[c] = real(1) / maximum(own[c] + joined[c], Limits<real>::smallest);
    }

    // Formulas at the nodes once more; then the momentum, and the multiplier that keeps the velocity at the end (D46).
    bool finish(const Coefficients& k, real time, real* q, real* p, real* multipliers, Arrays& a) {
        evaluate(k, time, a);
        real q1[n], p1[n], G1[slopes], mu[constraints], not_finite = real(0);
        real pull[constraints];
        for (int c = 0; c < constraints; ++c) pull[c] = multipliers[c * s];
        real y[n];
        for (int c = 0; c < n; ++c) y[c] = a.start_f[c];
        add_pull(static_cast<const real*>(a.start_G), static_cast<const real*>(pull), +y);
        spread(multipliers, a);
        for (int part = 0; part < parts; ++part)
            add_pull(static_cast<const V*>(a.G + part * slopes), static_cast<const V*>(a.pull + part * constraints),
                     a.f + part * n);
        constexpr int last = m - 1;
        for (int c = 0; c < n; ++c) {
            V total = weight[0] * a.f[c];
            for (int part = 1; part < parts; ++part) total = fused(weight[part], a.f[part * n + c], total);
            q1[c] = a.Q[(last / width) * n + c][last % width];
            p1[c] = p[c] + (h * K::b[0] * y[c] + sum(total));
            not_finite += (q1[c] - q1[c]) + (p1[c] - p1[c]);
        }
        for (int e = 0; e < slopes; ++e) G1[e] = a.G[(last / width) * slopes + e][last % width];
        if (not_finite != real(0) || !factor(G1, a.B, a.pivots)) return false;
        for (int c = 0; c < constraints; ++c) multipliers[c * s + m] = real(0);
        for (int look = 0; look < 2; ++look) {  // the second takes the rounding of the first away
            real v1[n];
            divide_by_mass(static_cast<const real*>(p1), +v1);
            for (int c = 0; c < constraints; ++c) mu[c] = a.phi_t[(last / width) * constraints + c][last % width];
            for (int e = 0; e < slopes; ++e) mu[K::constraint_row[e]] += G1[e] * v1[K::constraint_column[e]];
            solve_dense(a.B, a.pivots, mu, std::integral_constant<int, constraints>{});
            for (int c = 0; c < constraints; ++c) {
                multipliers[c * s + m] -= mu[c] / (h * K::b[m]);
                mu[c] = -mu[c];
            }
            add_pull(static_cast<const real*>(G1), static_cast<const real*>(mu), +p1);
        }
        remember(q, p, q1, p1, G1, multipliers, y, a);
        return true;
    }

    void remember(real* q, real* p, const real* q1, const real* p1, const real* G1, const real* multipliers,
                  const real* start_force, Arrays& a) {
        constexpr int last = m - 1;
        real force[n], pull[constraints];
        for (int c = 0; c < constraints; ++c) pull[c] = multipliers[c * s + m];
        for (int part = 0; part < parts; ++part) divide_by_mass(static_cast<const V*>(a.f + part * n), a.W + part * n);
        real W0[n], W1[n];
        divide_by_mass(start_force, +W0);
        for (int c = 0; c < n; ++c) force[c] = a.f[(last / width) * n + c][last % width];
        add_pull(G1, static_cast<const real*>(pull), +force);
        divide_by_mass(static_cast<const real*>(force), +W1);
        for (int c = 0; c < n; ++c) {
            w[c * s] = W0[c];
            w[c * s + m] = W1[c];
            for (int j = 0; j < m; ++j) {
                Y[c * m + j] = a.Q[(j / width) * n + c][j % width] - q[c];
                if (j + 1 < m) w[c * s + j + 1] = a.W[(j / width) * n + c][j % width];
            }
        }
        for (int i = 0; i < constraints * s; ++i) lambda[i] = multipliers[i];
        for (int c = 0; c < n; ++c) {
            q[c] = q1[c];
            p[c] = p1[c];
        }
        has_history = true;
    }
};

}  // namespace lobatto

#endif
// The step of any Lagrangian system by iterations over its nodes: no equations larger than the mass matrix of one node.
//
// With V, P = dL/dv and F = dL/dq + forces at the r nodes, A the matrix that integrates over the node polynomials,
// A'_ij = b_j (1 - A_ji / b_i), and pi the Legendre polynomial of degree r - 1 for Lobatto's nodes, nothing for
// Gauss's, the Galerkin equations (D28) are (D35)
//     Q_i = q + h sum_j A_ij V_j,   P_i = p + h sum_j A'_ij F_j + kappa pi_i,   P_i = L_v(Q_i, V_i),   sum_i b_i pi_i
//     V_i = 0 q1 = q + h sum_j b_j V_j,     p1 = p + h sum_j b_j F_j
// An iteration takes F, L_v and M = L_vv at all nodes, then P, then V <- V + M^-1 (P - L_v) with the kappa that keeps
// the last sum zero, then Q: where M varies little it contracts like h^2, not like h, because Q is new in every
// iteration. Angles are taken from those at the start of the step (base/angles.hpp).
#ifndef LOBATTO_KERNEL_GALERKIN_HPP
#define LOBATTO_KERNEL_GALERKIN_HPP

#include <type_traits>

namespace lobatto {

// M = L D L^T of a symmetric matrix, in place: L below the diagonal, 1/D on it. No pivoting: a mass matrix is positive
// definite as a rule, and where it is not, what fails shows as not finite or not converging.
template <int n, class V>
LOBATTO_INLINE void factor_symmetric(V* M) {
#pragma GCC unroll 8
    for (int k = 0; k < n; ++k) {
        V row[n];  // L_kj D_j
        V pivot = M[k * n + k];
#pragma GCC unroll 8
        for (int j = 0; j < k; ++j) {
            row[j] = M[k * n + j];
#pragma GCC unroll 8
            for (int l = 0; l < j; ++l) row[j] = fused(-row[l], M[j * n + l], row[j]);
            M[k * n + j] = row[j] * M[j * n + j];
            pivot = fused(-row[j], M[k * n + j], pivot);
        }
        M[k * n + k] = V(real_of<V>(1)) / pivot;
    }
}
template <int n, class V>
LOBATTO_INLINE void solve_symmetric(const V* M, V* x) {
#pragma GCC unroll 8
    for (int k = 1; k < n; ++k)
#pragma GCC unroll 8
        for (int j = 0; j < k; ++j) x[k] = fused(-M[k * n + j], x[j], x[k]);
    for (int k = n - 1; k >= 0; --k) {
        x[k] *= M[k * n + k];
#pragma GCC unroll 8
        for (int j = k + 1; j < n; ++j) x[k] = fused(-M[j * n + k], x[j], x[k]);
    }
}

template <class K, class T>
struct GalerkinFixedPoint {
    using real = typename K::real;
    static constexpr int n = K::coordinates, r = K::nodes;
    using Layout = NodeLayout<real, T, r - 1>;  // r nodes
    using V = typename Layout::V;
    static constexpr bool in_lanes = Layout::in_lanes;
    static constexpr int width = Layout::width, parts = Layout::parts_of(r), entries = K::mass_entries;
    static constexpr int evaluation_limit = 30;
    using ActiveMask = decltype(T() < T());

    static constexpr bool has_kappa() {
        for (int i = 0; i < r; ++i)
            if (K::legendre_polynomial[i] != real(0)) return true;
        return false;
    }

    struct Arrays {
        V Q[parts * n], v[parts * n], Lv[parts * n], F[parts * n], M[parts * n * n];
        T flat[n * parts * width], flat_v[n * parts * width], inverse_scale[n];
        AngleTable<V, parts, K::angles> near;
    };

    V position_map[r][parts], momentum_map[r][parts];  // h A and h A', a column for each node
    V weight[parts], legendre[parts];                  // h b and pi; zero in lanes to spare
    V ahead[r][parts], node_time[parts];
    real h{};
    real tolerance{};  // of increments, relative; 0: to rounding
    T v[n * r];        // velocities at the nodes of the last step
    T kappa[n];        // of the last step
    T evaluations;     // of the last step
    T increment;       // the last one of the last step, relative
    T elapsed;         // of kernels with a clock: the physical time of the last step, sum_i h b_i clock(Q_i)
    Workspace<Arrays> workspace;

    void prepare(real step) {
        h = step;
        for (int i = 0; i < parts * width; ++i) {
            const bool is_node = i < r;
            const int node = is_node ? i : r - 1;
            for (int j = 0; j < r; ++j) {
                put(position_map[j], i, h * K::integration[node * r + j]);
                put(momentum_map[j], i, h * (K::b[j] * (real(1) - K::integration[j * r + node] / K::b[node])));
                put(ahead[j], i, K::ahead[node * r + j]);
            }
            put(node_time, i, h * K::c[node]);
            put(weight, i, is_node ? h * K::b[node] : real(0));
            put(legendre, i, K::legendre_polynomial[node]);
        }
    }

    // Begins with this velocity.
    void begin(const real* velocity, int lane = 0) {
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            for (int i = 0; i < r; ++i) set_lane(v[c * r + i], lane, velocity[c]);
            set_lane(kappa[c], lane, real(0));
        }
    }

    // One step of the lanes that are `active`, h from `time`. The lanes that the answer names have moved; the others
    // stay.
    template <class Given>
    ActiveMask step(const Given& k, real time, T* q, T* p, ActiveMask active) {
        return workspace.with([&](Arrays& a) { return step_in(k, time, q, p, active, a); });
    }

    // Displacement and velocity of coordinate c of the last step at control point j + 1 and node i.
    T displacement(int c, int j) const {
        T sum = T(real(0));
        for (int i = 0; i < r; ++i) sum = fused(T(K::reach[j * r + i]), v[c * r + i], sum);
        return T(h) * sum;
    }
    // The memory of a step taken otherwise.
    template <class Velocity>
    void recall(const Velocity& velocity, int lane = 0) {
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c)
            for (int i = 0; i < r; ++i) set_lane(v[c * r + i], lane, velocity(c, i));
    }

private:
    static void put(V* values, int i, real x) {
        if constexpr (in_lanes)
            set_lane(values[i / width], i % width, x);
        else
            values[i] = V(x);
    }

    // base + sum_j column_j x_j of one part.
    LOBATTO_INLINE static V sum_of(const V& base, const V (*column)[parts], int p, const T* x) {
        V even = base, odd = V(real(0));
#pragma GCC unroll 16
        for (int j = 0; j < r; ++j) {
            V& sum = j % 2 == 0 ? even : odd;
            sum = fused(column[j][p], V(x[j]), sum);
        }
        return even + odd;
    }
    // sum_i w_i x_i over the nodes.
    LOBATTO_INLINE static T over_nodes(const V* w, const V* x, int stride) {
        V total = w[0] * x[0];
        for (int p = 1; p < parts; ++p) total = fused(w[p], x[p * stride], total);
        if constexpr (in_lanes)
            return sum(total);
        else
            return total;
    }

    template <class Given>
    ActiveMask step_in(const Given& k, real time, T* q, T* p, ActiveMask active, Arrays& a) {
        constexpr real floor = Limits<real>::epsilon / Limits<real>::root_epsilon;
        // Each coordinate has its own measure: increments as small as its rounding are so whatever the others do.
        const real least = maximum(tolerance, Limits<real>::epsilon);
        T kappa_now[n];
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            T* const flat = a.flat + c * parts * width;
            V fastest = V(real(0));
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) {
                V& v_part = a.v[part * n + c];
                v_part = sum_of(V(real(0)), ahead, part, v + c * r);
                lay_flat<1>(&v_part, 1, flat + part * width);
                fastest = maximum(fastest, fabs(v_part));
            }
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) a.Q[part * n + c] = sum_of(V(q[c]), position_map, part, flat);
            T speed;
            if constexpr (in_lanes)
                speed = largest(fastest);
            else
                speed = fastest;
            const T scale = fabs(T(h)) * speed + T(floor) * fabs(q[c]);
            const T rounding = T(Limits<real>::epsilon / least) * fabs(q[c]) + T(Limits<real>::smallest);
            a.inverse_scale[c] = fabs(T(h)) / maximum(scale, rounding);
            kappa_now[c] = kappa[c];
        }
        if constexpr (K::angles > 0) prepare_angles(k, time, q, a);
        // Velocities are kept, positions are made of them: more rounding, and ratios that tell less.
        const Convergence<T, 1, Pace<4, 90, 32>> rule{T(real(2) * least)};
        ActiveMask solved = active & !active;
        T e_before = T(Limits<real>::largest);
        evaluations = T(real(0));
        for (int evaluation = 1; evaluation <= evaluation_limit; ++evaluation) {
            evaluations = select(active, evaluations + T(real(1)), evaluations);
            const T e = iterate(k, time, q, p, kappa_now, a);
            if (evaluation > rule.judged_after) active = active & rule.contracts(e, e_before);
            const ActiveMask done = active & (rule.is_small(e) | rule.stagnates(e, e_before));
            if (any(done)) {
                increment = select(done, e, increment);
                solved = solved | finish(k, time, q, p, kappa_now, done, a);
                active = active & !done;
            }
            if (!any(active)) break;
            e_before = e;
        }
        return solved;
    }

    // The angles at the start of the step are those that all its nodes are near; those of velocities with the velocity
    // of the last step's last node. Nothing else of the stage is computed.
    template <class Given>
    LOBATTO_INLINE void prepare_angles(const Given& k, real time, const T* q, Arrays& a) const {
        using Start = Pack<real, lanes_of<T>>;
        Angle<Start> angles[K::angles];
        Start position[n], velocity[n], Lv[n], F[n], M[entries];
        for (int c = 0; c < n; ++c) {
            position[c] = Start(q[c]);
            velocity[c] = Start(v[c * r + r - 1]);
        }
        Formulas<K>::stage(k, Start(time), static_cast<const Start*>(position), static_cast<const Start*>(velocity),
                           +Lv, +F, +M, AnglesKept<Start>{angles});
        const auto spread = [](const Start& x) LOBATTO_FORMULA {
            if constexpr (in_lanes)
                return V(x[0]);
            else
                return x;
        };
        for (int part = 0; part < parts; ++part)
            for (int i = 0; i < K::angles; ++i)
                a.near.of(part)[i] = {spread(angles[i].x), spread(angles[i].sine), spread(angles[i].cosine)};
    }

    // One iteration; the largest change of a velocity, relative.
    template <class Given>
    LOBATTO_INLINE T iterate(const Given& k, real time, const T* q, const T* p, T* kappa_now, Arrays& a) {
#pragma GCC unroll 8
        for (int part = 0; part < parts; ++part) {
            V packed[entries];
            V* const M = a.M + part * n * n;
            const V* const Q = a.Q + part * n;
            const V* const velocity = a.v + part * n;
            if constexpr (K::angles > 0)
                Formulas<K>::stage(k, V(time) + node_time[part], Q, velocity, a.Lv + part * n, a.F + part * n, +packed,
                                   AnglesNear<V>{a.near.of(part)});
            else
                Formulas<K>::stage(k, V(time) + node_time[part], Q, velocity, a.Lv + part * n, a.F + part * n, +packed);
#pragma GCC unroll 8
            for (int i = 0; i < n * n; ++i) M[i] = V(real(0));
            for (int e = 0; e < entries; ++e) M[K::mass_row[e] * n + K::mass_column[e]] = packed[e];
            factor_symmetric<n>(M);
        }
        // P - L_v
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            T* const flat = a.flat + c * parts * width;
            lay_flat<parts>(a.F + c, n, flat);
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) {
                V& residual = a.Lv[part * n + c];
                V target = sum_of(V(p[c]) - residual, momentum_map, part, flat);
                if constexpr (has_kappa()) target = fused(legendre[part], V(kappa_now[c]), target);
                residual = target;
            }
        }
#pragma GCC unroll 8
        for (int part = 0; part < parts; ++part) {
            V* const x = a.Lv + part * n;
            solve_symmetric<n>(a.M + part * n * n, x);
#pragma GCC unroll 8
            for (int c = 0; c < n; ++c) x[c] += a.v[part * n + c];  // the new velocities
        }
        if constexpr (has_kappa()) correct(kappa_now, a);
        V worst = V(real(0));
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            T* const flat = a.flat_v + c * parts * width;
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) {
                V &next = a.Lv[part * n + c], &now = a.v[part * n + c];
                worst = maximum(worst, fabs(next - now) * V(a.inverse_scale[c]));
                now = next;
                lay_flat<1>(&now, 1, flat + part * width);
            }
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) a.Q[part * n + c] = sum_of(V(q[c]), position_map, part, flat);
        }
        if constexpr (in_lanes)
            return fabs(largest(worst));
        else
            return fabs(worst);
    }

    // kappa <- kappa + d, V <- V + M^-1 pi d with sum b pi V = 0.
    LOBATTO_INLINE void correct(T* kappa_now, Arrays& a) {
        V weighted[parts];  // h b pi
#pragma GCC unroll 8
        for (int part = 0; part < parts; ++part) weighted[part] = weight[part] * legendre[part];
        T S[n * n], d[n];
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) d[c] = -over_nodes(weighted, a.Lv + c, n);
            // S = sum h b pi^2 M^-1, column by column.
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            V columns[parts * n];
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) {
#pragma GCC unroll 8
                for (int i = 0; i < n; ++i) columns[part * n + i] = i == c ? legendre[part] : V(real(0));
                solve_symmetric<n>(a.M + part * n * n, columns + part * n);
            }
#pragma GCC unroll 8
            for (int i = c; i < n; ++i) S[i * n + c] = over_nodes(weighted, columns + i, n);
        }
        factor_symmetric<n>(S);
        solve_symmetric<n>(S, d);
#pragma GCC unroll 8
        for (int part = 0; part < parts; ++part) {
            V x[n];
#pragma GCC unroll 8
            for (int c = 0; c < n; ++c) x[c] = legendre[part] * V(d[c]);
            solve_symmetric<n>(a.M + part * n * n, x);
#pragma GCC unroll 8
            for (int c = 0; c < n; ++c) a.Lv[part * n + c] += x[c];
        }
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) kappa_now[c] += d[c];
    }

    template <class Given>
    ActiveMask finish(const Given& k, [[maybe_unused]] real time, T* q, T* p, const T* kappa_now, ActiveMask done,
                      Arrays& a) {
        T q1[n], p1[n], not_finite = T(real(0));
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            q1[c] = q[c] + over_nodes(weight, a.v + c, n);
            p1[c] = p[c] + over_nodes(weight, a.F + c, n);
            not_finite += (q1[c] - q1[c]) + (p1[c] - p1[c]);
        }
        if constexpr (K::clocked) {
            V rate[parts];
            for (int part = 0; part < parts; ++part)
                rate[part] = Formulas<K>::clock(k, V(time), static_cast<const V*>(a.Q + part * n));
            const T passed = over_nodes(weight, rate, 1);
            not_finite += passed - passed;
            elapsed = select(done, passed, elapsed);
        }
        done = done & (not_finite == T(real(0)));
        if (!any(done)) return done;
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            const T* const flat = a.flat_v + c * parts * width;
            for (int i = 0; i < r; ++i) v[c * r + i] = select(done, flat[i], v[c * r + i]);
            kappa[c] = select(done, kappa_now[c], kappa[c]);
            q[c] = select(done, q1[c], q[c]);
            p[c] = select(done, p1[c], p[c]);
        }
        return done;
    }
};

template <class K, class T, Stepping stepping>
struct LaneStepper<K, T, Form::general, stepping> {
    using real = typename K::real;
    using Chain = Stepper<FallbackKernel<K>, Form::general, Stepping::solved>;
    using ActiveMask = decltype(T() < T());
    static constexpr int n = K::coordinates;
    T q[n], p[n], evaluations = T(real(0));
    GalerkinFixedPoint<K, T> fixed_point;

    const T& position(int c) const { return q[c]; }
    void prepare(const ScalarFallback<K>& single, int) { fixed_point.prepare(single.step_size); }
    void set_tolerance(real tolerance) { fixed_point.tolerance = tolerance; }
    void start(const ScalarFallback<K>& single, const real*, int lane) {
        follow_state(single, lane);
        real velocity[n] = {};
        const Chain& chain = single;  // with a clock: dq/dtau
        chain.velocity(chain.time(), single.q, single.p, velocity);
        fixed_point.begin(velocity, lane);
    }
    void momentum(const ScalarFallback<K>&, int lane, real* momentum) const {
        for (int c = 0; c < n; ++c) momentum[c] = lane_of(p[c], lane);
    }
    template <class Given>
    [[gnu::noinline]] ActiveMask step(const Given& k, real time, ActiveMask active) {
        const ActiveMask moved = fixed_point.step(k, time, q, p, active);
        evaluations = fixed_point.evaluations;
        return moved;
    }
    void follow(const ScalarFallback<K>& single, int lane) {
        follow_state(single, lane);
        fixed_point.recall([&](int c, int i) { return single.node_velocity(c, i); }, lane);
    }

private:
    void follow_state(const ScalarFallback<K>& single, int lane) {
        for (int c = 0; c < n; ++c) {
            set_lane(q[c], lane, single.q[c]);
            set_lane(p[c], lane, single.p[c]);
        }
    }
};

}  // namespace lobatto

#endif
// The Galerkin equations of one step of any Lagrangian system, assembled from one node's derivatives.
//
// Of the n coordinates n_a are active (active_index[]); the others are cyclic (cyclic_index[]), and their momenta P are
// conserved. Control points 0 = x_0 < ... < x_m = 1 carry the positions X_j of the active ones; X_0 is the start, X_m
// the end. Nodes c_i with weights b_i, i = 1 ... r, are where the Lagrangian is looked at, at time t + c_i h:
//     v_i = (1/h) sum_j D_ij X_j,   q_i = sum_j B_ij X_j,   P_i = P + kappa pi(c_i),   B_ij = l_j(c_i), D_ij =
//     l_j'(c_i)
// with pi the shifted Legendre polynomial of degree r - 1 for Lobatto's nodes, where the conserved momenta are so only
// in the mean, and nothing for Gauss's. z = (v, q, P), R(z) = L - P . v_c with the cyclic velocities v_c eliminated, F
// the forces, g = (R_v, R_q + F, R_P = -v_c), and H its derivative:
//     sum_i h b_i [ (D_ij / h) g_v(i) + B_ij g_q(i) ] + delta_j0 p0 = 0,  j = 0 ... m - 1,
//     sum_i h b_i pi_i g_P(i) = 0,
//     q1 = X_m,  p1 = p0 + h sum_i b_i g_q(i)  (the sum over all j, because sum_j l_j = 1),
//     P1 = P,  cyclic positions + h sum_i b_i v_c(i).
// The unknowns are the displacements Y_j = X_j - X_0, j = 1 ... m, and kappa.
//
// Constraints phi(q, t) = 0, G = dphi/dq, add L + phi . Lambda, where Lambda_i belongs to node i and control points are
// nodes (Lobatto; D45): z and g have one slot more for each, the multiplier and phi itself. Their equations and
// unknowns are those of one more block each,
//     phi(X_j, t + x_j h) = 0, j = 1 ... m;  Lambda_0 ... Lambda_(m - 1);
// Lambda_m follows from the momentum at the end (iteration/velocity_of_momentum.hpp).
//
// A kernel of this form provides: active, cyclic and their tables; nodes (r), controls (m + 1), c, b, control, B, D,
// extrapolation (l_k(1 + x_j)), legendre_polynomial (pi_i, all zero for Gauss); the tables of base/solve.hpp for the
// active coordinates; node(k, z, g, H), slope(k, z, g); entries, entry_row, entry_column of H;
// legendre(k, q, velocity, p, M), mass_entries, mass_row, mass_column; momentum(k, q, velocity, p);
// energy(k, q, velocity); slopes(k, q, velocity, Lv, Lq), dL/dv and dL/dq + F over all coordinates.
#ifndef LOBATTO_KERNEL_GALERKIN_EQUATIONS_HPP
#define LOBATTO_KERNEL_GALERKIN_EQUATIONS_HPP

#include <type_traits>

namespace lobatto {

// The kinds of slots of z.
enum class Slot { velocity, position, momentum, multiplier };

// The tables of a kernel's nodes, in the sums that a step needs. Where a table has zeros is known to the compiler.
template <class K>
struct NodeTables {
    using real = typename K::real;
    static constexpr int active = K::active, cyclic = K::cyclic, constraints = K::constraints;
    static constexpr int blocks = active + constraints, Z = 2 * active + cyclic + constraints;
    static constexpr int r = K::nodes, m = K::controls - 1;
    static_assert(cyclic == 0 || constraints == 0, "with constraints all coordinates are active");

    static constexpr Slot kind(int slot) {
        return slot < active                ? Slot::velocity
               : slot < 2 * active          ? Slot::position
               : slot < 2 * active + cyclic ? Slot::momentum
                                            : Slot::multiplier;
    }
    // The block of unknowns that a slot depends on: a coordinate, or after them a kappa or a multiplier.
    static constexpr int block(int slot) { return slot < active ? slot : slot - active; }

    static constexpr bool has_kappa() {
        for (int i = 0; i < r; ++i)
            if (cyclic > 0 && K::legendre_polynomial[i] != real(0)) return true;
        return false;
    }
    // Every node is a control point: B = I.
    static constexpr bool is_nodal() {
        if (r != m + 1) return false;
        for (int i = 0; i < r; ++i)
            for (int j = 0; j <= m; ++j)
                if (K::B[i * (m + 1) + j] != (i == j ? real(1) : real(0))) return false;
        return true;
    }
    // dz/dX_j at node i without its power of h.
    static constexpr real weight(Slot slot, int i, int j) {
        return slot == Slot::velocity   ? K::D[i * (m + 1) + j]
               : slot == Slot::position ? K::B[i * (m + 1) + j]
                                        : K::legendre_polynomial[i];
    }
    static constexpr int diagonal_entry(int slot) {
        for (int e = 0; e < K::entries; ++e)
            if (K::entry_row[e] == slot && K::entry_column[e] == slot) return e;
        return -1;
    }
};

// b_i weight_ij weight_ik of the kinds of a row and a column: rows j = 0 ... m - 1, columns k = 1 ... m, at
// [(j * m + k - 1) * r + i].
template <class K, Slot row, Slot column>
struct NodeProducts {
    using Tables = NodeTables<K>;
    static constexpr int r = Tables::r, m = Tables::m;
    static constexpr int rows = row == Slot::momentum ? 1 : m, columns = column == Slot::momentum ? 1 : m;
    typename K::real value[rows * columns * r]{};
    constexpr NodeProducts() {
        for (int j = 0; j < rows; ++j)
            for (int k = 0; k < columns; ++k)
                for (int i = 0; i < r; ++i)
                    value[(j * columns + k) * r + i] =
                        K::b[i] * Tables::weight(row, i, j) * Tables::weight(column, i, k + 1);
    }
};
template <class K, Slot row, Slot column>
constexpr NodeProducts<K, row, column> node_products{};

// A motion with the equations of its steps. What is marked `solver` is in the order of the unknowns that solve.hpp has.
template <class K>
struct GalerkinEquations : Motion<K> {
    using typename Motion<K>::real;
    using Motion<K>::n, Motion<K>::coefficients, Motion<K>::step_size;
    using Tables = NodeTables<K>;
    static constexpr int active = K::active, cyclic = K::cyclic, Z = Tables::Z, r = Tables::r, m = Tables::m;
    static constexpr int constraints = Tables::constraints, blocks = Tables::blocks;
    static constexpr int kappas = Tables::has_kappa() ? cyclic : 0;
    static constexpr bool nodal = Tables::is_nodal();
    static_assert(nodal || constraints == 0, "constraints hold at control points, and multipliers belong to nodes");
    static constexpr int N = blocks * m + kappas;
    static constexpr int nodes = K::nodes;
    static constexpr int room = N > 0 ? N : 1, entry_room = K::entries > 0 ? K::entries : 1;
    static constexpr int cyclic_room = cyclic > 0 ? cyclic : 1, mass_room = K::mass_entries > 0 ? K::mass_entries : 1;

    struct Empty {  // no unknowns: nothing to solve
        void clear() {}
        bool factor() { return true; }
        void solve(real*) const {}
    };
    using Layout = Grouped<K, blocks, m, kappas>;
    using Matrix = std::conditional_t<(N > 0), GroupedMatrix<real, Layout>, Empty>;
    struct Arrays {
        real Y[room], delta[room], kappa_scale[cyclic_room];
        real z[r * Z], g[r * Z], H[r * entry_room];
        real q1[n], p1[n];
        Matrix matrix;
    };

    real p[n]{};  // momentum
    Workspace<Arrays> workspace;

    // R at the positions X of the control points 1 ... m, control-major, and kappa; rows j * n_a + a, then kappa's.
    // With constraints Lambda_(j - 1) follows each X_j, and phi(X_j) each row.
    Status residual(real time, const real* position, const real* momentum, const real* X, real* F) const {
        workspace.with([&](Arrays& a) {
            take_unknowns(position, X, a.Y);
            for (int i = 0; i < r; ++i) {
                node_variables(position, momentum, a.Y, i, a.z + i * Z);
                Formulas<K>::slope(coefficients, time + K::c[i] * step_size, a.z + i * Z, a.g + i * Z);
            }
            sum_over_nodes(a.g, a.delta);
            for (int b = 0; b < active; ++b) a.delta[Layout::index(b, 0)] += momentum[K::active_index[b]];
            for (int b = 0; b < blocks; ++b)
                for (int j = 0; j < m; ++j) F[j * blocks + b] = a.delta[Layout::index(b, j)];
            for (int c = 0; c < kappas; ++c) F[active * m + c] = a.delta[active * m + c];
        });
        return Status::ok;
    }

    // dR/dX, N x N, in the order of `residual`.
    Status jacobian(real time, const real* position, const real* momentum, const real* X, real* J) const {
        workspace.with([&](Arrays& a) {
            take_unknowns(position, X, a.Y);
            evaluate_nodes(time, position, momentum, a.Y, a);
            a.matrix.clear();
            assemble(a.H, entry_room, a.matrix);
            const auto index = [](int u, int j) { return u < blocks ? j * blocks + u : blocks * (m - 1) + u; };
            for (int i = 0; i < N * N; ++i) J[i] = real(0);
            for (int e = 0; e < K::entries; ++e) {
                const int u = Tables::block(K::entry_row[e]), v = Tables::block(K::entry_column[e]);
                if ((u >= blocks || v >= blocks) && kappas == 0) continue;
                for (int j = 0; j < (u < blocks ? m : 1); ++j)
                    for (int k = 0; k < (v < blocks ? m : 1); ++k)
                        J[index(u, j) * N + index(v, k)] = a.matrix(u, j, v, k);
            }
        });
        return Status::ok;
    }

protected:
    static void take_unknowns(const real* position, const real* X, real* Y_sorted) {
        for (int a = 0; a < active; ++a)
            for (int j = 0; j < m; ++j)
                Y_sorted[Layout::index(a, j)] = X[j * blocks + a] - position[K::active_index[a]];
        for (int c = active; c < blocks; ++c)
            for (int j = 0; j < m; ++j) Y_sorted[Layout::index(c, j)] = X[j * blocks + c];
        for (int c = 0; c < kappas; ++c) Y_sorted[active * m + c] = X[active * m + c];
    }

    // dz = T dX at node i, dX in the order of the solver.
    void apply_node_map(const real* dX, int i, real* dz) const {
        const real inverse_h = real(1) / step_size;
        for (int a = 0; a < active; ++a) {
            const real* const x = dX + Layout::index(a, 0);
            real v = real(0), moved = real(0);
            for (int j = 0; j < m; ++j) v += K::D[i * (m + 1) + j + 1] * x[j];
            if constexpr (nodal) {
                if (i > 0) moved = x[i - 1];
            } else {
                for (int j = 0; j < m; ++j) moved += K::B[i * (m + 1) + j + 1] * x[j];
            }
            dz[a] = v * inverse_h;
            dz[active + a] = moved;
        }
        for (int c = 0; c < cyclic; ++c)
            dz[2 * active + c] = kappas > 0 ? K::legendre_polynomial[i] * dX[active * m + c] : real(0);
        for (int c = active; c < blocks; ++c) dz[active + c] = i < m ? dX[Layout::index(c, i)] : real(0);
    }

    void node_variables(const real* position, const real* momentum, const real* displacement, int i, real* z) const {
        apply_node_map(displacement, i, z);
        for (int a = 0; a < active; ++a) z[active + a] += position[K::active_index[a]];
        for (int c = 0; c < cyclic; ++c) z[2 * active + c] += momentum[K::cyclic_index[c]];
    }

    void evaluate_nodes(real time, const real* position, const real* momentum, const real* displacement,
                        Arrays& a) const {
        for (int i = 0; i < r; ++i) {
            node_variables(position, momentum, displacement, i, a.z + i * Z);
            Formulas<K>::node(coefficients, time + K::c[i] * step_size, a.z + i * Z, a.g + i * Z, a.H + i * entry_room);
        }
    }

    // sum_i h b_i T_i^T g_i in the order of the solver: the residual without p0.
    void sum_over_nodes(const real* g, real* sum) const {
        for (int a = 0; a < active; ++a)
            for (int j = 0; j < m; ++j) {
                real from_velocity = real(0), from_position = real(0);
                for (int i = 0; i < r; ++i) from_velocity += K::b[i] * K::D[i * (m + 1) + j] * g[i * Z + a];
                if constexpr (nodal) {
                    from_position = K::b[j] * g[j * Z + active + a];
                } else {
                    for (int i = 0; i < r; ++i)
                        from_position += K::b[i] * K::B[i * (m + 1) + j] * g[i * Z + active + a];
                }
                sum[Layout::index(a, j)] = from_velocity + step_size * from_position;
            }
        for (int c = active; c < blocks; ++c)
            for (int j = 0; j < m; ++j) sum[Layout::index(c, j)] = g[(j + 1) * Z + active + c];
        for (int c = 0; c < kappas; ++c) {
            real from_momentum = real(0);
            for (int i = 0; i < r; ++i)
                from_momentum += K::b[i] * K::legendre_polynomial[i] * g[i * Z + 2 * active + c];
            sum[active * m + c] = step_size * from_momentum;
        }
    }

    // h sum_i b_i g_i of one slot.
    real impulse(const real* g, int slot) const {
        real sum = real(0);
        for (int i = 0; i < r; ++i) sum += K::b[i] * g[i * Z + slot];
        return step_size * sum;
    }

    // The part of one entry of H in the Jacobian. H is that of the nodes, `stride` apart; 0: the same for all.
    template <Slot row, Slot column, class At>
    void assemble_entry(const real* H, int stride, int u, int v, At&& at) const {
        constexpr int rows = row == Slot::momentum ? 1 : m, columns = column == Slot::momentum ? 1 : m;
        constexpr int velocities = (row == Slot::velocity) + (column == Slot::velocity);
        const real power = velocities == 2 ? real(1) / step_size : velocities == 1 ? real(1) : step_size;
        const real* const products = node_products<K, row, column>.value;
        if constexpr (nodal && row == Slot::position && column == Slot::position) {
            for (int j = 1; j < m; ++j) at(u, j, v, j - 1) += power * K::b[j] * H[j * stride];
        } else if constexpr (nodal && row == Slot::position) {
            for (int j = 0; j < rows; ++j)
                for (int k = 0; k < columns; ++k)
                    at(u, j, v, k) += products[(j * columns + k) * r + j] * (power * H[j * stride]);
        } else if constexpr (nodal && column == Slot::position) {
            for (int j = 0; j < rows; ++j)
                for (int k = 0; k < columns; ++k)
                    at(u, j, v, k) += products[(j * columns + k) * r + k + 1] * (power * H[(k + 1) * stride]);
        } else {
            for (int j = 0; j < rows; ++j)
                for (int k = 0; k < columns; ++k) {
                    real sum = real(0);
                    for (int i = 0; i < r; ++i) sum += products[(j * columns + k) * r + i] * H[i * stride];
                    at(u, j, v, k) += power * sum;
                }
        }
    }

    template <Slot row, class At>
    void assemble_row(const real* H, int stride, int e, At&& at) const {
        const int u = Tables::block(K::entry_row[e]), v = Tables::block(K::entry_column[e]);
        switch (Tables::kind(K::entry_column[e])) {
            case Slot::velocity:
                assemble_entry<row, Slot::velocity>(H, stride, u, v, at);
                break;
            case Slot::position:
                assemble_entry<row, Slot::position>(H, stride, u, v, at);
                break;
            case Slot::momentum:
                if constexpr (kappas > 0) assemble_entry<row, Slot::momentum>(H, stride, u, v, at);
                break;
            case Slot::multiplier:  // of dL/dq + G^T Lambda
                for (int j = 0; j < m; ++j) at(u, j, v, j) += step_size * K::b[j] * H[j * stride];
                break;
        }
    }

    // J = sum_i h b_i T_i^T H_i T_i into at(block, unknown; block, unknown), which begins at zero.
    template <class At>
    void assemble(const real* H, int stride, At&& at) const {
        for (int e = 0; e < K::entries; ++e) {
            switch (Tables::kind(K::entry_row[e])) {
                case Slot::velocity:
                    assemble_row<Slot::velocity>(H + e, stride, e, at);
                    break;
                case Slot::position:
                    assemble_row<Slot::position>(H + e, stride, e, at);
                    break;
                case Slot::momentum:
                    if constexpr (kappas > 0) assemble_row<Slot::momentum>(H + e, stride, e, at);
                    break;
                case Slot::multiplier:  // of phi: an entry of G
                    for (int j = 0; j < m; ++j)
                        at(Tables::block(K::entry_row[e]), j, Tables::block(K::entry_column[e]), j) +=
                            H[e + (j + 1) * stride];
                    break;
            }
        }
    }

    // g += H dz at node i.
    static void carry(const real* H, const real* dz, real* g) {
        for (int e = 0; e < K::entries; ++e) g[K::entry_row[e]] += H[e] * dz[K::entry_column[e]];
    }

    // T's column of a variation: of the slot that it shifts at every node (-1: none), or of p0 of an active coordinate.
    void tangent_column(Arrays& a, int slot, int active_momentum, int column, real* T) const {
        real dz[Z > 0 ? Z : 1];
        const auto shift = [&](real* dg) {
            for (int k = 0; k < Z; ++k) dz[k] = k == slot ? real(1) : real(0);
            for (int k = 0; k < Z; ++k) dg[k] = real(0);
        };
        for (int i = 0; i < r; ++i) {
            shift(a.g + i * Z);
            carry(a.H + i * entry_room, dz, a.g + i * Z);
        }
        sum_over_nodes(a.g, a.delta);
        if (active_momentum >= 0) a.delta[Layout::index(active_momentum, 0)] += real(1);
        for (int i = 0; i < N; ++i) a.delta[i] = -a.delta[i];
        a.matrix.solve(a.delta);
        for (int i = 0; i < r; ++i) {
            apply_node_map(a.delta, i, dz);
            carry(a.H + i * entry_room, dz, a.g + i * Z);
        }
        for (int b = 0; b < active; ++b) {
            T[K::active_index[b] * 2 * n + column] += a.delta[Layout::index(b, m - 1)];
            T[(n + K::active_index[b]) * 2 * n + column] += impulse(a.g, active + b);
        }
        for (int c = 0; c < cyclic; ++c) T[K::cyclic_index[c] * 2 * n + column] -= impulse(a.g, 2 * active + c);
    }
};

}  // namespace lobatto

#endif
// Newton's iteration for the Galerkin equations (D30, D34), where the fixed-point iteration does not contract.
#ifndef LOBATTO_KERNEL_GALERKIN_NEWTON_HPP
#define LOBATTO_KERNEL_GALERKIN_NEWTON_HPP

#include <type_traits>

namespace lobatto {

template <class K>
struct GalerkinNewton : GalerkinEquations<K> {
    using Equations = GalerkinEquations<K>;
    using Equations::n, Equations::active, Equations::blocks, Equations::cyclic, Equations::Z, Equations::r,
        Equations::m, Equations::kappas, Equations::N, Equations::room, Equations::entry_room, Equations::coefficients,
        Equations::step_size, Equations::q, Equations::p, Equations::iterations, Equations::increment,
        Equations::workspace;
    using typename Equations::real, typename Equations::Arrays, typename Equations::Matrix, typename Equations::Layout,
        typename Equations::Tables;
    using Rule = NewtonConvergence<real>;

protected:
    using Equations::apply_node_map, Equations::node_variables, Equations::evaluate_nodes, Equations::sum_over_nodes,
        Equations::assemble, Equations::carry;

    struct Nothing {};
    struct Frozen {
        Matrix matrix;
        real H[entry_room];
    };
    std::conditional_t<K::linear, Frozen, Nothing> frozen{};

    // The constant second derivatives and the Jacobian with them.
    template <class FrozenPart>
    Status freeze(FrozenPart& part) {
        return workspace.with([&](Arrays& a) {
            for (int k = 0; k < Z; ++k) a.z[k] = real(0);
            Formulas<K>::node(coefficients, real(0), a.z, a.g, part.H);
            part.matrix.clear();
            assemble(part.H, 0, part.matrix);
            return part.matrix.factor() ? Status::ok : Status::singular_jacobian;
        });
    }

    Status solve_stages(Arrays& a) {
        iterations = 0;
        increment = real(0);
        if constexpr (N == 0) {
            for (int i = 0; i < r; ++i) {
                node_variables(q, p, a.Y, i, a.z + i * Z);
                Formulas<K>::slope(coefficients, this->time() + K::c[i] * step_size, a.z + i * Z, a.g + i * Z);
            }
            return Status::ok;
        } else if constexpr (K::linear) {
            return correct_once(frozen, a);
        } else {
            return newton(a);
        }
    }

private:
    // One increment with the factored matrix; its size relative to the displacement within the step, with the rounding
    // of the position as floor, or not a number.
    real apply_increment(const Matrix& matrix, Arrays& a) {
        sum_over_nodes(a.g, a.delta);
        for (int b = 0; b < active; ++b) a.delta[Layout::index(b, 0)] += p[K::active_index[b]];
        for (int i = 0; i < N; ++i) a.delta[i] = -a.delta[i];
        ++iterations;
        matrix.solve(a.delta);
        constexpr real floor = Limits<real>::epsilon / Limits<real>::root_epsilon;
        real e = real(0);
        for (int b = 0; b < active; ++b) {
            real change = real(0), size = floor * fabs(q[K::active_index[b]]);
            for (int j = 0; j < m; ++j) {
                const int i = Layout::index(b, j);
                a.Y[i] += a.delta[i];
                change = fabs(a.delta[i]) > change ? fabs(a.delta[i]) : change;
                size = fabs(a.Y[i]) > size ? fabs(a.Y[i]) : size;
            }
            if (change > e * size) e = change / size;
        }
        for (int c = active; c < blocks; ++c)
            for (int j = 0; j < m; ++j) a.Y[Layout::index(c, j)] += a.delta[Layout::index(c, j)];
        for (int c = 0; c < kappas; ++c) {
            real& kappa = a.Y[active * m + c];
            const real change = fabs(a.delta[active * m + c]);
            kappa += a.delta[active * m + c];
            const real size = a.kappa_scale[c] + fabs(kappa);
            if (change > e * size) e = change / size;
        }
        const real part = not_finite_part(a.Y, N);
        return is_finite(part) ? e : part;
    }
    // The slopes at the corrected unknowns, to first order.
    void carry_increment(const real* H, int stride, Arrays& a) const {
        real dz[Z > 0 ? Z : 1];
        for (int i = 0; i < r; ++i) {
            apply_node_map(a.delta, i, dz);
            carry(H + i * stride, dz, a.g + i * Z);
        }
    }

    // The size of a conserved momentum, for its kappa: P itself, or what its velocity makes of it.
    void scale_kappas(Arrays& a) const {
        for (int c = 0; c < kappas; ++c) {
            const int entry = Tables::diagonal_entry(2 * active + c);
            a.kappa_scale[c] = fabs(p[K::cyclic_index[c]]);
            if (entry >= 0 && fabs(a.H[entry]) > Limits<real>::smallest)
                a.kappa_scale[c] += fabs(a.g[2 * active + c] / a.H[entry]);
        }
    }

    // Newton's iteration. At its end the slopes are carried to first order, which errs by the same e^2 as the unknowns.
    Status newton(Arrays& a) {
        real previous = Limits<real>::largest;
        for (int iteration = 1; iteration <= Rule::iteration_limit; ++iteration) {
            evaluate_nodes(this->time(), q, p, a.Y, a);
            if (iteration == 1) scale_kappas(a);
            if (!is_finite(not_finite_part(a.g, r * Z))) return Status::not_finite;
            a.matrix.clear();
            assemble(a.H, entry_room, a.matrix);
            if (!a.matrix.factor())
                return is_finite(not_finite_part(a.H, r * entry_room)) ? Status::singular_jacobian : Status::not_finite;
            const real e = apply_increment(a.matrix, a);
            increment = e;
            if (!is_finite(e)) return Status::not_finite;
            if (Rule::reached(iteration, e, previous) || (Rule::stagnates(iteration, e, previous) && is_rounding(a))) {
                carry_increment(a.H, entry_room, a);
                return Status::ok;
            }
            previous = e;
        }
        return Status::not_converged;
    }

    // Whether increments that no longer shrink are the rounding of what the residual is computed from.
    bool is_rounding(Arrays& a) const {
        real rounding[room];
        for (int i = 0; i < N; ++i) rounding[i] = real(0);
        for (int i = 0; i < r; ++i)
            for (int b = 0; b < active; ++b)
                for (int j = 0; j < m; ++j)
                    rounding[Layout::index(b, j)] +=
                        fabs(K::b[i] * K::D[i * (m + 1) + j] * a.g[i * Z + b]) +
                        fabs(step_size * K::b[i] * K::B[i * (m + 1) + j] * a.g[i * Z + active + b]);
        for (int i = 0; i < r; ++i)
            for (int c = 0; c < kappas; ++c)
                rounding[active * m + c] +=
                    fabs(step_size * K::b[i] * K::legendre_polynomial[i] * a.g[i * Z + 2 * active + c]);
        for (int b = 0; b < active; ++b) rounding[Layout::index(b, 0)] += fabs(p[K::active_index[b]]);
        for (int e = 0; e < K::entries; ++e)  // phi at positions that are rounded
            if (Tables::kind(K::entry_row[e]) == Slot::multiplier)
                for (int j = 0; j < m; ++j)
                    rounding[Layout::index(Tables::block(K::entry_row[e]), j)] +=
                        fabs(a.H[(j + 1) * entry_room + e] * a.z[(j + 1) * Z + K::entry_column[e]]);
        for (int i = 0; i < N; ++i) rounding[i] *= a.delta[i] < real(0) ? real(-1) : real(1);
        a.matrix.solve(rounding);
        real most = real(0), largest = real(0);
        for (int i = 0; i < N; ++i) {
            most = fabs(rounding[i]) > most ? fabs(rounding[i]) : most;
            largest = fabs(a.delta[i]) > largest ? fabs(a.delta[i]) : largest;
        }
        return largest <= real(Rule::noise) * Limits<real>::epsilon * most;
    }

    // A linear system: the frozen Jacobian is the Jacobian.
    template <class FrozenPart>
    Status correct_once(const FrozenPart& part, Arrays& a) {
        for (int i = 0; i < r; ++i) {
            node_variables(q, p, a.Y, i, a.z + i * Z);
            Formulas<K>::slope(coefficients, this->time() + K::c[i] * step_size, a.z + i * Z, a.g + i * Z);
        }
        for (int c = 0; c < kappas; ++c) a.kappa_scale[c] = real(1);
        if (!is_finite(apply_increment(part.matrix, a))) return Status::not_finite;
        carry_increment(part.H, 0, a);
        return Status::ok;
    }
};

}  // namespace lobatto

#endif
// The velocity of a momentum: Newton's iteration for p = dL/dv(q, v, t) (D27). With constraints phi(q, t) = 0, G =
// dphi/dq, it is the velocity that keeps them, with multipliers mu (D46):
//     dL/dv + G^T mu = p,  G v + dphi/dt = 0.
// p - G^T mu is then the nearest momentum, in the metric of the mass, whose velocity keeps the constraints. The same
// matrix, of M and G, gives the multipliers of a motion (D49).
#ifndef LOBATTO_KERNEL_VELOCITY_OF_MOMENTUM_HPP
#define LOBATTO_KERNEL_VELOCITY_OF_MOMENTUM_HPP

#include <type_traits>

namespace lobatto {

template <class K>
class VelocityOfMomentum {
public:
    using real = typename K::real;
    static constexpr int n = K::coordinates, constraints = K::constraints, unknowns = n + constraints;

    // v with the momentum p, and mu where there are constraints. The iteration begins at rest; where rest is
    // impossible, as in a frame that rotates faster than light, at a velocity that guess(v) writes, if it knows one.
    template <class Guess>
    Status find(const typename K::Coefficients& k, real time, const real* q, const real* p, const Guess& guess, real* v,
                real* mu) const {
        return workspace_.with([&](Arrays& a) {
            const State at{k, time, q, p};
            if constexpr (constraints > 0) {
                real phi[constraints];
                Formulas<K>::constraint(k, time, q, +phi, +a.phi_t, +a.G);
            }
            rest(a);
            Status status = solve(at, a);
            if (status != Status::ok) {
                rest(a);
                if (guess(a.x)) status = solve(at, a);
            }
            if (status != Status::ok) {
                begin_at_momentum(at, a);
                if (solve(at, a) == Status::ok) status = Status::ok;
            }
            for (int i = 0; i < n; ++i) v[i] = a.x[i];
            for (int c = 0; c < constraints; ++c) mu[c] = a.x[n + c];
            return status;
        });
    }

    // (D49) The multipliers of a motion with velocity v: M a - G^T lambda = r, G a = s.
    Status multipliers(const typename K::Coefficients& k, real time, const real* q, const real* v, real* lambda) const {
        if constexpr (constraints > 0) {
            return workspace_.with([&](Arrays& a) {
                real phi[constraints];
                Formulas<K>::constraint(k, time, q, +phi, +a.phi_t, +a.G);
                Formulas<K>::legendre(k, time, q, v, a.p, a.mass);
                Formulas<K>::multiplier_terms(k, time, q, v, +a.residual, a.residual + n);
                set_matrix(a);
                if (!a.matrix.factor()) return Status::singular_mass;
                solve_for(a, a.x);
                for (int c = 0; c < constraints; ++c) lambda[c] = -a.x[n + c];
                return is_finite(not_finite_part(a.x, unknowns)) ? Status::ok : Status::not_finite;
            });
        } else {
            (void)k, (void)time, (void)q, (void)v, (void)lambda;
            return Status::unsupported;
        }
    }

private:
    using Layout = std::conditional_t<K::cyclic == 0, Grouped<K, unknowns, 1, 0>, Whole<n>>;
    static constexpr int few = 4;  // iterations, after which only rounding may be left
    static constexpr int mass_room = K::mass_entries > 0 ? K::mass_entries : 1;
    static constexpr int slope_room = K::constraint_entries > 0 ? K::constraint_entries : 1;
    // x: v, then mu.
    struct Arrays {
        real x[unknowns], trial[unknowns], residual[unknowns], increment[unknowns], next[unknowns];
        real p[n], mass[mass_room], phi_t[constraints > 0 ? constraints : 1], G[slope_room];
        GroupedMatrix<real, Layout> matrix;
    };
    struct State {
        const typename K::Coefficients& k;
        real time;
        const real *q, *p;
    };

    static void rest(Arrays& a) {
        for (int i = 0; i < unknowns; ++i) a.x[i] = real(0);
    }

    // Both equations at x; whether they have values there.
    static bool evaluate(const State& at, const real* x, Arrays& a) {
        Formulas<K>::legendre(at.k, at.time, at.q, x, a.p, a.mass);
        for (int i = 0; i < n; ++i) a.residual[i] = at.p[i] - a.p[i];
        for (int c = 0; c < constraints; ++c) a.residual[n + c] = -a.phi_t[c];
        each_slope([&](int e, int c, int i) {
            a.residual[i] -= a.G[e] * x[n + c];
            a.residual[n + c] -= a.G[e] * x[i];
        });
        return is_finite(not_finite_part(a.residual, unknowns) + not_finite_part(a.mass, K::mass_entries));
    }

    // use(e, c, i) for the entries e of G, dphi_c/dq_i.
    template <class Use>
    static void each_slope(const Use& use) {
        for (int e = 0; e < K::constraint_entries; ++e) use(e, K::constraint_row[e], K::constraint_column[e]);
    }

    // M and G.
    static void set_matrix(Arrays& a) {
        a.matrix.clear();
        for (int e = 0; e < K::mass_entries; ++e) a.matrix(K::mass_row[e], 0, K::mass_column[e], 0) += a.mass[e];
        each_slope([&](int e, int c, int i) {
            a.matrix(i, 0, n + c, 0) += a.G[e];
            a.matrix(n + c, 0, i, 0) += a.G[e];
        });
    }

    // Increments are halved while the next one would be longer or is not finite, as with Lagrangians like -sqrt(1 -
    // v^2); lengths: sum |increment residual|.
    static Status solve(const State& at, Arrays& a) {
        if (!evaluate(at, a.x, a)) return Status::not_finite;
        for (int iteration = 0; iteration < 100; ++iteration) {
            if (iteration > 0 && is_near(at, a, real(2) * Limits<real>::epsilon)) return Status::ok;
            if (iteration > few && is_rounding(at, a)) return Status::ok;
            set_matrix(a);
            if (!a.matrix.factor()) return Status::singular_mass;
            const real length = solve_for(a, a.increment);
            const bool next_is_rounding = iteration > 0 && is_near(at, a, Limits<real>::root_epsilon);
            for (real part = real(1);; part *= real(0.5)) {
                if (part < Limits<real>::epsilon)
                    return evaluate(at, a.x, a) && is_rounding(at, a) ? Status::ok : Status::not_converged;
                for (int i = 0; i < unknowns; ++i) a.trial[i] = a.x[i] + part * a.increment[i];
                if (next_is_rounding || (evaluate(at, a.trial, a) && solve_for(a, a.next) <= length)) break;
            }
            for (int i = 0; i < unknowns; ++i) a.x[i] = a.trial[i];
            if (next_is_rounding) return Status::ok;
        }
        return Status::not_converged;
    }

    // At rest there is no inverse, as of v^4: the multiple of the momentum whose own momentum is nearest.
    static void begin_at_momentum(const State& at, Arrays& a) {
        real best = real(0), nearest = -real(1);
        rest(a);
        for (real scale = real(0x1p-40); scale <= real(0x1p40); scale *= real(2)) {
            for (int i = 0; i < n; ++i) a.x[i] = scale * at.p[i];
            if (!evaluate(at, a.x, a)) continue;
            real apart = real(0);
            for (int i = 0; i < n; ++i) apart += a.residual[i] * a.residual[i];
            if (nearest < real(0) || apart < nearest) best = scale, nearest = apart;
        }
        for (int i = 0; i < n; ++i) a.x[i] = best * at.p[i];
    }

    // Whether what is left is within a bound of what it is computed from.
    static bool is_near(const State& at, const Arrays& a, real bound) {
        real size[unknowns];
        for (int i = 0; i < n; ++i) size[i] = fabs(at.p[i]);
        for (int c = 0; c < constraints; ++c) size[n + c] = fabs(a.phi_t[c]);
        for (int e = 0; e < K::mass_entries; ++e) size[K::mass_row[e]] += fabs(a.mass[e] * a.x[K::mass_column[e]]);
        each_slope([&](int e, int c, int i) {
            size[i] += fabs(a.G[e] * a.x[n + c]);
            size[n + c] += fabs(a.G[e] * a.x[i]);
        });
        for (int i = 0; i < unknowns; ++i)
            if (!(fabs(a.residual[i]) <= bound * size[i])) return false;
        return true;
    }

    // Whether what is left is rounding beside the whole motion, in the metric of the mass: |p_i| <= sqrt(M_ii p v). The
    // terms of one row may all be rounding, as those of a coordinate that a constraint holds fixed.
    static bool is_rounding(const State& at, const Arrays& a) {
        real twice_energy = real(0), mass[n] = {}, size[unknowns] = {};
        for (int i = 0; i < n; ++i) twice_energy += fabs(at.p[i] * a.x[i]);
        for (int e = 0; e < K::mass_entries; ++e)
            if (K::mass_row[e] == K::mass_column[e]) mass[K::mass_row[e]] = fabs(a.mass[e]);
        for (int i = 0; i < n; ++i) size[i] = sqrt(mass[i] * twice_energy);
        each_slope([&](int e, int c, int i) {
            if (mass[i] > real(0)) size[n + c] += fabs(a.G[e]) * sqrt(twice_energy / mass[i]);
        });
        for (int i = 0; i < unknowns; ++i)
            if (!(fabs(a.residual[i]) <= real(64) * Limits<real>::epsilon * size[i])) return false;
        return true;
    }

    // x = matrix^-1 residual; sum |x_i residual_i|.
    static real solve_for(const Arrays& a, real* x) {
        real sorted[unknowns], length = real(0);
        for (int i = 0; i < unknowns; ++i) sorted[Layout::index(i, 0)] = a.residual[i];
        a.matrix.solve(sorted);
        for (int i = 0; i < unknowns; ++i) {
            x[i] = sorted[Layout::index(i, 0)];
            length += fabs(x[i] * a.residual[i]);
        }
        return length;
    }

    Workspace<Arrays> workspace_;
};

}  // namespace lobatto

#endif
// The step of many trajectories of a separable system side by side, one in each lane, by iterations over its nodes.
//
// Formula numbers (D..) refer to docs/derivation.md. The unknown is what the nodes X still have to move by (D41): with
// the stage map M = -h^2 P A (iteration/stage_map.hpp), W and S = dW/dq at X and the sums P that X was made with,
//     delta = d + M (S - D) delta,    d = M (W - D X) - P
// to first order. Where S pays (K::uses_hessian) one evaluation gives both sides, and delta follows by repetition;
// elsewhere delta = d. X moves by delta and is evaluated again until delta is small.
//
// No lane sees its neighbours: one that is solved stands still while others go on, and what is computed of it again
// has the same bits. A step need not wait for its tests of convergence: what they need is computed beside it.
#ifndef LOBATTO_KERNEL_ENSEMBLE_FIXED_POINT_HPP
#define LOBATTO_KERNEL_ENSEMBLE_FIXED_POINT_HPP

namespace lobatto {

template <class K, class T>
struct EnsembleFixedPoint : StageMap<K, T> {
    using real = typename K::real;
    using Tables = StageMap<K, T>;
    using Tables::h, Tables::usable, Tables::has_history, Tables::w, Tables::rest, Tables::diagonal, Tables::node_time,
        Tables::weight, Tables::arrival, Tables::map_of;
    using Tables::n, Tables::s, Tables::m, Tables::inner_room, Tables::absorbs, Tables::entries, Tables::maps,
        Tables::parts;
    using typename Tables::ActiveMask;
    static constexpr int values = inner_room * n;  // node by node
    static constexpr int evaluation_limit = 16;

    struct Arrays {
        T P[values], X[values], W[values], S[inner_room * entries], d[values], delta[values], bend[values];
        T rate[n], inverse_scale[n], inverse_next[n], inverse_linear[n];
    };

    // Of increments: the square that is small enough, and what they are measured against at least, a part of the
    // position's size and a number.
    struct Measure {
        real enough, part, least;
    };

    Measure settled, near;
    T evaluations;  // of the last step
    T drifting[n];  // the velocity before the last kick, so that the next step need not wait for it
    T reach;        // root of the sum of squares of a row of M, the largest
    Workspace<Arrays> workspace;

    void prepare(const typename K::Coefficients& k, real step, int lane) {
        Tables::prepare(k, step, lane);
        real largest = real(0);
        for (int c = 0; c < maps; ++c)
            for (int i = 0; i < m; ++i) {
                real squares = real(0);
                for (int j = 0; j < m; ++j) {
                    const real entry = lane_of(this->map[c].inner[j][i], lane);
                    squares += entry * entry;
                }
                largest = maximum(largest, squares);
            }
        set_lane(reach, lane, sqrt(largest));
    }
    void begin(const real* q, const real* u, const real* W0, int lane) {
        Tables::begin(q, W0, lane);
        for (int c = 0; c < n; ++c) set_lane(drifting[c], lane, u[c] + h * K::b[s - 1] * W0[c]);
    }
    template <class Acceleration, class Position>
    void recall(const real* u, const Acceleration& minus_acceleration, const Position& position, int lane) {
        Tables::recall(minus_acceleration, position, lane);
        for (int c = 0; c < n; ++c) set_lane(drifting[c], lane, u[c] + h * K::b[s - 1] * minus_acceleration(s - 1, c));
    }

    // Increments of positions are measured against what a coordinate moves by in a step. They count as nothing when
    // they are `tolerance` (0: rounding), and S as constant when they are its root.
    void set_tolerance(real tolerance) {
        const real small = maximum(tolerance, Limits<real>::epsilon);
        const real linear = maximum(Limits<real>::root_epsilon, sqrt(tolerance));
        constexpr real floor = Limits<real>::epsilon / Limits<real>::root_epsilon;
        settled = {small * small, maximum(floor, Limits<real>::epsilon / small), Limits<real>::smallest / small};
        near = {linear * linear, maximum(floor, real(8) * Limits<real>::epsilon / linear),
                real(8) * Limits<real>::smallest / linear};
    }

    // One step of the lanes that are `active`, h from `time`. The lanes that the answer names have moved; the others
    // stay.
    template <class Given>
    LOBATTO_INLINE ActiveMask step(const Given& k, real time, T* q, T* u, ActiveMask active) {
        return workspace.with([&](Arrays& a) LOBATTO_FORMULA {
            begin_step(q, u, a);
            active = active & usable;
            if constexpr (m == 0)
                evaluations = T(real(0));
            else if constexpr (K::uses_hessian)
                active = solve_with_slopes(k, time, active, a);
            else
                active = solve(k, time, active, a);
            return any(active) ? finish(k, time, q, u, active, a) : active;
        });
    }

private:
    // start + sum_j column_j r_j, r_j `stride` apart.
    template <int terms>
    LOBATTO_INLINE static T sum_of(const T& start, const T (*column)[parts], int p, const T* r, int stride) {
        T even = start, odd = T(real(0));
#pragma GCC unroll 16
        for (int j = 0; j < terms; ++j)
            if (terms > 3 && j % 2 == 1)
                odd = j == 1 ? column[j][p] * r[j * stride] : fused(column[j][p], r[j * stride], odd);
            else
                even = fused(column[j][p], r[j * stride], even);
        return terms > 3 ? even + odd : even;
    }

    // The measures of increments, and X from the polynomial of the step before. Each coordinate has its own: increments
    // as small as its rounding are so whatever the others do.
    LOBATTO_INLINE void begin_step(const T* q, const T* u, Arrays& a) const {
        for (int c = 0; c < n; ++c) {
            const T W0 = w[c * s + s - 1], position = fabs(q[c]);
            a.rate[c] = fused(T(-h * K::b[0]), W0, u[c]);
            const T moved = T(fabs(h)) * (fabs(a.rate[c]) + fabs(T(h) * W0));
            a.inverse_scale[c] = T(real(1)) / maximum(moved, fused(T(settled.part), position, T(settled.least)));
            a.inverse_next[c] = reach * a.inverse_scale[c];
            a.inverse_linear[c] = T(real(1)) / maximum(moved, fused(T(near.part), position, T(near.least)));
            const T rate = fused(T(-h * (K::b[0] + K::b[s - 1])), W0, drifting[c]);
            const auto& of = map_of(c);
            const T* last;
            if constexpr (absorbs)
                last = rest + c * s;
            else
                last = w + c * s;
            for (int j = 0; j < m; ++j) {
                T& P = a.P[j * n + c];
                if (has_history)
                    P = sum_of<s - 1>(of.before[0][j] * last[0], of.before + 1, j, last + 1, 1);
                else
                    P = of.simple[j] * last[s - 1];
                a.X[j * n + c] = fused(of.on_velocity[j], rate, (absorbs ? of.on_position[j] * q[c] : q[c]) + P);
            }
        }
    }
    // to += M r.
    LOBATTO_INLINE void add_mapped(const T* r, T* to) const {
        for (int c = 0; c < n; ++c)
            for (int j = 0; j < m; ++j) to[j * n + c] = sum_of<m>(to[j * n + c], map_of(c).inner, j, r + c, n);
    }
    // M (W - D X) - P; where K has a remainder, W holds W - D X while it is solved for X.
    LOBATTO_INLINE void residual(const Arrays& a, T* r) const {
        for (int i = 0; i < values; ++i) r[i] = -a.P[i];
        if constexpr (absorbs && !K::has_remainder) {
            T rest_of[values];
            for (int i = 0; i < values; ++i) rest_of[i] = fused(-diagonal[i % n], a.X[i], a.W[i]);
            add_mapped(rest_of, r);
        } else {
            add_mapped(a.W, r);
        }
    }
    // (S - D) x.
    LOBATTO_INLINE void slopes_times(const Arrays& a, const T* x, T* product) const {
        for (int j = 0; j < m; ++j) {
            T* const sum = product + j * n;
            for (int c = 0; c < n; ++c)
                if constexpr (absorbs)
                    sum[c] = -(diagonal[c] * x[j * n + c]);
                else
                    sum[c] = T(real(0));
#pragma GCC unroll 16
            for (int e = 0; e < K::entries; ++e) {
                const T &S = a.S[j * entries + e], &moved = x[j * n + K::entry_column[e]];
                T& to = sum[K::entry_row[e]];
                to = !absorbs && first_in_row.holds[e] ? S * moved : fused(S, moved, to);
            }
        }
    }
    // Whether an entry of S is the first of its row.
    struct FirstInRow {
        bool holds[entries]{};
        constexpr FirstInRow() {
            for (int e = 0; e < K::entries; ++e) {
                holds[e] = true;
                for (int f = 0; f < e; ++f)
                    if (K::entry_row[f] == K::entry_row[e]) holds[e] = false;
            }
        }
    };
    static constexpr FirstInRow first_in_row{};

    // The sum of (x_i scale_i)^2.
    LOBATTO_INLINE static T size(const T* x, const T* scale) {
        T sum[2] = {T(real(0)), T(real(0))};  // two, which do not wait for each other
        for (int i = 0; i < values; ++i) {
            const T relative = x[i] * scale[i % n];
            T& part = sum[i % 2];
            part = i < 2 ? relative * relative : fused(relative, relative, part);
        }
        return values > 1 ? sum[0] + sum[1] : sum[0];
    }

    template <class Given>
    LOBATTO_INLINE void evaluate(const Given& k, real time, Arrays& a) const {
#pragma GCC unroll 4
        for (int j = 0; j < m; ++j)
            if constexpr (K::uses_hessian)
                Formulas<K>::node(k, T(time) + node_time[j], static_cast<const T*>(a.X + j * n), a.W + j * n,
                                  a.S + j * entries);
            else if constexpr (K::has_remainder)
                Formulas<K>::remainder(k, T(time) + node_time[j], static_cast<const T*>(a.X + j * n), a.W + j * n);
            else
                Formulas<K>::minus_acceleration(k, T(time) + node_time[j], static_cast<const T*>(a.X + j * n),
                                                a.W + j * n);
    }
    // W at the nodes X.
    template <class Given>
    LOBATTO_INLINE void settle(const Given& k, real time, Arrays& a) const {
        for (int j = 0; j < m; ++j)
            Formulas<K>::minus_acceleration(k, T(time) + node_time[j], static_cast<const T*>(a.X + j * n), a.W + j * n);
    }

    // X and P of these lanes move on by delta.
    LOBATTO_INLINE static void move_on(ActiveMask active, Arrays& a) {
        for (int i = 0; i < values; ++i) {
            const T delta = select(active, a.delta[i], T(real(0)));
            a.X[i] += delta;
            a.P[i] += delta;
        }
    }
    // The lanes whose stage equations are solved, with W at their nodes X, by evaluations alone.
    template <class Given>
    LOBATTO_INLINE ActiveMask solve(const Given& k, real time, ActiveMask active, Arrays& a) {
        const Convergence<T, 2> rule{T(settled.enough)};
        T e_before = T(real(0));
        ActiveMask solved = active & !active;
        evaluations = T(real(0));
        for (int evaluation = 1; evaluation <= evaluation_limit && any(active); ++evaluation) {
            evaluate(k, time, a);
            evaluations += select(active, T(real(1)), T(real(0)));
            residual(a, a.delta);
            const T e = size(a.delta, a.inverse_scale);
            const ActiveMask ready = active & rule.reached(e, e_before);
            move_on(active, a);
            solved = solved | ready;
            active = active & !ready;
            if (evaluation > rule.judged_after) active = active & rule.contracts(e, e_before);
            // Not beyond 1: a coordinate that began at rest moves by any multiple of nothing.
            e_before = minimum(e, T(real(1)));
        }
        settle(k, time, a);
        return solved;
    }

    // The same by evaluations with S: X becomes the nodes, and W is carried to them. One iteration with S follows the
    // first evaluation; it is often the last.
    template <class Given>
    LOBATTO_INLINE ActiveMask solve_with_slopes(const Given& k, real time, ActiveMask active, Arrays& a) {
        evaluate(k, time, a);
        residual(a, a.d);
        slopes_times(a, a.d, a.bend);
        ActiveMask at_first = iterate(a);
        at_first = at_first & S_stands_for_W(a);  // of what the iteration has left, so not in one expression
        evaluations = select(active, T(real(1)), T(real(0)));
        if (any(active & !at_first)) active = evaluate_again(k, time, active, at_first, a);
        for (int i = 0; i < values; ++i) {
            a.X[i] += a.delta[i];
            if constexpr (absorbs) a.bend[i] = fused(diagonal[i % n], a.delta[i], a.bend[i]);
            a.W[i] += a.bend[i];
        }
        return active;
    }
    // The evaluations after the first, each with two iterations; `at_first`: the lanes that need none of them.
    template <class Given>
    LOBATTO_INLINE ActiveMask evaluate_again(const Given& k, real time, ActiveMask active, ActiveMask at_first,
                                             Arrays& a) {
        const Convergence<T, 2> rule{T(settled.enough)};
        T e_before = T(real(0));
        ActiveMask further = active & !at_first;
        for (int evaluation = 2;; ++evaluation) {
            move_on(further, a);
            evaluate(k, time, a);
            evaluations += select(further, T(real(1)), T(real(0)));
            residual(a, a.d);
            slopes_times(a, a.d, a.bend);
            ActiveMask is_solved = iterate(a);
            is_solved = iterate_others(at_first, is_solved, a);
            is_solved = is_solved & S_stands_for_W(a);
            further = active & !is_solved;
            if (!any(further)) break;
            if (evaluation == evaluation_limit) return active & is_solved;
            if (evaluation >= 3) {
                const T e = size(a.d, a.inverse_scale);
                if (evaluation > rule.judged_after) active = active & (is_solved | rule.contracts(e, e_before));
                e_before = e;
                further = active & further;
            }
        }
        return active;
    }

    LOBATTO_INLINE ActiveMask S_stands_for_W(const Arrays& a) const {
        return size(a.delta, a.inverse_linear) <= T(near.enough);
    }
    // delta = d + M bend, and bend = (S - D) delta; where the next iteration would change nothing: it would move X by M
    // times what `bend` has changed by, at most `reach` times its size.
    LOBATTO_INLINE ActiveMask iterate(Arrays& a) const {
        T change[values];
        for (int i = 0; i < values; ++i) {
            change[i] = a.bend[i];
            a.delta[i] = a.d[i];
        }
        add_mapped(a.bend, a.delta);
        slopes_times(a, a.delta, a.bend);
        for (int i = 0; i < values; ++i) change[i] = a.bend[i] - change[i];
        return size(change, a.inverse_next) <= T(settled.enough);
    }
    // Another iteration, but of the lanes `resting`, whose answer is `known`.
    LOBATTO_INLINE ActiveMask iterate_others(ActiveMask resting, ActiveMask known, Arrays& a) const {
        if (!any(resting)) return iterate(a);
        T bend[values], delta[values];
        for (int i = 0; i < values; ++i) {
            bend[i] = a.bend[i];
            delta[i] = a.delta[i];
        }
        const ActiveMask found = iterate(a);
        for (int i = 0; i < values; ++i) {
            a.bend[i] = select(resting, bend[i], a.bend[i]);
            a.delta[i] = select(resting, delta[i], a.delta[i]);
        }
        return (known & resting) | (found & !resting);
    }

    // (D16), (D17): the end of the step, each sum of increments rounded once; then the memory of the step.
    template <class Given>
    LOBATTO_INLINE ActiveMask finish(const Given& k, real time, T* q, T* u, ActiveMask solved, const Arrays& a) {
        T q1[n], u1[n], W1[n], change[n];
        for (int c = 0; c < n; ++c) {
            const T* const W = a.W + c;
            q1[c] = q[c] + sum_over_nodes(T(h) * a.rate[c], arrival, W);
            change[c] = sum_over_nodes(T(-h * K::b[0]) * w[c * s + s - 1], weight, W);
        }
        Formulas<K>::minus_acceleration(k, T(time + h), static_cast<const T*>(q1), +W1);
        T not_finite = T(real(0));
        for (int c = 0; c < n; ++c) {
            u1[c] = u[c] + fused(T(-h * K::b[s - 1]), W1[c], change[c]);
            not_finite = fused(T(real(0)), q1[c] + u1[c], not_finite);
        }
        solved = solved & (not_finite == T(real(0)));
        if (all(solved))
            remember<true>(q, u, q1, u1, change, W1, solved, a);
        else if (any(solved))
            remember<false>(q, u, q1, u1, change, W1, solved, a);
        return solved;
    }
    LOBATTO_INLINE static T sum_over_nodes(const T& start, const T* factor, const T* W) {
        T sum = start;
        for (int j = 0; j < m; ++j) sum = fused(factor[j], W[j * n], sum);
        return sum;
    }

    // The end of the step becomes the state, and its accelerations the memory, of all lanes or of those solved.
    template <bool is_all>
    LOBATTO_INLINE void remember(T* q, T* u, const T* q1, const T* u1, const T* change, const T* W1, ActiveMask solved,
                                 const Arrays& a) {
        const auto keep = [&](T& old, const T& value)
                              LOBATTO_FORMULA { old = is_all ? value : select(solved, value, old); };
        for (int c = 0; c < n; ++c) {
            T* const memory = w + c * s;
            keep(memory[0], memory[s - 1]);
            for (int j = 0; j < m; ++j) keep(memory[j + 1], a.W[j * n + c]);
            keep(memory[s - 1], W1[c]);
            if constexpr (absorbs) {
                T* const r = rest + c * s;
                keep(r[0], r[s - 1]);
                for (int j = 0; j < m; ++j) keep(r[j + 1], fused(-diagonal[c], a.X[j * n + c], a.W[j * n + c]));
                keep(r[s - 1], fused(-diagonal[c], q1[c], W1[c]));
            }
            keep(drifting[c], u[c] + change[c]);
            keep(q[c], q1[c]);
            keep(u[c], u1[c]);
        }
        has_history = true;
    }
};

template <class K, class T>
struct LaneStepper<K, T, Form::separable, Stepping::solved> {
    using real = typename K::real;
    using ActiveMask = decltype(T() < T());
    static constexpr int n = K::coordinates;
    T q[n], u[n], evaluations = T(real(0));
    EnsembleFixedPoint<K, T> fixed_point;

    const T& position(int c) const { return q[c]; }
    void prepare(const ScalarFallback<K>& single, int lane) {
        fixed_point.prepare(single.coefficients, single.step_size, lane);
    }
    void set_tolerance(real tolerance) { fixed_point.set_tolerance(tolerance); }
    void start(const ScalarFallback<K>& single, const real*, int lane) {
        follow_state(single, lane);
        fixed_point.begin(single.q, single.u, single.W + (K::points - 1) * n, lane);
    }
    void momentum(const ScalarFallback<K>& single, int lane, real* momentum) const {
        real velocity[n];
        for (int c = 0; c < n; ++c) velocity[c] = lane_of(u[c], lane);
        K::momentum(single.coefficients, static_cast<const real*>(velocity), momentum);
    }
    template <class Given>
    ActiveMask step(const Given& k, real time, ActiveMask active) {
        const ActiveMask moved = fixed_point.step(k, time, q, u, active);
        evaluations = fixed_point.evaluations;
        return moved;
    }
    // Takes over the state and the memory of the step that `single` has taken.
    void follow(const ScalarFallback<K>& single, int lane) {
        follow_state(single, lane);
        fixed_point.recall(
            single.u, [&](int i, int c) { return single.node_minus_acceleration(i, c); },
            [&](int i, int c) { return single.node_position(i, c); }, lane);
    }

private:
    void follow_state(const ScalarFallback<K>& single, int lane) {
        for (int c = 0; c < n; ++c) {
            set_lane(q[c], lane, single.q[c]);
            set_lane(u[c], lane, single.u[c]);
        }
    }
};

}  // namespace lobatto

#endif
// Linear maps: the step of a linear system as one affine map.
//
// Formula numbers (D..) refer to docs/derivation.md.
#ifndef LOBATTO_KERNEL_LINEAR_HPP
#define LOBATTO_KERNEL_LINEAR_HPP

#include <type_traits>

namespace lobatto {

// Moves the entries of E = Phi - I (2 x 2, rows of three: q, p, shift) by at most two units in the last place each, so
// that det Phi = 1 + tr E + det E is 1 to far below the rounding of the entries (D20). A determinant of 1 + e
// multiplies the conserved energy by 1 + e in every step.
template <class real>
inline void round_to_unit_determinant(real* E) {
    const int places[4] = {0, 1, 3, 4};
    real candidates[4][5], best[4] = {E[0], E[1], E[3], E[4]}, least = Limits<real>::largest;
    for (int e = 0; e < 4; ++e) {
        const real entry = best[e];
        // A unit in the last place, or half of one just above a power of two.
        real unit = fabs(entry) * Limits<real>::epsilon * real(0.5);
        while (unit > real(0) && entry + unit == entry) unit += unit;
        for (int j = 0; j < 5; ++j) candidates[e][j] = entry + real(j % 2 == 0 ? j / 2 : -(j + 1) / 2) * unit;
    }
    for (const real a : candidates[0])
        for (const real b : candidates[1])
            for (const real c : candidates[2])
                for (const real d : candidates[3]) {
                    const real ad = a * d, bc = b * c;
                    // tr E + det E, the terms and their rounding, summed without loss (TwoSum).
                    const real terms[6] = {a, d, ad, -bc, rounded_once(a, d, -ad), -rounded_once(b, c, -bc)};
                    real sum = real(0), lost = real(0);
                    for (const real term : terms) {
                        const real next = sum + term, back = next - sum;
                        lost += (sum - (next - back)) + (term - back);
                        sum = next;
                    }
                    const real defect = fabs(sum + lost);
                    if (defect < least) {
                        least = defect;
                        best[0] = a;
                        best[1] = b;
                        best[2] = c;
                        best[3] = d;
                    }
                }
    for (int e = 0; e < 4; ++e) E[places[e]] = best[e];
}

// The affine map of one step of a linear system, in (q, p), from the constant S = M^-1 V'' and W(0) (D20, n > 1).
template <class K>
inline Status linear_map(typename K::Coefficients& k, typename K::real h) {
    using real = typename K::real;
    constexpr int n = K::coordinates, s = K::points;
    const real origin[n] = {};
    real W0[n], entries[K::entries > 0 ? K::entries : 1];
    K::node(k, origin, W0, entries);
    if constexpr (K::is_explicit) {
        for (int i = 0; i < 2 * n * (2 * n + 1); ++i) k.Phi_minus_I[i] = real(0);
        for (int i = 0; i < s; ++i) {
            kick_increment<K>(-h * K::b[i], entries, W0, k.Phi_minus_I);
            if (i < s - 1) drift_increment<K>(h * K::drift_length[i], k.Phi_minus_I);
        }
    } else {
        real S[s * n * n];
        for (int i = 0; i < s; ++i) expand_entries<K>(entries, S + i * n * n);
        if (!increment_of_step<K>(h, S, W0, k.Phi_minus_I)) return Status::singular_jacobian;
    }
    to_momentum<K>(k, k.Phi_minus_I);
    real sum = real(0);
    for (int i = 0; i < 2 * n * (2 * n + 1); ++i) sum += k.Phi_minus_I[i] - k.Phi_minus_I[i];
    return sum == real(0) ? Status::ok : Status::not_finite;
}

// (q1, p1) = (q, p) + E (q, p) + shift, E = Phi - I; E: 2n x (2n + 1), the shift its last column.
template <int n, class given, class number>
inline void apply_map(const given* E, const number* q, const number* p, number* q1, number* p1) {
    for (int r = 0; r < 2 * n; ++r) {
        const given* const row = E + r * (2 * n + 1);
        number sum = row[2 * n];
        for (int k = 0; k < n; ++k) sum += row[k] * q[k];
        for (int k = 0; k < n; ++k) sum += row[n + k] * p[k];
        (r < n ? q1[r] : p1[r - n]) = (r < n ? q[r] : p[r - n]) + sum;
    }
}

// (D21) H_d(z) = 1/2 ((p - w_p).q1 - (q - w_q).p1) for z = (q, p), the step z1 = z + E z + w and the shift w: conserved
// exactly where Phi = 1 + E is symplectic, whether or not the map has a fixed point. In increments d = E z + w, so that
// p.q and q.p do not have to cancel.
template <int n, class given, class number>
inline number discrete_energy(const given* E, const number* q, const number* p) {
    number value = number(0);
    for (int k = 0; k < n; ++k) {
        const given *const row_q = E + k * (2 * n + 1), *const row_p = E + (n + k) * (2 * n + 1);
        const given w_q = row_q[2 * n], w_p = row_p[2 * n];
        number d_q = number(w_q), d_p = number(w_p);
        for (int j = 0; j < n; ++j) d_q += row_q[j] * q[j] + row_q[n + j] * p[j];
        for (int j = 0; j < n; ++j) d_p += row_p[j] * q[j] + row_p[n + j] * p[j];
        value += (p[k] * d_q - q[k] * d_p) + (w_q * (p[k] + d_p) - w_p * (q[k] + d_q));
    }
    return value * number(0.5);
}

// The stepper of an affine map: the whole step is K::propagate.
template <class K>
struct Stepper<K, Form::linear_map, Stepping::solved> : Motion<K> {
    using typename Motion<K>::real;
    using Motion<K>::n, Motion<K>::coefficients, Motion<K>::q;
    static constexpr int N = 0;
    static constexpr int nodes = K::points;
    // Of a few coordinates and more, the rows of Phi - I lie in lanes, column after column.
    static constexpr int width = native_lanes<real>, rows = (2 * n + width - 1) / width * width;
    static constexpr bool in_lanes = n >= 4 && width > 1;
    struct Nothing {};
    real p[n]{};  // momentum
    std::conditional_t<in_lanes, real[(2 * n + 1) * rows], Nothing> columns{};

    Status prepare(const typename K::Parameters& parameters, real h) {
        this->step_size = h;
        const Status status = K::prepare(parameters, h, coefficients);
        if constexpr (in_lanes)
            for (int r = 0; r < 2 * n; ++r)
                for (int c = 0; c <= 2 * n; ++c) columns[c * rows + r] = coefficients.Phi_minus_I[r * (2 * n + 1) + c];
        return status;
    }

    Status start(real time, const real* position, const real* momentum) {
        this->start_time = time;
        this->steps = 0;
        for (int k = 0; k < n; ++k) {
            q[k] = position[k];
            p[k] = momentum[k];
        }
        return is_finite(time + not_finite_part(q, n) + not_finite_part(p, n)) ? Status::ok : Status::not_finite;
    }

    Status step() {
        if (this->time_stands_still()) return Status::time_stands_still;
        real q1[n], p1[n];
        if constexpr (in_lanes)
            propagate(columns, q1, p1);
        else
            K::propagate(coefficients, +q, +p, +q1, +p1);
        real sum = real(0);
        for (int k = 0; k < n; ++k) sum += (q1[k] - q1[k]) + (p1[k] - p1[k]);
        if (!(sum == real(0))) return Status::not_finite;
        for (int k = 0; k < n; ++k) {
            q[k] = q1[k];
            p[k] = p1[k];
        }
        ++this->steps;
        return Status::ok;
    }

    void momentum(real* momentum) const {
        for (int k = 0; k < n; ++k) momentum[k] = p[k];
    }

    Status energy(real, const real* position, const real* momentum, real* value) const {
        if constexpr (K::has_energy) {
            *value = K::energy(coefficients, position, momentum);
            return Status::ok;
        } else {
            return Status::unsupported;
        }
    }
    void momentum(real, const real*, const real* velocity, real* momentum) const {
        K::momentum(coefficients, velocity, momentum);
    }
    Status velocity(real, const real*, const real* momentum, real* velocity) const {
        K::velocity(coefficients, momentum, velocity);
        return Status::ok;
    }
    // dL/dv = M v and dL/dq = -M W.
    void slopes(real, const real* position, const real* velocity, real* Lv, real* Lq) const {
        real W[n];
        K::minus_acceleration(coefficients, position, W);
        for (int k = 0; k < n; ++k) W[k] = -W[k];
        K::momentum(coefficients, velocity, Lv);
        K::momentum(coefficients, W, Lq);
    }
    Status residual(real, const real*, const real*, const real*, real*) const { return Status::unsupported; }
    Status jacobian(real, const real*, const real*, const real*, real*) const { return Status::unsupported; }

    // (D20), rows side by side.
    template <class Columns>
    void propagate(const Columns& column, real* q1, real* p1) const {
        using V = Pack<real, width>;
        V sum[rows / width];
        real moved[rows];
        for (int r = 0; r < rows / width; ++r) sum[r] = V::load(column + 2 * n * rows + r * width);
        const auto add = [&](int c, real x) LOBATTO_FORMULA {
#pragma GCC unroll 8
            for (int r = 0; r < rows / width; ++r) sum[r] = fused(V::load(column + c * rows + r * width), V(x), sum[r]);
        };
        for (int c = 0; c < n; ++c) add(c, q[c]);
        for (int c = 0; c < n; ++c) add(n + c, p[c]);
        for (int r = 0; r < rows / width; ++r) sum[r].store(moved + r * width);
        for (int k = 0; k < n; ++k) {
            q1[k] = q[k] + moved[k];
            p1[k] = p[k] + moved[n + k];
        }
    }

    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        if constexpr (K::has_tangent) {
            Stepper local = *this;
            add_identity<K>(coefficients.Phi_minus_I, T);
            return this->step_from(local, time, position, momentum, q1, p1);
        } else {
            return Status::unsupported;
        }
    }
};

template <class K, class T>
struct LaneStepper<K, T, Form::linear_map, Stepping::solved> {
    using real = typename K::real;
    using ActiveMask = decltype(T() < T());
    static constexpr int n = K::coordinates;
    T q[n], p[n], evaluations = T(real(0));

    const T& position(int c) const { return q[c]; }

    void prepare(const ScalarFallback<K>&, int) {}
    void set_tolerance(real) {}
    void start(const ScalarFallback<K>& single, const real* momentum, int lane) {
        for (int c = 0; c < n; ++c) {
            set_lane(q[c], lane, single.q[c]);
            set_lane(p[c], lane, momentum[c]);
        }
    }
    void momentum(const ScalarFallback<K>&, int lane, real* momentum) const {
        for (int c = 0; c < n; ++c) momentum[c] = lane_of(p[c], lane);
    }
    template <class Given>
    ActiveMask step(const Given& k, real, ActiveMask active) {
        T q1[n], p1[n], not_finite = T(real(0));
        K::propagate(k, +q, +p, +q1, +p1);
        for (int c = 0; c < n; ++c) not_finite += (q1[c] - q1[c]) + (p1[c] - p1[c]);
        active = active & (not_finite == T(real(0)));
        for (int c = 0; c < n; ++c) {
            q[c] = select(active, q1[c], q[c]);
            p[c] = select(active, p1[c], p[c]);
        }
        return active;
    }
    void follow(const ScalarFallback<K>& single, int lane) {
        for (int c = 0; c < n; ++c) {
            set_lane(q[c], lane, single.q[c]);
            set_lane(p[c], lane, single.p[c]);
        }
    }
};

}  // namespace lobatto

#endif
// Steps of systems with constant mass and forces without velocities: only the interior nodes are implicit.
//
// The fixed-point iteration (iteration/fixed_point.hpp) solves the stage equations where it contracts; Newton's
// iteration (iteration/newton.hpp) where it does not. Formula numbers (D..) refer to docs/derivation.md. W = M^-1 (grad
// V - F) may depend on time: node i is at t + c_i h.
#ifndef LOBATTO_KERNEL_SEPARABLE_HPP
#define LOBATTO_KERNEL_SEPARABLE_HPP

#include <type_traits>

namespace lobatto {

// ---------------------------------------------------------------------------------------------------------------------
// The stepper
// ---------------------------------------------------------------------------------------------------------------------

// Whether iterations have neighbouring coordinates in lanes, not nodes.
template <class K>
constexpr bool along_coordinates() {
    if constexpr (K::any_number && !K::linear)
        return K::neighbours;
    else
        return false;
}

template <class K>
struct Stepper<K, Form::separable, Stepping::solved> : ConstantMass<K> {
    using typename ConstantMass<K>::real;
    using ConstantMass<K>::n, ConstantMass<K>::coefficients, ConstantMass<K>::step_size, ConstantMass<K>::q,
        ConstantMass<K>::u, ConstantMass<K>::iterations, ConstantMass<K>::increment;
    static constexpr int s = K::points, m = s - 2;
    static constexpr int N = K::unknowns;
    static constexpr int nodes = s;
    static constexpr int room = N > 0 ? N : 1, entry_room = K::entries > 0 ? K::entries : 1;
    using Stages = StageEquations<K>;
    using Newton = NewtonIteration<K>;
    static constexpr bool has_fixed_point = N > 0 && K::any_number && !K::linear && !K::clean;
    static constexpr bool along_coordinates = has_fixed_point && lobatto::along_coordinates<K>();

    struct Nothing {};
    struct Arrays : Newton::Arrays {
        real q1[n], u1[n], W1[n];  // the end of the step
    };

    struct FixedPointState {
        typename FixedPointOf<K, along_coordinates>::type iteration;
        Pause pause;
    };

    real q_before[n]{}, u_before[n]{};  // before the last step
    real W[s * n]{};                    // M^-1 grad V at the nodes of the last step; the last n at q
    bool has_history{};                 // W holds a whole step
    bool is_current{};  // W is that of the last step; else the iterations' memory is, of chains also q_before
    std::conditional_t<has_fixed_point, FixedPointState, Nothing> fixed_point{};
    Newton newton{};
    Workspace<Arrays> workspace;

    Status prepare(const typename K::Parameters& parameters, real h) {
        step_size = h;
        has_history = false;
        const Status status = K::prepare(parameters, h, coefficients);
        if (status != Status::ok) return status;
        if constexpr (has_fixed_point) fixed_point.iteration.prepare(coefficients, h);
        return newton.prepare(coefficients, h);
    }

    Status start(real time, const real* position, const real* momentum) {
        const Status status = this->begin(time, position, momentum, W + (s - 1) * n);
        has_history = false;
        is_current = true;
        if constexpr (has_fixed_point) begin_fixed_point(fixed_point);
        return status;
    }

    Status step() {
        if (this->time_stands_still()) return Status::time_stands_still;
        if constexpr (has_fixed_point) {
            if (iterate(fixed_point)) return Status::ok;
        }
        return workspace.with([this](Arrays& arrays) { return step_in(arrays); });
    }

    // The polynomial of the last step through its positions, at t + theta h.
    void polynomial(real theta, real* position, real* velocity) const {
        real value[s], slope[s];
        basis_at(theta, value, slope);
        polynomial(value, slope, position, velocity);
    }
    static constexpr int basis = s;  // polynomials
    static void basis_at(real theta, real* value, real* slope) { lagrange<s>(K::c, theta, value, slope); }
    void polynomial(const real* value, const real* slope, real* position, real* velocity) const {
        for (int k = 0; k < n; ++k) {
            const real start = position_before(k);
            real moved = value[s - 1] * (q[k] - start), rate = slope[s - 1] * (q[k] - start);
            for (int i = 0; i < m; ++i) {
                const real displacement = displacement_of(i, k);
                moved += value[i + 1] * displacement;
                rate += slope[i + 1] * displacement;
            }
            position[k] = start + moved;
            velocity[k] = rate / step_size;
        }
    }

    // F at the interior positions X, node-major, N.
    Status residual(real time, const real* position, const real* momentum, const real* X, real* F) const {
        if constexpr (N > 0) {
            workspace.with([&](Arrays& a) {
                const Stages stages(step_size);
                K::velocity(coefficients, momentum, a.u1);
                Formulas<K>::minus_acceleration(coefficients, time, position, a.W1);
                stages.drift(position, a.u1, a.W1, a.v, a.base);
                for (int i = 0; i < m; ++i)
                    Formulas<K>::minus_acceleration(coefficients, time + K::c[i + 1] * step_size, X + i * n,
                                                    a.W + i * n);
                stages.residual(a.base, X, a.W, F);
            });
        }
        return Status::ok;
    }

    // dF/dX, N x N.
    Status jacobian(real time, const real*, const real*, const real* X, real* J) const {
        if constexpr (N > 0) {
            workspace.with([&](Arrays& a) {
                for (int i = 0; i < m; ++i)
                    Formulas<K>::node(coefficients, time + K::c[i + 1] * step_size, X + i * n, a.W1,
                                      a.S + i * K::entries);
                Stages(step_size).jacobian(a.S, J);
            });
        }
        return Status::ok;
    }

    // Where the last step began.
    real position_before(int k) const {
        if constexpr (along_coordinates) {
            if (!is_current) return fixed_point.iteration.q[fixed_point.iteration.then][k];
        }
        return q_before[k];
    }
    real velocity_before(int k) const {
        if constexpr (along_coordinates) {
            if (!is_current) return fixed_point.iteration.u[fixed_point.iteration.then][k];
        }
        return u_before[k];
    }
    // W at node i of the last step; node s - 1 is where the motion is now.
    real node_minus_acceleration(int i, int k) const {
        if constexpr (has_fixed_point) {
            if (!is_current) return fixed_point.iteration.minus_acceleration(i, k);
        }
        return W[i * n + k];
    }
    // (D12) Q_i - q of the last step's interior node i.
    real displacement_of(int i, int k) const {
        real moved = K::c[i + 1] * (velocity_before(k) - step_size * K::b[0] * node_minus_acceleration(0, k));
        for (int j = 0; j < m; ++j) moved -= step_size * K::A[i * m + j] * node_minus_acceleration(j + 1, k);
        return step_size * moved;
    }
    real node_position(int i, int k) const {
        return i == s - 1 ? q[k] : position_before(k) + (i > 0 ? displacement_of(i - 1, k) : real(0));
    }

    // One step from (q, p) at `time` and d(q1, p1)/d(q, p) (D24), 2n x 2n.
    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        if constexpr (K::has_tangent) {
            Stepper local = *this;
            const Status status = this->step_from(local, time, position, momentum, q1, p1);
            if (status != Status::ok) return status;
            constexpr int columns = 2 * n + 1;
            real full[2 * n * columns], second[s * n * n], at[n], ignored[n], entries[entry_room], none[n] = {};
            for (int i = 0; i < s; ++i) {
                for (int k = 0; k < n; ++k) at[k] = local.node_position(i, k);
                Formulas<K>::node(coefficients, time + K::c[i] * step_size, static_cast<const real*>(at), +ignored,
                                  +entries);
                expand_entries<K>(entries, second + i * n * n);
            }
            if (!increment_of_step<K>(step_size, second, none, full)) return Status::singular_jacobian;
            to_momentum<K>(coefficients, full);
            add_identity<K>(full, T);
            return Status::ok;
        } else {
            (void)time, (void)position, (void)momentum, (void)q1, (void)p1, (void)T;
            return Status::unsupported;
        }
    }

protected:
    real node_time(int i) const { return this->time() + K::c[i + 1] * step_size; }

    // a.v and a.base of the step from q and u, and its interior nodes by Newton's iteration: a.Q, a.W.
    Status solve_from_start(Arrays& a) {
        const Stages stages(step_size);
        const real* const W0 = W + (s - 1) * n;
        stages.drift(q, u, W0, a.v, a.base);
        if constexpr (N == 0) return Status::ok;
        Status status = Status::not_converged;
        if (has_history) {
            stages.extrapolated_start(a.base, W, a.Q);
            status = solve_stages(W0, a);
        }
        if (status != Status::ok) {
            stages.simple_start(a.base, W0, a.Q);
            status = solve_stages(W0, a);
        }
        return status;
    }

private:
    template <class AnyFixedPoint>
    void begin_fixed_point(AnyFixedPoint& any) {
        any.pause = Pause();
        if constexpr (along_coordinates)
            any.iteration.begin(q, u, W + (s - 1) * n);
        else
            any.iteration.begin(q, W + (s - 1) * n);
    }

    // A step by iterations; where they fail, all is made ready for Newton's iteration.
    template <class AnyFixedPoint>
    bool iterate(AnyFixedPoint& any) {
        const bool paused = any.pause.left > 0;
        if (!any.pause.count_down()) return false;
        if (paused) {
            const auto minus_acceleration = [this](int i, int k) { return node_minus_acceleration(i, k); };
            if constexpr (along_coordinates)
                any.iteration.recall(q, u, minus_acceleration);
            else
                any.iteration.recall(minus_acceleration, [this](int i, int k) { return node_position(i, k); });
        }
        any.iteration.tolerance = this->tolerance;
        if (fixed_point_step(any.iteration)) {
            iterations = static_cast<std::int32_t>(any.iteration.evaluations);
            increment = any.iteration.increment;
            any.pause.succeed();
            is_current = false;
            has_history = true;
            ++this->steps;
            return true;
        }
        if (!is_current)
            for (int k = 0; k < n; ++k) {
                for (int i = 0; i < s; ++i) W[i * n + k] = any.iteration.minus_acceleration(i, k);
                if constexpr (along_coordinates) {
                    q_before[k] = any.iteration.q[any.iteration.then][k];
                    u_before[k] = any.iteration.u[any.iteration.then][k];
                }
            }
        is_current = true;
        any.pause.fail();
        return false;
    }

    // q and u move on where the iterations succeed, and leave their values in q_before and u_before, or in the
    // iterations' memory.
    template <class AnyIteration>
    bool fixed_point_step(AnyIteration& iteration) {
        if constexpr (along_coordinates) {
            if (!iteration.step(coefficients, this->time())) return false;
            iteration.state(q, u);
        } else {
            real q1[n], u1[n];
            for (int k = 0; k < n; ++k) {
                q1[k] = q[k];
                u1[k] = u[k];
            }
            if (!iteration.step(coefficients, this->time(), q1, u1)) return false;
            for (int k = 0; k < n; ++k) {
                q_before[k] = q[k];
                u_before[k] = u[k];
                q[k] = q1[k];
                u[k] = u1[k];
            }
        }
        return true;
    }

    Status step_in(Arrays& a) {
        const Status solved = solve_from_start(a);
        if (solved != Status::ok) return solved;
        const Stages stages(step_size);
        const real* const W0 = W + (s - 1) * n;
        stages.arrive(a.base, a.W, a.q1);
        Formulas<K>::minus_acceleration(coefficients, this->next_time(), a.q1, a.W1);
        stages.finish(a.v, a.W, a.W1, a.u1);
        real sum = real(0);
        for (int k = 0; k < n; ++k) sum += (a.q1[k] - a.q1[k]) + (a.u1[k] - a.u1[k]) + (a.W1[k] - a.W1[k]);
        if (!(sum == real(0))) return Status::not_finite;
        for (int k = 0; k < n; ++k) {
            q_before[k] = q[k];
            u_before[k] = u[k];
            q[k] = a.q1[k];
            u[k] = a.u1[k];
            W[k] = W0[k];
        }
        for (int i = 0; i < N; ++i) W[n + i] = a.W[i];
        for (int k = 0; k < n; ++k) W[(s - 1) * n + k] = a.W1[k];
        has_history = true;
        ++this->steps;
        return Status::ok;
    }

    Status solve_stages(const real* W0, Arrays& a) {
        const auto outcome = newton.solve(coefficients, step_size, this->time(), q, W0, a);
        iterations = outcome.iterations;
        increment = outcome.increment;
        return outcome.status;
    }
};

}  // namespace lobatto

#endif
// Round-off-clean steps of systems with constant mass: what remains of rounding is random, and small.
//
// Three things make errors of rounding grow like a random walk (Brouwer's law: energy like sqrt(N), phase like N^(3/2))
// and not in proportion to the number N of steps; formula numbers (D..) of docs/derivation.md:
//   Coefficients are exactly symplectic as they stand in the machine (D38). On the grid of multiples of 2^(e - digits),
//     |h| < 2^e, gamma_i ~ h c_i; beta_i = h - gamma_i; eta_ij ~ h A_ij / b_j for i <= j, and below the diagonal
//     eta_ij = eta_ji + gamma_i - gamma_j, all without rounding. With impulses f_j = -h b_j W(Q_j), however rounded,
//         Q_i = q + gamma_i (u + f_1) + sum_j eta_ij f_j,   q1 = q + h (u + f_1) + sum_j beta_j f_j,   u1 = u + sum f
//     is symplectic, since eta_ij - eta_ji = gamma_i - gamma_j. (In the nodes f and positions are rounded once.)
//   Fixed-point iterations go on until they give the same bits again, or last bits alternate; a longer cycle of last
//   bits is left after
//     eight iterations. Newton's iteration takes the steps in which iterations do not get there.
//   Position and velocity are sums of two numbers each, and the increments of a step are added without error: products
//     with b_j too, whose rounding is not random where b_j is a simple fraction.
// The scheme is that of Antonana, Makazaga and Murua (Numer. Algorithms 76, 2017) for Gauss' methods, in the form that
// methods for second-order equations take here; error-free sums and products are Knuth's and Dekker's.
#ifndef LOBATTO_KERNEL_CLEAN_HPP
#define LOBATTO_KERNEL_CLEAN_HPP

#include <limits>
#include <type_traits>

namespace lobatto {

// a + b = sum + error, for any sizes of a and b.
template <class V>
LOBATTO_INLINE V add_with_error(const V& a, const V& b, V& error) {
    const V sum = a + b, of_b = sum - a;
    error = (a - (sum - of_b)) + (b - of_b);
    return sum;
}

template <class real>
constexpr bool has_64_bits = std::is_same_v<real, long double>&& std::numeric_limits<real>::digits == 64;

// x = high + low, of half its 64 digits each (Veltkamp).
inline void split(long double x, long double& high, long double& low) {
    const long double shifted = 4294967297.0L * x;  // 2^32 + 1
    high = shifted - (shifted - x);
    low = x - high;
}

// a b = product + error, as long as the error is a normal number.
template <class V>
LOBATTO_INLINE V multiply_with_error(const V& a, const V& b, V& error) {
    using real = real_of<V>;
    const V product = a * b;
    if constexpr (has_fused && sizeof(real) <= 8) {
        error = fused(a, b, -product);
    } else if constexpr (has_64_bits<real>) {  // Dekker's product: the library's fma is slow
        for (int i = 0; i < lanes_of<V>; ++i) {
            real a_high, a_low, b_high, b_low;
            split(lane_of(a, i), a_high, a_low);
            split(lane_of(b, i), b_high, b_low);
            set_lane(error, i,
                     ((a_high * b_high - lane_of(product, i)) + a_high * b_low + a_low * b_high) + a_low * b_low);
        }
    } else {
        for (int i = 0; i < lanes_of<V>; ++i)
            set_lane(error, i, rounded_once(lane_of(a, i), lane_of(b, i), -lane_of(product, i)));
    }
    return product;
}

// A number as the sum of two, the second below the rounding of the first; `add` errs by what the second rounds.
template <class V>
struct TwoFold {
    V value, rest;

    LOBATTO_INLINE void add(const V& x) {
        V error;
        value = add_with_error(value, x, error);
        rest = rest + error;
    }
    LOBATTO_INLINE void add_product(const V& a, const V& b) {
        V error;
        const V product = multiply_with_error(a, b, error);
        add(product);
        rest = rest + error;
    }
    LOBATTO_INLINE TwoFold sum_with(const TwoFold& increment) const {
        V error;
        const V all = add_with_error(value, increment.value, error);
        const V small = error + (increment.rest + rest);
        TwoFold result;
        result.value = all + small;
        result.rest = small - (result.value - all);
        return result;
    }
};

// What an iteration has done to the positions.
template <class real>
struct Change {
    bool none, back;  // the same bits as before; those of before the last change
    real size;        // the largest change, relative to the motion of its coordinate or a thousandth of the largest
    real own;         // relative to the motion of its coordinate alone
};

// A multiple of `unit`, a power of 2, next to x; |x| < unit / epsilon * 2.
template <class real>
real on_grid(real x, real unit) {
    const real half_way = real(1) / Limits<real>::epsilon, units = fabs(x) / unit;  // from there on numbers are whole
    const real rounded = (units < half_way ? (units + half_way) - half_way : units) * unit;
    return x < real(0) ? -rounded : rounded;
}

template <class K>
struct CleanFixedPoint {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2, inner_room = m > 0 ? m : 1;
    using Layout = NodeLayout<real, real, m>;
    using V = typename Layout::V;
    static constexpr int width = Layout::width, evaluation_limit = 30, correction_limit = 12, patience = 8;
    static constexpr Convergence<real, 1, NoisyPace> rule{Limits<real>::epsilon};  // noise may stay as it is
    static constexpr int parts = m > 0 ? Layout::parts_of(m) : 1;

    struct Arrays {
        V first[parts * n], X[parts * n], older[parts * n], W[parts * n];
        real flat[parts * width], inverse_scale[n], inverse_own[n], next[s * n];
        real q1[n], q1_rest[n], u1[n], u1_rest[n];
    };

    V eta[inner_room][parts];  // a column for each inner node
    V gamma[parts];            // h c
    V weight[parts];           // -h b; zero in lanes to spare
    V before[s][parts];        // -h^2 A E: from the accelerations of the step before (D15)
    V simple[parts];           // -h^2 A, row sums
    V node_time[parts];
    real impulse[s];  // -h b
    real beta[s];     // h, then h - gamma
    real h{};
    int evaluations{};  // of the last step
    real increment{};   // the last one of the last step, relative

    Status prepare(real step) {
        h = step;
        real power = real(1);
        while (power <= fabs(h) && is_finite(power)) power *= real(2);
        while (power > real(2) * fabs(h) && power > real(0)) power /= real(2);
        const real unit = power * (Limits<real>::epsilon / real(2));
        if (!(unit > real(0)) || !is_finite(power)) return Status::not_finite;
        real g[inner_room], e[inner_room * inner_room];
        for (int i = 0; i < m; ++i) g[i] = on_grid(h * K::c[i + 1], unit);
        for (int i = 0; i < m; ++i)
            for (int j = i; j < m; ++j) e[i * m + j] = on_grid(h * (K::A[i * m + j] / K::b[j + 1]), unit);
        for (int i = 0; i < m; ++i)
            for (int j = 0; j < i; ++j) e[i * m + j] = e[j * m + i] + (g[i] - g[j]);
        for (int j = 0; j < s; ++j) impulse[j] = -h * K::b[j];
        beta[0] = h;
        for (int j = 0; j < m; ++j) beta[j + 1] = h - g[j];
        beta[s - 1] = real(0);
        for (int i = 0; i < parts * width && m > 0; ++i) {
            const int row = i < m ? i : m - 1;
            const auto put = [i](V* values, real x) { set_lane(values[i / width], i % width, x); };
            put(gamma, g[row]);
            put(node_time, h * K::c[row + 1]);
            put(weight, i < m ? impulse[i + 1] : real(0));
            for (int j = 0; j < m; ++j) put(eta[j], e[row * m + j]);
            // Where iterations begin need not be on the grid.
            put(simple, -h * h * stage_coefficients<K>.sum[row]);
            for (int l = 0; l < s; ++l) put(before[l], -h * h * stage_coefficients<K>.before[row][l]);
        }
        return Status::ok;
    }

    // What the positions of a step are made of before any iteration, and the measures of changes. W: the accelerations
    // of the step before. What a coordinate that hardly moves gets from its neighbours' rounding is much by its own
    // measure.
    void set_out(const real* q, const real* u, const real* u_rest, const real* W, Arrays& a) const {
        if constexpr (m == 0) return;
        real largest_scale = real(0);
        for (int c = 0; c < n; ++c) {
            real rest;
            const real rate = add_with_error(u[c], impulse[0] * W[(s - 1) * n + c], rest);
            rest += u_rest[c];
            for (int p = 0; p < parts; ++p) a.first[p * n + c] = fused(gamma[p], V(rate), gamma[p] * V(rest));
            const real scale = maximum(fabs(q[c]) + fabs(h * rate), Limits<real>::smallest);
            a.inverse_own[c] = real(1) / scale;
            largest_scale = maximum(largest_scale, scale);
        }
        const real most = real(1024) / largest_scale;
        for (int c = 0; c < n; ++c) a.inverse_scale[c] = minimum(a.inverse_own[c], most);
    }

    // The accelerations a.W at the inner nodes of a step, by iterations. W: those of the step before, node-major. False
    // where iterations do not contract.
    template <class Given>
    bool solve(const Given& k, real time, const real* q, const real* q_rest, const real* W, bool has_history,
               Arrays& a) {
        evaluations = 0;
        increment = real(0);
        if constexpr (m == 0) return true;
        for (int c = 0; c < n; ++c)
            for (int p = 0; p < parts; ++p) {
                V Z = a.first[p * n + c];
                if (has_history)
                    for (int l = 0; l < s; ++l) Z = fused(before[l][p], V(W[l * n + c]), Z);
                else
                    Z = fused(simple[p], V(W[(s - 1) * n + c]), Z);
                a.older[p * n + c] = a.X[p * n + c] = V(q[c]) + Z;
            }
        real last = Limits<real>::largest;
        int noisy = 0;  // iterations that changed no more than rounding may
        while (evaluations < evaluation_limit) {
            for (int p = 0; p < parts; ++p)
                Formulas<K>::minus_acceleration(k, V(time) + node_time[p], static_cast<const V*>(a.X + p * n),
                                                a.W + p * n);
            ++evaluations;
            const Change<real> change = iterate(q, q_rest, a);
            increment = change.size;
            if (change.none || (change.back && rule.is_noise(change.own))) return true;
            noisy += rule.is_noise(change.own) ? 1 : 0;
            if (noisy > patience) return true;  // in a longer cycle
            if (evaluations > rule.judged_after && !rule.contracts(change.size, last)) return false;
            last = change.size;
        }
        return false;
    }

    // The positions that a.W gives, in place of X.
    Change<real> iterate(const real* q, const real* q_rest, Arrays& a) const {
        V worst = V(real(0)), worst_own = V(real(0));
        bool none = true, back = true;
        for (int c = 0; c < n; ++c) {
            for (int p = 0; p < parts; ++p) {
                const V f = weight[p] * a.W[p * n + c];
                lay_flat<1>(&f, 1, a.flat + p * width);
            }
            for (int p = 0; p < parts; ++p) {
                V even = a.first[p * n + c], odd = V(q_rest[c]);
#pragma GCC unroll 16
                for (int j = 0; j < m; ++j) {
                    V& sum = j % 2 == 0 ? even : odd;
                    sum = fused(eta[j][p], V(a.flat[j]), sum);
                }
                const V X = V(q[c]) + (even + odd), old = a.X[p * n + c];
                none = none && all(X == old);
                back = back && all(X == a.older[p * n + c]);
                const V moved = fabs(X - old);
                worst = maximum(worst, moved * V(a.inverse_scale[c]));
                worst_own = maximum(worst_own, moved * V(a.inverse_own[c]));
                a.older[p * n + c] = old;
                a.X[p * n + c] = X;
            }
        }
        return {none, back, largest(worst), largest(worst_own)};
    }

    // `use` is given a Pack of the type to use and the first coordinate of its lanes.
    template <class Use>
    LOBATTO_INLINE static void over_coordinates(const Use& use) {
        constexpr int lanes = native_lanes<real>;
        int c = 0;
        for (; c + lanes <= n; c += lanes) use(Pack<real, lanes>(), c);
        for (; c < n; ++c) use(Pack<real, 1>(), c);
    }

    // The end of the step from the accelerations a.W at its inner nodes: q, u, their rests and W, of all nodes, move
    // on. False, and nothing has moved, where a number is not finite.
    template <class Given>
    bool finish(const Given& k, real end_time, real* q, real* q_rest, real* u, real* u_rest, real* W, Arrays& a) const {
        real* const next = a.next;
        for (int c = 0; c < n; ++c) {
            for (int p = 0; m > 0 && p < parts; ++p) lay_flat<1>(&a.W[p * n + c], 1, a.flat + p * width);
            next[c] = W[(s - 1) * n + c];
            for (int j = 0; j < m; ++j) next[(j + 1) * n + c] = a.flat[j];
        }
        over_coordinates([&](auto lanes, int c) LOBATTO_FORMULA {
            using L = decltype(lanes);
            TwoFold<L> moved{L(real(0)), L(h) * L::load(u_rest + c)};
            moved.add_product(L(h), L::load(u + c));
            for (int j = 0; j <= m; ++j) {
                L error;
                const L f = multiply_with_error(L(impulse[j]), L::load(next + j * n + c), error);
                moved.add_product(L(beta[j]), f);
                moved.rest = fused(L(beta[j]), error, moved.rest);
            }
            moved = TwoFold<L>{L::load(q + c), L::load(q_rest + c)}.sum_with(moved);
            moved.value.store(a.q1 + c);
            moved.rest.store(a.q1_rest + c);
        });
        Formulas<K>::minus_acceleration(k, end_time, static_cast<const real*>(a.q1), next + (s - 1) * n);
        over_coordinates([&](auto lanes, int c) LOBATTO_FORMULA {
            using L = decltype(lanes);
            TwoFold<L> change{L(real(0)), L(real(0))};
            for (int j = 0; j < s; ++j) change.add_product(L(impulse[j]), L::load(next + j * n + c));
            change = TwoFold<L>{L::load(u + c), L::load(u_rest + c)}.sum_with(change);
            change.value.store(a.u1 + c);
            change.rest.store(a.u1_rest + c);
        });
        real sum = real(0);
        for (int c = 0; c < n; ++c)
            sum += (a.q1[c] - a.q1[c]) + (a.u1[c] - a.u1[c]) + (next[(s - 1) * n + c] - next[(s - 1) * n + c]);
        if (!(sum == real(0))) return false;
        for (int c = 0; c < n; ++c) {
            q[c] = a.q1[c];
            q_rest[c] = a.q1_rest[c];
            u[c] = a.u1[c];
            u_rest[c] = a.u1_rest[c];
        }
        for (int i = 0; i < s * n; ++i) W[i] = next[i];
        return true;
    }
};

// The stepper of steppers/separable.hpp with clean steps in place of its own.
template <class K>
struct Stepper<K, Form::separable, Stepping::clean> : Stepper<K, Form::separable, Stepping::solved> {
    using Plain = Stepper<K, Form::separable, Stepping::solved>;
    using real = typename K::real;
    using Plain::n, Plain::m, Plain::s, Plain::q, Plain::u, Plain::W, Plain::coefficients, Plain::q_before,
        Plain::u_before, Plain::has_history, Plain::iterations, Plain::increment;
    using FixedPoint = CleanFixedPoint<K>;

    real q_rest[n]{}, u_rest[n]{};  // position and velocity are q + q_rest, u + u_rest
    FixedPoint fixed_point;
    Pause pause;
    Workspace<typename FixedPoint::Arrays> clean_workspace;

    Status prepare(const typename K::Parameters& parameters, real h) {
        const Status status = Plain::prepare(parameters, h);
        return status == Status::ok ? fixed_point.prepare(h) : status;
    }

    Status start(real time, const real* position, const real* momentum) {
        for (int c = 0; c < n; ++c) q_rest[c] = u_rest[c] = real(0);
        pause = Pause();
        return Plain::start(time, position, momentum);
    }

    Status step() {
        if (this->time_stands_still()) return Status::time_stands_still;
        return clean_workspace.with([this](typename FixedPoint::Arrays& a) { return step_in(a); });
    }

private:
    Status step_in(typename FixedPoint::Arrays& a) {
        const real time = this->time();
        real q_old[n], u_old[n];
        for (int c = 0; c < n; ++c) {
            q_old[c] = q[c];
            u_old[c] = u[c];
        }
        fixed_point.set_out(q, u, u_rest, W, a);
        const auto finish = [&] {
            return fixed_point.finish(coefficients, this->next_time(), q, q_rest, u, u_rest, W, a);
        };
        if (pause.count_down() && fixed_point.solve(coefficients, time, q, q_rest, W, has_history, a) && finish()) {
            pause.succeed();
            iterations = static_cast<std::int32_t>(fixed_point.evaluations);
        } else {
            if (pause.left == 0) pause.fail();
            const Status status =
                this->workspace.with([&](typename Plain::Arrays& plain) { return correct(plain, a); });
            if (status != Status::ok) return status;
            if (!finish()) return Status::not_finite;
        }
        for (int c = 0; c < n; ++c) {
            q_before[c] = q_old[c];
            u_before[c] = u_old[c];
        }
        increment = fixed_point.increment;
        has_history = true;
        ++this->steps;
        return Status::ok;
    }

    // Where iterations do not contract: Newton's iteration for the plain equations, then with its last Jacobian
    // corrections of the clean ones, X -= J^-1 (X - iteration(X)), while they change anything and do not grow.
    Status correct(typename Plain::Arrays& plain, typename FixedPoint::Arrays& a) {
        const Status status = this->solve_from_start(plain);
        if constexpr (m > 0) {
            if (status != Status::ok) return status;
            constexpr int width = FixedPoint::width;
            real last = Limits<real>::largest;
            for (int correction = 0; correction < FixedPoint::correction_limit; ++correction) {
                for (int i = 0; i < m; ++i)
                    Formulas<K>::minus_acceleration(coefficients, this->node_time(i),
                                                    static_cast<const real*>(plain.Q + i * n), plain.W + i * n);
                for (int lane = 0; lane < FixedPoint::parts * width; ++lane)
                    for (int c = 0; c < n; ++c) {
                        const int place = (lane / width) * n + c, i = lane < m ? lane : m - 1;
                        set_lane(a.W[place], lane % width, plain.W[i * n + c]);
                        set_lane(a.X[place], lane % width, plain.Q[i * n + c]);
                        set_lane(a.older[place], lane % width, plain.Q[i * n + c]);
                    }
                ++iterations;
                fixed_point.iterate(q, q_rest, a);
                for (int i = 0; i < m; ++i)
                    for (int c = 0; c < n; ++c)
                        plain.delta[i * n + c] = lane_of(a.X[(i / width) * n + c], i % width) - plain.Q[i * n + c];
                StageEquations<K>::solve_for(plain.matrix, plain.delta, plain.sorted);
                bool changes = false;
                real worst = real(0);
                for (int i = 0; i < m; ++i)
                    for (int c = 0; c < n; ++c) {
                        const real delta = plain.delta[i * n + c], node = plain.Q[i * n + c];
                        if (!is_finite(delta)) return Status::not_finite;
                        changes = changes || node + delta != node;
                        worst = maximum(worst, fabs(delta) * a.inverse_scale[c]);
                    }
                fixed_point.increment = worst;
                if (!changes || (correction > 1 && !(worst < last))) break;
                last = worst;
                for (int i = 0; i < m * n; ++i) plain.Q[i] += plain.delta[i];
            }
        }
        return status;
    }
};

}  // namespace lobatto

#endif
// Steps of explicit splitting methods: kicks u -= h b_i W(q_i) and drifts q += h a_i u in turn (D40).
//
// Nothing is solved for, so that a step costs its gradients and no step can fail to converge. However their lengths are
// rounded, a kick and a drift are symplectic. One trajectory goes by itself, its neighbouring coordinates in the lanes
// of Packs where formulas join these; or several side by side.
#ifndef LOBATTO_KERNEL_EXPLICIT_HPP
#define LOBATTO_KERNEL_EXPLICIT_HPP

#include <cstdint>
#include <type_traits>

namespace lobatto {

// The lengths of a step's kicks and drifts.
template <class K>
struct Composition {
    using real = typename K::real;
    static constexpr int s = K::points;
    static constexpr bool kicks_ends = K::b[0] != real(0);  // else a step begins and ends with a drift

    real kick[s];  // -h b
    real drift[s - 1];

    void prepare(real h) {
        for (int i = 0; i < s; ++i) kick[i] = -h * K::b[i];
        for (int i = 0; i < s - 1; ++i) drift[i] = h * K::drift_length[i];
    }
};

// One step of q and u; W is that at their positions, before and after, where ends are kicked. T: a number or a Pack.
template <class K, class T, class Given>
LOBATTO_INLINE void kick_and_drift(const Composition<K>& composition, const Given& k, typename K::real time,
                                   typename K::real h, T* q, T* u, T* W) {
    constexpr int n = K::coordinates, s = K::points;
    const auto kick = [&](int i) LOBATTO_FORMULA {
        for (int c = 0; c < n; ++c) u[c] = fused(T(composition.kick[i]), W[c], u[c]);
    };
    const auto drift = [&](int i) LOBATTO_FORMULA {
        for (int c = 0; c < n; ++c) q[c] = fused(T(composition.drift[i]), u[c], q[c]);
    };
    if constexpr (Composition<K>::kicks_ends) kick(0);
    drift(0);
    for (int i = 1; i < s - 1; ++i) {
        Formulas<K>::minus_acceleration(k, T(time + K::c[i] * h), static_cast<const T*>(q), W);
        kick(i);
        drift(i);
    }
    if constexpr (Composition<K>::kicks_ends) {
        Formulas<K>::minus_acceleration(k, T(time + h), static_cast<const T*>(q), W);
        kick(s - 1);
    }
}

// Takes the acceleration of a coordinate as soon as it is known, which is kicked and drifts; the last kick of a step
// keeps accelerations instead.
template <class K, class T, class Given, bool is_last>
struct KickAndDrift {
    T *q, *u, *W;
    T kick, drift;
    const Given& k;
};
template <class K, class T, class Given, bool is_last>
LOBATTO_INLINE void store_to(const KickAndDrift<K, T, Given, is_last>& step, int at, T slope) {
    if constexpr (!K::unit_masses) slope *= step.k.inverse_mass[at];
    const T velocity = fused(step.kick, slope, step.u[at]);
    step.u[at] = velocity;
    if constexpr (is_last)
        step.W[at] = slope;
    else
        step.q[at] = fused(step.drift, velocity, step.q[at]);
}

// One step from q, u and W to q1, u1 and W1 of neighbouring coordinates of trajectories side by side: once along the
// coordinates for each kick.
template <class K, class T, class Given>
LOBATTO_INLINE void immediate_step(const Composition<K>& composition, const Given& k, typename K::real time,
                                   typename K::real h, const T* q, const T* u, const T* W, T* q1, T* u1, T* W1) {
    constexpr int n = K::coordinates, s = K::points;
    const auto pass = [&](int i, auto is_last) LOBATTO_FORMULA {
        const KickAndDrift<K, T, Given, is_last()> step{
            q1, u1, W1, T(composition.kick[i]), T(is_last ? 0 : composition.drift[i]), k};
        const T* const position = q1;
        Formulas<K>::template along_rows<Immediate>(k, T(time + K::c[i] * h), position, step);
    };
    for (int c = 0; c < n; ++c) {
        u1[c] = Composition<K>::kicks_ends ? fused(T(composition.kick[0]), W[c], u[c]) : u[c];
        q1[c] = fused(T(composition.drift[0]), u1[c], q[c]);
    }
    for (int i = 1; i < s - 1; ++i) pass(i, std::false_type());
    if constexpr (Composition<K>::kicks_ends) pass(s - 1, std::true_type());
}

// Whether positions and velocities, accelerations, and what is under way fit the 32 registers of AVX-512. With the 16
// of AVX2 a part of them goes to the stack; written out, a step of 32 masses takes 206 ns there, in loops 241.
template <class K>
constexpr bool composition_fits_registers() {
    using real = typename K::real;
    constexpr int width = native_lanes<real>, parts = (K::coordinates + width - 1) / width;
    return parts <= (width * sizeof(real) == 64   ? 5
                     : width * sizeof(real) == 32 ? 8
                                                  : 0) &&
           K::row_reach >= 0 && K::row_reach <= width;
}

// Positions, velocities and accelerations of neighbouring coordinates, on the way in registers or in memory; to the
// same bits.
template <class K, bool in_registers = composition_fits_registers<K>()>
struct NeighbourComposition {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points;
    static constexpr int width = native_lanes<real>, room = room_of<K>, parts = (n + width - 1) / width;
    using V = Pack<real, width>;

    int now{};  // the present; 1 - now: before the last step, and room for the next
    // Positions, velocities, and where ends are kicked accelerations.
    alignas(V) real q[2][room]{}, u[2][room]{}, W[2][room]{};

    void begin(const real* position, const real* velocity, const real* minus_acceleration) {
        for (int c = 0; c < n; ++c) {
            q[now][c] = position[c];
            u[now][c] = velocity[c];
            W[now][c] = minus_acceleration[c];
        }
    }
    // False, and nothing has moved, where the end is not finite; what was before the last step is lost then.
    bool step(const Composition<K>& composition, const typename K::Coefficients& k, real time, real h) {
        if constexpr (in_registers) {
            V position[parts], velocity[parts], slope[parts];
            return step_in(composition, k, time, h, Registers<V, parts>{position}, Registers<V, parts>{velocity},
                           Registers<V, parts>{slope});
        } else {
            return step_in(composition, k, time, h, +q[1 - now], +u[1 - now], +W[1 - now]);
        }
    }

private:
    template <class Row, class F>
    LOBATTO_INLINE static void over_parts(const F& f) {
        if constexpr (are_registers<Row>)
            written_out<width>(parts * width, f);
        else
            for (int at = 0; at < parts * width; at += width) f(at);
    }
    template <class Row>
    LOBATTO_INLINE static void accelerate(const typename K::Coefficients& k, real time, Row position, Row slope) {
        using How = std::conditional_t<are_registers<Row>, WrittenOut, SideBySide>;
        Formulas<K>::template along_rows<How>(k, time, position, slope);
    }
    template <class Row>
    LOBATTO_INLINE bool step_in(const Composition<K>& composition, const typename K::Coefficients& k, real time, real h,
                                Row position, Row velocity, Row slope) {
        over_parts<Row>([&](int at) LOBATTO_FORMULA {
            const V start = V::load(W[now] + at);
            V first = V::load(u[now] + at);
            if constexpr (Composition<K>::kicks_ends) first = fused(V(composition.kick[0]), start, first);
            store_to(slope, at, start);
            store_to(velocity, at, first);
            store_to(position, at, fused(V(composition.drift[0]), first, V::load(q[now] + at)));
        });
        for (int i = 1; i < s - 1; ++i) {
            accelerate(k, time + K::c[i] * h, position, slope);
            over_parts<Row>([&](int at) LOBATTO_FORMULA {
                const V moved = fused(V(composition.kick[i]), load_from<V>(slope, at), load_from<V>(velocity, at));
                store_to(velocity, at, moved);
                store_to(position, at, fused(V(composition.drift[i]), moved, load_from<V>(position, at)));
            });
        }
        if constexpr (Composition<K>::kicks_ends) accelerate(k, time + h, position, slope);
        V not_finite = V(real(0));
        over_parts<Row>([&](int at) LOBATTO_FORMULA {
            V last = load_from<V>(velocity, at);
            const V there = load_from<V>(position, at), bent = load_from<V>(slope, at);
            if constexpr (Composition<K>::kicks_ends) last = fused(V(composition.kick[s - 1]), bent, last);
            not_finite = fused(V(real(0)), last + there, not_finite);
            there.store(q[1 - now] + at);
            last.store(u[1 - now] + at);
            bent.store(W[1 - now] + at);
        });
        if (any(not_finite != V(real(0)))) return false;
        now = 1 - now;
        return true;
    }
};

template <class K, bool along_neighbours>
struct NeighbourCompositionOf {
    using type = NeighbourComposition<K>;
};
template <class K>
struct NeighbourCompositionOf<K, false> {
    struct type {};
};

template <class K>
struct Stepper<K, Form::separable, Stepping::composition> : ConstantMass<K> {
    using typename ConstantMass<K>::real;
    using ConstantMass<K>::n, ConstantMass<K>::coefficients, ConstantMass<K>::step_size, ConstantMass<K>::q,
        ConstantMass<K>::u;
    static constexpr int s = K::points;
    static constexpr int nodes = s - (Composition<K>::kicks_ends ? 1 : 2);  // gradients of a step
    static constexpr int N = 0;

    // The ends of the last step, for what lies between them.
    struct Ends {
        std::int64_t of{-1};  // this many steps since start; -1: not computed
        real W[2][n]{};
    };
    using Nothing = typename NeighbourCompositionOf<K, false>::type;

    Composition<K> composition{};
    real W[n]{};                        // M^-1 grad V at q, where ends are kicked; not of neighbours
    real q_before[n]{}, u_before[n]{};  // before the last step; likewise
    bool has_history{};                 // what lies between the ends of the last step is known
    mutable Ends ends{};
    typename NeighbourCompositionOf<K, K::neighbours>::type neighbours{};

    Status prepare(const typename K::Parameters& parameters, real h) {
        step_size = h;
        has_history = false;
        composition.prepare(h);
        return K::prepare(parameters, h, coefficients);
    }

    Status start(real time, const real* position, const real* momentum) {
        const Status status = this->begin(time, position, momentum, W);
        has_history = false;
        ends.of = -1;
        if constexpr (K::neighbours) neighbours.begin(q, u, W);
        return status;
    }

    Status step() {
        if (this->time_stands_still()) return Status::time_stands_still;
        if (!move(neighbours)) {
            has_history = has_history && !K::neighbours;
            return Status::not_finite;
        }
        has_history = true;
        ++this->steps;
        return Status::ok;
    }

    // The polynomial of degree 5 that has the positions, velocities and accelerations at both ends of the last step, at
    // t + theta h.
    static constexpr int basis = 0;
    void polynomial(real theta, real* position, real* velocity) const {
        evaluate_ends();
        const real t = theta, t2 = t * t, t3 = t2 * t, h = step_size;
        const real rise = t3 * (real(10) + t * (real(6) * t - real(15))),
                   rise_slope = t2 * (real(30) + t * (real(30) * t - real(60)));
        const real u0 = t + t3 * (t * (real(8) - real(3) * t) - real(6)),
                   u0_slope = real(1) + t2 * (t * (real(32) - real(15) * t) - real(18));
        const real u1 = t3 * (t * (real(7) - real(3) * t) - real(4)),
                   u1_slope = t2 * (t * (real(28) - real(15) * t) - real(12));
        const real a0 = real(0.5) * t2 * (real(1) + t * (t * (real(3) - t) - real(3))),
                   a0_slope = real(0.5) * t * (real(2) + t * (t * (real(12) - real(5) * t) - real(9)));
        const real a1 = real(0.5) * t3 * (real(1) + t * (t - real(2))),
                   a1_slope = real(0.5) * t2 * (real(3) + t * (real(5) * t - real(8)));
        for (int k = 0; k < n; ++k) {
            const real begin = position_before(k), moved = q[k] - begin, from = h * velocity_before(k), to = h * u[k];
            const real start = h * (h * ends.W[0][k]), end = h * (h * ends.W[1][k]);
            position[k] = begin + (rise * moved + u0 * from + u1 * to - a0 * start - a1 * end);
            velocity[k] =
                (rise_slope * moved + u0_slope * from + u1_slope * to - a0_slope * start - a1_slope * end) / h;
        }
    }

    // M^-1 grad V where the motion is, of coordinate c; where ends are kicked.
    real minus_acceleration(int c) const {
        if constexpr (K::neighbours)
            return neighbours.W[neighbours.now][c];
        else
            return W[c];
    }

    // There are no equations.
    Status residual(real, const real*, const real*, const real*, real*) const { return Status::ok; }
    Status jacobian(real, const real*, const real*, const real*, real*) const { return Status::ok; }

    // One step from (q, p) at `time` and d(q1, p1)/d(q, p) (D24), 2n x 2n.
    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        if constexpr (K::has_tangent) {
            Stepper local = *this;
            const Status status = this->step_from(local, time, position, momentum, q1, p1);
            if (status != Status::ok) return status;
            real full[2 * n * (2 * n + 1)] = {}, at[n], rate[n], slope[n], entries[K::entries > 0 ? K::entries : 1];
            for (int k = 0; k < n; ++k) at[k] = position[k];
            K::velocity(coefficients, momentum, rate);
            for (int i = 0; i < s; ++i) {
                Formulas<K>::node(coefficients, time + K::c[i] * step_size, static_cast<const real*>(at), +slope,
                                  +entries);
                for (int k = 0; k < n; ++k) rate[k] = fused(composition.kick[i], slope[k], rate[k]);
                kick_increment<K>(composition.kick[i], entries, static_cast<const real*>(nullptr), full);
                if (i == s - 1) break;
                for (int k = 0; k < n; ++k) at[k] = fused(composition.drift[i], rate[k], at[k]);
                drift_increment<K>(composition.drift[i], full);
            }
            to_momentum<K>(coefficients, full);
            add_identity<K>(full, T);
            return Status::ok;
        } else {
            (void)time, (void)position, (void)momentum, (void)q1, (void)p1, (void)T;
            return Status::unsupported;
        }
    }

private:
    bool move(Nothing&) {
        real q1[n], u1[n], W1[n], sum = real(0);
        for (int k = 0; k < n; ++k) {
            q1[k] = q[k];
            u1[k] = u[k];
            W1[k] = W[k];
        }
        kick_and_drift<K>(composition, coefficients, this->time(), step_size, q1, u1, W1);
        for (int k = 0; k < n; ++k) sum += (q1[k] - q1[k]) + (u1[k] - u1[k]);
        if (!(sum == real(0))) return false;
        for (int k = 0; k < n; ++k) {
            q_before[k] = q[k];
            u_before[k] = u[k];
            q[k] = q1[k];
            u[k] = u1[k];
            W[k] = W1[k];
        }
        return true;
    }
    template <class Neighbours>
    bool move(Neighbours& all) {
        if (!all.step(composition, coefficients, this->time(), step_size)) return false;
        copy_lanes<n>(all.q[all.now], q);
        copy_lanes<n>(all.u[all.now], u);
        return true;
    }

    real position_before(int k) const {
        if constexpr (K::neighbours)
            return neighbours.q[1 - neighbours.now][k];
        else
            return q_before[k];
    }
    real velocity_before(int k) const {
        if constexpr (K::neighbours)
            return neighbours.u[1 - neighbours.now][k];
        else
            return u_before[k];
    }
    void evaluate_ends() const {
        if (ends.of == this->steps) return;
        ends.of = this->steps;
        real begin[n];
        for (int k = 0; k < n; ++k) begin[k] = position_before(k);
        Formulas<K>::minus_acceleration(coefficients, this->start_time + real(this->steps - 1) * step_size,
                                        static_cast<const real*>(begin), +ends.W[0]);
        Formulas<K>::minus_acceleration(coefficients, this->time(), static_cast<const real*>(q), +ends.W[1]);
    }
};

template <class K, class T>
struct LaneStepper<K, T, Form::separable, Stepping::composition> {
    using real = typename K::real;
    using ActiveMask = decltype(T() < T());
    static constexpr int n = K::coordinates;
    int now{};  // the present; 1 - now: room for the next
    T q[2][n], u[2][n], W[2][n], evaluations = T(real(0));
    Composition<K> composition;
    real h;

    const T& position(int c) const { return q[now][c]; }
    void prepare(const ScalarFallback<K>& single, int) {
        composition = single.composition;
        h = single.step_size;
    }
    void set_tolerance(real) {}
    void start(const ScalarFallback<K>& single, const real*, int lane) { follow(single, lane); }
    void momentum(const ScalarFallback<K>& single, int lane, real* momentum) const {
        real velocity[n];
        for (int c = 0; c < n; ++c) velocity[c] = lane_of(u[now][c], lane);
        K::momentum(single.coefficients, static_cast<const real*>(velocity), momentum);
    }
    template <class Given>
    ActiveMask step(const Given& k, real time, ActiveMask active) {
        const int next = 1 - now;
        T not_finite = T(real(0));
        if constexpr (moves_immediately<K>()) {
            immediate_step<K>(composition, k, time, h, +q[now], +u[now], +W[now], +q[next], +u[next], +W[next]);
            for (int c = 0; c < n; ++c) not_finite = fused(T(real(0)), q[next][c] + u[next][c], not_finite);
        } else {
            T q1[n], u1[n], W1[n];
            for (int c = 0; c < n; ++c) {
                q1[c] = q[now][c];
                u1[c] = u[now][c];
                W1[c] = W[now][c];
            }
            kick_and_drift<K>(composition, k, time, h, q1, u1, W1);
            for (int c = 0; c < n; ++c) {
                not_finite += (q1[c] - q1[c]) + (u1[c] - u1[c]);
                q[next][c] = q1[c];
                u[next][c] = u1[c];
                W[next][c] = W1[c];
            }
        }
        active = active & (not_finite == T(real(0)));
        if (!all(active))
            for (int c = 0; c < n; ++c) {
                q[next][c] = select(active, q[next][c], q[now][c]);
                u[next][c] = select(active, u[next][c], u[now][c]);
                if constexpr (Composition<K>::kicks_ends) W[next][c] = select(active, W[next][c], W[now][c]);
            }
        now = next;
        return active;
    }
    void follow(const ScalarFallback<K>& single, int lane) {
        for (int c = 0; c < n; ++c) {
            set_lane(q[now][c], lane, single.q[c]);
            set_lane(u[now][c], lane, single.u[c]);
            set_lane(W[now][c], lane, single.minus_acceleration(c));
        }
    }
};

}  // namespace lobatto

#endif
// Steps of any Lagrangian system: fixed-point iteration (iteration/galerkin.hpp) first, Newton's iteration
// (iteration/galerkin_newton.hpp) where it does not contract. The equations stand in iteration/galerkin_equations.hpp.
#ifndef LOBATTO_KERNEL_GENERAL_HPP
#define LOBATTO_KERNEL_GENERAL_HPP

#include <type_traits>

namespace lobatto {

template <class K>
struct Stepper<K, Form::general, Stepping::solved> : GalerkinNewton<K> {
    using Newton = GalerkinNewton<K>;
    using Newton::n, Newton::active, Newton::constraints, Newton::cyclic, Newton::Z, Newton::r, Newton::m,
        Newton::kappas, Newton::N, Newton::room, Newton::entry_room, Newton::cyclic_room, Newton::coefficients,
        Newton::step_size, Newton::q, Newton::p, Newton::iterations, Newton::increment, Newton::workspace;
    using typename Newton::real, typename Newton::Arrays, typename Newton::Layout, typename Newton::Nothing;
    static constexpr int nodes = K::nodes, multiplier_room = constraints > 0 ? constraints : 1;

    // Fixed-point iterations need the mass matrix of a node alone, which is full for them.
    static constexpr bool iterates_on_constraints = constraints > 0 && K::constant_mass;
    static constexpr bool has_fixed_point =
        (K::any_number || iterates_on_constraints) && !K::linear && N > 0 && n <= most_full;
    struct FixedPointState {
        std::conditional_t<iterates_on_constraints, ConstrainedFixedPoint<K>, GalerkinFixedPoint<K, real>> iteration;
        Pause pause;
    };

    real q_before[n]{};         // before the last step
    real elapsed{};             // of kernels with a clock: the physical time of the last step
    bool has_history{};         // there is a last step
    mutable bool is_current{};  // what follows is of the last step; else the iterations' memory is
    mutable real Y[room]{};     // displacements at the control points, then kappa, in the order of the solver
    mutable real cyclic_rates[r * cyclic_room]{};  // -g_P at the nodes
    std::conditional_t<has_fixed_point, FixedPointState, Nothing> fixed_point{};
    std::conditional_t<(cyclic > 0), real[m * m], Nothing> integration{};  // inverse of D at the first m nodes
    real last_multiplier[multiplier_room]{};                               // at the end of the last step
    VelocityOfMomentum<K> velocity_of_momentum;

    Status prepare(const typename K::Parameters& parameters, real h) {
        step_size = h;
        has_history = false;
        const Status status = K::prepare(parameters, h, coefficients);
        if (status != Status::ok) return status;
        if constexpr (cyclic > 0) {
            real D[m * m];
            for (int i = 0; i < m; ++i)
                for (int j = 0; j < m; ++j) {
                    D[i * m + j] = K::D[i * (m + 1) + j + 1];
                    integration[i * m + j] = i == j ? real(1) : real(0);
                }
            lobatto::solve<m, m>(D, integration);
        }
        if constexpr (has_fixed_point && iterates_on_constraints)
            fixed_point.iteration.prepare(coefficients, h);
        else if constexpr (has_fixed_point)
            fixed_point.iteration.prepare(h);
        if constexpr (K::linear) return freeze(frozen);
        return Status::ok;
    }

    Status start(real time, const real* position, const real* momentum) {
        this->start_time = time;
        this->steps = 0;
        has_history = false;
        for (int k = 0; k < n; ++k) {
            q[k] = position[k];
            p[k] = momentum[k];
        }
        if (!is_finite(time + not_finite_part(q, n) + not_finite_part(p, n))) return Status::not_finite;
        real v[n], mu[multiplier_room];
        Status status = velocity(time, q, p, v, mu);
        if (status == Status::ok) status = check_constraints(v, mu);
        is_current = true;
        if constexpr (has_fixed_point) begin_fixed_point(fixed_point, v);
        if constexpr (K::events > 0) {
            if (status == Status::ok) Formulas<K>::event(coefficients, time, q, v, this->event_values);
        }
        return status;
    }

    void momentum(real* momentum) const {
        for (int k = 0; k < n; ++k) momentum[k] = p[k];
    }

    Status step() {
        if (this->time_stands_still()) return Status::time_stands_still;
        if constexpr (has_fixed_point) {
            if (iterate(fixed_point)) return Status::ok;
        }
        return workspace.with([this](Arrays& arrays) { return step_in(arrays); });
    }

    // The polynomial of the last step through its control points, at t + theta h.
    void polynomial(real theta, real* position, real* velocity) const {
        real value[m + 1], slope[m + 1];
        basis_at(theta, value, slope);
        polynomial(value, slope, position, velocity);
    }
    static constexpr int basis = m + 1;  // polynomials
    static void basis_at(real theta, real* value, real* slope) { lagrange<m + 1>(K::control, theta, value, slope); }
    void polynomial(const real* value, const real* slope, real* position, real* velocity) const {
        refresh();
        for (int a = 0; a < active; ++a) {
            const int k = K::active_index[a];
            real moved = real(0), rate = real(0);
            for (int j = 0; j < m; ++j) {
                moved += value[j + 1] * Y[Layout::index(a, j)];
                rate += slope[j + 1] * Y[Layout::index(a, j)];
            }
            position[k] = q_before[k] + moved;
            velocity[k] = rate / step_size;
        }
        if constexpr (cyclic > 0) {
            for (int c = 0; c < cyclic; ++c) {  // D Y = h v_c at the first m nodes
                const int k = K::cyclic_index[c];
                real moved = real(0), rate = real(0);
                for (int j = 0; j < m; ++j) {
                    real y = real(0);
                    for (int i = 0; i < m; ++i) y += integration[j * m + i] * cyclic_rates[i * cyclic + c];
                    moved += value[j + 1] * y;
                    rate += slope[j + 1] * y;
                }
                position[k] = q_before[k] + step_size * moved;
                velocity[k] = rate;
            }
        }
    }

    void momentum(real time, const real* position, const real* velocity, real* momentum) const {
        Formulas<K>::momentum(coefficients, time, position, velocity, momentum);
    }
    Status energy(real time, const real* position, const real* momentum, real* value) const {
        if constexpr (K::has_energy) {
            real v[n];
            const Status status = velocity(time, position, momentum, v);
            if (status == Status::ok) *value = Formulas<K>::energy(coefficients, time, position, v);
            return status;
        } else {
            (void)time, (void)position, (void)momentum, (void)value;
            return Status::unsupported;
        }
    }
    void slopes(real time, const real* position, const real* velocity, real* Lv, real* Lq) const {
        Formulas<K>::slopes(coefficients, time, position, velocity, Lv, Lq);
    }

    Status velocity(real time, const real* position, const real* momentum, real* v) const {
        real mu[multiplier_room];
        return velocity(time, position, momentum, v, mu);
    }

    // Of the constraints, at a state.
    Status multipliers(real time, const real* position, const real* momentum, real* lambda) const {
        real v[n];
        const Status status = velocity(time, position, momentum, v);
        return status == Status::ok ? velocity_of_momentum.multipliers(coefficients, time, position, v, lambda)
                                    : status;
    }

    // One step from (q, p) at `time` and d(q1, p1)/d(q, p), 2n x 2n: J dY = -dR for each column.
    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        if constexpr (K::has_tangent) {
            Stepper local = *this;
            const Status status = this->step_from(local, time, position, momentum, q1, p1);
            if (status != Status::ok) return status;
            local.refresh();
            return workspace.with([&](Arrays& a) {
                evaluate_nodes(time, position, momentum, local.Y, a);
                a.matrix.clear();
                assemble(a.H, entry_room, a.matrix);
                if (!a.matrix.factor()) return Status::singular_jacobian;
                for (int i = 0; i < 4 * n * n; ++i) T[i] = real(0);
                for (int k = 0; k < 2 * n; ++k) T[k * 2 * n + k] = real(1);
                for (int b = 0; b < active; ++b) {
                    tangent_column(a, active + b, -1, K::active_index[b], T);
                    tangent_column(a, -1, b, n + K::active_index[b], T);
                }
                for (int c = 0; c < cyclic; ++c) tangent_column(a, 2 * active + c, -1, n + K::cyclic_index[c], T);
                return Status::ok;
            });
        } else {
            (void)time, (void)position, (void)momentum, (void)q1, (void)p1, (void)T;
            return Status::unsupported;
        }
    }

    // Velocity of coordinate c at node i of the last step.
    real node_velocity(int c, int i) const {
        refresh();
        for (int j = 0; j < cyclic; ++j)
            if (K::cyclic_index[j] == c) return cyclic_rates[i * cyclic + j];
        real sum = real(0);
        for (int b = 0; b < active; ++b)
            if (K::active_index[b] == c)
                for (int j = 0; j < m; ++j) sum += K::D[i * (m + 1) + j + 1] * Y[Layout::index(b, j)];
        return sum / step_size;
    }

private:
    using Newton::evaluate_nodes, Newton::assemble, Newton::impulse, Newton::tangent_column, Newton::freeze,
        Newton::solve_stages, Newton::frozen;

    // Y, kappa and the cyclic rates of a step that iterations have taken.
    void refresh() const {
        if constexpr (has_fixed_point) {
            if (is_current || !has_history) return;
            const auto& memory = fixed_point.iteration;
            for (int b = 0; b < active; ++b)
                for (int j = 0; j < m; ++j) Y[Layout::index(b, j)] = memory.displacement(K::active_index[b], j);
            for (int c = 0; c < constraints; ++c) {
                if constexpr (constraints > 0) {
                    for (int j = 0; j < m; ++j) Y[Layout::index(active + c, j)] = memory.lambda[c * r + j];
                }
            }
            for (int c = 0; c < cyclic; ++c) {
                if constexpr (cyclic > 0) {
                    if (kappas > 0) Y[active * m + c] = memory.kappa[K::cyclic_index[c]];
                    for (int i = 0; i < r; ++i) cyclic_rates[i * cyclic + c] = memory.v[K::cyclic_index[c] * r + i];
                }
            }
            is_current = true;
        }
    }

    template <class AnyFixedPoint>
    void begin_fixed_point(AnyFixedPoint& any, const real* v) {
        any.pause = Pause();
        any.iteration.begin(v);
    }

    // A step by iterations; where they fail, all is made ready for Newton's iteration.
    template <class AnyFixedPoint>
    bool iterate(AnyFixedPoint& any) {
        const bool paused = any.pause.left > 0;
        if (!any.pause.count_down()) return false;
        if (paused) any.iteration.recall([this](int c, int i) { return node_velocity(c, i); });
        real q1[n], p1[n];
        for (int k = 0; k < n; ++k) {
            q1[k] = q[k];
            p1[k] = p[k];
        }
        any.iteration.tolerance = this->tolerance;
        if (any.iteration.step(coefficients, this->time(), +q1, +p1, true)) {
            for (int k = 0; k < n; ++k) {
                q_before[k] = q[k];
                q[k] = q1[k];
                p[k] = p1[k];
            }
            iterations = static_cast<std::int32_t>(any.iteration.evaluations);
            increment = any.iteration.increment;
            if constexpr (K::clocked) elapsed = any.iteration.elapsed;
            if constexpr (constraints > 0)
                for (int c = 0; c < constraints; ++c) last_multiplier[c] = any.iteration.lambda[c * r + r - 1];
            any.pause.succeed();
            is_current = false;
            has_history = true;
            ++this->steps;
            return true;
        }
        refresh();
        any.pause.fail();
        return false;
    }

    // With the multipliers that the momentum would need to keep the constraints.
    Status velocity(real time, const real* position, const real* momentum, real* v, real* mu) const {
        const auto of_last_step = [this](real* guess) {
            real position_there[n];
            if (has_history) polynomial(real(1), position_there, guess);
            return has_history;
        };
        return velocity_of_momentum.find(coefficients, time, position, momentum, of_last_step, v, mu);
    }

    // Whether a start keeps the constraints, to half of the digits; v, mu: its velocity and multipliers.
    Status check_constraints(const real* v, const real* mu) const {
        if constexpr (constraints > 0) {
            real phi[constraints], phi_t[constraints], G[K::constraint_entries], size[constraints], force[n];
            Formulas<K>::constraint(coefficients, this->time(), static_cast<const real*>(q), +phi, +phi_t, +G);
            for (int c = 0; c < constraints; ++c) size[c] = fabs(step_size * phi_t[c]);
            for (int k = 0; k < n; ++k) force[k] = real(0);
            for (int e = 0; e < K::constraint_entries; ++e) {
                const int c = K::constraint_row[e], k = K::constraint_column[e];
                size[c] += fabs(G[e]) * (fabs(q[k]) + fabs(step_size * v[k]));
                force[k] += G[e] * mu[c];
            }
            for (int c = 0; c < constraints; ++c)
                if (!(fabs(phi[c]) <= Limits<real>::root_epsilon * size[c])) return Status::off_constraints;
            real largest = real(0), apart = real(0);
            for (int k = 0; k < n; ++k) {
                largest = fabs(p[k]) > largest ? fabs(p[k]) : largest;
                apart = fabs(force[k]) > apart ? fabs(force[k]) : apart;
            }
            if (!(apart <= Limits<real>::root_epsilon * largest)) return Status::off_constraints;
        } else {
            (void)v, (void)mu;
        }
        return Status::ok;
    }

    // (D46) The multipliers of the end, which keep dphi/dt = 0 there, and their part of the momentum p1.
    Status end_on_constraints(const real* q1, real* p1) {
        if constexpr (constraints > 0) {
            real v[n], mu[constraints], phi[constraints], phi_t[constraints], G[K::constraint_entries];
            const Status status = velocity(this->next_time(), q1, p1, v, mu);
            if (status != Status::ok) return status;
            Formulas<K>::constraint(coefficients, this->next_time(), q1, +phi, +phi_t, +G);
            for (int e = 0; e < K::constraint_entries; ++e)
                p1[K::constraint_column[e]] -= G[e] * mu[K::constraint_row[e]];
            for (int c = 0; c < constraints; ++c) last_multiplier[c] = -mu[c] / (step_size * K::b[r - 1]);
        } else {
            (void)q1, (void)p1;
        }
        return Status::ok;
    }

    // sum_i h b_i clock(Q_i) of the stages just solved.
    real time_passed(Arrays& a) const {
        real passed = real(0);
        if constexpr (K::clocked) {
            real Q[n];
            for (int k = 0; k < n; ++k) Q[k] = q[k];
            for (int i = 0; i < r; ++i) {
                this->node_variables(q, p, a.Y, i, a.z);
                for (int b = 0; b < active; ++b) Q[K::active_index[b]] = a.z[active + b];
                passed += K::b[i] * Formulas<K>::clock(coefficients, this->time(), static_cast<const real*>(Q));
            }
        } else {
            (void)a;
        }
        return step_size * passed;
    }

    Status step_in(Arrays& a) {
        Status status = Status::not_converged;
        if (has_history) {
            for (int b = 0; b < active; ++b) {  // the last step's polynomial, beyond its end
                const real* const last = Y + Layout::index(b, 0);
                for (int j = 0; j < m; ++j) {
                    real moved = -last[m - 1];
                    for (int k = 0; k < m; ++k) moved += K::extrapolation[(j + 1) * (m + 1) + k + 1] * last[k];
                    a.Y[Layout::index(b, j)] = moved;
                }
            }
            for (int c = 0; c < kappas; ++c) a.Y[active * m + c] = Y[active * m + c];
            for (int c = 0; c < constraints; ++c)  // at the nodes 0 ... m - 1, from those of the last step and its end
                for (int j = 0; j < m; ++j) {
                    real sum = K::extrapolation[j * (m + 1) + m] * last_multiplier[c];
                    for (int k = 0; k < m; ++k)
                        sum += K::extrapolation[j * (m + 1) + k] * Y[Layout::index(active + c, k)];
                    a.Y[Layout::index(active + c, j)] = sum;
                }
            status = solve_stages(a);
        }
        if (status != Status::ok) {  // straight on
            real v[n];
            status = velocity(this->time(), q, p, v);
            if (status != Status::ok) return status;
            for (int b = 0; b < active; ++b)
                for (int j = 0; j < m; ++j)
                    a.Y[Layout::index(b, j)] = step_size * K::control[j + 1] * v[K::active_index[b]];
            for (int c = 0; c < kappas; ++c) a.Y[active * m + c] = real(0);
            for (int c = 0; c < constraints; ++c)
                for (int j = 0; j < m; ++j) a.Y[Layout::index(active + c, j)] = real(0);
            status = solve_stages(a);
        }
        if (status != Status::ok) return status;
        for (int b = 0; b < active; ++b) {
            const int k = K::active_index[b];
            a.q1[k] = q[k] + a.Y[Layout::index(b, m - 1)];
            a.p1[k] = p[k] + impulse(a.g, active + b);
        }
        for (int c = 0; c < cyclic; ++c) {
            const int k = K::cyclic_index[c];
            a.q1[k] = q[k] - impulse(a.g, 2 * active + c);
            a.p1[k] = p[k];
        }
        if (!is_finite(not_finite_part(a.q1, n) + not_finite_part(a.p1, n))) return Status::not_finite;
        status = end_on_constraints(a.q1, a.p1);
        if (status != Status::ok) return status;
        if constexpr (K::clocked) elapsed = time_passed(a);
        for (int k = 0; k < n; ++k) {
            q_before[k] = q[k];
            q[k] = a.q1[k];
            p[k] = a.p1[k];
        }
        for (int i = 0; i < N; ++i) Y[i] = a.Y[i];
        is_current = true;
        for (int i = 0; i < r; ++i)
            for (int c = 0; c < cyclic; ++c) cyclic_rates[i * cyclic + c] = -a.g[i * Z + 2 * active + c];
        has_history = true;
        ++this->steps;
        return Status::ok;
    }
};

}  // namespace lobatto

#endif
// Steps that are equally long in the time tau of a clock, dt = g(q) dtau: a chain of them, and states at given times.
//
// The chain is that of Form::general for Lambda(q, w) = g (L(q, w / g) + E), w = dq/dtau, with the energy E of the
// start (D42). Its steps last as long as the quadrature of g along them says (D43). A state at a given time is the end
// of a step of the chain that is shortened until it ends there: it has the order of the steps, and the chain goes on
// as if nobody had asked. Velocities that callers give and get are dq/dt.
#ifndef LOBATTO_KERNEL_CLOCKED_HPP
#define LOBATTO_KERNEL_CLOCKED_HPP

namespace lobatto {

// A time as the sum of two numbers, so that a million short steps add up.
template <class real>
struct LongTime {
    real time{}, rest{};

    void add(real part) {
        const real wanted = part + rest, sum = time + wanted;
        const real added = sum - time;
        rest = (time - (sum - added)) + (wanted - added);
        time = sum;
    }
    // What is missing to `target`.
    real until(real target) const { return (target - time) - rest; }
};

template <class K>
struct Stepper<K, Form::general, Stepping::clocked> : Stepper<K, Form::general, Stepping::solved> {
    using Chain = Stepper<K, Form::general, Stepping::solved>;
    using Chain::n, Chain::q, Chain::p, Chain::coefficients, Chain::step_size, Chain::elapsed;
    using typename Chain::real;
    static constexpr int trial_limit = 60;

    typename K::Parameters values{};                      // the last one is the energy at the start
    LongTime<real> now{}, before{};                       // of the chain: its state, and that a step ago
    real p_before[n]{};                                   // as q_before
    real arrival_time{}, arrival_q[n]{}, arrival_p[n]{};  // the state at the time last asked for
    real origin{};                                        // the time at the start
    std::int64_t arrivals{};                              // since the start
    bool is_recorded{};                                   // the state of the chain

    Status prepare(const typename K::Parameters& parameters, real h) {
        values = parameters;
        return Chain::prepare(values, h);
    }

    Status start(real time, const real* position, const real* momentum) {
        Status status = Chain::start(real(0), position, momentum);
        real energy_of_start = real(0);
        if (status == Status::ok) status = energy(real(0), position, momentum, &energy_of_start);
        if (status == Status::ok) status = start(time, position, momentum, energy_of_start);
        return status;
    }
    // A start on an orbit whose energy is known.
    Status start(real time, const real* position, const real* momentum, real energy_of_start) {
        set_energy(energy_of_start);
        Status status = Chain::prepare(values, step_size);
        if (status == Status::ok) status = Chain::start(real(0), position, momentum);
        now = before = {time, real(0)};
        origin = time;
        arrivals = 0;
        is_recorded = true;
        arrive_here(time);
        return status;
    }

    // One step of the chain.
    Status step() {
        real p_of_start[n];
        for (int k = 0; k < n; ++k) p_of_start[k] = p[k];
        const Status status = Chain::step();
        if (status != Status::ok) return status;
        // The clock is 0 somewhere on the way, or below: the motion in tau comes near such a place, but not beyond it.
        if (!is_ahead(elapsed) || now.time + elapsed == now.time) return Status::time_stands_still;
        for (int k = 0; k < n; ++k) p_before[k] = p_of_start[k];
        before = now;
        now.add(elapsed);
        is_recorded = false;
        return Status::ok;
    }

    // Whether the chain has not come to a time yet.
    bool is_short_of(real target) const { return is_ahead(now.until(target)); }

    // The state at a time that the last step of the chain has passed, or where the chain stands.
    Status arrive(real target) {
        ++arrivals;
        if (!(now.until(target) == real(0))) return shorten_to(target);
        is_recorded = true;
        arrive_here(target);
        return Status::ok;
    }

    real time() const { return now.time; }
    real energy_of_start() const {
        typename K::Parameters copy = values;
        return K::parameter(copy, K::parameter_count);
    }
    // The time at theta of the last step.
    real time_within(real theta) const {
        real passed = real(0);
        for (int i = 0; i < K::nodes; ++i) {
            real position[n], rate[n];
            Chain::polynomial(theta * K::c[i], position, rate);
            passed += K::b[i] * clock_at(position);
        }
        return before.time + theta * step_size * passed;
    }

    static constexpr int basis = 0;  // the rate of the clock goes with theta too
    void polynomial(real theta, real* position, real* velocity) const {
        Chain::polynomial(theta, position, velocity);
        slow_down(position, velocity);
    }
    void momentum(real* momentum) const { Chain::momentum(momentum); }
    void momentum(real time, const real* position, const real* velocity, real* momentum) const {
        real w[n];
        in_clock_time(position, velocity, w);
        Chain::momentum(time, position, w, momentum);
    }
    Status velocity(real time, const real* position, const real* momentum, real* velocity) const {
        const Status status = Chain::velocity(time, position, momentum, velocity);
        if (status == Status::ok) slow_down(position, velocity);
        return status;
    }
    Status energy(real time, const real* position, const real* momentum, real* value) const {
        return Chain::energy(time, position, momentum, value);
    }
    // dL/dv, and dL/dq where H = E.
    void slopes(real time, const real* position, const real* velocity, real* Lv, real* Lq) const {
        real w[n];
        in_clock_time(position, velocity, w);
        Chain::slopes(time, position, w, Lv, Lq);
        slow_down(position, Lq);
    }
    // Of a step of the chain at the energy of (q, p).
    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        Stepper local = *this;
        const Status status = local.start(time, position, momentum);
        return status == Status::ok ? local.Chain::tangent(real(0), position, momentum, q1, p1, T) : status;
    }

private:
    bool is_ahead(real duration) const { return step_size > real(0) ? duration > real(0) : duration < real(0); }
    void set_energy(real value) { K::parameter(values, K::parameter_count) = value; }
    real clock_at(const real* position) const { return Formulas<K>::clock(coefficients, real(0), position); }
    void slow_down(const real* position, real* velocity) const {
        const real rate = clock_at(position);
        for (int k = 0; k < n; ++k) velocity[k] /= rate;
    }
    void in_clock_time(const real* position, const real* velocity, real* w) const {
        const real rate = clock_at(position);
        for (int k = 0; k < n; ++k) w[k] = rate * velocity[k];
    }
    void arrive_here(real target) {
        arrival_time = target;
        for (int k = 0; k < n; ++k) {
            arrival_q[k] = q[k];
            arrival_p[k] = p[k];
        }
    }

    // theta with t(theta h) = target, t monotone: Newton's iteration with dt/dtau = g, kept between two bounds.
    Status shorten_to(real target) {
        const real wanted = before.until(target), whole = before.until(now.time) + now.rest;
        real low = real(0), high = real(1), theta = wanted / whole;
        Chain part;
        for (int trial = 0; trial < trial_limit; ++trial) {
            if (!(theta > low && theta < high)) theta = low + real(0.5) * (high - low);
            Status status = part.prepare(values, theta * step_size);
            part.tolerance = this->tolerance;
            if (status == Status::ok) status = part.start(real(0), this->q_before, p_before);
            if (status == Status::ok) status = part.step();
            if (status != Status::ok) return status;
            const real missing = wanted - part.elapsed;
            (is_ahead(missing) ? low : high) = theta;
            const real next = theta + missing / (step_size * clock_at(part.q));
            if (fabs(next - theta) <= real(2) * Limits<real>::epsilon || high - low <= Limits<real>::epsilon) {
                arrival_time = target;
                for (int k = 0; k < n; ++k) {
                    arrival_q[k] = part.q[k];
                    arrival_p[k] = part.p[k];
                }
                return Status::ok;
            }
            theta = next;
        }
        return Status::not_converged;
    }
};

}  // namespace lobatto

#endif
// Trajectories side by side: each in its lane, with its own parameters and state, one step size and time for all.
//
// What a lane computes depends on no other lane. Where the iterations of one fail, a Stepper of its own takes that step
// by Newton's iteration, in the general form after iterations that begin anew; a lane that none of these solves keeps
// its last good state and its status.
#ifndef LOBATTO_KERNEL_ENSEMBLE_HPP
#define LOBATTO_KERNEL_ENSEMBLE_HPP

#include <cstdint>
#include <type_traits>

namespace lobatto {

// Lane `lane` of coefficients side by side; both structures hold nothing but their number type.
template <class K, class T>
inline void set_coefficients(typename K::template CoefficientsOf<T>& all, int lane,
                             const typename K::Coefficients& one) {
    using real = typename K::real;
    if constexpr (!std::is_empty_v<typename K::Coefficients>) {
        constexpr int size = sizeof(one) / sizeof(real);
        static_assert(sizeof(all) == size * sizeof(T));
        const real* const from = reinterpret_cast<const real*>(&one);
        T* const to = reinterpret_cast<T*>(&all);
        for (int i = 0; i < size; ++i) set_lane(to[i], lane, from[i]);
    }
}

// How many of `trajectories` stand side by side: a register of each value; two, which hide each other's latency, where
// one or two coordinates leave room for them. None where the lanes serve a single step better.
template <class K>
constexpr int ensemble_lanes(int trajectories) {
    constexpr int native = native_lanes<typename K::real>;
    if (native == 1 || !K::any_number || is_clean<K>() || is_clocked<K>()) return 0;
    if constexpr (K::form == Form::separable) {
        if (K::neighbours) return moves_immediately<K>() && trajectories >= native ? native : 0;
    }
    if (K::form == Form::general) return K::coordinates > most_full ? 0 : native;
    return trajectories >= 2 * native && K::coordinates <= 2 ? 2 * native : native;
}

template <class K, int width>
struct Ensemble {
    using real = typename K::real;
    using T = Pack<real, width>;
    using ActiveMask = decltype(T() < T());
    static constexpr int n = K::coordinates, lanes = width;

    typename K::template CoefficientsOf<T> coefficients;
    LaneStepper<K, T> motion;
    typename K::Parameters parameters[width];
    typename K::Coefficients coefficients_of[width];
    mutable ScalarFallback<K> single;  // takes the steps of a lane that has left the others
    real step_size{}, start_time{};
    std::int64_t steps{};

    void prepare(const real* values, real h, Status* status) {
        step_size = h;
        for (int lane = 0; lane < width; ++lane) {
            for (int i = 0; i < K::parameter_count; ++i)
                K::parameter(parameters[lane], i) = values[lane * K::parameter_count + i];
            status[lane] = single.prepare(parameters[lane], h);
            coefficients_of[lane] = single.coefficients;
            set_coefficients<K>(coefficients, lane, single.coefficients);
            motion.prepare(single, lane);
        }
    }

    void start(real time, const real* q, const real* p, Status* status) {
        start_time = time;
        steps = 0;
        int started = -1;
        for (int lane = 0; lane < width; ++lane) {
            if (status[lane] != Status::ok) continue;
            status[lane] = start_lane(lane, lane, time, q, p);
            if (status[lane] == Status::ok) started = lane;
        }
        if (started < 0) return;
        // The others compute what one of these computes, so that no function has to leave its path for their numbers.
        for (int lane = 0; lane < width; ++lane)
            if (status[lane] != Status::ok) start_lane(lane, started, time, q, p);
    }

    // At most `count` steps of the lanes whose status is ok; `done` and `iterations` of each.
    void advance(std::int64_t count, real tolerance, Status* status, std::int64_t* done, std::int64_t* iterations) {
        motion.set_tolerance(tolerance);
        single.tolerance = tolerance;
        ActiveMask active = ActiveMask(false);
        for (int lane = 0; lane < width; ++lane) {
            active.set(lane, status[lane] == Status::ok);
            done[lane] = 0;
        }
        T evaluations = T(real(0));
        std::int64_t taken = 0;
        const auto leave = [&](int lane, Status why) {
            status[lane] = why;
            done[lane] = taken;
            active.set(lane, false);
        };
        for (; taken < count && any(active); ++taken, ++steps) {
            const real time = time_of(steps);
            if (time_of(steps + 1) == time) {
                for (int lane = 0; lane < width; ++lane)
                    if (active[lane]) leave(lane, Status::time_stands_still);
                break;
            }
            const ActiveMask moved = motion.step(coefficients, time, active);
            evaluations += motion.evaluations;
            if (any(active & !moved)) retry(active & !moved, time, evaluations, leave);
        }
        for (int lane = 0; lane < width; ++lane) {
            if (status[lane] == Status::ok) done[lane] = taken;
            iterations[lane] = static_cast<std::int64_t>(evaluations[lane]);
        }
    }

    void state(real* q, real* p) const {
        for (int lane = 0; lane < width; ++lane) state_of(lane, q + lane * n, p + lane * n);
    }

    void energy(real* energy) const {
        real q[n], p[n];
        for (int lane = 0; lane < width; ++lane) {
            state_of(lane, q, p);
            energy[lane] = real(0);
            single.energy(time_of(steps), q, p, energy + lane);
        }
    }

private:
    real time_of(std::int64_t step) const { return start_time + real(step) * step_size; }

    // The state of a lane; `single` has its coefficients from then on.
    void state_of(int lane, real* q, real* p) const {
        single.coefficients = coefficients_of[lane];
        for (int c = 0; c < n; ++c) q[c] = lane_of(motion.position(c), lane);
        motion.momentum(single, lane, p);
    }

    // `lane` computes what lane `as` is given.
    Status start_lane(int lane, int as, real time, const real* q, const real* p) {
        const Status status = begin_alone(as, time, q + as * n, p + as * n);
        if (status != Status::ok) return status;
        set_coefficients<K>(coefficients, lane, coefficients_of[as]);
        motion.prepare(single, lane);
        motion.start(single, p + as * n, lane);
        return status;
    }

    Status begin_alone(int lane, real time, const real* q, const real* p) {
        const Status status = single.prepare(parameters[lane], step_size);
        return status == Status::ok ? single.start(time, q, p) : status;
    }

    // What becomes of the lanes that a step has not moved.
    template <class Leave>
    [[gnu::noinline, gnu::cold]] void retry(ActiveMask left, real time, T& evaluations, const Leave& leave) {
        // Fixed-point iterations of any Lagrangian that begin with the velocity alone solve many steps that those with
        // a memory do not.
        if constexpr (K::form == Form::general) {
            if (steps > 0) {
                for (int lane = 0; lane < width; ++lane)
                    if (left[lane]) start_anew(lane, time);
                left = left & !motion.step(coefficients, time, left);
                evaluations += motion.evaluations;
            }
        }
        for (int lane = 0; lane < width; ++lane) {
            if (!left[lane]) continue;
            const Status alone = step_alone(lane, time);
            if (alone != Status::ok) leave(lane, alone);
        }
    }

    // The lane forgets the steps before; its state stays.
    void start_anew(int lane, real time) {
        real q[n], p[n];
        state_of(lane, q, p);
        if (begin_alone(lane, time, q, p) == Status::ok) motion.start(single, p, lane);
    }

    Status step_alone(int lane, real time) {
        real q[n], p[n];
        state_of(lane, q, p);
        Status status = begin_alone(lane, time, q, p);
        if (status == Status::ok) status = single.step();
        if (status == Status::ok) motion.follow(single, lane);
        return status;
    }
};

}  // namespace lobatto

#endif
// Between two steps: states on the polynomial of the last step, and where event functions change their sign.
//
// An event of g(t, q, q') = 0 happens where the sign of g changes. Its places are isolated on the step's polynomial: g
// is sampled at twice as many pieces as the step has nodes, and between samples where |g| is least. What decides is
// not the polynomial, of lower order than the steps, but g at the end of a step of the same method from the same
// start, shortened to theta h: the signs, and the root between them.
//
// Of the K::events functions the last are walls (impacts.hpp), on one side of which the motion is until it meets them;
// values that are rounding there are zero. Of these K::impacts throw it back, and K::switches, the very last, change
// its formulas: their sides, 1 or -1, are the last parameters. The K::stops before the walls end the motion. impact(k,
// q, G, g_t, e) gives dg/dq, dg/dt at fixed q and the restitution of each wall. Where reset_of[] of it is not below 0,
// reset(k, q, velocity, q1, velocity1) gives the state after that one of the K::resets.
#ifndef LOBATTO_KERNEL_EVENTS_HPP
#define LOBATTO_KERNEL_EVENTS_HPP

namespace lobatto {

template <class K>
struct Between {
    using real = typename K::real;
    using S = Stepper<K>;
    static constexpr int n = K::coordinates, columns = 1 + 2 * n;

    static real time(const S& stepper, real theta) {
        if constexpr (is_clocked<K>())
            return stepper.time_within(theta);
        else
            return stepper.start_time + (real(stepper.steps - 1) + theta) * stepper.step_size;
    }

    // t, q[n], p[n] at t + theta h of the last step.
    static void row(const S& stepper, real theta, real* row) {
        real velocity[n];
        row[0] = time(stepper, theta);
        stepper.polynomial(theta, row + 1, velocity);
        stepper.momentum(row[0], row + 1, velocity, row + 1 + n);
        if constexpr (K::form == Form::general) {  // conserved exactly
            for (int c = 0; c < K::cyclic; ++c) row[1 + n + K::cyclic_index[c]] = stepper.p[K::cyclic_index[c]];
        }
    }
};

// The functions at the end of those that are watched: of walls, and before them of stops.
template <class K>
constexpr int impacts_of() {
    if constexpr (K::events > 0)
        return K::impacts;
    else
        return 0;
}
template <class K>
constexpr int stops_of() {
    if constexpr (K::events > 0)
        return K::stops;
    else
        return 0;
}

template <class K>
constexpr int switches_of() {
    if constexpr (K::events > 0)
        return K::switches;
    else
        return 0;
}

// A stepper that knows its parameters, for steps of other lengths.
template <class K>
struct WatchedStepper : Stepper<K> {
    using real = typename K::real;
    typename K::Parameters parameters{};
    static constexpr int walls = impacts_of<K>() + switches_of<K>(), wall_room = walls > 0 ? walls : 1;
    real wall_scale[wall_room]{};  // the most that went into each wall's function so far

    // The side of a switch: 1 or -1.
    real& side(int number) { return K::parameter(parameters, K::parameter_count - switches_of<K>() + number); }
};

template <class K>
struct Events {
    using real = typename K::real;
    using S = WatchedStepper<K>;
    static constexpr int n = K::coordinates, pieces = 2 * S::nodes;
    static constexpr int grid_size = pieces + 3;     // the ends of pieces, and a place next to each end of the step
    static constexpr int room = grid_size + pieces;  // samples of one function
    static constexpr int columns = 1 + Between<K>::columns;
    static constexpr int most = K::events * room;  // rows of one step
    static constexpr int walls = S::walls, first_wall = K::events - walls;
    static constexpr real rounding = real(2) * Limits<real>::epsilon;

    struct Sample {
        real theta, value;
        bool is_exact;
    };

    explicit Events(const S& stepper) : partial(new S(stepper)) {
        for (int i = 0; i < grid_size; ++i) {
            grid[i] = i == 0               ? real(0)
                      : i == 1             ? real(1) / real(1024 * pieces)
                      : i == grid_size - 2 ? real(1) - grid[1]
                                           : real(i == grid_size - 1 ? pieces : i - 1) / real(pieces);
            if constexpr (S::basis > 0) S::basis_at(grid[i], basis_value[i], basis_slope[i]);
        }
    }
    Events(const Events&) = delete;
    Events& operator=(const Events&) = delete;
    ~Events() { delete partial; }

    // Before each step: the state that it starts from.
    void keep(const S& stepper) {
        time = stepper.time();
        for (int k = 0; k < n; ++k) q[k] = stepper.q[k];
        stepper.momentum(p);
    }

    // What happened with functions `first` ... `last` - 1 until theta in the step taken since keep: `found` places in
    // the order of the motion, each with its number. Where a shortened step fails, its status.
    Status find(S& stepper, int first, int last, real until) {
        step = &stepper;
        status = Status::ok;
        found = 0;
        knows_end[0] = knows_end[1] = false;
        for (int i = 0; i < grid_size; ++i) on_grid(i);
        for (int e = first; e < last && status == Status::ok; ++e) find_events(e, until);
        return status;
    }

    // t, q, p at t + theta h, by a step of that length.
    Status state(real theta, real* row) {
        state_at(theta, row);
        return status;
    }

    int found{};                 // places of the last find:
    real thetas[most]{};         // where
    int numbers[most]{};         // of which function
    real slack[S::wall_room]{};  // of each wall: up to here its function is zero, but for rounding
    real sides[S::wall_room]{};  // and the sign that it has where the motion is

private:
    S* step{};
    S* partial;  // the shortened step
    Status status{};
    real time{}, q[n]{}, p[n]{};
    static constexpr int basis_room = S::basis > 0 ? S::basis : 1;
    real grid[grid_size]{}, grid_values[grid_size][K::events]{};
    real basis_value[grid_size][basis_room]{}, basis_slope[grid_size][basis_room]{};  // of the step's polynomial
    real end_values[2][K::events]{};  // where the step begins and ends, once they were asked for
    bool knows_end[2]{};
    Sample samples[room]{};
    int sample_count{};

    static bool has_sign(real value) { return is_finite(value) && value != real(0); }
    static bool changes(real a, real b) { return has_sign(a) && has_sign(b) && (a > real(0)) != (b > real(0)); }

    void on_grid(int i) {
        if constexpr (S::basis > 0) {
            real position[n], velocity[n];
            step->polynomial(basis_value[i], basis_slope[i], position, velocity);
            Formulas<K>::event(step->coefficients, Between<K>::time(*step, grid[i]), position, velocity,
                               +grid_values[i]);
        } else {
            on_polynomial(grid[i], grid_values[i]);
        }
    }
    void on_polynomial(real theta, real* values) const {
        real position[n], velocity[n];
        step->polynomial(theta, position, velocity);
        Formulas<K>::event(step->coefficients, Between<K>::time(*step, theta), position, velocity, values);
    }
    real on_polynomial(real theta, int e) const {
        real values[K::events];
        on_polynomial(theta, values);
        return values[e];
    }

    // t, q, p at t + theta h, by a step of that length.
    void state_at(real theta, real* row) {
        row[0] = Between<K>::time(*step, theta);
        real* const momentum = row + 1 + n;
        if (theta == real(1)) {
            for (int k = 0; k < n; ++k) row[1 + k] = step->q[k];
            step->momentum(momentum);
            return;
        }
        for (int k = 0; k < n; ++k) {
            row[1 + k] = q[k];
            momentum[k] = p[k];
        }
        const real length = theta * step->step_size;
        if (time + length == time) return;
        Status done = partial->prepare(step->parameters, length);
        partial->tolerance = step->tolerance;
        if (done == Status::ok) {
            if constexpr (is_clocked<K>())
                done = partial->start(time, q, p, step->energy_of_start());
            else
                done = partial->start(time, q, p);
        }
        if (done == Status::ok) done = partial->step();
        if (done != Status::ok) {
            status = done;
            return;
        }
        if constexpr (is_clocked<K>()) row[0] = partial->time();
        for (int k = 0; k < n; ++k) row[1 + k] = partial->q[k];
        partial->momentum(momentum);
    }
    real exactly(real theta, int e) {
        real values[K::events];
        if (theta == real(0) || theta == real(1)) {
            const int end = theta == real(0) ? 0 : 1;
            if (!knows_end[end]) exactly(theta, end_values[end]);
            knows_end[end] = true;
            return end_values[end][e];
        }
        exactly(theta, values);
        return values[e];
    }
    void exactly(real theta, real* values) {
        real row[1 + 2 * n], velocity[n];
        state_at(theta, row);
        if (status == Status::ok) status = step->velocity(row[0], row + 1, row + 1 + n, velocity);
        if (status == Status::ok)
            Formulas<K>::event(step->coefficients, row[0], row + 1, velocity, values);
        else
            for (int e = 0; e < K::events; ++e) values[e] = real(0);
    }

    void insert(int place, Sample sample) {
        if (sample_count == room) return;
        for (int i = sample_count++; i > place; --i) samples[i] = samples[i - 1];
        samples[place] = sample;
    }
    void make_exact(Sample& sample, int e) {
        if (!sample.is_exact) sample = {sample.theta, exactly(sample.theta, e), true};
    }

    static constexpr bool is_wall(int e) { return e >= first_wall; }
    real side(int e) const { return sides[e - first_wall]; }

    void find_events(int e, real until) {
        sample_count = grid_size;
        for (int i = 0; i < grid_size; ++i) samples[i] = {grid[i], grid_values[i][e], false};
        if constexpr (walls > 0) {
            if (is_wall(e) && !begin_at_wall(e)) return;
        }
        const auto exact = [&](real theta) { return exactly(theta, e); };
        const auto polynomial = [&](real theta) { return on_polynomial(theta, e); };
        reach_undefined(false, polynomial);
        for (int i = 1; i + 1 < sample_count; ++i) i += refine_between(i, polynomial, exact);
        make_exact(samples[0], e);
        make_exact(samples[sample_count - 1], e);
        decide_signs(e);
        reach_undefined(true, exact);  // where the motion, not only its polynomial, leaves the domain of g
        walk(e, until);
    }

    // Where the step begins at the wall, a sample on the way that it takes before it comes back. False: it stays there.
    bool begin_at_wall(int e) {
        const real least = slack[e - first_wall];
        step->event_values[e] = side(e);
        make_exact(samples[0], e);
        if (!(fabs(samples[0].value) <= least)) return true;
        samples[0].value = real(0);
        bool stays = true;
        for (int i = 1; i < sample_count; ++i) stays = stays && fabs(samples[i].value) <= least;
        if (stays) return false;
        make_exact(samples[1], e);
        for (real theta = samples[1].theta; !(samples[1].value * side(e) > least) && theta > rounding;) {
            theta *= real(0.5);
            const Sample there{theta, exactly(theta, e), true};
            if (status != Status::ok) return true;
            if (there.value * side(e) > least) insert(1, there);
        }
        return true;
    }

    // From a sample where g is defined towards a place where it is not: the last sample before its domain ends, or one
    // where its sign has changed.
    template <class G>
    static Sample last_defined(Sample inside, real outside, const G& g) {
        const real start = inside.value;
        while (fabs(outside - inside.theta) > rounding && !changes(inside.value, start)) {
            const real middle = real(0.5) * (inside.theta + outside), value = g(middle);
            if (is_finite(value))
                inside = {middle, value, inside.is_exact};
            else
                outside = middle;
        }
        return inside;
    }

    // In pieces at one end of which g is not defined: a sample where its domain ends, and one half way to it.
    template <class G>
    void reach_undefined(bool is_exact, const G& g) {
        for (int i = 0; i + 1 < sample_count; ++i) {
            const bool is_first = is_finite(samples[i].value);
            const Sample inside = samples[is_first ? i : i + 1], outside = samples[is_first ? i + 1 : i];
            if (is_first == is_finite(samples[i + 1].value) || (is_exact && !(inside.is_exact && outside.is_exact)))
                continue;
            const Sample last = last_defined(inside, outside.theta, g);
            const real half = real(0.5) * (inside.theta + last.theta);
            if (half == inside.theta || half == last.theta) continue;
            const Sample between{half, g(half), is_exact};
            insert(i + 1, is_first ? last : between);
            insert(i + 1, is_first ? between : last);
            i += 2;
        }
    }

    // Around sample i, where |g| may be least without a change of sign at the samples: a sample there, if the sign
    // changes. How many were inserted.
    template <class Polynomial, class Exact>
    int refine_between(int i, const Polynomial& polynomial, const Exact& exact) {
        const Sample a = samples[i - 1], middle = samples[i], b = samples[i + 1];
        if (!has_sign(a.value) || !has_sign(middle.value) || !has_sign(b.value)) return 0;
        if (changes(a.value, middle.value) || changes(middle.value, b.value)) return 0;
        if (!(fabs(middle.value) <= fabs(a.value) && fabs(middle.value) < fabs(b.value))) return 0;
        Sample least = least_between(a, middle, b, polynomial);
        const real there = exact(least.theta), error = fabs(there - least.value);
        // So near to zero that the polynomial cannot tell.
        const bool is_near = !changes(there, a.value) && fabs(there) <= real(8) * error;
        least = {least.theta, there, true};
        if (is_near) least = least_between(a, least, b, exact);
        least.is_exact = true;
        if (!changes(least.value, a.value)) return 0;
        insert(least.theta < middle.theta ? i : i + 1, least);
        return 1;
    }

    // The least |g| between a and b by golden sections, or the first place found where the sign is another.
    template <class G>
    static Sample least_between(const Sample& a, Sample middle, const Sample& b, const G& g) {
        real low = a.theta, high = b.theta;
        for (int i = 0; i < 48 && !changes(middle.value, a.value) && high - low > Limits<real>::root_epsilon; ++i) {
            const bool is_above = high - middle.theta > middle.theta - low;
            const real theta = middle.theta + real(0.381966) * (is_above ? high - middle.theta : low - middle.theta);
            const real value = g(theta);
            if (changes(value, a.value) || fabs(value) < fabs(middle.value)) {
                (is_above ? low : high) = middle.theta;
                middle = {theta, value, middle.is_exact};
            } else {
                (is_above ? high : low) = theta;
            }
        }
        return middle;
    }

    // Exact values at both ends of each piece along which the sign changes, as far as that moves the changes.
    void decide_signs(int e) {
        for (bool is_done = false; !is_done;) {
            is_done = true;
            for (int i = 0; i + 1 < sample_count; ++i) {
                Sample &a = samples[i], &b = samples[i + 1];
                const bool is_change = changes(a.value, b.value) || a.value == real(0) || b.value == real(0);
                if (!is_change || (a.is_exact && b.is_exact)) continue;
                make_exact(a, e);
                make_exact(b, e);
                is_done = status != Status::ok;
            }
        }
    }

    bool is_zero(const Sample& sample, int e) {
        return is_wall(e) ? fabs(sample.value) <= slack[e - first_wall] : is_rounding(sample, e);
    }
    // Whether g is as small there as the roundings of what it is computed from make it: 64 of each number.
    bool is_rounding(const Sample& sample, int e) {
        real largest = real(0), row[1 + 2 * n], velocity[n], values[K::events];
        for (int i = 0; i < sample_count; ++i)
            if (is_finite(samples[i].value) && fabs(samples[i].value) > largest) largest = fabs(samples[i].value);
        if (!sample.is_exact || !(fabs(sample.value) <= Limits<real>::root_epsilon * largest)) return false;
        state_at(sample.theta, row);
        if (status == Status::ok) status = step->velocity(row[0], row + 1, row + 1 + n, velocity);
        if (status != Status::ok) return false;
        const real moved = real(1) + real(64) * Limits<real>::epsilon;
        real change = real(0);
        for (int k = 0; k <= 2 * n; ++k) {
            real& number = k == 0 ? row[0] : k <= n ? row[k] : velocity[k - n - 1];
            const real before = number;
            number *= moved;
            Formulas<K>::event(step->coefficients, row[0], row + 1, velocity, values);
            number = before;
            if (is_finite(values[e])) change += fabs(values[e] - sample.value);
        }
        return fabs(sample.value) <= change;
    }

    // The changes of sign along the samples. A zero at a sample, or what is rounding there, is one if the sign beyond
    // it is another: else g only touches zero. Where g is not defined in between, nothing has happened.
    void walk(int e, real until) {
        real& last = step->event_values[e];  // that is not zero
        int zero = -1, before = -1;          // samples: the first zero since the one before, which has the sign of last
        for (int i = 0; i < sample_count && status == Status::ok; ++i) {
            const Sample& here = samples[i];
            if (!is_finite(here.value)) {
                last = real(0);
                zero = before = -1;
            } else if (here.value == real(0) || is_zero(here, e)) {
                if (zero < 0) zero = i;
                if (i == 0 && step->steps == 1 && !is_wall(e)) last = real(0);  // the motion starts there
            } else {
                if (changes(last, here.value)) {
                    const int direction = ((here.value > real(0)) == (step->step_size > real(0))) ? 1 : -1;
                    if (K::event_direction[e] * direction >= 0) {
                        const int from = before >= 0 ? before : 0;
                        const bool is_exactly = zero >= 0 && samples[zero].value == real(0);
                        bool is_root = true;
                        const real root = is_exactly ? samples[zero].theta
                                          : changes(samples[from].value, here.value)
                                              ? locate(e, samples[from], here, is_root)
                                              : samples[from].theta;
                        if (is_root && root <= until) add(e, root);
                    }
                }
                last = here.value;
                zero = -1;
                before = i;
            }
        }
    }

    // The root between a and b, to the rounding of theta: secants, with the value of an end that stays halved (the
    // Illinois method), and every third time the middle. None where g grows: its sign changes at a pole.
    real locate(int e, Sample a, Sample b, bool& is_root) {
        const real largest = fabs(a.value) < fabs(b.value) ? fabs(b.value) : fabs(a.value);
        Sample nearest = fabs(a.value) < fabs(b.value) ? a : b;
        real weight_a = real(1), weight_b = real(1);
        int stays = 0;  // the end that the last secant left in place: -1 is a, 1 is b
        for (int iteration = 1; b.theta - a.theta > rounding && status == Status::ok; ++iteration) {
            const real left = weight_a * a.value, right = weight_b * b.value;
            const real middle = a.theta + real(0.5) * (b.theta - a.theta);
            real theta = iteration % 3 == 0 ? middle : b.theta - right * ((b.theta - a.theta) / (right - left));
            if (theta < a.theta + rounding) theta = a.theta + rounding;
            if (theta > b.theta - rounding) theta = b.theta - rounding;
            if (!(theta > a.theta && theta < b.theta)) theta = middle;
            const Sample there{theta, exactly(theta, e), true};
            if (!is_finite(there.value)) break;
            nearest = there;
            if (there.value == real(0)) break;
            if (changes(there.value, a.value)) {
                b = there;
                weight_b = real(1);
                weight_a = stays == -1 ? real(0.5) * weight_a : real(1);
                stays = -1;
            } else {
                a = there;
                weight_a = real(1);
                weight_b = stays == 1 ? real(0.5) * weight_b : real(1);
                stays = 1;
            }
        }
        is_root = is_finite(nearest.value) && fabs(nearest.value) <= largest;
        return nearest.theta;
    }

    void add(int e, real root) {
        int place = found++;
        for (; place > 0 && thetas[place - 1] > root; --place) {
            thetas[place] = thetas[place - 1];
            numbers[place] = numbers[place - 1];
        }
        thetas[place] = root;
        numbers[place] = e;
    }
};

}  // namespace lobatto

#endif
// What is looked for in each step: events, impacts, and where the motion is to stop.
//
// A wall is g(t, q) = 0, and the motion is on one side of it. A step that meets it is cut there, at the end of a step
// of the same method; the momentum jumps along dg/dq (D52), and a step of the rest of h leads back to the times of the
// run. So a step with impacts is one from t to t + h like any other, and of the method's order. (R. C. Fetecau, J. E.
// Marsden, M. Ortiz, M. West 2003.)
// A switch is a wall that lets the motion through, and changes the formulas beyond it.
#ifndef LOBATTO_KERNEL_IMPACTS_HPP
#define LOBATTO_KERNEL_IMPACTS_HPP

namespace lobatto {

// At a state: the walls of K, what they are there, and what they do.
template <class K>
struct Walls {
    using real = typename K::real;
    using S = WatchedStepper<K>;
    static constexpr int n = K::coordinates, impacts = K::impacts, count = S::walls, first = K::events - count;
    static constexpr int room = impacts > 0 ? impacts : 1;
    static constexpr real few = real(64) * Limits<real>::epsilon;

    real time{}, q[n]{}, p[n]{}, velocity[n]{};
    real value[K::events]{};                  // of all that is watched
    real gradient[room * n]{}, rate[room]{};  // of impacts: dg/dq, and dg/dt at fixed q
    real restitution[room]{};
    real slack[count]{};    // g as small as this is zero
    real approach[room]{};  // dg/dt along the motion, where it is above rounding; below 0: towards the wall

    // Everything at (t, q, p) of a stepper.
    Status look(S& stepper, real t, const real* position, const real* momentum) {
        time = t;
        for (int k = 0; k < n; ++k) {
            q[k] = position[k];
            p[k] = momentum[k];
        }
        const Status status = stepper.velocity(time, q, p, velocity);
        if (status != Status::ok) return status;
        const auto& k = stepper.coefficients;
        Formulas<K>::event(k, time, static_cast<const real*>(q), static_cast<const real*>(velocity), +value);
        if constexpr (impacts > 0) look_at_impacts(stepper);
        for (int w = 0; w < count; ++w) {
            real& scale = stepper.wall_scale[w];
            if (w >= impacts && fabs(value[first + w]) > scale) scale = fabs(value[first + w]);
            slack[w] = few * scale;
        }
        return Status::ok;
    }

    // The sign of g where the motion is.
    static real side(S& stepper, int w) {
        return w < impacts ? real(-K::event_direction[first + w]) : stepper.side(w - impacts);
    }
    bool is_behind(int w) const { return value[first + w] * real(-K::event_direction[first + w]) < -slack[w]; }
    bool is_met(int w) const { return fabs(value[first + w]) <= slack[w] && approach[w] < real(0); }

    // (D52) What wall w does to the momentum.
    Status hit(S& stepper, int w) {
        if (K::reset_of[w] >= 0) return reset(stepper, K::reset_of[w]);
        const real* const G = gradient + w * n;
        real still[n] = {}, rest[n], pushed[n], without[n], with[n];
        stepper.momentum(time, q, still, rest);
        for (int c = 0; c < n; ++c) pushed[c] = rest[c] + G[c];
        Status status = stepper.velocity(time, q, rest, without);
        if (status == Status::ok) status = stepper.velocity(time, q, pushed, with);
        if (status != Status::ok) return status;
        real mobility = real(0);
        for (int c = 0; c < n; ++c) mobility += G[c] * (with[c] - without[c]);
        const real impulse = -(real(1) + restitution[w]) * approach[w] * side(stepper, w) / mobility;
        if (!is_finite(impulse)) return Status::not_finite;
        if constexpr (constraints_of<K>() > 0) {
            for (int c = 0; c < n; ++c) velocity[c] += impulse * (with[c] - without[c]);
            stepper.momentum(time, q, velocity, p);
        } else {
            for (int c = 0; c < n; ++c) p[c] += impulse * G[c];
        }
        return look(stepper, time, q, p);
    }

    // Positions and velocities as the scene gives them.
    Status reset(S& stepper, int r) {
        if constexpr (K::resets > 0) {
            real positions[K::resets * n], velocities[K::resets * n];
            Formulas<K>::reset(stepper.coefficients, time, static_cast<const real*>(q),
                               static_cast<const real*>(velocity), +positions, +velocities);
            stepper.momentum(time, positions + r * n, velocities + r * n, p);
            return look(stepper, time, positions + r * n, static_cast<const real*>(p));
        }
        (void)stepper, (void)r;
        return Status::unsupported;
    }

private:
    void look_at_impacts(S& stepper) {
        Formulas<K>::impact(stepper.coefficients, time, static_cast<const real*>(q), +gradient, +rate, +restitution);
        for (int w = 0; w < impacts; ++w) {
            real along = rate[w], speed = fabs(rate[w]), moved = fabs(rate[w] * stepper.step_size);
            for (int c = 0; c < n; ++c) {
                const real slope = gradient[w * n + c], way = fabs(velocity[c] * stepper.step_size);
                along += slope * velocity[c];
                speed += fabs(slope * velocity[c]);
                moved += fabs(slope) * (fabs(q[c]) > way ? fabs(q[c]) : way);
            }
            if (moved > stepper.wall_scale[w]) stepper.wall_scale[w] = moved;
            approach[w] = fabs(along) <= few * speed ? real(0) : along * side(stepper, w);
        }
    }
};

// Looks at each step of one stepper: keep before it, look after it.
template <class K>
class Watch {
public:
    using real = typename K::real;
    using S = WatchedStepper<K>;
    static constexpr int n = K::coordinates, columns = Events<K>::columns;
    static constexpr int walls = S::walls, first_wall = K::events - walls, stops = stops_of<K>();
    static constexpr int most_impacts = walls > 0 ? 100 : 0;                             // in one step
    static constexpr int most = Events<K>::most + most_impacts * (1 + Events<K>::most);  // rows of one step

    explicit Watch(const S& stepper) : events(stepper), rest(walls > 0 ? new S(stepper) : nullptr) {}
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;
    ~Watch() { delete rest; }

    void keep(const S& stepper) {
        events.keep(stepper);
        if constexpr (walls > 0) {
            time = stepper.time();
            parameters = stepper.parameters;
            for (int k = 0; k < n; ++k) q[k] = stepper.q[k];
            stepper.momentum(p);
        }
    }

    // Adds rows of event number, t, q[n], p[n] of the step taken since keep, in the order of the motion; of an impact
    // the state after it. Without rows none are sought, and the motion does not stop. Status::stopped: the last row
    // says where and why. Where walls fail, the stepper is where it was before the step.
    Status look(S& stepper, real* rows, std::int64_t& count) {
        if constexpr (walls > 0) {
            const Status status = look_with_walls(stepper, rows, count);
            if (status != Status::ok) go_back(stepper);
            return status;
        } else {
            return rows == nullptr ? Status::ok : find(stepper, real(1), rows, count);
        }
    }

private:
    Events<K> events;
    S* rest;  // the steps from an impact to the end
    real time{}, q[n]{}, p[n]{};
    typename K::Parameters parameters{};
    int impacts{};  // of this step

    // Events and stops until theta.
    Status find(S& stepper, real until, real* rows, std::int64_t& count) {
        Status status = events.find(stepper, 0, first_wall, until);
        for (int i = 0; i < events.found && status == Status::ok; ++i) {
            real* const row = rows + count * columns;
            row[0] = real(events.numbers[i]);
            status = events.state(events.thetas[i], row + 1);
            if (status != Status::ok) break;
            ++count;
            if (events.numbers[i] >= first_wall - stops) return Status::stopped;
        }
        return status;
    }

    void go_back(S& stepper) {
        stepper.parameters = parameters;
        put(stepper, q, p, stepper.steps - 1);
    }
    // A state at one of the stepper's own times, with its parameters.
    static void put(S& stepper, const real* position, const real* momentum, std::int64_t steps) {
        const real start = stepper.start_time;
        if constexpr (switches_of<K>() > 0) stepper.prepare(stepper.parameters, stepper.step_size);
        stepper.steps = steps;
        stepper.start(stepper.time(), position, momentum);
        stepper.start_time = start;
        stepper.steps = steps;
    }

    Status look_with_walls(S& stepper, real* rows, std::int64_t& count) {
        const real end = stepper.time();
        Walls<K> wall;
        Status status = wall.look(stepper, time, q, p);
        S* step = &stepper;
        impacts = 0;
        while (status == Status::ok) {
            for (int w = 0; w < walls; ++w) {
                events.slack[w] = wall.slack[w];
                events.sides[w] = Walls<K>::side(stepper, w);
            }
            status = events.find(*step, first_wall, K::events, real(1));
            if (status != Status::ok) break;
            const bool is_hit = events.found > 0;
            const real theta = is_hit ? events.thetas[0] : real(1);
            const int number = is_hit ? events.numbers[0] : -1;
            if (rows != nullptr) {
                status = find(*step, theta, rows, count);
                if (status != Status::ok) break;
            }
            if (!is_hit) break;
            real row[1 + 2 * n];
            status = events.state(theta, row);
            if (status == Status::ok) status = wall.look(stepper, row[0], row + 1, row + 1 + n);
            if (status == Status::ok) status = pass(stepper, wall, number - first_wall, rows, count);
            if (status != Status::ok) break;
            const real left = end - wall.time;
            step = rest;
            if (!(left * stepper.step_size > real(0)) || wall.time + left == wall.time) {
                put(stepper, wall.q, wall.p, stepper.steps);
                return Status::ok;
            }
            status = take_rest(stepper, wall, left);
        }
        if (status == Status::ok && step == rest) finish(stepper);
        return status;
    }

    // Through a switch, or back from walls.
    Status pass(S& stepper, Walls<K>& wall, int number, real* rows, std::int64_t& count) {
        if constexpr (impacts_of<K>() > 0) {
            if (number < impacts_of<K>()) return meet(stepper, wall, number, rows, count);
        }
        (void)wall, (void)rows, (void)count;
        if (++impacts > most_impacts) return Status::impacts_accumulate;
        real& side = stepper.side(number - impacts_of<K>());
        side = -side;
        return K::prepare(stepper.parameters, stepper.step_size, stepper.coefficients);
    }

    // All walls that are met there, one after another, until none is.
    Status meet(S& stepper, Walls<K>& wall, int first, real* rows, std::int64_t& count) {
        for (bool is_first = true;; is_first = false) {
            int met = is_first && K::reset_of[first] >= 0 ? first : -1;
            for (int w = 0; w < impacts_of<K>() && met < 0; ++w)
                if (wall.is_met(w) || (is_first && w == first && wall.approach[w] < real(0))) met = w;
            if (met < 0) return is_first ? Status::impacts_accumulate : Status::ok;
            if (++impacts > most_impacts) return Status::impacts_accumulate;
            const Status status = wall.hit(stepper, met);
            if (status != Status::ok) return status;
            if (rows == nullptr) continue;
            real* const row = rows + count++ * columns;
            row[0] = real(first_wall + met);
            row[1] = wall.time;
            for (int k = 0; k < n; ++k) {
                row[2 + k] = wall.q[k];
                row[2 + n + k] = wall.p[k];
            }
        }
    }

    Status take_rest(S& stepper, const Walls<K>& wall, real left) {
        rest->parameters = stepper.parameters;
        Status status = rest->prepare(stepper.parameters, left);
        rest->tolerance = stepper.tolerance;
        if (status == Status::ok) status = rest->start(wall.time, wall.q, wall.p);
        events.keep(*rest);
        if (status == Status::ok) status = rest->step();
        if constexpr (S::N > 0) stepper.iterations += rest->iterations;
        return status;
    }

    void finish(S& stepper) {
        real momentum[n];
        rest->momentum(momentum);
        put(stepper, rest->q, momentum, stepper.steps);
        for (int e = 0; e < K::events; ++e) stepper.event_values[e] = rest->event_values[e];
    }
};

}  // namespace lobatto

#endif
