// SPDX-License-Identifier: MIT
// Steps of systems with constant mass and forces without velocities: only the interior nodes are implicit.
//
// The fixed-point iteration (iteration/fixed_point.hpp) solves the stage equations where it contracts; Newton's
// iteration (iteration/newton.hpp) where it does not. Formula numbers (D..) refer to docs/derivation.md. W = M^-1 (grad
// V - F) may depend on time: node i is at t + c_i h.
#ifndef LOBATTO_KERNEL_SEPARABLE_HPP
#define LOBATTO_KERNEL_SEPARABLE_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../iteration/fixed_point.hpp"
#include "../iteration/newton.hpp"
#include "../iteration/stage_equations.hpp"
#include "../iteration/tangent.hpp"

namespace lobatto {

template <class K>
struct Stepper<K, Form::separable, Stepping::solved> : VelocityKept<K> {
    using typename VelocityKept<K>::real;
    using VelocityKept<K>::n, VelocityKept<K>::coefficients, VelocityKept<K>::step_size, VelocityKept<K>::q,
        VelocityKept<K>::u, VelocityKept<K>::iterations, VelocityKept<K>::increment;
    static constexpr int s = K::points, m = s - 2;
    static constexpr int N = K::unknowns;
    static constexpr int nodes = s;
    static constexpr int room = N > 0 ? N : 1, entry_room = K::entries > 0 ? K::entries : 1;
    using Stages = StageEquations<K>;
    using Newton = NewtonIteration<K>;
    static constexpr bool has_fixed_point = N > 0 && K::any_number && !K::linear && !K::clean;
    static constexpr bool along_coordinates = has_fixed_point && K::neighbours;  // in lanes, not nodes

    struct Arrays : Newton::Arrays {
        real q1[n], u1[n], W1[n];  // the end of the step
    };

    struct FixedPointState {
        typename FixedPointOf<K, along_coordinates>::type iteration;
        Pause pause;
    };

    real q_before[n]{}, u_before[n]{};  // before the last step
    real W[s * n]{};                    // M^-1 grad V at the nodes of the last step; the last n at q
    bool has_history{};                 // W holds a whole step
    bool is_current{};  // W is that of the last step; else the iterations' memory is, of chains also q_before
    std::conditional_t<has_fixed_point, FixedPointState, Nothing> fixed_point{};
    Newton newton{};
    Workspace<Arrays> workspace;

    Status prepare(const typename K::Parameters& parameters, real h) {
        step_size = h;
        has_history = false;
        const Status status = K::prepare(parameters, h, coefficients);
        if (status != Status::ok) return status;
        if constexpr (has_fixed_point) fixed_point.iteration.prepare(coefficients, h);
        return newton.prepare(coefficients, h);
    }

    Status start(real time, const real* position, const real* momentum) {
        const Status status = this->begin(time, position, momentum, W + (s - 1) * n);
        has_history = false;
        is_current = true;
        if constexpr (has_fixed_point) {
            fixed_point.pause = Pause();
            fixed_point.iteration.least_increment = real(0);
            if constexpr (along_coordinates)
                fixed_point.iteration.begin(q, u, W + (s - 1) * n);
            else
                fixed_point.iteration.begin(q, W + (s - 1) * n);
        }
        return status;
    }

    Status step() {
        if (this->time_stands_still()) return Status::time_stands_still;
        if constexpr (has_fixed_point) {
            if (iterate(fixed_point)) return Status::ok;
        }
        return workspace.with([this](Arrays& arrays) { return step_in(arrays); });
    }

    // The polynomial of the last step through its positions, at t + theta h.
    void polynomial(real theta, real* position, real* velocity) const {
        real value[s], slope[s];
        basis_at(theta, value, slope);
        polynomial(value, slope, position, velocity);
    }
    static constexpr int basis = s;  // polynomials
    static void basis_at(real theta, real* value, real* slope) { lagrange<s>(K::c, theta, value, slope); }
    void polynomial(const real* value, const real* slope, real* position, real* velocity) const {
        for (int k = 0; k < n; ++k) {
            const real start = position_before(k);
            real moved = value[s - 1] * (q[k] - start), rate = slope[s - 1] * (q[k] - start);
            for (int i = 0; i < m; ++i) {
                const real displacement = displacement_of(i, k);
                moved += value[i + 1] * displacement;
                rate += slope[i + 1] * displacement;
            }
            position[k] = start + moved;
            velocity[k] = rate / step_size;
        }
    }

