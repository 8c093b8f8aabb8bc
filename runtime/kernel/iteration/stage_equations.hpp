// SPDX-License-Identifier: MIT
// The equations of one step of a system with constant mass, as Newton's iteration and the tests take them: the stages
// (D11 ... D15), their Jacobian (D13) and the end of the step (D16, D17). docs/derivation.md derives them. Iterations
// over nodes have their own text of them: stage_map.hpp, fixed_point.hpp, ensemble_fixed_point.hpp, steppers/clean.hpp.
//
// Arrays are node-major: Q[i * n + k] is coordinate k at interior node i. W = M^-1 (grad V - F), S = dW/dq.
#ifndef LOBATTO_KERNEL_STAGE_EQUATIONS_HPP
#define LOBATTO_KERNEL_STAGE_EQUATIONS_HPP

#include "../base/contract.hpp"
#include "../base/dense.hpp"
#include "../base/numbers.hpp"
#include "stage_coefficients.hpp"

namespace lobatto {

// Loops over nodes and coordinates with the kernel's tables c, b, A and E.
template <class K>
struct StageEquations {
    using real = typename K::real;
    static constexpr int n = K::coordinates, s = K::points, m = s - 2, N = n * m;
    using Layout = LayoutOf<K, n, (m > 0 ? m : 1)>;
    using Matrix = typename Layout::template Matrix<real>;
    real h;

    explicit StageEquations(real step_size) : h(step_size) {}

    // (D11) v = u - h b_1 W0 and base_i = q + h c_i v, i = 2 ... s.
    void drift(const real* q, const real* u, const real* W0, real* v, real* base) const {
        for (int k = 0; k < n; ++k) v[k] = u[k] - h * K::b[0] * W0[k];
        for (int i = 0; i < s - 1; ++i)
            for (int k = 0; k < n; ++k) base[i * n + k] = q[k] + h * K::c[i + 1] * v[k];
    }

    // (D14) Q_i = base_i - h^2 (sum_j A_ij) W0.
    void simple_start(const real* base, const real* W0, real* Q) const {
        for (int i = 0; i < m; ++i) {
            const real factor = h * h * stage_coefficients<K>.sum[i];
            for (int k = 0; k < n; ++k) Q[i * n + k] = base[i * n + k] - factor * W0[k];
        }
    }

    // (D15) Q_i = base_i - h^2 sum_j (A E)_ij W_before_j.
    void extrapolated_start(const real* base, const real* W_before, real* Q) const {
        for (int i = 0; i < m; ++i) {
            for (int k = 0; k < n; ++k) Q[i * n + k] = base[i * n + k];
            for (int j = 0; j < s; ++j) {
                const real factor = h * h * stage_coefficients<K>.before[i][j];
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
            const real factor = h * h * stage_coefficients<K>.map[m][j];
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

}  // namespace lobatto

#endif
