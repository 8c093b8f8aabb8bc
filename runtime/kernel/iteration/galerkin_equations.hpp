// SPDX-License-Identifier: MIT
// The Galerkin equations of one step of any Lagrangian system, assembled from one node's derivatives.
//
// Of the n coordinates n_a are active (active_index[]); the others are cyclic (cyclic_index[]), and their momenta P are
// conserved. Control points 0 = x_0 < ... < x_m = 1 carry the positions X_j of the active ones; X_0 is the start, X_m
// the end. Nodes c_i with weights b_i, i = 1 ... r, are where the Lagrangian is looked at, at time t + c_i h:
//     v_i = (1/h) sum_j D_ij X_j,   q_i = sum_j B_ij X_j,   P_i = P + kappa pi(c_i),
//     D_ij = l_j'(c_i),             B_ij = l_j(c_i),
// with pi the shifted Legendre polynomial of degree r - 1 for Lobatto's nodes, where the conserved momenta are so only
// in the mean, and nothing for Gauss's. z = (v, q, P), R(z) = L - P . v_c with the cyclic velocities v_c eliminated, F
// the forces, g = (R_v, R_q + F, R_P = -v_c), and H its derivative:
//     sum_i h b_i [ (D_ij / h) g_v(i) + B_ij g_q(i) ] + delta_j0 p0 = 0,  j = 0 ... m - 1,
//     sum_i h b_i pi_i g_P(i) = 0,
//     q1 = X_m,  p1 = p0 + h sum_i b_i g_q(i)  (the sum over all j, because sum_j l_j = 1),
//     P1 = P,  cyclic positions + h sum_i b_i v_c(i).
// The unknowns are the displacements Y_j = X_j - X_0, j = 1 ... m, and kappa.
//
// Constraints phi(q, t) = 0, G = dphi/dq, add L + phi . Lambda, where Lambda_i belongs to node i and control points are
// nodes (Lobatto; D45): z and g have one slot more for each, the multiplier and phi itself. Their equations and
// unknowns are those of one more block each,
//     phi(X_j, t + x_j h) = 0, j = 1 ... m;  Lambda_0 ... Lambda_(m - 1);
// Lambda_m follows from the momentum at the end (iteration/velocity_of_momentum.hpp).
//
// A kernel of this form provides: active, cyclic and their tables; nodes (r), controls (m + 1), c, b, control, B, D,
// extrapolation (l_k(1 + x_j)), legendre_polynomial (pi_i, all zero for Gauss); for fixed-point iterations integration
// (A, over the polynomials on the nodes), reach (the same to the control points), ahead (those polynomials at 1 + c_i)
// and stage(k, q, velocity, Lv, Lq, M); the tables of base/grouped.hpp for the active coordinates; node(k, z, g, H),
// slope(k, z, g); entries, entry_row, entry_column of H;
// legendre(k, q, velocity, p, M), mass_entries, mass_row, mass_column; momentum(k, q, velocity, p);
// energy(k, q, velocity); slopes(k, q, velocity, Lv, Lq), dL/dv and dL/dq + F over all coordinates.
#ifndef LOBATTO_KERNEL_GALERKIN_EQUATIONS_HPP
#define LOBATTO_KERNEL_GALERKIN_EQUATIONS_HPP

#include <type_traits>

#include "../base/contract.hpp"
#include "../base/dense.hpp"
#include "../base/numbers.hpp"

namespace lobatto {

// The kinds of slots of z.
enum class Slot { velocity, position, momentum, multiplier };

// The tables of a kernel's nodes, in the sums that a step needs. Where a table has zeros is known to the compiler.
template <class K>
struct NodeTables {
    using real = typename K::real;
    static constexpr int active = K::active, cyclic = K::cyclic, constraints = K::constraints;
    static constexpr int blocks = active + constraints, Z = 2 * active + cyclic + constraints;
    static constexpr int r = K::nodes, m = K::controls - 1;
    static_assert(cyclic == 0 || constraints == 0, "with constraints all coordinates are active");

    static constexpr Slot kind(int slot) {
        return slot < active                ? Slot::velocity
               : slot < 2 * active          ? Slot::position
               : slot < 2 * active + cyclic ? Slot::momentum
                                            : Slot::multiplier;
    }
    // The block of unknowns that a slot depends on: a coordinate, or after them a kappa or a multiplier.
    static constexpr int block(int slot) { return slot < active ? slot : slot - active; }

