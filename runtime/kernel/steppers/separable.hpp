// SPDX-License-Identifier: MIT
// Steps of systems with constant mass and forces without velocities: only the interior nodes are implicit.
//
// Sweeps (iteration/fixed_point.hpp) solve the stage equations where they contract; Newton's iteration, here, where
// they do not. Formula numbers (D..) refer to docs/derivation.md. W = M^-1 (grad V - F) may depend on time: node i is
// at t + c_i h.
#ifndef LOBATTO_KERNEL_SEPARABLE_HPP
#define LOBATTO_KERNEL_SEPARABLE_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/solve.hpp"
#include "../iteration/fixed_point.hpp"
#include "../iteration/neighbours.hpp"
#include "linear.hpp"

namespace lobatto {

// ---------------------------------------------------------------------------------------------------------------------
// The stage functions, either written out by the generator or as loops
// ---------------------------------------------------------------------------------------------------------------------

// Written out: the kernel's own. Their products with h are among its coefficients.
template <class K>
struct UnrolledStages {
    using real = typename K::real;
    const typename K::Coefficients& k;

    UnrolledStages(const typename K::Coefficients& coefficients, real) : k(coefficients) {}
    void drift(const real* q, const real* u, const real* W0, real* v, real* base) const {
        K::drift(k, q, u, W0, v, base);
    }
    void simple_start(const real* base, const real* W0, real* Q) const { K::simple_start(k, base, W0, Q); }
    void extrapolated_start(const real* base, const real* W_before, real* Q) const {
        K::extrapolated_start(k, base, W_before, Q);
    }
    void residual(const real* base, const real* Q, const real* W, real* F) const { K::residual(k, base, Q, W, F); }
    void jacobian(const real* S, real* J) const { K::jacobian(k, S, J); }
    bool correction(const real* base, const real* Q, const real* W, const real* S, real* delta) const {
        return K::correction(k, base, Q, W, S, delta);
    }
    void carry(const real* S, int, const real* delta, real* W) const { K::carry(k, S, delta, W); }
    void arrive(const real* base, const real* W, real* q1) const { K::arrive(k, base, W, q1); }
    void finish(const real* v, const real* W, const real* W1, real* u1) const { K::finish(k, v, W, W1, u1); }
};

// A E of (D15): from the accelerations of the step before to the stage map's sums.
template <class K>
struct ExtrapolatedStages {
    typename K::real entry[(K::points > 2 ? K::points - 2 : 1) * K::points]{};
    constexpr ExtrapolatedStages() {
        constexpr int s = K::points, m = s - 2;
        for (int i = 0; i < m; ++i)
            for (int j = 0; j < s; ++j)
                for (int l = 0; l < m; ++l) entry[i * s + j] += K::A[i * m + l] * K::E[l * s + j];
    }
};
template <class K>
constexpr ExtrapolatedStages<K> extrapolated_stages{};

// Loops over nodes and coordinates with the tables c, b, A and E.
template <class K>
struct LoopedStages {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2, N = n * m;
    using Layout = Grouped<K, n, (m > 0 ? m : 1), 0>;
    using Matrix = GroupedMatrix<real, Layout>;
    real h;

    LoopedStages(const typename K::Coefficients&, real step_size) : h(step_size) {}

    // (D11) v = u - h b_1 W0 and base_i = q + h c_i v, i = 2 ... s.
    void drift(const real* q, const real* u, const real* W0, real* v, real* base) const {
        for (int k = 0; k < n; ++k) v[k] = u[k] - h * K::b[0] * W0[k];
        for (int i = 0; i < s - 1; ++i)
            for (int k = 0; k < n; ++k) base[i * n + k] = q[k] + h * K::c[i + 1] * v[k];
    }

    // (D14) Q_i = base_i - h^2 (sum_j A_ij) W0.
    void simple_start(const real* base, const real* W0, real* Q) const {
        for (int i = 0; i < m; ++i) {
            real sum = real(0);
            for (int j = 0; j < m; ++j) sum += K::A[i * m + j];
            for (int k = 0; k < n; ++k) Q[i * n + k] = base[i * n + k] - h * h * sum * W0[k];
        }
    }

