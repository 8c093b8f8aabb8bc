// SPDX-License-Identifier: MIT
// Pack<real, width>: `width` numbers side by side in vector registers, computed with as one. C++17, no allocation.
//
// A plain number is a pack of one lane: lanes_of, real_of, select, any, all, fused, minimum, maximum, sum and largest
// know both, so that a function template serves one state and many.
#ifndef LOBATTO_KERNEL_PACK_HPP
#define LOBATTO_KERNEL_PACK_HPP

#include <type_traits>

#include "numbers.hpp"
#include "registers.hpp"

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

// Templates outside Pack, like the functions of base/trigonometry.hpp, so that lobatto::sqrt(x) finds them.
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

// a + b = sum + error, for any sizes of a and b (D. E. Knuth).
template <class T>
LOBATTO_INLINE constexpr T add_with_error(const T& a, const T& b, T& error) {
    const T sum = a + b, of_b = sum - a;
    error = (a - (sum - of_b)) + (b - of_b);
    return sum;
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
