// SPDX-License-Identifier: MIT
// A stepper whose motion is watched: states between its steps, and what is known of its events and walls.
//
// K::events functions are watched: first events, then the K::stops, which end the motion, then walls (walls.hpp). The
// motion stays on one side of a wall until it meets it; a value that is only rounding counts as zero. K::impacts walls
// throw the motion back. The last K::switches walls change its formulas; their sides, 1 or -1, are the last parameters.
// impact(k, q, G, g_t, e, rest) gives dg/dq, dg/dt at fixed q and the restitution of each wall w, and the speed below
// which the motion comes to rest there and ends. If reset_of[w] >= 0, reset(k, q, velocity, q1, velocity1) gives the
// state after it, that one of the K::resets. If passage_of[w] is not 0, the motion passes: its reset is for crossings
// with g rising (1), falling (-1) or both (2). K::passages is how many these are.
#ifndef LOBATTO_KERNEL_WATCHED_STEPPER_HPP
#define LOBATTO_KERNEL_WATCHED_STEPPER_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"

namespace lobatto {

template <class K>
struct Between {
    using real = typename K::real;
    using S = Stepper<K>;
    static constexpr int n = K::coordinates, columns = 1 + 2 * n;

    static real time(const S& stepper, real theta) {
        if constexpr (K::clocked)
            return stepper.time_within(theta);
        else
            return stepper.start_time + (real(stepper.steps - 1) + theta) * stepper.step_size;
    }

    // t, q[n], p[n] at t + theta h of the last step.
    static void row(const S& stepper, real theta, real* row) {
        real velocity[n];
        row[0] = time(stepper, theta);
        stepper.polynomial(theta, row + 1, velocity);
        stepper.momentum(row[0], row + 1, velocity, row + 1 + n);
        if constexpr (K::form == Form::general) {  // conserved exactly
            for (int c = 0; c < K::cyclic; ++c) row[1 + n + K::cyclic_index[c]] = stepper.p[K::cyclic_index[c]];
        }
    }
};

// A stepper that knows its parameters, for steps of other lengths.
template <class K>
struct WatchedStepper : Stepper<K> {
    using real = typename K::real;
    typename K::Parameters parameters{};
    static constexpr int walls = K::impacts + K::switches, wall_room = walls > 0 ? walls : 1;
    real wall_scale[wall_room]{};              // the most that went into each wall's function so far
    real scaled_at[1 + 2 * K::coordinates]{};  // the time, positions and velocities, as large, that this is known of
    real passage_side[wall_room]{};            // of walls that let the motion pass: the sign of g where it is

    // At a state at one of its own times.
    Status restart(const real* position, const real* momentum, std::int64_t steps_since) {
        const real begin = this->start_time;
        this->steps = steps_since;
        const Status status = this->start(this->time(), position, momentum);
        this->start_time = begin;
        this->steps = steps_since;
        for (bool& begins : this->event_begins) begins = true;
        return status;
    }

    // The side of a switch: 1 or -1.
    real& side(int number) { return K::parameter(parameters, K::parameter_count - K::switches + number); }
};

// What was last known of the events of a motion that goes on in another stepper, or in this one after a restart.
template <class S>
struct KnownEvents {
    typename S::real values[S::event_room];
    bool begins[S::event_room];

    explicit KnownEvents(const S& stepper) {
        for (int e = 0; e < S::event_room; ++e) {
            values[e] = stepper.event_values[e];
            begins[e] = stepper.event_begins[e];
        }
    }
    // In a stepper that has just started: it goes on with the motion.
    void continue_in(S& stepper) const {
        put(stepper);
        stepper.events_go_on = true;
    }
    void put(S& stepper) const {
        for (int e = 0; e < S::event_room; ++e) {
            stepper.event_values[e] = values[e];
            stepper.event_begins[e] = begins[e];
        }
    }
};

}  // namespace lobatto

#endif
