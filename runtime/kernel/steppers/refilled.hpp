// SPDX-License-Identifier: MIT
// Trajectories side by side, each with a time of its own: a lane whose trajectory has ended, because it was stopped or
// failed, takes the next one. Every state is recorded, and every step is looked at for events.
//
// The functions of events are sampled in all lanes at once, where Events samples them. A lane is quiet where each keeps
// the sign that it has had and nowhere comes near zero: then Events would find nothing. The step of any other lane is
// lent to a Stepper, in which Events locates what happened.
#ifndef LOBATTO_KERNEL_REFILLED_HPP
#define LOBATTO_KERNEL_REFILLED_HPP

#include <type_traits>

#include "ensemble.hpp"
#include "events.hpp"
#include "watch.hpp"

namespace lobatto {

// Where the functions of events are sampled in a step, and there the basis of its polynomial.
template <class K>
struct SamplePlaces {
    using real = typename K::real;
    using S = WatchedStepper<FallbackKernel<K>>;
    using Sampled = Events<FallbackKernel<K>>;
    static constexpr int places = Sampled::grid_size, basis = S::basis;
    real grid[places], value[places][basis], slope[places][basis];

    void prepare() {
        for (int i = 0; i < places; ++i) {
            grid[i] = Sampled::grid_at(i);
            S::basis_at(grid[i], value[i], slope[i]);
        }
    }
};

// The functions of events in the steps of lanes.
template <class K, int width>
struct LaneSamples {
    using real = typename K::real;
    using T = Pack<real, width>;
    using ActiveMask = decltype(T() < T());
    using Motion = LaneStepper<K, T>;
    using Sampled = Events<FallbackKernel<K>>;
    static constexpr int n = K::coordinates, basis = SamplePlaces<K>::basis, places = SamplePlaces<K>::places;
    static constexpr int pieces = Sampled::pieces;

    T last[K::events];  // of each function the last value that was not zero
    T moved[basis][n];  // the step's polynomial, in the basis of its form

    // The lanes in which something may have happened: in step number `gone` since `begun`, of length h, from `before`.
    template <class Given>
    LOBATTO_LANE ActiveMask restless(const SamplePlaces<K>& at, const Motion& motion, const Given& k, const T& begun,
                                     const T& gone, real h, const T* q_before, const T* rate_before) {
        motion.displacements(k, begun + gone * T(h), q_before, rate_before, moved);
        T y[places][K::events];
        for (int i = 0; i < places; ++i) {
            T q[n], velocity[n];
            for (int c = 0; c < n; ++c) {
                T position = T(real(0)), rate = T(real(0));
                for (int j = 0; j < basis; ++j) {
                    position = fused(T(at.value[i][j]), moved[j][c], position);
                    rate = fused(T(at.slope[i][j]), moved[j][c], rate);
                }
                q[c] = q_before[c] + position;
                velocity[c] = rate / T(h);
            }
            Formulas<K>::event(k, begun + (gone + T(at.grid[i])) * T(h), q, velocity, y[i]);
        }
        T velocity[n], end[K::events];
        const T next = begun + (gone + T(real(1))) * T(h);
        ActiveMask quiet = motion.velocities(k, next, velocity).have_converged;
        Formulas<K>::event(k, next, motion.positions(), velocity, end);
        for (int e = 0; e < K::events; ++e) quiet = quiet & is_quiet(e, y, end[e]);
        return !quiet;
    }

private:
    LOBATTO_LANE ActiveMask is_quiet(int e, const T (*samples)[K::events], const T& end) const {
        const ActiveMask is_above = last[e] > T(real(0));
        const auto with_sign = [&](const T& g) LOBATTO_FORMULA { return select(is_above, g, -g); };
        ActiveMask quiet = is_above | (last[e] < T(real(0)));
        T y[places], largest = T(real(0));
        for (int i = 0; i < places; ++i) {
            y[i] = with_sign(samples[i][e]);
            largest = maximum(largest, y[i]);
            quiet = quiet & (y[i] > T(real(0))) & (y[i] <= T(Limits<real>::largest));
        }
        T at[pieces + 1];
        for (int j = 0; j <= pieces; ++j) at[j] = y[Sampled::sample_at(j)];
        for (int i = 1; i + 1 < places; ++i) {
            const ActiveMask is_least = quiet & (y[i] <= y[i - 1]) & (y[i] < y[i + 1]);
            if (!any(is_least)) continue;
            if constexpr (pieces >= 4)
                quiet = quiet & (is_no_dip<pieces>(at, Sampled::piece_at(i), largest) | !is_least);
            else
                quiet = quiet & !is_least;
        }
        return quiet & (with_sign(end) > T(Limits<real>::root_epsilon) * largest) &
               (with_sign(end) <= T(Limits<real>::largest));
    }
};

// Looks at the steps of lanes.
template <class K, int width>
struct LaneWatch : LaneSamples<K, width> {
    using Samples = LaneSamples<K, width>;
    using Samples::last;
    using typename Samples::real;
    using Alone = FallbackKernel<K>;
    using S = WatchedStepper<Alone>;
    static constexpr int most = Watch<Alone>::most, columns = Watch<Alone>::columns;

