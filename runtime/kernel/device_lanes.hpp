// SPDX-License-Identifier: MIT
// Trajectories side by side on a device, each in a thread: the lanes of ensemble.hpp, one number wide.
//
// A trajectory is a row of words, which lie word by word beside those of the others, so that threads side by side read
// words side by side. A launch takes each lane to the step `target`, or to a step whose iterations fail. That step is
// taken by the host as Ensemble takes it, by Newton's iteration, and so is the rest of the way to `target`. What a lane
// computes is what a lane of Ensemble computes; this text is compiled for the host by any C++17 compiler, and for the
// device by nvcc.
#pragma once

#include <cstdint>
#include <limits>
#include <new>
#include <type_traits>

#include "abi.h"
#include "kernel.hpp"

namespace lobatto {

template <class K>
struct alignas(8) DeviceLane {
    using T = Pack<typename K::real, 1>;
    typename K::template CoefficientsOf<T> coefficients;
    LaneStepper<K, T> motion;
};

// Whether trajectories of K can be such rows: not those that stand beside walls, go by a clock, or along neighbours.
template <class K>
constexpr bool has_device_lanes() {
    constexpr std::size_t most = 16384;  // bytes of a row
    if constexpr (ensemble_lanes<K>(1) == 0)
        return false;
    else if constexpr (K::form == Form::separable)
        return !K::neighbours && sizeof(DeviceLane<K>) <= most;
    else
        return sizeof(DeviceLane<K>) <= most;
}

template <class K>
constexpr int device_words = sizeof(DeviceLane<K>) / 8;

// The words of the state, which stands first in each LaneStepper: at most two positions and two velocities or momenta.
template <class K>
struct MovingWords {
    using T = typename DeviceLane<K>::T;
    using Motion = LaneStepper<K, T>;
    static constexpr std::size_t begin =
        (sizeof(typename K::template CoefficientsOf<T>) + alignof(Motion) - 1) / alignof(Motion) * alignof(Motion);
    static constexpr std::size_t wanted = begin + 8 + (4 * K::coordinates + 1) * sizeof(T);
    static constexpr std::size_t end = wanted < sizeof(DeviceLane<K>) ? wanted : sizeof(DeviceLane<K>);
    static constexpr int first = begin / 8, count = (end + 7) / 8 - begin / 8;
};

template <class K>
LOBATTO_INLINE void load_lane(const lobatto_device_call& call, std::int64_t index, DeviceLane<K>& lane) {
    for (int w = 0; w < device_words<K>; ++w)
        __builtin_memcpy(reinterpret_cast<char*>(&lane) + 8 * w, call.words + w * call.room + index, 8);
}
template <class K>
LOBATTO_INLINE void store_lane(const lobatto_device_call& call, std::int64_t index, const DeviceLane<K>& lane) {
    for (int w = 0; w < device_words<K>; ++w)
        __builtin_memcpy(call.words + w * call.room + index, reinterpret_cast<const char*>(&lane) + 8 * w, 8);
}

template <class K>
using SharedByLanes = typename decltype(DeviceLane<K>::motion)::Shared;

// What a thread does. A step that fails is not counted: its lane waits for the host.
template <class K>
LOBATTO_INLINE void advance_lane(const lobatto_device_call& call, const SharedByLanes<K>& shared, std::int64_t index) {
    using real = typename K::real;
    using ActiveMask = decltype(typename DeviceLane<K>::T() < typename DeviceLane<K>::T());
    std::int64_t number = call.steps[index], evaluations = 0;
    if (call.status[index] != static_cast<std::int32_t>(Status::ok) || number >= call.target) return;
    DeviceLane<K> lane;
    load_lane(call, index, lane);
    lane.motion.take(shared);
    real start_time, h;
    __builtin_memcpy(&start_time, call.start_time, sizeof(real));
    __builtin_memcpy(&h, call.step, sizeof(real));
    Status status = Status::ok;
    for (; number < call.target; ++number) {
        const real time = start_time + real(number) * h;
        if (start_time + real(number + 1) * h == time) {
            status = Status::time_stands_still;
            break;
        }
        const ActiveMask moved = lane.motion.step(lane.coefficients, time, ActiveMask(true));
        if (!any(moved)) {
            status = Status::not_converged;
            break;
        }
        evaluations += static_cast<std::int64_t>(lane.motion.evaluations[0]);
    }
    store_lane(call, index, lane);
    call.status[index] = static_cast<std::int32_t>(status);
    call.steps[index] = number;
    call.iterations[index] += evaluations;
}

}  // namespace lobatto

#ifdef __CUDACC__

