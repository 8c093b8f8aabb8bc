// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/emit/angles.hpp"

#include <algorithm>
#include <set>

namespace lobatto {

std::map<Id, int> angles_of(const Graph& graph, const Program& program) {
    std::vector<Id> values;
    for (const Output& output : program.outputs) values.push_back(output.value);
    const auto moving_below = [&graph](Id id) {
        std::set<Id> inputs;
        for (const Id one : graph.topological({id}))
            if (graph[one].op == Op::input && graph[one].phase > Phase::step_size && graph.input_of(one).code != "time")
                inputs.insert(one);
        return inputs;
    };
    const std::vector<Id> all = graph.topological(values);
    std::set<Id> dividing;
    for (const Id id : all) {
        const Node& node = graph[id];
        if ((node.op == Op::power && node.index < 0) || node.op == Op::raise || node.op == Op::log)
            dividing.merge(moving_below(node.operands[0]));
    }
    std::map<Id, int> halves, angles;
    for (const Id id : all) {
        if (graph[id].op != Op::pair_sine && graph[id].op != Op::pair_cosine) continue;
        const Id pair = graph[id].operands[0];
        const std::set<Id> inputs = moving_below(pair);
        const auto divides = [&dividing](Id input) { return dividing.contains(input); };
        if (++halves[pair] == 2 && !inputs.empty() && std::none_of(inputs.begin(), inputs.end(), divides))
            angles.emplace(pair, static_cast<int>(angles.size()));
    }
    return angles;
}

}  // namespace lobatto
