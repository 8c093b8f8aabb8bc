// SPDX-License-Identifier: MIT
// Steps that are equally long in the time tau of a clock, dt = g(q) dtau: a chain of them, and states at given times.
//
// The chain is that of Form::general for Lambda(q, w) = g (L(q, w / g) + E), w = dq/dtau, with the energy E of the
// start (D42). Its steps last as long as the quadrature of g along them says (D43). A state at a given time is the end
// of a step of the chain that is shortened until it ends there: it has the order of the steps, and the chain goes on
// unaffected. Velocities that callers give and get are dq/dt.
//
// Where the energy changes, the time is the last coordinate, and minus the energy its momentum (D64). A start sets
// both.
#ifndef LOBATTO_KERNEL_CLOCKED_HPP
#define LOBATTO_KERNEL_CLOCKED_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "general.hpp"
#include "shortened.hpp"

namespace lobatto {

// The motion in tau comes near a place where the clock is 0, but not beyond it. Errors of its energy grow there like
// one over the clock, and may throw it back. So where the clock has become small, the energy is looked at: it may be
// off by a part of the larger of p.v here and where the clock became small. (At walls p.v vanishes, at poles it grows.)
// The equations of a step may have a second solution, far away, where the clock is fast: so the energy is looked at,
// too, where the clock is much faster than a step ago. No motion makes it faster by a million.
template <class real>
struct WatchedClock {
    real energy_of_start{};  // 0 where the time is a coordinate
    real last{};             // rate of the clock, of the step before
    real largest{};          // until now
    real moving{};           // p.v where it became small; 0: it is not
    bool has_leapt{};

    // After a step of this rate: whether the energy is to be looked at.
    bool is_suspect(real rate) {
        const bool is_fast = rate > real(100) * last;
        has_leapt = rate > real(1e6) * last;
        last = rate;
        largest = maximum(largest, rate);
        const bool is_small = rate < real(0.01) * largest;
        if (!is_small) moving = real(0);
        return is_small || is_fast;
    }
    // After a step to (q, p), where it is.
    template <class Stepper>
    bool keeps_energy(const Stepper& stepper, const real* q, const real* p) {
        real energy, v[Stepper::n], product = real(0);
        if (has_leapt) return false;
        if (stepper.energy(real(0), q, p, &energy) != Status::ok) return false;
        if constexpr (Stepper::has_time_coordinate) energy += p[Stepper::n - 1];
        if (stepper.velocity(real(0), q, p, v) != Status::ok) return false;
        for (int k = 0; k < Stepper::moving; ++k) product += p[k] * v[k];
        if (moving == real(0)) moving = fabs(product);
        return fabs(energy - energy_of_start) <= real(0.01) * maximum(moving, fabs(product));
    }
};

template <class K>
struct Stepper<K, Form::general, Stepping::clocked> : Stepper<K, Form::general, Stepping::solved> {
    using Chain = Stepper<K, Form::general, Stepping::solved>;
    using Chain::n, Chain::q, Chain::p, Chain::q_before, Chain::coefficients, Chain::step_size, Chain::elapsed;
    using typename Chain::real;
    static constexpr bool has_time_coordinate = K::has_time_coordinate;
    static constexpr int moving = has_time_coordinate ? n - 1 : n;

    typename K::Parameters values{};                      // the last one is E of (D42), or sigma of (D64)
    LongTime<real> now{}, before{};                       // of the chain: its state, and that a step ago
    real p_before[n]{};                                   // as q_before
    real arrival_time{}, arrival_q[n]{}, arrival_p[n]{};  // the state at the time last asked for
    real origin{};                                        // the time at the start
    std::int64_t arrivals{};                              // since the start
    bool is_recorded{};                                   // the state of the chain
    WatchedClock<real> watched_clock{};

    Status prepare(const typename K::Parameters& parameters, real h) {
        values = parameters;
        return Chain::prepare(values, h);
    }