    // F at the interior positions X, node-major, N.
    Status residual(real time, const real* position, const real* momentum, const real* X, real* F) const {
        if constexpr (N > 0) {
            workspace.with([&](Arrays& a) {
                const Stages stages(step_size);
                K::velocity(coefficients, momentum, a.u1);
                Formulas<K>::minus_acceleration(coefficients, time, position, a.W1);
                stages.drift(position, a.u1, a.W1, a.v, a.base);
                for (int i = 0; i < m; ++i)
                    Formulas<K>::minus_acceleration(coefficients, time + K::c[i + 1] * step_size, X + i * n,
                                                    a.W + i * n);
                stages.residual(a.base, X, a.W, F);
            });
        }
        return Status::ok;
    }

    // dF/dX, N x N.
    Status jacobian(real time, const real*, const real*, const real* X, real* J) const {
        if constexpr (N > 0) {
            workspace.with([&](Arrays& a) {
                for (int i = 0; i < m; ++i)
                    Formulas<K>::node(coefficients, time + K::c[i + 1] * step_size, X + i * n, a.W1,
                                      a.S + i * K::entries);
                Stages(step_size).jacobian(a.S, J);
            });
        }
        return Status::ok;
    }

    // Where the last step began.
    real position_before(int k) const {
        if constexpr (along_coordinates) {
            if (!is_current) return fixed_point.iteration.q[fixed_point.iteration.then][k];
        }
        return q_before[k];
    }
    real velocity_before(int k) const {
        if constexpr (along_coordinates) {
            if (!is_current) return fixed_point.iteration.u[fixed_point.iteration.then][k];
        }
        return u_before[k];
    }
    // W at node i of the last step; node s - 1 is where the motion is now.
    real node_minus_acceleration(int i, int k) const {
        if constexpr (has_fixed_point) {
            if (!is_current) return fixed_point.iteration.minus_acceleration(i, k);
        }
        return W[i * n + k];
    }
    // (D12) Q_i - q of the last step's interior node i.
    real displacement_of(int i, int k) const {
        real moved = K::c[i + 1] * (velocity_before(k) - step_size * K::b[0] * node_minus_acceleration(0, k));
        for (int j = 0; j < m; ++j) moved -= step_size * K::A[i * m + j] * node_minus_acceleration(j + 1, k);
        return step_size * moved;
    }
    real node_position(int i, int k) const {
        return i == s - 1 ? q[k] : position_before(k) + (i > 0 ? displacement_of(i - 1, k) : real(0));
    }

    // One step from (q, p) at `time` and d(q1, p1)/d(q, p) (D24), 2n x 2n.
    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        if constexpr (K::has_tangent) {
            Stepper local = *this;
            const Status status = this->step_from(local, time, position, momentum, q1, p1);
            if (status != Status::ok) return status;
            constexpr int columns = 2 * n + 1;
            real full[2 * n * columns], second[s * n * n], at[n], ignored[n], entries[entry_room], none[n] = {};
            for (int i = 0; i < s; ++i) {
                for (int k = 0; k < n; ++k) at[k] = local.node_position(i, k);
                Formulas<K>::node(coefficients, time + K::c[i] * step_size, at, ignored, entries);
                expand_entries<K>(entries, second + i * n * n);
            }
            if (!increment_of_step<K>(step_size, second, none, full)) return Status::singular_jacobian;
            to_momentum<K>(coefficients, full);
            add_identity<K>(full, T);
            return Status::ok;
        } else {
            return Status::unsupported;
        }
    }

protected:
    real node_time(int i) const { return this->time() + K::c[i + 1] * step_size; }

