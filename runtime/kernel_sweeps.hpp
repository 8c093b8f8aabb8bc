// SPDX-License-Identifier: MIT
// The step of a separable system by sweeps over its nodes: accelerations of all nodes at once, then the stage map.
//
// Formula numbers (D..) refer to docs/derivation.md. With W = M^-1 (grad V - F) and the stage map A one sweep is
//     Q_i <- q + h c_i v - h^2 sum_j A_ij W(Q_j),    v = u - h b_1 W(q),    i = 2 ... s - 1
// It contracts like h^2 |A| |S|, S = dW/dq; once the increment e is below sqrt(epsilon), W(Q) + S (Q' - Q) stands for
// W(Q'), which errs by e^2, and the sweeps that are left evaluate nothing. Where the constant part of S is diagonal, D,
// it is taken into the map (D31): Q <- P (base - h^2 A (W - D Q)) with P = (I + h^2 A D)^-1 contracts like what is left
// of S.
//
// One text serves two layouts. A single trajectory has its nodes in the lanes of Packs; of an ensemble each value is a
// Pack of trajectories, and its nodes come one after another. No lane of an ensemble sees its neighbours.
#ifndef LOBATTO_KERNEL_SWEEPS_HPP
#define LOBATTO_KERNEL_SWEEPS_HPP

#include <type_traits>

#include "kernel_contract.hpp"
#include "kernel_functions.hpp"
#include "kernel_numbers.hpp"
#include "kernel_pack.hpp"
#include "kernel_solve.hpp"

namespace lobatto {

// How `count` values of nodes lie: in `parts` values of type V. T: the number type of a trajectory's state.
template <class real, class T, int inner>
struct NodeLayout {
    static constexpr bool in_lanes = std::is_same_v<T, real>;
    static constexpr int padded(int values) {
        int lanes = 1;
        while (lanes < values) lanes *= 2;
        return lanes;
    }
    static constexpr int width = !in_lanes                                ? 1
                                 : padded(inner + 1) < native_lanes<real> ? padded(inner + 1)
                                                                          : native_lanes<real>;
    using V = std::conditional_t<in_lanes, Pack<real, width>, T>;
    static constexpr int parts_of(int values) { return (values + width - 1) / width; }
    // The end of the step is swept along with the inner nodes where that costs no further part.
    static constexpr bool with_end = width > 1 && parts_of(inner + 1) == parts_of(inner);
    static constexpr int count = inner + (with_end ? 1 : 0);
    static constexpr int parts = parts_of(count);
};

// One lane of a value, which may be a plain number.
template <class real, int width>
inline void set_lane(Pack<real, width>& value, int lane, real x) {
    value.set(lane, x);
}
template <class real>
inline void set_lane(real& value, int, real x) {
    value = x;
}
template <class real, int width>
inline real lane_of(const Pack<real, width>& value, int lane) {
    return value[lane];
}
template <class real>
inline real lane_of(const real& value, int) {
    return value;
}

// Values of nodes one by one: a Pack's lanes in memory.
template <int parts, class V, class T>
inline void lay_flat(const V* values, int stride, T* flat) {
    for (int p = 0; p < parts; ++p) {
        if constexpr (std::is_same_v<V, T>)
            flat[p] = values[p * stride];
        else
            values[p * stride].store(flat + p * lanes_of<V>);
    }
}

struct Unit {};

template <class K, class T>
struct Sweeps {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2, inner_room = m > 0 ? m : 1;
    using Layout = NodeLayout<real, T, m>;
    using V = typename Layout::V;
    static constexpr bool in_lanes = Layout::in_lanes, with_end = Layout::with_end, absorbs = K::diagonal_part;
    static constexpr int width = Layout::width, count = Layout::count;
    static constexpr int parts = Layout::parts > 0 ? Layout::parts : 1;
    static constexpr int entries = K::entries > 0 ? K::entries : 1, maps = absorbs ? n : 1;
    static constexpr int evaluation_limit = 16, carried_limit = 24;
    using Going = decltype(T() < T());

