// SPDX-License-Identifier: MIT
// When a fixed-point iteration ends: the one convergence rule of all of them.
//
// An increment e is the size of what an iteration moves positions by, relative to their measure; e_before is the one
// before it. What is left to come is about e times their ratio. Increments below `enough` are rounding, or the
// tolerance that was asked for. From the fourth evaluation on an iteration must shrink by a fifth, or it has failed.
#ifndef LOBATTO_KERNEL_CONVERGENCE_HPP
#define LOBATTO_KERNEL_CONVERGENCE_HPP

#include "../base/numbers.hpp"
#include "../base/pack.hpp"

namespace lobatto {

// T: a number, or a Pack with one trajectory in each lane. power 2: increments are kept as squares.
template <class T, int power = 1>
struct Convergence {
    using real = real_of<T>;
    using Truth = decltype(T() < T());
    static constexpr int judged_after = 3;  // evaluations
    T enough;

    // The rest is small, or increments no longer shrink because they are rounding.
    LOBATTO_INLINE Truth reached(const T& e, const T& e_before) const {
        return either(either(e * e <= enough * e_before, e <= enough), stagnates(e, e_before));
    }
    LOBATTO_INLINE Truth stagnates(const T& e, const T& e_before) const {
        return both(e <= raised(real(16)) * enough, e >= raised(real(0.5)) * e_before);
    }
    // Whether it is worth going on.
    LOBATTO_INLINE Truth contracts(const T& e, const T& e_before) const {
        return either(e < raised(real(0.8)) * e_before, e <= raised(real(16)) * enough);
    }

private:
    static constexpr real raised(real x) { return power == 2 ? x * x : x; }
    LOBATTO_INLINE static bool either(bool a, bool b) { return a || b; }
    LOBATTO_INLINE static bool both(bool a, bool b) { return a && b; }
    template <class Mask>
    LOBATTO_INLINE static Mask either(const Mask& a, const Mask& b) {
        return a | b;
    }
    template <class Mask>
    LOBATTO_INLINE static Mask both(const Mask& a, const Mask& b) {
        return a & b;
    }
};

}  // namespace lobatto

#endif