    S single;  // to which a step is lent
    Watch<Alone>* watch = nullptr;
    SamplePlaces<K> at;

    void prepare() { at.prepare(); }
    void start(const ScalarFallback<K>& started, int lane) {
        for (int e = 0; e < K::events; ++e) set_lane(last[e], lane, started.event_values[e]);
    }

    // What happened in the step of `lane` that was lent: of its last step all but the state before. Adds rows as Watch.
    template <class Lend>
    Status look(const typename K::Parameters& parameters, real h, const Lend& lend, int lane, real* rows,
                std::int64_t& count) {
        const Status status = single.prepare(parameters, h);
        if (status != Status::ok) return status;
        single.parameters = parameters;
        if (watch == nullptr) watch = new Watch<Alone>(single);
        lend(single, *watch);
        for (int e = 0; e < K::events; ++e) single.event_values[e] = lane_of(last[e], lane);
        const Status found = watch->look(single, rows, count);
        for (int e = 0; e < K::events; ++e) set_lane(last[e], lane, single.event_values[e]);
        return found;
    }
    // After each call of the host.
    void rest() {
        delete watch;
        watch = nullptr;
    }
};

// What trajectories without events need of the same.
template <class K, int width>
struct NoLaneWatch {
    static constexpr int most = 0, columns = 2 + 2 * K::coordinates;
    void prepare() {}
    void start(const ScalarFallback<K>&, int) {}
    void rest() {}
};

template <class K, int width>
struct RefilledEnsemble : Ensemble<K, width> {
    using Base = Ensemble<K, width>;
    using Base::n, Base::lanes, Base::coefficients, Base::motion, Base::parameters, Base::coefficients_of, Base::single,
        Base::step_size, Base::steps;
    using typename Base::real, typename Base::T, typename Base::ActiveMask;
    static constexpr int columns = 1 + 2 * n;
    static constexpr bool has_events = K::events > 0;
    using Looks = std::conditional_t<has_events, LaneWatch<K, width>, NoLaneWatch<K, width>>;
    static constexpr int events_of_step = Looks::most;

    T begun, gone;  // the time at which each lane began, and its steps since then
    Looks looks;
    bool is_filled{};

    void prepare(real h) {
        step_size = h;
        steps = 1;  // so that iterations which fail begin anew
        begun = gone = T(real(0));
        looks.prepare();
    }

    // A trajectory begins in `lane`; where that is impossible, the lane stays as it is.
    Status fill(int lane, const real* values, real time, const real* q, const real* p) {
        for (int i = 0; i < K::parameter_count; ++i) K::parameter(parameters[lane], i) = values[i];
        const Status status = this->begin_alone(lane, time, q, p);
        if (status != Status::ok) return status;
        place(lane, time);
        for (int other = 0; other < width && !is_filled; ++other)  // so that all have numbers to compute with
            if (other != lane) place(other, time);
        is_filled = true;
        return status;
    }

