// SPDX-License-Identifier: MIT
// Steps that are equally long in the time tau of a clock, dt = g(q) dtau: a chain of them, and states at given times.
//
// The chain is that of Form::general for Lambda(q, w) = g (L(q, w / g) + E), w = dq/dtau, with the energy E of the
// start (D42). Its steps last as long as the quadrature of g along them says (D43). A state at a given time is the end
// of a step of the chain that is shortened until it ends there: it has the order of the steps, and the chain goes on
// as if nobody had asked. Velocities that callers give and get are dq/dt.
#ifndef LOBATTO_KERNEL_CLOCKED_HPP
#define LOBATTO_KERNEL_CLOCKED_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "general.hpp"

namespace lobatto {

// A time as the sum of two numbers, so that a million short steps add up.
template <class real>
struct LongTime {
    real time{}, rest{};

    void add(real part) {
        const real wanted = part + rest, sum = time + wanted;
        const real added = sum - time;
        rest = (time - (sum - added)) + (wanted - added);
        time = sum;
    }
    // What is missing to `target`.
    real until(real target) const { return (target - time) - rest; }
};

template <class K>
struct Stepper<K, Form::general, Stepping::clocked> : Stepper<K, Form::general, Stepping::solved> {
    using Chain = Stepper<K, Form::general, Stepping::solved>;
    using Chain::n, Chain::q, Chain::p, Chain::coefficients, Chain::step_size, Chain::elapsed, Chain::rates;
    using typename Chain::real;
    static constexpr int trial_limit = 60, r = K::nodes;

    typename K::Parameters values{};                      // the last one is the energy at the start
    LongTime<real> now{}, before{};                       // of the chain: its state, and that a step ago
    real p_before[n]{};                                   // as q_before
    real arrival_time{}, arrival_q[n]{}, arrival_p[n]{};  // the state at the time last asked for
    real origin{};                                        // the time at the start
    std::int64_t arrivals{};                              // since the start
    bool is_recorded{};                                   // the state of the chain

    Status prepare(const typename K::Parameters& parameters, real h) {
        values = parameters;
        return Chain::prepare(values, h);
    }

    Status start(real time, const real* position, const real* momentum) {
        Status status = Chain::start(real(0), position, momentum);
        real energy_of_start = real(0);
        if (status == Status::ok) status = energy(real(0), position, momentum, &energy_of_start);
        if (status == Status::ok) status = start(time, position, momentum, energy_of_start);
        return status;
    }
    // A start on an orbit whose energy is known.
    Status start(real time, const real* position, const real* momentum, real energy_of_start) {
        set_energy(energy_of_start);
        Status status = Chain::prepare(values, step_size);
        if (status == Status::ok) status = Chain::start(real(0), position, momentum);
        now = before = {time, real(0)};
        origin = time;
        arrivals = 0;
        is_recorded = true;
        arrive_here(time);
        return status;
    }

    // One step of the chain.
    Status step() {
        real p_of_start[n];
        for (int k = 0; k < n; ++k) p_of_start[k] = p[k];
        const Status status = Chain::step();
        if (status != Status::ok) return status;
        // The clock is 0 somewhere on the way, or below: the motion in tau comes near such a place, but not beyond it.
        if (!is_ahead(elapsed) || now.time + elapsed == now.time) return Status::time_stands_still;
        for (int k = 0; k < n; ++k) p_before[k] = p_of_start[k];
        before = now;
        now.add(elapsed);
        is_recorded = false;
        return Status::ok;
    }

    // Whether the chain has not come to a time yet.
    bool is_short_of(real target) const { return is_ahead(now.until(target)); }

    // The state at a time that the last step of the chain has passed, or where the chain stands.
    Status arrive(real target) {
        ++arrivals;
        if (!(now.until(target) == real(0))) return shorten_to(target);
        is_recorded = true;
        arrive_here(target);
        return Status::ok;
    }

