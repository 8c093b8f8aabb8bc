// SPDX-License-Identifier: MIT
// Walls: what they are at a state, and what they do to a momentum there (D52).
//
// A wall is g(t, q) = 0, and the motion is on one side of it. Where it meets the wall the momentum jumps along dg/dq.
// (R. C. Fetecau, J. E. Marsden, M. Ortiz, M. West 2003.) Some let the motion pass, with a new state, as a kick does.
#ifndef LOBATTO_KERNEL_WALLS_HPP
#define LOBATTO_KERNEL_WALLS_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "watched_stepper.hpp"

namespace lobatto {

// At a state: the walls of K, what they are there, and what they do.
template <class K>
struct Walls {
    using real = typename K::real;
    using S = WatchedStepper<K>;
    static constexpr int n = K::coordinates, impacts = K::impacts, count = S::walls, first = K::events - count;
    static constexpr int room = impacts > 0 ? impacts : 1;
    static constexpr real few = real(64) * Limits<real>::epsilon;

    real time{}, q[n]{}, p[n]{}, velocity[n]{};
    real value[K::events]{};                  // of all that is watched
    real gradient[room * n]{}, rate[room]{};  // of impacts: dg/dq, and dg/dt at fixed q
    real restitution[room]{}, slow[room]{};   // slow: a speed; the motion that leaves a wall more slowly ends there
    real slack[count]{};                      // g as small as this is zero
    real along[room]{};                       // dg/dt along the motion, where it is above rounding
    real approach[room]{};                    // the same, below 0 towards the wall

    // Everything at (t, q, p) of a stepper.
    Status look(S& stepper, real t, const real* position, const real* momentum) {
        time = t;
        for (int k = 0; k < n; ++k) {
            q[k] = position[k];
            p[k] = momentum[k];
        }
        const Status status = stepper.velocity(time, q, p, velocity);
        if (status != Status::ok) return status;
        const auto& k = stepper.coefficients;
        Formulas<K>::event(k, time, q, velocity, value);
        if constexpr (impacts > 0) look_at_impacts(stepper);
        for (int w = 0; w < count; ++w) {
            real& scale = stepper.wall_scale[w];
            if (w >= impacts) scale = maximum(fabs(value[first + w]), scale);
            slack[w] = few * scale;
        }
        return Status::ok;
    }

    // The sign of g where the motion is.
    static real side(S& stepper, int w) {
        if (passes(w)) return stepper.passage_side[w];
        return w < impacts ? real(-K::event_direction[first + w]) : stepper.side(w - impacts);
    }
    static bool passes(int w) {
        if constexpr (K::passages > 0) return w < impacts && K::passage_of[w] != 0;
        return false;
    }
    // Whether a crossing that leads away from this side gives the motion a new state.
    static bool acts(int w, real from) {
        if constexpr (K::passages > 0) return K::passage_of[w] == 2 || real(K::passage_of[w]) * from < real(0);
        return true;
    }
    // On which side of each passage the motion is; of one where it is right there, from which it comes.
    void begin_passages(S& stepper) const {
        for (int w = 0; w < impacts; ++w)
            if (passes(w)) set_passage(stepper, w, -beyond(w));
    }
    // On which side of this passage it goes on.
    void go_beyond(S& stepper, int w) const { set_passage(stepper, w, beyond(w)); }
    bool is_behind(int w) const { return value[first + w] * real(-K::event_direction[first + w]) < -slack[w]; }
    bool is_behind() const {  // of one of the impacts
        for (int w = 0; w < impacts; ++w)
            if (is_behind(w)) return true;
        return false;
    }
    bool comes_to_rest(int w) const { return fabs(approach[w]) < slow[w]; }
    bool is_met(int w) const { return !passes(w) && fabs(value[first + w]) <= slack[w] && approach[w] < real(0); }

    // (D52) What wall w does to the momentum.
    Status hit(S& stepper, int w) {
        if (K::reset_of[w] >= 0) return reset(stepper, K::reset_of[w]);
        real change[n], mobility;
        const Status status = push(stepper, w, change, mobility);
        if (status != Status::ok) return status;
        const real impulse = -(real(1) + restitution[w]) * approach[w] * side(stepper, w) / mobility;
        if (!is_finite(impulse)) return Status::not_finite;
        if constexpr (K::constraints > 0) {
            for (int c = 0; c < n; ++c) velocity[c] += impulse * change[c];
            stepper.momentum(time, q, velocity, p);
        } else {
            for (int c = 0; c < n; ++c) p[c] += impulse * gradient[w * n + c];
        }
        return look(stepper, time, q, p);
    }

