// SPDX-License-Identifier: MIT
// The step of many trajectories of a separable system side by side, one in each lane, by iterations over its nodes.
//
// Formula numbers (D..) refer to docs/derivation.md. The unknown is what the nodes X still have to move by (D41): with
// the stage map M = -h^2 P A (iteration/stage_map.hpp), W and S = dW/dq at X and the sums P that X was made with,
//     delta = d + M (S - D) delta,    d = M (W - D X) - P
// to first order. Where S pays (K::uses_hessian) one evaluation gives both sides, and delta follows by repetition;
// elsewhere delta = d. X moves by delta and is evaluated again until delta is small.
//
// No lane sees its neighbours: one that is solved stands still while others go on, and what is computed of it again
// has the same bits. A step need not wait for its tests of convergence: what they need is computed beside it.
#ifndef LOBATTO_KERNEL_ENSEMBLE_FIXED_POINT_HPP
#define LOBATTO_KERNEL_ENSEMBLE_FIXED_POINT_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "convergence.hpp"
#include "ensemble_tables.hpp"
#include "lane_state.hpp"

namespace lobatto {

template <class K, class T>
struct EnsembleFixedPoint : EnsembleTables<K, T> {
    using real = typename K::real;
    using Tables = EnsembleTables<K, T>;
    using Tables::h, Tables::usable, Tables::has_history, Tables::w, Tables::rest, Tables::diagonal, Tables::node_time,
        Tables::weight, Tables::arrival, Tables::map_of, Tables::reach, Tables::settled, Tables::near;
    using Tables::n, Tables::s, Tables::m, Tables::inner_room, Tables::absorbs, Tables::entries, Tables::parts;
    using typename Tables::ActiveMask;
    static constexpr int values = inner_room * n;  // node by node
    static constexpr int evaluation_limit = 16;
    struct EndWeights {  // made where they are used: a device has no address of K's own
        real first = K::b[0], last = K::b[s - 1];
    };

    struct Arrays {
        T P[values], X[values], W[values], S[inner_room * entries], d[values], delta[values], bend[values];
        T rate[n], inverse_scale[n], inverse_next[n], inverse_linear[n];
    };

    T evaluations;  // of the last step
    T drifting[n];  // the velocity before the last kick, so that the next step need not wait for it
    Workspace<Arrays> workspace;

    void begin(const real* q, const real* u, const real* W0, int lane) {
        Tables::begin(q, W0, lane);
        for (int c = 0; c < n; ++c) set_lane(drifting[c], lane, u[c] + h * K::b[s - 1] * W0[c]);
    }
    template <class Acceleration, class Position>
    void recall(const real* u, const Acceleration& minus_acceleration, const Position& position, int lane) {
        Tables::recall(minus_acceleration, position, lane);
        for (int c = 0; c < n; ++c) set_lane(drifting[c], lane, u[c] + h * K::b[s - 1] * minus_acceleration(s - 1, c));
    }

    // One step of the lanes that are `active`, h from `time`, one number or one a lane. The lanes that the answer names
    // have moved; the others stay.
    template <class Given, class Time>
    LOBATTO_INLINE ActiveMask step(const Given& k, const Time& time, T* q, T* u, ActiveMask active) {
        return workspace.with([&](Arrays& a) LOBATTO_FORMULA {
            begin_step(q, u, a);
            active = active & usable;
            if constexpr (m == 0)
                evaluations = T(real(0));
            else if constexpr (K::uses_hessian)
                active = solve_with_slopes(k, time, active, a);
            else
                active = solve(k, time, active, a);
            return any(active) ? finish(k, time, q, u, active, a) : active;
        });
    }

private:
    // start + sum_j column_j r_j, r_j `stride` apart.
    template <int terms>
    LOBATTO_INLINE static T sum_of(const T& start, const T (*column)[parts], int p, const T* r, int stride) {
        T even = start, odd = T(real(0));
#pragma GCC unroll 16
        for (int j = 0; j < terms; ++j)
            if (terms > 3 && j % 2 == 1)
                odd = j == 1 ? column[j][p] * r[j * stride] : fused(column[j][p], r[j * stride], odd);
            else
                even = fused(column[j][p], r[j * stride], even);
        return terms > 3 ? even + odd : even;
    }

