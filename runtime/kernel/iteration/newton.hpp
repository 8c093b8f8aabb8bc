// SPDX-License-Identifier: MIT
// Newton's iteration for the stage equations (D14), where the fixed-point iteration does not contract.
//
// Three cases: a linear system needs one correction; where V is nearly quadratic one Jacobian serves all iterations
// (a chord iteration); else each iteration has a Jacobian of its own.
#ifndef LOBATTO_KERNEL_NEWTON_HPP
#define LOBATTO_KERNEL_NEWTON_HPP

#include <type_traits>
#include <utility>

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "convergence.hpp"
#include "stage_equations.hpp"

namespace lobatto {

template <class K>
struct NewtonIteration {
    using real = typename K::real;
    using Stages = StageEquations<K>;
    using Matrix = typename Stages::Matrix;
    using Coefficients = typename K::Coefficients;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2, N = n * m;
    static constexpr int room = N > 0 ? N : 1, entry_room = K::entries > 0 ? K::entries : 1;
    using Rule = NewtonConvergence<real>;
    static constexpr bool is_frozen = N > 0 && (K::linear || K::absorbed);

    struct Arrays {
        real v[n], base[(s - 1) * n];        // what is known of a step before it is solved (D11)
        real Q[room], W[room], delta[room];  // at the interior nodes
        real S[(m > 0 ? m : 1) * entry_room];
        real inverse_scale[n], sorted[room], net;  // net: of increments, relative
        Matrix matrix;
    };
    struct Outcome {
        Status status;
        std::int32_t iterations;
        real increment;  // the last one, relative to the displacement within the step
        real noise;      // what the rounding of forces moves positions by, where it ended the iteration
    };

    Status prepare(const Coefficients& k, real h) {
        if constexpr (is_frozen) {
            frozen_.is_factored = false;
            if constexpr (K::linear) {
                real q[n] = {}, W[n];
                Formulas<K>::node(k, real(0), q, W, frozen_.S);
                factor(frozen_, h);
                return frozen_.usable ? Status::ok : Status::singular_jacobian;
            }
        }
        return Status::ok;
    }

    // Solves for a.Q and a.W, from the start value in a.Q; a.v and a.base are given. q and W0: at the start of the
    // step.
    Outcome solve(const Coefficients& k, real h, real time, const real* q, const real* W0, Arrays& a) {
        scale_increments(h, q, W0, a);
        Outcome outcome{Status::not_converged, 0, real(0), real(0)};
        if constexpr (is_frozen && K::linear) {
            correct_once(k, h, time, a, outcome);
        } else {
            if constexpr (is_frozen) {
                if (!frozen_.is_factored) {
                    K::quadratic_part(k, frozen_.S);
                    factor(frozen_, h);
                }
                if (frozen_.usable) chord(k, h, time, a, outcome);
            }
            if (outcome.status == Status::not_converged) newton(k, h, time, a, outcome);
        }
        return outcome;
    }

private:
    // The Jacobian with a constant S.
    struct Frozen {
        Matrix matrix;
        real S[entry_room];
        bool usable, is_factored;
    };

    static real node_time(real time, real h, int i) { return time + K::c[i + 1] * h; }

    template <class FrozenPart>
    static void factor(FrozenPart& part, real h) {
        part.usable = Stages(h).factor(part.S, 0, part.matrix);
        part.is_factored = true;
    }

    // The scale that increments of each coordinate are measured against: the displacement within the step, with the
    // rounding of the position as floor.
    static void scale_increments(real h, const real* q, const real* W0, Arrays& a) {
        constexpr real floor = Limits<real>::epsilon / Limits<real>::root_epsilon;
        for (int k = 0; k < n; ++k) {
            const real scale = fabs(h * a.v[k]) + fabs(h * (h * W0[k])) + floor * fabs(q[k]);
            a.inverse_scale[k] = scale > Limits<real>::smallest ? real(1) / scale : real(0);
        }
    }

    // Adds the increments to the positions; their largest size, or not a number.
    static real apply_increments(Arrays& a) {
        real e = a.net = real(0);
        for (int i = 0; i < m; ++i)
            for (int k = 0; k < n; ++k) {
                const real d = fabs(a.delta[i * n + k]);
                real relative = d * a.inverse_scale[k];
                // A coordinate at rest that only the others move: its own displacement is the measure.
                if (a.inverse_scale[k] == real(0) && d > real(0)) relative = d / (d + fabs(a.Q[i * n + k]));
                e = maximum(relative, e);
                a.net += a.delta[i * n + k] < real(0) ? -relative : relative;
            }
        for (int i = 0; i < N; ++i) a.Q[i] += a.delta[i];
        return is_finite(a.net) ? e : a.net - a.net;
    }

