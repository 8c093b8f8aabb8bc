// SPDX-License-Identifier: MIT
// Steps of any Lagrangian system: fixed-point iteration (iteration/galerkin.hpp) first, Newton's iteration
// (iteration/galerkin_newton.hpp) where it does not contract. The equations stand in iteration/galerkin_equations.hpp.
#ifndef LOBATTO_KERNEL_GENERAL_HPP
#define LOBATTO_KERNEL_GENERAL_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/solve.hpp"
#include "../iteration/galerkin.hpp"
#include "../iteration/galerkin_newton.hpp"

namespace lobatto {

template <class K>
struct Stepper<K, Form::general, Stepping::solved> : GalerkinNewton<K> {
    using Newton = GalerkinNewton<K>;
    using Newton::n, Newton::active, Newton::cyclic, Newton::Z, Newton::r, Newton::m, Newton::kappas, Newton::N,
        Newton::room, Newton::entry_room, Newton::cyclic_room, Newton::coefficients, Newton::step_size, Newton::q,
        Newton::p, Newton::iterations, Newton::increment, Newton::workspace;
    using typename Newton::real, typename Newton::Arrays, typename Newton::Layout, typename Newton::Nothing;
    static constexpr int nodes = K::nodes, mass_room = K::mass_entries > 0 ? K::mass_entries : 1;

    using MassLayout = std::conditional_t<cyclic == 0, Grouped<K, n, 1, 0>, Whole<n>>;
    struct MassArrays {
        real p[n], entries[mass_room], residual[n], increment[n], next[n], trial[n];
        GroupedMatrix<real, MassLayout> matrix;
    };

    // Fixed-point iterations need the mass matrix of a node alone, which is full for them.
    static constexpr bool has_fixed_point = K::any_number && !K::linear && N > 0 && n <= most_full;
    struct FixedPointState {
        GalerkinFixedPoint<K, real> iteration;
        Pause pause;
    };

    real q_before[n]{};         // before the last step
    real elapsed{};             // of kernels with a clock: the physical time of the last step
    bool has_history{};         // there is a last step
    mutable bool is_current{};  // what follows is of the last step; else the iterations' memory is
    mutable real Y[room]{};     // displacements at the control points, then kappa, in the order of the solver
    mutable real cyclic_rates[r * cyclic_room]{};  // -g_P at the nodes
    std::conditional_t<has_fixed_point, FixedPointState, Nothing> fixed_point{};
    std::conditional_t<(cyclic > 0), real[m * m], Nothing> integration{};  // inverse of D at the first m nodes
    Workspace<MassArrays> mass_workspace;

    Status prepare(const typename K::Parameters& parameters, real h) {
        step_size = h;
        has_history = false;
        const Status status = K::prepare(parameters, h, coefficients);
        if (status != Status::ok) return status;
        if constexpr (cyclic > 0) {
            real D[m * m];
            for (int i = 0; i < m; ++i)
                for (int j = 0; j < m; ++j) {
                    D[i * m + j] = K::D[i * (m + 1) + j + 1];
                    integration[i * m + j] = i == j ? real(1) : real(0);
                }
            lobatto::solve<m, m>(D, integration);
        }
        if constexpr (has_fixed_point) fixed_point.iteration.prepare(h);
        if constexpr (K::linear) return freeze(frozen);
        return Status::ok;
    }

    Status start(real time, const real* position, const real* momentum) {
        this->start_time = time;
        this->steps = 0;
        has_history = false;
        for (int k = 0; k < n; ++k) {
            q[k] = position[k];
            p[k] = momentum[k];
        }
        if (!is_finite(time + not_finite_part(q, n) + not_finite_part(p, n))) return Status::not_finite;
        real v[n];
        const Status status = velocity(time, q, p, v);
        is_current = true;
        if constexpr (has_fixed_point) begin_fixed_point(fixed_point, v);
        if constexpr (K::events > 0) {
            if (status == Status::ok) Formulas<K>::event(coefficients, time, q, v, this->event_values);
        }
        return status;
    }

    void momentum(real* momentum) const {
        for (int k = 0; k < n; ++k) momentum[k] = p[k];
    }

    Status step() {
        if (this->time_stands_still()) return Status::time_stands_still;
        if constexpr (has_fixed_point) {
            if (iterate(fixed_point)) return Status::ok;
        }
        return workspace.with([this](Arrays& arrays) { return step_in(arrays); });
    }

