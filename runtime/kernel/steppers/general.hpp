// SPDX-License-Identifier: MIT
// Steps of any Lagrangian system: fixed-point iteration (iteration/galerkin.hpp) first, Newton's iteration
// (iteration/galerkin_newton.hpp) where it does not contract. The equations stand in iteration/galerkin_equations.hpp.
#ifndef LOBATTO_KERNEL_GENERAL_HPP
#define LOBATTO_KERNEL_GENERAL_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/dense.hpp"
#include "../base/numbers.hpp"
#include "../iteration/constrained_fixed_point.hpp"
#include "../iteration/constraint_checks.hpp"
#include "../iteration/extrapolation.hpp"
#include "../iteration/galerkin.hpp"
#include "../iteration/velocity_of_momentum.hpp"

namespace lobatto {

template <class K>
struct Stepper<K, Form::general, Stepping::solved> : ConstraintChecks<K> {
    using Newton = ConstraintChecks<K>;
    using Newton::multiplier_room;
    using Newton::n, Newton::active, Newton::constraints, Newton::cyclic, Newton::Z, Newton::r, Newton::m,
        Newton::kappas, Newton::N, Newton::room, Newton::entry_room, Newton::cyclic_room, Newton::coefficients,
        Newton::step_size, Newton::q, Newton::p, Newton::iterations, Newton::increment, Newton::workspace;
    using typename Newton::real, typename Newton::Arrays, typename Newton::Layout;
    static constexpr int nodes = K::nodes;

    // Fixed-point iterations need the mass matrix of a node alone, which is full for them unless it is light.
    static constexpr bool iterates_on_constraints = constraints > 0 && K::constant_mass;
    static constexpr bool has_fixed_point = (K::any_number || iterates_on_constraints) && !K::linear && N > 0 &&
                                            (n <= most_full || has_light_mass<K>());
    static constexpr bool iterates_on_velocities = has_fixed_point && !iterates_on_constraints;
    struct FixedPointState {
        std::conditional_t<iterates_on_constraints, ConstrainedFixedPoint<K>, GalerkinFixedPoint<K, real>> iteration;
        Pause pause;
    };

    real q_before[n]{};                // before the last step
    real elapsed{};                    // of kernels with a clock: the physical time of the last step
    real rates[K::clocked ? r : 1]{};  // and dt/dtau at its nodes
    bool has_history{};                // there is a last step
    mutable bool is_current{};         // what follows is of the last step; else the iterations' memory is
    mutable real Y[room]{};            // displacements at the control points, then kappa, in the order of the solver
    mutable real cyclic_rates[r * cyclic_room]{};  // -g_P at the nodes
    std::conditional_t<has_fixed_point, FixedPointState, Nothing> fixed_point{};
    std::conditional_t<(cyclic > 0), real[m * m], Nothing> integration{};  // inverse of D at the first m nodes
    real last_multiplier[multiplier_room]{};                               // at the end of the last step
    VelocityOfMomentum<K> velocity_of_momentum;

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
        if constexpr (has_fixed_point && iterates_on_constraints)
            fixed_point.iteration.prepare(coefficients, h);
        else if constexpr (has_fixed_point)
            fixed_point.iteration.prepare(h);
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
        real v[n], mu[multiplier_room];
        Status status = velocity(time, q, p, v, mu);
        if (status == Status::ok) status = check_constraints(v, mu);
        is_current = true;
        if constexpr (has_fixed_point) begin_fixed_point(fixed_point, v);
        if constexpr (K::events > 0) {
            if (status == Status::ok) Formulas<K>::event(coefficients, time, q, v, this->event_values);
            this->events_go_on = false;
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
        basis_at(theta, value, slope);
        polynomial(value, slope, position, velocity);
    }
    static constexpr int basis = m + 1;  // polynomials
    static void basis_at(real theta, real* value, real* slope) { lagrange<m + 1>(K::control, theta, value, slope); }
    void polynomial(const real* value, const real* slope, real* position, real* velocity) const {
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
            if (status != Status::ok) return status;
            *value = Formulas<K>::energy(coefficients, time, position, v);
            if constexpr (K::mass_needs_velocity) {
                // H errs by dH/dv = M v times the error of v, and by its square with the momentum that is known (D26).
                real Lv[n], Lq[n];
                slopes(time, position, v, Lv, Lq);
                for (int k = 0; k < n; ++k) *value += (momentum[k] - Lv[k]) * v[k];
            }
            return status;
        } else {
            return Status::unsupported;
        }
    }
    void slopes(real time, const real* position, const real* velocity, real* Lv, real* Lq) const {
        Formulas<K>::slopes(coefficients, time, position, velocity, Lv, Lq);
    }

