// SPDX-License-Identifier: MIT
// The step of one separable system by iterations over its nodes: accelerations of all nodes at once, in the lanes of
// Packs, then the stage map (iteration/stage_map.hpp).
//
// Formula numbers (D..) refer to docs/derivation.md. An iteration, Q <- q + h c v - h^2 A W(Q), contracts like h^2 |A|
// |S|, S = dW/dq; once the increment e is below sqrt(epsilon), W(Q) + S (Q' - Q) stands for W(Q'), which errs by e^2,
// and the iterations that are left evaluate nothing. Where the constant part of S is taken into the map, they contract
// like what is left of S.
#ifndef LOBATTO_KERNEL_FIXED_POINT_HPP
#define LOBATTO_KERNEL_FIXED_POINT_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "convergence.hpp"
#include "stage_map.hpp"

namespace lobatto {

// What takes a step before this iteration is tried: of kernels in DoubleDouble, iteration/refinement.hpp.
template <class K, class real = typename K::real>
struct RefinementOf {
    static constexpr bool exists = false;
    using type = Nothing;
};

template <class K>
struct FixedPoint : StageMap<K, typename K::real> {
    using real = typename K::real;
    using Tables = StageMap<K, real>;
    using Tables::h, Tables::usable, Tables::has_history, Tables::w, Tables::rest, Tables::diagonal, Tables::node_time,
        Tables::weight, Tables::arrival, Tables::map_of, Tables::row;
    using Tables::n, Tables::s, Tables::m, Tables::with_end, Tables::absorbs, Tables::width, Tables::parts,
        Tables::entries;
    using typename Tables::V;
    // Of many digits each iteration gains as many as in double: more of them are still worth less than Newton's.
    static constexpr bool is_long = is_many_digits<real>;
    static constexpr int evaluation_limit = is_long ? 60 : 16, carried_limit = is_long ? 80 : 24;

    struct Arrays {
        V base[parts * n], X[parts * n], W[parts * n], S[parts * entries], Y[parts * n], carried[parts * n];
        real flat[n * parts * width], rate[n], inverse_scale[n], inverse_linear[n];
    };

    real tolerance{};        // of increments, relative; 0: to rounding
    real least_increment{};  // what the rounding of forces moves positions by, where that is known
    real evaluations;        // of the last step
    real increment;          // the last one of the last step, relative
    real twentieth_norm{};   // h^2 |A| / 20
    Workspace<Arrays> workspace;
    typename RefinementOf<K>::type refinement{};

    void prepare(const typename K::Coefficients& k, real step) {
        Tables::prepare(k, step);
        if constexpr (RefinementOf<K>::exists) refinement.prepare(k, step);
        real norm = real(0);
        for (int i = 0; i <= m; ++i) {
            real sum = real(0);
            for (int j = 0; j < m; ++j) sum += fabs(row(i, j));
            norm = maximum(sum, norm);
        }
        twentieth_norm = h * h * norm / real(20);
    }

    // One step, h from `time`; false: it was not solved, and nothing has changed.
    bool step(const typename K::Coefficients& k, real time, real* q, real* u) {
        return workspace.with([&](Arrays& a) {
            if constexpr (RefinementOf<K>::exists)
                if (refinement.solve(k, *this, time, q, u, a)) return finish(k, time, q, u, a);
            return solve(k, time, q, u, a) && finish(k, time, q, u, a);
        });
    }

private:
    template <class>
    friend struct Refinement;

    // base + sum_j column_j r_j of one part.
    template <int terms>
    LOBATTO_INLINE static V sum_of(const V& base, const V (*column)[parts], int p, const real* r) {
        V even = base, odd = V(real(0));
#pragma GCC unroll 16
        for (int j = 0; j < terms; ++j) {
            V& sum = j % 2 == 0 ? even : odd;
            sum = fused(column[j][p], V(r[j]), sum);
        }
        return terms > 1 ? even + odd : even;
    }

