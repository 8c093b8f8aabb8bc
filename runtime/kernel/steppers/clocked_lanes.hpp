// SPDX-License-Identifier: MIT
// Trajectories with a clock side by side: each in its lane, with its own energy, its own time and its own count of
// steps. A lane whose trajectory has ended takes the next one.
//
// A trajectory arrives at the times start + interval, start + 2 interval, ... Lanes whose step has passed such a time
// shorten it together (steppers/shortened.hpp), where the state is output. For arrivals without output a lane stores
// only the step that passed the latest one: its state is the last good one of a motion that fails.
#ifndef LOBATTO_KERNEL_CLOCKED_LANES_HPP
#define LOBATTO_KERNEL_CLOCKED_LANES_HPP

#include "clocked.hpp"
#include "ensemble.hpp"

namespace lobatto {

template <class K, int width>
struct ClockedEnsemble : Ensemble<K, width> {
    using Base = Ensemble<K, width>;
    using Base::n, Base::coefficients, Base::motion, Base::parameters, Base::coefficients_of, Base::single,
        Base::step_size, Base::steps;
    using typename Base::real, typename Base::T, typename Base::ActiveMask;
    static constexpr int columns = 1 + 2 * n, events_of_step = 0;
    static constexpr std::int64_t most_steps = 4096;     // of the chain in one call
    static constexpr std::int64_t most_skipped = 65536;  // times that lanes pass arrivals without output, likewise
    // To shorten a step takes about as long as two steps, for one lane as for all. So lanes wait for each other.
    static constexpr int most_waited = 2 * width;

    LongTime<T> now, before;  // of the chain: where it is, and a step ago
    T q_before[n], p_before[n];
    LongTime<T> passed;  // the start of the step that passed the latest arrival without output
    T q_passed[n], p_passed[n];
    T target;  // the time of the next arrival
    real origin[width]{}, tolerance{}, interval{}, end{};
    WatchedClock<real> watched_clock[width];
    std::int64_t arrived[width]{}, recorded[width]{};  // arrivals since the start; the last of them that has a row
    ShortenedStep<K, T, true> shortened;
    bool is_filled{};

    void prepare(real h) {
        step_size = h;
        steps = 1;  // so that iterations which fail begin anew
    }

    // A trajectory begins in `lane`; where that is impossible, the lane stays as it is.
    Status fill(int lane, const real* values, real time, const real* q, const real* p) {
        typename K::Parameters given;
        for (int i = 0; i < K::parameter_count; ++i) K::parameter(given, i) = values[i];
        Status status = single.prepare(given, step_size);
        if (status == Status::ok) status = single.start(time, q, p);
        if (status != Status::ok) return status;
        place(lane, time);
        for (int other = 0; other < width && !is_filled; ++other)  // so that all have numbers to compute with
            if (other != lane) place(other, time);
        is_filled = true;
        return status;
    }