    // (D15) Q_i = base_i - h^2 sum_j (A E)_ij W_before_j.
    void extrapolated_start(const real* base, const real* W_before, real* Q) const {
        for (int i = 0; i < m; ++i) {
            for (int k = 0; k < n; ++k) Q[i * n + k] = base[i * n + k];
            for (int j = 0; j < s; ++j) {
                const real factor = h * h * extrapolated_stages<K>.entry[i * s + j];
                for (int k = 0; k < n; ++k) Q[i * n + k] -= factor * W_before[j * n + k];
            }
        }
    }

    // (D12) F_i = Q_i - base_i + h^2 sum_j A_ij W_j.
    void residual(const real* base, const real* Q, const real* W, real* F) const {
        for (int i = 0; i < m; ++i) {
            for (int k = 0; k < n; ++k) F[i * n + k] = Q[i * n + k] - base[i * n + k];
            for (int j = 0; j < m; ++j) {
                const real factor = h * h * K::A[i * m + j];
                for (int k = 0; k < n; ++k) F[i * n + k] += factor * W[j * n + k];
            }
        }
    }

    // (D13) J = I + h^2 A (x) S into add(coordinate, node; coordinate, node), which begins at zero. The S of two nodes
    // are `stride` apart; 0: the same for all.
    template <class At>
    void assemble(const real* S, int stride, At&& at) const {
        for (int k = 0; k < n; ++k)
            for (int i = 0; i < m; ++i) at(k, i, k, i) += real(1);
        for (int e = 0; e < K::entries; ++e)
            for (int i = 0; i < m; ++i)
                for (int j = 0; j < m; ++j)
                    at(K::entry_row[e], i, K::entry_column[e], j) += h * h * K::A[i * m + j] * S[j * stride + e];
    }
    void jacobian(const real* S, real* J) const {
        for (int i = 0; i < N * N; ++i) J[i] = real(0);
        assemble(S, K::entries, [&](int k, int i, int l, int j) -> real& { return J[(i * n + k) * N + j * n + l]; });
    }

    bool factor(const real* S, int stride, Matrix& matrix) const {
        matrix.clear();
        assemble(S, stride, matrix);
        return matrix.factor();
    }

    // (D14) delta = -J^-1 F with J factored; `sorted` is room for N.
    void solve(const real* base, const real* Q, const real* W, const Matrix& matrix, real* delta, real* sorted) const {
        residual(base, Q, W, delta);
        for (int i = 0; i < N; ++i) delta[i] = -delta[i];
        solve_for(matrix, delta, sorted);
    }
    // delta <- J^-1 delta.
    static void solve_for(const Matrix& matrix, real* delta, real* sorted) {
        for (int k = 0; k < n; ++k)
            for (int i = 0; i < m; ++i) sorted[Layout::index(k, i)] = delta[i * n + k];
        matrix.solve(sorted);
        for (int k = 0; k < n; ++k)
            for (int i = 0; i < m; ++i) delta[i * n + k] = sorted[Layout::index(k, i)];
    }

    // W_j += S_j delta_j.
    void carry(const real* S, int stride, const real* delta, real* W) const {
        for (int j = 0; j < m; ++j)
            for (int e = 0; e < K::entries; ++e)
                W[j * n + K::entry_row[e]] += S[j * stride + e] * delta[j * n + K::entry_column[e]];
    }

    // (D16) q1 = base_s - h^2 sum_j b_j (1 - c_j) W_j.
    void arrive(const real* base, const real* W, real* q1) const {
        for (int k = 0; k < n; ++k) q1[k] = base[m * n + k];
        for (int j = 0; j < m; ++j) {
            const real factor = h * h * (K::b[j + 1] * (real(1) - K::c[j + 1]));
            for (int k = 0; k < n; ++k) q1[k] -= factor * W[j * n + k];
        }
    }

