// SPDX-License-Identifier: MIT
// The step of any Lagrangian system by iterations over its nodes: no equations larger than the mass matrix of one node.
//
// With V, P = dL/dv and F = dL/dq + forces at the r nodes, A the matrix that integrates over the node polynomials,
// A'_ij = b_j (1 - A_ji / b_i), and pi the Legendre polynomial of degree r - 1 for Lobatto's nodes, nothing for
// Gauss's, the Galerkin equations (D28) are (D35)
//     Q_i = q + h sum_j A_ij V_j,   P_i = p + h sum_j A'_ij F_j + kappa pi_i,   P_i = L_v(Q_i, V_i),
//     q1 = q + h sum_j b_j V_j,     p1 = p + h sum_j b_j F_j,                   sum_i b_i pi_i V_i = 0
// An iteration takes F, L_v and M = L_vv at all nodes, then P, then V <- V + M^-1 (P - L_v) with the kappa that keeps
// the last sum zero, then Q: where M varies little it contracts like h^2, not like h, because Q is new in every
// iteration. Angles are taken from those at the start of the step (base/angles.hpp). Where velocities are formulas of
// positions and momenta, iteration/hamilton.hpp takes the place of this.
#ifndef LOBATTO_KERNEL_GALERKIN_HPP
#define LOBATTO_KERNEL_GALERKIN_HPP

#include <type_traits>

#include "../base/angles.hpp"
#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "convergence.hpp"
#include "galerkin_tables.hpp"
#include "hamilton.hpp"
#include "lane_state.hpp"
#include "node_mass.hpp"

#ifdef __clang__  // which warns of loops that are too large to unroll, in mechanisms
#pragma clang diagnostic ignored "-Wpass-failed"
#endif

namespace lobatto {

template <class K, class T>
struct GalerkinFixedPoint : GalerkinTables<K, T> {
    using Kernel = K;
    using Number = T;
    using Tables = GalerkinTables<K, T>;
    using Tables::h, Tables::tolerance, Tables::position_map, Tables::momentum_map, Tables::weight, Tables::legendre,
        Tables::on_legendre, Tables::ahead, Tables::node_time;
    using Tables::r, Tables::in_lanes, Tables::width, Tables::parts, Tables::has_kappa;
    using typename Tables::real, typename Tables::V;
    static constexpr int n = K::coordinates;
    using Mass = NodeMass<K, T, V>;
    static constexpr int mass_room = Mass::room;
    static constexpr int evaluation_limit = is_many_digits<real> ? 60 : 30;
    using ActiveMask = decltype(T() < T());

    struct Arrays {
        V Q[parts * n], v[parts * n], Lv[parts * n], F[parts * n], M[K::hamiltonian ? 1 : parts * mass_room];
        V P[K::hamiltonian ? parts * n : 1];
        T flat[n * parts * width], flat_v[n * parts * width], inverse_scale[n], middle[K::hamiltonian ? n : 1];
        AngleTable<V, parts, K::angles> near;
    };

    T v[n * r];                   // velocities at the nodes of the last step
    T kappa[n];                   // of the last step
    T evaluations;                // of the last step
    T increment;                  // the last one of the last step, relative
    T elapsed;                    // of kernels with a clock: the physical time of the last step, sum_i h b_i clock(Q_i)
    T rates[K::clocked ? r : 1];  // and clock(Q_i)
    bool is_guess{};              // v is not of the last step but what the next one begins with
    Mass mass;
    Workspace<Arrays> workspace;

    // Begins at a state.
    void begin(const typename K::Coefficients& k, real time, const real* q, const real* velocity, int lane = 0) {
        mass.begin(k, time, q, velocity, lane);
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            for (int i = 0; i < r; ++i) set_lane(v[c * r + i], lane, velocity[c]);
            set_lane(kappa[c], lane, real(0));
        }
    }

    // One step of the lanes that are `active`, h from `time`, one number or one a lane. The lanes that the answer names
    // have moved; the others stay.
    template <class Given, class Time>
    LOBATTO_LANE ActiveMask step(const Given& k, const Time& time, T* q, T* p, ActiveMask active = ActiveMask(true)) {
        return workspace.with([&](Arrays& a) { return step_in(k, time, q, p, active, a); });
    }

