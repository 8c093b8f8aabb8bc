// SPDX-License-Identifier: MIT
// What is looked for in each step: events, impacts, and where the motion is to stop.
//
// A wall is g(t, q) = 0, and the motion is on one side of it. A step that meets it is cut there, at the end of a step
// of the same method; the momentum jumps along dg/dq (D52), and a step of the rest of h leads back to the times of the
// run. So a step with impacts is one from t to t + h like any other, and of the method's order. (R. C. Fetecau, J. E.
// Marsden, M. Ortiz, M. West 2003.)
// A switch is a wall that lets the motion through, and changes the formulas beyond it.
#ifndef LOBATTO_KERNEL_IMPACTS_HPP
#define LOBATTO_KERNEL_IMPACTS_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "events.hpp"

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
    real restitution[room]{};
    real slack[count]{};    // g as small as this is zero
    real approach[room]{};  // dg/dt along the motion, where it is above rounding; below 0: towards the wall

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
            if (w >= impacts && fabs(value[first + w]) > scale) scale = fabs(value[first + w]);
            slack[w] = few * scale;
        }
        return Status::ok;
    }

    // The sign of g where the motion is.
    static real side(S& stepper, int w) {
        return w < impacts ? real(-K::event_direction[first + w]) : stepper.side(w - impacts);
    }
    bool is_behind(int w) const { return value[first + w] * real(-K::event_direction[first + w]) < -slack[w]; }
    bool is_behind() const {  // of one of the impacts
        for (int w = 0; w < impacts; ++w)
            if (is_behind(w)) return true;
        return false;
    }
    bool is_met(int w) const { return fabs(value[first + w]) <= slack[w] && approach[w] < real(0); }

    // (D52) What wall w does to the momentum.
    Status hit(S& stepper, int w) {
        if (K::reset_of[w] >= 0) return reset(stepper, K::reset_of[w]);
        real change[n], mobility;
        const Status status = push(stepper, w, change, mobility);
        if (status != Status::ok) return status;
        const real impulse = -(real(1) + restitution[w]) * approach[w] * side(stepper, w) / mobility;
        if (!is_finite(impulse)) return Status::not_finite;
        if constexpr (constraints_of<K>() > 0) {
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
            for (const real far : {fabs(q[c]), fabs(h * velocity[c])}) farthest = far > farthest ? far : farthest;
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
            stepper.momentum(time, positions + r * n, velocities + r * n, p);
            return look(stepper, time, positions + r * n, p);
        }
        (void)stepper, (void)r;
        return Status::unsupported;
    }

private:
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
        Formulas<K>::impact(stepper.coefficients, time, q, gradient, rate, restitution);
        for (int w = 0; w < impacts; ++w) {
            const real step = fabs(stepper.step_size), passed = fabs(time) > step ? fabs(time) : step;
            real along = rate[w], speed = fabs(rate[w]), moved = speed * passed;
            for (int c = 0; c < n; ++c) {
                const real slope = gradient[w * n + c], way = fabs(velocity[c] * stepper.step_size);
                along += slope * velocity[c];
                speed += fabs(slope * velocity[c]);
                moved += fabs(slope) * (fabs(q[c]) > way ? fabs(q[c]) : way);
            }
            if (moved > stepper.wall_scale[w]) stepper.wall_scale[w] = moved;
            approach[w] = fabs(along) <= few * speed ? real(0) : along * side(stepper, w);
        }
    }
};

// On which side of walls and switches a stepper is.
template <class K>
struct Sides {
    using real = typename K::real;
    using S = WatchedStepper<K>;
    static constexpr int n = K::coordinates;