    // (D17) u1 = v - h sum_j b_j W_j - h b_s W1.
    void finish(const real* v, const real* W, const real* W1, real* u1) const {
        for (int k = 0; k < n; ++k) u1[k] = v[k] - h * K::b[s - 1] * W1[k];
        for (int j = 0; j < m; ++j)
            for (int k = 0; k < n; ++k) u1[k] -= h * K::b[j + 1] * W[j * n + k];
    }
};

// ---------------------------------------------------------------------------------------------------------------------
// The stepper
// ---------------------------------------------------------------------------------------------------------------------

// What the loops need besides, in each step.
template <class K>
struct LoopArrays {
    typename LoopedStages<K>::Matrix matrix;
    typename K::real sorted[LoopedStages<K>::N];
};

// The Jacobian with a constant S, factored once.
template <class K>
struct FrozenJacobian {
    typename LoopedStages<K>::Matrix matrix;
    typename K::real S[K::entries > 0 ? K::entries : 1];
    bool usable, is_factored;
};

// Whether sweeps have neighbouring coordinates in lanes, not nodes.
template <class K>
constexpr bool along_coordinates() {
    if constexpr (K::any_number && !K::linear)
        return K::neighbours;
    else
        return false;
}

template <class K>
struct Stepper<K, Form::separable, Stepping::solved> : ConstantMass<K> {
    using typename ConstantMass<K>::real;
    using ConstantMass<K>::n, ConstantMass<K>::coefficients, ConstantMass<K>::step_size, ConstantMass<K>::q,
        ConstantMass<K>::u, ConstantMass<K>::iterations, ConstantMass<K>::increment;
    static constexpr int s = K::points, m = s - 2;
    static constexpr int N = K::unknowns;
    static constexpr int nodes = s;
    static constexpr int room = N > 0 ? N : 1, entry_room = K::entries > 0 ? K::entries : 1;
    static constexpr int iteration_limit = 40;
    using Stages = std::conditional_t<K::unrolled, UnrolledStages<K>, LoopedStages<K>>;

    static constexpr bool absorbs() {
        if constexpr (K::unrolled || K::linear)
            return false;
        else
            return K::absorbed;
    }
    static constexpr bool is_frozen = N > 0 && !K::unrolled && (K::linear || absorbs());
    static constexpr bool is_swept = N > 0 && K::any_number && !K::linear && !K::clean;
    static constexpr bool along_coordinates = lobatto::along_coordinates<K>();

    struct Nothing {};
    struct Arrays {
        real v[n], base[(s - 1) * n], nodes[room], W_nodes[room], q1[n], u1[n], W1[n];
        real S[(m > 0 ? m : 1) * entry_room], delta[room], inverse_scale[n];
        std::conditional_t<K::unrolled || N == 0, Nothing, LoopArrays<K>> loop;
    };

    struct Swept {
        std::conditional_t<along_coordinates, NeighbourSweeps<K>, Sweeps<K>> sweeps;
        Pause pause;
    };

    real q_before[n]{}, u_before[n]{};  // before the last step
    real W[s * n]{};                    // M^-1 grad V at the nodes of the last step; the last n at q
    bool has_history{};                 // W holds a whole step
    bool is_current{};  // W is that of the last step; else the sweeps' memory is, of chains also q_before
    std::conditional_t<is_swept, Swept, Nothing> swept{};
    std::conditional_t<is_frozen, FrozenJacobian<K>, Nothing> frozen{};
    Workspace<Arrays> workspace;

    Status prepare(const typename K::Parameters& parameters, real h) {
        step_size = h;
        has_history = false;
        const Status status = K::prepare(parameters, h, coefficients);
        if (status != Status::ok) return status;
        if constexpr (is_swept) swept.sweeps.prepare(coefficients, h);
        if constexpr (is_frozen) {
            frozen.is_factored = false;
            if constexpr (K::linear) return freeze(frozen);
        }
        return Status::ok;
    }

