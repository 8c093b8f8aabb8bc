// SPDX-License-Identifier: GPL-2.0-or-later
// The variational integrator of a system: discrete Lagrangian, discrete Euler-Lagrange equations, momenta, Jacobian
// (docs/derivation.md).
//
// Assembled from one node's V, grad V and V'' by the sums of the derivation; generator/check differentiates L_d itself
// and compares.
#include "generator/discretisation.hpp"

#include <string>

namespace lobatto {

namespace {

using GiNaC::ex;

std::string node_name(const System& system, std::size_t k, std::size_t i, const std::string& mark) {
    return system.q[k].get_name() + mark + "_" + std::to_string(i);
}

}  // namespace

Discretisation discretise(const System& system, const Quadrature& quadrature) {
    Discretisation d;
    const std::size_t n = static_cast<std::size_t>(system.n), s = static_cast<std::size_t>(quadrature.points),
                      m = s - 2;
    const std::vector<ex>&c = quadrature.c, &b = quadrature.b;
    const ex h = d.h;

    for (std::size_t i = 0; i < s; ++i) {
        d.Q.emplace_back();
        for (std::size_t k = 0; k < n; ++k) d.Q[i].emplace_back(node_name(system, k, i, ""));
    }
    for (std::size_t i = 0; i + 1 < s; ++i) {
        d.Q_before.emplace_back();
        for (std::size_t k = 0; k < n; ++k) d.Q_before[i].emplace_back(node_name(system, k, i, "_before"));
    }
    d.Q_before.push_back(d.Q[0]);
    for (std::size_t k = 0; k < n; ++k) {
        d.p0.emplace_back("p_" + system.q[k].get_name() + "_0");
        d.p1.emplace_back("p_" + system.q[k].get_name() + "_1");
    }

    // One node's quantities: an expression in q, moved to the node.
    const auto at = [&](const ex& expression, const std::vector<GiNaC::symbol>& position) {
        GiNaC::exmap move;
        for (std::size_t k = 0; k < n; ++k) move[system.q[k]] = position[k];
        return expression.subs(move, GiNaC::subs_options::no_pattern);
    };
    const auto gradient = [&](std::size_t i, std::size_t k) { return at(system.gradient[k], d.Q[i]); };
    const auto M = [&](std::size_t k, std::size_t l) {
        return system.mass(static_cast<unsigned>(k), static_cast<unsigned>(l));
    };
    const GiNaC::matrix inverse_mass = system.mass.dense().inverse();
    const auto W = [&](std::size_t i, std::size_t k) {  // (M^-1 grad V)_k at node i
        ex sum = 0;
        for (std::size_t l = 0; l < n; ++l)
            sum += inverse_mass(static_cast<unsigned>(k), static_cast<unsigned>(l)) * gradient(i, l);
        return sum;
    };
    const auto K = [&](std::size_t i, std::size_t j) {
        return quadrature.K(static_cast<unsigned>(i), static_cast<unsigned>(j));
    };
    const auto A = [&](std::size_t i, std::size_t j) {
        return quadrature.A(static_cast<unsigned>(i), static_cast<unsigned>(j));
    };
    const auto G = [&](std::size_t i, std::size_t j) {
        return quadrature.G(static_cast<unsigned>(i), static_cast<unsigned>(j));
    };

    // (D4) L_d = 1/(2h) sum_ij K_ij Q_i^T M Q_j - h sum_i b_i V(Q_i)
    d.L_d = 0;
    for (std::size_t i = 0; i < s; ++i)
        for (std::size_t j = 0; j < s; ++j)
            for (std::size_t k = 0; k < n; ++k)
                for (std::size_t l = 0; l < n; ++l) d.L_d += K(i, j) * M(k, l) * d.Q[i][k] * d.Q[j][l] / (2 * h);
    for (std::size_t i = 0; i < s; ++i) d.L_d -= h * b[i] * at(system.potential, d.Q[i]);

    // (D5) dL_d/dQ_j = (1/h) sum_i K_ji M Q_i - h b_j grad V(Q_j)
    const auto slope = [&](std::size_t j, std::size_t k, const std::vector<std::vector<GiNaC::symbol>>& Q) {
        ex sum = 0;
        for (std::size_t i = 0; i < s; ++i)
            for (std::size_t l = 0; l < n; ++l) sum += K(j, i) * M(k, l) * Q[i][l] / h;
        return ex(sum - h * b[j] * at(system.gradient[k], Q[j]));
    };
    for (std::size_t j = 1; j + 1 < s; ++j) {
        d.interior.emplace_back();
        for (std::size_t k = 0; k < n; ++k) d.interior.back().push_back(slope(j, k, d.Q));
    }
    for (std::size_t k = 0; k < n; ++k) {
        d.left_momentum.push_back(-slope(0, k, d.Q));                        // (D6)
        d.right_momentum.push_back(slope(s - 1, k, d.Q));                    // (D7)
        d.border.push_back(slope(s - 1, k, d.Q_before) + slope(0, k, d.Q));  // (D8)
    }

    // (D9) the full system in solved form, and (D10) its Jacobian.
    for (std::size_t i = 0; i < m; ++i)
        for (std::size_t k = 0; k < n; ++k) {
            ex equation = d.Q[i + 1][k] - (1 - c[i + 1]) * d.Q[0][k] - c[i + 1] * d.Q[s - 1][k];
            for (std::size_t j = 0; j < m; ++j) equation -= h * h * G(i, j) * b[j + 1] * W(j + 1, k);
            d.full_system.push_back(equation);
            d.full_unknowns.push_back(d.Q[i + 1][k]);
        }
    for (std::size_t k = 0; k < n; ++k) {
        ex equation = d.p1[k] - d.p0[k];
        for (std::size_t i = 0; i < s; ++i) equation += h * b[i] * gradient(i, k);
        d.full_system.push_back(equation);
        d.full_unknowns.push_back(d.p1[k]);
    }
    for (std::size_t k = 0; k < n; ++k) {
        ex equation = d.Q[s - 1][k] - d.Q[0][k];
        for (std::size_t l = 0; l < n; ++l)
            equation -= h / 2 * inverse_mass(static_cast<unsigned>(k), static_cast<unsigned>(l)) * (d.p0[l] + d.p1[l]);
        for (std::size_t i = 0; i < s; ++i) equation -= h * h * b[i] * (c[i] - GiNaC::numeric(1, 2)) * W(i, k);
        d.full_system.push_back(equation);
        d.full_unknowns.push_back(d.Q[s - 1][k]);
    }
    const auto index = [](std::size_t i) { return static_cast<unsigned>(i); };
    const auto second = [&](std::size_t i, std::size_t k, std::size_t l) {  // V'' at node i
        return at(system.hessian(index(k), index(l)), d.Q[i]);
    };
    const auto S = [&](std::size_t i, std::size_t k, std::size_t l) {  // (M^-1 V'')_kl at node i
        ex sum = 0;
        for (std::size_t r = 0; r < n; ++r) sum += inverse_mass(index(k), index(r)) * second(i, r, l);
        return sum;
    };
    d.full_jacobian = GiNaC::matrix(index(n * s), index(n * s));
    for (std::size_t k = 0; k < n; ++k) {
        const std::size_t momentum = n * m + k, position = n * (m + 1) + k;  // rows; the columns are in the same order
        d.full_jacobian(index(momentum), index(momentum)) = 1;
        d.full_jacobian(index(position), index(position)) = 1;
        for (std::size_t i = 0; i < m; ++i) {
            d.full_jacobian(index(i * n + k), index(i * n + k)) = 1;
            d.full_jacobian(index(i * n + k), index(position)) = -c[i + 1];
        }
        for (std::size_t l = 0; l < n; ++l) {
            d.full_jacobian(index(position), index(n * m + l)) = -h / 2 * inverse_mass(index(k), index(l));
            for (std::size_t j = 1; j < s; ++j) {
                const unsigned column = index(j + 1 < s ? (j - 1) * n + l : n * (m + 1) + l);
                const ex entry = S(j, k, l);
                d.full_jacobian(index(momentum), column) += h * b[j] * second(j, k, l);
                d.full_jacobian(index(position), column) -= h * h * b[j] * (c[j] - GiNaC::numeric(1, 2)) * entry;
                if (j + 1 < s)
                    for (std::size_t i = 0; i < m; ++i)
                        d.full_jacobian(index(i * n + k), column) -= h * h * G(i, j - 1) * b[j] * entry;
            }
        }
    }

    // (D11) v = M^-1 (p0 - h b_0 grad V(q0));  (D12) the reduced system;  (D13) its Jacobian;  (D16, D17) arrival.
    for (std::size_t k = 0; k < n; ++k) {
        ex v = -h * b[0] * W(0, k);
        for (std::size_t l = 0; l < n; ++l)
            v += inverse_mass(static_cast<unsigned>(k), static_cast<unsigned>(l)) * d.p0[l];
        d.drift_velocity.push_back(v);
    }
    for (std::size_t i = 0; i < m; ++i)
        for (std::size_t k = 0; k < n; ++k) {
            ex equation = d.Q[i + 1][k] - d.Q[0][k] - h * c[i + 1] * d.drift_velocity[k];
            for (std::size_t j = 0; j < m; ++j) equation += h * h * A(i, j) * W(j + 1, k);
            d.reduced_system.push_back(equation);
        }
    d.reduced_jacobian = GiNaC::matrix(index(n * m), index(n * m));
    for (std::size_t j = 0; j < m; ++j)
        for (std::size_t k = 0; k < n; ++k) {
            d.reduced_jacobian(index(j * n + k), index(j * n + k)) += 1;
            for (std::size_t l = 0; l < n; ++l) {
                const ex entry = S(j + 1, k, l);
                for (std::size_t i = 0; i < m; ++i)
                    d.reduced_jacobian(index(i * n + k), index(j * n + l)) += h * h * A(i, j) * entry;
            }
        }
    for (std::size_t k = 0; k < n; ++k) {
        ex position = d.Q[0][k] + h * d.drift_velocity[k];
        ex momentum = d.p0[k];
        for (std::size_t j = 1; j + 1 < s; ++j) position -= h * h * b[j] * (1 - c[j]) * W(j, k);
        for (std::size_t j = 0; j < s; ++j) momentum -= h * b[j] * gradient(j, k);
        d.arrival_position.push_back(position);
        d.arrival_momentum.push_back(momentum);
    }
    return d;
}

}  // namespace lobatto
