// SPDX-License-Identifier: MIT
// ManyDigits<bits>: a number of as many bits as are asked for, computed with by MPFR. C++17, no allocation of its own.
//
// MPFR (L. Fousse, G. Hanrot, V. Lefèvre, P. Pélissier and P. Zimmermann 2007) rounds every operation and function
// correctly. A number holds its words itself and no address, so that it is copied like any other, also as bytes, to a
// file and back; MPFR sees it through headers that live for one operation (its custom interface).
#ifndef LOBATTO_KERNEL_MANY_DIGITS_HPP
#define LOBATTO_KERNEL_MANY_DIGITS_HPP

#ifdef LOBATTO_USE_MPFR
#include <mpfr.h>

#include <cstdint>
#include <type_traits>

#include "numbers.hpp"

namespace lobatto {

template <int bits>
struct ManyDigits {
    static constexpr int words = (bits + 63) / 64;
    static_assert(sizeof(mp_limb_t) == 8, "MPFR has words of 64 bits");

    enum Kind : std::int16_t { zero, regular, infinite, nan };
    // (-1)^negative 0.word[words - 1] word[words - 2] ... 2^exponent, the first bit set where it is regular. All bytes
    // zero: the number zero.
    std::int16_t kind, negative;
    std::int32_t exponent;
    mp_limb_t word[words];

    ManyDigits() = default;

    // Exactly, of numbers with at most 128 bits.
    template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
    constexpr ManyDigits(Number x) : kind(zero), negative(0), exponent(0), word{} {
        long double rest = static_cast<long double>(x);
        if (rest == 0) return;
        kind = rest != rest ? nan : rest - rest != 0 ? infinite : regular;
        negative = rest < 0 ? 1 : 0;
        if (kind != regular) return;
        if (negative) rest = -rest;
        for (; rest >= 0x1p64L; rest *= 0x1p-64L) exponent += 64;
        for (; rest < 0x1p-64L; rest *= 0x1p64L) exponent -= 64;
        for (; rest >= 1; rest /= 2) ++exponent;
        for (; rest < 0.5L; rest *= 2) --exponent;
        for (int i = words - 1; i >= 0 && rest != 0; --i) {
            rest *= 0x1p64L;
            word[i] = static_cast<mp_limb_t>(rest);
            rest -= static_cast<long double>(word[i]);
        }
    }

    // The literals of emitted kernels: the exponent, then the words from the first to the last that is not zero.
    template <class... Words>
    static constexpr ManyDigits of(int exponent, Words... first_to_last) {
        static_assert(sizeof...(Words) <= words, "a literal has as many words as its number");
        ManyDigits result(0);
        result.kind = regular;
        result.exponent = exponent;
        int i = words;
        ((result.word[--i] = static_cast<mp_limb_t>(first_to_last)), ...);
        return result;
    }
    static constexpr ManyDigits power_of_two(int power) { return of(power + 1, mp_limb_t(1) << 63); }

    // Rounded. Of powers of two also in constants: all else is none, so that compilers compute it when programs start.
    template <class Number, class = std::enable_if_t<!std::is_class_v<Number>>>
    constexpr explicit operator Number() const {
        if (__builtin_is_constant_evaluated() && is_power_of_two()) {
            long double value = 0.5L;
            for (int e = exponent; e > 0; --e) value *= 2;
            for (int e = exponent; e < 0; ++e) value /= 2;
            return static_cast<Number>(value);
        }
        return rounded<Number>();
    }

    constexpr bool is_power_of_two() const {
        bool has_one_bit = kind == regular && !negative && word[words - 1] == mp_limb_t(1) << 63;
        for (int i = 0; i + 1 < words; ++i) has_one_bit = has_one_bit && word[i] == 0;
        return has_one_bit;
    }
    static constexpr bool are_constants(const ManyDigits& a, const ManyDigits& b) {
        return __builtin_is_constant_evaluated() && a.is_power_of_two() && b.is_power_of_two();
    }
    template <class Number>
    Number rounded() const {
        if constexpr (std::is_same_v<Number, float>)
            return mpfr_get_flt(View(*this), MPFR_RNDN);
        else if constexpr (std::is_same_v<Number, double>)
            return mpfr_get_d(View(*this), MPFR_RNDN);
        else
            return static_cast<Number>(mpfr_get_ld(View(*this), MPFR_RNDN));
    }