    // How many conserved momenta vary within a step.
    static constexpr int kappas() {
        for (int i = 0; i < r; ++i)
            if (K::legendre_polynomial[i] != real(0)) return cyclic;
        return 0;
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
template <class K, Slot row, Slot column, bool computed_at_start = is_many_digits<typename K::real>>
constexpr NodeProducts<K, row, column> node_products{};
template <class K, Slot row, Slot column>  // MPFR is no part of the compiler
inline const NodeProducts<K, row, column> node_products<K, row, column, true>{};

// A motion with the equations of its steps. What is marked `solver` is in the order of the unknowns that Layout has.
template <class K>
struct GalerkinEquations : Motion<K> {
    using typename Motion<K>::real;
    using Motion<K>::n, Motion<K>::coefficients, Motion<K>::step_size;
    using Tables = NodeTables<K>;
    static constexpr int active = K::active, cyclic = K::cyclic, Z = Tables::Z, r = Tables::r, m = Tables::m;
    static constexpr int constraints = Tables::constraints, blocks = Tables::blocks;
    static constexpr int kappas = Tables::kappas();
    static constexpr bool nodal = Tables::is_nodal();
    static_assert(nodal || constraints == 0, "constraints hold at control points, and multipliers belong to nodes");
    static constexpr int N = blocks * m + kappas;
    static constexpr int nodes = K::nodes;
    static constexpr int room = N > 0 ? N : 1, entry_room = K::entries > 0 ? K::entries : 1;
    static constexpr int cyclic_room = cyclic > 0 ? cyclic : 1, mass_room = K::mass_entries > 0 ? K::mass_entries : 1;

    struct NoUnknowns {  // nothing to solve
        template <class>
        struct Matrix {
            void clear() {}
            bool factor() { return true; }
            void solve(real*) const {}
        };
    };
    using Layout = LayoutOf<K, blocks, m, kappas>;
    using Matrix = typename std::conditional_t<(N > 0), Layout, NoUnknowns>::template Matrix<real>;
    struct Arrays {
        real Y[room], delta[room], kappa_scale[cyclic_room];
        real z[r * Z], g[r * Z], H[r * entry_room];
        real q1[n], p1[n];
        Matrix matrix;
    };

    real p[n]{};  // momentum
    Workspace<Arrays> workspace;

    // R at the positions X of the control points 1 ... m, control-major, and kappa; rows j * n_a + a, then kappa's.
    // With constraints Lambda_(j - 1) follows each X_j, and phi(X_j) each row.
    Status residual(real time, const real* position, const real* momentum, const real* X, real* F) const {
        workspace.with([&](Arrays& a) {
            take_unknowns(position, X, a.Y);
            for (int i = 0; i < r; ++i) {
                node_variables(position, momentum, a.Y, i, a.z + i * Z);
                Formulas<K>::slope(coefficients, time + K::c[i] * step_size, a.z + i * Z, a.g + i * Z);
            }
            sum_over_nodes(a.g, a.delta);
            for (int b = 0; b < active; ++b) a.delta[Layout::index(b, 0)] += momentum[K::active_index[b]];
            for (int b = 0; b < blocks; ++b)
                for (int j = 0; j < m; ++j) F[j * blocks + b] = a.delta[Layout::index(b, j)];
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
            const auto index = [](int u, int j) { return u < blocks ? j * blocks + u : blocks * (m - 1) + u; };
            for (int i = 0; i < N * N; ++i) J[i] = real(0);
            for (int e = 0; e < K::entries; ++e) {
                const int u = Tables::block(K::entry_row[e]), v = Tables::block(K::entry_column[e]);
                if ((u >= blocks || v >= blocks) && kappas == 0) continue;
                for (int j = 0; j < (u < blocks ? m : 1); ++j)
                    for (int k = 0; k < (v < blocks ? m : 1); ++k)
                        J[index(u, j) * N + index(v, k)] = a.matrix(u, j, v, k);
            }
        });
        return Status::ok;
    }

protected:
    static void take_unknowns(const real* position, const real* X, real* Y_sorted) {
        for (int a = 0; a < active; ++a)
            for (int j = 0; j < m; ++j)
                Y_sorted[Layout::index(a, j)] = X[j * blocks + a] - position[K::active_index[a]];
        for (int c = active; c < blocks; ++c)
            for (int j = 0; j < m; ++j) Y_sorted[Layout::index(c, j)] = X[j * blocks + c];
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
        for (int c = active; c < blocks; ++c) dz[active + c] = i < m ? dX[Layout::index(c, i)] : real(0);
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
    LOBATTO_APART void sum_over_nodes(const real* g, real* sum) const {
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
        for (int c = active; c < blocks; ++c)
            for (int j = 0; j < m; ++j) sum[Layout::index(c, j)] = g[(j + 1) * Z + active + c];
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
            case Slot::multiplier:  // of dL/dq + G^T Lambda
                if constexpr (constraints > 0)
                    for (int j = 0; j < m; ++j) at(u, j, v, j) += step_size * K::b[j] * H[j * stride];
                break;
        }
    }

    // J = sum_i h b_i T_i^T H_i T_i into at(block, unknown; block, unknown), which begins at zero.
    template <class At>
    LOBATTO_APART void assemble(const real* H, int stride, At& at) const {
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
                case Slot::multiplier:  // of phi: an entry of G
                    if constexpr (constraints > 0)
                        for (int j = 0; j < m; ++j)
                            at(Tables::block(K::entry_row[e]), j, Tables::block(K::entry_column[e]), j) +=
                                H[e + (j + 1) * stride];
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
};

}  // namespace lobatto

#endif
