// SPDX-License-Identifier: GPL-2.0-or-later
// How names get their meaning, and how they are written.
#include "generator/formula/names.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "generator/formula/switch.hpp"

namespace lobatto {

Name& Names::add_parameter(const std::string& name, const std::vector<GiNaC::ex>& values, bool array) {
    Name& added = all[name];
    added.array = array;
    for (const GiNaC::ex& value : values) added.values.push_back(operand_of(value));
    return added;
}

GiNaC::symbol Names::side_of(const GiNaC::ex& u, const std::string& function, const std::string& formula, Position at) {
    const bool may_jump = function == "sign" || function == "if";
    const auto moves = [&](const GiNaC::ex& part) {
        return std::any_of(flow.next.begin(), flow.next.end(), [&](const auto& one) {
            const GiNaC::ex change = one.second - one.first;  // dt times a velocity
            return part.has(one.first) || (!change.is_equal(flow.dt) && part.has(change / flow.dt));
        });
    };
    const GiNaC::ex value = without_poles(u, moves);
    for (Switch& known : switches)
        if (known.value.is_equal(value)) {
            known.may_jump = known.may_jump || may_jump;
            return known.side;
        }
    switches.push_back({value, GiNaC::symbol(fmt::format("side_{}", switches.size() + 1)),
                        fmt::format("{} in {}", function, formula), at, may_jump});
    return switches.back().side;
}

Name& Names::add_input(const std::string& name, const std::vector<GiNaC::ex>& values, bool array) {
    Name& added = add_parameter(name, values, array);
    added.role = Name::Role::input;
    for (Operand& value : added.values) value.inputs = true;
    return added;
}

Name& Names::add_coordinate(const std::string& name, const std::vector<GiNaC::symbol>& positions,
                            const std::vector<GiNaC::symbol>& velocities, bool array) {
    Name& added = all[name];
    added.role = Name::Role::coordinate;
    added.array = array;
    for (std::size_t k = 0; k < positions.size(); ++k) {
        added.values.push_back(operand_of(positions[k]));
        added.values.back().moves = true;
        added.velocities.push_back(operand_of(velocities[k]));
        added.velocities.back().velocities = true;
        flow.next[positions[k]] = positions[k] + flow.dt * velocities[k];
    }
    return added;
}

Name& Names::add_time(const std::string& name, const GiNaC::symbol& time) {
    Name& added = all[name];
    added.role = Name::Role::time;
    added.values.push_back(operand_of(time));
    added.values.back().moves = true;
    flow.next[time] = time + flow.dt;
    return added;
}

std::vector<Spelling> Names::spellings(bool motion_allowed) const {
    std::vector<Spelling> result;
    for (const auto& [name, meaning] : all) {
        const bool coordinate = meaning.role == Name::Role::coordinate;
        const bool changes = coordinate || meaning.role == Name::Role::time || meaning.role == Name::Role::input;
        if (!motion_allowed && changes) continue;
        std::string written = name;
        if (meaning.array) written += "[i]";
        if (meaning.definition && !meaning.definition->indices.empty())
            written += fmt::format("[{}]", fmt::join(meaning.definition->indices, ","));
        result.push_back({written, name});
        if (coordinate) result.push_back({written + "'", name + "'"});
    }
    return result;
}

}  // namespace lobatto
