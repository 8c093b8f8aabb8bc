// SPDX-License-Identifier: GPL-2.0-or-later
// The discrete action of one step and its slopes, in numbers of 60 digits.
#include "generator/check/discrete_action.hpp"

namespace lobatto {

DiscreteAction::DiscreteAction(const Derivation& derivation)
    : derivation_(derivation), system_(derivation.system), n_(static_cast<std::size_t>(system_.n)) {}

void DiscreteAction::begin(const cln::cl_R& time, const cln::cl_R& step) {
    t0_ = time;
    h_ = step;
    const Quadrature& quadrature = derivation_.quadrature;
    control_ = formulas_(quadrature.control);
    nodes_ = formulas_(quadrature.nodes);
    weights_ = formulas_(quadrature.weights);
    legendre_ = formulas_(quadrature.legendre);
    B_ = values_of(quadrature.B);
    is_straight_ = quadrature.is_explicit();
    if (!is_straight_) D_ = values_of(quadrature.D);
    lagrangian_ = formulas_.convert({system_.lagrangian});
    momentum_ = formulas_.convert(system_.momentum);
    force_ = formulas_.convert(system_.force);
    outer_force_ = formulas_.convert(system_.outer_force);
}

Numbers DiscreteAction::values_of(const GiNaC::matrix& matrix) {
    std::vector<GiNaC::ex> entries;
    for (unsigned i = 0; i < matrix.rows(); ++i)
        for (unsigned j = 0; j < matrix.cols(); ++j) entries.push_back(matrix(i, j));
    return formulas_(entries);
}
Numbers DiscreteAction::values_of(const Symbols& symbols) const {
    Numbers values;
    for (const auto& symbol : symbols) values.push_back(formulas_.get(symbol));
    return values;
}
void DiscreteAction::set(const Symbols& symbols, const Numbers& values) {
    for (std::size_t i = 0; i < symbols.size(); ++i) formulas_.set(symbols[i], values[i]);
}
// (D28); of straight paths positions alone.
void DiscreteAction::set_node(std::size_t i, const Path& X, const Symbols& q, const Symbols& v) {
    formulas_.set(system_.t, t0_ + nodes_[i] * h_);
    for (std::size_t k = 0; k < q.size(); ++k) {
        cln::cl_R position = 0, rise = 0;
        for (std::size_t j = 0; j < X.size(); ++j) {
            position = position + B(i, j) * X[j][k];
            if (!is_straight_) rise = rise + D(i, j) * X[j][k];
        }
        formulas_.set(q[k], position);
        formulas_.set(v[k], rise / h_);
    }
}

// Straight between control points j and j + 1 (D40); the position is that of the start.
void DiscreteAction::set_straight(std::size_t j, const Path& X) {
    set(system_.q, X.front());
    for (std::size_t k = 0; k < n_; ++k)
        formulas_.set(system_.v[k], (X[j + 1][k] - X[j][k]) / ((control_[j + 1] - control_[j]) * h_));
}

// Of straight paths L(q, v) - L(q, 0) is the kinetic energy, L(q, 0) at the nodes -V.
cln::cl_R DiscreteAction::action(const Path& X) {
    cln::cl_R sum = 0;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
        set_node(i, X, system_.q, system_.v);
        sum = sum + h_ * weights_[i] * formulas_.evaluate(lagrangian_)[0];
    }
    for (std::size_t j = 0; j + 1 < X.size() && is_straight_; ++j) {
        formulas_.set(system_.t, t0_);
        set_straight(j, X);
        const cln::cl_R moving = formulas_.evaluate(lagrangian_)[0];
        set(system_.v, Numbers(n_, cln::cl_R(0)));
        sum = sum + h_ * (control_[j + 1] - control_[j]) * (moving - formulas_.evaluate(lagrangian_)[0]);
    }
    return sum;
}
Path DiscreteAction::slopes(const Path& X, bool outer) {
    Path sums(X.size(), Numbers(n_, cln::cl_R(0)));
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
        set_node(i, X, system_.q, system_.v);
        const Numbers p = formulas_.evaluate(momentum_), f = formulas_.evaluate(outer ? outer_force_ : force_);
        for (std::size_t j = 0; j < X.size(); ++j)
            for (std::size_t k = 0; k < n_; ++k) {
                if (!outer && !is_straight_) sums[j][k] = sums[j][k] + weights_[i] * D(i, j) * p[k];
                sums[j][k] = sums[j][k] + h_ * weights_[i] * B(i, j) * f[k];
            }
    }
    for (std::size_t j = 0; j + 1 < X.size() && is_straight_ && !outer; ++j) {
        set_straight(j, X);
        const Numbers p = formulas_.evaluate(momentum_);
        for (std::size_t k = 0; k < n_; ++k) {
            sums[j][k] = sums[j][k] - p[k];
            sums[j + 1][k] = sums[j + 1][k] + p[k];
        }
    }
    return sums;
}

}  // namespace lobatto