    // The measures of increments, and X from the polynomial of the step before. Each coordinate has its own: increments
    // as small as its rounding are so whatever the others do.
    LOBATTO_INLINE void begin_step(const T* q, const T* u, Arrays& a) const {
        constexpr EndWeights end_weight{};
        for (int c = 0; c < n; ++c) {
            const T W0 = w[c * s + s - 1], position = fabs(q[c]);
            a.rate[c] = fused(T(-h * end_weight.first), W0, u[c]);
            const T moved = T(fabs(h)) * (fabs(a.rate[c]) + fabs(T(h) * W0));
            a.inverse_scale[c] = T(real(1)) / maximum(moved, fused(T(settled.part), position, T(settled.least)));
            a.inverse_next[c] = reach * a.inverse_scale[c];
            a.inverse_linear[c] = T(real(1)) / maximum(moved, fused(T(near.part), position, T(near.least)));
            const T rate = fused(T(-h * (end_weight.first + end_weight.last)), W0, drifting[c]);
            const auto& of = map_of(c);
            const T* last;
            if constexpr (absorbs)
                last = rest + c * s;
            else
                last = w + c * s;
            for (int j = 0; j < m; ++j) {
                T& P = a.P[j * n + c];
                if (has_history)
                    P = sum_of<s - 1>(of.before[0][j] * last[0], of.before + 1, j, last + 1, 1);
                else
                    P = of.simple[j] * last[s - 1];
                a.X[j * n + c] = fused(of.on_velocity[j], rate, (absorbs ? of.on_position[j] * q[c] : q[c]) + P);
            }
        }
    }
    // to += M r.
    LOBATTO_INLINE void add_mapped(const T* r, T* to) const {
        for (int c = 0; c < n; ++c)
            for (int j = 0; j < m; ++j) to[j * n + c] = sum_of<m>(to[j * n + c], map_of(c).inner, j, r + c, n);
    }
    // M (W - D X) - P.
    LOBATTO_INLINE void residual(const Arrays& a, T* r) const {
        for (int i = 0; i < values; ++i) r[i] = -a.P[i];
        if constexpr (absorbs) {
            T rest_of[values];
            for (int i = 0; i < values; ++i) rest_of[i] = fused(-diagonal[i % n], a.X[i], a.W[i]);
            add_mapped(rest_of, r);
        } else {
            add_mapped(a.W, r);
        }
    }
    // (S - D) x.
    LOBATTO_INLINE void slopes_times(const Arrays& a, const T* x, T* product) const {
        static constexpr Places place{};
        for (int j = 0; j < m; ++j) {
            T* const sum = product + j * n;
            for (int c = 0; c < n; ++c)
                if constexpr (absorbs)
                    sum[c] = -(diagonal[c] * x[j * n + c]);
                else
                    sum[c] = T(real(0));
#pragma GCC unroll 16
            for (int e = 0; e < K::entries; ++e) {
                const T &S = a.S[j * entries + e], &moved = x[j * n + place.column[e]];
                T& to = sum[place.row[e]];
                to = !absorbs && place.is_first[e] ? S * moved : fused(S, moved, to);
            }
        }
    }
    // Where the entries of S stand, and whether one is the first of its row.
    struct Places {
        int row[entries]{}, column[entries]{};
        bool is_first[entries]{};
        constexpr Places() {
            for (int e = 0; e < K::entries; ++e) {
                row[e] = K::entry_row[e];
                column[e] = K::entry_column[e];
                is_first[e] = true;
                for (int f = 0; f < e; ++f)
                    if (row[f] == row[e]) is_first[e] = false;
            }
        }
    };

    // The sum of (x_i scale_i)^2.
    LOBATTO_INLINE static T size(const T* x, const T* scale) {
        T sum[2] = {T(real(0)), T(real(0))};  // two, which do not wait for each other
        for (int i = 0; i < values; ++i) {
            const T relative = x[i] * scale[i % n];
            T& part = sum[i % 2];
            part = i < 2 ? relative * relative : fused(relative, relative, part);
        }
        return values > 1 ? sum[0] + sum[1] : sum[0];
    }