    real time() const { return now.time; }
    real energy_of_start() const {
        typename K::Parameters copy = values;
        return K::parameter(copy, K::parameter_count);
    }
    // The time at theta of the last step.
    real time_within(real theta) const {
        real passed = real(0);
        for (int i = 0; i < K::nodes; ++i) {
            real position[n], rate[n];
            Chain::polynomial(theta * K::c[i], position, rate);
            passed += K::b[i] * clock_at(position);
        }
        return before.time + theta * step_size * passed;
    }

    static constexpr int basis = 0;  // the rate of the clock goes with theta too
    void polynomial(real theta, real* position, real* velocity) const {
        Chain::polynomial(theta, position, velocity);
        slow_down(position, velocity);
    }
    void momentum(real* momentum) const { Chain::momentum(momentum); }
    void momentum(real time, const real* position, const real* velocity, real* momentum) const {
        real w[n];
        in_clock_time(position, velocity, w);
        Chain::momentum(time, position, w, momentum);
    }
    Status velocity(real time, const real* position, const real* momentum, real* velocity) const {
        const Status status = Chain::velocity(time, position, momentum, velocity);
        if (status == Status::ok) slow_down(position, velocity);
        return status;
    }
    Status energy(real time, const real* position, const real* momentum, real* value) const {
        return Chain::energy(time, position, momentum, value);
    }
    // dL/dv, and dL/dq where H = E.
    void slopes(real time, const real* position, const real* velocity, real* Lv, real* Lq) const {
        real w[n];
        in_clock_time(position, velocity, w);
        Chain::slopes(time, position, w, Lv, Lq);
        slow_down(position, Lq);
    }
    // Of a step of the chain at the energy of (q, p).
    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        Stepper local = *this;
        const Status status = local.start(time, position, momentum);
        return status == Status::ok ? local.Chain::tangent(real(0), position, momentum, q1, p1, T) : status;
    }

private:
    bool is_ahead(real duration) const { return step_size > real(0) ? duration > real(0) : duration < real(0); }
    void set_energy(real value) { K::parameter(values, K::parameter_count) = value; }
    real clock_at(const real* position) const { return Formulas<K>::clock(coefficients, real(0), position); }
    void slow_down(const real* position, real* velocity) const {
        const real rate = clock_at(position);
        for (int k = 0; k < n; ++k) velocity[k] /= rate;
    }
    void in_clock_time(const real* position, const real* velocity, real* w) const {
        const real rate = clock_at(position);
        for (int k = 0; k < n; ++k) w[k] = rate * velocity[k];
    }
    void arrive_here(real target) {
        arrival_time = target;
        for (int k = 0; k < n; ++k) {
            arrival_q[k] = q[k];
            arrival_p[k] = p[k];
        }
    }

    // Lagrange's polynomials on the nodes, at x; share: one over what each is at its own node.
    static void polynomials_at(real x, const real* share, real* value) {
        real below = real(1), above = real(1);
        for (int j = 0; j < r; ++j) {
            value[j] = below * share[j];
            below *= x - K::c[j];
        }
        for (int j = r - 1; j >= 0; --j) {
            value[j] *= above;
            above *= x - K::c[j];
        }
    }
    // theta at which the polynomial of the last step's rates says that `wanted` has passed: its integral is theta times
    // the polynomial of the mean rates until each node. Newton's iteration, as far as it stays within the step.
    real theta_of(real wanted, real theta, const real* share) const {
        real mean[r], value[r];
        for (int i = 0; i < r; ++i) {
            mean[i] = K::c[i] > real(0) ? real(0) : rates[i];
            if (K::c[i] > real(0)) {
                for (int j = 0; j < r; ++j) mean[i] += K::integration[i * r + j] * rates[j];
                mean[i] /= K::c[i];
            }
        }
        for (int trial = 0; trial < 8; ++trial) {
            polynomials_at(theta, share, value);
            real until_now = real(0), rate = real(0);
            for (int j = 0; j < r; ++j) {
                until_now += mean[j] * value[j];
                rate += rates[j] * value[j];
            }
            const real next = theta + (wanted / step_size - theta * until_now) / rate;
            if (!(next > real(0) && next < real(1))) break;
            const bool is_near = fabs(next - theta) <= Limits<real>::root_epsilon;
            theta = next;
            if (is_near) break;
        }
        return theta;
    }

