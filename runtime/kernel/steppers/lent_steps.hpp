// SPDX-License-Identifier: MIT
// What refilled lanes ask of the lane stepper of each form: that a trajectory begins in a lane while others go on, the
// polynomial of its last step, and the loan of that step to a Stepper.
//
//   refill: begins in a lane at the start of `single`.
//   displacements: with the basis of the form's Stepper, q(theta) = q_before + sum_j value_j(theta) moved_j in the
//   step. momenta: those of rates. velocities: those at the end of the step; answers in which lanes they are known.
//   lend_state: gives one lane's state to a Stepper.
//   lend_step: gives it the lane's step from that state.
#ifndef LOBATTO_KERNEL_LENT_STEPS_HPP
#define LOBATTO_KERNEL_LENT_STEPS_HPP

#include "../base/contract.hpp"
#include "../base/pack.hpp"
#include "../iteration/galerkin.hpp"

namespace lobatto {

template <class K, class T, Form form = K::form, Stepping stepping = stepping_of<K>()>
struct LentStep;

// The lanes in which velocities have converged, and those in which they have the momenta, also where they are no more
// than the rounding of these.
template <class T>
struct KnownVelocities {
    decltype(T() < T()) have_converged, have_momenta;
};

// Where velocities are kept beside positions.
template <class K, class T>
struct LentVelocity {
    using Motion = LaneStepper<K, T>;
    using ActiveMask = decltype(T() < T());
    static constexpr int n = K::coordinates;

    template <class Given>
    LOBATTO_LANE static void momenta(const T* rates, const Given& k, T* momentum) {
        K::momentum(k, rates, momentum);
    }
    template <class Given>
    LOBATTO_LANE static KnownVelocities<T> velocities(const Motion& motion, const Given&, const T&, T* velocity) {
        for (int c = 0; c < n; ++c) velocity[c] = motion.rates()[c];
        return {ActiveMask(true), ActiveMask(true)};
    }
    template <class Single>
    static void lend_state(const T* position, const T* velocity, Single& single, int lane) {
        for (int c = 0; c < n; ++c) {
            single.q[c] = lane_of(position[c], lane);
            single.u[c] = lane_of(velocity[c], lane);
        }
    }
    template <class Single>
    static void lend_end(const Motion& motion, Single& single, int lane) {
        for (int c = 0; c < n; ++c) {
            single.q_before[c] = single.q[c];
            single.u_before[c] = single.u[c];
            single.q[c] = lane_of(motion.position(c), lane);
            single.u[c] = lane_of(motion.rates()[c], lane);
        }
        single.has_history = true;
    }
};

template <class K, class T>
struct LentStep<K, T, Form::separable, Stepping::solved> : LentVelocity<K, T> {
    using real = typename K::real;
    using typename LentVelocity<K, T>::Motion;
    using LentVelocity<K, T>::n;
    static constexpr int s = K::points, m = s - 2, basis = s;

    struct Table {  // of K, for indices that are no constants: a device has no address of K's own
        real c[s]{}, A[m > 0 ? m*m : 1]{};
        constexpr Table() {
            for (int i = 0; i < s; ++i) c[i] = K::c[i];
            for (int i = 0; i < m * m; ++i) A[i] = K::A[i];
        }
    };

    // A trajectory that begins in the midst of others has a memory as they do: of a constant acceleration.
    template <class Single>
    static void refill(Motion& motion, const Single& single, int lane) {
        motion.start(single, lane);
        const real* const W0 = single.W + (s - 1) * n;
        motion.fixed_point.recall(
            single.u, [&](int, int c) { return W0[c]; }, [&](int, int c) { return single.q[c]; }, lane);
    }
    template <class Given>
    LOBATTO_LANE static void displacements(const Motion& motion, const Given&, const T&, const T* q_before,
                                           const T* u_before, T (*moved)[n]) {
        static constexpr Table table{};
        const real h = motion.fixed_point.h;
        for (int c = 0; c < n; ++c) {
            const T* const W = motion.fixed_point.w + c * s;
            const T drift = fused(T(-h * K::b[0]), W[0], u_before[c]);
            moved[0][c] = T(real(0));
            for (int i = 0; i < m; ++i) {
                T sum = T(table.c[i + 1]) * drift;
                for (int j = 0; j < m; ++j) sum = fused(T(-h * table.A[i * m + j]), W[j + 1], sum);
                moved[i + 1][c] = T(h) * sum;
            }
            moved[s - 1][c] = motion.position(c) - q_before[c];
        }
    }
    template <class Single>
    static void lend_step(const Motion& motion, const T (*)[n], Single& single, int lane) {
        LentVelocity<K, T>::lend_end(motion, single, lane);
        for (int i = 0; i < s; ++i)
            for (int c = 0; c < n; ++c)
                single.W[i * n + c] = lane_of(motion.fixed_point.minus_acceleration(i, c), lane);
        single.is_current = true;
    }
};

template <class K, class T>
struct LentStep<K, T, Form::separable, Stepping::composition> : LentVelocity<K, T> {
    using real = typename K::real;
    using typename LentVelocity<K, T>::Motion;
    using LentVelocity<K, T>::n;
    static constexpr int basis = ScalarFallback<K>::basis;

