// SPDX-License-Identifier: MIT
// The step of a large separable system whose terms join neighbouring coordinates, which lie in the lanes of Packs.
//
// The same iterations as in iteration/fixed_point.hpp, formula numbers (D..) of docs/derivation.md: accelerations W of
// all nodes, then the stage map. What is different is the layout: of each node all coordinates stand one after another,
// and every loop runs over them, so that the cost of a step is proportional to their number. Increments shrink by a
// factor rho in each iteration, so W at positions that moved by e at last errs by rho e: the iteration ends when that
// is rounding, or as much as is asked for, without an evaluation at the new positions.
#ifndef LOBATTO_KERNEL_NEIGHBOURS_HPP
#define LOBATTO_KERNEL_NEIGHBOURS_HPP

#include <type_traits>
#include <utility>

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "../base/rows.hpp"
#include "../base/shifts.hpp"
#include "convergence.hpp"
#include "stage_coefficients.hpp"

namespace lobatto {

// Whether the inner nodes of a step fit the registers of AVX-512, of which there are 32: these hold positions,
// accelerations and what is under way.
template <class K>
constexpr bool fits_registers() {
    using real = typename K::real;
    constexpr int width = native_lanes<real>, parts = (K::coordinates + width - 1) / width;
    return width * sizeof(real) == 64 && parts * (K::points - 2) <= 16 && K::row_reach >= 0 && K::row_reach <= width;
}

// One trajectory; its state, the memory of its last step, and room for the next. Most steps are quick ones: as many
// iterations as the last measurement found enough, and one test of the last increment, in registers, all written out,
// or in memory; to the same bits. A step that does not pass, and now and then one to measure with, is taken carefully:
// in memory, and every iteration measures its increments.
template <class K, bool in_registers = fits_registers<K>()>
struct NeighbourFixedPoint {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2;
    static_assert(m > 0);
    static constexpr int width = native_lanes<real>, room = room_of<K>, parts = (n + width - 1) / width;
    static constexpr int evaluation_limit = 16, longest_interval = 256, shortest_interval = 4;
    using V = Pack<real, width>;

    real before[m][s];           // -h^2 A E: from the accelerations of the step before (D15)
    real inner[m][m];            // -h^2 A
    real simple[m];              // the row sums of the latter
    real on_velocity[m];         // h c
    real weight[s], arrival[m];  // -h b and -h^2 b (1 - c)
    real h{};
    real tolerance{};        // of increments, relative; 0: to rounding
    real least_increment{};  // what the rounding of forces moves positions by, where that is known
    real shrinking{};        // rho, as last measured; 0: never
    real measured_for{};     // the tolerance
    real noise{};            // increments to this tolerance that were rounding, and those up to twice as large
    int until_measured{};    // steps
    int interval{};          // between the last two measurements, in steps
    int expected{};          // iterations of a quick step; 0: unknown
    int late{};              // how many of the last quick steps, without a break, took more
    // Squares of increments that are small enough: on_rate v^2 + still, the latter as in the last careful step.
    real on_rate{};
    alignas(V) real still[room]{};
    bool has_history{};
    int now{}, then{1};                                            // the present, the beginning of the last step, of
    alignas(V) real q[3][room]{}, u[3][room]{}, w_end[3][room]{};  // position, velocity, W there
    int last{};                                                    // the last step, of
    alignas(V) real w[2][m * room]{};                              // W at the inner nodes
    int evaluations{};                                             // of the last step
    real increment{};                                              // the last one that was measured, relative

    // Of the step that is being solved: positions of the inner nodes, q + h c v, v, and what u changes by. In registers
    // also W and the end of the step, which otherwise are written where they belong.
    struct InMemory {
        alignas(V) real X[m * room]{}, base[m * room]{}, rate[room]{}, change[room]{};
    };
    struct InRegisters {
        V X[m * parts], base[m * parts], rate[parts], change[parts];
        V W[m * parts], q1[parts], W1[parts];
    };
    InMemory memory{};

    void prepare(const typename K::Coefficients&, real step_size) {
        h = step_size;
        forget();
        for (int i = 0; i < m; ++i) {
            for (int j = 0; j < m; ++j) inner[i][j] = -h * h * stage_coefficients<K>.map[i][j];
            for (int l = 0; l < s; ++l) before[i][l] = -h * h * stage_coefficients<K>.before[i][l];
            simple[i] = -h * h * stage_coefficients<K>.sum[i];
            arrival[i] = -h * h * stage_coefficients<K>.map[m][i];
            on_velocity[i] = h * K::c[i + 1];
        }
        for (int i = 0; i < s; ++i) weight[i] = -h * K::b[i];
    }

