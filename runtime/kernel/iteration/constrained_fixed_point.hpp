// SPDX-License-Identifier: MIT
// The step of a system with constraints, a constant mass matrix and forces without velocities, by fixed-point
// iteration: no equations larger than those of one node's constraints.
//
// With f = dL/dq + F, W_j = M^-1 (f_j + G_j^T Lambda_j) and the stage map A over all nodes but the last, (D45) is
//     Q_i = q + h c_i v + h^2 sum_j A_ij W_j,   phi(Q_i) = 0,   i = 1 ... m, j = 0 ... m - 1.
// An iteration evaluates f, phi and G at all nodes, in the lanes of Packs, then corrects the multipliers as if G were
// the same all along the step (D48),
//     Lambda <- Lambda - (h^2 A)^-1 phi B^-1,   B = G M^-1 G^T in the middle,
// and then the positions. It contracts like the turn of G within a step.
#ifndef LOBATTO_KERNEL_CONSTRAINED_FIXED_POINT_HPP
#define LOBATTO_KERNEL_CONSTRAINED_FIXED_POINT_HPP

#include "../base/contract.hpp"
#include "../base/dense.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "constraint_rounding.hpp"
#include "convergence.hpp"
#include "extrapolation.hpp"
#include "node_mass.hpp"
#include "stage_map.hpp"

namespace lobatto {

template <class K>
struct ConstrainedFixedPoint {
    using real = typename K::real;
    using Coefficients = typename K::Coefficients;
    static constexpr int n = K::coordinates, constraints = K::constraints, m = K::controls - 1, s = m + 1;
    static constexpr int slopes = K::constraint_entries, evaluation_limit = 40;
    using Layout = NodeLayout<real, real, m - 1, node_lanes<real>>;
    using V = typename Layout::V;
    static constexpr int width = Layout::width, parts = Layout::parts_of(m), lanes = parts * width;

    struct Arrays {
        V Q[parts * n], f[parts * n], phi[parts * constraints], phi_t[parts * constraints], G[parts * slopes],
            W[parts * n], pull[parts * constraints];
        real flat[n * lanes], off[constraints * lanes], measure[n], inverse_scale[n], start_W[n];
        real start_f[n], start_phi[constraints], start_phi_t[constraints], start_G[slopes];
        real B[constraints * constraints], terms[constraints];
        std::int32_t pivots[constraints];
    };

    real h{}, tolerance{};       // of increments, relative; 0: to rounding
    real inverse_mass[n * n]{};  // diagonal, or whole
    V move[m][parts]{};          // h^2 A, a column for each node but the last
    V drift[parts]{}, node_time[parts]{};
    V weight[parts]{};               // h b
    real back[m * m]{};              // (h^2 A)^-1
    real lambda[constraints * s]{};  // multipliers of the last step
    real w[n * s]{};                 // and W at its nodes
    real Y[n * m]{};                 // displacements at its nodes after the first
    real evaluations{}, increment{};
    bool has_history{}, usable{};
    Workspace<Arrays> workspace;

