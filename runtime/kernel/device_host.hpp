// SPDX-License-Identifier: MIT
// The host's side of lanes on a device (device_lanes.hpp): it puts trajectories at their starts, takes the steps whose
// iterations fail, looks at those that may hold a stop, and reads states. For the C++ compiler alone.
#pragma once

#include <limits>
#include <new>

#include "device_lanes.hpp"

#ifndef __CUDACC__

namespace lobatto {

template <class K, int words = device_words<K> >
DeviceLane<K> loaded(const lobatto_device_call& call, std::int64_t index) {
    DeviceLane<K> lane{};
    load_lane<K, words>(call, index, lane);
    return lane;
}
// Without what steps compute with.
template <class K>
DeviceLane<K> loaded_state(const lobatto_device_call& call, std::int64_t index) {
    return loaded<K, MovingWords<K>::first + MovingWords<K>::count>(call, index);
}

// The host's side of the lanes of a call, one trajectory after another, as an ensemble E of one.
template <class K, class E>
struct LaneOnHost : E {
    using E::coefficients, E::coefficients_of, E::motion, E::single;
    using typename E::real;
    static constexpr int n = K::coordinates;

    static real number(const double* parts) {
        real x;
        __builtin_memcpy(&x, parts, sizeof x);
        return x;
    }
    void read_coefficients(const DeviceLane<K>& lane) {
        coefficients = lane.coefficients;
        if constexpr (!std::is_empty_v<typename K::Coefficients>) {
            static_assert(sizeof coefficients_of[0] == sizeof lane.coefficients);
            __builtin_memcpy(static_cast<void*>(&coefficients_of[0]), &lane.coefficients, sizeof lane.coefficients);
        }
    }
    void energy(real time, const real* q, const real* p, real* energy) {
        *energy = real(std::numeric_limits<double>::quiet_NaN());
        if constexpr (K::has_energy) {
            single.coefficients = coefficients_of[0];
            single.energy(time, q, p, energy);
        }
    }
};

template <class K, bool is_watched = has_watched_lanes<K> >
class HostLane : LaneOnHost<K, Ensemble<K, 1> > {
    using Base = LaneOnHost<K, Ensemble<K, 1> >;
    using Base::n, Base::coefficients, Base::motion, Base::steps, Base::number, Base::single;
    using typename Base::real;
    // Of the trajectory before: the next one often has the same parameters.
    real known_parameters_[K::parameter_count + 1];
    decltype(Base::motion) known_motion_;
    Status known_status_;
    bool is_ready_;

public:
    static constexpr int columns = 0;

    // At its start, with these parameters; `row` becomes its row.
    void place(lobatto_device_call& call, std::int64_t index, const real* parameters, const real* q, const real* p,
               real tolerance, real* energy, DeviceLane<K>& row) {
        prepare_for(parameters, number(call.step));
        this->start_time = number(call.start_time);
        Status status = known_status_;
        if (status == Status::ok) status = single.start(this->start_time, q, p);
        if (status == Status::ok) motion.start(single, 0);
        motion.set_tolerance(tolerance);
        call.status[index] = static_cast<std::int32_t>(status);
        call.steps[index] = call.iterations[index] = 0;
        fill(row);
        real its_q[n], its_p[n];
        this->state_of(0, its_q, its_p);
        Base::energy(number(call.start_time), its_q, its_p, energy);
    }
    // From the step that failed on to the target.
    void retake(lobatto_device_call& call, std::int64_t index, const real* parameters, real tolerance, real*) {
        Status status = Status::ok;
        this->prepare(parameters, number(call.step), &status);
        this->start_time = number(call.start_time);
        steps = call.steps[index];
        motion = loaded<K>(call, index).motion;
        std::int64_t done = 0, iterations = 0;
        this->advance(call.target - steps, tolerance, &status, &done, &iterations);
        call.status[index] = static_cast<std::int32_t>(status);
        call.steps[index] += done;
        call.iterations[index] += iterations;
        DeviceLane<K> row{};
        fill(row);
        store_lanes(call, index, &row);
    }
    void rest() {}
    void state(const lobatto_device_call& call, std::int64_t index, real* q, real* p, real* energy, real*) {
        const DeviceLane<K> lane = loaded_state<K>(call, index);
        motion = lane.motion;
        this->read_coefficients(lane);
        this->state_of(0, q, p);
        Base::energy(number(call.start_time) + real(call.steps[index]) * number(call.step), q, p, energy);
    }

private:
    void prepare_for(const real* parameters, real h) {
        constexpr std::size_t bytes = K::parameter_count * sizeof(real);
        if (!is_ready_ || __builtin_memcmp(known_parameters_, parameters, bytes) != 0) {
            this->prepare(parameters, h, &known_status_);
            __builtin_memcpy(known_parameters_, parameters, bytes);
            known_motion_ = motion;
            is_ready_ = true;
        }
        motion = known_motion_;
    }
    void fill(DeviceLane<K>& row) const {
        row.coefficients = coefficients;
        row.motion = motion;
    }
};

#ifdef LOBATTO_DEVICE_WATCHES
template <class K>
class HostLane<K, true> : LaneOnHost<K, RefilledEnsemble<K, 1> > {
    using Base = LaneOnHost<K, RefilledEnsemble<K, 1> >;
    using Base::n, Base::coefficients, Base::motion, Base::number, Base::looks, Base::single;
    using typename Base::real, typename Base::T, typename Base::Looks;
    static constexpr bool has_events = K::events > 0, keeps = KeptFormulas::parts > 0;
    real events_[has_events ? Looks::most * Looks::columns : 1];
    KeptBy<K> kept_;
    bool is_ready_;

public:
    static constexpr int columns = Looks::columns + 1 + KeptFormulas::parts;

