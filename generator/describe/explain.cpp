// SPDX-License-Identifier: GPL-2.0-or-later
// What was found of a system and how a step is taken, in words for a newcomer.
#include "generator/describe/explain.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "generator/formula/expansion.hpp"
#include "generator/mechanics/structure/scaled_mass.hpp"
#include "generator/programs/programs.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

bool has_linear_terms(const System& system) {
    GiNaC::exmap at_rest;
    for (const auto& velocity : system.v) at_rest[velocity] = 0;
    return std::any_of(system.momentum.begin(), system.momentum.end(), [&](const ex& p) {
        try {
            return !expanded(p.subs(at_rest, GiNaC::subs_options::no_pattern)).is_zero();
        } catch (const std::domain_error&) {  // infinite at rest, or 0^0
            return true;
        }
    });
}

// Points of a step where positions are unknown: of a general step all control points but the first.
int unknown_points(const Derivation& d) {
    if (d.structure.is_explicit()) return 0;
    if (d.structure.form() != StepForm::general) return d.quadrature.points - 2;
    return d.scene.method.family == Family::lobatto ? d.scene.method.points - 1 : d.scene.method.points;
}

std::string points_text(int count) {
    return count == 1 ? "the point" : fmt::format("the {} points", count);
}

// x, y, z and 9 more
std::string names_of(const Derivation& d, const std::vector<int>& coordinates) {
    std::string text;
    for (std::size_t i = 0; i < coordinates.size(); ++i) {
        if (i == 4 && coordinates.size() > 5) return text + fmt::format(" and {} more", coordinates.size() - i);
        text += (i == 0 ? "" : ", ") + d.scene.coordinates[static_cast<std::size_t>(coordinates[i])].written;
    }
    return text;
}

}  // namespace

std::string kind_of(const Derivation& derivation) {
    const System& system = derivation.system;
    std::string text;
    const bool has_time = derivation.scene.has_time_coordinate(), linear_terms = !has_time && has_linear_terms(system);
    if (has_time)
        text = "In the time of the clock, where the physical time is a coordinate because the energy changes";
    else if (system.momentum_v.holds_any(system.v))
        text = "Not quadratic in the velocities, as in relativity";
    else if (system.momentum_v.holds_any(system.q))
        text = "Quadratic in the velocities, with masses that depend on the position";
    else if (system.momentum_v.holds_any({system.t}))
        text = "Quadratic in the velocities, with masses that depend on the time";
    else
        text = linear_terms ? "Quadratic in the velocities, with constant masses"
                            : "Kinetic minus potential energy, with constant masses";
    if (linear_terms && !system.momentum_v.holds_any(system.v))
        text += ", and with terms linear in the velocities, as in magnetic fields and rotating frames";
    if (derivation.scene.clock && !has_time) text += ", in the clock's time";
    if (!system.autonomous) text += "; t appears explicitly";
    std::vector<int> forced;
    for (std::size_t k = 0; k < system.outer_force.size(); ++k)
        if (!system.outer_force[k].is_zero() && !(has_time && k + 1 == system.outer_force.size()))
            forced.push_back(static_cast<int>(k));
    if (!forced.empty()) text += "; forces outside L act on " + names_of(derivation, forced);
    return text + ".";
}

std::string form_of(const Derivation& derivation) {
    const int points = unknown_points(derivation);
    switch (derivation.structure.form()) {
        case StepForm::linear_map:
            return "none: one matrix maps positions and momenta to those of the next step";
        case StepForm::separable:
            if (points == 0) return "none: the end of a step follows explicitly from its start";
            return fmt::format("for the positions at {} inside the step; its end follows from them",
                               points_text(points));
        case StepForm::general:
            return points == 1 ? "for the positions at the end of the step"
                               : fmt::format(
                                     "for the positions at {} after the start of the step, the last of them its "
                                     "end",
                                     points_text(points));
    }
    throw std::logic_error("form_of: no such form");
}

int unknowns_of(const Derivation& derivation) {
    int unknowns = 0;
    for (const GroupSolve& solve : solves_of(derivation)) unknowns += solve.unknowns;
    return unknowns;
}

const char* word_of(MatrixOfStep matrix) {
    static constexpr const char* words[] = {"nothing to solve", "full matrix", "banded matrix"};
    return words[static_cast<int>(matrix)];
}