    void prepare(const Coefficients& k, real step) {
        h = step;
        has_history = false;
        real stiffness[m * m], map[m * s], zero[n] = {}, p[n], M[K::mass_entries];
        for (int j = 0; j < m; ++j) {
            for (int i = 1; i <= m; ++i) {
                real sum = real(0);
                for (int l = 0; l < s; ++l) sum += K::b[l] * K::D[l * s + j] * K::D[l * s + i];
                stiffness[j * m + i - 1] = -sum;
            }
            for (int i = 0; i <= m; ++i) map[j * s + i] = real(0);
            map[j * s + j] = h * (h * K::b[j]);
            map[j * s + m] = j == 0 ? h : real(0);
        }
        usable = solve<m, s>(stiffness, map);  // h^2 A, and h c
        real unit[m * m];
        for (int i = 0; i < m; ++i)
            for (int j = 0; j < m; ++j) {
                stiffness[i * m + j] = map[i * s + j];
                unit[i * m + j] = i == j ? real(1) : real(0);
            }
        usable = usable && solve<m, m>(stiffness, unit);
        for (int i = 0; i < m * m; ++i) back[i] = unit[i];
        for (int i = 0; i < lanes; ++i) {
            const int row = i < m ? i : m - 1;
            for (int j = 0; j < m; ++j) set_lane(move[j][i / width], i % width, map[row * s + j]);
            set_lane(drift[i / width], i % width, map[row * s + m]);
            set_lane(node_time[i / width], i % width, h * K::c[row + 1]);
            set_lane(weight[i / width], i % width, i < m ? h * K::b[i + 1] : real(0));
        }
        Formulas<K>::legendre(k, real(0), zero, zero, p, M);
        real mass[n * n];
        for (int i = 0; i < n * n; ++i) {
            mass[i] = real(0);
            inverse_mass[i] = i % (n + 1) == 0 ? real(1) : real(0);
        }
        for (int e = 0; e < K::mass_entries; ++e) mass[K::mass_row[e] * n + K::mass_column[e]] = M[e];
        usable = solve<n, n>(mass, inverse_mass) && usable;
    }

    real displacement(int c, int j) const { return Y[c * m + j]; }

    // One step, h from `time`; false: it was not solved, and nothing has changed.
    bool step(const Coefficients& k, real time, real* q, real* p) {
        return usable && workspace.with([&](Arrays& a) { return solve_step(k, time, q, p, a); });
    }

private:
    // x = M^-1 y.
    template <class T>
    LOBATTO_INLINE void divide_by_mass(const T* y, T* x) const {
        for (int c = 0; c < n; ++c) {
            x[c] = T(inverse_mass[c * n + c]) * y[c];
            if constexpr (!has_diagonal_mass<K>())
                for (int l = 0; l < n; ++l)
                    if (l != c) x[c] = fused(T(inverse_mass[c * n + l]), y[l], x[c]);
        }
    }
    // y + G^T lambda.
    template <class T>
    LOBATTO_INLINE static void add_pull(const T* G, const T* lambda, T* y) {
#pragma GCC unroll 16
        for (int e = 0; e < slopes; ++e)
            y[K::constraint_column[e]] = fused(G[e], lambda[K::constraint_row[e]], y[K::constraint_column[e]]);
    }
    // B = G M^-1 G^T, factored.
    bool factor(const real* G, real* B, std::int32_t* pivots) const {
        for (int c = 0; c < constraints; ++c) {
            real row[n] = {}, divided[n];
            for (int e = 0; e < slopes; ++e)
                if (K::constraint_row[e] == c) row[K::constraint_column[e]] += G[e];
            divide_by_mass(row, divided);
            for (int d = 0; d < constraints; ++d) B[d * constraints + c] = real(0);
            for (int e = 0; e < slopes; ++e)
                B[K::constraint_row[e] * constraints + c] += G[e] * divided[K::constraint_column[e]];
        }
        return factor_dense(B, pivots, std::integral_constant<int, constraints>{});
    }

    void evaluate(const Coefficients& k, real time, Arrays& a) const {
        V rest[n], Lv[n];
        for (int c = 0; c < n; ++c) rest[c] = V(real(0));
        for (int part = 0; part < parts; ++part) {
            const V* const Q = a.Q + part * n;
            const V at = V(time) + node_time[part];
            Formulas<K>::slopes(k, at, Q, rest, Lv, a.f + part * n);
            Formulas<K>::constraint(k, at, Q, a.phi + part * constraints, a.phi_t + part * constraints,
                                    a.G + part * slopes);
        }
    }

    // Multipliers of the nodes after the first, in lanes; the last node has none.
    void spread(const real* multipliers, Arrays& a) const {
        for (int c = 0; c < constraints; ++c)
            for (int i = 0; i < lanes; ++i)
                set_lane(a.pull[(i / width) * constraints + c], i % width,
                         i + 1 < m ? multipliers[c * s + i + 1] : real(0));
    }

