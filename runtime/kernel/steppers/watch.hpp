// SPDX-License-Identifier: MIT
// What is looked for in each step: events, impacts, and where the motion is to stop.
//
// A step that meets a wall is cut there, at the end of a step of the same method; the momentum jumps (walls.hpp), and a
// step of the rest of h leads back to the times of the run. So a step with impacts is one from t to t + h like any
// other, and of the method's order. A switch cuts a step too; the rest follows other formulas, and where L jumps there
// the momentum does, too (refraction.hpp). A kick cuts it, and gives the motion another state.
#ifndef LOBATTO_KERNEL_WATCH_HPP
#define LOBATTO_KERNEL_WATCH_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "events.hpp"
#include "refraction.hpp"
#include "sides.hpp"

namespace lobatto {

// Looks at each step of one stepper: keep before it, look after it.
template <class K>
class Watch {
public:
    using real = typename K::real;
    using S = WatchedStepper<K>;
    static constexpr int n = K::coordinates, columns = Events<K>::columns;
    static constexpr int walls = S::walls, first_wall = K::events - walls, stops = K::stops;
    static constexpr bool goes_back = !K::clocked;
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
        if constexpr (goes_back) {
            time = stepper.time();
            if constexpr (walls > 0) parameters = stepper.parameters;
            for (int w = 0; w < walls; ++w) passage_side[w] = stepper.passage_side[w];
            for (int k = 0; k < n; ++k) q[k] = stepper.q[k];
            stepper.momentum(p);
        }
    }

