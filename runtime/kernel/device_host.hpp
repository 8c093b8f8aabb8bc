// SPDX-License-Identifier: MIT
// The host's side of lanes on a device (device_lanes.hpp): it puts trajectories at their starts, takes the steps whose
// iterations fail, looks at those that may hold a stop, and reads states. For the C++ compiler alone.
#pragma once

#include <limits>
#include <new>

#include "device_lanes.hpp"

#ifndef __CUDACC__

namespace lobatto {

template <class K>
DeviceLane<K> loaded(const lobatto_device_call& call, std::int64_t index) {
    DeviceLane<K> lane{};
    load_lane(call, index, lane);
    return lane;
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
    using Base::n, Base::coefficients, Base::motion, Base::steps, Base::number;
    using typename Base::real;

public:
    // At its start, with these parameters.
    void place(lobatto_device_call& call, std::int64_t index, const real* parameters, const real* q, const real* p,
               real tolerance, real* energy) {
        Status status = Status::ok;
        this->prepare(parameters, number(call.step), &status);
        if (status == Status::ok) this->start(number(call.start_time), q, p, &status);
        motion.set_tolerance(tolerance);
        call.status[index] = static_cast<std::int32_t>(status);
        call.steps[index] = call.iterations[index] = 0;
        put(call, index);
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
        put(call, index);
    }
    void state(const lobatto_device_call& call, std::int64_t index, real* q, real* p, real* energy) {
        const DeviceLane<K> lane = loaded<K>(call, index);
        motion = lane.motion;
        this->read_coefficients(lane);
        this->state_of(0, q, p);
        Base::energy(number(call.start_time) + real(call.steps[index]) * number(call.step), q, p, energy);
    }

private:
    void put(const lobatto_device_call& call, std::int64_t index) const {
        DeviceLane<K> lane{};
        lane.coefficients = coefficients;
        lane.motion = motion;
        store_lane(call, index, lane);
    }
};

#ifdef LOBATTO_DEVICE_STOPS
template <class K>
class HostLane<K, true> : LaneOnHost<K, RefilledEnsemble<K, 1> > {
    using Base = LaneOnHost<K, RefilledEnsemble<K, 1> >;
    using Base::n, Base::coefficients, Base::motion, Base::number, Base::looks;
    using typename Base::real, typename Base::T, typename Base::Step, typename Base::Looks;
    real events_[Looks::most * Looks::columns];
    bool is_ready_;

public:
    void place(lobatto_device_call& call, std::int64_t index, const real* parameters, const real* q, const real* p,
               real tolerance, real* energy) {
        const real time = number(call.start_time);
        if (!is_ready_) this->prepare(number(call.step));
        is_ready_ = true;
        const Status status = this->fill(0, parameters, time, q, p);
        motion.set_tolerance(tolerance);
        call.status[index] = static_cast<std::int32_t>(status);
        call.steps[index] = call.iterations[index] = 0;
        put(call, index);
        Base::energy(time, q, p, energy);
    }
    // The one step that failed, or that has to be looked at. Of a lane that ends, `row` becomes the number of its stop
    // (not that it has one), and t, q, p and energy of its last state.
    void retake(lobatto_device_call& call, std::int64_t index, const real* parameters, real tolerance, real* row) {
        this->prepare(number(call.step));
        this->single.tolerance = tolerance;
        for (int i = 0; i < K::parameter_count; ++i) K::parameter(this->parameters[0], i) = parameters[i];
        this->single.prepare(this->parameters[0], this->step_size);
        const DeviceLane<K> lane = loaded<K>(call, index);
        this->read_coefficients(lane);
        motion = lane.motion;
        this->begun = T(number(call.start_time));
        this->gone = T(real(call.steps[index]));
        for (int e = 0; e < K::events; ++e) looks.last[e] = lane.watched.last[e];
        real last[1 + 2 * n];
        std::int64_t events = 0;
        auto status = static_cast<Status>(call.status[index]);
        if (status == Status::stopped) {
            remember(lane.watched.q_before, lane.watched.rate_before, last);
            looks.restless(looks.at, motion, coefficients, this->begun, this->gone, this->step_size,
                           lane.watched.q_before, lane.watched.rate_before);
            status = this->look(0, lane.watched.q_before, lane.watched.rate_before, tolerance, events_, events);
            looks.rest();
            if (status == Status::ok) ++call.steps[index];
        } else {
            T q[n], rates[n];
            for (int c = 0; c < n; ++c) {
                q[c] = motion.position(c);
                rates[c] = motion.rates()[c];
            }
            remember(q, rates, last);
            if (status == Status::not_converged) {
                real record[1 + 2 * n];
                std::int64_t done = 0, iterations = 0;
                status = Status::ok;
                this->advance(1, tolerance, record, 1, call.watches != 0 ? events_ : nullptr, Looks::most, &status,
                              &done, &iterations, &events);
                call.steps[index] += done;
                call.iterations[index] += iterations;
            }
        }
        call.status[index] = static_cast<std::int32_t>(status);
        put(call, index);
        const bool stops = status == Status::stopped;
        const real* const event = stops ? events_ + (events - 1) * Looks::columns : last;
        for (int i = 0; i < Looks::columns; ++i) row[i] = stops ? event[i] : i > 0 ? last[i - 1] : real(-1);
        Base::energy(row[1], row + 2, row + 2 + n, row + Looks::columns);
    }
    void state(const lobatto_device_call& call, std::int64_t index, real* q, real* p, real* energy) {
        const DeviceLane<K> lane = loaded<K>(call, index);
        motion = lane.motion;
        this->read_coefficients(lane);
        T momentum[n];
        Step::momenta(motion.rates(), coefficients, momentum);
        for (int c = 0; c < n; ++c) {
            q[c] = lane_of(motion.position(c), 0);
            p[c] = lane_of(momentum[c], 0);
        }
        Base::energy(number(call.start_time) + real(call.steps[index]) * number(call.step), q, p, energy);
    }

private:
    // t, q, p of the state before the step.
    void remember(const T* q, const T* rates, real* row) const {
        T momentum[n];
        Step::momenta(rates, coefficients, momentum);
        row[0] = lane_of(this->begun + this->gone * T(this->step_size), 0);
        for (int c = 0; c < n; ++c) {
            row[1 + c] = lane_of(q[c], 0);
            row[1 + n + c] = lane_of(momentum[c], 0);
        }
    }
    void put(const lobatto_device_call& call, std::int64_t index) const {
        DeviceLane<K> lane{};
        lane.coefficients = coefficients;
        lane.motion = motion;
        for (int e = 0; e < K::events; ++e) lane.watched.last[e] = looks.last[e];
        store_lane(call, index, lane);
    }
};
#endif

template <class K, bool has_lanes = has_device_lanes<K>()>
struct ExportDeviceLanes {
    using real = typename K::real;
    using Host = HostLane<K>;
    using Shared = SharedByLanes<K>;
    static constexpr int n = K::coordinates;

