// SPDX-License-Identifier: MIT
// Whether the last coordinate of a kernel is the time (D64): of one with a clock, whose motion does not keep its
// energy.
#ifndef LOBATTO_KERNEL_TIME_COORDINATE_HPP
#define LOBATTO_KERNEL_TIME_COORDINATE_HPP

#include <type_traits>

#include "../base/numbers.hpp"

namespace lobatto {

template <class K, class = void>
struct HasTimeCoordinate : std::false_type {};
template <class K>
struct HasTimeCoordinate<K, std::void_t<decltype(K::pace_exponent)>> : std::true_type {};

}  // namespace lobatto

#endif
