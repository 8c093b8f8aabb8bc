// SPDX-License-Identifier: MIT
// Pack<real, width>: `width` numbers side by side in vector registers, computed with as one. C++17, no allocation.
//
// A plain number is a pack of one lane: lanes_of, real_of, select, any, all, fused, minimum, maximum, sum and largest
// know both, so that a function template serves one state and many.
#ifndef LOBATTO_KERNEL_PACK_HPP
#define LOBATTO_KERNEL_PACK_HPP

#include <cstdint>
#include <type_traits>
#include <utility>

#include "numbers.hpp"

#ifdef __CUDACC__
#define LOBATTO_INLINE __host__ __device__ __forceinline__
#define LOBATTO_FORMULA
#else
#define LOBATTO_INLINE [[gnu::always_inline]] inline
#define LOBATTO_FORMULA __attribute__((always_inline))  // behind the parameters of a function object
#endif

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
#define LOBATTO_OPERATOR(Given, Result, operation) /* NOLINTNEXTLINE(bugprone-macro-parentheses): a type */ \
    LOBATTO_INLINE friend Result operator operation(const Given& a, const Given& b) {                       \
        LOBATTO_PARTS(Result, typename Result::Part(a.part[i] operation b.part[i]));                        \
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
#if defined(__FMA__) || defined(__FP_FAST_FMA) || defined(__aarch64__) || defined(__CUDACC__)
LOBATTO_INLINE float fused(float a, float b, float c) {
    return LOBATTO_LIBRARY(fmaf)(a, b, c);
}
LOBATTO_INLINE double fused(double a, double b, double c) {
    return LOBATTO_LIBRARY(fma)(a, b, c);
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
    LOBATTO_INLINE Pack& operator=(const Pack& other) {  // NOLINT(bugprone-unhandled-self-assignment): each by itself
        LOBATTO_EACH(part[i] = other.part[i]);
        return *this;
    }
#ifdef __CUDACC__
    LOBATTO_INLINE Pack(real x) {
        LOBATTO_EACH(part[i] = Operations::spread(x));
    }  // constants have no address there
#else
    LOBATTO_INLINE Pack(const real& x) {
        LOBATTO_EACH(part[i] = Operations::spread(x));
    }
#endif
    // From a literal, where numbers are a class.
    template <class Number, class = std::enable_if_t<std::is_class_v<real> && std::is_arithmetic_v<Number>>>
    LOBATTO_INLINE Pack(Number x) : Pack(real(x)) {}

    LOBATTO_INLINE static Pack load(const real* from) {
        Pack result;
        LOBATTO_EACH(result.part[i] = Operations::load(from + i * lanes));
        return result;
    }
    LOBATTO_INLINE void store(real* to) const {
        LOBATTO_EACH(Operations::store(part[i], to + i * lanes));
    }

    LOBATTO_INLINE real operator[](int lane) const {
        return Operations::lane(part[lane / lanes], lane % lanes);
    }
    LOBATTO_INLINE void set(int lane, const real& x) {
        Operations::set(part[lane / lanes], lane % lanes, x);
    }

    LOBATTO_INLINE Pack operator-() const {
        LOBATTO_PARTS(Pack, -part[i]);
    }
    LOBATTO_INLINE Pack& operator+=(const Pack& b) {
        return *this = *this + b;
    }
    LOBATTO_INLINE Pack& operator-=(const Pack& b) {
        return *this = *this - b;
    }
    LOBATTO_INLINE Pack& operator*=(const Pack& b) {
        return *this = *this * b;
    }
    LOBATTO_INLINE Pack& operator/=(const Pack& b) {
        return *this = *this / b;
    }
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
    LOBATTO_INLINE friend Pack minimum(const Pack& a, const Pack& b) {
        return select(a < b, a, b);
    }
    LOBATTO_INLINE friend Pack maximum(const Pack& a, const Pack& b) {
        return select(a > b, a, b);
    }

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
inline constexpr int lanes_of<Pack<real, width>> = width;

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
LOBATTO_DEVICE inline void set_lane(Pack<real, width>& value, int lane, real x) {
    value.set(lane, x);
}
template <class real>
LOBATTO_DEVICE inline void set_lane(real& value, int, real x) {
    value = x;
}
template <class real, int width>
LOBATTO_DEVICE inline real lane_of(const Pack<real, width>& value, int lane) {
    return value[lane];
}
template <class real>
LOBATTO_DEVICE inline real lane_of(const real& value, int) {
    return value;
}

}  // namespace lobatto

#endif
