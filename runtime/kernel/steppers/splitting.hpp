// SPDX-License-Identifier: MIT
// Steps of explicit splitting methods: kicks u -= h b_i W(q_i) and drifts q += h a_i u in turn (D40).
//
// Nothing is solved for, so that a step costs its gradients and no step can fail to converge. However their lengths are
// rounded, a kick and a drift are symplectic. One trajectory goes by itself, its neighbouring coordinates in the lanes
// of Packs where formulas join these; or several side by side.
#ifndef LOBATTO_KERNEL_SPLITTING_HPP
#define LOBATTO_KERNEL_SPLITTING_HPP

#include <cstdint>
#include <type_traits>

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "../base/rows.hpp"
#include "../iteration/lane_state.hpp"
#include "../iteration/tangent.hpp"

namespace lobatto {

// The lengths of a step's kicks and drifts.
template <class K>
struct Composition {
    using real = typename K::real;
    static constexpr int s = K::points;
    static constexpr bool kicks_ends = K::b[0] != real(0);  // else a step begins and ends with a drift

    real kick[s];  // -h b
    real drift[s - 1];
    real node_time[s];  // h c

    void prepare(real h) {
        for (int i = 0; i < s; ++i) kick[i] = -h * K::b[i];
        for (int i = 0; i < s; ++i) node_time[i] = K::c[i] * h;
        for (int i = 0; i < s - 1; ++i) drift[i] = h * K::drift_length[i];
    }
};

// One step of q and u; W is that at their positions, before and after, where ends are kicked. T: a number or a Pack.
template <class K, class T, class Given, class Time>
LOBATTO_INLINE void kick_and_drift(const Composition<K>& composition, const Given& k, const Time& time,
                                   typename K::real h, T* q, T* u, T* W) {
    constexpr int n = K::coordinates, s = K::points;
    const auto kick = [&](int i) LOBATTO_FORMULA {
        for (int c = 0; c < n; ++c) u[c] = fused(T(composition.kick[i]), W[c], u[c]);
    };
    const auto drift = [&](int i) LOBATTO_FORMULA {
        for (int c = 0; c < n; ++c) q[c] = fused(T(composition.drift[i]), u[c], q[c]);
    };
    if constexpr (Composition<K>::kicks_ends) kick(0);
    drift(0);
    for (int i = 1; i < s - 1; ++i) {
        Formulas<K>::minus_acceleration(k, T(time + composition.node_time[i]), q, W);
        kick(i);
        drift(i);
    }
    if constexpr (Composition<K>::kicks_ends) {
        Formulas<K>::minus_acceleration(k, T(time + h), q, W);
        kick(s - 1);
    }
}

// Takes the acceleration of a coordinate as soon as it is known, which is kicked and drifts; the last kick of a step
// keeps accelerations instead.
template <class K, class T, class Given, bool is_last>
struct KickAndDrift {
    T *q, *u, *W;
    T kick, drift;
    const Given& k;
};
template <class K, class T, class Given, bool is_last>
LOBATTO_INLINE void store_to(const KickAndDrift<K, T, Given, is_last>& step, int at, T slope) {
    if constexpr (!K::unit_masses) slope *= step.k.inverse_mass[at];
    const T velocity = fused(step.kick, slope, step.u[at]);
    step.u[at] = velocity;
    if constexpr (is_last)
        step.W[at] = slope;
    else
        step.q[at] = fused(step.drift, velocity, step.q[at]);
}

// One step from q, u and W to q1, u1 and W1 of neighbouring coordinates of trajectories side by side: once along the
// coordinates for each kick.
template <class K, class T, class Given, class Time>
LOBATTO_INLINE void immediate_step(const Composition<K>& composition, const Given& k, const Time& time, const T* q,
                                   const T* u, const T* W, T* q1, T* u1, T* W1) {
    constexpr int n = K::coordinates, s = K::points;
    const auto pass = [&](int i, auto is_last) LOBATTO_FORMULA {
        const KickAndDrift<K, T, Given, is_last()> step{
            q1, u1, W1, T(composition.kick[i]), T(is_last ? 0 : composition.drift[i]), k};
        const T* const position = q1;
        Formulas<K>::template along_rows<Immediate>(k, T(time + composition.node_time[i]), position, step);
    };
    for (int c = 0; c < n; ++c) {
        u1[c] = Composition<K>::kicks_ends ? fused(T(composition.kick[0]), W[c], u[c]) : u[c];
        q1[c] = fused(T(composition.drift[0]), u1[c], q[c]);
    }
    for (int i = 1; i < s - 1; ++i) pass(i, std::false_type());
    if constexpr (Composition<K>::kicks_ends) pass(s - 1, std::true_type());
}

// Whether positions and velocities, accelerations, and what is under way fit the 32 registers of AVX-512. With the 16
// of AVX2 a part of them goes to the stack; written out, a step of 32 masses takes 206 ns there, in loops 241.
template <class K>
constexpr bool composition_fits_registers() {
    using real = typename K::real;
    constexpr int width = native_lanes<real>, parts = (K::coordinates + width - 1) / width;
    return parts <= (width * sizeof(real) == 64   ? 5
                     : width * sizeof(real) == 32 ? 8
                                                  : 0) &&
           K::row_reach >= 0 && K::row_reach <= width;
}

// Positions, velocities and accelerations of neighbouring coordinates, on the way in registers or in memory; to the
// same bits.
template <class K, bool in_registers = composition_fits_registers<K>()>
struct NeighbourComposition {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points;
    static constexpr int width = native_lanes<real>, room = room_of<K>, parts = (n + width - 1) / width;
    using V = Pack<real, width>;