    // Displacement and velocity of coordinate c of the last step at control point j + 1 and node i.
    T displacement(int c, int j) const {
        T sum = T(real(0));
        for (int i = 0; i < r; ++i) sum = fused(T(K::reach[j * r + i]), v[c * r + i], sum);
        return h * sum;
    }
    // The memory of a step taken otherwise.
    template <class Velocity>
    void recall(const Velocity& velocity, int lane = 0) {
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c)
            for (int i = 0; i < r; ++i) set_lane(v[c * r + i], lane, velocity(c, i));
    }

private:
    friend HamiltonIteration<GalerkinFixedPoint>;
    // The values of one part.
    LOBATTO_INLINE static V at_nodes(const T* x, int part) {
        if constexpr (in_lanes) {
            V packed = V(x[r - 1]);
            for (int i = part * width; i < r && i < (part + 1) * width; ++i) set_lane(packed, i % width, x[i]);
            return packed;
        } else {
            return x[part];
        }
    }
    // base + sum_j column_j x_j of one part.
    LOBATTO_INLINE static V sum_of(const V& base, const V (*column)[parts], int p, const T* x) {
        V even = base, odd = V(real(0));
#pragma GCC unroll 16
        for (int j = 0; j < r; ++j) {
            V& sum = j % 2 == 0 ? even : odd;
            sum = fused(column[j][p], V(x[j]), sum);
        }
        return even + odd;
    }
    // sum_i w_i x_i over the nodes.
    LOBATTO_INLINE static T over_nodes(const V* w, const V* x, int stride) {
        V total = w[0] * x[0];
        for (int p = 1; p < parts; ++p) total = fused(w[p], x[p * stride], total);
        if constexpr (in_lanes)
            return sum(total);
        else
            return total;
    }

    template <class Given, class Time>
    LOBATTO_LANE ActiveMask step_in(const Given& k, const Time& time, T* q, T* p, ActiveMask active, Arrays& a) {
        constexpr real epsilon = Limits<real>::epsilon, floor = epsilon / Limits<real>::root_epsilon;
        // Each coordinate has its own measure: increments as small as its rounding are so whatever the others do.
        const real least = maximum(tolerance, epsilon);
        T kappa_now[n];
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            T* const flat = a.flat + c * parts * width;
            V fastest = V(real(0));
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) {
                V& v_part = a.v[part * n + c];
                v_part = is_guess ? at_nodes(v + c * r, part) : sum_of(V(real(0)), ahead, part, v + c * r);
                lay_flat<1>(&v_part, 1, flat + part * width);
                fastest = maximum(fastest, fabs(v_part));
            }
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) a.Q[part * n + c] = sum_of(V(q[c]), position_map, part, flat);
            T speed;
            if constexpr (in_lanes)
                speed = largest(fastest);
            else
                speed = fastest;
            const T scale = fabs(h) * speed + T(floor) * fabs(q[c]);
            const T rounding = T(epsilon / least) * fabs(q[c]) + T(Limits<real>::smallest);
            a.inverse_scale[c] = fabs(h) / maximum(scale, rounding);
            kappa_now[c] = kappa[c];
        }
        if constexpr (K::angles > 0) prepare_angles(k, time, q, a);
        if constexpr (K::hamiltonian) HamiltonIteration<GalerkinFixedPoint>::begin(*this, k, time, q, a);
        // Velocities are kept, positions are made of them: more rounding, and ratios that tell less.
        const Convergence<T, 1, Pace<4, 90, 32>> rule{T(real(2) * least)};
        ActiveMask solved = active & !active;
        T e_before = T(Limits<real>::largest);
        evaluations = T(real(0));
        for (int evaluation = 1; evaluation <= evaluation_limit; ++evaluation) {
            evaluations = select(active, evaluations + T(real(1)), evaluations);
            const T e = iterate(k, time, q, p, kappa_now, a);
            if (evaluation > rule.judged_after) active = active & rule.contracts(e, e_before);
            const ActiveMask done = active & rule.is_done(e, e_before);
            if (any(done)) {
                increment = select(done, e, increment);
                solved = solved | finish(k, time, q, p, kappa_now, done, a);
                active = active & !done;
            }
            if (!any(active)) break;
            e_before = e;
        }
        return solved;
    }

    // The angles at the start of the step are those that all its nodes are near; those of velocities with the velocity
    // of the last step's last node. Nothing else of the stage is computed.
    template <class Given, class Time>
    LOBATTO_INLINE void prepare_angles(const Given& k, const Time& time, const T* q, Arrays& a) const {
        using Start = Pack<real, lanes_of<T>>;
        Angle<Start> angles[K::angles];
        Start position[n], velocity[n], Lv[n], F[n], M[Mass::given];
        for (int c = 0; c < n; ++c) {
            position[c] = Start(q[c]);
            velocity[c] = Start(v[c * r + r - 1]);
        }
        Formulas<K>::stage(k, Start(time), position, velocity, +Lv, F, M, AnglesKept<Start>{angles});
        const auto spread = [](const Start& x) LOBATTO_FORMULA {
            if constexpr (in_lanes)
                return V(x[0]);
            else
                return x;
        };
        for (int part = 0; part < parts; ++part)
            for (int i = 0; i < K::angles; ++i)
                a.near.of(part)[i] = {spread(angles[i].x), spread(angles[i].sine), spread(angles[i].cosine)};
    }

    // One iteration; the largest change of a velocity, relative.
    template <class Given, class Time>
    LOBATTO_INLINE T iterate(const Given& k, const Time& time, const T* q, const T* p, T* kappa_now, Arrays& a) {
        if constexpr (K::hamiltonian) {
            const T lost = HamiltonIteration<GalerkinFixedPoint>::velocities(*this, k, time, p, kappa_now, a);
            return maximum(lost, move(q, a));
        } else {
            velocities(k, time, p, kappa_now, a);
            return move(q, a);
        }
    }

    // The new velocities, in place of Lv.
    template <class Given, class Time>
    LOBATTO_INLINE void velocities(const Given& k, const Time& time, const T* p, T* kappa_now, Arrays& a) {
#pragma GCC unroll 8
        for (int part = 0; part < parts; ++part) {
            V packed[Mass::given];
            const V* const Q = a.Q + part * n;
            const V* const velocity = a.v + part * n;
            if constexpr (K::angles > 0)
                Formulas<K>::stage(k, V(time) + node_time[part], Q, velocity, a.Lv + part * n, a.F + part * n, packed,
                                   AnglesNear<V>{a.near.of(part)});
            else
                Formulas<K>::stage(k, V(time) + node_time[part], Q, velocity, a.Lv + part * n, a.F + part * n, packed);
            Mass::take(packed, a.M + part * mass_room);
        }
        // P - L_v
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            T* const flat = a.flat + c * parts * width;
            lay_flat<parts>(a.F + c, n, flat);
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) {
                V& residual = a.Lv[part * n + c];
                V target = sum_of(V(p[c]) - residual, momentum_map, part, flat);
                if constexpr (has_kappa() && Mass::is_full) target = fused(legendre[part], V(kappa_now[c]), target);
                residual = target;
            }
        }
