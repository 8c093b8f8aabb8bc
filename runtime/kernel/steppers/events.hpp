// SPDX-License-Identifier: MIT
// Locates, inside one step, where a watched function changes sign: events, stops, walls, switches.
//
// An event of g(t, q, q') = 0 happens where the sign of g changes. Its places are isolated on the step's polynomial: g
// is sampled at twice as many pieces as the step has nodes, and between samples where |g| is least. What decides is
// not the polynomial, of lower order than the steps, but g at the end of a step of the same method from the same
// start, shortened to theta h: the signs, and the root between them. Most places where |g| is least are far from zero,
// and are told by the samples alone (is_no_dip).
#ifndef LOBATTO_KERNEL_EVENTS_HPP
#define LOBATTO_KERNEL_EVENTS_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "sampled_function.hpp"
#include "watched_stepper.hpp"

namespace lobatto {

// How a step is cut: not at all; at an impact; where the motion passes a switch.
enum class Cut { none, impact, passage };

template <class K>
struct Events : SampledFunction<typename K::real> {
    using real = typename K::real;
    using Sampled = SampledFunction<real>;
    using Sampled::changes, Sampled::has_sign, Sampled::last_defined, Sampled::least_between, Sampled::root_between,
        Sampled::rounding;
    using typename Sampled::Sample;
    using S = WatchedStepper<K>;
    static constexpr int n = K::coordinates, pieces = 2 * S::nodes;
    static constexpr int grid_size = pieces + 3;         // the ends of pieces, and a place next to each end of the step
    static constexpr int room = grid_size + pieces + 2;  // samples of one function
    static constexpr int columns = 1 + Between<K>::columns;
    static constexpr int most = K::events * room;  // rows of one step
    static constexpr int walls = S::walls, first_wall = K::events - walls;

    explicit Events(const S& stepper) : partial(new S(stepper)) {
        for (int i = 0; i < grid_size; ++i) {
            grid[i] = grid_at(i);
            if constexpr (S::basis > 0) S::basis_at(grid[i], basis_value[i], basis_slope[i]);
        }
    }
    Events(const Events&) = delete;
    Events& operator=(const Events&) = delete;
    ~Events() { delete partial; }

    // Where the functions are sampled first.
    static real grid_at(int i) {
        const real beside = real(1) / real(1024 * pieces);
        return i == 0               ? real(0)
               : i == 1             ? beside
               : i == grid_size - 2 ? real(1) - beside
                                    : real(i == grid_size - 1 ? pieces : i - 1) / real(pieces);
    }

    // The sample at the end of piece j, and which piece ends at or next to sample i.
    LOBATTO_DEVICE static constexpr int sample_at(int j) { return j == 0 ? 0 : j == pieces ? grid_size - 1 : j + 1; }
    LOBATTO_DEVICE static constexpr int piece_at(int i) { return i < 2 ? 0 : i > grid_size - 3 ? pieces : i - 1; }

    // Before each step: the state that it starts from.
    void keep(const S& stepper) {
        time = stepper.time();
        for (int k = 0; k < n; ++k) q[k] = stepper.q[k];
        stepper.momentum(p);
    }

    // What happened with functions `first` ... `last` - 1 until theta in the step taken since keep: `found` places in
    // the order of the motion, each with its number. Where a shortened step fails, its status. What is zero at a cut
    // happens there if the step would change its sign beyond an impact; if the motion does beyond a switch, which the
    // step from there on tells.
    Status find(S& stepper, int first, int last, real until, Cut at = Cut::none) {
        step = &stepper;
        cut = at;
        status = Status::ok;
        found = 0;
        knows_end[0] = knows_end[1] = false;
        for (int i = 0; i < grid_size; ++i) on_grid(i);
        for (int e = first; e < last && status == Status::ok; ++e) find_events(e, until);
        return status;
    }

    // t, q, p at t + theta h, by a step of that length.
    Status state(real theta, real* row) {
        state_at(theta, row);
        return status;
    }

    int found{};                 // places of the last find:
    real thetas[most]{};         // where
    int numbers[most]{};         // of which function
    real slack[S::wall_room]{};  // of each wall: up to here its function is zero, but for rounding
    real sides[S::wall_room]{};  // and the sign that it has where the motion is

private:
    S* step{};
    S* partial;  // the shortened step
    Cut cut{};
    Status status{};
    real time{}, q[n]{}, p[n]{};
    static constexpr int basis_room = S::basis > 0 ? S::basis : 1;
    real grid[grid_size]{}, grid_values[grid_size][K::events]{};
    real basis_value[grid_size][basis_room]{}, basis_slope[grid_size][basis_room]{};  // of the step's polynomial
    real end_values[2][K::events]{};  // where the step begins and ends, once they were asked for
    bool knows_end[2]{};
    Sample samples[room]{};
    int sample_count{};

