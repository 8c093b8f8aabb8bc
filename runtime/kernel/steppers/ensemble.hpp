// SPDX-License-Identifier: MIT
// Trajectories side by side: each in its lane, with its own parameters and state, one step size and time for all.
//
// What a lane computes depends on no other lane. Where the iterations of one fail, a Stepper of its own takes that step
// by Newton's iteration, in the general form after iterations that begin anew; a lane that none of these solves keeps
// its last good state and its status.
#ifndef LOBATTO_KERNEL_ENSEMBLE_HPP
#define LOBATTO_KERNEL_ENSEMBLE_HPP

#include <cstdint>
#include <type_traits>

#include "../base/contract.hpp"
#include "../base/pack.hpp"

namespace lobatto {

// Lane `lane` of coefficients side by side; both structures hold nothing but their number type.
template <class K, class T>
inline void set_coefficients(typename K::template CoefficientsOf<T>& all, int lane,
                             const typename K::Coefficients& one) {
    using real = typename K::real;
    if constexpr (!std::is_empty_v<typename K::Coefficients>) {
        constexpr int size = sizeof(one) / sizeof(real);
        static_assert(sizeof(all) == size * sizeof(T));
        const real* const from = reinterpret_cast<const real*>(&one);
        T* const to = reinterpret_cast<T*>(&all);
        for (int i = 0; i < size; ++i) set_lane(to[i], lane, from[i]);
    }
}

// Whether lanes can follow the motion: walls, switches and constraints are followed by one trajectory at a time.
template <class K>
constexpr bool is_for_lanes() {
    return K::constraints == 0 && K::impacts == 0 && K::switches == 0;
}

// How many of `trajectories` stand side by side: a register of each value; two, which hide each other's latency, where
// one or two coordinates leave room for them. None where the lanes serve a single step better.
template <class K>
constexpr int ensemble_lanes(int trajectories) {
    constexpr int native = native_lanes<typename K::real>;
    if (native == 1 || !K::any_number || K::clean || K::clocked || !is_for_lanes<K>()) return 0;
    if (K::neighbours) return K::is_explicit && K::immediate && trajectories >= native ? native : 0;
    if (K::form == Form::general) return K::coordinates > most_full ? 0 : native;
    return trajectories >= 2 * native && K::coordinates <= 2 ? 2 * native : native;
}

// The same for lanes that are refilled (steppers/refilled.hpp).
template <class K>
constexpr int refilled_lanes(int trajectories) {
    return K::neighbours ? 0 : ensemble_lanes<K>(trajectories);
}

// And of those with a clock (steppers/clocked_lanes.hpp): where steps are iterations over velocities.
template <class K>
constexpr int clocked_lanes() {
    constexpr int native = native_lanes<typename K::real>;
    const bool iterates = K::any_number && K::autonomous && !K::linear && K::constraints == 0;
    return native > 1 && iterates && K::coordinates <= most_full ? native : 0;
}
template <class K, int width>
struct ClockedEnsemble;

template <class K, int width>
struct Ensemble {
    static_assert(is_for_lanes<K>(), "walls, switches and constraints: take one stepper for each trajectory");

    using real = typename K::real;
    using T = Pack<real, width>;
    using ActiveMask = decltype(T() < T());
    static constexpr int n = K::coordinates, lanes = width;

    typename K::template CoefficientsOf<T> coefficients;
    LaneStepper<K, T> motion;
    typename K::Parameters parameters[width];
    typename K::Coefficients coefficients_of[width];
    mutable ScalarFallback<K> single;  // takes the steps of a lane that has left the others
    real step_size{}, start_time{};
    std::int64_t steps{};

    void prepare(const real* values, real h, Status* status) {
        step_size = h;
        for (int lane = 0; lane < width; ++lane) {
            for (int i = 0; i < K::parameter_count; ++i)
                K::parameter(parameters[lane], i) = values[lane * K::parameter_count + i];
            status[lane] = single.prepare(parameters[lane], h);
            coefficients_of[lane] = single.coefficients;
            set_coefficients<K>(coefficients, lane, single.coefficients);
            motion.prepare(single, lane);
        }
    }

    void start(real time, const real* q, const real* p, Status* status) {
        start_time = time;
        steps = 0;
        int started = -1;
        for (int lane = 0; lane < width; ++lane) {
            if (status[lane] != Status::ok) continue;
            status[lane] = start_lane(lane, lane, time, q, p);
            if (status[lane] == Status::ok) started = lane;
        }
        if (started < 0) return;
        // The others compute what one of these computes, so that no function has to leave its path for their numbers.
        for (int lane = 0; lane < width; ++lane)
            if (status[lane] != Status::ok) start_lane(lane, started, time, q, p);
    }