    int now{};  // the present; 1 - now: before the last step, and room for the next
    // Positions, velocities, and where ends are kicked accelerations.
    alignas(V) real q[2][room]{}, u[2][room]{}, W[2][room]{};

    void begin(const real* position, const real* velocity, const real* minus_acceleration) {
        for (int c = 0; c < n; ++c) {
            q[now][c] = position[c];
            u[now][c] = velocity[c];
            W[now][c] = minus_acceleration[c];
        }
    }
    // False, and nothing has moved, where the end is not finite; what was before the last step is lost then.
    bool step(const Composition<K>& composition, const typename K::Coefficients& k, real time, real h) {
        if constexpr (in_registers) {
            V position[parts], velocity[parts], slope[parts];
            return step_in(composition, k, time, h, Registers<V, parts>{position}, Registers<V, parts>{velocity},
                           Registers<V, parts>{slope});
        } else {
            return step_in(composition, k, time, h, q[1 - now], u[1 - now], W[1 - now]);
        }
    }

private:
    template <class Row, class F>
    LOBATTO_INLINE static void over_parts(const F& f) {
        if constexpr (are_registers<Row>)
            written_out<width>(parts * width, f);
        else
            for (int at = 0; at < parts * width; at += width) f(at);
    }
    template <class Row>
    LOBATTO_INLINE static void accelerate(const typename K::Coefficients& k, real time, Row position, Row slope) {
        using How = std::conditional_t<are_registers<Row>, WrittenOut, SideBySide>;
        Formulas<K>::template along_rows<How>(k, time, position, slope);
    }
    template <class Row>
    LOBATTO_INLINE bool step_in(const Composition<K>& composition, const typename K::Coefficients& k, real time, real h,
                                Row position, Row velocity, Row slope) {
        over_parts<Row>([&](int at) LOBATTO_FORMULA {
            const V start = V::load(W[now] + at);
            V first = V::load(u[now] + at);
            if constexpr (Composition<K>::kicks_ends) first = fused(V(composition.kick[0]), start, first);
            store_to(slope, at, start);
            store_to(velocity, at, first);
            store_to(position, at, fused(V(composition.drift[0]), first, V::load(q[now] + at)));
        });
        for (int i = 1; i < s - 1; ++i) {
            accelerate(k, time + K::c[i] * h, position, slope);
            over_parts<Row>([&](int at) LOBATTO_FORMULA {
                const V moved = fused(V(composition.kick[i]), load_from<V>(slope, at), load_from<V>(velocity, at));
                store_to(velocity, at, moved);
                store_to(position, at, fused(V(composition.drift[i]), moved, load_from<V>(position, at)));
            });
        }
        if constexpr (Composition<K>::kicks_ends) accelerate(k, time + h, position, slope);
        V not_finite = V(real(0));
        over_parts<Row>([&](int at) LOBATTO_FORMULA {
            V last = load_from<V>(velocity, at);
            const V there = load_from<V>(position, at), bent = load_from<V>(slope, at);
            if constexpr (Composition<K>::kicks_ends) last = fused(V(composition.kick[s - 1]), bent, last);
            not_finite = fused(V(real(0)), last + there, not_finite);
            there.store(q[1 - now] + at);
            last.store(u[1 - now] + at);
            bent.store(W[1 - now] + at);
        });
        if (any(not_finite != V(real(0)))) return false;
        now = 1 - now;
        return true;
    }
};

template <class K>
struct Stepper<K, Form::separable, Stepping::composition> : VelocityKept<K> {
    using typename VelocityKept<K>::real;
    using VelocityKept<K>::n, VelocityKept<K>::coefficients, VelocityKept<K>::step_size, VelocityKept<K>::q,
        VelocityKept<K>::u;
    static constexpr int s = K::points;
    static constexpr int nodes = s - (Composition<K>::kicks_ends ? 1 : 2);  // gradients of a step
    static constexpr int N = 0;

