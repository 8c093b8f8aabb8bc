// SPDX-License-Identifier: MIT
// What a switch does to the momentum where the Lagrangian jumps (D67).
//
// Of all paths across u(t, q) = 0 the action is stationary at the one whose momentum and energy jump along the slope of
// u, p+ = p + mu du/dq and H+ = H - mu du/dt: Snell's law, and the loss of speed on a step of the potential. Where no
// such momentum leads beyond, the motion is thrown back, as in total reflection.
#ifndef LOBATTO_KERNEL_REFRACTION_HPP
#define LOBATTO_KERNEL_REFRACTION_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "watched_stepper.hpp"

namespace lobatto {

// A place u(t, q) = 0 at which L may jump, near a state.
template <class K>
struct Surface {
    using real = typename K::real;
    static constexpr int n = K::coordinates;
    real slopes[K::refractions * n]{}, rates[K::refractions]{}, rate{};
    const real* slope{};  // du/dq; the rate is du/dt at fixed q

    Surface(const WatchedStepper<K>& stepper, int number, real time, const real* q) {
        Formulas<K>::refraction(stepper.coefficients, time, q, +slopes, +rates);
        slope = slopes + K::refraction_of[number] * n;
        rate = rates[K::refraction_of[number]];
    }
    Surface(const Surface&) = delete;

    real speed(const real* velocity) const {  // du/dt along the motion
        real sum = rate;
        for (int c = 0; c < n; ++c) sum += slope[c] * velocity[c];
        return sum;
    }
    // What a rounding of the time and of positions, or of their ways in a step, does to u.
    real rounding(real time, const real* q, const real* velocity, real step) const {
        real sum = fabs(rate) * maximum(fabs(time), fabs(step));
        for (int c = 0; c < n; ++c) {
            const real way = fabs(velocity[c] * step);
            sum += fabs(slope[c]) * maximum(fabs(q[c]), way);
        }
        return real(64) * Limits<real>::epsilon * sum;
    }
    bool is_parallel_to(const Surface& other) const {
        real own = rate * rate, others = other.rate * other.rate, both = rate * other.rate;
        for (int c = 0; c < n; ++c) {
            own += slope[c] * slope[c];
            others += other.slope[c] * other.slope[c];
            both += slope[c] * other.slope[c];
        }
        return fabs(own * others - both * both) <= Limits<real>::root_epsilon * own * others;
    }
};

// Of a state that lies on a switch, before the side changes.
template <class K>
class Refraction {
public:
    using real = typename K::real;
    using S = WatchedStepper<K>;
    static constexpr int n = K::coordinates;

    // `value`, `slack`: of all switches there. Those that vanish along the same surface change together.
    Refraction(S& at, int number, real t, const real* position, const real* momentum, const real* value,
               const real* slack)
        : stepper(at), surface(at, number, t, position), side(at.side(number)), time(t), q(position), p(momentum) {
        before = stepper.energy(time, q, p, &energy);
        real velocity[n];
        if (before == Status::ok) before = stepper.velocity(time, q, p, velocity);
        for (int i = 0; i < K::switches && before == Status::ok; ++i)
            changes[i] = i == number || (K::refraction_of[i] >= 0 && fabs(value[i]) <= slack[i] &&
                                         is_crossed_beside(Surface<K>(at, i, t, position), i, velocity, slack[i]));
    }

    // The momentum after it, and the side where the motion goes on.
    Status pass(real* result) {
        const real direction = -side;  // of du/dt along the motion
        if (before != Status::ok || !is_finite(energy)) return Status::not_finite;
        real normal = real(0), square = real(0);
        for (int c = 0; c < n; ++c) {
            normal += p[c] * surface.slope[c];
            square += surface.slope[c] * surface.slope[c];
        }
        least = fabs(normal) > real(0) ? fabs(normal) / square * Limits<real>::root_epsilon : Limits<real>::epsilon;
        Trial trial = at(real(0));
        size = fabs(energy);
        for (int c = 0; c < n; ++c) size += fabs(p[c] * trial.velocity[c]);
        change_side();
        trial = at(real(0));
        if (!(trial.is_known && fabs(trial.excess) <= few * size)) {
            // Beyond it the momentum may have no velocity, but the one along the switch alone.
            if (!trial.is_known) trial = at(-normal / square);
            if (!solve(trial, direction) && !search(trial, direction)) {
                change_side();
                trial = at(real(0));
                if (!search(trial, -direction)) return Status::not_converged;
            }
        }
        for (int c = 0; c < n; ++c) result[c] = trial.p[c];
        return Status::ok;
    }

private:
    static constexpr real few = real(64) * Limits<real>::epsilon;
    static constexpr int most_iterations = 200;