    // One iteration: Y = base - h^2 P A r with r = W, or `carried` W + S (Y - X), minus D at the same place.
    // The size of what Y moved by; `displaced`: the same, in the measure for carrying.
    template <bool is_carried>
    LOBATTO_INLINE real iterate(Arrays& a, real& displaced) const {
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
                Y = next;
                worst = maximum(worst, fabs(moved) * V(a.inverse_scale[c]));
                if constexpr (K::uses_hessian && !is_carried)
                    farthest = maximum(farthest, fabs(moved) * V(a.inverse_linear[c]));
            }
        displaced = largest(farthest);
        return largest(worst);
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

    LOBATTO_INLINE void evaluate(const typename K::Coefficients& k, real time, Arrays& a) const {
        for (int p = 0; p < parts; ++p)
            if constexpr (K::uses_hessian)
                Formulas<K>::node(k, V(time) + node_time[p], a.X + p * n, a.W + p * n, a.S + p * entries);
            else
                Formulas<K>::minus_acceleration(k, V(time) + node_time[p], a.X + p * n, a.W + p * n);
    }

    // A twentieth of h^2 |A| |S - D|, largest row sums. Fixed-point iterations contract by more than the norm says, but
    // the first ratio of two increments can be small by chance: no estimate goes below this.
    real least_rate(const Arrays& a) const {
        V worst = V(real(0));
        for (int p = 0; p < parts; ++p) {
            V sums[n];
            for (int c = 0; c < n; ++c) sums[c] = V(real(0));
            for (int e = 0; e < K::entries; ++e) {
                V entry = a.S[p * entries + e];
                if constexpr (absorbs) {
                    if (K::entry_row[e] == K::entry_column[e]) entry -= V(diagonal[K::entry_row[e]]);
                }
                sums[K::entry_row[e]] += fabs(entry);
            }
            for (int c = 0; c < n; ++c) worst = maximum(worst, sums[c]);
        }
        return twentieth_norm * largest(worst);
    }

    // The stage equations; a.carried: W at the nodes.
    bool solve(const typename K::Coefficients& k, real time, const real* q, const real* u, Arrays& a) {
        constexpr real of_position = Limits<real>::epsilon / Limits<real>::root_epsilon;
        // Each coordinate has its own measures: increments as small as its rounding are so whatever the others do.
        const real small = maximum(tolerance, Limits<real>::epsilon);
        const real linear = maximum(Limits<real>::root_epsilon, sqrt(tolerance));  // where e^2 is no matter
        for (int c = 0; c < n; ++c) {
            const real W0 = w[c * s + s - 1];
            a.rate[c] = fused(-h * K::b[0], W0, u[c]);
            const real scale = fabs(h * a.rate[c]) + fabs(h * (h * W0)) + of_position * fabs(q[c]);
            const real rounding = Limits<real>::epsilon * fabs(q[c]) + Limits<real>::smallest + least_increment;
            a.inverse_scale[c] = real(1) / maximum(scale, real(1) / small * rounding);
            a.inverse_linear[c] = real(1) / maximum(scale, real(8) / linear * rounding);
        }
        for (int c = 0; c < n; ++c)
            for (int p = 0; p < parts; ++p) {
                const auto& of = map_of(c);
                const V base = fused(of.on_velocity[p], V(a.rate[c]), of.on_position[p] * V(q[c]));
                a.base[p * n + c] = base;
                const real* last;
                if constexpr (absorbs)
                    last = rest + c * s;
                else
                    last = w + c * s;
                a.X[p * n + c] =
                    has_history ? sum_of<s>(base, of.before, p, last) : fused(of.simple[p], V(last[s - 1]), base);
            }
        evaluations = real(0);
        if (!usable) return false;
        const Convergence<real> rule{small};
        real e_before = K::uses_hessian ? Limits<real>::largest : real(0);
        [[maybe_unused]] real least = real(0);
        for (int evaluation = 1; evaluation <= evaluation_limit; ++evaluation) {
            evaluate(k, time, a);
            evaluations += real(1);
            real displaced;
            const real e = iterate<false>(a, displaced);
            if (evaluation > rule.judged_after && !rule.contracts(e, e_before)) return false;
            if constexpr (K::uses_hessian) {
                if (evaluation == 1) least = least_rate(a);
                if (displaced <= linear) return carry(e, e_before, least, small, a);
            } else {
                // What is left, e times its ratio to the one before, is rounding; or it no longer shrinks.
                if (rule.reached(e, e_before)) {
                    settle(k, time, a);
                    increment = e;
                    return true;
                }
            }
            for (int i = 0; i < parts * n; ++i) a.X[i] = a.Y[i];
            e_before = e;
        }
        return false;
    }