    // The ends of the last step, for what lies between them.
    struct Ends {
        std::int64_t of{-1};  // this many steps since start; -1: not computed
        real W[2][n]{};
    };

    Composition<K> composition{};
    real W[n]{};                        // M^-1 grad V at q, where ends are kicked; not of neighbours
    real q_before[n]{}, u_before[n]{};  // before the last step; likewise
    bool has_history{};                 // what lies between the ends of the last step is known
    mutable Ends ends{};
    std::conditional_t<K::neighbours, NeighbourComposition<K>, Nothing> neighbours{};

    Status prepare(const typename K::Parameters& parameters, real h) {
        step_size = h;
        has_history = false;
        composition.prepare(h);
        return K::prepare(parameters, h, coefficients);
    }

    Status start(real time, const real* position, const real* momentum) {
        const Status status = this->begin(time, position, momentum, W);
        has_history = false;
        ends.of = -1;
        if constexpr (K::neighbours) neighbours.begin(q, u, W);
        return status;
    }

    Status step() {
        if (this->time_stands_still()) return Status::time_stands_still;
        if (!move(neighbours)) {
            has_history = has_history && !K::neighbours;
            return Status::not_finite;
        }
        has_history = true;
        ++this->steps;
        return Status::ok;
    }

    // The polynomial of degree 5 that has the positions, velocities and accelerations at both ends of the last step, at
    // t + theta h.
    static constexpr int basis = 5;  // polynomials: of what q moves by, h u at both ends, h^2 W at both
    void polynomial(real theta, real* position, real* velocity) const {
        real value[basis], slope[basis];
        basis_at(theta, value, slope);
        polynomial(value, slope, position, velocity);
    }
    static void basis_at(real t, real* value, real* slope) {
        const real t2 = t * t, t3 = t2 * t;
        value[0] = t3 * (real(10) + t * (real(6) * t - real(15)));
        slope[0] = t2 * (real(30) + t * (real(30) * t - real(60)));
        value[1] = t + t3 * (t * (real(8) - real(3) * t) - real(6));
        slope[1] = real(1) + t2 * (t * (real(32) - real(15) * t) - real(18));
        value[2] = t3 * (t * (real(7) - real(3) * t) - real(4));
        slope[2] = t2 * (t * (real(28) - real(15) * t) - real(12));
        value[3] = -real(0.5) * t2 * (real(1) + t * (t * (real(3) - t) - real(3)));
        slope[3] = -real(0.5) * t * (real(2) + t * (t * (real(12) - real(5) * t) - real(9)));
        value[4] = -real(0.5) * t3 * (real(1) + t * (t - real(2)));
        slope[4] = -real(0.5) * t2 * (real(3) + t * (real(5) * t - real(8)));
    }
    void polynomial(const real* value, const real* slope, real* position, real* velocity) const {
        evaluate_ends();
        const real h = step_size;
        for (int k = 0; k < n; ++k) {
            const real begin = position_before(k);
            const real of[basis] = {q[k] - begin, h * velocity_before(k), h * u[k], h * (h * ends.W[0][k]),
                                    h * (h * ends.W[1][k])};
            real moved = value[0] * of[0], rate = slope[0] * of[0];
            for (int j = 1; j < basis; ++j) {
                moved += value[j] * of[j];
                rate += slope[j] * of[j];
            }
            position[k] = begin + moved;
            velocity[k] = rate / h;
        }
    }

