// SPDX-License-Identifier: MIT
// The step of a large separable system whose terms join neighbouring coordinates, which lie in the lanes of Packs.
//
// The same sweeps as in kernel_sweeps.hpp, formula numbers (D..) of docs/derivation.md: accelerations W of all nodes,
// then the stage map. What is different is the layout: of each node all coordinates stand one after another, and every
// loop runs over them, so that the cost of a step is proportional to their number. Increments shrink by a factor rho in
// each sweep, so W at positions that moved by e at last errs by rho e: the iteration ends when that is rounding, or as
// much as is asked for, without another look at the new positions.
//
// Arrays of coordinates have room for room_of<K> numbers: whole Packs and two to spare, where formulas may read what
// does not matter and write zeros.
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

// The coordinates of one node in registers, a Pack of neighbours each; beyond the last there are zeros.
template <class V, int parts>
struct Registers {
    using real = real_of<V>;
    V* part;

    LOBATTO_INLINE real operator[](int place) const { return part[place / lanes_of<V>][place % lanes_of<V>]; }
    LOBATTO_INLINE void add(int place, real x) const {
        V one = V(real(0));
        one.set(place % lanes_of<V>, x);
        part[place / lanes_of<V>] += one;
    }
};

// A V of an array of coordinates: those from `at` on, a multiple of V's lanes where they are in registers.
template <class V, class number>
LOBATTO_INLINE V load_from(const number* array, int at) {
    if constexpr (std::is_same_v<V, number>)
        return array[at];
    else
        return V::load(array + at);
}
template <class V, int parts>
LOBATTO_INLINE V load_from(Registers<V, parts> array, int at) {
    return at < parts * lanes_of<V> ? array.part[at / lanes_of<V>] : V(real_of<V>(0));
}
template <class V, class number>
LOBATTO_INLINE void store_to(number* array, int at, const V& value) {
    if constexpr (std::is_same_v<V, number>)
        array[at] = value;
    else
        value.store(array + at);
}
template <class V, int parts>
LOBATTO_INLINE void store_to(Registers<V, parts> array, int at, const V& value) {
    if (at < parts * lanes_of<V>) array.part[at / lanes_of<V>] = value;
}
template <class number>
LOBATTO_INLINE void add_to(number* array, int place, const number& x) {
    array[place] += x;
}
template <class V, int parts>
LOBATTO_INLINE void add_to(Registers<V, parts> array, int place, real_of<V> x) {
    array.add(place, x);
}
template <class Array>
constexpr bool are_registers = false;
template <class V, int parts>
constexpr bool are_registers<Registers<V, parts>> = true;

