// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/graph/rewrite.hpp"

namespace lobatto {

std::vector<Id> roots_of(const Program& program) {
    std::vector<Id> roots;
    for (const Output& output : program.outputs) roots.push_back(output.value);
    return roots;
}

std::vector<Id> images(Graph& after, const Graph& before, const std::vector<Id>& roots, const Rule& rule) {
    std::vector<Id> image(static_cast<std::size_t>(before.size()), -1);
    for (const Id id : before.topological(roots)) {
        const Node& node = before[id];
        std::vector<Id> operands;
        for (const Id operand : node.operands) operands.push_back(image[static_cast<std::size_t>(operand)]);
        Id& result = image[static_cast<std::size_t>(id)];
        if (node.op == Op::constant)
            result = after.constant(before.constant_of(id).value, before.constant_of(id).label);
        else if (node.op == Op::input)
            result = after.input(before.input_of(id));
        else
            result = rule(after, before, id, std::move(operands));
    }
    return image;
}

Programs rewrite(const Programs& before, const Rule& rule) {
    Programs after;
    for (const Input& input : before.graph.inputs()) after.graph.input(input);
    const std::vector<Id> image = images(after.graph, before.graph, roots_of(before), rule);
    after.programs = before.programs;
    for (Program& program : after.programs)
        for (Output& output : program.outputs) output.value = image[static_cast<std::size_t>(output.value)];
    for (const auto& [id, name] : before.names) after.names.emplace_back(image[static_cast<std::size_t>(id)], name);
    return after;
}

Id same(Graph& graph, const Node& node, std::vector<Id> operands) {
    return graph.raw(node.op, std::move(operands), node.index);
}

std::vector<Id> roots_of(const Programs& programs) {
    std::vector<Id> roots;
    for (const Program& program : programs.programs)
        for (const Id root : roots_of(program)) roots.push_back(root);
    for (const auto& [id, name] : programs.names) roots.push_back(id);
    return roots;
}

}  // namespace lobatto
