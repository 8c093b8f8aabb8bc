// SPDX-License-Identifier: GPL-2.0-or-later
// Graph to graph: sines and cosines of sums of angles, and of one argument together.
#include <array>
#include <set>

#include "generator/graph/rewrite.hpp"

namespace lobatto {

// ---- sines and cosines of a sum of two angles from those of the two

namespace {

bool is_trigonometric(Op op) {
    return op == Op::sin || op == Op::cos;
}

// x of a term x or -x.
Id angle_of(const Graph& graph, Id term, bool& is_negative) {
    const Node& node = graph[term];
    is_negative = node.op == Op::multiply && node.operands.size() == 2 && graph.is_number(node.operands[0], -1);
    return is_negative ? node.operands[1] : term;
}

// The sums of two angles, both plus or minus, whose sines or cosines a program takes besides those of both angles.
std::set<Id> sums_of_known_angles(const Graph& graph, const Program& program) {
    const std::vector<Id> nodes = graph.topological(roots_of(program));
    std::set<Id> arguments;
    for (const Id id : nodes)
        if (is_trigonometric(graph[id].op)) arguments.insert(graph[id].operands[0]);
    std::set<Id> sums;
    for (const Id sum : arguments) {
        if (graph[sum].op != Op::add || graph[sum].operands.size() != 2) continue;
        bool ignored = false;
        const auto is_known = [&](Id term) {
            const Id angle = angle_of(graph, term, ignored);
            return graph[angle].op != Op::add && arguments.contains(angle);
        };
        if (is_known(graph[sum].operands[0]) && is_known(graph[sum].operands[1])) sums.insert(sum);
    }
    // Near zero sin(a - b) has fewer digits then: not where it is divided by, or in the argument of a function.
    std::vector<bool> needs_digits(static_cast<std::size_t>(graph.size()));
    for (auto id = nodes.rbegin(); id != nodes.rend(); ++id) {
        const Node& node = graph[*id];
        const bool is_polynomial =
            node.op == Op::add || node.op == Op::multiply || (node.op == Op::power && node.index > 0);
        const bool here = needs_digits[static_cast<std::size_t>(*id)];
        if (here && is_trigonometric(node.op)) sums.erase(node.operands[0]);
        if (here || !is_polynomial)
            for (const Id operand : node.operands) needs_digits[static_cast<std::size_t>(operand)] = true;
    }
    return sums;
}

Id sine_or_cosine_of_sum(Graph& graph, Op op, const std::vector<Id>& terms) {
    std::array<Id, 2> sine{}, cosine{};
    std::array<bool, 2> minus{};
    for (std::size_t i = 0; i < 2; ++i) {
        const Id angle = angle_of(graph, terms[i], minus[i]);
        sine[i] = graph.raw(Op::sin, {angle});
        cosine[i] = graph.raw(Op::cos, {angle});
    }
    const auto product = [&](Id a, Id b, bool is_negative) {
        const Id value = graph.raw(Op::multiply, {a, b});
        return is_negative ? graph.raw(Op::multiply, {graph.constant(-1, ""), value}) : value;
    };
    if (op == Op::sin)
        return graph.raw(Op::add, {product(sine[0], cosine[1], minus[0]), product(cosine[0], sine[1], minus[1])});
    return graph.raw(Op::add, {product(cosine[0], cosine[1], false), product(sine[0], sine[1], minus[0] == minus[1])});
}

}  // namespace

Programs add_angles(const Programs& programs) {
    // Each program by itself: another may take the sum's sine alone.
    Programs after = programs;
    for (std::size_t p = 0; p < programs.programs.size(); ++p) {
        const std::set<Id> sums = sums_of_known_angles(programs.graph, programs.programs[p]);
        if (sums.empty()) continue;
        const std::vector<Id> image =
            images(after.graph, programs.graph, roots_of(programs.programs[p]),
                   [&sums](Graph& graph, const Graph& before, Id id, std::vector<Id> operands) {
                       const Node& node = before[id];
                       if (!is_trigonometric(node.op) || !sums.contains(node.operands[0]))
                           return same(graph, node, std::move(operands));
                       return sine_or_cosine_of_sum(graph, node.op, std::vector<Id>(graph[operands[0]].operands));
                   });
        for (std::size_t i = 0; i < programs.programs[p].outputs.size(); ++i)
            after.programs[p].outputs[i].value = image[static_cast<std::size_t>(programs.programs[p].outputs[i].value)];
    }
    return after;
}

// ---- sine and cosine of one argument as a pair

Programs pair_sines(const Programs& programs) {
    std::set<Id> sines, cosines;  // arguments, in the graph before
    for (const Id id : programs.graph.topological(roots_of(programs))) {
        if (programs.graph[id].op == Op::sin) sines.insert(programs.graph[id].operands[0]);
        if (programs.graph[id].op == Op::cos) cosines.insert(programs.graph[id].operands[0]);
    }
    return rewrite(programs, [&](Graph& graph, const Graph& before, Id id, std::vector<Id> operands) {
        const Node& node = before[id];
        const bool trigonometric = node.op == Op::sin || node.op == Op::cos;
        if (!trigonometric || !sines.contains(node.operands[0]) || !cosines.contains(node.operands[0]))
            return same(graph, node, std::move(operands));
        const Id pair = graph.raw(Op::sincos_pair, std::move(operands));
        return graph.raw(node.op == Op::sin ? Op::pair_sine : Op::pair_cosine, {pair});
    });
}

}  // namespace lobatto