    // The stage map and its kin, minus and with their powers of h; of each coordinate where D is absorbed.
    struct Map {
        V inner[inner_room][parts];  // -h^2 P A, a column for each inner node
        V before[s][parts];          // the same after the extrapolation of the step before (D15)
        V simple[parts];             // the row sums of the first
        V on_position[parts];        // P 1
        V on_velocity[parts];        // P h c
    };
    struct Arrays {
        V base[parts * n], X[parts * n], W[parts * n], S[parts * entries], Y[parts * n], carried[parts * n];
        T flat[n * parts * width], rate[n], inverse_scale[n], inverse_linear[n];
    };

    Map map[maps];
    V node_time[parts];               // h c
    V weight[parts], arrival[parts];  // -h b and -h^2 b (1 - c), for a trajectory's Packs; zero in lanes to spare
    std::conditional_t<absorbs, T[n], Unit> diagonal{};
    real h{};
    real tolerance{};       // of increments, relative; 0: to rounding
    real twentieth_norm{};  // h^2 |A| / 20
    Going usable{};
    bool has_history{};
    T w[n * s];                                          // W at the nodes of the last step; the last of each at q
    std::conditional_t<absorbs, T[n * s], Unit> rest{};  // W - D q there
    T evaluations;                                       // of the last step
    T increment;                                         // the last one of the last step, relative
    Workspace<Arrays> workspace;

    // The tables of one trajectory; `lane` is its place in T.
    void prepare(const typename K::Coefficients& k, real step, int lane = 0) {
        h = step;
        has_history = false;
        real D[n] = {};
        if constexpr (absorbs) {
            real part[entries];
            K::quadratic_part(k, part);
            for (int e = 0; e < K::entries; ++e)
                if (K::entry_row[e] == K::entry_column[e]) D[K::entry_row[e]] = part[e];
            for (int c = 0; c < n; ++c) set_lane(diagonal[c], lane, D[c]);
        }
        real norm = real(0);
        for (int i = 0; i <= m; ++i) {
            real sum = real(0);
            for (int j = 0; j < m; ++j) sum += fabs(row(i, j));
            norm = sum > norm ? sum : norm;
        }
        twentieth_norm = h * h * norm / real(20);
        bool good = true;
        for (int c = 0; c < maps; ++c) good = prepare_map(map[c], D[c], lane) && good;
        for (int i = 0; i < parts * width; ++i) {
            const bool inner = i < m, end = with_end && i == m;
            put(node_time, i, lane, h * K::c[(i < count ? i : count - 1) + 1]);
            put(weight, i, lane, inner || end ? -h * K::b[i + 1] : real(0));
            put(arrival, i, lane, inner ? -h * h * (K::b[i + 1] * (real(1) - K::c[i + 1])) : real(0));
        }
        if constexpr (in_lanes)
            usable = good;
        else
            usable.set(lane, good);
    }

    // W at node i of the last step.
    T acceleration(int i, int c) const { return w[c * s + i]; }

    // Begins at q with W(q) = W0.
    void begin(const real* q, const real* W0, int lane = 0) {
        has_history = false;
        for (int c = 0; c < n; ++c) {
            set_lane(w[c * s + s - 1], lane, W0[c]);
            if constexpr (absorbs) set_lane(rest[c * s + s - 1], lane, W0[c] - lane_of(diagonal[c], lane) * q[c]);
        }
    }

    // One step of the lanes `going`, h from `time`. The lanes that the answer names have moved; the others stay.
    template <class Given>
    Going step(const Given& k, real time, T* q, T* u, Going going) {
        return workspace.with([&](Arrays& a) {
            const Going solved = solve(k, time, q, u, going, a);
            return any(solved) ? finish(k, time, q, u, solved, a) : solved;
        });
    }

