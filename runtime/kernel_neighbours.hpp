// SPDX-License-Identifier: MIT
// The step of a large separable system whose terms join neighbouring coordinates, which lie in the lanes of Packs.
//
// The same sweeps as in kernel_sweeps.hpp, formula numbers (D..) of docs/derivation.md: accelerations W of all nodes,
// then the stage map. What is different is the layout: of each node all coordinates stand one after another, and every
// loop runs over them, so that the cost of a step is proportional to their number. Increments shrink by a factor rho in
// each sweep, so W at positions that moved by e at last errs by rho e: the iteration ends when that is rounding, or as
// much as is asked for, without another look at the new positions.
//
// Arrays of coordinates have room for room_of<K> numbers: whole Packs and one to spare, where formulas may write zeros.
#ifndef LOBATTO_KERNEL_NEIGHBOURS_HPP
#define LOBATTO_KERNEL_NEIGHBOURS_HPP

#include <type_traits>
#include <utility>

#include "kernel_contract.hpp"
#include "kernel_numbers.hpp"
#include "kernel_pack.hpp"

namespace lobatto {

// Rows of a repeated formula: its variables x, and what it gives for each, to be added to W. V: a number, of one row;
// or, `in_lanes`, a Pack of `count` rows that follow one another from `row` on.
template <class V, int variables, bool in_lanes>
struct Rows {
    V x[variables], result[variables]{};
    int row, count;

    // A coefficient, of which the table has one value a row.
    template <class number>
    LOBATTO_INLINE auto of(const number* table) const {
        if constexpr (!in_lanes) {
            return table[row];
        } else {
            if (count == lanes_of<V>) return V::load(table + row);
            number first[lanes_of<V>]{};
            for (int i = 0; i < count; ++i) first[i] = table[row + i];
            return V::load(first);
        }
    }
};

// Shorter runs of rows are not worth a Pack.
constexpr int long_run = 8;

// Going through rows of formulas. `indices` has the `variables` of each row; a run is rows whose variables are those of
// the row before plus one. All runs of more than one row have the same distances between the variables of a row.
template <int variables, const auto& indices>
struct RowLoop {
    // How far variable j is behind the first.
    static constexpr int least() {
        int first = indices[0];
        for (int j = 1; j < variables; ++j) first = indices[j] < first ? indices[j] : first;
        return first - indices[0];
    }
    static constexpr int offset(int j) { return indices[j] - indices[0] - least(); }
    static constexpr int farthest_within(int width) {
        int farthest = 0;
        for (int j = 0; j < variables; ++j)
            if (offset(j) <= width && offset(j) > farthest) farthest = offset(j);
        return farthest;
    }

