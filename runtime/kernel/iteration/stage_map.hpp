// SPDX-License-Identifier: MIT
// The stage map of a separable system, its tables and its memory of the step before, in either of two layouts: the
// nodes of one trajectory in the lanes of Packs (iteration/fixed_point.hpp), or of an ensemble each value a Pack of
// trajectories, its nodes one after another (iteration/ensemble_fixed_point.hpp).
//
// Formula numbers (D..) refer to docs/derivation.md. With W = M^-1 (grad V - F) and the stage map A the equations are
//     Q_i = q + h c_i v - h^2 sum_j A_ij W(Q_j),    v = u - h b_1 W(q),    i = 2 ... s - 1
// Where the constant part of S = dW/dq is diagonal, D, it is taken into the map (D31): with P = (I + h^2 A D)^-1
//     Q = P (q + h c v) - h^2 P A (W - D Q)
#ifndef LOBATTO_KERNEL_STAGE_MAP_HPP
#define LOBATTO_KERNEL_STAGE_MAP_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/dense.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "stage_coefficients.hpp"

namespace lobatto {

// How `count` values of nodes lie: in `parts` values of type V, Packs of at most `most` lanes. T: the number type of a
// trajectory's state.
template <class real, class T, int inner, int most = native_lanes<real>>
struct NodeLayout {
    static constexpr bool in_lanes = std::is_same_v<T, real>;
    static constexpr int padded(int values) {
        int lanes = 1;
        while (lanes < values) lanes *= 2;
        return lanes;
    }
    static constexpr int width = !in_lanes ? 1 : padded(inner + 1) < most ? padded(inner + 1) : most;
    using V = std::conditional_t<in_lanes, Pack<real, width>, T>;
    static constexpr int parts_of(int values) { return (values + width - 1) / width; }
    // The end of the step is iterated along with the inner nodes where that costs no further part.
    static constexpr bool with_end = width > 1 && parts_of(inner + 1) == parts_of(inner);
    static constexpr int count = inner + (with_end ? 1 : 0);
    static constexpr int parts = parts_of(count);
};

// Values of nodes one by one: a Pack's lanes in memory.
template <int parts, class V, class T>
LOBATTO_DEVICE inline void lay_flat(const V* values, int stride, T* flat) {
    for (int p = 0; p < parts; ++p) {
        if constexpr (std::is_same_v<V, T>)
            flat[p] = values[p * stride];
        else
            values[p * stride].store(flat + p * lanes_of<V>);
    }
}

// The nodes of one trajectory lie in registers of 32 bytes at most: a step waits for its longest chain of operations,
// and in wider ones divisions, roots and sums over the lanes answer later (docs/measurements/fixed_point_iteration.md).
template <class real>
constexpr int node_lanes =
    register_bytes > 32 && native_lanes<real> > 1 ? native_lanes<real> * 32 / register_bytes : native_lanes<real>;

template <class K, class T>
struct StageMap {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2, inner_room = m > 0 ? m : 1;
    using Layout = NodeLayout<real, T, m, node_lanes<real>>;
    using V = typename Layout::V;
    static constexpr bool in_lanes = Layout::in_lanes, with_end = Layout::with_end, absorbs = K::diagonal_part;
    static constexpr int width = Layout::width, count = Layout::count;
    static constexpr int parts = Layout::parts > 0 ? Layout::parts : 1;
    static constexpr int entries = K::entries > 0 ? K::entries : 1, maps = absorbs ? n : 1;
    using ActiveMask = decltype(T() < T());

    // The stage map and its kin, minus and with their powers of h; of each coordinate where D is absorbed.
    struct Map {
        V inner[inner_room][parts];  // -h^2 P A, a column for each inner node
        V before[s][parts];          // the same after the extrapolation of the step before (D15)
        V simple[parts];             // the row sums of the first
        V on_position[parts];        // P 1
        V on_velocity[parts];        // P h c
    };

    Map map[maps];
    V node_time[parts];               // h c
    V weight[parts], arrival[parts];  // -h b and -h^2 b (1 - c), for a trajectory's Packs; zero in lanes to spare
    std::conditional_t<absorbs, T[n], Nothing> diagonal{};
    real h{};
    ActiveMask usable{};
    bool has_history{};
    T w[n * s];                                             // W at the nodes of the last step; the last of each at q
    std::conditional_t<absorbs, T[n * s], Nothing> rest{};  // W - D q there

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
        bool good = true;
        for (int c = 0; c < maps; ++c) good = prepare_map(map[c], D[c], lane) && good;
        for (int i = 0; i < parts * width; ++i) {
            const bool inner = i < m, end = with_end && i == m;
            put(node_time, i, lane, h * K::c[(i < count ? i : count - 1) + 1]);
            put(weight, i, lane, inner || end ? -h * K::b[i + 1] : real(0));
            put(arrival, i, lane, inner ? -h * h * row(m, i) : real(0));
        }
        if constexpr (in_lanes)
            usable = good;
        else
            usable.set(lane, good);
    }

    // W at node i of the last step.
    T minus_acceleration(int i, int c) const { return w[c * s + i]; }

    // Begins at q with W(q) = W0.
    void begin(const real* q, const real* W0, int lane = 0) {
        has_history = false;
        for (int c = 0; c < n; ++c) {
            set_lane(w[c * s + s - 1], lane, W0[c]);
            if constexpr (absorbs) set_lane(rest[c * s + s - 1], lane, W0[c] - lane_of(diagonal[c], lane) * q[c]);
        }
    }

    // Takes over a step that was taken otherwise, into `lane`: minus_acceleration(i, c) and position(i, c) at node i.
    // All lanes have a memory from then on.
    template <class Acceleration, class Position>
    void recall(const Acceleration& minus_acceleration, const Position& position, int lane = 0) {
        has_history = true;
        for (int c = 0; c < n; ++c)
            for (int i = 0; i < s; ++i) {
                set_lane(w[c * s + i], lane, minus_acceleration(i, c));
                if constexpr (absorbs)
                    set_lane(rest[c * s + i], lane,
                             minus_acceleration(i, c) - lane_of(diagonal[c], lane) * position(i, c));
            }
    }

    LOBATTO_DEVICE const Map& map_of(int c) const { return map[absorbs ? c : 0]; }

    // Rows of the map: those of A, then the end of the step.
    static real row(int i, int j) { return stage_coefficients<K>.map[i][j]; }

private:
    static void put(V* values, int i, int lane, real x) {
        if constexpr (in_lanes)
            set_lane(values[i / width], i % width, x);
        else
            set_lane(values[i], lane, x);
    }

    bool prepare_map(Map& of, real D, int lane) const {
        if (m == 0) return true;  // nothing is solved
        constexpr int columns = m + s + 3;
        real J[inner_room * inner_room], X[(m + 1) * columns];
        for (int i = 0; i <= m; ++i) {
            real* const x = X + i * columns;
            for (int j = 0; j < m; ++j) x[j] = -h * h * row(i, j);
            for (int l = 0; l < s; ++l) x[m + l] = -h * h * stage_coefficients<K>.before[i][l];
            x[m + s] = -h * h * stage_coefficients<K>.sum[i];
            x[m + s + 1] = real(1);
            x[m + s + 2] = h * K::c[i + 1];
        }
        bool good = true;
        if (absorbs) {
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
};

}  // namespace lobatto

#endif