    // Takes over a step that was taken otherwise, into `lane`: acceleration(i, c) and position(i, c) at node i.
    // All lanes have a memory from then on.
    template <class Acceleration, class Position>
    void recall(const Acceleration& acceleration, const Position& position, int lane = 0) {
        has_history = true;
        for (int c = 0; c < n; ++c)
            for (int i = 0; i < s; ++i) {
                set_lane(w[c * s + i], lane, acceleration(i, c));
                if constexpr (absorbs)
                    set_lane(rest[c * s + i], lane, acceleration(i, c) - lane_of(diagonal[c], lane) * position(i, c));
            }
    }

private:
    static void put(V* values, int i, int lane, real x) {
        if constexpr (in_lanes)
            set_lane(values[i / width], i % width, x);
        else
            set_lane(values[i], lane, x);
    }

    // Rows of the map: those of A, then the end of the step.
    static real row(int i, int j) { return i < m ? K::A[i * m + j] : K::b[j + 1] * (real(1) - K::c[j + 1]); }

    bool prepare_map(Map& of, real D, int lane) const {
        constexpr int columns = m + s + 3;
        real J[inner_room * inner_room], X[(m + 1) * columns];
        for (int i = 0; i <= m; ++i) {
            real* const x = X + i * columns;
            for (int j = 0; j < columns; ++j) x[j] = real(0);
            for (int j = 0; j < m; ++j) {
                x[j] = -h * h * row(i, j);
                x[m + s] += x[j];
                for (int l = 0; l < s; ++l) x[m + l] += x[j] * K::E[j * s + l];
            }
            x[m + s + 1] = real(1);
            x[m + s + 2] = h * K::c[i + 1];
        }
        bool good = true;
        if (absorbs && m > 0) {
            for (int i = 0; i < m; ++i)
                for (int j = 0; j < m; ++j) J[i * m + j] = (i == j ? real(1) : real(0)) + h * h * D * row(i, j);
            good = lobatto::solve<inner_room, columns>(J, X);
            // The end: its row of the map acts on D times the inner positions too.
            for (int i = 0; i < m; ++i)
                for (int j = 0; j < columns; ++j) X[m * columns + j] -= h * h * D * row(m, i) * X[i * columns + j];
        }
        for (int i = 0; i < parts * width; ++i) {
            const real* const x = X + (i < count ? i : count - 1) * columns;
            for (int j = 0; j < m; ++j) put(of.inner[j], i, lane, x[j]);
            for (int l = 0; l < s; ++l) put(of.before[l], i, lane, x[m + l]);
            put(of.simple, i, lane, x[m + s]);
            put(of.on_position, i, lane, x[m + s + 1]);
            put(of.on_velocity, i, lane, x[m + s + 2]);
            for (int j = 0; j < columns; ++j) good = good && is_finite(x[j]);
        }
        return good;
    }

    const Map& map_of(int c) const { return map[absorbs ? c : 0]; }

    // base + sum_j column_j r_j of one part.
    template <int terms>
    LOBATTO_INLINE static V sum_of(const V& base, const V (*column)[parts], int p, const T* r) {
        V even = base, odd = V(real(0));
#pragma GCC unroll 16
        for (int j = 0; j < terms; ++j) {
            V& sum = j % 2 == 0 ? even : odd;
            sum = fused(column[j][p], V(r[j]), sum);
        }
        return terms > 1 ? even + odd : even;
    }