    template <class Given, class Time>
    LOBATTO_INLINE void evaluate(const Given& k, const Time& time, Arrays& a) const {
#pragma GCC unroll 4
        for (int j = 0; j < m; ++j)
            if constexpr (K::uses_hessian)
                Formulas<K>::node(k, T(time) + node_time[j], a.X + j * n, a.W + j * n, a.S + j * entries);
            else
                Formulas<K>::minus_acceleration(k, T(time) + node_time[j], a.X + j * n, a.W + j * n);
    }
    // W at the nodes X.
    template <class Given, class Time>
    LOBATTO_INLINE void settle(const Given& k, const Time& time, Arrays& a) const {
        for (int j = 0; j < m; ++j)
            Formulas<K>::minus_acceleration(k, T(time) + node_time[j], a.X + j * n, a.W + j * n);
    }

    // X and P of these lanes move on by delta.
    LOBATTO_INLINE static void move_on(ActiveMask active, Arrays& a) {
        for (int i = 0; i < values; ++i) {
            const T delta = select(active, a.delta[i], T(real(0)));
            a.X[i] += delta;
            a.P[i] += delta;
        }
    }
    // The lanes whose stage equations are solved, with W at their nodes X, by evaluations alone.
    template <class Given, class Time>
    LOBATTO_INLINE ActiveMask solve(const Given& k, const Time& time, ActiveMask active, Arrays& a) {
        const Convergence<T, 2> rule{T(settled.enough)};
        T e_before = T(real(0));
        ActiveMask solved = active & !active;
        evaluations = T(real(0));
        for (int evaluation = 1; evaluation <= evaluation_limit && any(active); ++evaluation) {
            evaluate(k, time, a);
            evaluations += select(active, T(real(1)), T(real(0)));
            residual(a, a.delta);
            const T e = size(a.delta, a.inverse_scale);
            const ActiveMask ready = active & rule.reached(e, e_before);
            move_on(active, a);
            solved = solved | ready;
            active = active & !ready;
            if (evaluation > rule.judged_after) active = active & rule.contracts(e, e_before);
            // Not beyond 1: a coordinate that began at rest moves by any multiple of nothing.
            e_before = minimum(e, T(real(1)));
        }
        settle(k, time, a);
        return solved;
    }

    // The same by evaluations with S: X becomes the nodes, and W is carried to them. One iteration with S follows the
    // first evaluation; it is often the last.
    template <class Given, class Time>
    LOBATTO_INLINE ActiveMask solve_with_slopes(const Given& k, const Time& time, ActiveMask active, Arrays& a) {
        evaluate(k, time, a);
        residual(a, a.d);
        slopes_times(a, a.d, a.bend);
        ActiveMask at_first = iterate(a);
        at_first = at_first & S_stands_for_W(a);  // of what the iteration has left, so not in one expression
        evaluations = select(active, T(real(1)), T(real(0)));
        if (any(active & !at_first)) active = evaluate_again(k, time, active, at_first, a);
        for (int i = 0; i < values; ++i) {
            a.X[i] += a.delta[i];
            if constexpr (absorbs) a.bend[i] = fused(diagonal[i % n], a.delta[i], a.bend[i]);
            a.W[i] += a.bend[i];
        }
        return active;
    }
    // The evaluations after the first, each with two iterations; `at_first`: the lanes that need none of them.
    template <class Given, class Time>
    LOBATTO_INLINE ActiveMask evaluate_again(const Given& k, const Time& time, ActiveMask active, ActiveMask at_first,
                                             Arrays& a) {
        const Convergence<T, 2> rule{T(settled.enough)};
        T e_before = T(real(0));
        ActiveMask further = active & !at_first;
        for (int evaluation = 2;; ++evaluation) {
            move_on(further, a);
            evaluate(k, time, a);
            evaluations += select(further, T(real(1)), T(real(0)));
            residual(a, a.d);
            slopes_times(a, a.d, a.bend);
            ActiveMask is_solved = iterate(a);
            is_solved = iterate_others(at_first, is_solved, a);
            is_solved = is_solved & S_stands_for_W(a);
            further = active & !is_solved;
            if (!any(further)) break;
            if (evaluation == evaluation_limit) return active & is_solved;
            if (evaluation >= 3) {
                const T e = size(a.d, a.inverse_scale);
                if (evaluation > rule.judged_after) active = active & (is_solved | rule.contracts(e, e_before));
                e_before = e;
                further = active & further;
            }
        }
        return active;
    }