    // Begins at q and u, where W is W0.
    void begin(const real* position, const real* velocity, const real* W0) {
        forget();
        for (int c = 0; c < n; ++c) {
            q[now][c] = position[c];
            u[now][c] = velocity[c];
            w_end[now][c] = W0[c];
        }
    }

    // Position and velocity now.
    void state(real* position, real* velocity) const {
        copy_lanes<n>(q[now], position);
        copy_lanes<n>(u[now], velocity);
    }

    // W at node i of the last step.
    real minus_acceleration(int i, int c) const {
        return i == 0 ? w_end[then][c] : i < s - 1 ? w[last][(i - 1) * room + c] : w_end[now][c];
    }

    // Takes over a step that was taken otherwise: minus_acceleration_at(i, c) at node i.
    template <class Acceleration>
    void recall(const real* position, const real* velocity, const Acceleration& minus_acceleration_at) {
        begin(position, velocity, w_end[now]);
        has_history = true;
        for (int c = 0; c < n; ++c) {
            w_end[then][c] = minus_acceleration_at(0, c);
            for (int i = 0; i < m; ++i) w[last][i * room + c] = minus_acceleration_at(i + 1, c);
            w_end[now][c] = minus_acceleration_at(s - 1, c);
        }
    }

    // One step, h from `time`. False, and nothing has moved, where the iterations do not contract.
    bool step(const typename K::Coefficients& k, real time) {
        if (tolerance != measured_for) {
            until_measured = 0;
            noise = real(0);
        }
        int spent = 0;  // iterations of a quick step that was none
        if (expected > 0 && until_measured > 0) {
            bool good;
            if constexpr (in_registers) {
                InRegisters nodes;
                good = quick_step(nodes, k, time);
            } else {
                good = quick_step(memory, k, time);
            }
            if (good) {
                --until_measured;
                late = evaluations > expected ? late + 1 : 0;
                if (late > 3) expected = evaluations;
                return true;
            }
            spent = evaluations;
        }
        const bool good = careful_step(k, time);
        evaluations += spent;
        return good;
    }

private:
    void forget() {
        has_history = false;
        shrinking = noise = real(0);
        until_measured = interval = expected = late = 0;
    }
    int next() const { return 3 - now - then; }
    // The coordinates of node i in one of the arrays of a step.
    LOBATTO_INLINE static Registers<V, parts> row(V* nodes, int i = 0) { return {nodes + i * parts}; }
    LOBATTO_INLINE static real* row(real* nodes, int i = 0) { return nodes + i * room; }
    // W at inner node i, the position at the end and W there, of the step that is being solved.
    LOBATTO_INLINE Registers<V, parts> W_at(InRegisters& a, int i) { return row(a.W, i); }
    LOBATTO_INLINE real* W_at(InMemory&, int i) { return row(w[1 - last], i); }
    LOBATTO_INLINE Registers<V, parts> arrival_of(InRegisters& a) { return row(a.q1); }
    LOBATTO_INLINE real* arrival_of(InMemory&) { return q[next()]; }
    LOBATTO_INLINE Registers<V, parts> W_at_end(InRegisters& a) { return row(a.W1); }
    LOBATTO_INLINE real* W_at_end(InMemory&) { return w_end[next()]; }
    // f(at) for all parts, which begin at coordinate `at`.
    template <class Nodes, class F>
    LOBATTO_INLINE static void over_parts(const F& f) {
        if constexpr (std::is_same_v<Nodes, InRegisters>)
            written_out<width>(parts * width, f);
        else
            for (int at = 0; at < parts * width; at += width) f(at);
    }

    template <class How, class Row>
    LOBATTO_INLINE static void accelerate_here(const typename K::Coefficients& k, real time, Row position, Row W) {
        Formulas<K>::template along_rows<How>(k, time, position, W);
    }
    // In memory one copy of the formulas serves all nodes.
    static void accelerate(const typename K::Coefficients& k, real time, real* position, real* W) {
        accelerate_here<SideBySide>(k, time, position, W);
    }
    LOBATTO_INLINE static void accelerate(const typename K::Coefficients& k, real time, Registers<V, parts> position,
                                          Registers<V, parts> W) {
        accelerate_here<WrittenOut>(k, time, position, W);
    }
    template <class Nodes>
    LOBATTO_INLINE void accelerate_nodes(Nodes& a, const typename K::Coefficients& k, real time) {
#pragma GCC unroll 16
        for (int i = 0; i < m; ++i) accelerate(k, time + K::c[i + 1] * h, row(a.X, i), W_at(a, i));
    }

