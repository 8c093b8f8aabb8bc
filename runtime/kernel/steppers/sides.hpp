// SPDX-License-Identifier: MIT
// On which side of its walls and switches a motion is: at its start, and after a change of inputs.
//
// A switch is a wall that lets the motion through, and changes the formulas beyond it.
#ifndef LOBATTO_KERNEL_SIDES_HPP
#define LOBATTO_KERNEL_SIDES_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "refraction.hpp"
#include "walls.hpp"

namespace lobatto {

// On which side of walls and switches a stepper is.
template <class K>
struct Sides {
    using real = typename K::real;
    using S = WatchedStepper<K>;
    static constexpr int n = K::coordinates;

    // Of each switch where a state is; at a place where L jumps, the one from which the motion comes. A switch may hold
    // the sides of those before it.
    static void take_at(S& stepper, real time, const real* q, const real* velocity) {
        for (int tries = 0; tries <= K::switches; ++tries) {
            bool changes = tries == 0;
            real values[K::events];
            Formulas<K>::event(stepper.coefficients, time, q, velocity, values);
            for (int i = 0; i < K::switches; ++i) {
                real value = values[K::events - K::switches + i];
                if constexpr (K::refractions > 0) value = where_it_comes_from(stepper, i, value, time, q, velocity);
                const real side = value > real(0) ? real(1) : real(-1);
                changes = changes || side != stepper.side(i);
                stepper.side(i) = side;
            }
            if (!changes) return;
            stepper.prepare(stepper.parameters, stepper.step_size);
        }
    }
    static real where_it_comes_from(const S& stepper, int number, real u, real time, const real* q,
                                    const real* velocity) {
        if (K::refraction_of[number] < 0) return u;
        const Surface<K> surface(stepper, number, time, q);
        const real speed = surface.speed(velocity);
        return fabs(u) <= surface.rounding(time, q, velocity, stepper.step_size) && speed != real(0) ? -speed : u;
    }
    // The velocity is that of the sides so far.
    static void take(S& stepper, real time, const real* q, const real* p) {
        if constexpr (K::switches > 0) {
            real velocity[n];
            if (stepper.velocity(time, q, p, velocity) == Status::ok) take_at(stepper, time, q, velocity);
        }
    }
    // Whether a state is where the motion may be.
    static Status of_walls(S& stepper, real time, const real* q, const real* p) {
        Walls<K> wall;
        for (real& scale : stepper.wall_scale) scale = real(0);
        for (real& size : stepper.scaled_at) size = real(0);
        if constexpr (K::switches > 0) scale_switches(stepper, time, q, p);
        Status status = wall.look(stepper, time, q, p);
        wall.begin_passages(stepper);
        if (status == Status::ok && wall.is_behind()) {
            wall.forgive_rounding(stepper);
            status = wall.look(stepper, time, q, p);
            if (status == Status::ok && wall.is_behind()) return Status::off_constraints;
        }
        return status;
    }
    // sum |du/dx x| over the time, positions and velocities: what a rounding of these does to a switch u, over epsilon.
    // Where that is known of an earlier place, anew if one of them has grown to more than twice of what it was there;
    // or `again`, because the slopes were small there, as where u is largest.
    static void scale_switches(S& stepper, real time, const real* q, const real* p, bool again = false) {
        real x[1 + 2 * n] = {time}, here[K::events], there[K::events], scale[K::switches] = {};
        for (int k = 0; k < n; ++k) x[1 + k] = q[k];
        if (stepper.velocity(time, q, p, x + 1 + n) != Status::ok) return;
        bool has_grown = false;
        for (int k = 0; k <= 2 * n; ++k) has_grown = has_grown || fabs(x[k]) > real(2) * stepper.scaled_at[k];
        if (!has_grown && !again) return;
        for (int k = 0; k <= 2 * n; ++k) stepper.scaled_at[k] = fabs(x[k]);
        Formulas<K>::event(stepper.coefficients, x[0], x + 1, x + 1 + n, here);
        for (real& moved : x) {
            const real kept = moved;
            moved += Limits<real>::root_epsilon * moved;
            Formulas<K>::event(stepper.coefficients, x[0], x + 1, x + 1 + n, there);
            moved = kept;
            for (int i = 0; i < K::switches; ++i) {
                const real change = fabs(there[K::events - K::switches + i] - here[K::events - K::switches + i]);
                if (is_finite(change)) scale[i] += change / Limits<real>::root_epsilon;
            }
        }
        for (int i = 0; i < K::switches; ++i)
            stepper.wall_scale[K::impacts + i] = maximum(scale[i], stepper.wall_scale[K::impacts + i]);
    }
    static Status start(S& stepper, real time, const real* q, const real* p) {
        take(stepper, time, q, p);
        const Status status = stepper.start(time, q, p);
        return status == Status::ok ? of_walls(stepper, time, q, p) : status;
    }
    // After a change of formulas, where the motion is.
    static Status take_again(S& stepper) {
        const real time = stepper.time();
        real q[n], p[n];
        for (int k = 0; k < n; ++k) q[k] = stepper.q[k];
        stepper.momentum(p);
        if constexpr (K::switches > 0) {
            take(stepper, time, q, p);
            const KnownEvents<S> known(stepper);
            const Status status = stepper.restart(q, p, stepper.steps);
            if (status != Status::ok) return status;
            known.put(stepper);
        }
        return of_walls(stepper, time, q, p);
    }
};

// (D60) As set_inputs (inputs.hpp) of a stepper that knows its parameters. The sides of switches are those of the
// state. Refused values change nothing.
template <class K>
Status set_watched_inputs(WatchedStepper<K>& stepper, typename K::Parameters values) {
    const auto* const before = new WatchedStepper<K>(stepper);  // of megabytes, in large systems
    for (int i = K::first_input; i < K::first_input + K::inputs; ++i)
        K::parameter(stepper.parameters, i) = K::parameter(values, i);
    Status status = set_inputs(stepper, stepper.parameters);
    if constexpr (WatchedStepper<K>::walls > 0)
        if (status == Status::ok) status = Sides<K>::take_again(stepper);
    if (status != Status::ok) stepper = *before;
    delete before;
    return status;
}

}  // namespace lobatto

#endif