    Status velocity(real time, const real* position, const real* momentum, real* v) const {
        real mu[multiplier_room];
        return velocity(time, position, momentum, v, mu);
    }

    // Of the constraints, at a state.
    Status multipliers(real time, const real* position, const real* momentum, real* lambda) const {
        real v[n];
        const Status status = velocity(time, position, momentum, v);
        return status == Status::ok ? velocity_of_momentum.multipliers(coefficients, time, position, v, lambda)
                                    : status;
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
            return Status::unsupported;
        }
    }

    // Velocity of coordinate c at node i of the last step.
    real node_velocity(int c, int i) const {
        if constexpr (iterates_on_velocities)
            if (!is_current) return fixed_point.iteration.v[c * r + i];
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
        Newton::solve_stages, Newton::frozen, Newton::check_constraints, Newton::keeps_constraints;

    // Y, kappa and the cyclic rates of a step that iterations have taken.
    void refresh() const {
        if constexpr (has_fixed_point) {
            if (is_current || !has_history) return;
            const auto& memory = fixed_point.iteration;
            for (int b = 0; b < active; ++b)
                for (int j = 0; j < m; ++j) Y[Layout::index(b, j)] = memory.displacement(K::active_index[b], j);
            for (int c = 0; c < constraints; ++c) {
                if constexpr (constraints > 0) {
                    for (int j = 0; j < m; ++j) Y[Layout::index(active + c, j)] = memory.lambda[c * r + j];
                }
            }
            for (int c = 0; c < cyclic; ++c) {
                if constexpr (cyclic > 0) {
                    if (kappas > 0) Y[active * m + c] = memory.kappa[K::cyclic_index[c]];
                    for (int i = 0; i < r; ++i) cyclic_rates[i * cyclic + c] = memory.v[K::cyclic_index[c] * r + i];
                }
            }
            is_current = true;
        }
    }

    template <class AnyFixedPoint>
    void begin_fixed_point(AnyFixedPoint& any, [[maybe_unused]] const real* v) {
        any.pause = Pause();
        if constexpr (iterates_on_constraints)
            any.iteration.has_history = false;
        else
            any.iteration.begin(coefficients, this->time(), q, v);
    }

    // A step by iterations; where they fail, all is made ready for Newton's iteration.
    template <class AnyFixedPoint>
    bool iterate(AnyFixedPoint& any) {
        const bool paused = any.pause.left > 0;
        if (!any.pause.count_down()) return false;
        if constexpr (iterates_on_constraints)
            any.iteration.has_history = any.iteration.has_history && !paused;
        else if (paused)
            any.iteration.recall([this](int c, int i) { return node_velocity(c, i); });
        real q1[n], p1[n];
        for (int k = 0; k < n; ++k) {
            q1[k] = q[k];
            p1[k] = p[k];
        }
        any.iteration.tolerance = this->tolerance;
        if (any.iteration.step(coefficients, this->time(), q1, p1)) {
            for (int k = 0; k < n; ++k) {
                q_before[k] = q[k];
                q[k] = q1[k];
                p[k] = p1[k];
            }
            iterations = static_cast<std::int32_t>(any.iteration.evaluations);
            increment = any.iteration.increment;
            if constexpr (K::clocked) {
                elapsed = any.iteration.elapsed;
                for (int i = 0; i < r; ++i) rates[i] = any.iteration.rates[i];
            }
            if constexpr (constraints > 0)
                for (int c = 0; c < constraints; ++c) last_multiplier[c] = any.iteration.lambda[c * r + r - 1];
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

    // With the multipliers that the momentum would need to keep the constraints.
    Status velocity(real time, const real* position, const real* momentum, real* v, real* mu) const {
        if constexpr (K::hamiltonian) {
            Formulas<K>::velocity(coefficients, time, position, momentum, v);
            return is_finite(not_finite_part(v, n)) ? Status::ok : Status::not_finite;
        }
        const auto of_last_step = [this](real* guess) {
            real position_there[n];
            if (has_history) polynomial(real(1), position_there, guess);
            return has_history;
        };
        return velocity_of_momentum.find(coefficients, time, position, momentum, of_last_step, v, mu);
    }

    // (D46) The multipliers of the end, which keep dphi/dt = 0 there, and their part of the momentum p1.
    Status end_on_constraints(const real* q1, real* p1, const Arrays& a) {
        if constexpr (constraints > 0) {
            real v[n], mu[constraints], phi[constraints], phi_t[constraints], G[K::constraint_entries];
            const Status status = velocity(this->next_time(), q1, p1, v, mu);
            if (status != Status::ok) return status;
            Formulas<K>::constraint(coefficients, this->next_time(), q1, phi, phi_t, G);
            if (!keeps_constraints(q1, v, phi, phi_t, G, a)) return Status::singular_jacobian;
            for (int e = 0; e < K::constraint_entries; ++e)
                p1[K::constraint_column[e]] -= G[e] * mu[K::constraint_row[e]];
            for (int c = 0; c < constraints; ++c) last_multiplier[c] = -mu[c] / (step_size * K::b[r - 1]);
        }
        return Status::ok;
    }

    // sum_i h b_i dt/dtau of the stages just solved: clock(Q_i), or the velocity of the time.
    real time_passed(Arrays& a) {
        real passed = real(0);
        if constexpr (K::clocked) {
            real Q[n];
            for (int k = 0; k < n; ++k) Q[k] = q[k];
            for (int i = 0; i < r; ++i) {
                this->node_variables(q, p, a.Y, i, a.z);
                for (int b = 0; b < active; ++b) Q[K::active_index[b]] = a.z[active + b];
                rates[i] = K::has_time_coordinate ? a.z[active - 1] : Formulas<K>::clock(coefficients, this->time(), Q);
                passed += K::b[i] * rates[i];
            }
        }
        return step_size * passed;
    }

    Status step_in(Arrays& a) {
        Status status = Status::not_converged;
        if (has_history && may_extrapolate<K>()) {
            for (int b = 0; b < active; ++b) {  // the last step's polynomial, beyond its end
                const real* const last = Y + Layout::index(b, 0);
                for (int j = 0; j < m; ++j) {
                    real moved = -last[m - 1];
                    for (int k = 0; k < m; ++k) moved += K::extrapolation[(j + 1) * (m + 1) + k + 1] * last[k];
                    a.Y[Layout::index(b, j)] = moved;
                }
            }
            for (int c = 0; c < kappas; ++c) a.Y[active * m + c] = Y[active * m + c];
            for (int c = 0; c < constraints; ++c)  // at the nodes 0 ... m - 1, from those of the last step and its end
                for (int j = 0; j < m; ++j) {
                    real sum = K::extrapolation[j * (m + 1) + m] * last_multiplier[c];
                    for (int k = 0; k < m; ++k)
                        sum += K::extrapolation[j * (m + 1) + k] * Y[Layout::index(active + c, k)];
                    a.Y[Layout::index(active + c, j)] = sum;
                }
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
            for (int c = 0; c < constraints; ++c)
                for (int j = 0; j < m; ++j) a.Y[Layout::index(active + c, j)] = real(0);
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
        status = end_on_constraints(a.q1, a.p1, a);
        if (status != Status::ok) return status;
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
