// SPDX-License-Identifier: MIT
// Packs of neighbouring coordinates: shifts by lanes, parts of a pack, and a rough inverse.
#ifndef LOBATTO_KERNEL_SHIFTS_HPP
#define LOBATTO_KERNEL_SHIFTS_HPP

#include <utility>

#include "numbers.hpp"
#include "pack.hpp"

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