    // At most `count` steps of the lanes whose status is ok; `done` and `iterations` of each.
    void advance(std::int64_t count, real tolerance, Status* status, std::int64_t* done, std::int64_t* iterations) {
        motion.set_tolerance(tolerance);
        single.tolerance = tolerance;
        ActiveMask active = ActiveMask(false);
        for (int lane = 0; lane < width; ++lane) {
            active.set(lane, status[lane] == Status::ok);
            done[lane] = 0;
        }
        T evaluations = T(real(0));
        std::int64_t taken = 0;
        const auto leave = [&](int lane, Status why) {
            status[lane] = why;
            done[lane] = taken;
            active.set(lane, false);
        };
        for (; taken < count && any(active); ++taken, ++steps) {
            const real time = time_of(steps);
            if (time_of(steps + 1) == time) {
                for (int lane = 0; lane < width; ++lane)
                    if (active[lane]) leave(lane, Status::time_stands_still);
                break;
            }
            const ActiveMask moved = motion.step(coefficients, time, active);
            evaluations += motion.evaluations;
            if (any(active & !moved)) retry(active & !moved, time, evaluations, leave);
        }
        for (int lane = 0; lane < width; ++lane) {
            if (status[lane] == Status::ok) done[lane] = taken;
            iterations[lane] = static_cast<std::int64_t>(evaluations[lane]);
        }
    }

    void state(real* q, real* p) const {
        for (int lane = 0; lane < width; ++lane) state_of(lane, q + lane * n, p + lane * n);
    }

    void energy(real* energy) const {
        real q[n], p[n];
        for (int lane = 0; lane < width; ++lane) {
            state_of(lane, q, p);
            energy[lane] = real(0);
            single.energy(time_of(steps), q, p, energy + lane);
        }
    }

protected:
    real time_of(std::int64_t step) const { return start_time + real(step) * step_size; }

    // The state of a lane; `single` has its coefficients from then on.
    void state_of(int lane, real* q, real* p) const {
        single.coefficients = coefficients_of[lane];
        for (int c = 0; c < n; ++c) q[c] = lane_of(motion.positions()[c], lane);
        motion.momentum(single, lane, p);
    }

    // `lane` computes what lane `as` is given.
    Status start_lane(int lane, int as, real time, const real* q, const real* p) {
        const Status status = begin_alone(as, time, q + as * n, p + as * n);
        if (status != Status::ok) return status;
        set_coefficients<K>(coefficients, lane, coefficients_of[as]);
        motion.prepare(single, lane);
        motion.start(single, lane);
        return status;
    }

    Status begin_alone(int lane, real time, const real* q, const real* p) {
        const Status status = single.prepare(parameters[lane], step_size);
        return status == Status::ok ? single.start(time, q, p) : status;
    }
    // The same in the midst of a motion: one with a clock has what is known of its start among its parameters.
    Status go_on_alone(int lane, real time, const real* q, const real* p) {
        if constexpr (K::clocked) {
            const Status status = single.prepare(parameters[lane], step_size);
            return status == Status::ok ? single.start(time, q, p, single.known_of_start()) : status;
        } else {
            return begin_alone(lane, time, q, p);
        }
    }

    // What becomes of the lanes that a step has not moved.
    template <class Time, class Leave>
    [[gnu::noinline, gnu::cold]] void retry(ActiveMask left, const Time& time, T& evaluations, const Leave& leave) {
        // Fixed-point iterations of any Lagrangian that begin with the velocity alone solve many steps that those with
        // a memory do not.
        if constexpr (K::form == Form::general) {
            if (steps > 0) {
                for (int lane = 0; lane < width; ++lane)
                    if (left[lane]) start_anew(lane, lane_of(time, lane));
                left = left & !motion.step(coefficients, time, left);
                evaluations += motion.evaluations;
            }
        }
        for (int lane = 0; lane < width; ++lane) {
            if (!left[lane]) continue;
            const Status alone = step_alone(lane, lane_of(time, lane));
            if (alone != Status::ok) leave(lane, alone);
        }
    }

    // The lane forgets the steps before; its state stays.
    void start_anew(int lane, real time) {
        real q[n], p[n];
        state_of(lane, q, p);
        if (go_on_alone(lane, time, q, p) == Status::ok) motion.start(single, lane);
    }

    Status step_alone(int lane, real time) {
        real q[n], p[n];
        state_of(lane, q, p);
        Status status = go_on_alone(lane, time, q, p);
        if (status == Status::ok) status = single.step();
        if (status == Status::ok) motion.follow(single, lane);
        return status;
    }
};

}  // namespace lobatto

#endif
