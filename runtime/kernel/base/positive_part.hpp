// SPDX-License-Identifier: MIT
// x where x > 0, 0 elsewhere: what stands under a broken power of max(u, 0), beyond its switch too.
#ifndef LOBATTO_KERNEL_POSITIVE_PART_HPP
#define LOBATTO_KERNEL_POSITIVE_PART_HPP

#include "pack.hpp"

namespace lobatto {

template <class T>
LOBATTO_INLINE T positive_part(const T& x) {
    return maximum(T(0), x);  // keeps what is not a number
}

}  // namespace lobatto

#endif