    // The polynomial of the last step through its control points, at t + theta h.
    void polynomial(real theta, real* position, real* velocity) const {
        real value[m + 1], slope[m + 1];
        lagrange<m + 1>(K::control, theta, value, slope);
        refresh();
        for (int a = 0; a < active; ++a) {
            const int k = K::active_index[a];
            real moved = real(0), rate = real(0);
            for (int j = 0; j < m; ++j) {
                moved += value[j + 1] * Y[Layout::index(a, j)];
                rate += slope[j + 1] * Y[Layout::index(a, j)];
            }
            position[k] = q_before[k] + moved;
            velocity[k] = rate / step_size;
        }
        if constexpr (cyclic > 0) {
            for (int c = 0; c < cyclic; ++c) {  // D Y = h v_c at the first m nodes
                const int k = K::cyclic_index[c];
                real moved = real(0), rate = real(0);
                for (int j = 0; j < m; ++j) {
                    real y = real(0);
                    for (int i = 0; i < m; ++i) y += integration[j * m + i] * cyclic_rates[i * cyclic + c];
                    moved += value[j + 1] * y;
                    rate += slope[j + 1] * y;
                }
                position[k] = q_before[k] + step_size * moved;
                velocity[k] = rate;
            }
        }
    }

    void momentum(real time, const real* position, const real* velocity, real* momentum) const {
        Formulas<K>::momentum(coefficients, time, position, velocity, momentum);
    }
    Status energy(real time, const real* position, const real* momentum, real* value) const {
        if constexpr (K::has_energy) {
            real v[n];
            const Status status = velocity(time, position, momentum, v);
            if (status == Status::ok) *value = Formulas<K>::energy(coefficients, time, position, v);
            return status;
        } else {
            (void)time, (void)position, (void)momentum, (void)value;
            return Status::unsupported;
        }
    }
    void slopes(real time, const real* position, const real* velocity, real* Lv, real* Lq) const {
        Formulas<K>::slopes(coefficients, time, position, velocity, Lv, Lq);
    }

    // The velocity of a momentum: Newton's iteration on p = dL/dv from rest, or, where rest is impossible, as in a
    // frame that rotates faster than light, from the velocity at the end of the last step. Its increments are halved
    // while the next one would be longer or is not finite, as with Lagrangians like -sqrt(1 - v^2); lengths: sum
    // |increment residual|.
    Status velocity(real time, const real* position, const real* momentum, real* v) const {
        return mass_workspace.with([&](MassArrays& a) {
            const auto evaluate = [&](const real* trial) {
                Formulas<K>::legendre(coefficients, time, position, trial, a.p, a.entries);
                for (int k = 0; k < n; ++k) a.residual[k] = momentum[k] - a.p[k];
                return is_finite(not_finite_part(a.residual, n) + not_finite_part(a.entries, K::mass_entries));
            };
            const auto solve_from = [&]() -> Status {
                if (!evaluate(v)) return Status::not_finite;
                for (int iteration = 0; iteration < 100; ++iteration) {
                    if (iteration > 0 && is_near(a, momentum, v, real(2) * Limits<real>::epsilon)) return Status::ok;
                    a.matrix.clear();
                    for (int e = 0; e < K::mass_entries; ++e)
                        a.matrix(K::mass_row[e], 0, K::mass_column[e], 0) += a.entries[e];
                    if (!a.matrix.factor()) return Status::singular_mass;
                    const real length = solve_mass(a, a.increment);
                    const bool next_is_rounding = iteration > 0 && is_near(a, momentum, v, Limits<real>::root_epsilon);
                    for (real part = real(1);; part *= real(0.5)) {
                        if (part < Limits<real>::epsilon) return Status::not_converged;
                        for (int k = 0; k < n; ++k) a.trial[k] = v[k] + part * a.increment[k];
                        if (next_is_rounding || (evaluate(a.trial) && solve_mass(a, a.next) <= length)) break;
                    }
                    for (int k = 0; k < n; ++k) v[k] = a.trial[k];
                    if (next_is_rounding) return Status::ok;
                }
                return Status::not_converged;
            };
            for (int k = 0; k < n; ++k) v[k] = real(0);
            Status status = solve_from();
            if (status != Status::ok && has_history) {
                polynomial(real(1), a.trial, v);
                status = solve_from();
            }
            if (status == Status::ok) return status;
            // At rest there is no inverse, as of v^4: from the multiple of the momentum whose own momentum is nearest.
            const Status at_rest = status;
            real best = real(0), nearest = -real(1);
            for (real scale = real(0x1p-40); scale <= real(0x1p40); scale *= real(2)) {
                for (int k = 0; k < n; ++k) v[k] = scale * momentum[k];
                if (!evaluate(v)) continue;
                real apart = real(0);
                for (int k = 0; k < n; ++k) apart += a.residual[k] * a.residual[k];
                if (nearest < real(0) || apart < nearest) best = scale, nearest = apart;
            }
            for (int k = 0; k < n; ++k) v[k] = best * momentum[k];
            status = solve_from();
            return status == Status::ok ? status : at_rest;
        });
    }