    // Adds to W (or sets it) what `count` rows from `begin` on give, as many at a time as V has lanes for them. What
    // variable j receives belongs offset(j) places behind what the first receives: those lanes move on from one V to
    // the next, so that each place of W is written once. Those that are far away are added where they belong.
    template <class V, bool adds, class number, class Formula>
    LOBATTO_INLINE static void run(int begin, int count, const number* q, number* W, const Formula& formula) {
        constexpr bool in_lanes = !std::is_same_v<V, number>;
        constexpr int width = in_lanes ? lanes_of<V> : 1;
        const auto load = [](const number* from) LOBATTO_FORMULA {
            if constexpr (in_lanes)
                return V::load(from);
            else
                return *from;
        };
        const auto store = [](const V& value, number* to) LOBATTO_FORMULA {
            if constexpr (in_lanes)
                value.store(to);
            else
                *to = value;
        };
        constexpr std::make_integer_sequence<int, variables> every{};
        const int first = indices[begin * variables] + least();
        q += first;
        W += first;
        V before[variables];
        for (int j = 0; j < variables; ++j) before[j] = V(real_of<number>(0));
        int r = 0;
        const auto add = [&](auto is_whole) LOBATTO_FORMULA {
            Rows<V, variables, in_lanes> rows;
            rows.row = begin + r;
            rows.count = is_whole ? width : count - r;
            each(every, [&](auto j) LOBATTO_FORMULA { rows.x[j] = load(q + offset(j) + r); });
            formula(rows);
            V sum = adds ? load(W + r) : V(real_of<number>(0));
            each(every, [&](auto j) LOBATTO_FORMULA {
                V& result = rows.result[j];
                if constexpr (in_lanes) {
                    if constexpr (!is_whole) result = first_lanes(result, count - r);
                }
                if constexpr (offset(j) > width)
                    store(load(W + offset(j) + r) + result, W + offset(j) + r);
                else if constexpr (!adds && j == 0)
                    sum = passed_on<width, offset(j)>(before[j], result);
                else
                    sum += passed_on<width, offset(j)>(before[j], result);
                before[j] = result;
            });
            store(sum, W + r);
            r += width;
        };
        while (r + width <= count) add(std::true_type());
        if constexpr (in_lanes) {
            if (r < count) add(std::false_type());
        }
        if (r < count + farthest_within(width)) {
            V sum = adds ? load(W + r) : V(real_of<number>(0));
            each(every, [&](auto j) LOBATTO_FORMULA {
                if constexpr (offset(j) > 0 && offset(j) <= width)
                    sum += passed_on<width, offset(j)>(before[j], V(real_of<number>(0)));
            });
            store(sum, W + r);
        }
    }

    template <class number, class Formula>
    static void row_by_row(int begin, int count, const number* q, number* W, const Formula& formula) {
        for (int row = begin; row < begin + count; ++row) {
            Rows<number, variables, false> one;
            one.row = row;
            one.count = 1;
            for (int j = 0; j < variables; ++j) one.x[j] = q[indices[row * variables + j]];
            formula(one);
            for (int j = 0; j < variables; ++j) W[indices[row * variables + j]] += one.result[j];
        }
    }

    // All runs of `runs`, pairs (first row, how many).
    template <class V, const auto& runs, class number, class Formula>
    LOBATTO_INLINE static void all(const number* q, number* W, const Formula& formula) {
        constexpr int run_count = sizeof(runs) / sizeof(runs[0]);
        for (int i = 0; i < run_count; i += 2) {
            if (runs[i + 1] < long_run)
                row_by_row(runs[i], runs[i + 1], q, W, formula);
            else
                run<V, true>(runs[i], runs[i + 1], q, W, formula);
        }
    }

private:
    // f(0), f(1), ... of numbers known to the compiler.
    template <class F, int... numbers>
    LOBATTO_INLINE static void each(std::integer_sequence<int, numbers...>, const F& f) {
        (f(std::integral_constant<int, numbers>()), ...);
    }
    template <int width, int places, class V>
    LOBATTO_INLINE static V passed_on(const V& before, const V& values) {
        if constexpr (places == 0)
            return values;
        else if constexpr (places == width)
            return before;
        else
            return moved_on<places>(before, values);
    }
};

// How an emitted kernel goes through its rows: one after another, for any type of number,
struct OneByOne {
    template <int count, class number>
    static void clear(number* W) {
        for (int i = 0; i < count; ++i) W[i] = number(0);
    }
    template <int count, class number, class Factor>
    static void scale(number* W, const Factor* factor) {
        for (int i = 0; i < count; ++i) W[i] *= factor[i];
    }
    template <int place, class number>
    static number& at(number* W) {
        return W[place];
    }
    // `runs`: pairs (first row, how many).
    template <int variables, const auto& indices, const auto& runs, class number, class Formula>
    LOBATTO_INLINE static void add_rows(const number* q, number* W, const Formula& formula) {
        RowLoop<variables, indices>::template all<number, runs>(q, W, formula);
    }
    // The same where the rows are one run that reaches all of W, of `count`, on which nothing stands yet.
    template <int count, int variables, const auto& indices, const auto& runs, class number, class Formula>
    LOBATTO_INLINE static void set_rows(const number* q, number* W, const Formula& formula) {
        clear<count>(W);
        add_rows<variables, indices, runs>(q, W, formula);
    }
};

// or those of a run side by side in a Pack, for plain numbers in arrays with room.
struct SideBySide {
    template <class real>
    using Lanes = Pack<real, native_lanes<real>>;