    // One sweep: Y = base - h^2 P A r with r = W, or `carried` W + S (Y - X), minus D at the same place. The new Y of
    // the lanes `still`, and the size of what it moved by; `displaced`: the same, in the measure for carrying.
    template <bool is_carried>
    LOBATTO_INLINE T sweep(Going still, Arrays& a, T& displaced) const {
        for (int p = 0; p < parts; ++p) {
            V r[n];
            if constexpr (is_carried)
                carry_over(a, p, r);
            else
                for (int c = 0; c < n; ++c) r[c] = a.W[p * n + c];
            for (int c = 0; c < n; ++c) {
                if constexpr (absorbs) r[c] = fused(-V(diagonal[c]), (is_carried ? a.Y : a.X)[p * n + c], r[c]);
                lay_flat<1>(&r[c], 1, a.flat + (c * parts + p) * width);
            }
        }
        V worst = V(real(0)), farthest = V(real(0));
        for (int c = 0; c < n; ++c)
            for (int p = 0; p < parts; ++p) {
                const V next = sum_of<m>(a.base[p * n + c], map_of(c).inner, p, a.flat + c * parts * width);
                V& Y = a.Y[p * n + c];
                const V moved = next - (is_carried ? Y : a.X[p * n + c]);
                if constexpr (in_lanes)
                    Y = next;
                else
                    Y = select(still, next, Y);
                worst = maximum(worst, fabs(moved) * V(a.inverse_scale[c]));
                if constexpr (K::costly && !is_carried)
                    farthest = maximum(farthest, fabs(moved) * V(a.inverse_linear[c]));
            }
        if constexpr (in_lanes) {
            displaced = largest(farthest);
            return largest(worst);
        } else {
            displaced = farthest;
            return worst;
        }
    }

    // W + S (Y - X) of one part.
    LOBATTO_INLINE void carry_over(const Arrays& a, int p, V* r) const {
        V moved[n];
        for (int c = 0; c < n; ++c) {
            moved[c] = a.Y[p * n + c] - a.X[p * n + c];
            r[c] = a.W[p * n + c];
        }
#pragma GCC unroll 16
        for (int e = 0; e < K::entries; ++e)
            r[K::entry_row[e]] = fused(a.S[p * entries + e], moved[K::entry_column[e]], r[K::entry_row[e]]);
    }

    template <class Given>
    LOBATTO_INLINE void evaluate(const Given& k, real time, Arrays& a) const {
        for (int p = 0; p < parts; ++p)
            if constexpr (K::costly)
                Formulas<K>::node(k, V(time) + node_time[p], static_cast<const V*>(a.X + p * n), a.W + p * n,
                                  a.S + p * entries);
            else
                Formulas<K>::acceleration(k, V(time) + node_time[p], static_cast<const V*>(a.X + p * n), a.W + p * n);
    }

    // A twentieth of h^2 |A| |S - D|, largest row sums. Sweeps contract by more than the norm says, but the first ratio
    // of two increments can be small by chance: no estimate goes below this.
    T least_rate(const Arrays& a) const {
        V worst = V(real(0));
        for (int p = 0; p < parts; ++p) {
            V row[n];
            for (int c = 0; c < n; ++c) row[c] = V(real(0));
            for (int e = 0; e < K::entries; ++e) {
                V entry = a.S[p * entries + e];
                if constexpr (absorbs) {
                    if (K::entry_row[e] == K::entry_column[e]) entry -= V(diagonal[K::entry_row[e]]);
                }
                row[K::entry_row[e]] += fabs(entry);
            }
            for (int c = 0; c < n; ++c) worst = maximum(worst, row[c]);
        }
        if constexpr (in_lanes)
            return T(twentieth_norm) * largest(worst);
        else
            return T(twentieth_norm) * worst;
    }