    // M^-1 grad V where the motion is, of coordinate c; where ends are kicked.
    real minus_acceleration(int c) const {
        if constexpr (K::neighbours)
            return neighbours.W[neighbours.now][c];
        else
            return W[c];
    }

    // There are no equations.
    Status residual(real, const real*, const real*, const real*, real*) const { return Status::ok; }
    Status jacobian(real, const real*, const real*, const real*, real*) const { return Status::ok; }

    // One step from (q, p) at `time` and d(q1, p1)/d(q, p) (D24), 2n x 2n.
    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        if constexpr (K::has_tangent) {
            Stepper local = *this;
            const Status status = this->step_from(local, time, position, momentum, q1, p1);
            if (status != Status::ok) return status;
            real full[2 * n * (2 * n + 1)] = {}, at[n], rate[n], slope[n], entries[K::entries > 0 ? K::entries : 1];
            for (int k = 0; k < n; ++k) at[k] = position[k];
            K::velocity(coefficients, momentum, rate);
            for (int i = 0; i < s; ++i) {
                Formulas<K>::node(coefficients, time + K::c[i] * step_size, at, slope, entries);
                for (int k = 0; k < n; ++k) rate[k] = fused(composition.kick[i], slope[k], rate[k]);
                kick_increment<K>(composition.kick[i], entries, static_cast<const real*>(nullptr), full);
                if (i == s - 1) break;
                for (int k = 0; k < n; ++k) at[k] = fused(composition.drift[i], rate[k], at[k]);
                drift_increment<K>(composition.drift[i], full);
            }
            to_momentum<K>(coefficients, full);
            add_identity<K>(full, T);
            return Status::ok;
        } else {
            return Status::unsupported;
        }
    }

private:
    bool move(Nothing&) {
        real q1[n], u1[n], W1[n];
        for (int k = 0; k < n; ++k) {
            q1[k] = q[k];
            u1[k] = u[k];
            W1[k] = W[k];
        }
        kick_and_drift<K>(composition, coefficients, this->time(), step_size, q1, u1, W1);
        if (!is_finite(not_finite_part(q1, n) + not_finite_part(u1, n))) return false;
        for (int k = 0; k < n; ++k) {
            q_before[k] = q[k];
            u_before[k] = u[k];
            q[k] = q1[k];
            u[k] = u1[k];
            W[k] = W1[k];
        }
        return true;
    }
    template <class Neighbours>
    bool move(Neighbours& all) {
        if (!all.step(composition, coefficients, this->time(), step_size)) return false;
        copy_lanes<n>(all.q[all.now], q);
        copy_lanes<n>(all.u[all.now], u);
        return true;
    }

