// SPDX-License-Identifier: MIT
// The velocity of a momentum: Newton's iteration for p = dL/dv(q, v, t) (D27). With constraints phi(q, t) = 0, G =
// dphi/dq, it is the velocity that keeps them, with multipliers mu (D46):
//     dL/dv + G^T mu = p,  G v + dphi/dt = 0.
// p - G^T mu is then the nearest momentum, in the metric of the mass, whose velocity keeps the constraints. The same
// matrix, of M and G, gives the multipliers of a motion (D49). If the time is a coordinate, its velocity is that of the
// clock, whatever its momentum, so that the other velocities are those of their own momenta.
#ifndef LOBATTO_KERNEL_VELOCITY_OF_MOMENTUM_HPP
#define LOBATTO_KERNEL_VELOCITY_OF_MOMENTUM_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/dense.hpp"
#include "../base/numbers.hpp"

namespace lobatto {

template <class K>
class VelocityOfMomentum {
public:
    using real = typename K::real;
    static constexpr int n = K::coordinates, constraints = K::constraints, unknowns = n + constraints;

    // v with the momentum p, and mu where there are constraints. The iteration begins at rest; where rest is
    // impossible, as in a frame that rotates faster than light, at a velocity that guess(v) writes, if it knows one.
    template <class Guess>
    Status find(const typename K::Coefficients& k, real time, const real* q, const real* p, const Guess& guess, real* v,
                real* mu) const {
        return workspace_.with([&](Arrays& a) {
            const State at{k, time, q, p};
            if constexpr (constraints > 0) {
                real phi[constraints];
                Formulas<K>::constraint(k, time, q, phi, a.phi_t, a.G);
            }
            rest(at, a);
            Status status = solve(at, a);
            const bool has_no_rest = status == Status::not_finite;
            if (status != Status::ok) {
                rest(at, a);
                if (guess(a.x)) status = solve(at, a);
            }
            for (int d = -1; d < (has_no_rest ? most_directions : 0) && status != Status::ok; ++d) {
                real direction[n] = {};
                for (int i = 0; i < n; ++i) direction[i] = d < 0 ? p[i] : real(i == d / 2) * real(d % 2 == 0 ? 1 : -1);
                begin_along(at, direction, a);
                if (solve(at, a) == Status::ok) status = Status::ok;
            }
            for (int i = 0; i < n; ++i) v[i] = a.x[i];
            for (int c = 0; c < constraints; ++c) mu[c] = a.x[n + c];
            return status;
        });
    }

    // (D49) The multipliers of a motion with velocity v: M a - G^T lambda = r, G a = s.
    Status multipliers(const typename K::Coefficients& k, real time, const real* q, const real* v, real* lambda) const {
        if constexpr (constraints > 0) {
            return workspace_.with([&](Arrays& a) {
                real phi[constraints];
                Formulas<K>::constraint(k, time, q, phi, a.phi_t, a.G);
                Formulas<K>::legendre(k, time, q, v, a.p, a.mass);
                Formulas<K>::multiplier_terms(k, time, q, v, a.residual, a.residual + n);
                set_matrix(a);
                if (!a.matrix.factor()) return Status::singular_mass;
                solve_for(a, a.x);
                for (int c = 0; c < constraints; ++c) lambda[c] = -a.x[n + c];
                return is_finite(not_finite_part(a.x, unknowns)) ? Status::ok : Status::not_finite;
            });
        } else {
            return Status::unsupported;
        }
    }

private:
    using Layout = std::conditional_t<K::cyclic == 0, LayoutOf<K, unknowns, 1>, Single<n>>;
    static constexpr int few = 4;  // iterations, after which only rounding may be left
    static constexpr int most_directions = n <= 16 ? 2 * n : 0;
    static constexpr int mass_room = K::mass_entries > 0 ? K::mass_entries : 1;
    static constexpr int slope_room = K::constraint_entries > 0 ? K::constraint_entries : 1;
    // x: v, then mu.
    struct Arrays {
        real x[unknowns], trial[unknowns], residual[unknowns], increment[unknowns], next[unknowns];
        real p[n], mass[mass_room], phi_t[constraints > 0 ? constraints : 1], G[slope_room];
        typename Layout::template Matrix<real> matrix;
    };
    struct State {
        const typename K::Coefficients& k;
        real time;
        const real *q, *p;
    };

