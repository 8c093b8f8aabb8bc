// SPDX-License-Identifier: MIT
// Whether the first guess of a step continues the polynomials of the step before it.
#ifndef LOBATTO_KERNEL_EXTRAPOLATION_HPP
#define LOBATTO_KERNEL_EXTRAPOLATION_HPP

#include "../base/numbers.hpp"

namespace lobatto {

// Whether polynomials through a step's control points may be continued over the next one, as a first guess: of many
// points that enlarges rounding, of twelve 10^8 times, which float has no digits for.
template <class K>
constexpr bool may_extrapolate() {
    using real = typename K::real;
    if constexpr (sizeof(real) < sizeof(double)) {
        for (int j = 0; j < K::controls; ++j) {
            real sum = real(0);
            for (int k = 0; k < K::controls; ++k) {
                const real weight = K::extrapolation[j * K::controls + k];
                sum += weight < real(0) ? -weight : weight;
            }
            if (sum * Limits<real>::epsilon > real(1) / real(1024)) return false;
        }
    }
    return true;
}

}  // namespace lobatto

#endif