    LOBATTO_INLINE ActiveMask S_stands_for_W(const Arrays& a) const {
        return size(a.delta, a.inverse_linear) <= T(near.enough);
    }
    // delta = d + M bend, and bend = (S - D) delta; where the next iteration would change nothing: it would move X by M
    // times what `bend` has changed by, at most `reach` times its size.
    LOBATTO_INLINE ActiveMask iterate(Arrays& a) const {
        T change[values];
        for (int i = 0; i < values; ++i) {
            change[i] = a.bend[i];
            a.delta[i] = a.d[i];
        }
        add_mapped(a.bend, a.delta);
        slopes_times(a, a.delta, a.bend);
        for (int i = 0; i < values; ++i) change[i] = a.bend[i] - change[i];
        return size(change, a.inverse_next) <= T(settled.enough);
    }
    // Another iteration, but of the lanes `resting`, whose answer is `known`.
    LOBATTO_INLINE ActiveMask iterate_others(ActiveMask resting, ActiveMask known, Arrays& a) const {
        if (!any(resting)) return iterate(a);
        T bend[values], delta[values];
        for (int i = 0; i < values; ++i) {
            bend[i] = a.bend[i];
            delta[i] = a.delta[i];
        }
        const ActiveMask found = iterate(a);
        for (int i = 0; i < values; ++i) {
            a.bend[i] = select(resting, bend[i], a.bend[i]);
            a.delta[i] = select(resting, delta[i], a.delta[i]);
        }
        return (known & resting) | (found & !resting);
    }

    // (D16), (D17): the end of the step, each sum of increments rounded once; then the memory of the step.
    template <class Given, class Time>
    LOBATTO_INLINE ActiveMask finish(const Given& k, const Time& time, T* q, T* u, ActiveMask solved, const Arrays& a) {
        constexpr EndWeights end_weight{};
        T q1[n], u1[n], W1[n], change[n];
        for (int c = 0; c < n; ++c) {
            const T* const W = a.W + c;
            q1[c] = q[c] + sum_over_nodes(T(h) * a.rate[c], arrival, W);
            change[c] = sum_over_nodes(T(-h * end_weight.first) * w[c * s + s - 1], weight, W);
        }
        Formulas<K>::minus_acceleration(k, T(time + h), q1, W1);
        T not_finite = T(real(0));
        for (int c = 0; c < n; ++c) {
            u1[c] = u[c] + fused(T(-h * end_weight.last), W1[c], change[c]);
            not_finite = fused(T(real(0)), q1[c] + u1[c], not_finite);
        }
        solved = solved & (not_finite == T(real(0)));
        if (all(solved))
            remember<true>(q, u, q1, u1, change, W1, solved, a);
        else if (any(solved))
            remember<false>(q, u, q1, u1, change, W1, solved, a);
        return solved;
    }
    LOBATTO_INLINE static T sum_over_nodes(const T& start, const T* factor, const T* W) {
        T sum = start;
        for (int j = 0; j < m; ++j) sum = fused(factor[j], W[j * n], sum);
        return sum;
    }

