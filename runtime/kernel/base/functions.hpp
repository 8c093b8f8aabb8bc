// SPDX-License-Identifier: MIT
// What the elementary functions of packs share; they are in trigonometry.hpp, exponential.hpp and arc.hpp. Every lane
// is as if it were alone. C++17, no allocation.
//
// For double: one path without branches, polynomials in Estrin's order (a step waits for their latency), and the
// library for lanes beyond the path's range. float is computed in double and rounded. long double and __float128 are
// the library's. Accuracy and speed: docs/measurements/vector_functions.md, measured by
// bench/measurements/functions.cpp.
#ifndef LOBATTO_KERNEL_FUNCTIONS_HPP
#define LOBATTO_KERNEL_FUNCTIONS_HPP

#include "numbers.hpp"
#include "pack.hpp"

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
[[gnu::noinline, gnu::cold]] LOBATTO_DEVICE void by_library(int width, const double* beyond, const double* x,
                                                            const double* y, double* values, Function function) {
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
#ifndef __CUDACC__
    asm("" : "+m"(to));  // g++ 12 leaves out this rounding of two lanes where a widening follows
#endif
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