    // One step from (q, p) at `time` and d(q1, p1)/d(q, p), 2n x 2n: J dY = -dR for each column.
    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        if constexpr (K::has_tangent) {
            Stepper local = *this;
            const Status status = this->step_from(local, time, position, momentum, q1, p1);
            if (status != Status::ok) return status;
            local.refresh();
            return workspace.with([&](Arrays& a) {
                evaluate_nodes(time, position, momentum, local.Y, a);
                a.matrix.clear();
                assemble(a.H, entry_room, a.matrix);
                if (!a.matrix.factor()) return Status::singular_jacobian;
                for (int i = 0; i < 4 * n * n; ++i) T[i] = real(0);
                for (int k = 0; k < 2 * n; ++k) T[k * 2 * n + k] = real(1);
                for (int b = 0; b < active; ++b) {
                    tangent_column(a, active + b, -1, K::active_index[b], T);
                    tangent_column(a, -1, b, n + K::active_index[b], T);
                }
                for (int c = 0; c < cyclic; ++c) tangent_column(a, 2 * active + c, -1, n + K::cyclic_index[c], T);
                return Status::ok;
            });
        } else {
            (void)time, (void)position, (void)momentum, (void)q1, (void)p1, (void)T;
            return Status::unsupported;
        }
    }

    // Velocity of coordinate c at node i of the last step.
    real node_velocity(int c, int i) const {
        refresh();
        for (int j = 0; j < cyclic; ++j)
            if (K::cyclic_index[j] == c) return cyclic_rates[i * cyclic + j];
        real sum = real(0);
        for (int b = 0; b < active; ++b)
            if (K::active_index[b] == c)
                for (int j = 0; j < m; ++j) sum += K::D[i * (m + 1) + j + 1] * Y[Layout::index(b, j)];
        return sum / step_size;
    }

private:
    using Newton::evaluate_nodes, Newton::assemble, Newton::impulse, Newton::tangent_column, Newton::freeze,
        Newton::solve_stages, Newton::frozen;

    // Y, kappa and the cyclic rates of a step that iterations have taken.
    void refresh() const {
        if constexpr (has_fixed_point) {
            if (is_current || !has_history) return;
            const auto& memory = fixed_point.iteration;
            for (int b = 0; b < active; ++b)
                for (int j = 0; j < m; ++j) Y[Layout::index(b, j)] = memory.displacement(K::active_index[b], j);
            for (int c = 0; c < cyclic; ++c) {
                if (kappas > 0) Y[active * m + c] = memory.kappa[K::cyclic_index[c]];
                for (int i = 0; i < r; ++i) cyclic_rates[i * cyclic + c] = memory.v[K::cyclic_index[c] * r + i];
            }
            is_current = true;
        }
    }

    template <class AnyFixedPoint>
    void begin_fixed_point(AnyFixedPoint& any, const real* v) {
        any.pause = Pause();
        any.iteration.begin(v);
    }

    // A step by iterations; where they fail, all is made ready for Newton's iteration.
    template <class AnyFixedPoint>
    bool iterate(AnyFixedPoint& any) {
        const bool paused = any.pause.left > 0;
        if (!any.pause.count_down()) return false;
        if (paused) any.iteration.recall([this](int c, int i) { return node_velocity(c, i); });
        real q1[n], p1[n];
        for (int k = 0; k < n; ++k) {
            q1[k] = q[k];
            p1[k] = p[k];
        }
        any.iteration.tolerance = this->tolerance;
        if (any.iteration.step(coefficients, this->time(), +q1, +p1, true)) {
            for (int k = 0; k < n; ++k) {
                q_before[k] = q[k];
                q[k] = q1[k];
                p[k] = p1[k];
            }
            iterations = static_cast<std::int32_t>(any.iteration.evaluations);
            increment = any.iteration.increment;
            if constexpr (K::clocked) elapsed = any.iteration.elapsed;
            any.pause.succeed();
            is_current = false;
            has_history = true;
            ++this->steps;
            return true;
        }
        refresh();
        any.pause.fail();
        return false;
    }