    // W at all nodes but the last, then the positions; the largest increment, relative.
    real iterate(const real* q, const real* v, const real* multipliers, Arrays& a) const {
        real pull[constraints], y[n];
        for (int c = 0; c < constraints; ++c) pull[c] = multipliers[c * s];
        for (int c = 0; c < n; ++c) y[c] = a.start_f[c];
        add_pull(a.start_G, pull, y);
        divide_by_mass(y, a.start_W);
        spread(multipliers, a);
        for (int part = 0; part < parts; ++part) {
            V force[n];
            for (int c = 0; c < n; ++c) force[c] = a.f[part * n + c];
            add_pull(a.G + part * slopes, a.pull + part * constraints, force);
            divide_by_mass(force, a.W + part * n);
        }
        V worst = V(real(0));
        for (int c = 0; c < n; ++c) {
            real* const flat = a.flat + c * lanes;
            lay_flat<parts>(a.W + c, n, flat);
            for (int part = 0; part < parts; ++part) {
                V next = fused(drift[part], V(v[c]), V(q[c]));
                next = fused(move[0][part], V(a.start_W[c]), next);
#pragma GCC unroll 16
                for (int j = 1; j < m; ++j) next = fused(move[j][part], V(flat[j - 1]), next);
                V& now = a.Q[part * n + c];
                worst = maximum(worst, fabs(next - now) * V(a.inverse_scale[c]));
                now = next;
            }
        }
        return largest(worst);
    }

    // Lambda <- Lambda - (h^2 A)^-1 phi B^-1.
    void correct(real* multipliers, Arrays& a) const {
        for (int c = 0; c < constraints; ++c) lay_flat<parts>(a.phi + c, constraints, a.off + c * lanes);
        for (int j = 0; j < m; ++j) {
            real x[constraints];
            for (int c = 0; c < constraints; ++c) {
                x[c] = real(0);
                for (int i = 0; i < m; ++i) x[c] += back[j * m + i] * a.off[c * lanes + i];
            }
            solve_dense(a.B, a.pivots, x, std::integral_constant<int, constraints>{});
            for (int c = 0; c < constraints; ++c) multipliers[c * s + j] -= x[c];
        }
    }

    bool solve_step(const Coefficients& k, real time, real* q, real* p, Arrays& a) {
        real v[n], multipliers[constraints * s];
        divide_by_mass(p, v);
        begin_step(k, time, q, v, multipliers, a);
        set_measures(k, time, q, v, a);
        const real small = maximum(tolerance, Limits<real>::epsilon);
        const Convergence<real, 1, Pace<4, 70, 16>> rule{small};
        real e_before = Limits<real>::largest;
        evaluations = real(0);
        for (int evaluation = 1; evaluation <= evaluation_limit; ++evaluation) {
            evaluate(k, time, a);
            evaluations += real(1);
            if (evaluation == 1 && !factor_middle(a)) return false;
            correct(multipliers, a);
            const real e = iterate(q, v, multipliers, a);
            if (!is_finite(e) || (evaluation > rule.judged_after && !rule.contracts(e, e_before))) return false;
            if (evaluation > 1 && rule.is_done(e, e_before)) {
                increment = e;
                return finish(k, time, q, p, multipliers, a);
            }
            e_before = e;
        }
        return false;
    }

    bool factor_middle(Arrays& a) const {
        constexpr int middle = (m - 1) / 2;
        real G[slopes];
        for (int e = 0; e < slopes; ++e) G[e] = a.G[(middle / width) * slopes + e][middle % width];
        return factor(G, a.B, a.pivots);
    }

