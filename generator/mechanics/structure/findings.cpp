// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/structure/findings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <tuple>

#include "generator/formula/spline.hpp"
#include "generator/graph/notation.hpp"
#include "generator/scene/eliminated.hpp"

namespace lobatto {

using GiNaC::ex;

bool has_any(const ex& expression, const std::vector<GiNaC::symbol>& symbols) {
    return std::any_of(symbols.begin(), symbols.end(), [&](const auto& symbol) { return expression.has(symbol); });
}

std::string name_of(const System& system, int coordinate) {
    return system.q[static_cast<std::size_t>(coordinate)].get_name();
}

std::string names_of(const System& system, const std::vector<int>& coordinates) {
    std::string text;
    std::size_t shown = 0;
    for (const int k : coordinates) {
        if (shown == 6 && coordinates.size() > 7) return text + fmt::format(" and {} more", coordinates.size() - shown);
        text += (shown++ == 0 ? "" : ", ") + name_of(system, k);
    }
    return text;
}

std::vector<Finding> elimination_findings(const Scene& scene) {
    std::vector<Finding> findings;
    if (!scene.eliminated.empty()) {
        std::string names;
        for (const Eliminated& x : scene.eliminated)
            if (names.size() < 200) names += (names.empty() ? "" : ", ") + x.coordinate.written;
        const bool one = scene.eliminated.size() == 1;
        findings.push_back(
            {"eliminated coordinates", true,
             fmt::format("{} {} eliminated: {}", names, one ? "is" : "are", equations_of_eliminated(scene))});
    }
    if (scene.not_eliminated.empty()) return findings;
    std::string list;
    for (const std::string& one : scene.not_eliminated)
        if (list.size() < 400) list += (list.empty() ? "" : "; ") + one;
    findings.push_back({"eliminated coordinates", false, list});
    return findings;
}

Finding constraint_finding(const Scene& scene, const System& system) {
    std::string list;
    for (const Constraint& constraint : scene.constraints)
        if (list.size() < 200) list += (list.empty() ? "" : ", ") + constraint.written;
    const std::size_t count = scene.constraints.size();
    return {
        "constraints", true,
        fmt::format(
            "{} ({}): {} of {} degrees of freedom remain, and multipliers at the nodes of each step hold the rest",
            count == 1 ? "one" : std::to_string(count), list, static_cast<std::size_t>(system.n) - count, system.n)};
}

namespace {

// What is not smooth in them, and not cut at; where atan2 jumps.
void add_measured_values(const System& system, std::vector<Finding>& findings) {
    std::set<int> numbers;
    bool has_angle = false;
    const auto look_at = [&](const ex& formula) {
        for (auto part = formula.preorder_begin(); part != formula.preorder_end(); ++part) {
            if (is_table_value(*part)) numbers.insert(GiNaC::ex_to<GiNaC::numeric>(part->op(0)).to_int());
            has_angle = has_angle || is_angle(*part);
        }
    };
    look_at(system.lagrangian);
    for (const ex& force : system.outer_force) look_at(force);
    for (const Constraint& constraint : system.constraints) look_at(constraint.value);
    for (const int number : numbers)
        findings.push_back(
            {"measured values", true,
             fmt::format("{}: cubic polynomials between {} knots, smooth to the second derivative (C2). A step "
                         "across a knot has an error of h^4 where a force is this table, and of h^3 where a "
                         "potential is; steps that end at knots keep the order of the method",
                         spline_of(number).file(), spline_of(number).x().size())});
    if (has_angle)
        findings.push_back({"angles of atan2", true,
                            "atan2(y, x) jumps by 2*pi where y passes 0 and x is below 0, and no step is cut there"});
}

}  // namespace

std::vector<Finding> scene_findings(const Scene& scene, const System& system) {
    std::vector<Finding> findings;
    const auto find = [&](const std::string& name, bool holds, const std::string& reason) {
        findings.push_back({name, holds, reason});
    };
    find("no explicit time", system.autonomous,
         !system.autonomous ? "t appears in L, a force or an event, so every formula takes it"
         : scene.has_time_coordinate()
             ? "t is a coordinate, " + scene.coordinates.back().name + ", so no formula takes it besides"
             : "t appears nowhere, so no formula takes it");
    std::vector<int> driven;
    for (int k = 0; k < system.n; ++k)
        if (!system.outer_force[static_cast<std::size_t>(k)].is_zero() &&
            !(scene.has_time_coordinate() && k + 1 == system.n))  // the momentum of the time takes their power
            driven.push_back(k);
    find("no forces", driven.empty(),
         driven.empty() ? "all forces come from L, so every step is symplectic"
                        : "forces outside L act on " + names_of(system, driven) + ", so energy is gained or lost");
    if (!system.inputs.empty()) {
        std::string list;
        for (const GiNaC::symbol& input : system.inputs) list += (list.empty() ? "" : ", ") + input.get_name();
        const auto jumps = [&](const GiNaC::ex& formula) {
            return !formula.has(scene.time) &&
                   std::any_of(system.inputs.begin(), system.inputs.end(),
                               [&](const GiNaC::symbol& input) { return formula.has(input); });
        };
        std::vector<std::string> jumping = scene.inputs_without_speed;
        for (const Constraint& constraint : scene.constraints)
            if (jumps(constraint.value)) jumping.push_back("the constraint " + constraint.written);
        for (const Impact& impact : scene.impacts)
            if (jumps(impact.when.value)) jumping.push_back("the wall " + impact.written);
        find("inputs", true,
             list + ": a program may change them before each step with set_inputs(); the energy changes with them");
        if (!jumping.empty())
            find("inputs without speed", true,
                 fmt::format("{}: an input jumps between steps. What moves with it needs its speed as a second input "
                             "(docs/scene_format.md, [inputs])",
                             fmt::join(jumping, ", ")));
    }
    add_measured_values(system, findings);
    if (!scene.constants.empty()) {
        std::string list;
        for (const Parameter& parameter : scene.constants) list += (list.empty() ? "" : ", ") + parameter.name;
        find("constant parameters", true, list + ": written into the formulas as numbers, not passed as arguments");
    }
    return findings;
}

std::string curvature_text(const System& system) {
    SparseMatrix hessian = system.hessian;
    if (const Unwritten& unwritten = system.unwritten; !unwritten.empty()) {
        const auto& [row, column] = unwritten.places.front();
        hessian.put(row, column,
                    hessian(static_cast<std::size_t>(row), static_cast<std::size_t>(column)) +
                        unwritten.at({row, column}, system.q));
    }
    const auto blocks =
        system.separable ? std::vector<std::tuple<const SparseMatrix*, bool, bool>>{{&hessian, 0, 0}}
                         : std::vector<std::tuple<const SparseMatrix*, bool, bool>>{{&system.momentum_v, true, true},
                                                                                    {&system.momentum_q, true, false},
                                                                                    {&system.force_v, false, true},
                                                                                    {&system.force_q, false, false}};
    const std::string of = system.separable ? "V" : "L";
    for (const auto& [matrix, by_velocity, then_velocity] : blocks)
        for (const auto& [place, value] : matrix->entries()) {
            const char* on = has_any(value, system.q)        ? "position"
                             : has_any(value, system.v)      ? "velocity"
                             : value.has(system.t)           ? "time"
                             : has_any(value, system.inputs) ? "inputs"
                                                             : nullptr;
            if (on == nullptr) continue;
            const std::string row = name_of(system, place.first),
                              column = name_of(system, place.second) + (then_velocity ? "'" : "");
            const bool outer = !by_velocity && !system.outer_force[static_cast<std::size_t>(place.first)].is_zero();
            const std::string text = canonical_text(outer && system.separable ? -value : value),
                              formula = text.size() > 80 ? "" : " = " + text;
            const std::string slope = outer ? fmt::format("df_{}/d{}", row, column)
                                            : fmt::format("d2{}/d{}{}d{}", of, row, by_velocity ? "'" : "", column);
            return fmt::format("{}{} depends on the {}", slope, formula, on);
        }
    if (!system.constraints.empty())
        return "the constraint " + system.constraints.front().written + " pulls on coordinates";
    return "a force depends on the time";
}

}  // namespace lobatto
