// SPDX-License-Identifier: MIT
// Steps of any Lagrangian system: the Galerkin equations of one step, assembled from one node's derivatives.
//
// Of the n coordinates n_a are active (active_index[]); the others are cyclic (cyclic_index[]), and their momenta P are
// conserved. Control points 0 = x_0 < ... < x_m = 1 carry the positions X_j of the active ones; X_0 is the start, X_m
// the end. Nodes c_i with weights b_i, i = 1 ... r, are where the Lagrangian is looked at, at time t + c_i h:
//     v_i = (1/h) sum_j D_ij X_j,   q_i = sum_j B_ij X_j,   P_i = P + kappa pi(c_i),   B_ij = l_j(c_i), D_ij =
//     l_j'(c_i)
// with pi the shifted Legendre polynomial of degree r - 1 for Lobatto's nodes, where the conserved momenta are so only
// in the mean, and nothing for Gauss's. z = (v, q, P), R(z) = L - P . v_c with the cyclic velocities v_c eliminated, F
// the forces, g = (R_v, R_q + F, R_P = -v_c), and H its derivative:
//     sum_i h b_i [ (D_ij / h) g_v(i) + B_ij g_q(i) ] + delta_j0 p0 = 0,  j = 0 ... m - 1,
//     sum_i h b_i pi_i g_P(i) = 0,
//     q1 = X_m,  p1 = p0 + h sum_i b_i g_q(i)  (the sum over all j, because sum_j l_j = 1),
//     P1 = P,  cyclic positions + h sum_i b_i v_c(i).
// The unknowns are the displacements Y_j = X_j - X_0, j = 1 ... m, and kappa.
//
// A kernel of this form provides: active, cyclic and their tables; nodes (r), controls (m + 1), c, b, control, B, D,
// extrapolation (l_k(1 + x_j)), legendre_polynomial (pi_i, all zero for Gauss); the tables of base/solve.hpp for the
// active coordinates; node(k, z, g, H), slope(k, z, g); entries, entry_row, entry_column of H;
// legendre(k, q, velocity, p, M), mass_entries, mass_row, mass_column; momentum(k, q, velocity, p);
// energy(k, q, velocity); slopes(k, q, velocity, Lv, Lq), dL/dv and dL/dq + F over all coordinates.
#ifndef LOBATTO_KERNEL_GENERAL_HPP
#define LOBATTO_KERNEL_GENERAL_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/numbers.hpp"
#include "../base/solve.hpp"
#include "../iteration/galerkin.hpp"

namespace lobatto {

// The three kinds of slots of z.
enum class Slot { velocity, position, momentum };

// The tables of a kernel's nodes, in the sums that a step needs. Where a table has zeros is known to the compiler.
template <class K>
struct NodeTables {
    using real = typename K::real;
    static constexpr int active = K::active, cyclic = K::cyclic, Z = 2 * active + cyclic;
    static constexpr int r = K::nodes, m = K::controls - 1;

    static constexpr Slot kind(int slot) {
        return slot < active ? Slot::velocity : slot < 2 * active ? Slot::position : Slot::momentum;
    }
    // The block of unknowns that a slot depends on: a coordinate, or after them a kappa.
    static constexpr int block(int slot) { return slot < active ? slot : slot - active; }