    template <int count, class real>
    LOBATTO_INLINE static void clear(real* W) {
        for (int i = 0; i < count; i += native_lanes<real>) Lanes<real>(real(0)).store(W + i);
    }
    template <int count, class real>
    LOBATTO_INLINE static void scale(real* W, const real* factor) {
        using V = Lanes<real>;
        int i = 0;
        for (; i + lanes_of<V> <= count; i += lanes_of<V>) (V::load(W + i) * V::load(factor + i)).store(W + i);
        for (; i < count; ++i) W[i] *= factor[i];
    }
    // One number of W, as a part of its Pack: what has just been stored as a whole is loaded as a whole.
    template <class real, int place>
    struct Place {
        real* W;
        LOBATTO_INLINE void operator+=(real x) const {
            constexpr int lane = place % native_lanes<real>;
            using V = Lanes<real>;
            (V::load(W + place - lane) + only_lane<lane, lanes_of<V>>(x)).store(W + place - lane);
        }
    };
    template <int place, class real>
    LOBATTO_INLINE static Place<real, place> at(real* W) {
        return {W};
    }
    template <int variables, const auto& indices, const auto& runs, class real, class Formula>
    LOBATTO_INLINE static void add_rows(const real* q, real* W, const Formula& formula) {
        RowLoop<variables, indices>::template all<Lanes<real>, runs>(q, W, formula);
    }
    template <int count, int variables, const auto& indices, const auto& runs, class real, class Formula>
    LOBATTO_INLINE static void set_rows(const real* q, real* W, const Formula& formula) {
        RowLoop<variables, indices>::template run<Lanes<real>, false>(runs[0], runs[1], q, W, formula);
    }
};

// How many numbers an array of coordinates holds.
template <class K>
constexpr int room_of = (K::coordinates / native_lanes<typename K::real> + 2) * native_lanes<typename K::real>;

// One trajectory; its state and the memory of its last step, each twice: before the step and after it.
template <class K>
struct NeighbourSweeps {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2, inner_room = m > 0 ? m : 1;
    static constexpr int width = native_lanes<real>, room = room_of<K>, end = (n + width - 1) / width * width;
    static constexpr int evaluation_limit = 16, measured_every = 16;
    using V = Pack<real, width>;

    V before[inner_room][s];           // -h^2 A E: from the accelerations of the step before (D15)
    V inner[inner_room][inner_room];   // -h^2 A
    V simple[inner_room];              // the row sums of the latter
    V on_velocity[inner_room];         // h c
    V weight[s], arrival[inner_room];  // -h b and -h^2 b (1 - c)
    real h{};
    real tolerance{};      // of increments, relative; 0: to rounding
    real shrinking{};      // rho, as last measured; 0: never
    int until_measured{};  // steps
    bool has_history{};
    int now{};                                                    // which of the two is the present
    alignas(V) real q[2][room]{}, u[2][room]{};                   // position and velocity
    alignas(V) real w[2][inner_room * room]{}, w_end[2][room]{};  // W at the inner nodes of the last step, at its end
    alignas(V) real X[inner_room * room]{}, rate[room]{}, inverse_scale[room]{}, change[room]{};
    int evaluations{};  // of the last step
    real increment{};   // the last one of the last step, relative