    // a.v and a.base of the step from q and u, and its interior nodes by Newton's iteration: a.Q, a.W.
    Status solve_from_start(Arrays& a) {
        const Stages stages(step_size);
        const real* const W0 = W + (s - 1) * n;
        stages.drift(q, u, W0, a.v, a.base);
        if constexpr (N == 0) return Status::ok;
        Status status = Status::not_converged;
        if (has_history) {
            stages.extrapolated_start(a.base, W, a.Q);
            status = solve_stages(W0, a);
        }
        if (status != Status::ok) {
            stages.simple_start(a.base, W0, a.Q);
            status = solve_stages(W0, a);
        }
        return status;
    }

private:
    // A step by iterations; where they fail, all is made ready for Newton's iteration.
    template <class AnyFixedPoint>
    bool iterate(AnyFixedPoint& any) {
        const bool paused = any.pause.left > 0;
        if (!any.pause.count_down()) return false;
        if (paused) {
            const auto minus_acceleration = [this](int i, int k) { return node_minus_acceleration(i, k); };
            if constexpr (along_coordinates)
                any.iteration.recall(q, u, minus_acceleration);
            else
                any.iteration.recall(minus_acceleration, [this](int i, int k) { return node_position(i, k); });
        }
        any.iteration.tolerance = this->tolerance;
        if (fixed_point_step(any.iteration)) {
            iterations = static_cast<std::int32_t>(any.iteration.evaluations);
            increment = any.iteration.increment;
            any.pause.succeed();
            is_current = false;
            has_history = true;
            ++this->steps;
            return true;
        }
        if (!is_current)
            for (int k = 0; k < n; ++k) {
                for (int i = 0; i < s; ++i) W[i * n + k] = any.iteration.minus_acceleration(i, k);
                if constexpr (along_coordinates) {
                    q_before[k] = any.iteration.q[any.iteration.then][k];
                    u_before[k] = any.iteration.u[any.iteration.then][k];
                }
            }
        is_current = true;
        any.pause.fail();
        return false;
    }

    // q and u move on where the iterations succeed, and leave their values in q_before and u_before, or in the
    // iterations' memory.
    template <class AnyIteration>
    bool fixed_point_step(AnyIteration& iteration) {
        if constexpr (along_coordinates) {
            if (!iteration.step(coefficients, this->time())) return false;
            iteration.state(q, u);
        } else {
            real q1[n], u1[n];
            for (int k = 0; k < n; ++k) {
                q1[k] = q[k];
                u1[k] = u[k];
            }
            if (!iteration.step(coefficients, this->time(), q1, u1)) return false;
            for (int k = 0; k < n; ++k) {
                q_before[k] = q[k];
                u_before[k] = u[k];
                q[k] = q1[k];
                u[k] = u1[k];
            }
        }
        return true;
    }

    Status step_in(Arrays& a) {
        const Status solved = solve_from_start(a);
        if (solved != Status::ok) return solved;
        const Stages stages(step_size);
        const real* const W0 = W + (s - 1) * n;
        stages.arrive(a.base, a.W, a.q1);
        Formulas<K>::minus_acceleration(coefficients, this->next_time(), a.q1, a.W1);
        stages.finish(a.v, a.W, a.W1, a.u1);
        if (!is_finite(not_finite_part(a.q1, n) + not_finite_part(a.u1, n) + not_finite_part(a.W1, n)))
            return Status::not_finite;
        for (int k = 0; k < n; ++k) {
            q_before[k] = q[k];
            u_before[k] = u[k];
            q[k] = a.q1[k];
            u[k] = a.u1[k];
            W[k] = W0[k];
        }
        for (int i = 0; i < N; ++i) W[n + i] = a.W[i];
        for (int k = 0; k < n; ++k) W[(s - 1) * n + k] = a.W1[k];
        has_history = true;
        ++this->steps;
        return Status::ok;
    }

    Status solve_stages(const real* W0, Arrays& a) {
        const auto outcome = newton.solve(coefficients, step_size, this->time(), q, W0, a);
        iterations = outcome.iterations;
        increment = outcome.increment;
        if constexpr (has_fixed_point)
            if (real(2) * outcome.noise > fixed_point.iteration.least_increment) {
                fixed_point.iteration.least_increment = real(2) * outcome.noise;
                fixed_point.pause = {1, 1};  // iterations that only failed for what rounds take the next step again
            }
        return outcome.status;
    }
};

}  // namespace lobatto

#endif