    // The stage equations; a.carried: W at the nodes of the lanes that it names.
    template <class Given>
    Going solve(const Given& k, real time, const T* q, const T* u, Going going, Arrays& a) {
        constexpr real floor = Limits<real>::epsilon / Limits<real>::root_epsilon;
        // Each coordinate has its own measures: increments as small as its rounding are so whatever the others do.
        const real small = maximum(tolerance, Limits<real>::epsilon);
        const real linear = maximum(Limits<real>::root_epsilon, sqrt(tolerance));  // where e^2 is no matter
        for (int c = 0; c < n; ++c) {
            const T W0 = w[c * s + s - 1];
            a.rate[c] = fused(T(-h * K::b[0]), W0, u[c]);
            const T scale = fabs(T(h) * a.rate[c]) + fabs(T(h) * (T(h) * W0)) + T(floor) * fabs(q[c]);
            const T rounding = T(Limits<real>::epsilon) * fabs(q[c]) + T(Limits<real>::smallest);
            a.inverse_scale[c] = T(real(1)) / maximum(scale, T(real(1) / small) * rounding);
            a.inverse_linear[c] = T(real(1)) / maximum(scale, T(real(8) / linear) * rounding);
        }
        for (int c = 0; c < n; ++c)
            for (int p = 0; p < parts; ++p) {
                const Map& of = map_of(c);
                const V base = fused(of.on_velocity[p], V(a.rate[c]), of.on_position[p] * V(q[c]));
                a.base[p * n + c] = base;
                const T* last;
                if constexpr (absorbs)
                    last = rest + c * s;
                else
                    last = w + c * s;
                a.X[p * n + c] =
                    has_history ? sum_of<s>(base, of.before, p, last) : fused(of.simple[p], V(last[s - 1]), base);
            }
        if constexpr (m == 0) {
            evaluations = T(real(0));
            return going;
        }
        Going solved = going & !going;
        going = going & usable;
        T e_before = T(K::costly ? Limits<real>::largest : real(0));
        [[maybe_unused]] T least = T(real(0));
        evaluations = T(real(0));
        for (int evaluation = 1; evaluation <= evaluation_limit; ++evaluation) {
            evaluate(k, time, a);
            evaluations = select(going, evaluations + T(real(1)), evaluations);
            T displaced;
            const T e = sweep<false>(going, a, displaced);
            if (evaluation > 3) going = going & ((e < T(real(0.8)) * e_before) | (e <= T(real(16) * small)));
            if constexpr (K::costly) {
                if (evaluation == 1) least = least_rate(a);
                const Going ready = going & (displaced <= T(linear));
                if (any(ready)) {
                    solved = solved | carry(ready, e, e_before, least, small, a);
                    going = going & !ready;
                }
            } else {
                // What is left, e times its ratio to the one before, is rounding; or it no longer shrinks.
                const Going ready = going & ((e * e <= T(small) * e_before) | (e <= T(small)) |
                                             ((e <= T(real(16) * small)) & (e >= T(real(0.5)) * e_before)));
                if (any(ready)) {
                    settle(k, time, ready, a);
                    increment = select(ready, e, increment);
                    solved = solved | ready;
                    going = going & !ready;
                }
            }
            if (!any(going)) break;
            for (int i = 0; i < parts * n; ++i) a.X[i] = a.Y[i];
            e_before = e;
        }
        return solved;
    }

    // W at the nodes Y of the lanes that are ready.
    template <class Given>
    LOBATTO_INLINE void settle(const Given& k, real time, Going ready, Arrays& a) const {
        for (int p = 0; p < parts; ++p) {
            Formulas<K>::acceleration(k, V(time) + node_time[p], static_cast<const V*>(a.Y + p * n), a.W + p * n);
            for (int c = 0; c < n; ++c) {
                if constexpr (in_lanes)
                    a.carried[p * n + c] = a.W[p * n + c];
                else
                    a.carried[p * n + c] = select(ready, a.W[p * n + c], a.carried[p * n + c]);
            }
        }
    }

    // Sweeps with W + S (Y - X) in place of W(Y), until what is left of an increment, e times its ratio to the one
    // before, is rounding; then that is what W is at the nodes.
    LOBATTO_INLINE Going carry(Going ready, T e, T e_before, T least, real bound, Arrays& a) {
        const T small = T(bound);
        T ignored;
        Going still = ready & !((e * e <= small * e_before) & (e * least <= small));
        for (int i = 0; i < carried_limit && any(still); ++i) {
            const T next = sweep<true>(still, a, ignored);
            const Going stands =
                still & (next >= T(real(0.5)) * e) & (next > T(real(0)));  // rounding, or no convergence
            ready = ready & !(stands & (next > T(real(64)) * small));
            still = still & !stands & !((next * next <= small * e) & (next * least <= small));
            e = select(ready, next, e);
        }
        increment = select(ready, e, increment);
        ready = ready & !still;
        for (int p = 0; p < parts; ++p) {
            V r[n];
            carry_over(a, p, r);
            for (int c = 0; c < n; ++c) {
                if constexpr (in_lanes)
                    a.carried[p * n + c] = r[c];
                else
                    a.carried[p * n + c] = select(ready, r[c], a.carried[p * n + c]);
            }
        }
        return ready;
    }