    void prepare(const typename K::Coefficients&, real step_size) {
        h = step_size;
        has_history = false;
        until_measured = 0;
        for (int i = 0; i < m; ++i) {
            real row_sum = real(0);
            for (int j = 0; j < m; ++j) {
                const real entry = -h * h * K::A[i * m + j];
                inner[i][j] = V(entry);
                row_sum += entry;
            }
            simple[i] = V(row_sum);
            for (int l = 0; l < s; ++l) {
                real entry = real(0);
                for (int j = 0; j < m; ++j) entry += -h * h * K::A[i * m + j] * K::E[j * s + l];
                before[i][l] = V(entry);
            }
            on_velocity[i] = V(h * K::c[i + 1]);
            arrival[i] = V(-h * h * (K::b[i + 1] * (real(1) - K::c[i + 1])));
        }
        for (int i = 0; i < s; ++i) weight[i] = V(-h * K::b[i]);
    }

    // Begins at q and u, where W is W0.
    void begin(const real* position, const real* velocity, const real* W0) {
        has_history = false;
        until_measured = 0;
        for (int c = 0; c < n; ++c) {
            q[now][c] = position[c];
            u[now][c] = velocity[c];
            w_end[now][c] = W0[c];
        }
    }

    // W at node i of the last step.
    real acceleration(int i, int c) const {
        return i == 0 ? w_end[1 - now][c] : i < s - 1 ? w[now][(i - 1) * room + c] : w_end[now][c];
    }

    // Takes over a step that was taken otherwise: acceleration_at(i, c) at node i.
    template <class Acceleration>
    void recall(const real* position, const real* velocity, const Acceleration& acceleration_at) {
        begin(position, velocity, w_end[now]);
        has_history = true;
        for (int c = 0; c < n; ++c) {
            w_end[1 - now][c] = acceleration_at(0, c);
            for (int i = 0; i < m; ++i) w[now][i * room + c] = acceleration_at(i + 1, c);
            w_end[now][c] = acceleration_at(s - 1, c);
        }
    }

    // One step, h from `time`. False, and nothing has moved, where the sweeps do not contract.
    bool step(const typename K::Coefficients& k, real time) {
        const bool measures = until_measured == 0;
        if (has_history)
            predict<true>();
        else
            predict<false>();
        if (m > 0 && !solve(k, time, measures)) return false;
        return finish(k, time);
    }

private:
    static void accelerate(const typename K::Coefficients& k, real time, const real* position, real* W) {
        if constexpr (K::autonomous)
            K::template acceleration<SideBySide>(k, position, W);
        else
            K::template acceleration<SideBySide>(k, time, position, W);
    }
    real bound() const { return maximum(tolerance, Limits<real>::epsilon); }

    // The positions at the nodes from the accelerations of the step before; and the measure of each coordinate: its
    // displacement in a step, with the rounding of its position as floor.
    template <bool with_history>
    void predict() {
        constexpr real floor = Limits<real>::epsilon / Limits<real>::root_epsilon;
        const V rounding = V(Limits<real>::epsilon / bound()), step_size = V(h);
        const real *const position = q[now], *const velocity = u[now];
        const real *const at_start = w_end[1 - now], *const inside = w[now], *const at_end = w_end[now];
        for (int at = 0; at < end; at += width) {
            V W[s];
            W[0] = V::load(at_start + at);
            for (int j = 0; j < m; ++j) W[j + 1] = V::load(inside + j * room + at);
            W[s - 1] = V::load(at_end + at);
            const V Q = V::load(position + at), v = fused(weight[0], W[s - 1], V::load(velocity + at));
            v.store(rate + at);
            const V distance = fabs(Q);
            const V scale = fabs(step_size * v) + fabs(step_size * (step_size * W[s - 1])) + V(floor) * distance;
            (V(real(1)) / maximum(scale, fused(rounding, distance, V(Limits<real>::smallest))))
                .store(inverse_scale + at);
#pragma GCC unroll 16
            for (int i = 0; i < m; ++i) {
                V x = fused(on_velocity[i], v, Q);
                if constexpr (with_history) {
#pragma GCC unroll 16
                    for (int j = 0; j < s; ++j) x = fused(before[i][j], W[j], x);
                } else {
                    x = fused(simple[i], W[s - 1], x);
                }
                x.store(X + i * room + at);
            }
        }
    }