std::vector<GroupSolve> solves_of(const Derivation& derivation) {
    const Structure& structure = derivation.structure;
    if (structure.form() == StepForm::linear_map) return {};
    const bool general = structure.form() == StepForm::general;
    const int points = unknown_points(derivation);
    // One multiplier a cyclic coordinate with Lobatto: its momentum may sway within a step.
    const int multipliers = general && derivation.scene.method.family == Family::lobatto
                                ? static_cast<int>(structure.routhian().cyclic.size())
                                : 0;
    std::vector<GroupSolve> solves;
    for (const Group& group : structure.groups) {
        GroupSolve solve;
        const std::vector<int> active = general ? structure.routhian().active : std::vector<int>();
        for (const int k : group.coordinates) {
            const auto i = static_cast<std::size_t>(k);
            const int multiplier = k - static_cast<int>(active.size()) + derivation.system.n;
            solve.coordinates.push_back(!general ? k : i < active.size() ? active[i] : multiplier);
        }
        solve.unknowns = points * static_cast<int>(group.coordinates.size()) + multipliers;
        solve.band =
            multipliers > 0 ? solve.unknowns - 1 : std::min((group.bandwidth + 1) * points, solve.unknowns) - 1;
        const bool free =
            !general && std::none_of(structure.constant_mass().entries.begin(), structure.constant_mass().entries.end(),
                                     [&](const auto& e) { return e.first == group.coordinates.front(); });
        solve.matrix = free || solve.unknowns == 0        ? MatrixOfStep::none
                       : 3 * solve.band >= solve.unknowns ? MatrixOfStep::full
                                                          : MatrixOfStep::banded;
        if (solve.unknowns > 0) solves.push_back(solve);
    }
    return solves;
}

long elimination_of(const Derivation& derivation) {
    const bool factored = derivation.structure.linear || derivation.structure.absorbed();  // once for all
    long multiplications = 0;
    for (const GroupSolve& solve : solves_of(derivation)) {
        const long N = solve.unknowns, band = solve.band;
        if (solve.matrix == MatrixOfStep::none) continue;
        if (solve.matrix == MatrixOfStep::banded)
            multiplications += (factored ? 0 : 2 * N * band * band) + 3 * N * band;
        else
            multiplications += (factored ? 0 : N * N * N / 3) + N * N;
    }
    return multiplications;
}

std::string solver_text(const Derivation& derivation) {
    const std::vector<GroupSolve> solves = solves_of(derivation);
    if (solves.empty()) return "";
    const auto words = [](const GroupSolve& solve) {
        const std::string equations =
            solve.unknowns == 1 ? "one equation" : fmt::format("{} equations", solve.unknowns);
        if (solve.matrix == MatrixOfStep::none)
            return std::string("no equations, because no force depends on the positions inside a step");
        if (solve.matrix == MatrixOfStep::full) return equations + ", as a full matrix";
        return fmt::format("{}, as a band of {} diagonals", equations, 2 * solve.band + 1);
    };
    std::vector<std::pair<std::string, std::vector<int>>> kinds;  // groups solved alike, together
    for (const GroupSolve& solve : solves) {
        const std::string text = words(solve);
        auto known = std::find_if(kinds.begin(), kinds.end(), [&](const auto& kind) { return kind.first == text; });
        if (known == kinds.end()) known = kinds.insert(kinds.end(), {text, {}});
        known->second.push_back(solve.coordinates.front());
    }
    const bool has_fixed_point =
        !derivation.structure.full() && (derivation.system.constraints.empty() || derivation.system.constant_mass) &&
        (derivation.structure.form() == StepForm::separable || derivation.system.n <= most_iterated ||
         has_light_mass(derivation.scene, derivation.system, derivation.structure));
    std::string text = derivation.structure.linear ? "once per step, without iteration: "
                       : has_fixed_point
                           ? "by fixed-point iteration over all points at once; where it does not converge, "
                           : "";
    if (!derivation.structure.linear)
        text += derivation.structure.absorbed() ? "by iterations with one matrix for all steps: "
                                                : "by Newton's iteration: ";
    if (solves.size() == 1) return text + kinds.front().first;
    for (std::size_t i = 0; i < kinds.size(); ++i) {
        const auto& [how, list] = kinds[i];
        text += i == 0 ? "" : "; ";
        text += list.size() == 1 ? "in the group of " + names_of(derivation, list) + " "
                                 : fmt::format("in each of {} groups ", list.size());
        text += how;
    }
    return text;
}

}  // namespace lobatto