    // Formulas at the start; W and the multipliers continued from the last step, and positions with them.
    void begin_step(const Coefficients& k, real time, const real* q, const real* v, real* multipliers,
                    Arrays& a) const {
        real rest[n] = {}, Lv[n];
        Formulas<K>::slopes(k, time, q, rest, Lv, a.start_f);
        Formulas<K>::constraint(k, time, q, a.start_phi, a.start_phi_t, a.start_G);
        const auto continued = [](const real* last, int j) {
            real sum = real(0);
            for (int i = 0; i < s; ++i) sum += K::extrapolation[j * s + i] * last[i];
            return sum;
        };
        const bool continues = has_history && may_extrapolate<K>();
        for (int c = 0; c < constraints; ++c)
            for (int j = 0; j < s; ++j) multipliers[c * s + j] = continues ? continued(lambda + c * s, j) : real(0);
        for (int c = 0; c < n; ++c) {
            real W[m];
            for (int j = 0; j < m; ++j) W[j] = continues ? continued(w + c * s, j) : real(0);
            for (int part = 0; part < parts; ++part) {
                V next = fused(drift[part], V(v[c]), V(q[c]));
                for (int j = 0; j < m; ++j) next = fused(move[j][part], V(W[j]), next);
                a.Q[part * n + c] = next;
            }
        }
    }

    // What increments of each coordinate are measured by: its position, its way in the step, and how far the equations
    // it stands in move it when the coordinates beside it move by as much as they are measured by, or phi by as much as
    // its terms. `measure`: without these.
    void set_measures(const Coefficients& k, real time, const real* q, const real* v, Arrays& a) const {
        real own[n], joined[n] = {}, raised[n] = {}, size[constraints] = {}, square[constraints] = {};
        const auto inverse = [&](int c) { return fabs(inverse_mass[c * n + c]); };
        for (int c = 0; c < n; ++c)
            own[c] = maximum(fabs(h * v[c]) + h * (h * inverse(c)) * fabs(a.start_f[c]), fabs(q[c]));
        for (int e = 0; e < slopes; ++e) {
            const int c = K::constraint_column[e];
            size[K::constraint_row[e]] += fabs(a.start_G[e]) * own[c];
            square[K::constraint_row[e]] += inverse(c) * (a.start_G[e] * a.start_G[e]);
        }
        for (int c = 0; c < constraints; ++c) a.terms[c] = size[c];
        raise_to_summands<K>(k, time, q, a.terms);
        for (int e = 0; e < slopes; ++e) {
            const int c = K::constraint_column[e], row = K::constraint_row[e];
            const real pull = inverse(c) * fabs(a.start_G[e]), of_row = maximum(square[row], Limits<real>::smallest);
            joined[c] += pull * (size[row] / of_row);
            raised[c] += pull * (a.terms[row] / of_row);
        }
        for (int c = 0; c < n; ++c) {
            a.measure[c] = maximum(own[c] + joined[c], Limits<real>::smallest);
            a.inverse_scale[c] = real(1) / maximum(own[c] + raised[c], Limits<real>::smallest);
        }
    }

    // Whether the positions found keep the constraints, to half of the digits of what they are measured by, or to the
    // rounding of their terms. Where constraints depend on one another, multipliers grow until corrections are lost in
    // their rounding: nothing moves any more, and nothing is solved.
    bool keeps_constraints(const Arrays& a) const {
        const real few = real(128) * Limits<real>::epsilon / Limits<real>::root_epsilon;
        for (int part = 0; part < parts; ++part) {
            V size[constraints];
            for (int c = 0; c < constraints; ++c)
                size[c] = V(fabs(h)) * fabs(a.phi_t[part * constraints + c]) + V(few * a.terms[c]);
            for (int e = 0; e < slopes; ++e)
                size[K::constraint_row[e]] = fused(fabs(a.G[part * slopes + e]), V(a.measure[K::constraint_column[e]]),
                                                   size[K::constraint_row[e]]);
            V worst = V(real(0));
            for (int c = 0; c < constraints; ++c)
                worst = maximum(worst, fabs(a.phi[part * constraints + c]) - V(Limits<real>::root_epsilon) * size[c]);
            if (!(largest(worst) <= real(0))) return false;
        }
        return true;
    }