    Status start(real time, const real* position, const real* momentum) {
        this->start_time = time;
        this->steps = 0;
        has_history = false;
        real sum = time + not_finite_part(momentum, n);
        for (int k = 0; k < n; ++k) {
            q[k] = position[k];
            sum += position[k] - position[k];
        }
        K::velocity(coefficients, momentum, u);
        Formulas<K>::acceleration(coefficients, time, q, W + (s - 1) * n);
        sum += not_finite_part(W + (s - 1) * n, n);
        if constexpr (K::events > 0) Formulas<K>::event(coefficients, time, q, u, this->event_values);
        is_current = true;
        if constexpr (is_swept) begin_sweeps(swept);
        return is_finite(sum) ? Status::ok : Status::not_finite;
    }

    Status step() {
        if (this->time_stands_still()) return Status::time_stands_still;
        if constexpr (is_swept) {
            if (sweep(swept)) return Status::ok;
        }
        return workspace.with([this](Arrays& arrays) { return step_in(arrays); });
    }

    // The polynomial of the last step through its positions, at t + theta h.
    void polynomial(real theta, real* position, real* velocity) const {
        real value[s], slope[s];
        lagrange<s>(K::c, theta, value, slope);
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
                const Stages stages(coefficients, step_size);
                K::velocity(coefficients, momentum, a.u1);
                Formulas<K>::acceleration(coefficients, time, position, a.W1);
                stages.drift(position, a.u1, a.W1, a.v, a.base);
                for (int i = 0; i < m; ++i)
                    Formulas<K>::acceleration(coefficients, time + K::c[i + 1] * step_size, X + i * n,
                                              a.W_nodes + i * n);
                stages.residual(a.base, X, a.W_nodes, F);
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
                Stages(coefficients, step_size).jacobian(a.S, J);
            });
        }
        return Status::ok;
    }

    // Where the last step began.
    real position_before(int k) const {
        if constexpr (along_coordinates) {
            if (!is_current) return swept.sweeps.q[swept.sweeps.then][k];
        }
        return q_before[k];
    }
    real velocity_before(int k) const {
        if constexpr (along_coordinates) {
            if (!is_current) return swept.sweeps.u[swept.sweeps.then][k];
        }
        return u_before[k];
    }
    // W at node i of the last step; node s - 1 is where the motion is now.
    real node_acceleration(int i, int k) const {
        if constexpr (is_swept) {
            if (!is_current) return swept.sweeps.acceleration(i, k);
        }
        return W[i * n + k];
    }
    // (D12) Q_i - q of the last step's interior node i.
    real displacement_of(int i, int k) const {
        real moved = K::c[i + 1] * (velocity_before(k) - step_size * K::b[0] * node_acceleration(0, k));
        for (int j = 0; j < m; ++j) moved -= step_size * K::A[i * m + j] * node_acceleration(j + 1, k);
        return step_size * moved;
    }
    real node_position(int i, int k) const {
        return i == s - 1 ? q[k] : position_before(k) + (i > 0 ? displacement_of(i - 1, k) : real(0));
    }

    // One step from (q, p) at `time` and d(q1, p1)/d(q, p) (D24), 2n x 2n.
    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        if constexpr (K::has_tangent) {
            Stepper local = *this;
            Status status = local.start(time, position, momentum);
            if (status == Status::ok) status = local.step();
            if (status != Status::ok) return status;
            for (int k = 0; k < n; ++k) q1[k] = local.q[k];
            local.momentum(p1);
            constexpr int columns = 2 * n + 1;
            real full[2 * n * columns], second[s * n * n], at[n], ignored[n], entries[entry_room], none[n] = {};
            for (int i = 0; i < s; ++i) {
                for (int k = 0; k < n; ++k) at[k] = local.node_position(i, k);
                Formulas<K>::node(coefficients, time + K::c[i] * step_size, static_cast<const real*>(at), +ignored,
                                  +entries);
                expand_entries<K>(entries, second + i * n * n);
            }
            if (!increment_of_step<K>(step_size, second, none, full)) return Status::singular_jacobian;
            to_momentum<K>(coefficients, full);
            for (int r = 0; r < 2 * n; ++r)
                for (int c = 0; c < 2 * n; ++c) T[r * 2 * n + c] = (r == c ? real(1) : real(0)) + full[r * columns + c];
            return Status::ok;
        } else {
            (void)time, (void)position, (void)momentum, (void)q1, (void)p1, (void)T;
            return Status::unsupported;
        }
    }