    // W at the nodes Y.
    LOBATTO_INLINE void settle(const typename K::Coefficients& k, real time, Arrays& a) const {
        for (int p = 0; p < parts; ++p)
            Formulas<K>::minus_acceleration(k, V(time) + node_time[p], a.Y + p * n, a.carried + p * n);
    }

    // Fixed-point iterations with W + S (Y - X) in place of W(Y), until what is left of an increment, e times its ratio
    // to the one before, is rounding; then that is what W is at the nodes.
    LOBATTO_INLINE bool carry(real e, real e_before, real least, real small, Arrays& a) {
        const Convergence<real, 1, NoisyPace> rule{small};
        real ignored;
        bool still = !(e * e <= small * e_before && e * least <= small);
        for (int i = 0; i < carried_limit && still; ++i) {
            const real next = iterate<true>(a, ignored);
            const bool stands = next >= real(0.5) * e && next > real(0);  // rounding, or no convergence
            if (stands && !rule.is_noise(next)) return false;
            still = !stands && !(next * next <= small * e && next * least <= small);
            e = next;
        }
        increment = e;
        for (int p = 0; p < parts; ++p) carry_over(a, p, a.carried + p * n);
        return !still;
    }

    // (D16), (D17): the end of the step, each sum of increments rounded once; then the memory of the step.
    bool finish(const typename K::Coefficients& k, real time, real* q, real* u, Arrays& a) {
        real q1[n], u1[n], W1[n];
        for (int c = 0; c < n; ++c) {
            lay_flat<parts>(a.carried + c, n, a.flat + c * parts * width);
            V to_arrive = arrival[0] * a.carried[c], to_change = weight[0] * a.carried[c];
            for (int p = 1; p < parts; ++p) {
                to_arrive = fused(arrival[p], a.carried[p * n + c], to_arrive);
                to_change = fused(weight[p], a.carried[p * n + c], to_change);
            }
            q1[c] = q[c] + fused(h, a.rate[c], sum(to_arrive));
            u1[c] = sum(to_change);
        }
        if constexpr (with_end) {
            for (int c = 0; c < n; ++c) W1[c] = a.flat[c * parts * width + m];
        } else {
            Formulas<K>::minus_acceleration(k, time + h, q1, W1);
        }
        real not_finite = real(0);
        for (int c = 0; c < n; ++c) {
            real change = fused(-h * K::b[0], w[c * s + s - 1], u1[c]);
            if constexpr (!with_end) change = fused(-h * K::b[s - 1], W1[c], change);
            u1[c] = u[c] + change;
            not_finite += (q1[c] - q1[c]) + (u1[c] - u1[c]) + (W1[c] - W1[c]);
        }
        if (not_finite != real(0)) return false;
        remember(q, u, q1, u1, W1, a);
        has_history = true;
        return true;
    }

    // The end of the step becomes the state, and its accelerations the memory.
    LOBATTO_INLINE void remember(real* q, real* u, const real* q1, const real* u1, const real* W1, const Arrays& a) {
        for (int c = 0; c < n; ++c) {
            real* const memory = w + c * s;
            const real* const flat = a.flat + c * parts * width;
            memory[0] = memory[s - 1];
            for (int j = 0; j < m; ++j) memory[j + 1] = flat[j];
            memory[s - 1] = W1[c];
            if constexpr (absorbs) {
                real* const r = rest + c * s;
                r[0] = r[s - 1];
                for (int j = 0; j < m; ++j)
                    r[j + 1] = flat[j] - diagonal[c] * lane_of(a.Y[(j / width) * n + c], j % width);
                r[s - 1] = W1[c] - diagonal[c] * q1[c];
            }
            q[c] = q1[c];
            u[c] = u1[c];
        }
    }
};

template <class K>
struct FixedPointOf<K, false> {
    using type = FixedPoint<K>;
};

}  // namespace lobatto

#endif