    static void rest(const State& at, Arrays& a) {
        for (int i = 0; i < unknowns; ++i) a.x[i] = real(0);
        if constexpr (K::has_time_coordinate) a.x[n - 1] = Formulas<K>::clock(at.k, at.time, at.q);
    }

    // Both equations at x; whether they have values there.
    LOBATTO_APART static bool evaluate(const State& at, const real* x, Arrays& a) {
        Formulas<K>::legendre(at.k, at.time, at.q, x, a.p, a.mass);
        for (int i = 0; i < n; ++i) a.residual[i] = at.p[i] - a.p[i];
        if constexpr (K::has_time_coordinate) a.residual[n - 1] = real(0);
        for (int c = 0; c < constraints; ++c) a.residual[n + c] = -a.phi_t[c];
        each_slope([&](int e, int c, int i) {
            a.residual[i] -= a.G[e] * x[n + c];
            a.residual[n + c] -= a.G[e] * x[i];
        });
        return is_finite(not_finite_part(a.residual, unknowns) + not_finite_part(a.mass, K::mass_entries));
    }

    // use(e, c, i) for the entries e of G, dphi_c/dq_i.
    template <class Use>
    static void each_slope(const Use& use) {
        for (int e = 0; e < K::constraint_entries; ++e) use(e, K::constraint_row[e], K::constraint_column[e]);
    }

    // M and G.
    static void set_matrix(Arrays& a) {
        a.matrix.clear();
        for (int e = 0; e < K::mass_entries; ++e)
            if (!K::has_time_coordinate || K::mass_row[e] < n - 1)
                a.matrix(K::mass_row[e], 0, K::mass_column[e], 0) += a.mass[e];
        if constexpr (K::has_time_coordinate) a.matrix(n - 1, 0, n - 1, 0) = real(1);
        each_slope([&](int e, int c, int i) {
            a.matrix(i, 0, n + c, 0) += a.G[e];
            a.matrix(n + c, 0, i, 0) += a.G[e];
        });
    }

    // Increments are halved while the next one would be longer or is not finite, as with Lagrangians like -sqrt(1 -
    // v^2); lengths: sum |increment residual|.
    static Status solve(const State& at, Arrays& a) {
        if (!evaluate(at, a.x, a)) return Status::not_finite;
        bool may_be_last = true;
        for (int iteration = 0; iteration < 100; ++iteration) {
            if (iteration > 0 && is_near(at, a, real(2) * Limits<real>::epsilon)) return Status::ok;
            if (iteration > few && is_rounding(at, a)) return Status::ok;
            set_matrix(a);
            if (!a.matrix.factor()) return Status::singular_mass;
            const real length = solve_for(a, a.increment);
            const bool next_is_rounding = may_be_last && iteration > 0 && is_near(at, a, Limits<real>::root_epsilon);
            for (real part = real(1);; part *= real(0.5)) {
                if (part < Limits<real>::epsilon)
                    return evaluate(at, a.x, a) && is_rounding(at, a) ? Status::ok : Status::not_converged;
                for (int i = 0; i < unknowns; ++i) a.trial[i] = a.x[i] + part * a.increment[i];
                if (next_is_rounding || (evaluate(at, a.trial, a) && solve_for(a, a.next) <= length)) break;
            }
            if (next_is_rounding) {  // near the speed of light it may not be
                may_be_last = evaluate(at, a.trial, a) && is_near(at, a, real(64) * Limits<real>::epsilon);
                if (!may_be_last && !evaluate(at, a.x, a)) return Status::not_finite;
                if (!may_be_last) continue;
            }
            for (int i = 0; i < unknowns; ++i) a.x[i] = a.trial[i];
            if (next_is_rounding) return Status::ok;
        }
        return Status::not_converged;
    }