    // The lanes whose status is ok, until one of them has arrived call.steps times since its start, has failed or has
    // no more room for rows. Rows are those of each call.record_every-th arrival (0: of none), of the last one, and of
    // the last before a failure.
    template <class Call>
    void advance(const Call& call, Status* status) {
        tolerance = static_cast<real>(call.tolerance);
        interval = static_cast<real>(call.interval);
        end = static_cast<real>(call.end);
        motion.set_tolerance(tolerance);
        single.tolerance = tolerance;
        ActiveMask active = ActiveMask(false);
        for (int lane = 0; lane < width; ++lane) {
            active.set(lane, status[lane] == Status::ok);
            call.steps_done[lane] = -arrived[lane];
            call.records_written[lane] = 0;
            aim(lane);
        }
        T evaluations = T(real(0));
        bool has_left = false;
        const auto leave = [&](int lane, Status why) {
            status[lane] = why;
            active.set(lane, false);
            has_left = true;
            if (arrived[lane] > recorded[lane] &&
                arrive_alone(call, lane, passed, q_passed, p_passed, arrived[lane]) != Status::ok)
                arrived[lane] = recorded[lane];  // the last good row
        };
        int waited = 0;  // steps, of all lanes together
        T gone = T(real(0));
        for (std::int64_t taken = 0, skipped = 0;
             any(active) && !has_left && taken < most_steps && skipped < most_skipped;) {
            ActiveMask arriving = active & !is_ahead(now.until(target));
            if (any(arriving) && skip(call, arriving)) {
                ++skipped;
                continue;
            }
            const ActiveMask moving = active & !arriving;
            if (any(arriving) && (!any(moving) || waited >= most_waited)) {
                has_left = arrive(call, arriving, leave) || has_left;
                waited = 0;
                continue;
            }
            step(moving, active, evaluations, leave);
            gone += select(moving & active, T(real(1)), T(real(0)));
            ++taken;
            for (int lane = 0; lane < width; ++lane) waited += arriving[lane] ? 1 : 0;
        }
        for (int lane = 0; lane < width; ++lane) {
            call.steps_done[lane] += arrived[lane];
            call.iterations[lane] = static_cast<std::int64_t>(evaluations[lane]);
            if (call.chain_steps != nullptr) call.chain_steps[lane] = static_cast<std::int64_t>(gone[lane]);
        }
    }

    // What ShortenedStep asks of the last step.
    const T& rate_at(int i) const { return motion.fixed_point.rates[i]; }
    const T& node_velocity(int c, int i) const { return motion.fixed_point.v[c * K::nodes + i]; }
    const auto& node_mass() const { return motion.fixed_point.mass; }

private:
    ActiveMask is_ahead(const T& duration) const {
        return step_size > real(0) ? duration > T(real(0)) : duration < T(real(0));
    }
    static void set_where(ActiveMask where, LongTime<T>& to, const LongTime<T>& from) {
        to.time = select(where, from.time, to.time);
        to.rest = select(where, from.rest, to.rest);
    }
    static void set_where(ActiveMask where, T* to, const T* from) {
        for (int c = 0; c < n; ++c) to[c] = select(where, from[c], to[c]);
    }
    real time_of(int lane, std::int64_t arrival) const {
        const real time = origin[lane] + real(arrival) * interval;
        return (time - end) * interval > real(0) ? end : time;
    }
    void aim(int lane) { set_lane(target, lane, time_of(lane, arrived[lane] + 1)); }

    void place(int lane, real time) {
        parameters[lane] = single.values;
        coefficients_of[lane] = single.coefficients;
        set_coefficients<K>(coefficients, lane, single.coefficients);
        motion.prepare(single, lane);
        motion.start(single, lane);
        for (LongTime<T>* moment : {&now, &before, &passed}) {
            set_lane(moment->time, lane, time);
            set_lane(moment->rest, lane, real(0));
        }
        for (int c = 0; c < n; ++c) {
            set_lane(q_before[c], lane, single.q[c]);
            set_lane(p_before[c], lane, single.p[c]);
        }
        for (int i = 0; i < K::nodes; ++i) set_lane(motion.fixed_point.rates[i], lane, real(1));
        origin[lane] = time;
        watched_clock[lane] = single.watched_clock;
        arrived[lane] = recorded[lane] = 0;
    }

    // A step of the chain in the lanes that move; `active`: all lanes that have not left.
    template <class Leave>
    void step(ActiveMask moving, const ActiveMask& active, T& evaluations, const Leave& leave) {
        set_where(moving, q_before, motion.positions());
        set_where(moving, p_before, motion.rates());
        const ActiveMask moved = motion.step(coefficients, now.time, moving);
        evaluations += motion.evaluations;
        if (any(moving & !moved)) this->retry(moving & !moved, now.time, evaluations, leave);
        const T& elapsed = motion.fixed_point.elapsed;
        const ActiveMask stands_still = moving & active & !(is_ahead(elapsed) & (now.time + elapsed != now.time));
        for (int lane = 0; lane < width; ++lane)
            if (moving[lane] && active[lane] && (stands_still[lane] || !keeps_energy(lane)))
                leave(lane, Status::time_stands_still);
        LongTime<T> next = now;
        next.add(elapsed);
        set_where(moving & active, before, now);
        set_where(moving & active, now, next);
    }