    static const real* in(const void* numbers) { return static_cast<const real*>(numbers); }
    static real* out(void* numbers) { return static_cast<real*>(numbers); }

    static void place(void* host, lobatto_device_call* call, std::int64_t first, std::int64_t last,
                      const void* parameters, const void* q, const void* p, double tolerance, void* energy) {
        Host& lane = *new (host) Host{};
        for (std::int64_t l = first; l < last; ++l)
            lane.place(*call, l, in(parameters) + l * K::parameter_count, in(q) + l * n, in(p) + l * n,
                       static_cast<real>(tolerance), out(energy) + l);
    }
    static void shared(const lobatto_device_call* call, std::int64_t lane, void* all) {
        Shared& made = *new (all) Shared{};
        const DeviceLane<K> one = loaded<K>(*call, lane);
        made.coefficients = one.coefficients;
        made.motion = one.motion.shared();
        if constexpr (has_watched_lanes<K>) made.places.prepare();
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
    static void retake(void* host, lobatto_device_call* call, std::int64_t lane, const void* parameters,
                       double tolerance, void* row) {
        (new (host) Host{})->retake(*call, lane, in(parameters), static_cast<real>(tolerance), out(row));
    }
    static void state(void* host, const lobatto_device_call* call, std::int64_t first, std::int64_t last, void* q,
                      void* p, void* energy) {
        Host& lane = *new (host) Host{};
        for (std::int64_t l = first; l < last; ++l)
            lane.state(*call, l, out(q) + l * n, out(p) + l * n, out(energy) + l);
    }

    static constexpr lobatto_device_lanes table = {LOBATTO_ABI_VERSION,
                                                   sizeof(lobatto_device_lanes),
                                                   K::digest,
                                                   device_words<K>,
                                                   MovingWords<K>::first,
                                                   MovingWords<K>::count,
                                                   sizeof(Shared),
                                                   alignof(Shared),
                                                   sizeof(Host),
                                                   alignof(Host),
                                                   has_watched_lanes<K> ? 3 + 2 * n : 0,
                                                   place,
                                                   shared,
                                                   advance,
                                                   retake,
                                                   state};
};
template <class K>
struct ExportDeviceLanes<K, false> {
    static constexpr lobatto_device_lanes table = {LOBATTO_ABI_VERSION,
                                                   sizeof(lobatto_device_lanes),
                                                   K::digest,
                                                   0,
                                                   0,
                                                   0,
                                                   0,
                                                   0,
                                                   0,
                                                   0,
                                                   0,
                                                   nullptr,
                                                   nullptr,
                                                   nullptr,
                                                   nullptr,
                                                   nullptr};
};

}  // namespace lobatto

#define LOBATTO_EXPORT_DEVICE_LANES(K)                                                                               \
    extern "C" __attribute__((visibility("default"))) const lobatto_device_lanes* lobatto_device_lanes_table(void) { \
        return &lobatto::ExportDeviceLanes<K>::table;                                                                \
    }

#endif