    // For formulas; with a clock a sum over nodes.
    real time_at(real theta) const { return K::autonomous ? real(0) : Between<K>::time(*step, theta); }

    void on_grid(int i) {
        if constexpr (S::basis > 0) {
            real position[n], velocity[n];
            step->polynomial(basis_value[i], basis_slope[i], position, velocity);
            Formulas<K>::event(step->coefficients, time_at(grid[i]), position, velocity, +grid_values[i]);
        } else {
            on_polynomial(grid[i], grid_values[i]);
        }
    }
    void on_polynomial(real theta, real* values) const {
        real position[n], velocity[n];
        step->polynomial(theta, position, velocity);
        Formulas<K>::event(step->coefficients, time_at(theta), position, velocity, values);
    }
    LOBATTO_APART real on_polynomial(real theta, int e) const {
        real values[K::events];
        on_polynomial(theta, values);
        return values[e];
    }

    // t, q, p at t + theta h, by a step of that length.
    LOBATTO_APART void state_at(real theta, real* row) {
        real momentum[n];
        const real there = Between<K>::time(*step, theta);
        if (theta == real(1)) {
            step->momentum(momentum);
            return put_state<n>(there, step->q, momentum, row);
        }
        put_state<n>(there, q, p, row);
        const real length = theta * step->step_size;
        if (time + length == time) return;
        Status done = partial->prepare(step->parameters, length);
        partial->tolerance = step->tolerance;
        if (done == Status::ok) {
            if constexpr (K::clocked)
                done = partial->start(time, q, p, step->known_of_start());
            else
                done = partial->start(time, q, p);
        }
        if (done == Status::ok) done = partial->step();
        if (K::clocked && done == Status::time_stands_still) return;  // so short that it ends where it begins
        if (done != Status::ok) {
            status = done;
            return;
        }
        partial->momentum(momentum);
        put_state<n>(K::clocked ? partial->time() : there, partial->q, momentum, row);
    }
    LOBATTO_APART real exactly(real theta, int e) {
        real values[K::events];
        if (theta == real(0) || theta == real(1)) {
            const int end = theta == real(0) ? 0 : 1;
            if (!knows_end[end]) exactly(theta, end_values[end]);
            knows_end[end] = true;
            return end_values[end][e];
        }
        exactly(theta, values);
        return values[e];
    }
    void exactly(real theta, real* values) {
        real row[1 + 2 * n], velocity[n];
        state_at(theta, row);
        if (status == Status::ok) status = step->velocity(row[0], row + 1, row + 1 + n, velocity);
        if (status == Status::ok)
            Formulas<K>::event(step->coefficients, row[0], row + 1, velocity, values);
        else
            for (int e = 0; e < K::events; ++e) values[e] = real(0);
    }

    real value_at(real theta, int e, bool is_exact) { return is_exact ? exactly(theta, e) : on_polynomial(theta, e); }

    void insert(int place, Sample sample) {
        if (sample_count == room) return;
        for (int i = sample_count++; i > place; --i) samples[i] = samples[i - 1];
        samples[place] = sample;
    }
    void make_exact(Sample& sample, int e) {
        if (!sample.is_exact) sample = {sample.theta, exactly(sample.theta, e), true};
    }

    static constexpr bool is_wall(int e) { return e >= first_wall; }
    static constexpr bool is_switch(int e) { return e >= K::events - K::switches; }
    real side(int e) const { return sides[e - first_wall]; }

    void find_events(int e, real until) {
        sample_count = grid_size;
        for (int i = 0; i < grid_size; ++i) samples[i] = {grid[i], grid_values[i][e], false};
        if constexpr (walls > 0) {
            if (is_wall(e) && !begin_at_wall(e)) return;
        }
        reach_undefined(false, e);
        for (int i = 1; i + 1 < sample_count; ++i) i += refine_between(i, e);
        make_exact(samples[0], e);
        make_exact(samples[sample_count - 1], e);
        decide_signs(e);
        reach_undefined(true, e);  // where the motion, not only its polynomial, leaves the domain of g
        if (cut != Cut::none) look_at_cut(e, until);
        walk(e, until);
    }

    // A sample at the cut, and one beyond, if the step ends there.
    void look_at_cut(int e, real until) {
        int place = 0;
        while (place < sample_count && samples[place].theta < until) ++place;
        if (place < sample_count && samples[place].theta == until)
            make_exact(samples[place], e);
        else
            insert(place, {until, exactly(until, e), true});
        if (cut == Cut::impact && until == real(1)) {
            const real beyond = real(1) + real(1) / real(pieces);
            insert(sample_count, {beyond, on_polynomial(beyond, e), false});
        }
    }