    void place(lobatto_device_call& call, std::int64_t index, const real* parameters, const real* q, const real* p,
               real tolerance, real* energy, DeviceLane<K>& row) {
        const real time = number(call.start_time);
        prepare_once(number(call.step));
        const Status status = Base::fill(0, parameters, time, q, p);
        motion.set_tolerance(tolerance);
        call.status[index] = static_cast<std::int32_t>(status);
        call.steps[index] = call.iterations[index] = 0;
        if constexpr (keeps) {
            for (int i = 0; i < K::parameter_count; ++i) kept_.of_parameters[i] = parameters[i];
            for (int i = 0; i < KeptFormulas::parts; ++i) kept_.numbers[i].begin(KeptFormulas::of(i));
            if (status == Status::ok) observe_state(time, 0, true, q, p);
        }
        fill(row);
        Base::energy(time, q, p, energy);
    }
    // The one step that failed, or that has to be looked at. Of a lane that ends, `row` becomes the number of its stop
    // (not that it has one), t, q, p and energy of its last state, and what is kept.
    void retake(lobatto_device_call& call, std::int64_t index, const real* parameters, real tolerance, real* row) {
        prepare_once(number(call.step));
        single.tolerance = tolerance;
        for (int i = 0; i < K::parameter_count; ++i) K::parameter(this->parameters[0], i) = parameters[i];
        single.prepare(this->parameters[0], this->step_size);
        const DeviceLane<K> lane = loaded<K>(call, index);
        this->read_coefficients(lane);
        motion = lane.motion;
        kept_ = lane.kept;
        this->begun = T(number(call.start_time));
        this->gone = T(real(call.steps[index]));
        real last[1 + 2 * n];
        std::int64_t events = 0;
        const auto status = static_cast<Status>(call.status[index]);
        const Status found = status == Status::stopped ? look_at(call, index, lane, tolerance, last, events)
                                                       : retry(call, index, lane, status, tolerance, last, events);
        const bool stops = found == Status::stopped;
        const real* const event = stops ? events_ + (events - 1) * Looks::columns : last;
        if constexpr (keeps) {
            for (std::int64_t e = 0; e < events; ++e) observe_event(events_ + e * Looks::columns);
            if (found == Status::ok) {
                const double before = last[0], time = time_of(call, index);
                kept_.observe(motion, coefficients, time, time - before, false);
            }
            if (stops) observe_state(event[1], event[1] - last[0], false, event + 2, event + 2 + n);
        }
        call.status[index] = static_cast<std::int32_t>(found);
        DeviceLane<K> its_row{};
        fill(its_row);
        store_lanes(call, index, &its_row);
        for (int i = 0; i < Looks::columns; ++i) row[i] = stops ? event[i] : i > 0 ? last[i - 1] : real(-1);
        Base::energy(row[1], row + 2, row + 2 + n, row + Looks::columns);
        if constexpr (keeps) results(row[1] - number(call.start_time), row + Looks::columns + 1);
    }
    // After the last `retake`.
    void rest() { looks.rest(); }
    void state(const lobatto_device_call& call, std::int64_t index, real* q, real* p, real* energy, real* kept) {
        const DeviceLane<K> lane = loaded_state<K>(call, index);
        motion = lane.motion;
        this->read_coefficients(lane);
        kept_ = lane.kept;
        T momentum[n];
        motion.momenta(motion.rates(), coefficients, momentum);
        for (int c = 0; c < n; ++c) {
            q[c] = lane_of(motion.positions()[c], 0);
            p[c] = lane_of(momentum[c], 0);
        }
        Base::energy(time_of(call, index), q, p, energy);
        if constexpr (keeps) results(time_of(call, index) - number(call.start_time), kept);
    }

private:
    void prepare_once(real h) {
        if (!is_ready_) this->prepare(h);
        is_ready_ = true;
    }
    real time_of(const lobatto_device_call& call, std::int64_t index) const {
        return number(call.start_time) + real(call.steps[index]) * number(call.step);
    }
    Status look_at(lobatto_device_call& call, std::int64_t index, const DeviceLane<K>& lane, real tolerance, real* last,
                   std::int64_t& events) {
        if constexpr (has_events) {
            for (int e = 0; e < K::events; ++e) looks.last[e] = lane.watched.last[e];
            remember(lane.watched.q_before, lane.watched.rate_before, last);
            looks.restless(looks.at, motion, coefficients, this->begun, this->gone, this->step_size,
                           lane.watched.q_before, lane.watched.rate_before);
            const Status found =
                this->look(0, lane.watched.q_before, lane.watched.rate_before, tolerance, events_, events);
            if (found == Status::ok) ++call.steps[index];
            return found;
        } else {
            return Status::unsupported;
        }
    }
    // A step whose iteration failed; with another status the lane has ended.
    Status retry(lobatto_device_call& call, std::int64_t index, const DeviceLane<K>& lane, Status status,
                 real tolerance, real* last, std::int64_t& events) {
        T q[n], rates[n];
        for (int c = 0; c < n; ++c) {
            q[c] = motion.positions()[c];
            rates[c] = motion.rates()[c];
        }
        remember(q, rates, last);
        if constexpr (has_events)
            for (int e = 0; e < K::events; ++e) looks.last[e] = lane.watched.last[e];
        if (status != Status::not_converged) return status;
        real record[1 + 2 * n];
        std::int64_t done = 0, iterations = 0;
        lobatto_refilled_advance step{};
        step.steps = step.capacity = 1;
        step.tolerance = static_cast<double>(tolerance);
        step.records = record;
        step.events = has_events && call.watches != 0 ? events_ : nullptr;
        step.event_capacity = Looks::most;
        step.steps_done = &done;
        step.iterations = &iterations;
        step.events_written = &events;
        status = Status::ok;
        this->advance(step, &status);
        call.steps[index] += done;
        call.iterations[index] += iterations;
        return status;
    }
    void observe_event(const real* row) {
        for (int i = 0; i < KeptFormulas::parts; ++i)
            if constexpr (keeps)
                if (KeptFormulas::event(i) == static_cast<int>(row[0]))
                    kept_.numbers[i].observe_event(KeptFormulas::of(i), row[1]);
    }
    // A state that is no lane's: the first, or that of a stop.
    void observe_state(real time, double passed, bool is_first, const real* q, const real* p) {
        if constexpr (keeps) {
            real v[n];
            const bool is_known = single.velocity(time, q, p, v) == Status::ok;
            T position[n], momentum[n], velocity[n];
            for (int c = 0; c < n; ++c) {
                position[c] = T(q[c]);
                momentum[c] = T(p[c]);
                velocity[c] = is_known ? T(v[c]) : T(KeptNumber::none);
            }
            kept_.observe(coefficients, time, passed, is_first, position, momentum, velocity);
        }
    }
    void results(double passed, real* numbers) const {
        for (int i = 0; i < KeptFormulas::parts; ++i) numbers[i] = kept_.numbers[i].result(KeptFormulas::of(i), passed);
    }
    // t, q, p of the state before the step.
    void remember(const T* q, const T* rates, real* row) const {
        T momentum[n];
        motion.momenta(rates, coefficients, momentum);
        put_state<n>(lane_of(this->begun + this->gone * T(this->step_size), 0), q, momentum, row);
    }
    void fill(DeviceLane<K>& row) const {
        row.coefficients = coefficients;
        row.motion = motion;
        row.kept = kept_;
        if constexpr (has_events)
            for (int e = 0; e < K::events; ++e) row.watched.last[e] = looks.last[e];
    }
};
#endif

template <class K, bool has_lanes = has_device_lanes<K>()>
struct ExportDeviceLanes;
// None, and the functions are null.
template <class K>
struct ExportDeviceLanes<K, false> {
    static constexpr lobatto_device_lanes empty_table() {
        lobatto_device_lanes t{};
        t.abi_version = LOBATTO_ABI_VERSION;
        t.bytes = sizeof(lobatto_device_lanes);
        t.digest = K::digest;
        return t;
    }
    static constexpr lobatto_device_lanes table = empty_table();
};
template <class K>
struct ExportDeviceLanes<K, true> {
    using real = typename K::real;
    using Host = HostLane<K>;
    using Shared = SharedByLanes<K>;
    static constexpr int n = K::coordinates;

