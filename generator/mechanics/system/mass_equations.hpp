// SPDX-License-Identifier: GPL-2.0-or-later
// The equations that velocities follow from, M v + G^T mu = right (D27, D46), at 60 digits: M = d2L/dv2, and with
// constraints phi(q, t) = 0, G = dphi/dq, the rows G v = right below.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "generator/mechanics/algebra/elimination.hpp"
#include "generator/mechanics/system/system.hpp"

namespace lobatto {

class MassEquations {
public:
    // Both outlive it; the values of the symbols may be changed between calls.
    MassEquations(const System& system, Formulas& formulas);

    using Entries = std::map<std::pair<int, int>, Sized>;  // by row and column

    // v, then mu; without a right side only whether there is a solution. DomainError where an entry has no value.
    Elimination eliminate(std::vector<cln::cl_R> right) const { return eliminate(mass(), std::move(right)); }
    // With another matrix in the place of M.
    Elimination eliminate(Entries block, std::vector<cln::cl_R> right) const;
    Entries mass() const;  // M
    // Of a singular elimination: a sentence when constraints depend on one another, "" when mass is missing.
    std::string dependent_constraints(const Elimination& singular) const;
    std::size_t unknowns() const { return system_.q.size() + system_.constraints.size(); }

private:
    const System& system_;
    Formulas& formulas_;
    std::vector<std::pair<int, int>> places_, slope_places_;
    std::vector<Id> values_, slopes_;  // of M; of G and its transpose
};

}  // namespace lobatto