    // Where the step begins at the wall, a sample on the way that it takes before it comes back. False: it stays there.
    bool begin_at_wall(int e) {
        const real least = slack[e - first_wall];
        step->event_values[e] = side(e);
        make_exact(samples[0], e);
        if (!(fabs(samples[0].value) <= least)) return true;
        samples[0].value = real(0);
        bool stays = true;
        for (int i = 1; i < sample_count; ++i) stays = stays && fabs(samples[i].value) <= least;
        if (stays) return false;
        make_exact(samples[1], e);
        for (real theta = samples[1].theta; !(samples[1].value * side(e) > least) && theta > rounding;) {
            theta *= real(0.5);
            const Sample there{theta, exactly(theta, e), true};
            if (status != Status::ok) return true;
            if (there.value * side(e) > least) insert(1, there);
        }
        return true;
    }

    // In pieces at one end of which g is not defined: a sample where its domain ends, and one half way to it.
    void reach_undefined(bool is_exact, int e) {
        const auto g = [&](real theta) { return value_at(theta, e, is_exact); };
        for (int i = 0; i + 1 < sample_count; ++i) {
            const bool is_first = is_finite(samples[i].value);
            const Sample inside = samples[is_first ? i : i + 1], outside = samples[is_first ? i + 1 : i];
            if (is_first == is_finite(samples[i + 1].value) || (is_exact && !(inside.is_exact && outside.is_exact)))
                continue;
            const Sample last = last_defined(inside, outside.theta, g);
            const real half = real(0.5) * (inside.theta + last.theta);
            if (half == inside.theta || half == last.theta) continue;
            const Sample between{half, g(half), is_exact};
            insert(i + 1, is_first ? last : between);
            insert(i + 1, is_first ? between : last);
            i += 2;
        }
    }

    // Around sample i, where |g| may be least without a change of sign at the samples: a sample there, if the sign
    // changes. How many were inserted.
    int refine_between(int i, int e) {
        bool is_exact = false;
        const auto g = [&](real theta) { return value_at(theta, e, is_exact); };
        const Sample a = samples[i - 1], middle = samples[i], b = samples[i + 1];
        if (!has_sign(a.value) || !has_sign(middle.value) || !has_sign(b.value)) return 0;
        if (changes(a.value, middle.value) || changes(middle.value, b.value)) return 0;
        if (!(fabs(middle.value) <= fabs(a.value) && fabs(middle.value) < fabs(b.value))) return 0;
        if (sees_no_dip(i)) return 0;
        Sample least = least_between(a, middle, b, g);
        const real there = exactly(least.theta, e), error = fabs(there - least.value);
        // So near to zero that the polynomial cannot tell.
        const bool is_near = !changes(there, a.value) && fabs(there) <= real(8) * error;
        least = {least.theta, there, true};
        is_exact = true;
        if (is_near) least = least_between(a, least, b, g);
        least.is_exact = true;
        if (!changes(least.value, a.value)) return 0;
        insert(least.theta < middle.theta ? i : i + 1, least);
        return 1;
    }

    bool sees_no_dip(int i) const {
        if (pieces < 4 || sample_count != grid_size) return false;
        real y[pieces + 1], largest = real(0);
        for (int j = 0; j <= pieces; ++j) {
            const real value = samples[sample_at(j)].value;
            if (!has_sign(value) || changes(value, samples[i].value)) return false;
            y[j] = fabs(value);
            largest = maximum(y[j], largest);
        }
        return is_no_dip<pieces>(y, piece_at(i), largest);
    }

    // Exact values at both ends of each piece along which the sign changes, as far as that moves the changes.
    void decide_signs(int e) {
        for (bool is_done = false; !is_done;) {
            is_done = true;
            for (int i = 0; i + 1 < sample_count; ++i) {
                Sample &a = samples[i], &b = samples[i + 1];
                const bool is_change = changes(a.value, b.value) || a.value == real(0) || b.value == real(0);
                if (!is_change || (a.is_exact && b.is_exact)) continue;
                make_exact(a, e);
                make_exact(b, e);
                is_done = status != Status::ok;
            }
        }
    }