    static constexpr bool has_kappa() {
        for (int i = 0; i < r; ++i)
            if (cyclic > 0 && K::legendre_polynomial[i] != real(0)) return true;
        return false;
    }
    // Every node is a control point: B = I.
    static constexpr bool is_nodal() {
        if (r != m + 1) return false;
        for (int i = 0; i < r; ++i)
            for (int j = 0; j <= m; ++j)
                if (K::B[i * (m + 1) + j] != (i == j ? real(1) : real(0))) return false;
        return true;
    }
    // dz/dX_j at node i without its power of h.
    static constexpr real weight(Slot slot, int i, int j) {
        return slot == Slot::velocity   ? K::D[i * (m + 1) + j]
               : slot == Slot::position ? K::B[i * (m + 1) + j]
                                        : K::legendre_polynomial[i];
    }
    static constexpr int diagonal_entry(int slot) {
        for (int e = 0; e < K::entries; ++e)
            if (K::entry_row[e] == slot && K::entry_column[e] == slot) return e;
        return -1;
    }
};

// b_i weight_ij weight_ik of the kinds of a row and a column: rows j = 0 ... m - 1, columns k = 1 ... m, at
// [(j * m + k - 1) * r + i].
template <class K, Slot row, Slot column>
struct NodeProducts {
    using Tables = NodeTables<K>;
    static constexpr int r = Tables::r, m = Tables::m;
    static constexpr int rows = row == Slot::momentum ? 1 : m, columns = column == Slot::momentum ? 1 : m;
    typename K::real value[rows * columns * r]{};
    constexpr NodeProducts() {
        for (int j = 0; j < rows; ++j)
            for (int k = 0; k < columns; ++k)
                for (int i = 0; i < r; ++i)
                    value[(j * columns + k) * r + i] =
                        K::b[i] * Tables::weight(row, i, j) * Tables::weight(column, i, k + 1);
    }
};
template <class K, Slot row, Slot column>
constexpr NodeProducts<K, row, column> node_products{};

template <class K>
struct Stepper<K, Form::general, Stepping::solved> : Motion<K> {
    using typename Motion<K>::real;
    using Motion<K>::n, Motion<K>::coefficients, Motion<K>::step_size, Motion<K>::q, Motion<K>::iterations,
        Motion<K>::increment;
    using Tables = NodeTables<K>;
    static constexpr int active = K::active, cyclic = K::cyclic, Z = Tables::Z, r = Tables::r, m = Tables::m;
    static constexpr int kappas = Tables::has_kappa() ? cyclic : 0;
    static constexpr bool nodal = Tables::is_nodal();
    static constexpr int N = active * m + kappas;
    static constexpr int nodes = K::nodes;
    static constexpr int room = N > 0 ? N : 1, entry_room = K::entries > 0 ? K::entries : 1;
    static constexpr int cyclic_room = cyclic > 0 ? cyclic : 1, mass_room = K::mass_entries > 0 ? K::mass_entries : 1;
    static constexpr int iteration_limit = 40;

    struct Nothing {};
    struct Empty {  // no unknowns: nothing to solve
        void clear() {}
        bool factor() { return true; }
        void solve(real*) const {}
    };
    using Layout = Grouped<K, active, m, kappas>;
    using Matrix = std::conditional_t<(N > 0), GroupedMatrix<real, Layout>, Empty>;
    using MassLayout = std::conditional_t<cyclic == 0, Grouped<K, n, 1, 0>, Whole<n>>;
    struct Arrays {
        real Y[room], delta[room], kappa_scale[cyclic_room];
        real z[r * Z], g[r * Z], H[r * entry_room];
        real q1[n], p1[n];
        Matrix matrix;
    };
    struct MassArrays {
        real p[n], entries[mass_room], residual[n], increment[n], next[n], trial[n];
        GroupedMatrix<real, MassLayout> matrix;
    };
    struct Frozen {
        Matrix matrix;
        real H[entry_room];
    };

    // Fixed-point iterations need the mass matrix of a node alone, which is full for them.
    static constexpr bool has_fixed_point = K::any_number && !K::linear && N > 0 && n <= most_full;
    struct FixedPointState {
        GalerkinFixedPoint<K, real> iteration;
        Pause pause;
    };

