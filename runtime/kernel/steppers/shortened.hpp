// SPDX-License-Identifier: MIT
// The end, at a given time, of a step in the time of a clock: the step from the same start that is shortened until it
// ends then (D43). One trajectory or, with T a Pack, one in each lane.
#ifndef LOBATTO_KERNEL_SHORTENED_HPP
#define LOBATTO_KERNEL_SHORTENED_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "../iteration/galerkin.hpp"

namespace lobatto {

// A time as the sum of two numbers, so that a million short steps add up.
template <class T>
struct LongTime {
    T time{}, rest{};

    void add(const T& part) { time = add_with_error(time, part + rest, rest); }
    // What is missing to `target`.
    T until(const T& target) const { return (target - time) - rest; }
};

// By iterations that begin with the velocities of the polynomial of the whole step, or of the trial before, where it
// `iterates`; else, and where these fail, as the caller says.
template <class K, class T, bool iterates>
struct ShortenedStep {
    using real = typename K::real;
    using ActiveMask = decltype(T() < T());
    static constexpr int n = K::coordinates, r = K::nodes, trial_limit = 60;

    std::conditional_t<iterates, GalerkinFixedPoint<K, T>, Nothing> iteration;
    T q[n]{}, p[n]{}, elapsed{};   // of a trial
    T found_q[n]{}, found_p[n]{};  // the ends that were found

    // theta with t(theta h) = wanted, t monotone: Newton's iteration with dt/dtau = g, kept between two bounds. `step`
    // has taken the whole step, in the time `whole`; alone(theta): whether a trial by other means went well. The lanes
    // whose end is found.
    template <class Step, class Alone = Nothing>
    ActiveMask find(const Step& step, const T& wanted, const T& whole, ActiveMask active, const Alone& alone = {}) {
        const T h = T(step.step_size);
        T low = T(real(0)), high = T(real(1)), change = T(real(1)), theta = theta_of(step, wanted / h, wanted / whole);
        ActiveMask found = active & !active;
        begin(step, iteration);
        for (int trial = 0; trial < trial_limit && any(active); ++trial) {
            const ActiveMask is_within = (theta > low) & (theta < high);
            theta = select(is_within, theta, low + T(real(0.5)) * (high - low));
            active = take(step, theta, trial == 0, active, alone);
            const T missing = wanted - elapsed;
            const ActiveMask is_short = step.step_size > real(0) ? missing > T(real(0)) : missing < T(real(0));
            low = select(is_short, theta, low);
            high = select(is_short, high, theta);
            // The change before was so small that its square is rounding.
            const ActiveMask is_there = fabs(change) <= T(Limits<real>::root_epsilon);
            change = missing / (h * Formulas<K>::clock(step.coefficients, T(real(0)), q));
            const ActiveMask done = active & (is_there | (fabs(change) <= T(real(2) * Limits<real>::epsilon)) |
                                              (high - low <= T(Limits<real>::epsilon)));
            for (int k = 0; k < n; ++k) {
                found_q[k] = select(done, q[k], found_q[k]);
                found_p[k] = select(done, p[k], found_p[k]);
            }
            found = found | done;
            active = active & !done;
            theta += change;
        }
        return found;
    }

private:
    bool has_failed = false;

    template <class Step, class Iteration>
    void begin(const Step& step, Iteration& any_iteration) {
        if constexpr (iterates) {
            any_iteration.mass = step.node_mass();
            for (int c = 0; c < n; ++c) any_iteration.kappa[c] = T(real(0));
            any_iteration.tolerance = step.tolerance;
        }
    }

    // The lanes in which the step of theta h went well.
    template <class Step, class Alone>
    ActiveMask take(const Step& step, const T& theta, bool is_first, ActiveMask active, const Alone& alone) {
        ActiveMask moved = active & !active;
        if (!has_failed) moved = iterate(iteration, step, theta, is_first, active);
        // One trajectory alone; in lanes each is left to a stepper of its own.
        if constexpr (std::is_same_v<T, real>) {
            has_failed = !moved;
            if (!moved) moved = alone(theta);
        }
        return moved;
    }
    template <class Iteration, class Step>
    ActiveMask iterate(Iteration& any_iteration, const Step& step, const T& theta, bool is_first, ActiveMask active) {
        if constexpr (iterates) {
            for (int k = 0; k < n; ++k) {
                q[k] = step.q_before[k];
                p[k] = step.p_before[k];
            }
            any_iteration.prepare(theta * T(step.step_size));
            if (is_first) {
                for (int i = 0; i < r; ++i) {
                    T value[r];
                    polynomials_at(theta * T(K::c[i]), value);
                    for (int c = 0; c < n; ++c) {
                        T sum = T(real(0));
                        for (int j = 0; j < r; ++j) sum += value[j] * step.node_velocity(c, j);
                        any_iteration.v[c * r + i] = sum;
                    }
                }
            }
            any_iteration.is_guess = true;
            active = any_iteration.step(step.coefficients, T(real(0)), q, p, active);
            elapsed = any_iteration.elapsed;
            return active;
        } else {
            return active & !active;
        }
    }

    // One over what each of Lagrange's polynomials is at its own node.
    struct Shares {
        real of[r];
        Shares() {
            for (int j = 0; j < r; ++j) {
                of[j] = real(1);
                for (int l = 0; l < r; ++l)
                    if (l != j) of[j] *= K::c[j] - K::c[l];
                of[j] = real(1) / of[j];
            }
        }
    };
    Shares share;

    // Lagrange's polynomials on the nodes, at x.
    void polynomials_at(const T& x, T* value) const {
        T below = T(real(1)), above = T(real(1));
        for (int j = 0; j < r; ++j) {
            value[j] = below * T(share.of[j]);
            below *= x - T(K::c[j]);
        }
        for (int j = r - 1; j >= 0; --j) {
            value[j] *= above;
            above *= x - T(K::c[j]);
        }
    }
    // theta at which the polynomial of the whole step's rates says that `wanted`, in steps, has passed: its integral is
    // theta times the polynomial of the mean rates until each node. Newton's iteration, as far as it stays within the
    // step.
    template <class Step>
    T theta_of(const Step& step, const T& wanted, T theta) const {
        T mean[r], value[r];
        for (int i = 0; i < r; ++i) {
            mean[i] = K::c[i] > real(0) ? T(real(0)) : step.rate_at(i);
            if (K::c[i] > real(0)) {
                for (int j = 0; j < r; ++j) mean[i] += T(K::integration[i * r + j]) * step.rate_at(j);
                mean[i] /= T(K::c[i]);
            }
        }
        ActiveMask goes_on = ActiveMask(true);
        for (int trial = 0; trial < 8 && any(goes_on); ++trial) {
            polynomials_at(theta, value);
            T until_now = T(real(0)), rate = T(real(0));
            for (int j = 0; j < r; ++j) {
                until_now += mean[j] * value[j];
                rate += step.rate_at(j) * value[j];
            }
            const T next = theta + (wanted - theta * until_now) / rate;
            goes_on = goes_on & (next > T(real(0))) & (next < T(real(1)));
            const ActiveMask is_far = fabs(next - theta) > T(Limits<real>::root_epsilon);
            theta = select(goes_on, next, theta);
            goes_on = goes_on & is_far;
        }
        return theta;
    }
};

}  // namespace lobatto

#endif