#pragma GCC unroll 8
        for (int part = 0; part < parts; ++part) {
            V* const x = a.Lv + part * n;
            mass.solve(a.M + part * mass_room, x);
#pragma GCC unroll 8
            for (int c = 0; c < n; ++c) x[c] += a.v[part * n + c];  // the new velocities
        }
        if constexpr (has_kappa() && Mass::is_full)
            correct(kappa_now, a);
        else if constexpr (has_kappa())
            correct_each(kappa_now, a);
    }

    // With the new velocities to new positions; the largest change of a velocity, relative.
    LOBATTO_INLINE T move(const T* q, Arrays& a) const {
        V worst = V(real(0));
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            T* const flat = a.flat_v + c * parts * width;
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) {
                V &next = a.Lv[part * n + c], &now = a.v[part * n + c];
                worst = maximum(worst, fabs(next - now) * V(a.inverse_scale[c]));
                now = next;
                lay_flat<1>(&now, 1, flat + part * width);
            }
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) a.Q[part * n + c] = sum_of(V(q[c]), position_map, part, flat);
        }
        if constexpr (in_lanes)
            return fabs(largest(worst));
        else
            return fabs(worst);
    }

    // kappa <- kappa + d, V <- V + M^-1 pi d with sum b pi V = 0.
    LOBATTO_INLINE void correct(T* kappa_now, Arrays& a) {
        V weighted[parts];  // h b pi
#pragma GCC unroll 8
        for (int part = 0; part < parts; ++part) weighted[part] = weight[part] * legendre[part];
        T S[n * n], d[n];  // S = sum h b pi^2 M^-1, column by column
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) d[c] = -over_nodes(weighted, a.Lv + c, n);
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            V columns[parts * n];
#pragma GCC unroll 8
            for (int part = 0; part < parts; ++part) {
#pragma GCC unroll 8
                for (int i = 0; i < n; ++i) columns[part * n + i] = i == c ? legendre[part] : V(real(0));
                mass.solve(a.M + part * mass_room, columns + part * n);
            }