protected:
    real node_time(int i) const { return this->time() + K::c[i + 1] * step_size; }

    // a.v and a.base of the step from q and u, and its interior nodes by Newton's iteration: a.nodes, a.W_nodes.
    Status solve_from_start(Arrays& a) {
        const Stages stages(coefficients, step_size);
        const real* const W0 = W + (s - 1) * n;
        stages.drift(q, u, W0, a.v, a.base);
        Status status = Status::ok;
        if constexpr (N > 0) {
            status = Status::not_converged;
            if (has_history) {
                stages.extrapolated_start(a.base, W, a.nodes);
                status = solve_stages(stages, W0, a);
            }
            if (status != Status::ok) {
                stages.simple_start(a.base, W0, a.nodes);
                status = solve_stages(stages, W0, a);
            }
        }
        return status;
    }

private:
    template <class AnySwept>
    void begin_sweeps(AnySwept& any) {
        any.pause = Pause();
        if constexpr (along_coordinates)
            any.sweeps.begin(q, u, W + (s - 1) * n);
        else
            any.sweeps.begin(q, W + (s - 1) * n);
    }

    // A step by sweeps; where they fail, all is made ready for Newton's iteration.
    template <class AnySwept>
    bool sweep(AnySwept& any) {
        const bool paused = any.pause.left > 0;
        if (!any.pause.count_down()) return false;
        if (paused) {
            const auto acceleration = [this](int i, int k) { return node_acceleration(i, k); };
            if constexpr (along_coordinates)
                any.sweeps.recall(q, u, acceleration);
            else
                any.sweeps.recall(acceleration, [this](int i, int k) { return node_position(i, k); });
        }
        any.sweeps.tolerance = this->tolerance;
        if (sweeps_step(any.sweeps)) {
            iterations = static_cast<std::int32_t>(any.sweeps.evaluations);
            increment = any.sweeps.increment;
            any.pause.succeed();
            is_current = false;
            has_history = true;
            ++this->steps;
            return true;
        }
        if (!is_current)
            for (int k = 0; k < n; ++k) {
                for (int i = 0; i < s; ++i) W[i * n + k] = any.sweeps.acceleration(i, k);
                if constexpr (along_coordinates) {
                    q_before[k] = any.sweeps.q[any.sweeps.then][k];
                    u_before[k] = any.sweeps.u[any.sweeps.then][k];
                }
            }
        is_current = true;
        any.pause.fail();
        return false;
    }

    // q and u move on where the sweeps succeed, and leave their values in q_before and u_before, or in the sweeps'
    // memory.
    template <class AnySweeps>
    bool sweeps_step(AnySweeps& sweeps) {
        if constexpr (along_coordinates) {
            if (!sweeps.step(coefficients, this->time())) return false;
            copy_lanes<n>(sweeps.q[sweeps.now], q);
            copy_lanes<n>(sweeps.u[sweeps.now], u);
        } else {
            real q1[n], u1[n];
            for (int k = 0; k < n; ++k) {
                q1[k] = q[k];
                u1[k] = u[k];
            }
            if (!sweeps.step(coefficients, this->time(), q1, u1)) return false;
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
        const Stages stages(coefficients, step_size);
        const real* const W0 = W + (s - 1) * n;
        stages.arrive(a.base, a.W_nodes, a.q1);
        Formulas<K>::acceleration(coefficients, this->next_time(), a.q1, a.W1);
        stages.finish(a.v, a.W_nodes, a.W1, a.u1);
        real sum = real(0);
        for (int k = 0; k < n; ++k) sum += (a.q1[k] - a.q1[k]) + (a.u1[k] - a.u1[k]) + (a.W1[k] - a.W1[k]);
        if (!(sum == real(0))) return Status::not_finite;
        for (int k = 0; k < n; ++k) {
            q_before[k] = q[k];
            u_before[k] = u[k];
            q[k] = a.q1[k];
            u[k] = a.u1[k];
            W[k] = W0[k];
        }
        for (int i = 0; i < N; ++i) W[n + i] = a.W_nodes[i];
        for (int k = 0; k < n; ++k) W[(s - 1) * n + k] = a.W1[k];
        has_history = true;
        ++this->steps;
        return Status::ok;
    }

    // The scale that increments of each coordinate are measured against: the displacement within the step, with the
    // rounding of the position as floor.
    void scale_increments(const real* W0, Arrays& a) const {
        constexpr real floor = Limits<real>::epsilon / Limits<real>::root_epsilon;
        for (int k = 0; k < n; ++k) {
            const real scale = fabs(step_size * a.v[k]) + fabs(step_size * (step_size * W0[k])) + floor * fabs(q[k]);
            a.inverse_scale[k] = scale > Limits<real>::smallest ? real(1) / scale : real(0);
        }
    }

    // Adds the increments to the positions; their largest size, or not a number.
    real apply_increments(Arrays& a) const {
        real e = real(0), sum = real(0);
        for (int i = 0; i < m; ++i)
            for (int k = 0; k < n; ++k) {
                const real d = fabs(a.delta[i * n + k]);
                real relative = d * a.inverse_scale[k];
                // A coordinate at rest that only the others move: its own displacement is the measure.
                if (a.inverse_scale[k] == real(0) && d > real(0)) relative = d / (d + fabs(a.nodes[i * n + k]));
                e = relative > e ? relative : e;
                sum += relative;
            }
        for (int i = 0; i < N; ++i) a.nodes[i] += a.delta[i];
        return is_finite(sum) ? e : sum - sum;
    }

    // Whether increments that no longer shrink are within `roundings` of what they are computed from: positions and
    // accelerations. S is that of the nodes, `stride` apart.
    bool is_rounding(const Arrays& a, const real* S, int stride, real roundings) const {
        for (int i = 0; i < m; ++i) {
            real size[n];
            for (int k = 0; k < n; ++k) size[k] = fabs(a.W_nodes[i * n + k]);
            for (int e = 0; e < K::entries; ++e)
                size[K::entry_row[e]] += fabs(S[i * stride + e] * a.nodes[i * n + K::entry_column[e]]);
            for (int k = 0; k < n; ++k) {
                const real sum = fabs(a.nodes[i * n + k]) + fabs(a.base[i * n + k]) + step_size * step_size * size[k];
                if (!(fabs(a.delta[i * n + k]) <= roundings * Limits<real>::epsilon * sum)) return false;
            }
        }
        return true;
    }

    template <class AnyStages>
    Status solve_stages(const AnyStages& stages, const real* W0, Arrays& a) {
        scale_increments(W0, a);
        iterations = 0;
        if constexpr (is_frozen && K::linear) {
            return correct_once(stages, frozen, a);
        } else {
            if constexpr (is_frozen) {
                if (!frozen.is_factored) factor_quadratic_part(frozen);
                if (frozen.usable) {
                    const Status status = chord(stages, frozen, a);
                    if (status != Status::not_converged) return status;
                }
            }
            return newton(stages, a);
        }
    }

    // Newton's iteration for the interior positions (D14). Convergence is quadratic, e_next = C e^2, so the iteration
    // stops as soon as the NEXT increment would be below rounding; the accelerations are then carried to the final
    // positions to first order, which errs by the same e^2.
    template <class AnyStages>
    Status newton(const AnyStages& stages, Arrays& a) {
        constexpr real last = Limits<real>::root_epsilon;
        real previous = Limits<real>::largest;
        for (int iteration = 1; iteration <= iteration_limit; ++iteration) {
            for (int i = 0; i < m; ++i)
                Formulas<K>::node(coefficients, node_time(i), a.nodes + i * n, a.W_nodes + i * n, a.S + i * K::entries);
            ++iterations;
            if constexpr (K::unrolled) {
                if (!stages.correction(a.base, a.nodes, a.W_nodes, a.S, a.delta)) return why_not_solved(a.S);
            } else {
                if (!stages.factor(a.S, K::entries, a.loop.matrix)) return why_not_solved(a.S);
                stages.solve(a.base, a.nodes, a.W_nodes, a.loop.matrix, a.delta, a.loop.sorted);
            }
            const real e = apply_increments(a);
            increment = e;
            if (!is_finite(e)) return Status::not_finite;
            const bool next_is_rounding =
                K::linear || e <= last ||
                (iteration > 1 && e < previous && (e / previous) * (e / previous) * e <= Limits<real>::epsilon);
            if (next_is_rounding ||
                (iteration > 2 && e >= real(0.5) * previous && is_rounding(a, a.S, K::entries, real(64)))) {
                stages.carry(a.S, K::entries, a.delta, a.W_nodes);
                return Status::ok;
            }
            previous = e;
        }
        return Status::not_converged;
    }

    // Of entries h^2 S far beyond 1 / epsilon products overflow, and their matrix only looks singular.
    Status why_not_solved(const real* S) const {
        for (int e = 0; e < m * K::entries; ++e) {
            const real entry = fabs(step_size * (step_size * S[e])) * Limits<real>::epsilon * Limits<real>::epsilon;
            if (!(entry <= real(1))) return Status::not_finite;
        }
        return Status::singular_jacobian;
    }

    // The constant part of S and the Jacobian with it.
    template <class FrozenPart>
    Status freeze(FrozenPart& part) {
        return workspace.with([&](Arrays& a) {
            for (int k = 0; k < n; ++k) a.q1[k] = real(0);
            Formulas<K>::node(coefficients, real(0), a.q1, a.W1, part.S);
            factor(part);
            return part.usable ? Status::ok : Status::singular_jacobian;
        });
    }
    // The Jacobian of V's quadratic part: when it is first asked for, because sweeps take most steps.
    template <class FrozenPart>
    void factor_quadratic_part(FrozenPart& part) {
        K::quadratic_part(coefficients, part.S);
        factor(part);
    }
    template <class FrozenPart>
    void factor(FrozenPart& part) {
        part.usable = LoopedStages<K>(coefficients, step_size).factor(part.S, 0, part.matrix);
        part.is_factored = true;
    }

    // One increment with the frozen Jacobian; its size.
    template <class FrozenPart>
    real frozen_increment(const Stages& stages, const FrozenPart& part, Arrays& a) {
        for (int i = 0; i < m; ++i)
            Formulas<K>::acceleration(coefficients, node_time(i), a.nodes + i * n, a.W_nodes + i * n);
        ++iterations;
        stages.solve(a.base, a.nodes, a.W_nodes, part.matrix, a.delta, a.loop.sorted);
        return apply_increments(a);
    }

    // A linear system: the frozen Jacobian is the Jacobian.
    template <class FrozenPart>
    Status correct_once(const Stages& stages, const FrozenPart& part, Arrays& a) {
        if (!is_finite(frozen_increment(stages, part, a))) return Status::not_finite;
        increment = real(0);
        stages.carry(part.S, 0, a.delta, a.W_nodes);
        return Status::ok;
    }

    // The frozen Jacobian holds the constant part of S only, so that increments shrink by a factor rho; what is still
    // to come is e rho / (1 - rho). Where rho exceeds 0.1 Newton's iteration is cheaper: not_converged.
    template <class FrozenPart>
    Status chord(const Stages& stages, const FrozenPart& part, Arrays& a) {
        real previous = Limits<real>::largest;
        for (int iteration = 1; iteration <= iteration_limit; ++iteration) {
            const real e = frozen_increment(stages, part, a);
            increment = e;
            if (!is_finite(e)) return Status::not_finite;
            const real contraction = e / previous;
            const bool rest_is_rounding =
                e == real(0) || (iteration > 1 && contraction < real(1) &&
                                 e * contraction <= Limits<real>::epsilon * (real(1) - contraction));
            if (rest_is_rounding || (iteration > 1 && contraction > real(0.1) && is_rounding(a, part.S, 0, real(4)))) {
                stages.carry(part.S, 0, a.delta, a.W_nodes);
                return Status::ok;
            }
            if (iteration > 1 && contraction > real(0.1)) break;
            previous = e;
        }
        return Status::not_converged;
    }
};

}  // namespace lobatto

#endif