// f(0), f(width), ... up to `count`, which the compiler knows, each written out.
template <int width, class F>
LOBATTO_INLINE void written_out(int count, const F& f) {
#pragma GCC unroll 32
    for (int at = 0; at < count; at += width) f(at);
}

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
    template <class V, bool adds, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void run(int begin, int count, Position q, Slope W, const Formula& formula) {
        using number = real_of<V>;
        constexpr bool in_lanes = !std::is_same_v<V, element_of<Position>>;
        constexpr int width = in_lanes ? lanes_of<V> : 1;
        constexpr std::make_integer_sequence<int, variables> every{};
        const int first = indices[begin * variables] + least();
        constexpr bool overlaps = farthest_within(width) > 0;  // what is loaded for one V serves the next too
        V before[variables], here = load_from<V>(q, first);
        for (int j = 0; j < variables; ++j) before[j] = V(number(0));
        const auto add = [&](int r, auto is_whole) LOBATTO_FORMULA {
            const int at = first + r;
            Rows<V, variables, in_lanes> rows;
            rows.row = begin + r;
            rows.count = is_whole ? width : count - r;
            if constexpr (!overlaps) here = load_from<V>(q, at);
            V there = here;
            if constexpr (overlaps) there = load_from<V>(q, at + width);
            each(every, [&](auto j) LOBATTO_FORMULA {
                if constexpr (offset(j) > width)
                    rows.x[j] = load_from<V>(q, at + offset(j));
                else
                    rows.x[j] = further<width, offset(j)>(here, there);
            });
            here = there;
            formula(rows);
            V sum = adds ? load_from<V>(W, at) : V(number(0));
            each(every, [&](auto j) LOBATTO_FORMULA {
                V& result = rows.result[j];
                if constexpr (in_lanes) {
                    if constexpr (!is_whole) result = first_lanes(result, count - r);
                }
                if constexpr (offset(j) > width)
                    store_to(W, at + offset(j), load_from<V>(W, at + offset(j)) + result);
                else if constexpr (!adds && j == 0)
                    sum = passed_on<width, offset(j)>(before[j], result);
                else
                    sum += passed_on<width, offset(j)>(before[j], result);
                before[j] = result;
            });
            store_to(W, at, sum);
        };
        const int whole = count / width * width;
        if constexpr (are_registers<Position>)
            written_out<width>(whole, [&](int r) LOBATTO_FORMULA { add(r, std::true_type()); });
        else
            for (int r = 0; r < whole; r += width) add(r, std::true_type());
        int behind = whole;
        if constexpr (in_lanes) {
            if (whole < count) {
                add(whole, std::false_type());
                behind += width;
            }
        }
        if (behind < count + farthest_within(width)) {
            V sum = adds ? load_from<V>(W, first + behind) : V(number(0));
            each(every, [&](auto j) LOBATTO_FORMULA {
                if constexpr (offset(j) > 0 && offset(j) <= width)
                    sum += passed_on<width, offset(j)>(before[j], V(number(0)));
            });
            store_to(W, first + behind, sum);
        }
    }

    template <class number, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void one_row(int row, Position q, Slope W, const Formula& formula) {
        Rows<number, variables, false> one;
        one.row = row;
        one.count = 1;
        for (int j = 0; j < variables; ++j) one.x[j] = q[indices[row * variables + j]];
        formula(one);
        for (int j = 0; j < variables; ++j) add_to(W, indices[row * variables + j], one.result[j]);
    }

    // All runs of `runs`, pairs (first row, how many).
    template <class V, const auto& runs, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void all(Position q, Slope W, const Formula& formula) {
        constexpr int run_count = sizeof(runs) / sizeof(runs[0]);
        const auto one_run = [&](int i) LOBATTO_FORMULA {
            if (runs[i + 1] >= long_run)
                run<V, true>(runs[i], runs[i + 1], q, W, formula);
            else if constexpr (are_registers<Position>)
                written_out<1>(runs[i + 1],
                               [&](int r) LOBATTO_FORMULA { one_row<real_of<V>>(runs[i] + r, q, W, formula); });
            else
                for (int row = runs[i]; row < runs[i] + runs[i + 1]; ++row)
                    one_row<element_of<Position>>(row, q, W, formula);
        };
        if constexpr (are_registers<Position>)
            written_out<2>(run_count, one_run);
        else
            for (int i = 0; i < run_count; i += 2) one_run(i);
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
    // `places` further on than `here`, behind which `there` stands.
    template <int width, int places, class V>
    LOBATTO_INLINE static V further(const V& here, const V& there) {
        return passed_on<width, width - places>(here, there);
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

// or those of a run side by side in a Pack, for plain numbers in arrays with room,
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

// or the same in registers, all written out.
struct WrittenOut {
    template <int count, class V, int parts>
    LOBATTO_INLINE static void clear(Registers<V, parts> W) {
        written_out<1>(parts, [&](int i) LOBATTO_FORMULA { W.part[i] = V(real_of<V>(0)); });
    }
    template <int count, class V, int parts>
    LOBATTO_INLINE static void scale(Registers<V, parts> W, const real_of<V>* factor) {
        written_out<lanes_of<V>>(count / lanes_of<V> * lanes_of<V>,
                                 [&](int at) LOBATTO_FORMULA { W.part[at / lanes_of<V>] *= V::load(factor + at); });
        if constexpr (count % lanes_of < V >> 0) {
            real_of<V> rest[lanes_of<V>]{};
            for (int i = 0; i < count % lanes_of<V>; ++i) rest[i] = factor[count / lanes_of<V> * lanes_of<V> + i];
            W.part[parts - 1] *= V::load(rest);
        }
    }
    template <class Slope, int place>
    struct Place {
        Slope W;
        LOBATTO_INLINE void operator+=(typename Slope::real x) const { W.add(place, x); }
    };
    template <int place, class Slope>
    LOBATTO_INLINE static Place<Slope, place> at(Slope W) {
        return {W};
    }
    template <int variables, const auto& indices, const auto& runs, class V, int parts, class Formula>
    LOBATTO_INLINE static void add_rows(Registers<V, parts> q, Registers<V, parts> W, const Formula& formula) {
        RowLoop<variables, indices>::template all<V, runs>(q, W, formula);
    }
    template <int count, int variables, const auto& indices, const auto& runs, class V, int parts, class Formula>
    LOBATTO_INLINE static void set_rows(Registers<V, parts> q, Registers<V, parts> W, const Formula& formula) {
        RowLoop<variables, indices>::template run<V, false>(runs[0], runs[1], q, W, formula);
    }
};

// How many numbers an array of coordinates holds.
template <class K>
constexpr int room_of = (K::coordinates / native_lanes<typename K::real> + 3) * native_lanes<typename K::real>;

// A Pack at a time.
template <int count, class real>
LOBATTO_INLINE void copy_lanes(const real* from, real* to) {
    using V = Pack<real, native_lanes<real>>;
    int i = 0;
    for (; i + lanes_of<V> <= count; i += lanes_of<V>) V::load(from + i).store(to + i);
    for (; i < count; ++i) to[i] = from[i];
}

// Whether the inner nodes of a step fit the registers of AVX-512, of which there are 32: these hold positions,
// accelerations and what is under way.
template <class K>
constexpr bool fits_registers() {
    using real = typename K::real;
    constexpr int width = native_lanes<real>, parts = (K::coordinates + width - 1) / width;
    if constexpr (K::neighbours)
        return width * sizeof(real) == 64 && parts * (K::points - 2) <= 16 && K::row_reach >= 0 &&
               K::row_reach <= width;
    else
        return false;
}

// One trajectory; its state, the memory of its last step, and room for the next. A step is solved in registers, all
// written out, or in memory; to the same bits.
template <class K, bool in_registers = fits_registers<K>()>
struct NeighbourSweeps {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2, inner_room = m > 0 ? m : 1;
    static constexpr int width = native_lanes<real>, room = room_of<K>, parts = (n + width - 1) / width;
    static constexpr int evaluation_limit = 16, measured_every = 16;
    using V = Pack<real, width>;
    using How = std::conditional_t<in_registers, WrittenOut, SideBySide>;
    using Row = std::conditional_t<in_registers, Registers<V, parts>, real*>;

    real before[inner_room][s];           // -h^2 A E: from the accelerations of the step before (D15)
    real inner[inner_room][inner_room];   // -h^2 A
    real simple[inner_room];              // the row sums of the latter
    real on_velocity[inner_room];         // h c
    real weight[s], arrival[inner_room];  // -h b and -h^2 b (1 - c)
    real h{};
    real tolerance{};      // of increments, relative; 0: to rounding
    real shrinking{};      // rho, as last measured; 0: never
    int until_measured{};  // steps
    int expected{};        // sweeps
    bool has_history{};
    int now{}, then{1};                                            // the present, the beginning of the last step, of
    alignas(V) real q[3][room]{}, u[3][room]{}, w_end[3][room]{};  // position, velocity, W there
    int last{};                                                    // the last step, of
    alignas(V) real w[2][inner_room * room]{};                     // W at the inner nodes
    int evaluations{};                                             // of the last step
    real increment{};                                              // the last one of the last step, relative

    // Of the step that is being solved: positions of the inner nodes, q + h c v, v, and what u changes by. In registers
    // also W and the end of the step, which otherwise are written where they belong.
    struct InMemory {
        alignas(V) real X[inner_room * room]{}, base[inner_room * room]{}, rate[room]{}, change[room]{};
    };
    struct InRegisters {
        V X[inner_room * parts], base[inner_room * parts], rate[parts], change[parts];
        V W[inner_room * parts], q1[parts], W1[parts];
    };
    struct Nothing {};
    using Nodes = std::conditional_t<in_registers, InRegisters, InMemory>;
    std::conditional_t<in_registers, Nothing, InMemory> memory{};

    void prepare(const typename K::Coefficients&, real step_size) {
        h = step_size;
        has_history = false;
        shrinking = real(0);
        until_measured = expected = 0;
        for (int i = 0; i < m; ++i) {
            real row_sum = real(0);
            for (int j = 0; j < m; ++j) {
                const real entry = -h * h * K::A[i * m + j];
                inner[i][j] = entry;
                row_sum += entry;
            }
            simple[i] = row_sum;
            for (int l = 0; l < s; ++l) {
                real entry = real(0);
                for (int j = 0; j < m; ++j) entry += -h * h * K::A[i * m + j] * K::E[j * s + l];
                before[i][l] = entry;
            }
            on_velocity[i] = h * K::c[i + 1];
            arrival[i] = -h * h * (K::b[i + 1] * (real(1) - K::c[i + 1]));
        }
        for (int i = 0; i < s; ++i) weight[i] = -h * K::b[i];
    }

    // Begins at q and u, where W is W0.
    void begin(const real* position, const real* velocity, const real* W0) {
        has_history = false;
        until_measured = expected = 0;
        for (int c = 0; c < n; ++c) {
            q[now][c] = position[c];
            u[now][c] = velocity[c];
            w_end[now][c] = W0[c];
        }
    }

    // W at node i of the last step.
    real acceleration(int i, int c) const {
        return i == 0 ? w_end[then][c] : i < s - 1 ? w[last][(i - 1) * room + c] : w_end[now][c];
    }

    // Takes over a step that was taken otherwise: acceleration_at(i, c) at node i.
    template <class Acceleration>
    void recall(const real* position, const real* velocity, const Acceleration& acceleration_at) {
        begin(position, velocity, w_end[now]);
        has_history = true;
        for (int c = 0; c < n; ++c) {
            w_end[then][c] = acceleration_at(0, c);
            for (int i = 0; i < m; ++i) w[last][i * room + c] = acceleration_at(i + 1, c);
            w_end[now][c] = acceleration_at(s - 1, c);
        }
    }

    // One step, h from `time`. False, and nothing has moved, where the sweeps do not contract.
    bool step(const typename K::Coefficients& k, real time) {
        if constexpr (in_registers) {
            InRegisters nodes;
            return step_in(nodes, k, time);
        } else {
            return step_in(memory, k, time);
        }
    }

private:
    LOBATTO_INLINE bool step_in(Nodes& a, const typename K::Coefficients& k, real time) {
        if (has_history)
            predict<true>(a);
        else
            predict<false>(a);
        if (m > 0 && !solve(a, k, time)) return false;
        return finish(a, k, time);
    }

    int next() const { return 3 - now - then; }
    // The coordinates of node i in one of the arrays of Nodes.
    LOBATTO_INLINE static Row row(V* nodes, int i = 0) { return {nodes + i * parts}; }
    LOBATTO_INLINE static Row row(real* nodes, int i = 0) { return nodes + i * room; }
    // W at inner node i, the position at the end and W there, of the step that is being solved.
    LOBATTO_INLINE Row W_at(Nodes& a, int i) {
        if constexpr (in_registers)
            return row(a.W, i);
        else
            return row(w[1 - last], i);
    }
    LOBATTO_INLINE Row arrival_of(Nodes& a) {
        if constexpr (in_registers)
            return row(a.q1);
        else
            return q[next()];
    }
    LOBATTO_INLINE Row W_at_end(Nodes& a) {
        if constexpr (in_registers)
            return row(a.W1);
        else
            return w_end[next()];
    }
    // f(at) for all parts, which begin at coordinate `at`.
    template <class F>
    LOBATTO_INLINE static void over_parts(const F& f) {
        if constexpr (in_registers)
            written_out<width>(parts * width, f);
        else
            for (int at = 0; at < parts * width; at += width) f(at);
    }

    static void call(const typename K::Coefficients& k, real time, Row position, Row W) {
        accelerate_here(k, time, position, W);
    }
    LOBATTO_INLINE static void accelerate_here(const typename K::Coefficients& k, real time, Row position, Row W) {
        if constexpr (K::autonomous)
            K::template acceleration<How>(k, position, W);
        else
            K::template acceleration<How>(k, time, position, W);
    }
    LOBATTO_INLINE static void accelerate(const typename K::Coefficients& k, real time, Row position, Row W) {
        if constexpr (in_registers)
            accelerate_here(k, time, position, W);
        else
            call(k, time, position, W);
    }
    real bound() const { return maximum(tolerance, Limits<real>::epsilon); }

    // The positions at the nodes from the accelerations of the step before.
    template <bool with_history>
    LOBATTO_INLINE void predict(Nodes& a) const {
        over_parts([&](int at) LOBATTO_FORMULA {
            const V Q = V::load(q[now] + at), W_now = V::load(w_end[now] + at);
            const V v = fused(V(weight[0]), W_now, V::load(u[now] + at));
            store_to(row(a.rate), at, v);
            V W[s];
            if constexpr (with_history) {
                W[0] = V::load(w_end[then] + at);
                for (int j = 0; j < m; ++j) W[j + 1] = V::load(w[last] + j * room + at);
                W[s - 1] = W_now;
            }
#pragma GCC unroll 16
            for (int i = 0; i < m; ++i) {
                V x = fused(V(on_velocity[i]), v, Q);
                store_to(row(a.base, i), at, x);
                if constexpr (with_history) {
#pragma GCC unroll 16
                    for (int j = 0; j < s; ++j) x = fused(V(before[i][j]), W[j], x);
                } else {
                    x = fused(V(simple[i]), W_now, x);
                }
                store_to(row(a.X, i), at, x);
            }
        });
    }

    // X = q + h c v - h^2 A W; and, where it `looks`, the largest of what it moved by, measured against the
    // displacement of each coordinate in a step, with the rounding of its position as floor.
    template <bool looks>
    LOBATTO_INLINE real sweep(Nodes& a) {
        constexpr real floor = Limits<real>::epsilon / Limits<real>::root_epsilon;
        const V on_distance = V(floor + Limits<real>::epsilon / bound()), step_size = V(h);
        V worst = V(real(0));
        over_parts([&](int at) LOBATTO_FORMULA {
            V W[inner_room], farthest = V(real(0));
#pragma GCC unroll 16
            for (int j = 0; j < m; ++j) W[j] = load_from<V>(W_at(a, j), at);
#pragma GCC unroll 16
            for (int i = 0; i < m; ++i) {
                V x = load_from<V>(row(a.base, i), at);
#pragma GCC unroll 16
                for (int j = 0; j < m; ++j) x = fused(V(inner[i][j]), W[j], x);
                if constexpr (looks) {
                    const V moved = fabs(x - load_from<V>(row(a.X, i), at));
                    farthest = i == 0 ? moved : maximum(farthest, moved);
                }
                store_to(row(a.X, i), at, x);
            }
            if constexpr (looks) {
                const V rounding = fused(on_distance, fabs(V::load(q[now] + at)), V(Limits<real>::smallest));
                const V speed = fabs(load_from<V>(row(a.rate), at)) + fabs(step_size * V::load(w_end[now] + at));
                const V scale = minimum(fused(fabs(step_size), speed, rounding), V(Limits<real>::largest / real(8)));
                worst = maximum(worst, farthest * rough_inverse(scale));
            }
        });
        return looks ? largest(worst) : real(0);
    }

    // The accelerations at the inner nodes of the step. Where rho is measured, increments themselves go down to
    // rounding: the last ratios are those of the errors that shrink most slowly. Otherwise only sweeps from that on
    // with which the step before ended look at their increments, or from the one before it where rho is small: two
    // increments show whether it still is.
    LOBATTO_INLINE bool solve(Nodes& a, const typename K::Coefficients& k, real time) {
        const bool measures = until_measured == 0;
        const real small = bound();
        constexpr real trusted = real(0.015625);  // of rho, where this step has not shown it
        const int first_look = real(4) * shrinking < trusted ? expected - 1 : expected;
        real e_before = real(0), measured = real(0);
        int enough = 0;  // sweeps, of a step that goes on for the sake of measuring
        for (evaluations = 1; evaluations <= evaluation_limit; ++evaluations) {
#pragma GCC unroll 16
            for (int i = 0; i < m; ++i) accelerate(k, time + K::c[i + 1] * h, row(a.X, i), W_at(a, i));
            if (!measures && evaluations < first_look) {
                sweep<false>(a);
                continue;
            }
            const real e = sweep<true>(a);
            increment = e;
            if (e_before > real(256) * Limits<real>::epsilon) measured = maximum(measured, e / e_before);
            const real known = real(4) * maximum(measured, shrinking);  // 4: the motion changes rho
            if (enough == 0 && known > real(0) && known * e <= small) enough = evaluations;
            const real rho = measures ? real(1) : measured > real(0) ? known : maximum(known, trusted);
            const bool is_rounding = e <= real(16) * small && e >= real(0.5) * e_before && e_before > real(0);
            if (rho * e <= small || is_rounding) {
                if (measured > real(0)) shrinking = measures ? measured : maximum(measured, shrinking);
                until_measured = !measures ? until_measured - 1 : measured > real(0) ? measured_every : 0;
                // Whether one sweep less would have done, or only two together showed that the rest is rounding.
                const bool sooner =
                    is_rounding || real(8) * e <= small || (e_before > real(0) && known * e_before <= small);
                expected = measures && enough > 0 ? enough : sooner && evaluations > 1 ? evaluations - 1 : evaluations;
                return true;
            }
            if (evaluations > 3 && e_before != real(0) && !(e < real(0.8) * e_before || e <= real(16) * small))
                return false;
            e_before = e;
        }
        return false;
    }

    // (D16), (D17): the end of the step, each sum of increments rounded once.
    LOBATTO_INLINE bool finish(Nodes& a, const typename K::Coefficients& k, real time) {
        over_parts([&](int at) LOBATTO_FORMULA {
            V moved = V(h) * load_from<V>(row(a.rate), at), difference = V(weight[0]) * V::load(w_end[now] + at);
#pragma GCC unroll 16
            for (int j = 0; j < m; ++j) {
                const V W = load_from<V>(W_at(a, j), at);
                if constexpr (in_registers) W.store(w[1 - last] + j * room + at);
                moved = fused(V(arrival[j]), W, moved);
                difference = fused(V(weight[j + 1]), W, difference);
            }
            store_to(arrival_of(a), at, V::load(q[now] + at) + moved);
            store_to(row(a.change), at, difference);
        });
        accelerate(k, time + h, arrival_of(a), W_at_end(a));
        V not_finite = V(real(0));
        over_parts([&](int at) LOBATTO_FORMULA {
            const V W1 = load_from<V>(W_at_end(a), at), q1 = load_from<V>(arrival_of(a), at);
            const V u1 = V::load(u[now] + at) + fused(V(weight[s - 1]), W1, load_from<V>(row(a.change), at));
            u1.store(u[next()] + at);
            if constexpr (in_registers) {
                q1.store(q[next()] + at);
                W1.store(w_end[next()] + at);
            }
            not_finite = fused(V(real(0)), u1 + q1, not_finite);
        });
        if (!(sum(not_finite) == real(0))) return false;
        then = std::exchange(now, next());
        last = 1 - last;
        has_history = true;
        return true;
    }
};

}  // namespace lobatto

#endif
