// SPDX-License-Identifier: GPL-2.0-or-later
// The variational integrator of a system: discrete Lagrangian, discrete Euler-Lagrange equations, momenta, Jacobian
// (docs/derivation.md).
//
// Assembled from one node's momentum and force, or M, grad V and V'', by the sums of the derivation; generator/check
// differentiates L_d itself and compares.
#include "generator/mechanics/discretisation.hpp"

#include <string>

namespace lobatto {

namespace {

using GiNaC::ex;
using Symbols = std::vector<GiNaC::symbol>;

unsigned at(std::size_t index) {
    return static_cast<unsigned>(index);
}

class Assembler {
public:
    Assembler(const System& system, const Quadrature& quadrature)
        : system_(system),
          quadrature_(quadrature),
          n_(static_cast<std::size_t>(system.n)),
          controls_(quadrature.control.size()),
          s_(quadrature.c.size()) {
        name_symbols();
    }

    Discretisation run() {
        if (system_.separable)
            separable_action();
        else
            general_action();
        if (system_.separable) {
            inverse_mass_ = system_.mass.dense().inverse();
            if (quadrature_.method.family != Family::gauss) full_system();
            reduced_system();
        }
        return std::move(d_);
    }

private:
    void name_symbols() {
        const auto named = [&](std::size_t k, std::size_t i, const std::string& mark) {
            return GiNaC::symbol(system_.q[k].get_name() + mark + "_" + std::to_string(i));
        };
        const auto rows = [&](std::size_t count, const std::string& mark) {
            std::vector<Symbols> symbols(count);
            for (std::size_t i = 0; i < count; ++i)
                for (std::size_t k = 0; k < n_; ++k) symbols[i].push_back(named(k, i, mark));
            return symbols;
        };
        d_.Q = rows(controls_, "");
        d_.Q_before = rows(controls_ - 1, "_before");
        d_.Q_before.push_back(d_.Q[0]);
        if (system_.separable && quadrature_.method.family == Family::gauss) {
            d_.Y = rows(s_, "_stage");
            d_.Y.front() = d_.Q.front();
            d_.Y.back() = d_.Q.back();
        } else if (system_.separable) {
            d_.Y = d_.Q;
        }
        for (std::size_t k = 0; k < n_; ++k) {
            d_.p0.emplace_back("p_" + system_.q[k].get_name() + "_0");
            d_.p1.emplace_back("p_" + system_.q[k].get_name() + "_1");
        }
    }

    // One node's quantities: expressions in q, v and t, moved to quadrature node i of the path through the positions
    // Q; the step begins at time `begin` (D28).
    GiNaC::exmap node(std::size_t i, const std::vector<Symbols>& Q, const ex& begin) const {
        GiNaC::exmap move{{system_.t, begin + quadrature_.nodes[i] * d_.h}};
        for (std::size_t k = 0; k < n_; ++k) {
            ex position = 0, rise = 0;
            for (std::size_t j = 0; j < controls_; ++j) {
                position += quadrature_.B(at(i), at(j)) * Q[j][k];
                if (!system_.separable) rise += quadrature_.D(at(i), at(j)) * Q[j][k];
            }
            move[system_.q[k]] = position;
            if (!system_.separable) move[system_.v[k]] = rise / d_.h;
        }
        return move;
    }
    static ex moved(const ex& expression, const GiNaC::exmap& move) {
        return expression.subs(move, GiNaC::subs_options::no_pattern);
    }

    // L_d = h sum_i b_i L(q_i, v_i, t_i), and its slopes sum_i h b_i (D_ij/h p(i) + B_ij f(i)) (D30).
    void general_action() {
        const ex h = d_.h;
        d_.L_d = 0;
        for (std::size_t i = 0; i < quadrature_.nodes.size(); ++i)
            d_.L_d += h * quadrature_.weights[i] * moved(system_.lagrangian, node(i, d_.Q, d_.t0));
        equations([&](std::size_t j, std::size_t k, const std::vector<Symbols>& Q, const ex& begin) {
            ex sum = 0;
            for (std::size_t i = 0; i < quadrature_.nodes.size(); ++i) {
                const GiNaC::exmap move = node(i, Q, begin);
                const ex D = quadrature_.D(at(i), at(j)), B = quadrature_.B(at(i), at(j));
                if (!D.is_zero()) sum += quadrature_.weights[i] * D * moved(system_.momentum[k], move);
                if (!B.is_zero()) sum += h * quadrature_.weights[i] * B * moved(system_.force[k], move);
            }
            return sum;
        });
    }

