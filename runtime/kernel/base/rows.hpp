// SPDX-License-Identifier: MIT
// Going through the rows of a repeated formula: one after another, or those of neighbouring coordinates side by side in
// the lanes of Packs, in memory or in registers.
//
// In lanes arrays of coordinates have room for room_of<K> numbers: whole Packs and two to spare, where formulas may
// read what does not matter and write zeros.
#ifndef LOBATTO_KERNEL_ROWS_HPP
#define LOBATTO_KERNEL_ROWS_HPP

#include <limits>
#include <type_traits>
#include <utility>

#include "contract.hpp"
#include "numbers.hpp"
#include "pack.hpp"
#include "shifts.hpp"

namespace lobatto {

// What an array of coordinates, a pointer or anything with [], holds.
template <class Array>
using element_of = std::decay_t<decltype(std::declval<const Array&>()[0])>;

// Rows of a repeated formula: its variables x, and what it gives for each, to be added to W, or taken away from it. V:
// a number, of one row; or, `in_lanes`, a Pack of `count` rows that follow one another from `row` on.
template <class V, int variables, bool in_lanes>
struct FormulaRows {
    V x[variables], result[variables]{};
    bool takes[variables]{};  // known to the compiler
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

// Where the ends of a chain are fixed: rows of two neighbours go on beyond its first coordinate, or its last, with zero
// in the place of the coordinate that is not there.
constexpr int free_ends = 0, fixed_before = 1, fixed_behind = 2;

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
// the row before plus one. All runs of more than one row have the same distances between the variables of a row. With
// fixed ends there is one run, over all coordinates, of rows of two neighbours.
template <int variables, const auto& indices, int fixed_ends = free_ends>
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

    static constexpr int reach() { return farthest_within(std::numeric_limits<int>::max()); }

    // Adds to W (or sets it) what `count` rows from `begin` on give, as many at a time as V has lanes for them. What
    // variable j receives belongs offset(j) places behind what the first receives: those lanes move on from one V to
    // the next, so that each place of W is written once. Those that are far away are added where they belong.
    template <class V, bool adds, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void run(int begin, int count, Position q, Slope W, const Formula& formula) {
        using number = real_of<V>;
        constexpr bool in_lanes = !std::is_same_v<V, element_of<Position>>;
        constexpr int width = in_lanes ? lanes_of<V> : 1;
        constexpr std::make_integer_sequence<int, variables> every{};
        static_assert(fixed_ends == free_ends || (variables == 2 && offset(0) + offset(1) == 1));
        const int first = indices[begin * variables] + least();
        constexpr bool overlaps = farthest_within(width) > 0;  // what is loaded for one V serves the next too
        V before[variables], here = load_from<V>(q, first);
        bool takes[variables]{};
        for (int j = 0; j < variables; ++j) before[j] = V(number(0));
        if constexpr ((fixed_ends & fixed_before) != 0) before_first<V, in_lanes>(begin, here, formula, before);
        const auto add = [&](int r, auto is_whole) LOBATTO_FORMULA {
            const int at = first + r;
            FormulaRows<V, variables, in_lanes> rows;
            rows.row = begin + r;
            rows.count = is_whole ? width : count - r;
            if constexpr (!overlaps) here = load_from<V>(q, at);
            V there = here;
            if constexpr (overlaps) {
                // One by one, no zero stands behind the last coordinate.
                if constexpr (in_lanes || is_whole || (fixed_ends & fixed_behind) == 0)
                    there = load_from<V>(q, at + width);
                else
                    there = V(number(0));
            }
            each(every, [&](auto j) LOBATTO_FORMULA {
                if constexpr (offset(j) > width)
                    rows.x[j] = load_from<V>(q, at + offset(j));
                else
                    rows.x[j] = further<width, offset(j)>(here, there);
            });
            here = there;
            formula(rows);
            V sum = V(number(0));
            if constexpr (adds) sum = load_from<V>(W, at);
            each(every, [&](auto j) LOBATTO_FORMULA {
                V& result = rows.result[j];
                if constexpr (in_lanes) {
                    // The row at the fixed end gives to its first variable only.
                    constexpr bool is_end = (fixed_ends & fixed_behind) != 0 && offset(j) > 0;
                    if constexpr (!is_whole) result = first_lanes(result, count - (is_end ? 1 : 0) - r);
                }
                takes[j] = rows.takes[j];
                if constexpr (offset(j) > width)
                    store_to(W, at + offset(j), joined(load_from<V>(W, at + offset(j)), result, takes[j]));
                else if constexpr (!adds && j == 0)
                    sum = sign(passed_on<width, offset(j)>(before[j], result), takes[j]);
                else
                    sum = joined(sum, passed_on<width, offset(j)>(before[j], result), takes[j]);
                before[j] = result;
            });
            store_to(W, at, sum);
        };
        constexpr bool last_apart = !in_lanes && (fixed_ends & fixed_behind) != 0;
        const int whole = last_apart ? count - 1 : count / width * width;
        if constexpr (are_registers<Position>)
            written_out<width>(whole, [&](int r) LOBATTO_FORMULA { add(r, std::true_type()); });
        else
            for (int r = 0; r < whole; r += width) add(r, std::true_type());
        int behind = whole;
        if constexpr (in_lanes || last_apart) {
            if (whole < count) {
                add(whole, std::false_type());
                behind += width;
            }
        }
        if ((fixed_ends & fixed_behind) == 0 && behind < count + farthest_within(width)) {
            V sum = V(number(0));
            if constexpr (adds) sum = load_from<V>(W, first + behind);
            each(every, [&](auto j) LOBATTO_FORMULA {
                if constexpr (offset(j) > 0 && offset(j) <= width)
                    sum = joined(sum, passed_on<width, offset(j)>(before[j], V(number(0))), takes[j]);
            });
            store_to(W, first + behind, sum);
        }
    }

