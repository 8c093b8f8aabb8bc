// SPDX-License-Identifier: MIT
// Newton's iteration for the Galerkin equations (D30, D34), where the fixed-point iteration does not contract.
#ifndef LOBATTO_KERNEL_GALERKIN_NEWTON_HPP
#define LOBATTO_KERNEL_GALERKIN_NEWTON_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/pack.hpp"
#include "constraint_rounding.hpp"
#include "convergence.hpp"
#include "galerkin_equations.hpp"

namespace lobatto {

template <class K>
struct GalerkinNewton : GalerkinEquations<K> {
    using Equations = GalerkinEquations<K>;
    using Equations::n, Equations::active, Equations::blocks, Equations::cyclic, Equations::Z, Equations::r,
        Equations::m, Equations::kappas, Equations::N, Equations::room, Equations::entry_room, Equations::coefficients,
        Equations::step_size, Equations::q, Equations::p, Equations::iterations, Equations::increment,
        Equations::workspace;
    using typename Equations::real, typename Equations::Arrays, typename Equations::Matrix, typename Equations::Layout,
        typename Equations::Tables;
    using Rule = NewtonConvergence<real>;

protected:
    using Equations::apply_node_map, Equations::node_variables, Equations::evaluate_nodes, Equations::sum_over_nodes,
        Equations::assemble, Equations::carry;

    struct Frozen {
        Matrix matrix;
        real H[entry_room];
    };
    std::conditional_t<K::linear, Frozen, Nothing> frozen{};

    // The constant second derivatives and the Jacobian with them.
    template <class FrozenPart>
    Status freeze(FrozenPart& part) {
        return workspace.with([&](Arrays& a) {
            for (int k = 0; k < Z; ++k) a.z[k] = real(0);
            Formulas<K>::node(coefficients, real(0), a.z, a.g, part.H);
            part.matrix.clear();
            assemble(part.H, 0, part.matrix);
            return part.matrix.factor() ? Status::ok : Status::singular_jacobian;
        });
    }

    Status solve_stages(Arrays& a) {
        iterations = 0;
        increment = real(0);
        if constexpr (N == 0) {
            for (int i = 0; i < r; ++i) {
                node_variables(q, p, a.Y, i, a.z + i * Z);
                Formulas<K>::slope(coefficients, this->time() + K::c[i] * step_size, a.z + i * Z, a.g + i * Z);
            }
            return Status::ok;
        } else if constexpr (K::linear) {
            return correct_once(frozen, a);
        } else {
            return newton(a);
        }
    }

private:
    // One increment with the factored matrix; its size relative to the displacement within the step, with the rounding
    // of the position as floor, or not a number.
    real apply_increment(const Matrix& matrix, Arrays& a) {
        sum_over_nodes(a.g, a.delta);
        for (int b = 0; b < active; ++b) a.delta[Layout::index(b, 0)] += p[K::active_index[b]];
        for (int i = 0; i < N; ++i) a.delta[i] = -a.delta[i];
        ++iterations;
        matrix.solve(a.delta);
        constexpr real floor = Limits<real>::epsilon / Limits<real>::root_epsilon;
        real e = real(0);
        for (int b = 0; b < active; ++b) {
            real change = real(0), size = floor * fabs(q[K::active_index[b]]);
            for (int j = 0; j < m; ++j) {
                const int i = Layout::index(b, j);
                a.Y[i] += a.delta[i];
                change = maximum(fabs(a.delta[i]), change);
                size = maximum(fabs(a.Y[i]), size);
            }
            size = maximum(change, size);  // it came back to 0, where a constraint holds it
            if (change > e * size) e = change / size;
        }
        for (int c = active; c < blocks; ++c)
            for (int j = 0; j < m; ++j) a.Y[Layout::index(c, j)] += a.delta[Layout::index(c, j)];
        for (int c = 0; c < kappas; ++c) {
            real& kappa = a.Y[active * m + c];
            const real change = fabs(a.delta[active * m + c]);
            kappa += a.delta[active * m + c];
            const real size = a.kappa_scale[c] + fabs(kappa);
            if (change > e * size) e = change / size;
        }
        const real part = not_finite_part(a.Y, N);
        return is_finite(part) ? e : part;
    }
    // The slopes at the corrected unknowns, to first order.
    void carry_increment(const real* H, int stride, Arrays& a) const {
        real dz[Z > 0 ? Z : 1];
        for (int i = 0; i < r; ++i) {
            apply_node_map(a.delta, i, dz);
            carry(H + i * stride, dz, a.g + i * Z);
        }
    }

    // The size of a conserved momentum, for its kappa: P itself, or what its velocity makes of it.
    void scale_kappas(Arrays& a) const {
        for (int c = 0; c < kappas; ++c) {
            const int entry = Tables::diagonal_entry(2 * active + c);
            a.kappa_scale[c] = fabs(p[K::cyclic_index[c]]);
            if (entry >= 0 && fabs(a.H[entry]) > Limits<real>::smallest)
                a.kappa_scale[c] += fabs(a.g[2 * active + c] / a.H[entry]);
        }
    }