    real position_before(int k) const {
        if constexpr (K::neighbours)
            return neighbours.q[1 - neighbours.now][k];
        else
            return q_before[k];
    }
    real velocity_before(int k) const {
        if constexpr (K::neighbours)
            return neighbours.u[1 - neighbours.now][k];
        else
            return u_before[k];
    }
    void evaluate_ends() const {
        if (ends.of == this->steps) return;
        ends.of = this->steps;
        real begin[n];
        for (int k = 0; k < n; ++k) begin[k] = position_before(k);
        Formulas<K>::minus_acceleration(coefficients, this->start_time + real(this->steps - 1) * step_size, begin,
                                        ends.W[0]);
        Formulas<K>::minus_acceleration(coefficients, this->time(), q, ends.W[1]);
    }
};

template <class K, class T>
struct LaneStepper<K, T, Form::separable, Stepping::composition> : LaneState<K, T, true, 2> {
    using State = LaneState<K, T, true, 2>;
    using State::n, State::q, State::now;
    using typename State::real, typename State::ActiveMask;
    T W[2][n];
    Composition<K> composition;
    real h;
    struct Shared {  // by all trajectories of one step size
        Composition<K> composition;
        real h;
    };

    Shared shared() const { return {composition, h}; }
    template <bool>
    LOBATTO_INLINE void take(const Shared& all) {
        composition = all.composition;
        h = all.h;
    }
    void prepare(const ScalarFallback<K>& single, int) {
        composition = single.composition;
        h = single.step_size;
    }
    void set_tolerance(real) {}
    void start(const ScalarFallback<K>& single, int lane) { follow(single, lane); }
    void refill(const ScalarFallback<K>& single, int lane) { follow(single, lane); }
    template <class Given, class Time>
    LOBATTO_LANE ActiveMask step(const Given& k, const Time& time, ActiveMask active) {
        const int next = 1 - now;
        auto& u = this->rate;
        T not_finite = T(real(0));
        if constexpr (K::immediate) {
            immediate_step<K>(composition, k, time, q[now], u[now], W[now], q[next], u[next], W[next]);
            for (int c = 0; c < n; ++c) not_finite = fused(T(real(0)), q[next][c] + u[next][c], not_finite);
        } else {
            T q1[n], u1[n], W1[n];
            for (int c = 0; c < n; ++c) {
                q1[c] = q[now][c];
                u1[c] = u[now][c];
                W1[c] = W[now][c];
            }
            kick_and_drift<K>(composition, k, time, h, q1, u1, W1);
            for (int c = 0; c < n; ++c) {
                not_finite += (q1[c] - q1[c]) + (u1[c] - u1[c]);
                q[next][c] = q1[c];
                u[next][c] = u1[c];
                W[next][c] = W1[c];
            }
        }
        active = active & (not_finite == T(real(0)));
        if (!all(active))
            for (int c = 0; c < n; ++c) {
                q[next][c] = select(active, q[next][c], q[now][c]);
                u[next][c] = select(active, u[next][c], u[now][c]);
                if constexpr (Composition<K>::kicks_ends) W[next][c] = select(active, W[next][c], W[now][c]);
            }
        now = next;
        return active;
    }
    void follow(const ScalarFallback<K>& single, int lane) {
        this->follow_state(single, lane);
        for (int c = 0; c < n; ++c) set_lane(W[now][c], lane, single.minus_acceleration(c));
    }

    template <class Given>
    LOBATTO_LANE void displacements(const Given& k, const T& time, const T* q_before, const T* u_before,
                                    T (*moved)[n]) const {
        T start[n], end[n];
        Formulas<K>::minus_acceleration(k, time, q_before, start);
        Formulas<K>::minus_acceleration(k, time + T(h), this->positions(), end);
        for (int c = 0; c < n; ++c) {
            moved[0][c] = q[now][c] - q_before[c];
            moved[1][c] = T(h) * u_before[c];
            moved[2][c] = T(h) * this->rate[now][c];
            moved[3][c] = T(h) * (T(h) * start[c]);
            moved[4][c] = T(h) * (T(h) * end[c]);
        }
    }
    template <class Single>
    void lend_step(const T (*)[n], Single& single, int lane) const {
        this->lend_end(single, lane);
        single.ends.of = -1;
    }
};

}  // namespace lobatto

#endif
