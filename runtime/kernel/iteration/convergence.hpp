// SPDX-License-Identifier: MIT
// When an iteration ends: the rules that iterations share.
//
// An increment e is the size of what an iteration moves positions by, relative to their measure; e_before is the one
// before it. Increments below `enough` are rounding, or the tolerance that was asked for.
#ifndef LOBATTO_KERNEL_CONVERGENCE_HPP
#define LOBATTO_KERNEL_CONVERGENCE_HPP

#include "../base/numbers.hpp"
#include "../base/pack.hpp"

namespace lobatto {

// What an iteration may ask of its increments: from the evaluation after `judged_after` on they shrink to `percent` of
// the one before, or the iteration has failed; below `noise` times enough they need not.
template <int after = 3, int part = 80, int multiple = 16>
struct Pace {
    static constexpr int judged_after = after, percent = part, noise = multiple;
};
using NoisyPace = Pace<3, 80, 64>;

// Fixed-point iterations converge linearly: what is left to come is about e times e / e_before. T: a number, or a Pack
// with one trajectory in each lane. power 2: increments are kept as squares.
template <class T, int power = 1, class P = Pace<>>
struct Convergence {
    using real = real_of<T>;
    using Truth = decltype(T() < T());
    static constexpr int judged_after = P::judged_after;
    T enough;

    // The rest is small, or increments no longer shrink because they are rounding.
    LOBATTO_INLINE Truth reached(const T& e, const T& e_before) const {
        return either(e * e <= enough * e_before, is_done(e, e_before));
    }
    LOBATTO_INLINE Truth is_done(const T& e, const T& e_before) const {
        return either(is_small(e), stagnates(e, e_before));
    }
    LOBATTO_INLINE Truth is_small(const T& e) const { return e <= enough; }
    LOBATTO_INLINE Truth stagnates(const T& e, const T& e_before) const {
        return both(is_noise(e), e >= raised(real(0.5)) * e_before);
    }
    LOBATTO_INLINE Truth is_noise(const T& e) const { return e <= raised(real(P::noise)) * enough; }
    // Whether more iterations are worth their time.
    LOBATTO_INLINE Truth contracts(const T& e, const T& e_before) const {
        return either(e < raised(real(P::percent) / real(100)) * e_before, is_noise(e));
    }

private:
    static constexpr real raised(real x) { return power == 2 ? x * x : x; }
    LOBATTO_INLINE static Truth either(const Truth& a, const Truth& b) { return a | b; }
    LOBATTO_INLINE static Truth both(const Truth& a, const Truth& b) { return a & b; }
};

// Newton's iteration converges quadratically, e_next = C e^2: it ends as soon as the next increment would be rounding.
// Increments that no longer shrink are rounding up to `noise` units of what they are computed from.
template <class real>
struct NewtonConvergence {
    static constexpr int iteration_limit = 40, noise = 64, noise_after = 20;

    static bool reached(int iteration, real e, real e_before) {
        return e <= Limits<real>::root_epsilon ||
               (iteration > 1 && e < e_before && (e / e_before) * (e / e_before) * e <= Limits<real>::epsilon);
    }
    static bool stagnates(int iteration, real e, real e_before) { return iteration > 2 && e >= real(0.5) * e_before; }
};

// With one Jacobian for all iterations increments shrink by a factor rho, and what is left to come is e rho / (1 -
// rho).
template <class real>
struct ChordConvergence {
    static constexpr int noise = 4;  // as above

    static bool reached(int iteration, real e, real e_before) {
        const real rho = e / e_before;
        return e == real(0) || (iteration > 1 && rho < real(1) && e * rho <= Limits<real>::epsilon * (real(1) - rho));
    }
    // Newton's iteration is cheaper.
    static bool is_slow(int iteration, real e, real e_before) { return iteration > 1 && e > real(0.1) * e_before; }
};

}  // namespace lobatto

#endif