    // (D4) L_d = 1/(2h) sum_ij K_ij Q_i^T M Q_j - h sum_i b_i V(q_i);
    // (D5) dL_d/dQ_j = (1/h) sum_i K_ji M Q_i - h sum_i b_i B_ij grad V(q_i)
    void separable_action() {
        const ex h = d_.h;
        d_.L_d = 0;
        for (std::size_t i = 0; i < controls_; ++i)
            for (std::size_t j = 0; j < controls_; ++j)
                for (const auto& [place, M] : system_.mass.entries())
                    d_.L_d += quadrature_.K(at(i), at(j)) * M * d_.Q[i][static_cast<std::size_t>(place.first)] *
                              d_.Q[j][static_cast<std::size_t>(place.second)] / (2 * h);
        for (std::size_t i = 0; i < quadrature_.nodes.size(); ++i)
            d_.L_d -= h * quadrature_.weights[i] * moved(system_.potential, node(i, d_.Q, d_.t0));
        equations([&](std::size_t j, std::size_t k, const std::vector<Symbols>& Q, const ex& begin) {
            ex sum = 0;
            for (std::size_t i = 0; i < controls_; ++i)
                for (std::size_t l = 0; l < n_; ++l)
                    sum += quadrature_.K(at(j), at(i)) * system_.mass(k, l) * Q[i][l] / h;
            for (std::size_t i = 0; i < quadrature_.nodes.size(); ++i)
                if (const ex B = quadrature_.B(at(i), at(j)); !B.is_zero())
                    sum -= h * quadrature_.weights[i] * B * moved(system_.gradient[k], node(i, Q, begin));
            return sum;
        });
    }

    // Interior equations, momenta (D6, D7) and border equations (D8) from slope(j, k, positions, start of the step).
    template <class Slope>
    void equations(const Slope& slope) {
        const std::size_t last = controls_ - 1;
        for (std::size_t j = 1; j < last; ++j) {
            d_.interior.emplace_back();
            for (std::size_t k = 0; k < n_; ++k) d_.interior.back().push_back(slope(j, k, d_.Q, d_.t0));
        }
        for (std::size_t k = 0; k < n_; ++k) {
            const ex left = slope(0, k, d_.Q, d_.t0);
            d_.left_momentum.push_back(-left);
            d_.right_momentum.push_back(slope(last, k, d_.Q, d_.t0));
            d_.border.push_back(slope(last, k, d_.Q_before, d_.t0 - d_.h) + left);
        }
    }

    // Of separable systems, at node i of the list with both ends.
    GiNaC::exmap stage(std::size_t i) const {
        GiNaC::exmap move{{system_.t, d_.t0 + quadrature_.c[i] * d_.h}};
        for (std::size_t k = 0; k < n_; ++k) move[system_.q[k]] = d_.Y[i][k];
        return move;
    }
    ex gradient(std::size_t i, std::size_t k) const { return moved(system_.gradient[k], stage(i)); }
    ex second(std::size_t i, std::size_t k, std::size_t l) const { return moved(system_.hessian(k, l), stage(i)); }
    ex W(std::size_t i, std::size_t k) const {  // (M^-1 grad V)_k
        ex sum = 0;
        for (std::size_t l = 0; l < n_; ++l) sum += inverse_mass_(at(k), at(l)) * gradient(i, l);
        return sum;
    }
    ex S(std::size_t i, std::size_t k, std::size_t l) const {  // (M^-1 V'')_kl
        ex sum = 0;
        for (std::size_t r = 0; r < n_; ++r) sum += inverse_mass_(at(k), at(r)) * second(i, r, l);
        return sum;
    }