    template <class number, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void one_row(int row, Position q, Slope W, const Formula& formula) {
        FormulaRows<number, variables, false> one;
        one.row = row;
        one.count = 1;
        for (int j = 0; j < variables; ++j) one.x[j] = q[indices[row * variables + j]];
        formula(one);
        for (int j = 0; j < variables; ++j) add_to(W, indices[row * variables + j], sign(one.result[j], one.takes[j]));
    }

    // The rows at the fixed ends of a chain of `count` coordinates, by themselves.
    template <class number, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void end_rows(int count, Position q, Slope W, const Formula& formula) {
        const auto end_row = [&](int place, bool is_behind) LOBATTO_FORMULA {
            FormulaRows<number, variables, false> one;
            one.row = 0;
            one.count = 1;
            for (int j = 0; j < variables; ++j) one.x[j] = (offset(j) == 0) == is_behind ? q[place] : number(0);
            formula(one);
            for (int j = 0; j < variables; ++j)
                if ((offset(j) == 0) == is_behind) add_to(W, place, sign(one.result[j], one.takes[j]));
        };
        if constexpr ((fixed_ends & fixed_before) != 0) end_row(0, false);
        if constexpr ((fixed_ends & fixed_behind) != 0) end_row(count - 1, true);
    }

    // The one run, with the rows at the fixed ends where they are rows as others are.
    template <class V, bool adds, const auto& runs, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void entire(Position q, Slope W, const Formula& formula) {
        run<V, adds>(runs[0], runs[1] + ((fixed_ends & fixed_behind) != 0 ? 1 : 0), q, W, formula);
    }