    // A motion may leave a body behind a wall by what a rounding of the largest coordinate does to g. Such a depth is
    // zero from then on. The metric of the kinetic energy makes one unit of all coordinates: g grows by sqrt(dq M dq)
    // sqrt(dg/dq M^-1 dg/dq) at most; where masses are far apart that is too much, and |dg/dq| |dq| counts.
    void forgive_rounding(S& stepper) {
        const real h = stepper.step_size;
        real still[n] = {}, rest[n], moved[n], size = real(0), farthest = real(0), change[n], mobility;
        stepper.momentum(time, q, still, rest);
        stepper.momentum(time, q, q, moved);
        for (int c = 0; c < n; ++c) {
            size += q[c] * (moved[c] - rest[c]) + h * h * velocity[c] * (p[c] - rest[c]);
            farthest = maximum(fabs(h * velocity[c]), maximum(fabs(q[c]), farthest));
        }
        for (int w = 0; w < impacts; ++w) {
            const real depth = fabs(value[first + w]);
            if (!is_behind(w) || push(stepper, w, change, mobility) != Status::ok) continue;
            real slope = real(0);
            for (int c = 0; c < n; ++c) slope += fabs(gradient[w * n + c]);
            if (depth <= few * sqrt(size * mobility) && depth <= few * slope * farthest)
                stepper.wall_scale[w] = (real(1) + few) * depth / few;
        }
    }

    // Positions and velocities as the scene gives them.
    Status reset(S& stepper, int r) {
        if constexpr (K::resets > 0) {
            real positions[K::resets * n], velocities[K::resets * n];
            Formulas<K>::reset(stepper.coefficients, time, q, velocity, positions, velocities);
            cross_switches(stepper, positions + r * n, velocities + r * n);
            stepper.momentum(time, positions + r * n, velocities + r * n, p);
            return look(stepper, time, positions + r * n, p);
        }
        (void)stepper, (void)r;
        return Status::unsupported;
    }

private:
    real beyond(int w) const { return along[w] != real(0) ? along[w] : value[first + w]; }
    // `there`: the sign where the motion is right there.
    void set_passage(S& stepper, int w, real there) const {
        const real sign = fabs(value[first + w]) > slack[w] ? value[first + w] : there;
        stepper.passage_side[w] = sign < real(0) ? real(-1) : real(1);
    }
    // The sides of a state to which the motion has jumped; where it lies on a switch, as before. A switch may hold the
    // sides of those before it.
    void cross_switches(S& stepper, const real* position, const real* speed) {
        for (int tries = 0; tries < K::switches; ++tries) {
            bool crosses = false;
            Formulas<K>::event(stepper.coefficients, time, position, speed, value);
            for (int i = 0; i < K::switches; ++i) {
                const real there = value[first + impacts + i] * stepper.side(i);
                if (!(there < -slack[impacts + i])) continue;
                stepper.side(i) = -stepper.side(i);
                crosses = true;
            }
            if (!crosses) return;
            K::prepare(stepper.parameters, stepper.step_size, stepper.coefficients);
        }
    }
    // An impulse of dg/dq on the motion at rest: the velocity that it gives, and dg/dt.
    Status push(S& stepper, int w, real* change, real& mobility) {
        real still[n] = {}, rest[n], pushed[n], without[n];
        stepper.momentum(time, q, still, rest);
        for (int c = 0; c < n; ++c) pushed[c] = rest[c] + gradient[w * n + c];
        Status status = stepper.velocity(time, q, rest, without);
        if (status == Status::ok) status = stepper.velocity(time, q, pushed, change);
        if (status != Status::ok) return status;
        mobility = real(0);
        for (int c = 0; c < n; ++c) {
            change[c] -= without[c];
            mobility += gradient[w * n + c] * change[c];
        }
        return Status::ok;
    }

    void look_at_impacts(S& stepper) {
        Formulas<K>::impact(stepper.coefficients, time, q, gradient, rate, restitution, slow);
        for (int w = 0; w < impacts; ++w) {
            const real step = fabs(stepper.step_size), passed = maximum(fabs(time), step);
            real sum = rate[w], speed = fabs(rate[w]), moved = speed * passed;
            for (int c = 0; c < n; ++c) {
                const real slope = gradient[w * n + c], way = fabs(velocity[c] * stepper.step_size);
                sum += slope * velocity[c];
                speed += fabs(slope * velocity[c]);
                moved += fabs(slope) * maximum(fabs(q[c]), way);
            }
            stepper.wall_scale[w] = maximum(moved, stepper.wall_scale[w]);
            along[w] = fabs(sum) <= few * speed ? real(0) : sum;
            approach[w] = along[w] * side(stepper, w);
        }
    }
};

}  // namespace lobatto

#endif