    // At rest there is no inverse, as of v^4, and no value of x'^2/t': the multiple of a direction whose own momentum
    // is nearest. Directions are that of the momentum, and where rest has no value those of the coordinates.
    static void begin_along(const State& at, const real* direction, Arrays& a) {
        constexpr int moving = K::has_time_coordinate ? n - 1 : n;
        real best = real(0), nearest = -real(1);
        rest(at, a);
        for (real scale = real(0x1p-40); scale <= real(0x1p40); scale *= real(2)) {
            for (int i = 0; i < moving; ++i) a.x[i] = scale * direction[i];
            if (!evaluate(at, a.x, a)) continue;
            real apart = real(0);
            for (int i = 0; i < n; ++i) apart += a.residual[i] * a.residual[i];
            if (nearest < real(0) || apart < nearest) best = scale, nearest = apart;
        }
        for (int i = 0; i < moving; ++i) a.x[i] = best * direction[i];
    }

    // Whether what is left is within a bound of what it is computed from.
    LOBATTO_APART static bool is_near(const State& at, const Arrays& a, real bound) {
        real size[unknowns];
        for (int i = 0; i < n; ++i) size[i] = fabs(at.p[i]);
        for (int c = 0; c < constraints; ++c) size[n + c] = fabs(a.phi_t[c]);
        for (int e = 0; e < K::mass_entries; ++e) size[K::mass_row[e]] += fabs(a.mass[e] * a.x[K::mass_column[e]]);
        each_slope([&](int e, int c, int i) {
            size[i] += fabs(a.G[e] * a.x[n + c]);
            size[n + c] += fabs(a.G[e] * a.x[i]);
        });
        for (int i = 0; i < unknowns; ++i)
            if (!(fabs(a.residual[i]) <= bound * size[i])) return false;
        return true;
    }

    // Whether what is left is rounding. It is measured by the momentum, and what constraints take of it, which may be
    // all; by the whole motion, in the metric of the mass: |p_i| <= sqrt(M_ii p v); and by the terms of p, where these
    // cancel at rest. The terms of one row may all be rounding, as those of a coordinate that a constraint holds fixed.
    static bool is_rounding(const State& at, const Arrays& a) {
        real twice_energy = real(0), mass[n] = {}, size[unknowns] = {};
        for (int i = 0; i < n; ++i) twice_energy += fabs(at.p[i] * a.x[i]);
        for (int e = 0; e < K::mass_entries; ++e)
            if (K::mass_row[e] == K::mass_column[e]) mass[K::mass_row[e]] = fabs(a.mass[e]);
        for (int i = 0; i < n; ++i) size[i] = sqrt(mass[i] * twice_energy) + fabs(at.p[i]);
        each_slope([&](int e, int c, int i) {
            size[i] += fabs(a.G[e] * a.x[n + c]);
            if (mass[i] > real(0))
                size[n + c] += fabs(a.G[e]) * (sqrt(twice_energy / mass[i]) + fabs(at.p[i]) / mass[i]);
        });
        if constexpr (K::momentum_summand_count > 0) {  // momenta are 0 at rest as differences, as exp(v) - 1 is
            real T[K::momentum_summand_count];
            Formulas<K>::momentum_summands(at.k, at.time, at.q, a.x, +T);
            for (int e = 0; e < K::momentum_summand_count; ++e)
                size[K::momentum_summand_row[e]] += real(0.5) * fabs(T[e]);
        }
        for (int i = 0; i < unknowns; ++i)
            if (!(fabs(a.residual[i]) <= real(64) * Limits<real>::epsilon * size[i])) return false;
        return true;
    }

    // x = matrix^-1 residual; sum |x_i residual_i|.
    LOBATTO_APART static real solve_for(const Arrays& a, real* x) {
        real sorted[unknowns], length = real(0);
        for (int i = 0; i < unknowns; ++i) sorted[Layout::index(i, 0)] = a.residual[i];
        a.matrix.solve(sorted);
        for (int i = 0; i < unknowns; ++i) {
            x[i] = sorted[Layout::index(i, 0)];
            length += fabs(x[i] * a.residual[i]);
        }
        return length;
    }

    Workspace<Arrays> workspace_;
};

}  // namespace lobatto

#endif
