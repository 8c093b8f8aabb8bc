// SPDX-License-Identifier: MIT
// Packs of neighbouring coordinates: shifts by lanes, parts of a pack, and a rough inverse.
#ifndef LOBATTO_KERNEL_SHIFTS_HPP
#define LOBATTO_KERNEL_SHIFTS_HPP

#include <utility>

#include "numbers.hpp"
#include "pack.hpp"

namespace lobatto {

// The last `places` lanes of `before` and then the first of `values`: a step of `places` to the right. One register.
template <int places, class real, int width, int... lanes>
LOBATTO_INLINE Pack<real, width> moved_on(const Pack<real, width>& before, const Pack<real, width>& values,
                                          std::integer_sequence<int, lanes...>) {
    Pack<real, width> result;
    result.part[0] = __builtin_shufflevector(before.part[0], values.part[0], (width - places + lanes)...);
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
