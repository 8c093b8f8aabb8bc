// SPDX-License-Identifier: GPL-2.0-or-later
// Where a motion with constraints begins: the start of the scene, or the nearest that keeps them (D47).
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "generator/mechanics/system/mass_equations.hpp"

namespace lobatto {

// Works on the values of `start`; all it is given outlives it.
class ConstrainedStart {
public:
    ConstrainedStart(const Scene& scene, const System& system, Formulas& start, const MassEquations& equations);

    // p + G^T mu, with symbols for mu, and the rates of the constraints, G v + dphi/dt.
    const std::vector<Id>& momentum() const { return momentum_; }
    const std::vector<Id>& rates() const { return rates_; }
    const std::vector<GiNaC::symbol>& mu() const { return mu_; }

    // Moves positions, or velocities, so that they keep the constraints to all digits. InputError when the scene's are
    // further off than the rounding of a double, unless it is to be assembled, and when there are none. The mass
    // equations have a solution at the start.
    void keep_positions();
    void keep_velocities();

private:
    using Numbers = std::vector<cln::cl_R>;

    std::optional<std::size_t> furthest(const std::vector<Id>& of) const;
    std::optional<std::size_t> pulled() const;
    std::string value_text(const std::vector<Id>& of, std::size_t constraint) const;
    std::string moved_text(const std::vector<GiNaC::symbol>& symbols, const Numbers& before) const;
    Numbers values_of(const std::vector<GiNaC::symbol>& symbols) const;
    std::optional<cln::cl_R> square() const;
    void move_positions(const Numbers& given);
    Numbers residual(const MassEquations::Entries& mass, const Numbers& given) const;
    void go(const Numbers& q, const Numbers& step);
    bool newton_step(const MassEquations::Entries& mass, const Numbers& given, const Numbers& right,
                     const Elimination& step);
    bool goes_down(const MassEquations::Entries& mass, Numbers right, const Elimination& newton,
                   const Elimination& step) const;
    void find_bends();
    [[noreturn]] void refuse(std::size_t constraint, const std::string& what, const std::string& nearest) const;
    [[noreturn]] void refuse_unreachable(std::size_t constraint) const;

    const Scene& scene_;
    const System& system_;
    Formulas& start_;
    const MassEquations& equations_;
    std::vector<GiNaC::symbol> mu_;
    std::vector<Id> momentum_, rates_, constraints_, slopes_;
    std::vector<std::pair<int, int>> bend_places_;  // of d2(mu phi)/dq2, when they were asked for
    std::vector<Id> bends_;
};

}  // namespace lobatto