    // Adds rows of event number, t, q[n], p[n] of the step taken since keep, in the order of the motion; of an impact
    // the state after it. Without rows none are sought, and the motion does not stop. Status::stopped: the last row
    // says where and why. Where the search fails, the stepper is where it was before the step; one with a clock is at
    // its end.
    Status look(S& stepper, real* rows, std::int64_t& count) {
        const std::int64_t before = count;
        Status status = Status::ok;
        if constexpr (walls > 0) {
            status = look_with_walls(stepper, rows, count);
            if (status != Status::ok) go_back(stepper);
        } else if (rows != nullptr) {
            status = find(stepper, real(1), Cut::none, rows, count);
            if constexpr (goes_back)
                if (status != Status::ok && status != Status::stopped) go_back(stepper);
        }
        if (status != Status::ok && status != Status::stopped) count = before;  // the step was not taken
        return status;
    }

private:
    Events<K> events;
    S* rest;  // the steps from an impact to the end
    real time{}, q[n]{}, p[n]{};
    typename K::Parameters parameters{};
    real passage_side[S::wall_room]{};
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
        if constexpr (walls > 0) stepper.parameters = parameters;
        for (int w = 0; w < walls; ++w) stepper.passage_side[w] = passage_side[w];
        put(stepper, q, p, stepper.steps - 1);
    }
    // A state at one of the stepper's own times, with its parameters.
    static void put(S& stepper, const real* position, const real* momentum, std::int64_t steps) {
        if constexpr (K::switches > 0) stepper.prepare(stepper.parameters, stepper.step_size);
        stepper.restart(position, momentum, steps);
    }

    Status look_with_walls(S& stepper, real* rows, std::int64_t& count) {
        const real end = stepper.time();
        Arrest arrest;
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
            const int number = events.found > 0 ? events.numbers[0] : -1;
            const real theta = events.found > 0 ? events.thetas[0] : real(1),
                       left_over = end - Between<K>::time(*step, theta);
            const bool is_late = !(left_over * stepper.step_size > real(0)) || end - left_over == end;
            const bool is_hit = number >= 0 && !(is_late && changes_state(number - first_wall));
            const Cut cut = !is_hit                                                                 ? Cut::none
                            : throws(stepper, number - first_wall) || refracts(number - first_wall) ? Cut::impact
                                                                                                    : Cut::passage;
            if (rows != nullptr) {
                status = find(*step, theta, cut, rows, count);
                if (status != Status::ok) break;
            }
            if (!is_hit) break;
            const KnownEvents<S> known(*step);
            real row[1 + 2 * n];
            status = events.state(theta, row);
            if constexpr (K::switches > 0)
                if (status == Status::ok)  // again at the second, third, fifth, ninth cut of a step
                    Sides<K>::scale_switches(stepper, row[0], row + 1, row + 1 + n,
                                             impacts > 0 && (impacts & (impacts - 1)) == 0);
            if (status == Status::ok) status = wall.look(stepper, row[0], row + 1, row + 1 + n);
            if (status == Status::ok && cut == Cut::passage && rows != nullptr)
                arrest.see(*step, wall, number - first_wall, count);
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
        if (status != Status::impacts_accumulate || arrest.stop < 0) return status;
        count = arrest.count;
        real* const row = rows + count++ * columns;
        row[0] = real(arrest.stop);
        for (int i = 1; i < columns; ++i) row[i] = arrest.row[i - 1];
        return Status::stopped;
    }

    // Where friction holds a motion for good: a stop that is zero there, such as that of the velocity, ends it.
    struct Arrest {
        int stop = -1;
        std::int64_t count{};
        real row[columns]{};

        void see(const S& step, const Walls<K>& wall, int w, std::int64_t rows) {
            for (int s = first_wall - stops; s < first_wall && stop < 0; ++s) {
                if (!(fabs(wall.value[s]) <= wall.slack[w]) ||
                    real(K::event_direction[s]) * step.event_values[s] > real(0))
                    continue;
                stop = s;
                count = rows;
                put_state<n>(wall.time, wall.q, wall.p, row);
            }
        }
    };

    // Whether L may jump at wall w, a switch.
    static bool refracts(int w) {
        if constexpr (K::refractions > 0) return w >= K::impacts && K::refraction_of[w - K::impacts] >= 0;
        return false;
    }
    // At kicks and refractions: a state right there is the one before, so that the next step begins with them.
    static bool changes_state(int w) { return Walls<K>::passes(w) || refracts(w); }
    // Whether the state jumps at wall w.
    static bool throws(S& stepper, int w) {
        return w < K::impacts && (!Walls<K>::passes(w) || Walls<K>::acts(w, Walls<K>::side(stepper, w)));
    }

    // Through a switch, or back from walls.
    Status pass(S& stepper, Walls<K>& wall, int number, real* rows, std::int64_t& count) {
        if constexpr (K::impacts > 0) {
            if (throws(stepper, number)) return meet(stepper, wall, number, rows, count);
        }
        (void)wall, (void)rows, (void)count;
        if (++impacts > most_impacts) return Status::impacts_accumulate;
        if (Walls<K>::passes(number)) {
            stepper.passage_side[number] = -stepper.passage_side[number];
            return Status::ok;
        }
        const int number_of_switch = number - K::impacts;
        if constexpr (K::refractions > 0) {
            if (K::refraction_of[number_of_switch] >= 0) {
                real momentum[n];
                Refraction<K> refraction(stepper, number_of_switch, wall.time, wall.q, wall.p,
                                         wall.value + first_wall + K::impacts, wall.slack + K::impacts);
                const Status status = refraction.pass(momentum);
                return status == Status::ok ? wall.look(stepper, wall.time, wall.q, momentum) : status;
            }
        }
        real& side = stepper.side(number_of_switch);
        side = -side;
        return K::prepare(stepper.parameters, stepper.step_size, stepper.coefficients);
    }

    // All walls that are met there, one after another, until none is, or none faster than the motion comes to rest. It
    // ends where it leaves the last of them too slowly, or lies there; where rows are asked for.
    Status meet(S& stepper, Walls<K>& wall, int first, real* rows, std::int64_t& count) {
        for (int last = -1;;) {
            int met = last < 0 && K::reset_of[first] >= 0 ? first : -1;
            for (int w = 0; w < K::impacts && met < 0; ++w)
                if ((wall.is_met(w) && (last < 0 || !wall.comes_to_rest(w))) ||
                    (last < 0 && w == first && wall.approach[w] < real(0)))
                    met = w;
            const bool lies = met < 0 && last < 0 && rows != nullptr && wall.comes_to_rest(first);
            if (met < 0 && !lies) {
                if (last < 0) return Status::impacts_accumulate;
                return rows != nullptr && wall.comes_to_rest(last) ? Status::stopped : Status::ok;
            }
            if (++impacts > most_impacts) return Status::impacts_accumulate;
            last = lies ? first : met;
            const Status status = lies ? Status::ok : wall.hit(stepper, last);
            if (status != Status::ok) return status;
            if (Walls<K>::passes(last)) wall.go_beyond(stepper, last);
            if (rows == nullptr) continue;
            real* const row = rows + count++ * columns;
            row[0] = real(first_wall + last);
            put_state<n>(wall.time, wall.q, wall.p, row + 1);
            if (lies) return Status::stopped;
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

}  // namespace lobatto

#endif