    static constexpr int most_halvings = 20;
    static bool has_values(const Arrays& a) { return is_finite(not_finite_part(a.g, r * Z)); }

    // Newton's iteration. At its end the slopes are carried to first order, which errs by the same e^2 as the unknowns.
    Status newton(Arrays& a) {
        real previous = Limits<real>::largest;
        for (int iteration = 1; iteration <= Rule::iteration_limit; ++iteration) {
            evaluate_nodes(this->time(), q, p, a.Y, a);
            // Formulas may have no value there, as beyond the speed of light: half of the increment, and half of that.
            for (int halving = 0; iteration > 1 && halving < most_halvings && !has_values(a); ++halving) {
                previous *= real(0.5);
                for (int i = 0; i < N; ++i) {
                    a.delta[i] *= real(0.5);
                    a.Y[i] -= a.delta[i];
                }
                evaluate_nodes(this->time(), q, p, a.Y, a);
            }
            if (iteration == 1) scale_kappas(a);
            if (!has_values(a)) return Status::not_finite;
            a.matrix.clear();
            assemble(a.H, entry_room, a.matrix);
            if (!a.matrix.factor())
                return is_finite(not_finite_part(a.H, r * entry_room)) ? Status::singular_jacobian : Status::not_finite;
            const real e = apply_increment(a.matrix, a);
            increment = e;
            if (!is_finite(e)) return Status::not_finite;
            if (Rule::reached(iteration, e, previous) || (Rule::stagnates(iteration, e, previous) && is_rounding(a))) {
                carry_increment(a.H, entry_room, a);
                return Status::ok;
            }
            previous = e;
        }
        return Status::not_converged;
    }

    // Whether increments that no longer shrink are the rounding of what the residual is computed from.
    bool is_rounding(Arrays& a) const {
        real rounding[room];
        for (int i = 0; i < N; ++i) rounding[i] = real(0);
        for (int i = 0; i < r; ++i)
            for (int b = 0; b < active; ++b)
                for (int j = 0; j < m; ++j)
                    rounding[Layout::index(b, j)] +=
                        fabs(K::b[i] * K::D[i * (m + 1) + j] * a.g[i * Z + b]) +
                        fabs(step_size * K::b[i] * K::B[i * (m + 1) + j] * a.g[i * Z + active + b]);
        for (int i = 0; i < r; ++i)
            for (int c = 0; c < kappas; ++c)
                rounding[active * m + c] +=
                    fabs(step_size * K::b[i] * K::legendre_polynomial[i] * a.g[i * Z + 2 * active + c]);
        for (int b = 0; b < active; ++b) rounding[Layout::index(b, 0)] += fabs(p[K::active_index[b]]);
        if constexpr (Tables::constraints > 0) {  // phi, and at positions that are rounded
            for (int e = 0; e < K::entries; ++e)
                if (Tables::kind(K::entry_row[e]) == Slot::multiplier)
                    for (int j = 0; j < m; ++j)
                        rounding[Layout::index(Tables::block(K::entry_row[e]), j)] +=
                            fabs(a.H[(j + 1) * entry_room + e] * a.z[(j + 1) * Z + K::entry_column[e]]);
            for (int j = 0; j < m; ++j) {
                real size[Tables::constraints];
                for (int c = 0; c < Tables::constraints; ++c) size[c] = rounding[Layout::index(active + c, j)];
                raise_to_summands<K>(coefficients, this->time() + K::control[j + 1] * step_size,
                                     a.z + (j + 1) * Z + active, size);
                for (int c = 0; c < Tables::constraints; ++c) rounding[Layout::index(active + c, j)] = size[c];
            }
        }
        for (int i = 0; i < N; ++i) rounding[i] *= a.delta[i] < real(0) ? real(-1) : real(1);
        a.matrix.solve(rounding);
        real most = real(0), largest = real(0);
        for (int i = 0; i < N; ++i) {
            most = maximum(fabs(rounding[i]), most);
            largest = maximum(fabs(a.delta[i]), largest);
        }
        return largest <= real(Rule::noise) * Limits<real>::epsilon * most;
    }

    // A linear system: the frozen Jacobian is the Jacobian.
    template <class FrozenPart>
    Status correct_once(const FrozenPart& part, Arrays& a) {
        for (int i = 0; i < r; ++i) {
            node_variables(q, p, a.Y, i, a.z + i * Z);
            Formulas<K>::slope(coefficients, this->time() + K::c[i] * step_size, a.z + i * Z, a.g + i * Z);
        }
        for (int c = 0; c < kappas; ++c) a.kappa_scale[c] = real(1);
        if (!is_finite(apply_increment(part.matrix, a))) return Status::not_finite;
        carry_increment(part.H, 0, a);
        return Status::ok;
    }
};

}  // namespace lobatto

#endif
