// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/formulas/constraint_sizes.hpp"

#include <cmath>

#include "generator/mechanics/algebra/summands.hpp"

namespace lobatto {

ConstraintSizes::ConstraintSizes(const SystemOutline& system) : n_(system.q.size()) {
    if (system.constraints.empty()) return;
    std::vector<GiNaC::symbol> variables{system.t};
    for (const auto* list : {&system.q, &system.v, &system.parameters})
        variables.insert(variables.end(), list->begin(), list->end());
    const Tape::Variables numbered(variables);
    for (const Constraint& constraint : system.constraints) {
        Row row;
        for (const GiNaC::ex& summand : summands_of(constraint.value))
            if (const auto tape = Tape::of(summand, numbered)) row.summands.push_back(*tape);
        for (std::size_t k = 0; k < n_; ++k) {
            const GiNaC::ex slope = constraint.value.diff(system.q[k]);
            if (slope.is_zero()) continue;
            if (const auto tape = Tape::of(slope, numbered)) row.slopes.push_back({k, *tape});
        }
        rows_.push_back(std::move(row));
    }
    for (int k = 0; k < system.n; ++k) masses_.push_back(Tape::of(system.momentum_v(k, k), numbered));
}

void ConstraintSizes::widen(std::vector<double>& sizes, double time, const double* q,
                            const std::vector<double>& parameters) const {
    sizes.resize(2 * n_, 0.0);
    if (rows_.empty()) return;
    std::vector<double> variables{time};
    variables.insert(variables.end(), q, q + n_);
    variables.resize(1 + 2 * n_, 0.0);  // masses of the state at rest
    variables.insert(variables.end(), parameters.begin(), parameters.end());
    const auto weight = [&](std::size_t k) {
        const double mass = masses_[k] ? std::fabs((*masses_[k])(variables)) : 1;
        return mass > 0 && std::isfinite(mass) ? 1 / mass : 1;
    };
    for (const Row& row : rows_) {
        double size = 0, square = 0;
        for (const Tape& summand : row.summands) size += std::fabs(summand(variables));
        std::vector<double> pull(n_, 0.0);
        for (const Slope& slope : row.slopes) {
            const double value = slope.value(variables), w = weight(slope.coordinate);
            pull[slope.coordinate] = w * std::fabs(value);
            square += w * value * value;
        }
        if (!(square > 0) || !std::isfinite(size / square)) continue;
        for (std::size_t k = 0; k < n_; ++k) sizes[k] = std::fmax(sizes[k], size * (pull[k] / square));
    }
}

}  // namespace lobatto