    // All runs of `runs`, pairs (first row, how many).
    template <class V, const auto& runs, class Position, class Slope, class Formula>
    LOBATTO_INLINE static void all(Position q, Slope W, const Formula& formula) {
        static_assert(fixed_ends == free_ends);
        constexpr int run_count = sizeof(runs) / sizeof(runs[0]) / 2;
        if constexpr (are_registers<Position>) {
            each(std::make_integer_sequence<int, run_count>(), [&](auto i) LOBATTO_FORMULA {
                constexpr int begin = runs[2 * decltype(i)::value], count = runs[2 * decltype(i)::value + 1];
                if constexpr (count >= long_run)
                    run<V, true>(begin, count, q, W, formula);
                else
                    written_out<1>(count,
                                   [&](int r) LOBATTO_FORMULA { one_row<real_of<V>>(begin + r, q, W, formula); });
            });
        } else {
            for (int i = 0; i < run_count; ++i) {
                const int begin = runs[2 * i], count = runs[2 * i + 1];
                if (count >= long_run)
                    run<V, true>(begin, count, q, W, formula);
                else
                    for (int row = begin; row < begin + count; ++row) one_row<element_of<Position>>(row, q, W, formula);
            }
        }
    }

private:
    // What the row at the fixed end before coordinate `here` gives, in the last lane.
    template <class V, bool in_lanes, class Formula>
    LOBATTO_INLINE static void before_first(int begin, const V& here, const Formula& formula, V* before) {
        using number = real_of<V>;
        constexpr int width = in_lanes ? lanes_of<V> : 1;
        FormulaRows<V, variables, in_lanes> rows;
        rows.row = begin;
        rows.count = width;
        for (int j = 0; j < variables; ++j)
            rows.x[j] = offset(j) == 0 ? V(number(0)) : passed_on<width, width - 1>(V(number(0)), here);
        formula(rows);
        for (int j = 0; j < variables; ++j) before[j] = rows.result[j];
    }
    template <class V>
    LOBATTO_INLINE static V sign(const V& given, bool takes) {
        return takes ? -given : given;
    }
    template <class V>
    LOBATTO_INLINE static V joined(const V& sum, const V& given, bool takes) {
        return takes ? sum - given : sum + given;
    }
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

// An emitted kernel goes through its rows in one of these ways. One after another, for any type of number.
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
    template <int count, int variables, const auto& indices, const auto& runs, int fixed_ends = free_ends, class number,
              class Formula>
    LOBATTO_INLINE static void add_rows(const number* q, number* W, const Formula& formula) {
        RowLoop<variables, indices>::template all<number, runs>(q, W, formula);
        RowLoop<variables, indices, fixed_ends>::template end_rows<number>(count, q, W, formula);
    }
    // The same where the rows are one run that reaches all of W, of `count`, on which nothing stands yet.
    template <int count, int variables, const auto& indices, const auto& runs, int fixed_ends = free_ends, class number,
              class Formula>
    LOBATTO_INLINE static void set_rows(const number* q, number* W, const Formula& formula) {
        if constexpr (RowLoop<variables, indices>::reach() <= 1) {
            RowLoop<variables, indices, fixed_ends>::template entire<number, false, runs>(q, W, formula);
        } else {
            clear<count>(W);
            add_rows<count, variables, indices, runs, fixed_ends>(q, W, formula);
        }
    }
};

// The same, but each entry of W is given away as soon as it is known, with its coordinate no longer needed
// (K::immediate); masses are the receiver's.
struct Immediate {
    template <int count, int variables, const auto& indices, const auto& runs, int fixed_ends = free_ends, class number,
              class Receiver, class Formula>
    LOBATTO_INLINE static void set_rows(const number* q, Receiver W, const Formula& formula) {
        static_assert(RowLoop<variables, indices>::reach() <= 1);
        RowLoop<variables, indices, fixed_ends>::template entire<number, false, runs>(q, W, formula);
    }
    template <int, class Receiver, class Factor>
    LOBATTO_INLINE static void scale(Receiver, const Factor*) {}
};

// Those of a run side by side in a Pack; what the next two share.
struct InLanes {
    template <class real>
    using NativePack = Pack<real, native_lanes<real>>;

    template <class real>
    static NativePack<real> pack_of(real*);
    template <class V, int parts>
    static V pack_of(Registers<V, parts>);

    template <int count, int variables, const auto& indices, const auto& runs, int fixed_ends = free_ends,
              class Position, class Slope, class Formula>
    LOBATTO_INLINE static void add_rows(Position q, Slope W, const Formula& formula) {
        using V = decltype(pack_of(W));
        if constexpr (fixed_ends != free_ends)
            RowLoop<variables, indices, fixed_ends>::template entire<V, true, runs>(q, W, formula);
        else
            RowLoop<variables, indices>::template all<V, runs>(q, W, formula);
    }
    template <int count, int variables, const auto& indices, const auto& runs, int fixed_ends = free_ends,
              class Position, class Slope, class Formula>
    LOBATTO_INLINE static void set_rows(Position q, Slope W, const Formula& formula) {
        RowLoop<variables, indices, fixed_ends>::template entire<decltype(pack_of(W)), false, runs>(q, W, formula);
    }
};

// Side by side, of plain numbers in arrays with room.
struct SideBySide : InLanes {
    template <int count, class real>
    LOBATTO_INLINE static void clear(real* W) {
        for (int i = 0; i < count; i += native_lanes<real>) NativePack<real>(real(0)).store(W + i);
    }
    template <int count, class real>
    LOBATTO_INLINE static void scale(real* W, const real* factor) {
        using V = NativePack<real>;
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
            using V = NativePack<real>;
            (V::load(W + place - lane) + only_lane<lane, lanes_of<V>>(x)).store(W + place - lane);
        }
    };
    template <int place, class real>
    LOBATTO_INLINE static Place<real, place> at(real* W) {
        return {W};
    }
};

// Side by side in registers, all written out.
struct WrittenOut : InLanes {
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
};

// How many numbers an array of coordinates holds.
template <class K>
constexpr int room_of = (K::coordinates / native_lanes<typename K::real> + 3) * native_lanes<typename K::real>;

}  // namespace lobatto

#endif
