// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/names.hpp"

namespace lobatto {

Name& Names::add_parameter(const std::string& name, const std::vector<GiNaC::ex>& values, bool array) {
    Name& added = all[name];
    added.array = array;
    for (const GiNaC::ex& value : values) added.values.push_back(operand_of(value));
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

}  // namespace lobatto