    // X = q + h c v - h^2 A W; the largest of what it moved by.
    real sweep() {
        V worst = V(real(0));
        const real *const position = q[now], *const inside = w[1 - now];
        for (int at = 0; at < end; at += width) {
            const V Q = V::load(position + at), v = V::load(rate + at);
            V W[inner_room], farthest = V(real(0));
            for (int j = 0; j < m; ++j) W[j] = V::load(inside + j * room + at);
#pragma GCC unroll 16
            for (int i = 0; i < m; ++i) {
                V x = fused(on_velocity[i], v, Q);
#pragma GCC unroll 16
                for (int j = 0; j < m; ++j) x = fused(inner[i][j], W[j], x);
                const V moved = fabs(x - V::load(X + i * room + at));
                farthest = i == 0 ? moved : maximum(farthest, moved);
                x.store(X + i * room + at);
            }
            worst = maximum(worst, farthest * V::load(inverse_scale + at));
        }
        return largest(worst);
    }

    // The accelerations at the inner nodes of the step. Where rho is measured, increments themselves go down to
    // rounding: the last ratios are those of the errors that shrink most slowly.
    bool solve(const typename K::Coefficients& k, real time, bool measures) {
        const real small = bound();
        real e_before = real(0), measured = real(0);
        for (evaluations = 1; evaluations <= evaluation_limit; ++evaluations) {
            for (int i = 0; i < m; ++i) accelerate(k, time + K::c[i + 1] * h, X + i * room, w[1 - now] + i * room);
            const real e = sweep();
            increment = e;
            if (e_before > real(256) * Limits<real>::epsilon) measured = maximum(measured, e / e_before);
            const real rho = measures ? real(1) : real(4) * maximum(measured, shrinking);  // 4: the motion changes it
            if (rho * e <= small || (e <= real(16) * small && e >= real(0.5) * e_before && e_before > real(0))) {
                if (measured > real(0)) shrinking = measures ? measured : maximum(measured, shrinking);
                until_measured = !measures ? until_measured - 1 : measured > real(0) ? measured_every : 0;
                return true;
            }
            if (evaluations > 3 && !(e < real(0.8) * e_before || e <= real(16) * small)) return false;
            e_before = e;
        }
        return false;
    }

    // (D16), (D17): the end of the step, each sum of increments rounded once.
    bool finish(const typename K::Coefficients& k, real time) {
        const int next = 1 - now;
        const real *const position = q[now], *const velocity = u[now], *const at_start = w_end[now],
                          *const inside = w[next], *const at_end = w_end[next];
        real *const new_position = q[next], *const new_velocity = u[next];
        const V step_size = V(h);
        for (int at = 0; at < end; at += width) {
            V moved = step_size * V::load(rate + at), difference = weight[0] * V::load(at_start + at);
#pragma GCC unroll 16
            for (int j = 0; j < m; ++j) {
                const V W = V::load(inside + j * room + at);
                moved = fused(arrival[j], W, moved);
                difference = fused(weight[j + 1], W, difference);
            }
            (V::load(position + at) + moved).store(new_position + at);
            difference.store(change + at);
        }
        accelerate(k, time + h, q[next], w_end[next]);
        V not_finite = V(real(0));
        for (int at = 0; at < end; at += width) {
            const V difference = fused(weight[s - 1], V::load(at_end + at), V::load(change + at));
            const V moved = V::load(velocity + at) + difference;
            moved.store(new_velocity + at);
            not_finite = fused(V(real(0)), moved + V::load(new_position + at), not_finite);
        }
        if (!(sum(not_finite) == real(0))) {
            has_history = false;  // W at the beginning of the step before is lost
            return false;
        }
        now = next;
        has_history = true;
        return true;
    }
};

}  // namespace lobatto

#endif
