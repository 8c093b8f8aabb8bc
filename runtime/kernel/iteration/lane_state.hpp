// SPDX-License-Identifier: MIT
// The states of trajectories side by side, and the loan of one to a Stepper: what the lane steppers of all forms share.
//
// Beside this and what base/contract.hpp says of them, LaneSteppers have for refilled lanes (steppers/refilled.hpp)
//   refill(single, lane): begins in a lane, while others go on, at the start of `single`;
// and where steps are looked at
//   displacements(k, time, q_before, rate_before, moved): the polynomial of the last step, which is, with the basis of
//       the form's Stepper, q(theta) = q_before + sum_j value_j(theta) moved_j;
//   lend_step(moved, single, lane): gives a Stepper, which lend_state has given the state before, the step of a lane.
#ifndef LOBATTO_KERNEL_LANE_STATE_HPP
#define LOBATTO_KERNEL_LANE_STATE_HPP

#include "../base/contract.hpp"
#include "../base/pack.hpp"

namespace lobatto {

// The lanes in which velocities have converged, and those in which they have the momenta, also where they are no more
// than the rounding of these.
template <class T>
struct KnownVelocities {
    decltype(T() < T()) have_converged, have_momenta;
};

// Positions, and beside them velocities or momenta; `rooms`: that they go to and fro between.
template <class K, class T, bool keeps_velocities, int rooms = 1>
struct LaneState {
    using real = typename K::real;
    using ActiveMask = decltype(T() < T());
    static constexpr int n = K::coordinates;
    T q[rooms][n], rate[rooms][n];
    T evaluations = T(real(0));  // of the last step
    int now{};                   // the room of the present

    LOBATTO_DEVICE const T* positions() const { return q[rooms > 1 ? now : 0]; }
    LOBATTO_DEVICE const T* rates() const { return rate[rooms > 1 ? now : 0]; }
    // Of rates.
    template <class Number, class Given>
    LOBATTO_LANE static void momenta(const Number* rates, [[maybe_unused]] const Given& k, Number* momentum) {
        if constexpr (keeps_velocities)
            K::momentum(k, rates, momentum);
        else
            for (int c = 0; c < n; ++c) momentum[c] = rates[c];
    }
    void momentum(const ScalarFallback<K>& single, int lane, real* momentum) const {
        real here[n];
        for (int c = 0; c < n; ++c) here[c] = lane_of(rates()[c], lane);
        momenta(here, single.coefficients, momentum);
    }
    // At the end of the step.
    template <class Given>
    LOBATTO_LANE KnownVelocities<T> velocities(const Given&, const T&, T* velocity) const {
        for (int c = 0; c < n; ++c) velocity[c] = rates()[c];
        return {ActiveMask(true), ActiveMask(true)};
    }
    template <class Single>
    static void lend_state(const T* position, const T* rates, Single& single, int lane) {
        for (int c = 0; c < n; ++c) {
            single.q[c] = lane_of(position[c], lane);
            rates_of(single)[c] = lane_of(rates[c], lane);
        }
    }

protected:
    template <class Single>
    static auto* rates_of(Single& single) {
        if constexpr (keeps_velocities)
            return single.u;
        else
            return single.p;
    }
    void follow_state(const ScalarFallback<K>& single, int lane) {
        for (int c = 0; c < n; ++c) {
            set_lane(q[rooms > 1 ? now : 0][c], lane, single.q[c]);
            set_lane(rate[rooms > 1 ? now : 0][c], lane, rates_of(single)[c]);
        }
    }
    // The end of a step from the state that was lent.
    template <class Single>
    void lend_end(Single& single, int lane) const {
        for (int c = 0; c < n; ++c) {
            single.q_before[c] = single.q[c];
            if constexpr (keeps_velocities) single.u_before[c] = single.u[c];
        }
        lend_state(positions(), rates(), single, lane);
        single.has_history = true;
    }
};

}  // namespace lobatto

#endif