    // (D16), (D17): the end of the step, each sum of increments rounded once; then the memory of the step.
    template <class Given>
    Going finish(const Given& k, real time, T* q, T* u, Going solved, Arrays& a) {
        T q1[n], u1[n], W1[n];
        for (int c = 0; c < n; ++c) {
            T* const flat = a.flat + c * parts * width;
            lay_flat<parts>(a.carried + c, n, flat);
            T moved, change;
            if constexpr (in_lanes) {
                V to_arrive = arrival[0] * a.carried[c], to_change = weight[0] * a.carried[c];
                for (int p = 1; p < parts; ++p) {
                    to_arrive = fused(arrival[p], a.carried[p * n + c], to_arrive);
                    to_change = fused(weight[p], a.carried[p * n + c], to_change);
                }
                moved = sum(to_arrive);
                change = sum(to_change);
            } else {
                moved = change = T(real(0));
                for (int j = 0; j < m; ++j) {
                    moved = fused(arrival[j], a.carried[j * n + c], moved);
                    change = fused(weight[j], a.carried[j * n + c], change);
                }
            }
            q1[c] = q[c] + fused(T(h), a.rate[c], moved);
            u1[c] = change;
        }
        if constexpr (with_end) {
            for (int c = 0; c < n; ++c) W1[c] = a.flat[c * parts * width + m];
        } else {
            Formulas<K>::acceleration(k, T(time + h), q1, W1);
        }
        T not_finite = T(real(0));
        for (int c = 0; c < n; ++c) {
            T change = fused(T(-h * K::b[0]), w[c * s + s - 1], u1[c]);
            if constexpr (!with_end) change = fused(T(-h * K::b[s - 1]), W1[c], change);
            u1[c] = u[c] + change;
            not_finite += (q1[c] - q1[c]) + (u1[c] - u1[c]) + (W1[c] - W1[c]);
        }
        solved = solved & (not_finite == T(real(0)));
        if (!any(solved)) return solved;
        if (in_lanes || all(solved))
            remember<true>(q, u, q1, u1, W1, solved, a);
        else
            remember<false>(q, u, q1, u1, W1, solved, a);
        has_history = true;
        return solved;
    }

    // The end of the step becomes the state, and its accelerations the memory, of all lanes or of those solved.
    template <bool is_all>
    LOBATTO_INLINE void remember(T* q, T* u, const T* q1, const T* u1, const T* W1, Going solved, const Arrays& a) {
        const auto keep = [&](T& old, const T& value) { old = is_all ? value : select(solved, value, old); };
        for (int c = 0; c < n; ++c) {
            T* const memory = w + c * s;
            const T* const flat = a.flat + c * parts * width;
            keep(memory[0], memory[s - 1]);
            for (int j = 0; j < m; ++j) keep(memory[j + 1], flat[j]);
            keep(memory[s - 1], W1[c]);
            if constexpr (absorbs) {
                T* const r = rest + c * s;
                keep(r[0], r[s - 1]);
                for (int j = 0; j < m; ++j) {
                    const V& Y = a.Y[(j / width) * n + c];
                    if constexpr (in_lanes)
                        keep(r[j + 1], flat[j] - diagonal[c] * Y[j % width]);
                    else
                        keep(r[j + 1], flat[j] - diagonal[c] * Y);
                }
                keep(r[s - 1], W1[c] - diagonal[c] * q1[c]);
            }
            keep(q[c], q1[c]);
            keep(u[c], u1[c]);
        }
    }
};

}  // namespace lobatto

#endif