    template <class Single>
    static void refill(Motion& motion, const Single& single, int lane) {
        motion.start(single, lane);
    }
    template <class Given>
    LOBATTO_LANE static void displacements(const Motion& motion, const Given& k, const T& time, const T* q_before,
                                           const T* u_before, T (*moved)[n]) {
        const T h = T(motion.h);
        T q[n], start[n], end[n];
        for (int c = 0; c < n; ++c) q[c] = motion.position(c);
        Formulas<K>::minus_acceleration(k, time, q_before, start);
        Formulas<K>::minus_acceleration(k, time + h, q, end);
        for (int c = 0; c < n; ++c) {
            moved[0][c] = q[c] - q_before[c];
            moved[1][c] = h * u_before[c];
            moved[2][c] = h * motion.rates()[c];
            moved[3][c] = h * (h * start[c]);
            moved[4][c] = h * (h * end[c]);
        }
    }
    template <class Single>
    static void lend_step(const Motion& motion, const T (*)[n], Single& single, int lane) {
        LentVelocity<K, T>::lend_end(motion, single, lane);
        single.ends.of = -1;
    }
};

// Where momenta are kept beside positions.
template <class K, class T>
struct LentMomentum {
    using real = typename K::real;
    using Motion = LaneStepper<K, T>;
    static constexpr int n = K::coordinates;

    template <class Single>
    static void refill(Motion& motion, const Single& single, int lane) {
        motion.start(single, lane);
    }
    template <class Given>
    LOBATTO_LANE static void momenta(const T* rates, const Given&, T* momentum) {
        for (int c = 0; c < n; ++c) momentum[c] = rates[c];
    }
};

// Without events: its steps have no polynomial.
template <class K, class T>
struct LentStep<K, T, Form::linear_map, Stepping::solved> : LentMomentum<K, T> {};

template <class K, class T, Stepping stepping>
struct LentStep<K, T, Form::general, stepping> : LentMomentum<K, T> {
    using typename LentMomentum<K, T>::real;
    using typename LentMomentum<K, T>::Motion;
    using LentMomentum<K, T>::n;
    using ActiveMask = decltype(T() < T());
    static constexpr int r = K::nodes, basis = ScalarFallback<K>::basis, controls = basis - 1;

    struct Table {  // as above
        real reach[controls * r]{};
        int row[K::mass_entries]{}, column[K::mass_entries]{};
        constexpr Table() {
            for (int i = 0; i < controls * r; ++i) reach[i] = K::reach[i];
            for (int e = 0; e < K::mass_entries; ++e) {
                row[e] = K::mass_row[e];
                column[e] = K::mass_column[e];
            }
        }
    };

    template <class Given>
    LOBATTO_LANE static void displacements(const Motion& motion, const Given&, const T&, const T*, const T*,
                                           T (*moved)[n]) {
        static constexpr Table table{};
        for (int c = 0; c < n; ++c) {
            moved[0][c] = T(real(0));
            for (int j = 0; j < controls; ++j) {
                T sum = T(real(0));
                for (int i = 0; i < r; ++i)
                    sum = fused(T(table.reach[j * r + i]), motion.fixed_point.v[c * r + i], sum);
                moved[j + 1][c] = T(motion.fixed_point.h) * sum;
            }
        }
    }
    // By Newton's iteration from the velocity of the last node (D27).
    template <class Given>
    LOBATTO_LANE static KnownVelocities<T> velocities(const Motion& motion, const Given& k, const T& time,
                                                      T* velocity) {
        static constexpr Table table{};
        T change = T(real(0)), size = T(real(0)), left = T(real(0)), whole = T(real(0));
        for (int c = 0; c < n; ++c) velocity[c] = motion.fixed_point.v[c * r + r - 1];
        for (int iteration = 0; iteration < 3; ++iteration) {
            T q[n], residual[n], packed[K::mass_entries], M[n * n];
            for (int c = 0; c < n; ++c) q[c] = motion.position(c);
            Formulas<K>::legendre(k, time, q, velocity, residual, packed);
            for (int i = 0; i < n * n; ++i) M[i] = T(real(0));
            for (int e = 0; e < K::mass_entries; ++e) M[table.row[e] * n + table.column[e]] = packed[e];
            factor_symmetric<n>(M);
            left = whole = T(real(0));
            for (int c = 0; c < n; ++c) {
                residual[c] = motion.rates()[c] - residual[c];
                left += fabs(residual[c]);
                whole += fabs(motion.rates()[c]);
            }
            solve_symmetric<n>(M, residual);
            change = size = T(real(0));
            for (int c = 0; c < n; ++c) {
                velocity[c] += residual[c];
                change += fabs(residual[c]);
                size += fabs(velocity[c]);
            }
        }
        const T root = T(Limits<real>::root_epsilon);
        return {change <= root * size, left <= root * whole};
    }
    template <class Single>
    static void lend_state(const T* position, const T* momentum, Single& single, int lane) {
        for (int c = 0; c < n; ++c) {
            single.q[c] = lane_of(position[c], lane);
            single.p[c] = lane_of(momentum[c], lane);
        }
    }
    template <class Single>
    static void lend_step(const Motion& motion, const T (*moved)[n], Single& single, int lane) {
        for (int c = 0; c < n; ++c) {
            single.q_before[c] = single.q[c];
            single.q[c] = lane_of(motion.position(c), lane);
            single.p[c] = lane_of(motion.rates()[c], lane);
        }
        for (int b = 0; b < Single::active; ++b)
            for (int j = 0; j < basis - 1; ++j)
                single.Y[Single::Layout::index(b, j)] = lane_of(moved[j + 1][K::active_index[b]], lane);
        for (int c = 0; c < Single::cyclic; ++c)
            for (int i = 0; i < r; ++i)
                single.cyclic_rates[i * Single::cyclic + c] =
                    lane_of(motion.fixed_point.v[K::cyclic_index[c] * r + i], lane);
        single.has_history = single.is_current = true;
    }
};

}  // namespace lobatto

#endif