    // Whether increments that no longer shrink are within `roundings` of what they are computed from: positions and
    // accelerations. S is that of the nodes, `stride` apart.
    static bool is_rounding(real h, const Arrays& a, const real* S, int stride, int roundings) {
        for (int i = 0; i < m; ++i) {
            real size[n];
            for (int k = 0; k < n; ++k) size[k] = fabs(a.W[i * n + k]);
            for (int e = 0; e < K::entries; ++e)
                size[K::entry_row[e]] += fabs(S[i * stride + e] * a.Q[i * n + K::entry_column[e]]);
            for (int k = 0; k < n; ++k) {
                const real sum = fabs(a.Q[i * n + k]) + fabs(a.base[i * n + k]) + h * h * size[k];
                if (!(fabs(a.delta[i * n + k]) <= real(roundings) * Limits<real>::epsilon * sum)) return false;
            }
        }
        return true;
    }

    // The largest increment, if all are far below the largest displacement within the step; else 0. Newton's iteration
    // goes to and fro by such where terms cancel, as in exp(a) - exp(b), and their rounding moves what hardly moves.
    static real noise_of(const Arrays& a) {
        real most = real(0), of_farthest = Limits<real>::largest;
        for (int k = 0; k < n; ++k)
            if (a.inverse_scale[k] > real(0)) of_farthest = minimum(of_farthest, a.inverse_scale[k]);
        for (int i = 0; i < N; ++i) most = maximum(most, fabs(a.delta[i]));
        return most * of_farthest <= Limits<real>::root_epsilon ? most : real(0);
    }

    // At the end accelerations are carried to the final positions to first order, which errs by e^2 as they do.
    static void newton(const Coefficients& k, real h, real time, Arrays& a, Outcome& outcome) {
        const Stages stages(h);
        real previous = Limits<real>::largest, net_before = real(0);
        for (int iteration = 1; iteration <= Rule::iteration_limit; ++iteration) {
            for (int i = 0; i < m; ++i)
                Formulas<K>::node(k, node_time(time, h, i), a.Q + i * n, a.W + i * n, a.S + i * K::entries);
            ++outcome.iterations;
            if (!stages.factor(a.S, K::entries, a.matrix)) {
                outcome.status = why_singular(h, a.S);
                return;
            }
            stages.solve(a.base, a.Q, a.W, a.matrix, a.delta, a.sorted);
            const real e = outcome.increment = apply_increments(a);
            if (!is_finite(e)) {
                outcome.status = Status::not_finite;
                return;
            }
            const bool stagnates = Rule::stagnates(iteration, e, previous);
            const bool returns = fabs(a.net + std::exchange(net_before, a.net)) < real(0.5) * fabs(a.net);
            if (stagnates && returns && iteration > Rule::noise_after) outcome.noise = noise_of(a);
            if (K::linear || Rule::reached(iteration, e, previous) || outcome.noise > real(0) ||
                (stagnates && is_rounding(h, a, a.S, K::entries, Rule::noise))) {
                stages.carry(a.S, K::entries, a.delta, a.W);
                outcome.status = Status::ok;
                return;
            }
            previous = e;
        }
        outcome.status = Status::not_converged;
    }

    // Of entries h^2 S far beyond 1 / epsilon products overflow, and their matrix only looks singular.
    static Status why_singular(real h, const real* S) {
        for (int e = 0; e < m * K::entries; ++e) {
            const real entry = fabs(h * (h * S[e])) * Limits<real>::epsilon * Limits<real>::epsilon;
            if (!(entry <= real(1))) return Status::not_finite;
        }
        return Status::singular_jacobian;
    }

    // One increment with the frozen Jacobian; its size.
    real frozen_increment(const Coefficients& k, real h, real time, Arrays& a, Outcome& outcome) const {
        for (int i = 0; i < m; ++i) Formulas<K>::minus_acceleration(k, node_time(time, h, i), a.Q + i * n, a.W + i * n);
        ++outcome.iterations;
        Stages(h).solve(a.base, a.Q, a.W, frozen_.matrix, a.delta, a.sorted);
        return apply_increments(a);
    }

    // A linear system: the frozen Jacobian is the Jacobian.
    void correct_once(const Coefficients& k, real h, real time, Arrays& a, Outcome& outcome) const {
        outcome.status = is_finite(frozen_increment(k, h, time, a, outcome)) ? Status::ok : Status::not_finite;
        if (outcome.status == Status::ok) Stages(h).carry(frozen_.S, 0, a.delta, a.W);
    }

    // The frozen Jacobian holds the constant part of S only. Where that is too slow: not_converged.
    void chord(const Coefficients& k, real h, real time, Arrays& a, Outcome& outcome) const {
        using Chord = ChordConvergence<real>;
        real previous = Limits<real>::largest;
        for (int iteration = 1; iteration <= Rule::iteration_limit; ++iteration) {
            const real e = outcome.increment = frozen_increment(k, h, time, a, outcome);
            if (!is_finite(e)) {
                outcome.status = Status::not_finite;
                return;
            }
            const bool is_slow = Chord::is_slow(iteration, e, previous);
            if (Chord::reached(iteration, e, previous) || (is_slow && is_rounding(h, a, frozen_.S, 0, Chord::noise))) {
                Stages(h).carry(frozen_.S, 0, a.delta, a.W);
                outcome.status = Status::ok;
                return;
            }
            if (is_slow) return;
            previous = e;
        }
    }

    std::conditional_t<is_frozen, Frozen, Nothing> frozen_{};
};

}  // namespace lobatto

#endif
