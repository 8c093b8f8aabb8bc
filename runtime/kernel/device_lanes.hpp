// SPDX-License-Identifier: MIT
// Trajectories side by side on a device, each in a thread: the lanes of ensemble.hpp, one number wide.
//
// A trajectory is a row of words, which lie word by word beside those of the others, so that threads side by side read
// words side by side. A launch takes each lane to the step `target`, or to a step whose iterations fail. That step is
// taken by the host as Ensemble takes it, by Newton's iteration, and so is the rest of the way to `target`. What a lane
// computes is what a lane of Ensemble computes; this text is compiled for the host by any C++17 compiler, and for the
// device by nvcc.
//
// With LOBATTO_DEVICE_WATCHES a lane is one of RefilledEnsemble, whose steps are looked at: for events, whose functions
// it samples (one that is not quiet, as refilled.hpp has it, waits with that step, which the host looks at; then it
// goes on, or has ended), and for what is kept of its trajectory (KeptFormulas, whose text is made for the scene).
#pragma once

#include <cstdint>
#include <type_traits>

#include "abi.h"
#include "kept.hpp"
#include "kernel.hpp"

namespace lobatto {

#ifndef LOBATTO_DEVICE_KEPT
struct KeptFormulas {  // nothing is kept
    static constexpr int parts = 0;
    static constexpr bool needs_velocity = false, needs_energy = false;
    static Kept of(int part);    // what is made of the formula or event,
    static int event(int part);  // the number of the event; -1: it is the formula
    // Formulas; x: parameters, time, positions, velocities, momenta, energy.
    static void values(const double* x, double* values);
};
#endif

#ifdef LOBATTO_DEVICE_WATCHES
template <class K>
constexpr bool has_watched_lanes = K::impacts == 0 && K::switches == 0;

// What is kept of a lane's trajectory so far. Formulas are in double.
template <class K>
struct KeptOfLane {
    using T = Pack<typename K::real, 1>;
    static constexpr int n = K::coordinates, parameters = K::parameter_count, count = KeptFormulas::parts;
    static constexpr bool needs_velocity =
        KeptFormulas::needs_velocity || (KeptFormulas::needs_energy && K::form == Form::general);
    double of_parameters[parameters > 0 ? parameters : 1];
    KeptNumber numbers[count];