    // At most call.steps of the lanes whose status is ok, until one of them ends. After each step a row of t, q, p of
    // each, call.capacity rows a lane; events as of Watch, where there is room for them.
    template <class Call>
    void advance(const Call& call, Status* status) {
        const real tolerance = static_cast<real>(call.tolerance);
        real* const events = static_cast<real*>(call.events);
        motion.set_tolerance(tolerance);
        single.tolerance = tolerance;
        ActiveMask active = ActiveMask(false);
        for (int lane = 0; lane < width; ++lane) {
            active.set(lane, status[lane] == Status::ok);
            call.steps_done[lane] = call.events_written[lane] = 0;
        }
        T evaluations = T(real(0));
        std::int64_t taken = 0;
        bool has_left = false;
        const auto leave = [&](int lane, Status why) {
            status[lane] = why;
            call.steps_done[lane] = taken;
            active.set(lane, false);
            has_left = true;
        };
        while (taken < call.steps && taken < call.capacity && !has_left && any(active)) {
            T q_before[n], rate_before[n];
            for (int c = 0; c < n; ++c) {
                q_before[c] = motion.positions()[c];
                rate_before[c] = motion.rates()[c];
            }
            const T time = begun + gone * T(step_size), next = begun + (gone + T(real(1))) * T(step_size);
            const ActiveMask stands_still = active & (next == time);
            if (any(stands_still))
                for (int lane = 0; lane < width; ++lane)
                    if (stands_still[lane]) leave(lane, Status::time_stands_still);
            const ActiveMask moved = motion.step(coefficients, time, active);
            evaluations += motion.evaluations;
            if (any(active & !moved)) this->retry(active & !moved, time, evaluations, leave);
            if constexpr (has_events) {
                if (events != nullptr) {
                    const ActiveMask restless = active & looks.restless(looks.at, motion, coefficients, begun, gone,
                                                                        step_size, q_before, rate_before);
                    for (int lane = 0; any(restless) && lane < width; ++lane) {
                        if (!restless[lane]) continue;
                        const Status found =
                            look(lane, q_before, rate_before, tolerance,
                                 events + lane * call.event_capacity * Looks::columns, call.events_written[lane]);
                        if (found != Status::ok) leave(lane, found);
                    }
                }
            }
            gone = select(active, gone + T(real(1)), gone);
            record(next, static_cast<real*>(call.records) + taken * columns, call.capacity * columns);
            ++taken;
            for (int lane = 0; lane < width; ++lane)
                has_left =
                    has_left || (events != nullptr && call.events_written[lane] + Looks::most > call.event_capacity);
        }
        looks.rest();
        for (int lane = 0; lane < width; ++lane) {
            if (status[lane] == Status::ok) call.steps_done[lane] = taken;
            call.iterations[lane] = static_cast<std::int64_t>(evaluations[lane]);
        }
    }

protected:
    void place(int lane, real time) {
        coefficients_of[lane] = single.coefficients;
        set_coefficients<K>(coefficients, lane, single.coefficients);
        motion.prepare(single, lane);
        motion.refill(single, lane);
        looks.start(single, lane);
        begun.set(lane, time);
        gone.set(lane, real(0));
    }

    // Into the rows of all lanes, `stride` apart.
    void record(const T& time, real* row, std::int64_t stride) const {
        T momentum[n];
        motion.momenta(motion.rates(), coefficients, momentum);
        for (int lane = 0; lane < width; ++lane, row += stride)
            put_state<n>(lane_of(time, lane), motion.positions(), momentum, row, lane);
    }

    Status look(int lane, const T* q_before, const T* rate_before, real tolerance, real* rows, std::int64_t& count) {
        const auto lend = [&](auto& to, auto& watch) {
            to.tolerance = tolerance;
            to.start_time = lane_of(begun, lane);
            to.steps = static_cast<std::int64_t>(lane_of(gone, lane));
            motion.lend_state(q_before, rate_before, to, lane);
            watch.keep(to);
            motion.lend_step(looks.moved, to, lane);
            ++to.steps;
        };
        return looks.look(parameters[lane], step_size, lend, lane, rows, count);
    }
};

}  // namespace lobatto

#endif