    // MPFR's header of a number, which must live longer.
    class View {
    public:
        explicit View(const ManyDigits& x) {
            constexpr int kinds[] = {MPFR_ZERO_KIND, MPFR_REGULAR_KIND, MPFR_INF_KIND, MPFR_NAN_KIND};
            const int magnitude = kinds[x.kind & 3];
            mpfr_custom_init_set(header_, x.negative ? -magnitude : magnitude, x.exponent, bits,
                                 const_cast<mp_limb_t*>(x.word));
        }
        operator mpfr_srcptr() const { return header_; }

    private:
        mpfr_t header_;
    };
    // The number that a function of MPFR, operation(header), leaves in its first argument.
    template <class Operation>
    static ManyDigits result_of(const Operation& operation) {
        ManyDigits result(0);
        mpfr_t header;
        mpfr_custom_init_set(header, MPFR_ZERO_KIND, 0, bits, result.word);
        operation(header);
        result.kind = mpfr_zero_p(header) ? zero : mpfr_nan_p(header) ? nan : mpfr_inf_p(header) ? infinite : regular;
        result.negative = static_cast<std::int16_t>(mpfr_signbit(header) != 0);
        result.exponent = result.kind == regular ? static_cast<std::int32_t>(mpfr_custom_get_exp(header)) : 0;
        return result;
    }

