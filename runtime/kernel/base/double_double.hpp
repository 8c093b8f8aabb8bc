// SPDX-License-Identifier: MIT
// DoubleDouble: a number of 106 bits as the sum of two doubles, alone and in the lanes of Packs. C++17, no allocation.
//
// Formula numbers (D..) refer to docs/derivation.md. high is the sum rounded to double, low the rest (D50). With u =
// 2^-53 products, quotients and roots err by at most some 10 u^2, sums by 2 u^2 (|a| + |b|): (T. J. Dekker 1971; M.
// Joldes, J.-M. Muller and V. Popescu 2017). The range is that of double; below 2^-916 the digits of low get lost. What
// overflows is infinite or not a number, and stays so.
#ifndef LOBATTO_KERNEL_DOUBLE_DOUBLE_HPP
#define LOBATTO_KERNEL_DOUBLE_DOUBLE_HPP
#if defined(__FLT_EVAL_METHOD__) && (__FLT_EVAL_METHOD__ == 2 || __FLT_EVAL_METHOD__ < 0)
#error "double-double needs sums that are rounded to double: compile without -mfpmath=387 and -mfpmath=both"
#endif

#include <type_traits>

#include "numbers.hpp"
#include "pack.hpp"

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
#if defined(__CUDACC__)  // nvcc contracts nothing with --fmad=false
#elif defined(__x86_64__)
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

// s + e = a + b, s the rounded sum, where |a| >= |b|, or a is zero.
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
    T e{};
    const T s = add_with_error(a.high, b.high, e);
    return joined<X>(s, e + (a.low + b.low));
}
// Errs by 3 u^2 |a + b|, also where digits cancel.
template <class X>
LOBATTO_INLINE constexpr X accurate_sum(const X& a, const X& b) {
    using T = typename X::Part;
    T e{}, f{};
    const T s = add_with_error(a.high, b.high, e), t = add_with_error(a.low, b.low, f);
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
    T p{}, e{}, f{};
    multiply(a.high, b.high, p, e);
    const T rest = fused(a.high, b.low, fused(a.low, b.high, e + c.low));
    const T s = add_with_error(c.high, p, f);
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
    LOBATTO_EACH(result.part[i].high = add_with_error(a.part[i], b.part[i], result.part[i].low));
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