    // (D9) the full system in solved form, and (D10) its Jacobian.
    void full_system() {
        const std::vector<ex>&c = quadrature_.c, &b = quadrature_.b;
        const GiNaC::matrix& G = quadrature_.G;
        const std::size_t n = n_, s = s_, m = s - 2;
        const ex h = d_.h;
        for (std::size_t i = 0; i < m; ++i)
            for (std::size_t k = 0; k < n; ++k) {
                ex equation = d_.Q[i + 1][k] - (1 - c[i + 1]) * d_.Q[0][k] - c[i + 1] * d_.Q[s - 1][k];
                for (std::size_t j = 0; j < m; ++j) equation -= h * h * G(at(i), at(j)) * b[j + 1] * W(j + 1, k);
                d_.full_system.push_back(equation);
                d_.full_unknowns.push_back(d_.Q[i + 1][k]);
            }
        for (std::size_t k = 0; k < n; ++k) {
            ex equation = d_.p1[k] - d_.p0[k];
            for (std::size_t i = 0; i < s; ++i) equation += h * b[i] * gradient(i, k);
            d_.full_system.push_back(equation);
            d_.full_unknowns.push_back(d_.p1[k]);
        }
        for (std::size_t k = 0; k < n; ++k) {
            ex equation = d_.Q[s - 1][k] - d_.Q[0][k];
            for (std::size_t l = 0; l < n; ++l) equation -= h / 2 * inverse_mass_(at(k), at(l)) * (d_.p0[l] + d_.p1[l]);
            for (std::size_t i = 0; i < s; ++i) equation -= h * h * b[i] * (c[i] - GiNaC::numeric(1, 2)) * W(i, k);
            d_.full_system.push_back(equation);
            d_.full_unknowns.push_back(d_.Q[s - 1][k]);
        }
        GiNaC::matrix& J = d_.full_jacobian;
        J = GiNaC::matrix(at(n * s), at(n * s));
        for (std::size_t k = 0; k < n; ++k) {
            // rows; the columns are in the same order
            const std::size_t momentum = n * m + k, position = n * (m + 1) + k;
            J(at(momentum), at(momentum)) = 1;
            J(at(position), at(position)) = 1;
            for (std::size_t i = 0; i < m; ++i) {
                J(at(i * n + k), at(i * n + k)) = 1;
                J(at(i * n + k), at(position)) = -c[i + 1];
            }
            for (std::size_t l = 0; l < n; ++l) {
                J(at(position), at(n * m + l)) = -h / 2 * inverse_mass_(at(k), at(l));
                for (std::size_t j = 1; j < s; ++j) {
                    const unsigned column = at(j + 1 < s ? (j - 1) * n + l : n * (m + 1) + l);
                    const ex entry = S(j, k, l);
                    J(at(momentum), column) += h * b[j] * second(j, k, l);
                    J(at(position), column) -= h * h * b[j] * (c[j] - GiNaC::numeric(1, 2)) * entry;
                    if (j + 1 < s)
                        for (std::size_t i = 0; i < m; ++i)
                            J(at(i * n + k), column) -= h * h * G(at(i), at(j - 1)) * b[j] * entry;
                }
            }
        }
    }

    // (D11) v = M^-1 (p0 - h b_0 grad V(q0));  (D12) the reduced system;  (D13) its Jacobian;  (D16, D17) arrival.
    void reduced_system() {
        const std::vector<ex>&c = quadrature_.c, &b = quadrature_.b;
        const GiNaC::matrix& A = quadrature_.A;
        const std::size_t n = n_, s = s_, m = s - 2;
        const ex h = d_.h;
        for (std::size_t k = 0; k < n; ++k) {
            ex v = -h * b[0] * W(0, k);
            for (std::size_t l = 0; l < n; ++l) v += inverse_mass_(at(k), at(l)) * d_.p0[l];
            d_.drift_velocity.push_back(v);
        }
        for (std::size_t i = 0; i < m; ++i)
            for (std::size_t k = 0; k < n; ++k) {
                ex equation = d_.Y[i + 1][k] - d_.Q[0][k] - h * c[i + 1] * d_.drift_velocity[k];
                for (std::size_t j = 0; j < m; ++j) equation += h * h * A(at(i), at(j)) * W(j + 1, k);
                d_.reduced_system.push_back(equation);
            }
        GiNaC::matrix& J = d_.reduced_jacobian;
        J = GiNaC::matrix(at(n * m), at(n * m));
        for (std::size_t j = 0; j < m; ++j)
            for (std::size_t k = 0; k < n; ++k) {
                J(at(j * n + k), at(j * n + k)) += 1;
                for (std::size_t l = 0; l < n; ++l) {
                    const ex entry = S(j + 1, k, l);
                    for (std::size_t i = 0; i < m; ++i)
                        J(at(i * n + k), at(j * n + l)) += h * h * A(at(i), at(j)) * entry;
                }
            }
        for (std::size_t k = 0; k < n; ++k) {
            ex position = d_.Q[0][k] + h * d_.drift_velocity[k];
            ex momentum = d_.p0[k];
            for (std::size_t j = 1; j + 1 < s; ++j) position -= h * h * b[j] * (1 - c[j]) * W(j, k);
            for (std::size_t j = 0; j < s; ++j) momentum -= h * b[j] * gradient(j, k);
            d_.arrival_position.push_back(position);
            d_.arrival_momentum.push_back(momentum);
        }
    }

    const System& system_;
    const Quadrature& quadrature_;
    const std::size_t n_, controls_, s_;
    Discretisation d_;
    GiNaC::matrix inverse_mass_;
};

}  // namespace

Discretisation discretise(const System& system, const Quadrature& quadrature) {
    return Assembler(system, quadrature).run();
}

bool is_written_out(const System& system, const Quadrature& quadrature) {
    return system.n * static_cast<int>(quadrature.control.size()) <= written_out_limit;
}

}  // namespace lobatto