    // The end of the step becomes the state, and its accelerations the memory, of all lanes or of those solved.
    template <bool is_all>
    LOBATTO_INLINE void remember(T* q, T* u, const T* q1, const T* u1, const T* change, const T* W1, ActiveMask solved,
                                 const Arrays& a) {
        const auto keep = [&](T& old, const T& value)
                              LOBATTO_FORMULA { old = is_all ? value : select(solved, value, old); };
        for (int c = 0; c < n; ++c) {
            T* const memory = w + c * s;
            keep(memory[0], memory[s - 1]);
            for (int j = 0; j < m; ++j) keep(memory[j + 1], a.W[j * n + c]);
            keep(memory[s - 1], W1[c]);
            if constexpr (absorbs) {
                T* const r = rest + c * s;
                keep(r[0], r[s - 1]);
                for (int j = 0; j < m; ++j) keep(r[j + 1], fused(-diagonal[c], a.X[j * n + c], a.W[j * n + c]));
                keep(r[s - 1], fused(-diagonal[c], q1[c], W1[c]));
            }
            keep(drifting[c], u[c] + change[c]);
            keep(q[c], q1[c]);
            keep(u[c], u1[c]);
        }
        has_history = true;
    }
};

template <class K, class T>
struct LaneStepper<K, T, Form::separable, Stepping::solved> : LaneState<K, T, true> {
    using State = LaneState<K, T, true>;
    using State::n, State::q, State::rate;
    using typename State::real, typename State::ActiveMask;
    using Shared = typename EnsembleTables<K, T>::Shared;
    static constexpr int s = K::points, m = s - 2;
    EnsembleFixedPoint<K, T> fixed_point;

    Shared shared() const { return fixed_point.shared(); }
    template <bool alike>
    LOBATTO_INLINE void take(const Shared& all) {
        fixed_point.template take<alike>(all);
    }

    void prepare(const ScalarFallback<K>& single, int lane) {
        fixed_point.prepare(single.coefficients, single.step_size, lane);
    }
    void set_tolerance(real tolerance) { fixed_point.set_tolerance(tolerance); }
    void start(const ScalarFallback<K>& single, int lane) {
        this->follow_state(single, lane);
        fixed_point.begin(single.q, single.u, single.W + (s - 1) * n, lane);
    }
    // A trajectory that begins in the midst of others has a memory as they do: of a constant acceleration.
    void refill(const ScalarFallback<K>& single, int lane) {
        start(single, lane);
        const real* const W0 = single.W + (s - 1) * n;
        fixed_point.recall(
            single.u, [&](int, int c) { return W0[c]; }, [&](int, int c) { return single.q[c]; }, lane);
    }
    template <class Given, class Time>
    LOBATTO_LANE ActiveMask step(const Given& k, const Time& time, ActiveMask active) {
        const ActiveMask moved = fixed_point.step(k, time, q[0], rate[0], active);
        this->evaluations = fixed_point.evaluations;
        return moved;
    }
    // Takes over the state and the memory of the step that `single` has taken.
    void follow(const ScalarFallback<K>& single, int lane) {
        this->follow_state(single, lane);
        fixed_point.recall(
            single.u, [&](int i, int c) { return single.node_minus_acceleration(i, c); },
            [&](int i, int c) { return single.node_position(i, c); }, lane);
    }

    template <class Given>
    LOBATTO_LANE void displacements(const Given&, const T&, const T* q_before, const T* u_before, T (*moved)[n]) const {
        static constexpr Table table{};
        const real h = fixed_point.h;
        for (int c = 0; c < n; ++c) {
            const T* const W = fixed_point.w + c * s;
            const T drift = fused(T(-h * K::b[0]), W[0], u_before[c]);
            moved[0][c] = T(real(0));
            for (int i = 0; i < m; ++i) {
                T sum = T(table.c[i + 1]) * drift;
                for (int j = 0; j < m; ++j) sum = fused(T(-h * table.A[i * m + j]), W[j + 1], sum);
                moved[i + 1][c] = T(h) * sum;
            }
            moved[s - 1][c] = q[0][c] - q_before[c];
        }
    }
    template <class Single>
    void lend_step(const T (*)[n], Single& single, int lane) const {
        this->lend_end(single, lane);
        for (int i = 0; i < s; ++i)
            for (int c = 0; c < n; ++c) single.W[i * n + c] = lane_of(fixed_point.minus_acceleration(i, c), lane);
        single.is_current = true;
    }

private:
    struct Table {  // of K, for indices that are no constants: a device has no address of K's own
        real c[s]{}, A[m > 0 ? m*m : 1]{};
        constexpr Table() {
            for (int i = 0; i < s; ++i) c[i] = K::c[i];
            for (int i = 0; i < m * m; ++i) A[i] = K::A[i];
        }
    };
};

}  // namespace lobatto

#endif
