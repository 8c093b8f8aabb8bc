// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/system/mass_equations.hpp"

#include <fmt/format.h>

namespace lobatto {

MassEquations::MassEquations(const System& system, Formulas& formulas) : system_(system), formulas_(formulas) {
    std::vector<GiNaC::ex> masses, slopes;
    for (const auto& [place, value] : system.momentum_v.entries()) {
        places_.push_back(place);
        masses.push_back(value);
    }
    for (const auto& [place, value] : system.constraint_q.entries()) {
        const int row = system.n + place.first;
        slope_places_.emplace_back(row, place.second);
        slope_places_.emplace_back(place.second, row);
        slopes.insert(slopes.end(), 2, value);
    }
    values_ = formulas.convert(masses);
    slopes_ = formulas.convert(slopes);
}

MassEquations::Entries MassEquations::mass() const {
    const std::vector<Sized> values = formulas_.evaluate_sized(values_);
    Entries entries;
    for (std::size_t i = 0; i < places_.size(); ++i) entries[places_[i]] = values[i];
    return entries;
}

Elimination MassEquations::eliminate(Entries block, std::vector<cln::cl_R> right) const {
    right.resize(unknowns(), cln::cl_R(0));
    const std::vector<Sized> slopes = formulas_.evaluate_sized(slopes_);
    for (std::size_t i = 0; i < slope_places_.size(); ++i) block[slope_places_[i]] = slopes[i];
    return lobatto::eliminate(block, std::move(right));
}

std::string MassEquations::dependent_constraints(const Elimination& singular) const {
    const std::size_t n = system_.q.size();
    const cln::cl_R tiny = cln::expt(cln::cl_RA(10), -30);
    for (std::size_t k = 0; k < n; ++k)
        if (cln::abs(singular.vector[k]) > tiny) return "";
    std::string names;
    int count = 0;
    for (std::size_t c = 0; c < system_.constraints.size(); ++c) {
        if (cln::abs(singular.vector[n + c]) <= tiny) continue;
        if (++count <= 6) names += (count == 1 ? "" : ", ") + system_.constraints[c].written;
    }
    if (count == 1)
        return fmt::format(
            "the constraint {} has no slope: all its derivatives in the coordinates vanish there. If it is written "
            "like "
            "x^2 = 0, write x = 0; if it follows from the other constraints, remove it",
            names);
    return fmt::format(
        "the constraints {}{} depend on one another: one of them follows from the others, or contradicts "
        "them; remove it, or start away from a dead point",
        names, count > 6 ? ", ..." : "");
}

}  // namespace lobatto