    // Formulas at the nodes once more; then the momentum, and the multiplier that keeps the velocity at the end (D46).
    bool finish(const Coefficients& k, real time, real* q, real* p, real* multipliers, Arrays& a) {
        evaluate(k, time, a);
        if (!keeps_constraints(a)) return false;
        real q1[n], p1[n], G1[slopes], mu[constraints], not_finite = real(0);
        real pull[constraints];
        for (int c = 0; c < constraints; ++c) pull[c] = multipliers[c * s];
        real y[n];
        for (int c = 0; c < n; ++c) y[c] = a.start_f[c];
        add_pull(a.start_G, pull, y);
        spread(multipliers, a);
        for (int part = 0; part < parts; ++part)
            add_pull(a.G + part * slopes, a.pull + part * constraints, a.f + part * n);
        constexpr int last = m - 1;
        for (int c = 0; c < n; ++c) {
            V total = weight[0] * a.f[c];
            for (int part = 1; part < parts; ++part) total = fused(weight[part], a.f[part * n + c], total);
            q1[c] = a.Q[(last / width) * n + c][last % width];
            p1[c] = p[c] + (h * K::b[0] * y[c] + sum(total));
            not_finite += (q1[c] - q1[c]) + (p1[c] - p1[c]);
        }
        for (int e = 0; e < slopes; ++e) G1[e] = a.G[(last / width) * slopes + e][last % width];
        if (not_finite != real(0) || !factor(G1, a.B, a.pivots)) return false;
        for (int c = 0; c < constraints; ++c) multipliers[c * s + m] = real(0);
        for (int look = 0; look < 2; ++look) {  // the second takes the rounding of the first away
            real v1[n];
            divide_by_mass(p1, v1);
            for (int c = 0; c < constraints; ++c) mu[c] = a.phi_t[(last / width) * constraints + c][last % width];
            for (int e = 0; e < slopes; ++e) mu[K::constraint_row[e]] += G1[e] * v1[K::constraint_column[e]];
            solve_dense(a.B, a.pivots, mu, std::integral_constant<int, constraints>{});
            for (int c = 0; c < constraints; ++c) {
                multipliers[c * s + m] -= mu[c] / (h * K::b[m]);
                mu[c] = -mu[c];
            }
            add_pull(G1, mu, p1);
        }
        remember(q, p, q1, p1, G1, multipliers, y, a);
        return true;
    }

    void remember(real* q, real* p, const real* q1, const real* p1, const real* G1, const real* multipliers,
                  const real* start_force, Arrays& a) {
        constexpr int last = m - 1;
        real force[n], pull[constraints];
        for (int c = 0; c < constraints; ++c) pull[c] = multipliers[c * s + m];
        for (int part = 0; part < parts; ++part) divide_by_mass(a.f + part * n, a.W + part * n);
        real W0[n], W1[n];
        divide_by_mass(start_force, W0);
        for (int c = 0; c < n; ++c) force[c] = a.f[(last / width) * n + c][last % width];
        add_pull(G1, pull, force);
        divide_by_mass(force, W1);
        for (int c = 0; c < n; ++c) {
            w[c * s] = W0[c];
            w[c * s + m] = W1[c];
            for (int j = 0; j < m; ++j) {
                Y[c * m + j] = a.Q[(j / width) * n + c][j % width] - q[c];
                if (j + 1 < m) w[c * s + j + 1] = a.W[(j / width) * n + c][j % width];
            }
        }
        for (int i = 0; i < constraints * s; ++i) lambda[i] = multipliers[i];
        for (int c = 0; c < n; ++c) {
            q[c] = q1[c];
            p[c] = p1[c];
        }
        has_history = true;
    }
};

}  // namespace lobatto

#endif
