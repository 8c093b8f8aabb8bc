// SPDX-License-Identifier: GPL-2.0-or-later
// Gauss' nodes on [0, 1] with the matrices of collocation, computed in quadruple precision from Legendre's polynomials.
#pragma once

#include <array>

#include "bench/peers/number.hpp"

namespace lobatto::bench {

// P_0(2x - 1) ... P_s(2x - 1).
template <int s>
std::array<__float128, s + 1> shifted_legendre(__float128 x) {
    const __float128 z = 2 * x - 1;
    std::array<__float128, s + 1> P{1, z};
    for (int k = 1; k < s; ++k) P[k + 1] = ((2 * k + 1) * z * P[k] - k * P[k - 1]) / (k + 1);
    return P;
}

// Matrices are stored by columns: column j holds what f_j adds to each stage.
template <class real, int s>
struct GaussTable {
    using Matrix = std::array<std::array<real, s>, s>;
    std::array<real, s> c, b;  // nodes, weights
    std::array<real, s> beta;  // b_j (1 - c_j): q1 = q + h v + h^2 sum of beta_j a_j
    Matrix A;                  // a_ij = integral of l_j from 0 to c_i
    Matrix A2;                 // its square, for q'' = a(q)
    Matrix AE, A2E;            // times E, e_ij = l_j(1 + c_i): from the last step's f_j the start of the next iteration

    GaussTable() {
        using Quad = __float128;
        std::array<Quad, s> node, weight;
        for (int i = 0; i < s; ++i) {
            // Newton from Tricomi's approximation of the zeros.
            Quad x = (1 - std::cos(3.14159265358979323846 * (i + 0.75) / (s + 0.5))) / 2;
            for (int iteration = 0; iteration < 8; ++iteration) {
                const auto P = shifted_legendre<s>(x);
                x += 2 * x * (1 - x) * P[s] / (s * ((2 * x - 1) * P[s] - P[s - 1]));
            }
            const Quad last = shifted_legendre<s>(x)[s - 1];
            node[i] = x;
            weight[i] = 4 * x * (1 - x) / (Quad(s) * s * last * last);
        }
        // l_j(x) = b_j sum over k < s of (2k + 1) P_k(c_j) P_k(x); the integral of P_k is (P_{k+1} - P_{k-1})/(2 (2k +
        // 1)).
        std::array<std::array<Quad, s>, s> a, e;  // [i][j]
        for (int i = 0; i < s; ++i) {
            const auto here = shifted_legendre<s>(node[i]), beyond = shifted_legendre<s>(1 + node[i]);
            for (int j = 0; j < s; ++j) {
                const auto P = shifted_legendre<s>(node[j]);
                Quad integral = node[i], value = 1;
                for (int k = 1; k < s; ++k) {
                    integral += P[k] * (here[k + 1] - here[k - 1]) / 2;
                    value += (2 * k + 1) * P[k] * beyond[k];
                }
                a[i][j] = weight[j] * integral;
                e[i][j] = weight[j] * value;
            }
        }
        const auto product = [](const auto& left, const auto& right) {
            std::array<std::array<Quad, s>, s> result{};
            for (int i = 0; i < s; ++i)
                for (int j = 0; j < s; ++j)
                    for (int k = 0; k < s; ++k) result[i][j] += left[i][k] * right[k][j];
            return result;
        };
        const auto a2 = product(a, a), ae = product(a, e), a2e = product(a2, e);
        for (int j = 0; j < s; ++j) {
            c[j] = static_cast<real>(node[j]);
            b[j] = static_cast<real>(weight[j]);
            beta[j] = static_cast<real>(weight[j] * (1 - node[j]));
            for (int i = 0; i < s; ++i) {
                A[j][i] = static_cast<real>(a[i][j]);
                A2[j][i] = static_cast<real>(a2[i][j]);
                AE[j][i] = static_cast<real>(ae[i][j]);
                A2E[j][i] = static_cast<real>(a2e[i][j]);
            }
        }
    }
};

}  // namespace lobatto::bench