    // The state after a step, or the first one.
    template <class Given>
    LOBATTO_INLINE void observe(const LaneStepper<K, T>& motion, const Given& k, double time, double passed,
                                bool is_first) {
        T p[n], v[n];
        motion.momenta(motion.rates(), k, p);
        for (int c = 0; c < n; ++c) v[c] = T(KeptNumber::none);
        if constexpr (needs_velocity) velocities(motion, k, T(time), p, v);
        observe(k, time, passed, is_first, motion.positions(), p, v);
    }
    template <class Given>
    LOBATTO_INLINE void observe(const Given& k, double time, double passed, bool is_first, const T* q, const T* p,
                                const T* v) {
        double x[parameters + 2 + 3 * n], values[count];
        for (int i = 0; i < parameters; ++i) x[i] = of_parameters[i];
        x[parameters] = time;
        for (int c = 0; c < n; ++c) {
            x[parameters + 1 + c] = lane_of(q[c], 0);
            x[parameters + 1 + n + c] = lane_of(v[c], 0);
            x[parameters + 1 + 2 * n + c] = lane_of(p[c], 0);
        }
        if constexpr (KeptFormulas::needs_energy && K::has_energy) {
            T energy;
            if constexpr (K::form == Form::linear_map)
                energy = K::energy(k, q, p);
            else
                energy = Formulas<K>::energy(k, T(time), q, K::form == Form::general ? v : p);
            x[parameters + 1 + 3 * n] = lane_of(energy, 0);
        } else {
            x[parameters + 1 + 3 * n] = KeptNumber::none;
        }
        KeptFormulas::values(x, values);
        for (int i = 0; i < count; ++i)
            if (KeptFormulas::event(i) < 0) numbers[i].observe(KeptFormulas::of(i), values[i], passed, is_first);
    }

private:
    template <class Given>
    LOBATTO_INLINE static void velocities(const LaneStepper<K, T>& motion, const Given& k, const T& time, const T* p,
                                          T* v) {
        if constexpr (K::form == Form::general) {
            const auto known = motion.velocities(k, time, v);
            for (int c = 0; c < n; ++c)
                v[c] = any(known.have_converged | known.have_momenta) ? v[c] : T(KeptNumber::none);
        } else {
            K::velocity(k, p, v);
        }
    }
};

struct NoPlaces {
    void prepare() {}
};
template <class K>
using KeptBy = std::conditional_t<(KeptFormulas::parts > 0), KeptOfLane<K>, Nothing>;
template <class K>
using PlacesOfLanes = std::conditional_t<(K::events > 0), SamplePlaces<K>, NoPlaces>;

// What a lane knows of events, and the state before the step that the host is to look at.
template <class K, bool has_events = (K::events > 0)>
struct Watched {
    using T = Pack<typename K::real, 1>;
    T last[K::events], q_before[K::coordinates], rate_before[K::coordinates];
};
template <class K>
struct Watched<K, false> {};
#else
template <class K>
constexpr bool has_watched_lanes = false;
template <class K>
struct PlacesOfLanes {};
#endif

// The state stands before what steps compute with.
template <class K>
struct alignas(8) DeviceLane {
    using T = Pack<typename K::real, 1>;
    typename K::template CoefficientsOf<T> coefficients;
#ifdef LOBATTO_DEVICE_WATCHES
    KeptBy<K> kept;
#endif
    LaneStepper<K, T> motion;
#ifdef LOBATTO_DEVICE_WATCHES
    Watched<K> watched;
#endif
};

// Whether trajectories of K can be such rows: not those that stand beside walls, go by a clock, or along neighbours.
template <class K>
constexpr bool has_device_lanes() {
    constexpr std::size_t most = 16384;  // bytes of a row
#ifdef LOBATTO_DEVICE_WATCHES
    if (!has_watched_lanes<K>) return false;
#endif
    if constexpr (ensemble_lanes<K>(1) == 0 || K::neighbours)
        return false;
    else
        return sizeof(DeviceLane<K>) <= most;
}

template <class K>
constexpr int device_words = sizeof(DeviceLane<K>) / 8;

// The words of what is kept and of the state, which stands first in each LaneStepper: at most two positions and two
// velocities or momenta.
template <class K>
struct MovingWords {
    using T = typename DeviceLane<K>::T;
    static constexpr std::size_t begin = sizeof(typename K::template CoefficientsOf<T>) / 8 * 8;
#ifdef LOBATTO_DEVICE_WATCHES
    static constexpr std::size_t kept = sizeof(KeptBy<K>) + 8;
#else
    static constexpr std::size_t kept = 0;
#endif
    static constexpr std::size_t wanted = begin + alignof(T) + kept + 8 + (4 * K::coordinates + 1) * sizeof(T);
    static constexpr std::size_t end = wanted < sizeof(DeviceLane<K>) ? wanted : sizeof(DeviceLane<K>);
    static constexpr int first = begin / 8, count = (end + 7) / 8 - begin / 8;
};

// Words are copied whole: nvcc moves what it takes for bytes one by one. `words`: so many of the first.
template <class K, int words = device_words<K> >
LOBATTO_INLINE void load_lane(const lobatto_device_call& call, std::int64_t index, DeviceLane<K>& lane) {
    for (int w = 0; w < words; ++w) {
        const std::uint64_t word = call.words[w * call.room + index];
        __builtin_memcpy(reinterpret_cast<char*>(&lane) + 8 * w, &word, 8);
    }
}
// `count` lanes, of which the first is number `index`.
template <class K, int count = 1>
LOBATTO_INLINE void store_lanes(const lobatto_device_call& call, std::int64_t index, const DeviceLane<K>* lanes) {
    for (int w = 0; w < device_words<K>; ++w)
        for (int i = 0; i < count; ++i) {
            std::uint64_t word;
            __builtin_memcpy(&word, reinterpret_cast<const char*>(lanes + i) + 8 * w, 8);
            call.words[w * call.room + index + i] = word;
        }
}

// What lanes of one step size have in common; `alike`: of one step size and the same parameters.
template <class K>
struct SharedByLanes {
    typename K::template CoefficientsOf<typename DeviceLane<K>::T> coefficients;
    typename LaneStepper<K, typename DeviceLane<K>::T>::Shared motion;
    PlacesOfLanes<K> places;