    real largest_value() const {
        real largest = real(0);
        for (int i = 0; i < sample_count; ++i)
            if (is_finite(samples[i].value)) largest = maximum(fabs(samples[i].value), largest);
        return largest;
    }
    // Of what is not small along the step.
    bool is_zero(const Sample& sample, int e) {
        if (is_wall(e)) return fabs(sample.value) <= slack[e - first_wall];
        return sample.is_exact && fabs(sample.value) <= Limits<real>::root_epsilon * largest_value() &&
               is_rounding(sample.theta, e);
    }
    // Whether g is as small there as the roundings of what it is computed from make it: 64 of each number, and of the
    // time, in which a position goes its way and a velocity changes.
    bool is_rounding(real theta, int e) {
        if (e < 0) __builtin_unreachable();  // what g++ would warn of
        real row[1 + 2 * n], velocity[n], values[K::events];
        state_at(theta, row);
        if (status == Status::ok) status = step->velocity(row[0], row + 1, row + 1 + n, velocity);
        if (status != Status::ok) return false;
        Formulas<K>::event(step->coefficients, row[0], row + 1, velocity, values);
        const real value = values[e];
        real place[n], begin[n], end[n];  // velocities
        step->polynomial(real(0), place, begin);
        step->polynomial(real(1), place, end);
        const real few = real(64) * Limits<real>::epsilon, h = fabs(step->step_size), passed = maximum(fabs(row[0]), h);
        real change = real(0);
        for (int k = 0; k <= 2 * n; ++k) {
            real& number = k == 0 ? row[0] : k <= n ? row[k] : velocity[k - n - 1];
            const real before = number, way = k == 0   ? real(0)
                                              : k <= n ? fabs(velocity[k - 1]) * passed
                                                       : fabs(end[k - n - 1] - begin[k - n - 1]) / h * passed;
            number += few * (fabs(number) > way ? number : way);
            Formulas<K>::event(step->coefficients, row[0], row + 1, velocity, values);
            number = before;
            if (is_finite(values[e])) change += fabs(values[e] - value);
        }
        return fabs(value) <= change;
    }

    // Whether a change of sign between two steps, from this value to that of the first sample, is a zero: the state
    // goes on, so that both are small. At a pole, or where g jumps, they are not.
    bool is_small_at_start(real before) const {
        const real here = fabs(samples[0].value), few = real(0.125) * largest_value();
        return here <= Limits<real>::root_epsilon * fabs(before) || (here <= few && fabs(before) <= few);
    }

    // The changes of sign along the samples. A zero at a sample, or what is rounding there, is one if the sign beyond
    // it is another: else g only touches zero. Where g is not defined in between, nothing has happened.
    void walk(int e, real until) {
        if (e < 0) __builtin_unreachable();  // what g++ would warn of
        const auto g = [&](real theta) { return exactly(theta, e); };
        real& last = step->event_values[e];  // that is not zero
        int zero = -1, before = -1;          // samples: the first zero since the one before, which has the sign of last
        for (int i = 0; i < sample_count && status == Status::ok; ++i) {
            const Sample& here = samples[i];
            const bool is_beyond = cut != Cut::none && here.theta > until;
            if (is_beyond && !(cut == Cut::impact && zero >= 0)) break;
            if (!is_finite(here.value)) {
                last = real(0);
                zero = before = -1;
            } else if (here.value == real(0) || is_zero(here, e)) {
                if (zero < 0) zero = i;
                // The motion starts there, or goes on there from an impact or with other inputs.
                const bool is_first = step->steps == 1 && !step->events_go_on;
                if (i == 0 && (is_first || step->event_begins[e]) && !is_wall(e)) last = real(0);
            } else {
                if (changes(last, here.value)) {
                    const int from = before >= 0 ? before : 0;
                    // Of a constant, and of what holds identically, rounding alone changes the sign.
                    if (!is_beyond && !is_wall(e) && is_rounding(here.theta, e) && is_rounding(samples[from].theta, e))
                        continue;
                    const int direction = ((here.value > real(0)) == (step->step_size > real(0))) ? 1 : -1;
                    if (K::event_direction[e] * direction >= 0) {
                        const bool is_exactly = zero >= 0 && samples[zero].value == real(0);
                        bool is_root = i > 0 || is_wall(e) || is_small_at_start(last);
                        const real root = is_beyond    ? until
                                          : is_exactly ? samples[zero].theta
                                          : changes(samples[from].value, here.value)
                                              ? root_between(samples[from], here, is_switch(e), is_root, g)
                                              : samples[from].theta;
                        if (is_root) add(e, root);
                    }
                }
                last = here.value;
                zero = -1;
                before = i;
            }
        }
        step->event_begins[e] = false;
    }

    void add(int e, real root) {
        int place = found++;
        for (; place > 0 && thetas[place - 1] > root; --place) {
            thetas[place] = thetas[place - 1];
            numbers[place] = numbers[place - 1];
        }
        thetas[place] = root;
        numbers[place] = e;
    }
};

}  // namespace lobatto

#endif