    static const real* in(const void* numbers) { return static_cast<const real*>(numbers); }
    static real* out(void* numbers) { return static_cast<real*>(numbers); }

    static void place(void* host, lobatto_device_call* call, std::int64_t first, std::int64_t last,
                      const void* parameters, const void* q, const void* p, double tolerance, void* energy) {
        Host& lane = *new (host) Host{};
        constexpr int together = 8;  // rows that are written at once: words side by side
        DeviceLane<K> rows[together] = {};
        for (std::int64_t l = first; l < last; ++l) {
            DeviceLane<K>& row = rows[(l - first) % together];
            lane.place(*call, l, in(parameters) + l * K::parameter_count, in(q) + l * n, in(p) + l * n,
                       static_cast<real>(tolerance), out(energy) + l, row);
            if (&row == rows + together - 1)
                store_lanes<K, together>(*call, l + 1 - together, rows);
            else if (l + 1 == last)
                for (DeviceLane<K>* left = rows; left <= &row; ++left) store_lanes(*call, l - (&row - left), left);
        }
    }
    static void shared(const lobatto_device_call* call, std::int64_t lane, void* all) {
        Shared& made = *new (all) Shared{};
        const DeviceLane<K> one = loaded<K>(*call, lane);
        made.coefficients = one.coefficients;
        made.motion = one.motion.shared();
        if constexpr (has_watched_lanes<K>) made.places.prepare();
    }
    // Those whose bits stay when a lane takes what is shared.
    static void own(const void* all, std::uint8_t* is_own) {
        DeviceLane<K> zeros{}, ones{};
        __builtin_memset(static_cast<void*>(&zeros), 0, sizeof zeros);
        __builtin_memset(static_cast<void*>(&ones), 0xff, sizeof ones);
        static_cast<const Shared*>(all)->template give<true>(zeros);
        static_cast<const Shared*>(all)->template give<true>(ones);
        for (int w = 0; w < device_words<K>; ++w)
            is_own[w] = __builtin_memcmp(reinterpret_cast<const char*>(&zeros) + 8 * w,
                                         reinterpret_cast<const char*>(&ones) + 8 * w, 8) != 0
                            ? 1
                            : 0;
    }
    static void advance(lobatto_device_call* call, const void* all, std::int64_t first, std::int64_t last) {
        const Shared& common = *static_cast<const Shared*>(all);
        for (std::int64_t i = first; i < last; ++i) {
            const std::int64_t lane = call->order == nullptr ? i : call->order[i];
            if (call->alike != 0)
                advance_lane<K, true>(*call, common, lane);
            else
                advance_lane<K, false>(*call, common, lane);
        }
    }
    static void retake(void* host, lobatto_device_call* call, std::int64_t count, const void* parameters,
                       double tolerance, void* rows) {
        Host& lane = *new (host) Host{};
        for (std::int64_t l = 0; l < count; ++l)
            lane.retake(*call, l, in(parameters) + l * K::parameter_count, static_cast<real>(tolerance),
                        out(rows) + l * Host::columns);
        lane.rest();
    }
    static void state(void* host, const lobatto_device_call* call, std::int64_t first, std::int64_t last, void* q,
                      void* p, void* energy, void* kept) {
        Host& lane = *new (host) Host{};
        for (std::int64_t l = first; l < last; ++l)
            lane.state(*call, l, out(q) + l * n, out(p) + l * n, out(energy) + l, out(kept) + l * KeptFormulas::parts);
    }

    static constexpr lobatto_device_lanes filled_table() {
        lobatto_device_lanes t = ExportDeviceLanes<K, false>::table;
        t.words = device_words<K>;
        t.first_moving = MovingWords<K>::first;
        t.moving = MovingWords<K>::count;
        t.shared_bytes = sizeof(Shared);
        t.shared_alignment = alignof(Shared);
        t.host_bytes = sizeof(Host);
        t.host_alignment = alignof(Host);
        t.columns = Host::columns;
        t.kept = KeptFormulas::parts;
        t.place = place;
        t.shared = shared;
        t.own = own;
        t.advance = advance;
        t.retake = retake;
        t.state = state;
        return t;
    }
    static constexpr lobatto_device_lanes table = filled_table();
};

}  // namespace lobatto

#define LOBATTO_EXPORT_DEVICE_LANES(K)                                                                               \
    extern "C" __attribute__((visibility("default"))) const lobatto_device_lanes* lobatto_device_lanes_table(void) { \
        return &lobatto::ExportDeviceLanes<K>::table;                                                                \
    }

#endif