    // Ends of the last step's start, shortened: by iterations that begin with the velocities of the polynomial of that
    // step, or of the end before; by a stepper of their own where these fail.
    struct Ends {
        const Stepper& step;
        std::conditional_t<Chain::iterates_on_velocities, GalerkinFixedPoint<K, real>, Unit> iteration;
        real share[r], q[n], p[n], elapsed;
        bool is_first = true;

        explicit Ends(const Stepper& whole) : step(whole) {
            for (int j = 0; j < r; ++j) {
                share[j] = real(1);
                for (int l = 0; l < r; ++l)
                    if (l != j) share[j] *= K::c[j] - K::c[l];
                share[j] = real(1) / share[j];
            }
            begin(iteration);
        }
        Status take(real theta) {
            if (iterate(iteration, theta)) return Status::ok;
            Chain part;
            Status status = part.prepare(step.values, theta * step.step_size);
            part.tolerance = step.tolerance;
            if (status == Status::ok) status = part.start(real(0), step.q_before, step.p_before);
            if (status == Status::ok) status = part.step();
            for (int k = 0; k < n; ++k) {
                q[k] = part.q[k];
                p[k] = part.p[k];
            }
            elapsed = part.elapsed;
            return status;
        }

    private:
        template <class Iteration>
        void begin(Iteration& any) {
            if constexpr (Chain::iterates_on_velocities) {
                any.mass = step.fixed_point.iteration.mass;
                for (int c = 0; c < n; ++c) any.kappa[c] = real(0);
                any.tolerance = step.tolerance;
            }
        }
        template <class Iteration>
        bool iterate(Iteration& any, real theta) {
            if constexpr (Chain::iterates_on_velocities) {
                for (int k = 0; k < n; ++k) {
                    q[k] = step.q_before[k];
                    p[k] = step.p_before[k];
                }
                any.prepare(theta * step.step_size);
                if (is_first) {
                    real value[r][r];
                    for (int i = 0; i < r; ++i) polynomials_at(theta * K::c[i], share, value[i]);
                    any.recall([&](int c, int i) {
                        real sum = real(0);
                        for (int j = 0; j < r; ++j) sum += value[i][j] * step.node_velocity(c, j);
                        return sum;
                    });
                }
                any.is_guess = true;
                is_first = false;
                if (any.step(step.coefficients, real(0), +q, +p, true)) {
                    elapsed = any.elapsed;
                    return true;
                }
                is_first = true;
            }
            (void)any, (void)theta;
            return false;
        }
    };

    // theta with t(theta h) = target, t monotone: Newton's iteration with dt/dtau = g, kept between two bounds.
    Status shorten_to(real target) {
        Ends end(*this);
        const real wanted = before.until(target), whole = before.until(now.time) + now.rest;
        real low = real(0), high = real(1), change = real(1), theta = theta_of(wanted, wanted / whole, end.share);
        for (int trial = 0; trial < trial_limit; ++trial) {
            if (!(theta > low && theta < high)) theta = low + real(0.5) * (high - low);
            const Status status = end.take(theta);
            if (status != Status::ok) return status;
            const real missing = wanted - end.elapsed;
            (is_ahead(missing) ? low : high) = theta;
            // The change before was so small that its square is rounding.
            const bool is_there = fabs(change) <= Limits<real>::root_epsilon;
            change = missing / (step_size * clock_at(end.q));
            if (is_there || fabs(change) <= real(2) * Limits<real>::epsilon || high - low <= Limits<real>::epsilon) {
                arrival_time = target;
                for (int k = 0; k < n; ++k) {
                    arrival_q[k] = end.q[k];
                    arrival_p[k] = end.p[k];
                }
                return Status::ok;
            }
            theta += change;
        }
        return Status::not_converged;
    }
};

}  // namespace lobatto

#endif