#define LOBATTO_EXPORT_DEVICE_LANES(K)                                                                                \
    extern "C" __global__ void __launch_bounds__(LOBATTO_DEVICE_BLOCK) lobatto_advance_lanes(                         \
        const __grid_constant__ lobatto_device_call call, const __grid_constant__ lobatto::SharedByLanes<K> shared) { \
        const std::int64_t index = static_cast<std::int64_t>(blockIdx.x) * LOBATTO_DEVICE_BLOCK + threadIdx.x;        \
        if (index < call.lanes) lobatto::advance_lane<K>(call, shared, index);                                        \
    }

#else

namespace lobatto {

// The host's side of the lanes of a call: one trajectory after another, as an ensemble of one.
template <class K>
class HostLane : Ensemble<K, 1> {
    using typename Ensemble<K, 1>::real;
    using Ensemble<K, 1>::n, Ensemble<K, 1>::coefficients, Ensemble<K, 1>::motion, Ensemble<K, 1>::steps;

public:
    // At its start, with these parameters.
    void place(lobatto_device_call& call, std::int64_t index, const real* parameters, const real* q, const real* p,
               real tolerance) {
        Status status = Status::ok;
        this->prepare(parameters, number(call.step), &status);
        if (status == Status::ok) this->start(number(call.start_time), q, p, &status);
        motion.set_tolerance(tolerance);
        call.status[index] = static_cast<std::int32_t>(status);
        call.steps[index] = call.iterations[index] = 0;
        put(call, index);
    }
    // From the step that failed on.
    void retake(lobatto_device_call& call, std::int64_t index, const real* parameters, real tolerance) {
        Status status = Status::ok;
        this->prepare(parameters, number(call.step), &status);
        this->start_time = number(call.start_time);
        steps = call.steps[index];
        motion = loaded(call, index).motion;
        std::int64_t done = 0, iterations = 0;
        this->advance(call.target - steps, tolerance, &status, &done, &iterations);
        call.status[index] = static_cast<std::int32_t>(status);
        call.steps[index] += done;
        call.iterations[index] += iterations;
        put(call, index);
    }
    void state(const lobatto_device_call& call, std::int64_t index, real* q, real* p, real* energy) {
        const DeviceLane<K> lane = loaded(call, index);
        motion = lane.motion;
        read_coefficients(lane);
        steps = call.steps[index];
        this->start_time = number(call.start_time);
        this->step_size = number(call.step);
        this->state_of(0, q, p);
        *energy = real(std::numeric_limits<double>::quiet_NaN());
        if constexpr (K::has_energy) this->single.energy(this->time_of(steps), q, p, energy);
    }
    static SharedByLanes<K> shared(const lobatto_device_call& call, std::int64_t index) {
        return loaded(call, index).motion.shared();
    }

private:
    static real number(const double* parts) {
        real x;
        __builtin_memcpy(&x, parts, sizeof x);
        return x;
    }
    static DeviceLane<K> loaded(const lobatto_device_call& call, std::int64_t index) {
        DeviceLane<K> lane{};
        load_lane(call, index, lane);
        return lane;
    }
    void put(const lobatto_device_call& call, std::int64_t index) const {
        DeviceLane<K> lane{};
        lane.coefficients = coefficients;
        lane.motion = motion;
        store_lane(call, index, lane);
    }
    void read_coefficients(const DeviceLane<K>& lane) {
        if constexpr (!std::is_empty_v<typename K::Coefficients>) {
            static_assert(sizeof(this->coefficients_of[0]) == sizeof lane.coefficients);
            __builtin_memcpy(static_cast<void*>(&this->coefficients_of[0]), &lane.coefficients,
                             sizeof lane.coefficients);
        }
    }
};

template <class K, bool has_lanes = has_device_lanes<K>()>
struct ExportDeviceLanes {
    using real = typename K::real;
    using Host = HostLane<K>;
    using Shared = SharedByLanes<K>;
    static constexpr int n = K::coordinates;

    static const real* in(const void* numbers) { return static_cast<const real*>(numbers); }
    static real* out(void* numbers) { return static_cast<real*>(numbers); }

    static void place(void* host, lobatto_device_call* call, std::int64_t first, std::int64_t last,
                      const void* parameters, const void* q, const void* p, double tolerance) {
        Host& lane = *new (host) Host{};
        for (std::int64_t l = first; l < last; ++l)
            lane.place(*call, l, in(parameters) + l * K::parameter_count, in(q) + l * n, in(p) + l * n,
                       static_cast<real>(tolerance));
    }
    static void shared(const lobatto_device_call* call, std::int64_t lane, void* all) {
        new (all) Shared(Host::shared(*call, lane));
    }
    static void advance(lobatto_device_call* call, const void* all, std::int64_t first, std::int64_t last) {
        for (std::int64_t l = first; l < last; ++l) advance_lane<K>(*call, *static_cast<const Shared*>(all), l);
    }
    static void retake(void* host, lobatto_device_call* call, std::int64_t lane, const void* parameters,
                       double tolerance) {
        (new (host) Host{})->retake(*call, lane, in(parameters), static_cast<real>(tolerance));
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