    bool keeps_energy(int lane) {
        WatchedClock<real>& watch = watched_clock[lane];
        if (!watch.is_suspect(lane_of(motion.fixed_point.elapsed, lane) / step_size)) return true;
        real q[n], p[n];
        this->state_of(lane, q, p);
        return watch.keeps_energy(single, q, p);
    }

    // Leaves those of the lanes that arrive whose states are output; whether there were others.
    template <class Call>
    bool skip(const Call& call, ActiveMask& arriving) {
        ActiveMask skipped = arriving;
        for (int lane = 0; lane < width; ++lane) {
            if (!arriving[lane]) continue;
            const std::int64_t next = arrived[lane] + 1;
            if (next == call.steps || (call.record_every > 0 && next % call.record_every == 0)) {
                skipped.set(lane, false);
            } else {
                arrived[lane] = next;
                aim(lane);
            }
        }
        set_where(skipped, passed, before);
        set_where(skipped, q_passed, q_before);
        set_where(skipped, p_passed, p_before);
        arriving = arriving & !skipped;
        return any(skipped);
    }

    // The rows of the lanes whose last step has passed an arrival; whether one has ended, or has no more room.
    template <class Call, class Leave>
    bool arrive(const Call& call, ActiveMask arriving, const Leave& leave) {
        const ActiveMask here = arriving & (now.until(target) == T(real(0)));
        const T wanted = before.until(target), whole = before.until(now.time) + now.rest;
        const ActiveMask found = here | shortened.find(*this, wanted, whole, arriving & !here);
        set_where(here, shortened.found_q, motion.positions());
        set_where(here, shortened.found_p, motion.rates());
        bool has_left = false;
        for (int lane = 0; lane < width; ++lane) {
            if (!arriving[lane]) continue;
            Status status = Status::ok;
            const std::int64_t next = arrived[lane] + 1;
            if (found[lane])
                put_row(call, lane, next, shortened.found_q, shortened.found_p);
            else
                status = arrive_alone(call, lane, before, q_before, p_before, next);
            if (status != Status::ok) {
                leave(lane, status);
                continue;
            }
            arrived[lane] = recorded[lane] = next;
            has_left = has_left || next == call.steps || call.records_written[lane] == call.capacity;
            aim(lane);
        }
        return has_left;
    }

    // The row of an arrival by a step that began there and then, which is taken anew by Newton's iteration.
    template <class Call>
    Status arrive_alone(const Call& call, int lane, const LongTime<T>& time, const T* q, const T* p,
                        std::int64_t arrival) {
        real position[n], momentum[n];
        for (int c = 0; c < n; ++c) {
            position[c] = lane_of(q[c], lane);
            momentum[c] = lane_of(p[c], lane);
        }
        Status status = this->go_on_alone(lane, lane_of(time.time, lane), position, momentum);
        single.now.rest = lane_of(time.rest, lane);
        if (status == Status::ok) status = single.step();
        if (status == Status::ok) status = single.arrive(time_of(lane, arrival));
        if (status == Status::ok) put_row(call, lane, arrival, single.arrival_q, single.arrival_p);
        return status;
    }

    template <class Call, class Number>
    void put_row(const Call& call, int lane, std::int64_t arrival, const Number* q, const Number* p) {
        real* const row =
            static_cast<real*>(call.records) + (lane * call.capacity + call.records_written[lane]++) * columns;
        put_state<n>(time_of(lane, arrival), q, p, row, lane);
    }
};

}  // namespace lobatto

#endif