#pragma GCC unroll 8
            for (int i = c; i < n; ++i) S[i * n + c] = over_nodes(weighted, columns + i, n);
        }
        factor_symmetric<n>(S);
        solve_symmetric<n>(S, d);
#pragma GCC unroll 8
        for (int part = 0; part < parts; ++part) {
            V x[n];
#pragma GCC unroll 8
            for (int c = 0; c < n; ++c) x[c] = legendre[part] * V(d[c]);
            mass.solve(a.M + part * mass_room, x);
#pragma GCC unroll 8
            for (int c = 0; c < n; ++c) a.Lv[part * n + c] += x[c];
        }
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) kappa_now[c] += d[c];
    }

    // The same for masses that do not couple coordinates, or do so by M0 alone, which drops out: kappa = M0 d is found
    // anew, and P does not hold it.
    LOBATTO_INLINE void correct_each(T* kappa_now, Arrays& a) {
        V weighted[parts], moved[parts * mass_room];  // h b pi, M^-1 pi
        T share[mass_room], d[n];
        for (int part = 0; part < parts; ++part) weighted[part] = weight[part] * legendre[part];
#pragma GCC unroll 8
        for (int c = 0; c < mass_room; ++c) {
            for (int part = 0; part < parts; ++part)
                moved[part * mass_room + c] = legendre[part] * a.M[part * mass_room + c];
            share[c] = T(real(-1)) / over_nodes(weighted, moved + c, mass_room);
        }
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            const int of = c < mass_room ? c : 0;
            d[c] = share[of] * over_nodes(weighted, a.Lv + c, n);
            for (int part = 0; part < parts; ++part) {
                V& x = a.Lv[part * n + c];
                x = fused(moved[part * mass_room + of], V(d[c]), x);
            }
        }
        mass.momentum_of(d, kappa_now);
    }

    template <class Given, class Time>
    LOBATTO_LANE ActiveMask finish(const Given& k, [[maybe_unused]] const Time& time, T* q, T* p, const T* kappa_now,
                                   ActiveMask done, Arrays& a) {
        T q1[n], p1[n], not_finite = T(real(0));
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            q1[c] = q[c] + over_nodes(weight, a.v + c, n);
            p1[c] = p[c] + over_nodes(weight, a.F + c, n);
            not_finite += (q1[c] - q1[c]) + (p1[c] - p1[c]);
        }
        if constexpr (K::clocked) {
            V rate[parts];
            for (int part = 0; part < parts; ++part)
                rate[part] =
                    K::has_time_coordinate ? a.v[part * n + n - 1] : Formulas<K>::clock(k, V(time), a.Q + part * n);
            const T passed = over_nodes(weight, rate, 1);
            not_finite += passed - passed;
            elapsed = select(done, passed, elapsed);
            T flat[parts * width];
            lay_flat<parts>(rate, 1, flat);
            for (int i = 0; i < r; ++i) rates[i] = select(done, flat[i], rates[i]);
        }
        done = done & (not_finite == T(real(0)));
        if (!any(done)) return done;
        is_guess = false;
#pragma GCC unroll 8
        for (int c = 0; c < n; ++c) {
            const T* const flat = a.flat_v + c * parts * width;
            for (int i = 0; i < r; ++i) v[c * r + i] = select(done, flat[i], v[c * r + i]);
            kappa[c] = select(done, kappa_now[c], kappa[c]);
            q[c] = select(done, q1[c], q[c]);
            p[c] = select(done, p1[c], p[c]);
        }
        return done;
    }
};

template <class K, class T, Stepping stepping>
struct LaneStepper<K, T, Form::general, stepping> : LaneState<K, T, false> {
    using State = LaneState<K, T, false>;
    using State::n, State::q, State::rate;
    using typename State::real, typename State::ActiveMask;
    using Chain = Stepper<FallbackKernel<K>, Form::general, Stepping::solved>;
    using Shared = GalerkinTables<K, T>;
    static constexpr int r = K::nodes, controls = K::controls - 1;
    GalerkinFixedPoint<K, T> fixed_point;

    Shared shared() const { return fixed_point; }
    template <bool>
    LOBATTO_INLINE void take(const Shared& all) {
        static_cast<Shared&>(fixed_point) = all;
    }