    Status start(real time, const real* position, const real* momentum) {
        real from[n], p_from[n], energy_of_start = real(0), of_start = real(0);
        for (int k = 0; k < n; ++k) {
            from[k] = position[k];
            p_from[k] = momentum[k];
        }
        if constexpr (has_time_coordinate) from[n - 1] = time;
        Status status = Chain::start(real(0), from, p_from);
        if (status == Status::ok) status = energy(real(0), from, p_from, &energy_of_start);
        if constexpr (has_time_coordinate) {
            p_from[n - 1] = -energy_of_start;
            if (status == Status::ok) status = scale_of(from, p_from, energy_of_start, of_start);
        } else {
            of_start = energy_of_start;
        }
        return status == Status::ok ? start(time, from, p_from, of_start) : status;
    }
    // A start on an orbit of which that is known what the last parameter says.
    Status start(real time, const real* position, const real* momentum, real of_start) {
        K::parameter(values, K::parameter_count) = of_start;
        Status status = Chain::prepare(values, step_size);
        if (status == Status::ok) status = Chain::start(real(0), position, momentum);
        now = before = {time, real(0)};
        watched_clock = {has_time_coordinate ? real(0) : of_start, clock_at(position)};
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
        if (!is_ahead(elapsed) || now.time + elapsed == now.time ||
            (watched_clock.is_suspect(elapsed / step_size) && !watched_clock.keeps_energy(*this, q, p))) {
            for (int k = 0; k < n; ++k) {
                q[k] = q_before[k];
                p[k] = p_of_start[k];
            }
            return Status::time_stands_still;
        }
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
    real known_of_start() const {
        typename K::Parameters copy = values;
        return K::parameter(copy, K::parameter_count);
    }
    // The time at theta of the last step.
    real time_within(real theta) const {
        real passed = real(0);
        for (int i = 0; i < K::nodes; ++i) {
            real position[n], rate[n];
            Chain::polynomial(theta * K::c[i], position, rate);
            passed += K::b[i] * (has_time_coordinate ? rate[n - 1] : clock_at(position));
        }
        return before.time + theta * step_size * passed;
    }

    void polynomial(real theta, real* position, real* velocity) const {
        Chain::polynomial(theta, position, velocity);
        slow_down(position, velocity);
    }
    void polynomial(const real* value, const real* slope, real* position, real* velocity) const {  // as Chain's
        Chain::polynomial(value, slope, position, velocity);
        slow_down(position, velocity);
    }
    void momentum(real* momentum) const { Chain::momentum(momentum); }
    // Where the time is a coordinate, `time` says it, and its velocity is 1.
    void momentum(real time, const real* position, const real* velocity, real* momentum) const {
        real there[n], w[n];
        for (int k = 0; k < n; ++k) there[k] = position[k];
        if constexpr (has_time_coordinate) there[n - 1] = time;
        in_clock_time(there, velocity, w);
        if constexpr (has_time_coordinate) w[n - 1] = clock_at(there);
        Chain::momentum(time, there, w, momentum);
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
    // What ShortenedStep asks of the last step.
    real rate_at(int i) const { return Chain::rates[i]; }
    const auto& node_mass() const { return Chain::fixed_point.iteration.mass; }

    // Of a step of the chain at the energy of (q, p).
    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        Stepper local = *this;
        const Status status = local.start(time, position, momentum);
        return status == Status::ok ? local.Chain::tangent(real(0), position, momentum, q1, p1, T) : status;
    }

private:
    bool is_ahead(real duration) const { return step_size > real(0) ? duration > real(0) : duration < real(0); }
    // sigma = g^(1 - a) (|p v / 2| + |H - p v / 2|) / 2: the last term of (D64) is about as large as those of L.
    Status scale_of(const real* position, const real* momentum, real energy_of_start, real& sigma) const {
        real v[n], half = real(0);
        const Status status = velocity(real(0), position, momentum, v);
        for (int k = 0; k < moving; ++k) half += real(0.5) * momentum[k] * v[k];
        sigma = real(0.5) * (fabs(half) + fabs(energy_of_start - half));
        if (sigma == real(0)) sigma = real(1);
        if constexpr (has_time_coordinate) sigma *= exp(real(1 - K::pace_exponent) * log(clock_at(position)));
        return status;
    }
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

    Status shorten_to(real target) {
        ShortenedStep<K, real, Chain::iterates_on_velocities> end;
        Status status = Status::not_converged;
        const auto alone = [&](real theta) {
            Chain part;
            status = part.prepare(values, theta * step_size);
            part.tolerance = this->tolerance;
            if (status == Status::ok) status = part.start(real(0), q_before, p_before);
            if (status == Status::ok) status = part.step();
            for (int k = 0; k < n; ++k) {
                end.q[k] = part.q[k];
                end.p[k] = part.p[k];
            }
            end.elapsed = part.elapsed;
            return status == Status::ok;
        };
        if (!end.find(*this, before.until(target), before.until(now.time) + now.rest, true, alone))
            return status == Status::ok ? Status::not_converged : status;
        arrival_time = target;
        for (int k = 0; k < n; ++k) {
            arrival_q[k] = end.found_q[k];
            arrival_p[k] = end.found_p[k];
        }
        return Status::ok;
    }
};

}  // namespace lobatto

#endif