    // Of each switch where a state is.
    static void take_at(S& stepper, real time, const real* q, const real* velocity) {
        if constexpr (switches_of<K>() > 0) {
            real values[K::events];
            Formulas<K>::event(stepper.coefficients, time, q, velocity, values);
            for (int i = 0; i < switches_of<K>(); ++i)
                stepper.side(i) = values[K::events - switches_of<K>() + i] > real(0) ? real(1) : real(-1);
            stepper.prepare(stepper.parameters, stepper.step_size);
        }
    }
    // The velocity is that of the sides so far.
    static void take(S& stepper, real time, const real* q, const real* p) {
        if constexpr (switches_of<K>() > 0) {
            real velocity[n];
            if (stepper.velocity(time, q, p, velocity) == Status::ok) take_at(stepper, time, q, velocity);
        }
    }
    // Whether a state is where the motion may be.
    static Status of_walls(S& stepper, real time, const real* q, const real* p) {
        Walls<K> wall;
        for (real& scale : stepper.wall_scale) scale = real(0);
        for (real& size : stepper.scaled_at) size = real(0);
        if constexpr (switches_of<K>() > 0) scale_switches(stepper, time, q, p);
        Status status = wall.look(stepper, time, q, p);
        if (status == Status::ok && wall.is_behind()) {
            wall.forgive_rounding(stepper);
            status = wall.look(stepper, time, q, p);
            if (status == Status::ok && wall.is_behind()) return Status::off_constraints;
        }
        return status;
    }
    // sum |du/dx x| over the time, positions and velocities: what a rounding of these does to a switch u, over epsilon.
    // Where that is known of an earlier place, anew if one of them has grown to more than twice of what it was there.
    static void scale_switches(S& stepper, real time, const real* q, const real* p) {
        real x[1 + 2 * n] = {time}, here[K::events], there[K::events], scale[switches_of<K>()] = {};
        for (int k = 0; k < n; ++k) x[1 + k] = q[k];
        if (stepper.velocity(time, q, p, x + 1 + n) != Status::ok) return;
        bool has_grown = false;
        for (int k = 0; k <= 2 * n; ++k) has_grown = has_grown || fabs(x[k]) > real(2) * stepper.scaled_at[k];
        if (!has_grown) return;
        for (int k = 0; k <= 2 * n; ++k) stepper.scaled_at[k] = fabs(x[k]);
        Formulas<K>::event(stepper.coefficients, x[0], x + 1, x + 1 + n, here);
        for (real& moved : x) {
            const real kept = moved;
            moved += Limits<real>::root_epsilon * moved;
            Formulas<K>::event(stepper.coefficients, x[0], x + 1, x + 1 + n, there);
            moved = kept;
            for (int i = 0; i < switches_of<K>(); ++i) {
                const real change =
                    fabs(there[K::events - switches_of<K>() + i] - here[K::events - switches_of<K>() + i]);
                if (is_finite(change)) scale[i] += change / Limits<real>::root_epsilon;
            }
        }
        for (int i = 0; i < switches_of<K>(); ++i)
            if (scale[i] > stepper.wall_scale[impacts_of<K>() + i]) stepper.wall_scale[impacts_of<K>() + i] = scale[i];
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
        if constexpr (switches_of<K>() > 0) {
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

// Looks at each step of one stepper: keep before it, look after it.
template <class K>
class Watch {
public:
    using real = typename K::real;
    using S = WatchedStepper<K>;
    static constexpr int n = K::coordinates, columns = Events<K>::columns;
    static constexpr int walls = S::walls, first_wall = K::events - walls, stops = stops_of<K>();
    static constexpr int most_impacts = walls > 0 ? 100 : 0;                             // in one step
    static constexpr int most = Events<K>::most + most_impacts * (1 + Events<K>::most);  // rows of one step

    // Of the last step: when walls and switches cut it.
    real cut_at[most_impacts + 1]{};
    int cuts{};

    explicit Watch(const S& stepper) : events(stepper), rest(walls > 0 ? new S(stepper) : nullptr) {}
    Watch(const Watch&) = delete;
    Watch& operator=(const Watch&) = delete;
    ~Watch() { delete rest; }

    void keep(const S& stepper) {
        events.keep(stepper);
        if constexpr (walls > 0) {
            time = stepper.time();
            parameters = stepper.parameters;
            for (int k = 0; k < n; ++k) q[k] = stepper.q[k];
            stepper.momentum(p);
        }
    }

    // Adds rows of event number, t, q[n], p[n] of the step taken since keep, in the order of the motion; of an impact
    // the state after it. Without rows none are sought, and the motion does not stop. Status::stopped: the last row
    // says where and why. Where walls fail, the stepper is where it was before the step.
    Status look(S& stepper, real* rows, std::int64_t& count) {
        const std::int64_t before = count;
        Status status = Status::ok;
        if constexpr (walls > 0) {
            status = look_with_walls(stepper, rows, count);
            if (status != Status::ok) go_back(stepper);
        } else if (rows != nullptr) {
            status = find(stepper, real(1), Cut::none, rows, count);
        }
        if (status != Status::ok && status != Status::stopped) count = before;  // the step was not taken
        return status;
    }

private:
    Events<K> events;
    S* rest;  // the steps from an impact to the end
    real time{}, q[n]{}, p[n]{};
    typename K::Parameters parameters{};
    int impacts{};  // of this step

    // Events and stops until theta.
    Status find(S& stepper, real until, Cut cut, real* rows, std::int64_t& count) {
        Status status = events.find(stepper, 0, first_wall, until, cut);
        for (int i = 0; i < events.found && status == Status::ok; ++i) {
            real* const row = rows + count * columns;
            row[0] = real(events.numbers[i]);
            status = events.state(events.thetas[i], row + 1);
            if (status != Status::ok) break;
            ++count;
            if (events.numbers[i] >= first_wall - stops) return Status::stopped;
        }
        return status;
    }

    void go_back(S& stepper) {
        stepper.parameters = parameters;
        put(stepper, q, p, stepper.steps - 1);
    }
    // A state at one of the stepper's own times, with its parameters.
    static void put(S& stepper, const real* position, const real* momentum, std::int64_t steps) {
        if constexpr (switches_of<K>() > 0) stepper.prepare(stepper.parameters, stepper.step_size);
        stepper.restart(position, momentum, steps);
    }

    Status look_with_walls(S& stepper, real* rows, std::int64_t& count) {
        const real end = stepper.time();
        Walls<K> wall;
        Status status = wall.look(stepper, time, q, p);
        S* step = &stepper;
        impacts = cuts = 0;
        while (status == Status::ok) {
            for (int w = 0; w < walls; ++w) {
                events.slack[w] = wall.slack[w];
                events.sides[w] = Walls<K>::side(stepper, w);
            }
            status = events.find(*step, first_wall, K::events, real(1));
            if (status != Status::ok) break;
            const bool is_hit = events.found > 0;
            const real theta = is_hit ? events.thetas[0] : real(1);
            const int number = is_hit ? events.numbers[0] : -1;
            const Cut cut = !is_hit ? Cut::none : number - first_wall < impacts_of<K>() ? Cut::impact : Cut::passage;
            if (rows != nullptr) {
                status = find(*step, theta, cut, rows, count);
                if (status != Status::ok) break;
            }
            if (!is_hit) break;
            const KnownEvents<S> known(*step);
            real row[1 + 2 * n];
            status = events.state(theta, row);
            if constexpr (switches_of<K>() > 0)
                if (status == Status::ok) Sides<K>::scale_switches(stepper, row[0], row + 1, row + 1 + n);
            if (status == Status::ok) status = wall.look(stepper, row[0], row + 1, row + 1 + n);
            if (status == Status::ok) status = pass(stepper, wall, number - first_wall, rows, count);
            if (status != Status::ok) break;
            cut_at[cuts++] = wall.time;
            const real left = end - wall.time;
            step = rest;
            if (!(left * stepper.step_size > real(0)) || wall.time + left == wall.time) {
                put(stepper, wall.q, wall.p, stepper.steps);
                if (cut == Cut::passage) known.put(stepper);
                return Status::ok;
            }
            status = take_rest(stepper, wall, left, cut == Cut::passage ? &known : nullptr);
        }
        if (status == Status::ok && step == rest) finish(stepper);
        return status;
    }

    // Through a switch, or back from walls.
    Status pass(S& stepper, Walls<K>& wall, int number, real* rows, std::int64_t& count) {
        if constexpr (impacts_of<K>() > 0) {
            if (number < impacts_of<K>()) return meet(stepper, wall, number, rows, count);
        }
        (void)wall, (void)rows, (void)count;
        if (++impacts > most_impacts) return Status::impacts_accumulate;
        real& side = stepper.side(number - impacts_of<K>());
        side = -side;
        return K::prepare(stepper.parameters, stepper.step_size, stepper.coefficients);
    }

    // All walls that are met there, one after another, until none is.
    Status meet(S& stepper, Walls<K>& wall, int first, real* rows, std::int64_t& count) {
        for (bool is_first = true;; is_first = false) {
            int met = is_first && K::reset_of[first] >= 0 ? first : -1;
            for (int w = 0; w < impacts_of<K>() && met < 0; ++w)
                if (wall.is_met(w) || (is_first && w == first && wall.approach[w] < real(0))) met = w;
            if (met < 0) return is_first ? Status::impacts_accumulate : Status::ok;
            if (++impacts > most_impacts) return Status::impacts_accumulate;
            const Status status = wall.hit(stepper, met);
            if (status != Status::ok) return status;
            if (rows == nullptr) continue;
            real* const row = rows + count++ * columns;
            row[0] = real(first_wall + met);
            row[1] = wall.time;
            for (int k = 0; k < n; ++k) {
                row[2 + k] = wall.q[k];
                row[2 + n + k] = wall.p[k];
            }
        }
    }

    // `known`: of the events of a motion that goes on.
    Status take_rest(S& stepper, const Walls<K>& wall, real left, const KnownEvents<S>* known) {
        rest->parameters = stepper.parameters;
        Status status = rest->prepare(stepper.parameters, left);
        rest->tolerance = stepper.tolerance;
        if (status == Status::ok) status = rest->start(wall.time, wall.q, wall.p);
        if (known != nullptr) known->continue_in(*rest);
        events.keep(*rest);
        if (status == Status::ok) status = rest->step();
        if constexpr (S::N > 0) stepper.iterations += rest->iterations;
        return status;
    }

    void finish(S& stepper) {
        real momentum[n];
        rest->momentum(momentum);
        put(stepper, rest->q, momentum, stepper.steps);
        KnownEvents<S>(*rest).put(stepper);
    }
};

// A stepper with all that its kernel looks for: events, stops, impacts, switches. A step is one from t to t + h,
// whatever it meets on the way. For programs that hold a kernel's text; it allocates when it starts.
template <class K>
class HybridStepper {
public:
    using real = typename K::real;
    static constexpr int n = K::coordinates, columns = Watch<K>::columns;

    HybridStepper() = default;
    HybridStepper(const HybridStepper&) = delete;
    HybridStepper& operator=(const HybridStepper&) = delete;
    ~HybridStepper() { delete looks; }

    void set_tolerance(real tolerance) { stepper.tolerance = tolerance; }  // of increments, relative; 0: to rounding
    Status prepare(const typename K::Parameters& parameters, real h) {
        delete looks;
        looks = nullptr;
        started = Status::unsupported;
        stepper.parameters = parameters;
        return stepper.prepare(parameters, h);
    }
    // Status::off_constraints behind a wall; Status::unsupported where walls or switches are and h < 0.
    Status start(real time, const real* q, const real* p) {
        delete looks;
        looks = nullptr;
        if constexpr (WatchedStepper<K>::walls > 0)
            started = stepper.step_size < real(0) ? Status::unsupported : Sides<K>::start(stepper, time, q, p);
        else
            started = stepper.start(time, q, p);
        if (started == Status::ok) looks = new Looks(stepper);
        return started;
    }
    // Status::stopped: the motion met a stop in this step, where the last event says. Without a start:
    // Status::unsupported; after one that was refused: the status of that one.
    Status step() {
        if (looks == nullptr) return started;
        looks->count = 0;
        looks->watch.keep(stepper);
        const Status status = stepper.step();
        return status == Status::ok ? looks->watch.look(stepper, looks->rows, looks->count) : status;
    }

    // Of a kernel with inputs, before a step: their values in `values`, the others of which do not count.
    Status set_inputs(const typename K::Parameters& values) { return set_watched_inputs(stepper, values); }

    real time() const { return stepper.time(); }
    const real* q() const { return stepper.q; }
    void momentum(real* p) const { stepper.momentum(p); }
    // Of the last step, in the order of the motion: number (those of the scene: events, stops, impacts), t, q[n], p[n];
    // of an impact the state after it.
    std::int64_t events() const { return looks == nullptr ? 0 : looks->count; }
    const real* event(std::int64_t i) const { return looks->rows + i * columns; }

private:
    struct Looks {
        explicit Looks(const WatchedStepper<K>& stepper) : watch(stepper) {}
        Watch<K> watch;
        real rows[Watch<K>::most * columns];
        std::int64_t count = 0;
    };
    WatchedStepper<K> stepper{};
    Status started = Status::unsupported;
    Looks* looks = nullptr;
};

}  // namespace lobatto

#endif