    template <bool alike>
    LOBATTO_INLINE void give(DeviceLane<K>& lane) const {
        if constexpr (alike) lane.coefficients = coefficients;
        lane.motion.template take<alike>(motion);
    }
};

#ifdef LOBATTO_DEVICE_WATCHES
// Before a step.
template <class K>
LOBATTO_INLINE void keep_state(DeviceLane<K>& lane) {
    if constexpr (K::events > 0)
        for (int c = 0; c < K::coordinates; ++c) {
            lane.watched.q_before[c] = lane.motion.positions()[c];
            lane.watched.rate_before[c] = lane.motion.rates()[c];
        }
}
// After it: whether the host has to look at it.
template <class K>
LOBATTO_INLINE bool is_restless(const lobatto_device_call& call, const PlacesOfLanes<K>& places,
                                const DeviceLane<K>& lane, typename K::real begun, typename K::real gone,
                                typename K::real h) {
    if constexpr (K::events > 0) {
        using T = typename DeviceLane<K>::T;
        if (call.watches == 0) return false;
        LaneSamples<K, 1> samples;
        for (int e = 0; e < K::events; ++e) samples.last[e] = lane.watched.last[e];
        return any(samples.restless(places, lane.motion, lane.coefficients, T(begun), T(gone), h, lane.watched.q_before,
                                    lane.watched.rate_before));
    } else {
        return false;
    }
}
template <class K>
LOBATTO_INLINE void keep_numbers(DeviceLane<K>& lane, typename K::real begun, typename K::real done,
                                 typename K::real h) {
    if constexpr (KeptFormulas::parts > 0) {
        const double time = begun + done * h, before = begun + (done - 1) * h;
        lane.kept.observe(lane.motion, lane.coefficients, time, time - before, false);
    }
}
#else
template <class K>
LOBATTO_INLINE void keep_state(DeviceLane<K>&) {}
template <class K>
LOBATTO_INLINE bool is_restless(const lobatto_device_call&, const PlacesOfLanes<K>&, const DeviceLane<K>&,
                                typename K::real, typename K::real, typename K::real) {
    return false;
}
template <class K>
LOBATTO_INLINE void keep_numbers(DeviceLane<K>&, typename K::real, typename K::real, typename K::real) {}
#endif

// What a thread does. A step that fails, or that the host has to look at, is not counted: its lane waits for the host.
template <class K, bool alike>
LOBATTO_INLINE void advance_lane(const lobatto_device_call& call, const SharedByLanes<K>& shared, std::int64_t index) {
    using real = typename K::real;
    using ActiveMask = decltype(typename DeviceLane<K>::T() < typename DeviceLane<K>::T());
    std::int64_t number = call.steps[index], evaluations = 0;
    const std::int64_t target = call.target - number > call.most ? number + call.most : call.target;
    if (call.status[index] != static_cast<std::int32_t>(Status::ok) || number >= target) return;
    DeviceLane<K> lane;
    load_lane(call, index, lane);
    shared.template give<alike>(lane);
    real start_time, h;
    __builtin_memcpy(&start_time, call.start_time, sizeof(real));
    __builtin_memcpy(&h, call.step, sizeof(real));
    Status status = Status::ok;
    for (; number < target; ++number) {
        const real time = start_time + real(number) * h;
        if (start_time + real(number + 1) * h == time) {
            status = Status::time_stands_still;
            break;
        }
        keep_state(lane);
        const ActiveMask moved = lane.motion.step(lane.coefficients, time, ActiveMask(true));
        if (!any(moved)) {
            status = Status::not_converged;
            break;
        }
        evaluations += static_cast<std::int64_t>(lane.motion.evaluations[0]);
        if (is_restless(call, shared.places, lane, start_time, real(number), h)) {
            status = Status::stopped;
            break;
        }
        keep_numbers(lane, start_time, real(number + 1), h);
    }
    store_lanes(call, index, &lane);
    call.status[index] = static_cast<std::int32_t>(status);
    call.steps[index] = number;
    call.iterations[index] += evaluations;
}

}  // namespace lobatto

#ifdef __CUDACC__

#define LOBATTO_DEVICE_FUNCTION(K, name, alike, exists)                                                               \
    extern "C" __global__ void __launch_bounds__(LOBATTO_DEVICE_BLOCK) name(                                          \
        const __grid_constant__ lobatto_device_call call, const __grid_constant__ lobatto::SharedByLanes<K> shared) { \
        const std::int64_t index = static_cast<std::int64_t>(blockIdx.x) * LOBATTO_DEVICE_BLOCK + threadIdx.x;        \
        if constexpr (exists) {                                                                                       \
            if (index < call.lanes)                                                                                   \
                lobatto::advance_lane<K, alike>(call, shared, call.order == nullptr ? index : call.order[index]);     \
        }                                                                                                             \
    }
#define LOBATTO_EXPORT_DEVICE_LANES(K)                            \
    LOBATTO_DEVICE_FUNCTION(K, lobatto_advance_alike, true, true) \
    LOBATTO_DEVICE_FUNCTION(K, lobatto_advance_lanes, false, K::parameter_count > 0)

// The rows of the lanes of `order`, so many words, out into `packed`, whose room is `lanes`, or back.
extern "C" __global__ void __launch_bounds__(LOBATTO_DEVICE_BLOCK)
    lobatto_move_lanes(const __grid_constant__ lobatto_device_call call, std::uint64_t* packed, std::int64_t words,
                       std::int64_t back) {
    const std::int64_t index = static_cast<std::int64_t>(blockIdx.x) * LOBATTO_DEVICE_BLOCK + threadIdx.x;
    if (index >= call.lanes) return;
    for (std::int64_t word = 0; word < words; ++word) {
        std::uint64_t &row = call.words[word * call.room + call.order[index]],
                      &other = packed[word * call.lanes + index];
        if (back != 0)
            row = other;
        else
            other = row;
    }
}

#endif