    // One iteration more than expected, or two, are no reason for a careful step.
    template <class Nodes>
    LOBATTO_INLINE bool quick_step(Nodes& a, const typename K::Coefficients& k, real time) {
        predict<true>(a);
        for (evaluations = 1;; ++evaluations) {
            accelerate_nodes(a, k, time);
            if (evaluations >= expected) {
                if (is_settled(a)) break;
                if (evaluations > expected + 1) return false;
            }
            iterate(a);
        }
        return finish(a, k, time);
    }
    bool careful_step(const typename K::Coefficients& k, real time) {
        if (has_history)
            predict<true>(memory);
        else
            predict<false>(memory);
        if (!solve(k, time)) return false;
        return finish(memory, k, time);
    }

    real bound() const {
        return maximum(tolerance, Limits<real>::epsilon);
    }
    // What increments are measured against beside the displacement of each coordinate in a step: the rounding of its
    // position, relative to the bound.
    real on_distance() const {
        return Limits<real>::epsilon / Limits<real>::root_epsilon + Limits<real>::epsilon / bound();
    }

    // The positions at the nodes from the accelerations of the step before.
    template <bool with_history, class Nodes>
    LOBATTO_INLINE void predict(Nodes& a) const {
        over_parts<Nodes>([&](int at) LOBATTO_FORMULA {
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

    // f(i, x): x = (q + h c v - h^2 A W)_i of all inner nodes, for the part that begins at coordinate `at`.
    template <class Nodes, class F>
    LOBATTO_INLINE void map_stages(Nodes& a, int at, const F& f) {
        V W[m];
#pragma GCC unroll 16
        for (int j = 0; j < m; ++j) W[j] = load_from<V>(W_at(a, j), at);
#pragma GCC unroll 16
        for (int i = 0; i < m; ++i) {
            V x = load_from<V>(row(a.base, i), at);
#pragma GCC unroll 16
            for (int j = 0; j < m; ++j) x = fused(V(inner[i][j]), W[j], x);
            f(i, x);
        }
    }
    template <class Nodes>
    LOBATTO_INLINE void iterate(Nodes& a) {
        over_parts<Nodes>([&](int at) LOBATTO_FORMULA {
            map_stages(a, at, [&](int i, const V& x) LOBATTO_FORMULA { store_to(row(a.X, i), at, x); });
        });
    }
    // What increments of coordinates that hardly move are measured against: the rounding of the largest displacement in
    // a step, or that of forces. A blow must not be followed down to the denormal numbers that run ahead of it.
    real least_distance() const {
        V most = V(real(0));
        over_parts<InMemory>([&](int at) LOBATTO_FORMULA { most = maximum(most, displacement(at)); });
        return maximum(Limits<real>::epsilon * minimum(largest(most), Limits<real>::largest / real(8)),
                       least_increment / bound());
    }
    LOBATTO_INLINE V displacement(int at) const {
        return V(fabs(h)) * (fabs(V::load(memory.rate + at)) + fabs(V(h) * V::load(w_end[now] + at)));
    }
    // An iteration and its increment: the largest of what it moves by, measured against the displacement of each
    // coordinate in a step, or what is `least`, with the rounding of its position as floor.
    real measured_iteration(InMemory& a, real least) {
        const V on_position = V(on_distance()), floor = V(least + Limits<real>::smallest);
        V worst = V(real(0));
        over_parts<InMemory>([&](int at) LOBATTO_FORMULA {
            V farthest = V(real(0));
            map_stages(a, at, [&](int i, const V& x) LOBATTO_FORMULA {
                const V moved = fabs(x - V::load(row(a.X, i) + at));
                farthest = i == 0 ? moved : maximum(farthest, moved);
                x.store(row(a.X, i) + at);
            });
            const V rounding = fused(on_position, fabs(V::load(q[now] + at)), floor);
            const V scale = minimum(displacement(at) + rounding, V(Limits<real>::largest / real(8)));
            worst = maximum(worst, farthest * rough_inverse(scale));
        });
        return largest(worst);
    }
    // Whether another iteration would move no coordinate by more than is small enough; in squares, which are the fewest
    // instructions, summed over the nodes. Of the differences only the signs are asked for.
    template <class Nodes>
    LOBATTO_INLINE bool is_settled(Nodes& a) {
        Bits<real, width> signs(0);
        over_parts<Nodes>([&](int at) LOBATTO_FORMULA {
            V moved = V(real(0));
            map_stages(a, at, [&](int i, const V& x) LOBATTO_FORMULA {
                const V d = x - load_from<V>(row(a.X, i), at);
                moved = i == 0 ? d * d : fused(d, d, moved);
            });
            const V rate = load_from<V>(row(a.rate), at);
            signs = signs | bits(fused(V(on_rate) * rate, rate, V::load(still + at)) - moved);
        });
        return !any(is_odd(signs >> (8 * static_cast<int>(sizeof(real)) - 1)));
    }
    // Makes increments of `enough` small enough, relative to what they are measured against by measured_iteration:
    // of which the next steps compute the part of the velocity anew. False where squares are too small or too large for
    // numbers: then no step is quick.
    bool settle_at(real enough, real least) {
        on_rate = (enough * h) * (enough * h);
        V most = V(real(0));
        over_parts<InMemory>([&](int at) LOBATTO_FORMULA {
            const V bent = fused(V(h * h), fabs(V::load(w_end[now] + at)), V(least));
            const V distance = V(enough) * fused(V(on_distance()), fabs(V::load(q[now] + at)), bent);
            (distance * distance).store(still + at);
            most = maximum(most, distance * distance);
        });
        const real farthest = least / Limits<real>::epsilon;  // displacement of a coordinate in a step
        return largest(most) > Limits<real>::smallest / Limits<real>::epsilon && is_finite(sum(most) + on_rate) &&
               farthest * farthest < Limits<real>::largest * Limits<real>::epsilon;
    }

    // The accelerations at the inner nodes of a careful step. Where rho is measured, increments themselves go down to
    // rounding: the last ratios are those of the errors that shrink most slowly.
    bool solve(const typename K::Coefficients& k, real time) {
        const bool measures = until_measured == 0;
        const real small = bound(), least = least_distance();
        const Convergence<real> rule{small};
        constexpr real trusted = real(0.015625);  // of rho, where this step has not shown it
        real e_before = real(0), measured = real(0), after[evaluation_limit + 1];  // so many iterations
        for (evaluations = 1; evaluations <= evaluation_limit; ++evaluations) {
            accelerate_nodes(memory, k, time);
            const real e = measured_iteration(memory, least);
            increment = after[evaluations] = e;
            if (e_before > real(256) * Limits<real>::epsilon) measured = maximum(measured, e / e_before);
            const real known = real(4) * maximum(measured, shrinking);  // 4: the motion changes rho
            const real rho = measures ? real(1) : measured > real(0) ? known : maximum(known, trusted);
            const bool is_rounding = e_before > real(0) && rule.stagnates(e, e_before);
            if (rho * e <= small || is_rounding) {
                if (measured > real(0)) shrinking = measures ? measured : maximum(measured, shrinking);
                real enough = shrinking > real(0) ? small / maximum(real(4) * shrinking, trusted) : small;
                if (is_rounding) noise = maximum(noise, minimum(real(2) * e, real(4) * small));
                enough = maximum(enough, noise);
                if (measures) {
                    measured_for = tolerance;
                    interval = minimum(maximum(4 * interval, shortest_interval), longest_interval);
                    until_measured = interval;
                    expected = 1;
                    while (expected < evaluations && after[expected] > enough) ++expected;
                } else {
                    until_measured = interval = shortest_interval;
                    expected = evaluations;
                }
                if (!settle_at(enough, least)) expected = 0;
                return true;
            }
            if (evaluations > rule.judged_after && e_before != real(0) && !rule.contracts(e, e_before)) return false;
            e_before = e;
        }
        return false;
    }

    // (D16), (D17): the end of the step, each sum of increments rounded once.
    template <class Nodes>
    LOBATTO_INLINE bool finish(Nodes& a, const typename K::Coefficients& k, real time) {
        constexpr bool stores = std::is_same_v<Nodes, InRegisters>;
        over_parts<Nodes>([&](int at) LOBATTO_FORMULA {
            V moved = V(h) * load_from<V>(row(a.rate), at), difference = V(weight[0]) * V::load(w_end[now] + at);
#pragma GCC unroll 16
            for (int j = 0; j < m; ++j) {
                const V W = load_from<V>(W_at(a, j), at);
                if constexpr (stores) W.store(w[1 - last] + j * room + at);
                moved = fused(V(arrival[j]), W, moved);
                difference = fused(V(weight[j + 1]), W, difference);
            }
            store_to(arrival_of(a), at, V::load(q[now] + at) + moved);
            store_to(row(a.change), at, difference);
        });
        accelerate(k, time + h, arrival_of(a), W_at_end(a));
        V not_finite = V(real(0));
        over_parts<Nodes>([&](int at) LOBATTO_FORMULA {
            const V W1 = load_from<V>(W_at_end(a), at), q1 = load_from<V>(arrival_of(a), at);
            const V u1 = V::load(u[now] + at) + fused(V(weight[s - 1]), W1, load_from<V>(row(a.change), at));
            u1.store(u[next()] + at);
            if constexpr (stores) {
                q1.store(q[next()] + at);
                W1.store(w_end[next()] + at);
            }
            not_finite = fused(V(real(0)), u1 + q1, not_finite);
        });
        if (any(not_finite != V(real(0)))) return false;
        then = std::exchange(now, next());
        last = 1 - last;
        has_history = true;
        return true;
    }
};

template <class K>
struct FixedPointOf<K, true> {
    using type = NeighbourFixedPoint<K>;
};

}  // namespace lobatto

#endif