    void prepare(const ScalarFallback<K>& single, int) { fixed_point.prepare(single.step_size); }
    void set_tolerance(real tolerance) { fixed_point.tolerance = tolerance; }
    void start(const ScalarFallback<K>& single, int lane) {
        this->follow_state(single, lane);
        real velocity[n] = {};
        const Chain& chain = single;  // with a clock: dq/dtau
        chain.velocity(chain.time(), single.q, single.p, velocity);
        fixed_point.begin(chain.coefficients, chain.time(), single.q, velocity, lane);
    }
    void refill(const ScalarFallback<K>& single, int lane) { start(single, lane); }
    template <class Given, class Time>
    LOBATTO_APART ActiveMask step(const Given& k, const Time& time, ActiveMask active) {
        const ActiveMask moved = fixed_point.step(k, time, q[0], rate[0], active);
        this->evaluations = fixed_point.evaluations;
        return moved;
    }
    void follow(const ScalarFallback<K>& single, int lane) {
        this->follow_state(single, lane);
        fixed_point.recall([&](int c, int i) { return single.node_velocity(c, i); }, lane);
        if constexpr (K::clocked) {
            set_lane(fixed_point.elapsed, lane, single.elapsed);
            for (int i = 0; i < r; ++i) set_lane(fixed_point.rates[i], lane, single.rates[i]);
        }
    }

    template <class Given>
    LOBATTO_LANE void displacements(const Given&, const T&, const T*, const T*, T (*moved)[n]) const {
        static constexpr Table table{};
        for (int c = 0; c < n; ++c) {
            moved[0][c] = T(real(0));
            for (int j = 0; j < controls; ++j) {
                T sum = T(real(0));
                for (int i = 0; i < r; ++i) sum = fused(T(table.reach[j * r + i]), fixed_point.v[c * r + i], sum);
                moved[j + 1][c] = T(fixed_point.h) * sum;
            }
        }
    }
    // By Newton's iteration from the velocity of the last node (D27).
    template <class Given>
    LOBATTO_LANE KnownVelocities<T> velocities(const Given& k, const T& time, T* velocity) const {
        static constexpr Table table{};
        T change = T(real(0)), size = T(real(0)), left = T(real(0)), whole = T(real(0));
        for (int c = 0; c < n; ++c) velocity[c] = fixed_point.v[c * r + r - 1];
        for (int iteration = 0; iteration < 3; ++iteration) {
            T residual[n], packed[K::mass_entries], M[n * n];
            Formulas<K>::legendre(k, time, this->positions(), velocity, residual, packed);
            for (int i = 0; i < n * n; ++i) M[i] = T(real(0));
            for (int e = 0; e < K::mass_entries; ++e) M[table.row[e] * n + table.column[e]] = packed[e];
            factor_symmetric<n>(M);
            left = whole = T(real(0));
            for (int c = 0; c < n; ++c) {
                residual[c] = rate[0][c] - residual[c];
                left += fabs(residual[c]);
                whole += fabs(rate[0][c]);
            }
            solve_symmetric<n>(M, residual);
            change = size = T(real(0));
            for (int c = 0; c < n; ++c) {
                velocity[c] += residual[c];
                change += fabs(residual[c]);
                size += fabs(velocity[c]);
            }
        }
        const T root = T(Limits<real>::root_epsilon);
        return {change <= root * size, left <= root * whole};
    }
    template <class Single>
    void lend_step(const T (*moved)[n], Single& single, int lane) const {
        this->lend_end(single, lane);
        for (int b = 0; b < Single::active; ++b)
            for (int j = 0; j < controls; ++j)
                single.Y[Single::Layout::index(b, j)] = lane_of(moved[j + 1][K::active_index[b]], lane);
        for (int c = 0; c < Single::cyclic; ++c)
            for (int i = 0; i < r; ++i)
                single.cyclic_rates[i * Single::cyclic + c] = lane_of(fixed_point.v[K::cyclic_index[c] * r + i], lane);
        single.is_current = true;
    }

private:
    struct Table {  // of K, for indices that are no constants: a device has no address of K's own
        real reach[controls * r]{};
        int row[K::mass_entries]{}, column[K::mass_entries]{};
        constexpr Table() {
            for (int i = 0; i < controls * r; ++i) reach[i] = K::reach[i];
            for (int e = 0; e < K::mass_entries; ++e) {
                row[e] = K::mass_row[e];
                column[e] = K::mass_column[e];
            }
        }
    };
};

}  // namespace lobatto

#endif