    // Whether |p - dL/dv| is within a bound of what it is computed from.
    bool is_near(const MassArrays& a, const real* momentum, const real* v, real bound) const {
        real size[n];
        for (int k = 0; k < n; ++k) size[k] = fabs(momentum[k]);
        for (int e = 0; e < K::mass_entries; ++e) size[K::mass_row[e]] += fabs(a.entries[e] * v[K::mass_column[e]]);
        for (int k = 0; k < n; ++k)
            if (!(fabs(a.residual[k]) <= bound * size[k])) return false;
        return true;
    }

    // x = M^-1 residual; sum |x_k residual_k|.
    static real solve_mass(MassArrays& a, real* x) {
        real sorted[n], length = real(0);
        for (int k = 0; k < n; ++k) sorted[MassLayout::index(k, 0)] = a.residual[k];
        a.matrix.solve(sorted);
        for (int k = 0; k < n; ++k) {
            x[k] = sorted[MassLayout::index(k, 0)];
            length += fabs(x[k] * a.residual[k]);
        }
        return length;
    }

    // sum_i h b_i clock(Q_i) of the stages just solved.
    real time_passed(Arrays& a) const {
        real passed = real(0);
        if constexpr (K::clocked) {
            real Q[n];
            for (int k = 0; k < n; ++k) Q[k] = q[k];
            for (int i = 0; i < r; ++i) {
                this->node_variables(q, p, a.Y, i, a.z);
                for (int b = 0; b < active; ++b) Q[K::active_index[b]] = a.z[active + b];
                passed += K::b[i] * Formulas<K>::clock(coefficients, this->time(), static_cast<const real*>(Q));
            }
        } else {
            (void)a;
        }
        return step_size * passed;
    }

    Status step_in(Arrays& a) {
        Status status = Status::not_converged;
        if (has_history) {
            for (int b = 0; b < active; ++b) {  // the last step's polynomial, beyond its end
                const real* const last = Y + Layout::index(b, 0);
                for (int j = 0; j < m; ++j) {
                    real moved = -last[m - 1];
                    for (int k = 0; k < m; ++k) moved += K::extrapolation[(j + 1) * (m + 1) + k + 1] * last[k];
                    a.Y[Layout::index(b, j)] = moved;
                }
            }
            for (int c = 0; c < kappas; ++c) a.Y[active * m + c] = Y[active * m + c];
            status = solve_stages(a);
        }
        if (status != Status::ok) {  // straight on
            real v[n];
            status = velocity(this->time(), q, p, v);
            if (status != Status::ok) return status;
            for (int b = 0; b < active; ++b)
                for (int j = 0; j < m; ++j)
                    a.Y[Layout::index(b, j)] = step_size * K::control[j + 1] * v[K::active_index[b]];
            for (int c = 0; c < kappas; ++c) a.Y[active * m + c] = real(0);
            status = solve_stages(a);
        }
        if (status != Status::ok) return status;
        for (int b = 0; b < active; ++b) {
            const int k = K::active_index[b];
            a.q1[k] = q[k] + a.Y[Layout::index(b, m - 1)];
            a.p1[k] = p[k] + impulse(a.g, active + b);
        }
        for (int c = 0; c < cyclic; ++c) {
            const int k = K::cyclic_index[c];
            a.q1[k] = q[k] - impulse(a.g, 2 * active + c);
            a.p1[k] = p[k];
        }
        if (!is_finite(not_finite_part(a.q1, n) + not_finite_part(a.p1, n))) return Status::not_finite;
        if constexpr (K::clocked) elapsed = time_passed(a);
        for (int k = 0; k < n; ++k) {
            q_before[k] = q[k];
            q[k] = a.q1[k];
            p[k] = a.p1[k];
        }
        for (int i = 0; i < N; ++i) Y[i] = a.Y[i];
        is_current = true;
        for (int i = 0; i < r; ++i)
            for (int c = 0; c < cyclic; ++c) cyclic_rates[i * cyclic + c] = -a.g[i * Z + 2 * active + c];
        has_history = true;
        ++this->steps;
        return Status::ok;
    }
};

}  // namespace lobatto

#endif