    // Momentum p + mu du/dq on the present side: by how much H + mu du/dt is larger than before, and its slope in mu,
    // which is du/dt along the motion.
    struct Trial {
        real mu{}, p[n]{}, velocity[n]{}, excess{}, speed{};
        bool is_known{};
    };
    Trial at(real mu) {
        Trial trial;
        trial.mu = mu;
        for (int c = 0; c < n; ++c) trial.p[c] = p[c] + mu * surface.slope[c];
        real here{};
        Status status = stepper.velocity(time, q, trial.p, trial.velocity);
        if (K::constraints > 0 && status == Status::ok) stepper.momentum(time, q, trial.velocity, trial.p);
        if (status == Status::ok) status = stepper.energy(time, q, trial.p, &here);
        trial.excess = here - energy + mu * surface.rate;
        trial.speed = surface.speed(trial.velocity);
        trial.is_known = status == Status::ok && is_finite(trial.excess) && is_finite(trial.speed);
        return trial;
    }

    // Newton's method for an excess of 0. H is convex in p: from where the speed has this direction it comes nearer
    // from one side, or the speed changes its sign, and there is no zero.
    bool solve(Trial& trial, real direction) {
        const Trial first = trial;
        if (converges(trial, direction)) return true;
        trial = first;
        return false;
    }
    bool converges(Trial& trial, real direction) {
        for (int i = 0; i < most_iterations; ++i) {
            if (!trial.is_known || !(trial.speed * direction > real(0))) return false;
            if (fabs(trial.excess) <= Limits<real>::epsilon * size) return true;
            real step = -trial.excess / trial.speed;
            Trial next = at(trial.mu + step);
            for (int halves = 0; !next.is_known && halves < most_iterations; ++halves)
                next = at(trial.mu + (step *= real(0.5)));
            const bool is_rounding = fabs(trial.excess) <= few * size && !(fabs(next.excess) < fabs(trial.excess));
            if (is_rounding || next.mu == trial.mu) return true;
            trial = next;
        }
        return false;
    }

    // From a place that is known, in this direction, to where the excess is not below 0 and the speed is right; where
    // the momentum has no velocity any more, between the last two places.
    bool search(Trial& trial, real direction) {
        if (!trial.is_known) return false;
        const real begin = trial.mu;
        real inside = begin, outside{}, length = least;
        bool is_bounded = false;
        for (int i = 0; i < most_iterations; ++i) {
            const real mu = is_bounded ? real(0.5) * (inside + outside) : begin + direction * length;
            if (is_bounded && (mu == inside || mu == outside)) return false;
            trial = at(mu);
            if (!trial.is_known) {
                outside = mu;
                is_bounded = true;
            } else if (trial.speed * direction > real(0) && trial.excess >= real(0)) {
                return solve(trial, direction);
            } else {
                inside = mu;
                length *= real(2);
            }
        }
        return false;
    }

    // Whether the motion crosses another surface in the same place; it may touch one there.
    bool is_crossed_beside(const Surface<K>& other, int i, const real* velocity, real slack) const {
        const real towards = -other.speed(velocity) * stepper.side(i);
        return towards * fabs(stepper.step_size) > slack && surface.is_parallel_to(other);
    }

    void change_side() {
        for (int i = 0; i < K::switches; ++i)
            if (changes[i]) stepper.side(i) = -stepper.side(i);
        K::prepare(stepper.parameters, stepper.step_size, stepper.coefficients);
    }

    S& stepper;
    const Surface<K> surface;
    const real side;
    bool changes[K::switches]{};
    real time;
    const real *q, *p;
    real energy{}, size{}, least{};
    Status before{};
};

}  // namespace lobatto

#endif