    friend constexpr ManyDigits operator-(const ManyDigits& a) {
        ManyDigits result = a;
        result.negative = a.negative ? 0 : 1;
        return result;
    }
    friend ManyDigits operator+(const ManyDigits& a, const ManyDigits& b) {
        return result_of([&](mpfr_ptr r) { mpfr_add(r, View(a), View(b), MPFR_RNDN); });
    }
    friend ManyDigits operator-(const ManyDigits& a, const ManyDigits& b) {
        return result_of([&](mpfr_ptr r) { mpfr_sub(r, View(a), View(b), MPFR_RNDN); });
    }
    friend constexpr ManyDigits operator*(const ManyDigits& a, const ManyDigits& b) {
        if (are_constants(a, b)) return power_of_two(a.exponent + b.exponent - 2);
        return result_of([&](mpfr_ptr r) { mpfr_mul(r, View(a), View(b), MPFR_RNDN); });
    }
    friend constexpr ManyDigits operator/(const ManyDigits& a, const ManyDigits& b) {
        if (are_constants(a, b)) return power_of_two(a.exponent - b.exponent);
        return result_of([&](mpfr_ptr r) { mpfr_div(r, View(a), View(b), MPFR_RNDN); });
    }
    friend ManyDigits& operator+=(ManyDigits& a, const ManyDigits& b) { return a = a + b; }
    friend ManyDigits& operator-=(ManyDigits& a, const ManyDigits& b) { return a = a - b; }
    friend ManyDigits& operator*=(ManyDigits& a, const ManyDigits& b) { return a = a * b; }
    friend ManyDigits& operator/=(ManyDigits& a, const ManyDigits& b) { return a = a / b; }
    friend bool operator<(const ManyDigits& a, const ManyDigits& b) { return mpfr_less_p(View(a), View(b)) != 0; }
    friend bool operator<=(const ManyDigits& a, const ManyDigits& b) { return mpfr_lessequal_p(View(a), View(b)) != 0; }
    friend bool operator>(const ManyDigits& a, const ManyDigits& b) { return b < a; }
    friend bool operator>=(const ManyDigits& a, const ManyDigits& b) { return b <= a; }
    friend constexpr bool operator==(const ManyDigits& a, const ManyDigits& b) {
        if (__builtin_is_constant_evaluated()) {
            bool same = a.kind == b.kind && a.negative == b.negative && a.exponent == b.exponent;
            for (int i = 0; i < words; ++i) same = same && a.word[i] == b.word[i];
            return same;
        }
        return mpfr_equal_p(View(a), View(b)) != 0;
    }
    friend constexpr bool operator!=(const ManyDigits& a, const ManyDigits& b) { return !(a == b); }
};

template <int bits>
constexpr bool is_many_digits<ManyDigits<bits>> = true;

// The range is that of sums of doubles (abi.h: parts).
template <int bits>
struct Limits<ManyDigits<bits>> {
    using real = ManyDigits<bits>;
    static constexpr real epsilon = real::power_of_two(1 - bits);
    static constexpr real smallest = real::power_of_two(bits - 1074);
    static constexpr real largest = real::power_of_two(1023);
    static constexpr real root_epsilon = real::power_of_two(-bits / 2);
};

// MPFR's functions keep constants for each thread: they go with it.
inline void free_constants_at_the_end_of_the_thread() {
    struct Constants {
        ~Constants() { mpfr_free_cache(); }
    };
    thread_local const Constants constants;
    static_cast<void>(constants);
}

#define LOBATTO_FUNCTION(f)                                                                          \
    template <int bits>                                                                              \
    inline ManyDigits<bits> f(const ManyDigits<bits>& x) {                                           \
        using real = ManyDigits<bits>;                                                               \
        free_constants_at_the_end_of_the_thread();                                                   \
        return real::result_of([&](mpfr_ptr r) { mpfr_##f(r, typename real::View(x), MPFR_RNDN); }); \
    }
LOBATTO_FUNCTION(acos)
LOBATTO_FUNCTION(asin)
LOBATTO_FUNCTION(atan)
LOBATTO_FUNCTION(cos)
LOBATTO_FUNCTION(cosh)
LOBATTO_FUNCTION(exp)
LOBATTO_FUNCTION(log)
LOBATTO_FUNCTION(sin)
LOBATTO_FUNCTION(sinh)
LOBATTO_FUNCTION(sqrt)
LOBATTO_FUNCTION(tan)
LOBATTO_FUNCTION(tanh)
#undef LOBATTO_FUNCTION
template <int bits>
inline ManyDigits<bits> fabs(const ManyDigits<bits>& x) {
    ManyDigits<bits> result = x;
    result.negative = 0;
    return result;
}
#define LOBATTO_FUNCTION(f)                                                                                \
    template <int bits>                                                                                    \
    inline ManyDigits<bits> f(const ManyDigits<bits>& x, const ManyDigits<bits>& y) {                      \
        using View = typename ManyDigits<bits>::View;                                                      \
        free_constants_at_the_end_of_the_thread();                                                         \
        return ManyDigits<bits>::result_of([&](mpfr_ptr r) { mpfr_##f(r, View(x), View(y), MPFR_RNDN); }); \
    }                                                                                                      \
    template <int bits>                                                                                    \
    inline ManyDigits<bits> f(double x, const ManyDigits<bits>& y) {                                       \
        return f(ManyDigits<bits>(x), y);                                                                  \
    }                                                                                                      \
    template <int bits>                                                                                    \
    inline ManyDigits<bits> f(const ManyDigits<bits>& x, double y) {                                       \
        return f(x, ManyDigits<bits>(y));                                                                  \
    }
LOBATTO_FUNCTION(atan2)
LOBATTO_FUNCTION(pow)
#undef LOBATTO_FUNCTION
// x y + z, rounded twice: in MPFR faster than once.
template <int bits>
inline ManyDigits<bits> fused(const ManyDigits<bits>& x, const ManyDigits<bits>& y, const ManyDigits<bits>& z) {
    return x * y + z;
}

}  // namespace lobatto
#endif

#endif