    real p[n]{};                // momentum
    real q_before[n]{};         // before the last step
    bool has_history{};         // there is a last step
    mutable bool is_current{};  // what follows is of the last step; else the iterations' memory is
    mutable real Y[room]{};     // displacements at the control points, then kappa, in the order of the solver
    mutable real cyclic_rates[r * cyclic_room]{};  // -g_P at the nodes
    std::conditional_t<has_fixed_point, FixedPointState, Nothing> fixed_point{};
    std::conditional_t<(cyclic > 0), real[m * m], Nothing> integration{};  // inverse of D at the first m nodes
    std::conditional_t<K::linear, Frozen, Nothing> frozen{};
    Workspace<Arrays> workspace;
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
            const auto look_at = [&](const real* trial) {
                Formulas<K>::legendre(coefficients, time, position, trial, a.p, a.entries);
                for (int k = 0; k < n; ++k) a.residual[k] = momentum[k] - a.p[k];
                return is_finite(not_finite_part(a.residual, n) + not_finite_part(a.entries, K::mass_entries));
            };
            for (int k = 0; k < n; ++k) v[k] = real(0);
            if (!look_at(v)) {
                if (!has_history) return Status::not_finite;
                polynomial(real(1), a.trial, v);
                if (!look_at(v)) return Status::not_finite;
            }
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
                    if (next_is_rounding || (look_at(a.trial) && solve_mass(a, a.next) <= length)) break;
                }
                for (int k = 0; k < n; ++k) v[k] = a.trial[k];
                if (next_is_rounding) return Status::ok;
            }
            return Status::not_converged;
        });
    }

    // R at the positions X of the control points 1 ... m, control-major, and kappa; rows j * n_a + a, then kappa's.
    Status residual(real time, const real* position, const real* momentum, const real* X, real* F) const {
        workspace.with([&](Arrays& a) {
            take_unknowns(position, X, a.Y);
            for (int i = 0; i < r; ++i) {
                node_variables(position, momentum, a.Y, i, a.z + i * Z);
                Formulas<K>::slope(coefficients, time + K::c[i] * step_size, a.z + i * Z, a.g + i * Z);
            }
            sum_over_nodes(a.g, a.delta);
            for (int b = 0; b < active; ++b) {
                a.delta[Layout::index(b, 0)] += momentum[K::active_index[b]];
                for (int j = 0; j < m; ++j) F[j * active + b] = a.delta[Layout::index(b, j)];
            }
            for (int c = 0; c < kappas; ++c) F[active * m + c] = a.delta[active * m + c];
        });
        return Status::ok;
    }

    // dR/dX, N x N, in the order of `residual`.
    Status jacobian(real time, const real* position, const real* momentum, const real* X, real* J) const {
        workspace.with([&](Arrays& a) {
            take_unknowns(position, X, a.Y);
            evaluate_nodes(time, position, momentum, a.Y, a);
            a.matrix.clear();
            assemble(a.H, entry_room, a.matrix);
            const auto index = [](int u, int j) { return u < active ? j * active + u : active * (m - 1) + u; };
            for (int i = 0; i < N * N; ++i) J[i] = real(0);
            for (int e = 0; e < K::entries; ++e) {
                const int u = Tables::block(K::entry_row[e]), v = Tables::block(K::entry_column[e]);
                if ((u >= active || v >= active) && kappas == 0) continue;
                for (int j = 0; j < (u < active ? m : 1); ++j)
                    for (int k = 0; k < (v < active ? m : 1); ++k)
                        J[index(u, j) * N + index(v, k)] = a.matrix(u, j, v, k);
            }
        });
        return Status::ok;
    }

    // One step from (q, p) at `time` and d(q1, p1)/d(q, p), 2n x 2n: J dY = -dR for each column.
    Status tangent(real time, const real* position, const real* momentum, real* q1, real* p1, real* T) const {
        if constexpr (K::has_tangent) {
            Stepper local = *this;
            Status status = local.start(time, position, momentum);
            if (status == Status::ok) status = local.step();
            if (status != Status::ok) return status;
            for (int k = 0; k < n; ++k) {
                q1[k] = local.q[k];
                p1[k] = local.p[k];
            }
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

    static void take_unknowns(const real* position, const real* X, real* Y_sorted) {
        for (int a = 0; a < active; ++a)
            for (int j = 0; j < m; ++j)
                Y_sorted[Layout::index(a, j)] = X[j * active + a] - position[K::active_index[a]];
        for (int c = 0; c < kappas; ++c) Y_sorted[active * m + c] = X[active * m + c];
    }

    // dz = T dX at node i, dX in the order of the solver.
    void apply_node_map(const real* dX, int i, real* dz) const {
        const real inverse_h = real(1) / step_size;
        for (int a = 0; a < active; ++a) {
            const real* const x = dX + Layout::index(a, 0);
            real v = real(0), moved = real(0);
            for (int j = 0; j < m; ++j) v += K::D[i * (m + 1) + j + 1] * x[j];
            if constexpr (nodal) {
                if (i > 0) moved = x[i - 1];
            } else {
                for (int j = 0; j < m; ++j) moved += K::B[i * (m + 1) + j + 1] * x[j];
            }
            dz[a] = v * inverse_h;
            dz[active + a] = moved;
        }
        for (int c = 0; c < cyclic; ++c)
            dz[2 * active + c] = kappas > 0 ? K::legendre_polynomial[i] * dX[active * m + c] : real(0);
    }

    void node_variables(const real* position, const real* momentum, const real* displacement, int i, real* z) const {
        apply_node_map(displacement, i, z);
        for (int a = 0; a < active; ++a) z[active + a] += position[K::active_index[a]];
        for (int c = 0; c < cyclic; ++c) z[2 * active + c] += momentum[K::cyclic_index[c]];
    }

    void evaluate_nodes(real time, const real* position, const real* momentum, const real* displacement,
                        Arrays& a) const {
        for (int i = 0; i < r; ++i) {
            node_variables(position, momentum, displacement, i, a.z + i * Z);
            Formulas<K>::node(coefficients, time + K::c[i] * step_size, a.z + i * Z, a.g + i * Z, a.H + i * entry_room);
        }
    }

    // sum_i h b_i T_i^T g_i in the order of the solver: the residual without p0.
    void sum_over_nodes(const real* g, real* sum) const {
        for (int a = 0; a < active; ++a)
            for (int j = 0; j < m; ++j) {
                real from_velocity = real(0), from_position = real(0);
                for (int i = 0; i < r; ++i) from_velocity += K::b[i] * K::D[i * (m + 1) + j] * g[i * Z + a];
                if constexpr (nodal) {
                    from_position = K::b[j] * g[j * Z + active + a];
                } else {
                    for (int i = 0; i < r; ++i)
                        from_position += K::b[i] * K::B[i * (m + 1) + j] * g[i * Z + active + a];
                }
                sum[Layout::index(a, j)] = from_velocity + step_size * from_position;
            }
        for (int c = 0; c < kappas; ++c) {
            real from_momentum = real(0);
            for (int i = 0; i < r; ++i)
                from_momentum += K::b[i] * K::legendre_polynomial[i] * g[i * Z + 2 * active + c];
            sum[active * m + c] = step_size * from_momentum;
        }
    }

    // h sum_i b_i g_i of one slot.
    real impulse(const real* g, int slot) const {
        real sum = real(0);
        for (int i = 0; i < r; ++i) sum += K::b[i] * g[i * Z + slot];
        return step_size * sum;
    }

    // The part of one entry of H in the Jacobian. H is that of the nodes, `stride` apart; 0: the same for all.
    template <Slot row, Slot column, class At>
    void assemble_entry(const real* H, int stride, int u, int v, At&& at) const {
        constexpr int rows = row == Slot::momentum ? 1 : m, columns = column == Slot::momentum ? 1 : m;
        constexpr int velocities = (row == Slot::velocity) + (column == Slot::velocity);
        const real power = velocities == 2 ? real(1) / step_size : velocities == 1 ? real(1) : step_size;
        const real* const products = node_products<K, row, column>.value;
        if constexpr (nodal && row == Slot::position && column == Slot::position) {
            for (int j = 1; j < m; ++j) at(u, j, v, j - 1) += power * K::b[j] * H[j * stride];
        } else if constexpr (nodal && row == Slot::position) {
            for (int j = 0; j < rows; ++j)
                for (int k = 0; k < columns; ++k)
                    at(u, j, v, k) += products[(j * columns + k) * r + j] * (power * H[j * stride]);
        } else if constexpr (nodal && column == Slot::position) {
            for (int j = 0; j < rows; ++j)
                for (int k = 0; k < columns; ++k)
                    at(u, j, v, k) += products[(j * columns + k) * r + k + 1] * (power * H[(k + 1) * stride]);
        } else {
            for (int j = 0; j < rows; ++j)
                for (int k = 0; k < columns; ++k) {
                    real sum = real(0);
                    for (int i = 0; i < r; ++i) sum += products[(j * columns + k) * r + i] * H[i * stride];
                    at(u, j, v, k) += power * sum;
                }
        }
    }

    template <Slot row, class At>
    void assemble_row(const real* H, int stride, int e, At&& at) const {
        const int u = Tables::block(K::entry_row[e]), v = Tables::block(K::entry_column[e]);
        switch (Tables::kind(K::entry_column[e])) {
            case Slot::velocity:
                assemble_entry<row, Slot::velocity>(H, stride, u, v, at);
                break;
            case Slot::position:
                assemble_entry<row, Slot::position>(H, stride, u, v, at);
                break;
            case Slot::momentum:
                if constexpr (kappas > 0) assemble_entry<row, Slot::momentum>(H, stride, u, v, at);
                break;
        }
    }

    // J = sum_i h b_i T_i^T H_i T_i into at(block, unknown; block, unknown), which begins at zero.
    template <class At>
    void assemble(const real* H, int stride, At&& at) const {
        for (int e = 0; e < K::entries; ++e) {
            switch (Tables::kind(K::entry_row[e])) {
                case Slot::velocity:
                    assemble_row<Slot::velocity>(H + e, stride, e, at);
                    break;
                case Slot::position:
                    assemble_row<Slot::position>(H + e, stride, e, at);
                    break;
                case Slot::momentum:
                    if constexpr (kappas > 0) assemble_row<Slot::momentum>(H + e, stride, e, at);
                    break;
            }
        }
    }

    // g += H dz at node i.
    static void carry(const real* H, const real* dz, real* g) {
        for (int e = 0; e < K::entries; ++e) g[K::entry_row[e]] += H[e] * dz[K::entry_column[e]];
    }

    // T's column of a variation: of the slot that it shifts at every node (-1: none), or of p0 of an active coordinate.
    void tangent_column(Arrays& a, int slot, int active_momentum, int column, real* T) const {
        real dz[Z > 0 ? Z : 1];
        const auto shift = [&](real* dg) {
            for (int k = 0; k < Z; ++k) dz[k] = k == slot ? real(1) : real(0);
            for (int k = 0; k < Z; ++k) dg[k] = real(0);
        };
        for (int i = 0; i < r; ++i) {
            shift(a.g + i * Z);
            carry(a.H + i * entry_room, dz, a.g + i * Z);
        }
        sum_over_nodes(a.g, a.delta);
        if (active_momentum >= 0) a.delta[Layout::index(active_momentum, 0)] += real(1);
        for (int i = 0; i < N; ++i) a.delta[i] = -a.delta[i];
        a.matrix.solve(a.delta);
        for (int i = 0; i < r; ++i) {
            apply_node_map(a.delta, i, dz);
            carry(a.H + i * entry_room, dz, a.g + i * Z);
        }
        for (int b = 0; b < active; ++b) {
            T[K::active_index[b] * 2 * n + column] += a.delta[Layout::index(b, m - 1)];
            T[(n + K::active_index[b]) * 2 * n + column] += impulse(a.g, active + b);
        }
        for (int c = 0; c < cyclic; ++c) T[K::cyclic_index[c] * 2 * n + column] -= impulse(a.g, 2 * active + c);
    }

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
                change = fabs(a.delta[i]) > change ? fabs(a.delta[i]) : change;
                size = fabs(a.Y[i]) > size ? fabs(a.Y[i]) : size;
            }
            if (change > e * size) e = change / size;
        }
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

    // Newton's iteration. Convergence is quadratic, e_next = C e^2, so it stops as soon as the NEXT increment would be
    // below rounding; the slopes are then carried to first order, which errs by the same e^2.
    Status newton(Arrays& a) {
        constexpr real last = Limits<real>::root_epsilon;
        real previous = Limits<real>::largest;
        for (int iteration = 1; iteration <= iteration_limit; ++iteration) {
            evaluate_nodes(this->time(), q, p, a.Y, a);
            if (iteration == 1) scale_kappas(a);
            if (!is_finite(not_finite_part(a.g, r * Z))) return Status::not_finite;
            a.matrix.clear();
            assemble(a.H, entry_room, a.matrix);
            if (!a.matrix.factor())
                return is_finite(not_finite_part(a.H, r * entry_room)) ? Status::singular_jacobian : Status::not_finite;
            const real e = apply_increment(a.matrix, a);
            increment = e;
            if (!is_finite(e)) return Status::not_finite;
            if (e <= last ||
                (iteration > 1 && e < previous && (e / previous) * (e / previous) * e <= Limits<real>::epsilon) ||
                (iteration > 2 && e >= real(0.5) * previous && is_rounding(a))) {
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
        for (int i = 0; i < N; ++i) rounding[i] *= a.delta[i] < real(0) ? real(-1) : real(1);
        a.matrix.solve(rounding);
        real most = real(0), largest = real(0);
        for (int i = 0; i < N; ++i) {
            most = fabs(rounding[i]) > most ? fabs(rounding[i]) : most;
            largest = fabs(a.delta[i]) > largest ? fabs(a.delta[i]) : largest;
        }
        return largest <= real(64) * Limits<real>::epsilon * most;
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
