// SPDX-License-Identifier: GPL-2.0-or-later
// Graph to graph: fold, factor, powers, phases, shared parts. Those of sines and cosines: passes_of_angles.cpp.
#include "generator/graph/passes.hpp"

#include <cln/cln.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <set>

#include "generator/graph/notation.hpp"
#include "generator/graph/rewrite.hpp"

namespace lobatto {

std::string element_text(int element) {
    return element == LoopPart::rest     ? "rest"
           : element == LoopPart::inside ? "inside"
                                         : "element_" + std::to_string(element + 1);
}

std::string name_of(const LoopPart& part) {
    static constexpr const char* parts[] = {"node", "slope", "quadratic", "energy", "a"};
    return element_text(part.element) + "_" + parts[static_cast<std::size_t>(part.of)];
}

// ---- fold constants: whatever depends on numbers only becomes a number of 60 digits; its formula stays as label

Programs fold_constants(const Programs& programs) {
    Graph scratch = programs.graph;  // to print the formulas that vanish
    return rewrite(programs, [&scratch](Graph& graph, const Graph& before, Id id, std::vector<Id> operands) {
        const Node& node = before[id];
        std::vector<Id> numbers, others, printed;
        for (std::size_t i = 0; i < operands.size(); ++i) {
            if (graph.is_constant(operands[i])) {
                numbers.push_back(operands[i]);
                printed.push_back(node.operands[i]);
            } else {
                others.push_back(operands[i]);
            }
        }
        const bool n_ary = node.op == Op::add || node.op == Op::multiply;
        if (numbers.empty() || (!n_ary && !others.empty())) return same(graph, node, std::move(operands));
        if (n_ary && numbers.size() == 1) return node.op == Op::add ? graph.add(operands) : graph.multiply(operands);
        std::vector<cln::cl_R> values;
        for (const Id number : numbers) values.push_back(graph.constant_of(number).value);
        const cln::cl_R value = apply(node.op, node.index, values);
        std::string label;
        if (!is_rational(value)) label = formula(scratch, scratch.raw(node.op, printed, node.index), Notation::text);
        others.push_back(graph.constant(value, label));
        return node.op == Op::add        ? graph.add(others)
               : node.op == Op::multiply ? graph.multiply(others)
                                         : others.front();
    });
}

// ---- factor sums (Horner): a x^3 + b x^2 + c x = x (c + x (b + a x))

namespace {

// A factor is taken out only of terms that are known no earlier than the factor itself: coefficients of an earlier
// phase are hoisted for free.
Id horner(Graph& graph, const std::vector<Id>& terms) {
    const auto factors_of = [&graph](Id term) {
        return graph[term].op == Op::multiply ? graph[term].operands : std::vector<Id>{term};
    };
    const auto base_of = [&graph](Id factor) {
        return graph[factor].op == Op::power && graph[factor].index > 0 ? graph[factor].operands[0] : factor;
    };
    std::vector<std::pair<Id, std::vector<std::size_t>>> uses;  // base -> terms, in order of first appearance
    for (std::size_t t = 0; t < terms.size(); ++t)
        for (const Id factor : factors_of(terms[t])) {
            const Id base = base_of(factor);
            const Node& node = graph[base];
            if (graph.is_constant(base) || node.op == Op::power || node.phase != graph[terms[t]].phase) continue;
            auto use = std::find_if(uses.begin(), uses.end(), [base](const auto& u) { return u.first == base; });
            if (use == uses.end()) use = uses.insert(uses.end(), {base, {}});
            use->second.push_back(t);
        }
    const auto best = std::max_element(uses.begin(), uses.end(),
                                       [](const auto& x, const auto& y) { return x.second.size() < y.second.size(); });
    if (best == uses.end() || best->second.size() < 2)
        return terms.size() == 1 ? terms.front()
                                 : graph.raw(Op::add, terms);  // a sum within a sum stays one: it chose its rounding
    std::vector<Id> inside, outside;
    for (std::size_t t = 0, next = 0; t < terms.size(); ++t) {
        if (next < best->second.size() && best->second[next] == t) {
            inside.push_back(graph.divide(terms[t], best->first));
            ++next;
        } else {
            outside.push_back(terms[t]);
        }
    }
    const Id product = graph.raw(Op::multiply, {best->first, horner(graph, inside)});
    if (outside.empty()) return product;
    const Id rest = outside.size() == 1 ? outside.front() : horner(graph, outside);
    std::vector<Id> sum{product};
    if (graph[rest].op == Op::add)
        sum.insert(sum.end(), graph[rest].operands.begin(), graph[rest].operands.end());
    else
        sum.push_back(rest);
    return graph.raw(Op::add, std::move(sum));
}

}  // namespace

Programs factor_sums(const Programs& programs) {
    return rewrite(programs, [](Graph& graph, const Graph& before, Id id, std::vector<Id> operands) {
        return before[id].op == Op::add ? horner(graph, operands) : same(graph, before[id], std::move(operands));
    });
}

// ---- powers by multiplication

namespace {

Id raised(Graph& graph, Id base, int exponent) {
    if (exponent == 1) return base;
    if (exponent < 0) return graph.raw(Op::power, {raised(graph, base, -exponent)}, -1);
    if (exponent % 2 == 0) {
        const Id half = raised(graph, base, exponent / 2);
        return graph.raw(Op::multiply, {half, half});
    }
    return graph.raw(Op::multiply, {raised(graph, base, exponent - 1), base});
}

// k where the exponent is the number k/4 with an odd k, and small enough to be written out; else 0.
int odd_quarters(const Graph& graph, Id exponent) {
    constexpr int most = 40;
    if (!graph.is_constant(exponent)) return 0;
    const cln::cl_R quarters = 4 * graph.constant_of(exponent).value;
    if (cln::abs(quarters) > most || cln::round1(quarters) != quarters) return 0;
    const int k = static_cast<int>(std::lround(cln::double_approx(quarters)));
    return k % 2 != 0 ? k : 0;
}

// What is asked for of a base x.
struct PowersOf {
    std::set<int> negative;                  // k of x^(k/4)
    bool root = false, fourth_root = false;  // for positive powers, or for themselves
};

std::map<Id, PowersOf> powers_asked_for(const Programs& programs) {
    const Graph& graph = programs.graph;
    std::map<Id, PowersOf> asked;
    const auto ask = [&](Id root) {
        if (graph[root].op == Op::sqrt) asked[graph[root].operands[0]].root = true;
    };
    const std::vector<Id> outputs = roots_of(programs);
    std::for_each(outputs.begin(), outputs.end(), ask);
    for (const Id id : graph.topological(outputs)) {
        const Node& node = graph[id];
        if (node.op == Op::power && node.index < 0) {
            const Id base = node.operands[0];
            const bool is_root = graph[base].op == Op::sqrt;
            asked[is_root ? graph[base].operands[0] : base].negative.insert((is_root ? 2 : 4) * node.index);
            continue;
        }
        std::for_each(node.operands.begin(), node.operands.end(), ask);
        const int k = node.op == Op::raise ? odd_quarters(graph, node.operands[1]) : 0;
        if (k < 0) asked[node.operands[0]].negative.insert(k);
        if (k > 0) asked[node.operands[0]].root = asked[node.operands[0]].fourth_root = true;
    }
    return asked;
}

// x^(k/4), k not a multiple of 4, as a power of y = x or 1/x times its square root, its fourth root or both: rounding
// of the roots is not raised with them. Where roots of x are there anyway, none are taken of 1/x: sqrt(1/x) =
// sqrt(x)/x.
Id raised_root(Graph& graph, Id x, int k, const PowersOf& asked) {
    const auto root_of = [&](Id z) { return graph.raw(Op::sqrt, {z}); };
    const auto product = [&](Id a, Id b) { return graph.raw(Op::multiply, {a, b}); };
    const Id y = k > 0 ? x : graph.raw(Op::power, {x}, -1);
    const Id root = k < 0 && asked.root ? product(y, root_of(x)) : root_of(y);
    std::vector<Id> factors;
    if (std::abs(k) >= 4) factors.push_back(raised(graph, y, std::abs(k) / 4));
    if (std::abs(k) % 4 >= 2) factors.push_back(root);
    if (k % 2 != 0) factors.push_back(k < 0 && asked.fourth_root ? product(root, root_of(root_of(x))) : root_of(root));
    return factors.size() == 1 ? factors.front() : graph.raw(Op::multiply, std::move(factors));
}

}  // namespace

Programs multiply_powers(const Programs& programs) {
    // Where a base is divided by in several powers, one division serves them all: r = 1/x, then r^2, r^3, sqrt(r) ...
    std::map<Id, PowersOf> asked = powers_asked_for(programs);
    return rewrite(programs, [&](Graph& graph, const Graph& before, Id id, std::vector<Id> operands) {
        const Node& node = before[id];
        if (node.op == Op::raise)
            if (const int k = odd_quarters(graph, operands[1]); k != 0)
                return raised_root(graph, operands[0], k, asked[node.operands[0]]);
        if (node.op != Op::power) return same(graph, node, std::move(operands));
        const Node& base = before[node.operands[0]];
        const bool is_root = base.op == Op::sqrt;
        const PowersOf& of_base = asked[is_root ? base.operands[0] : node.operands[0]];
        const bool shares = node.index < 0 && of_base.negative.size() > 1;
        if (is_root && node.index % 2 != 0 && (node.index != -1 || shares))
            return raised_root(graph, graph[operands.front()].operands[0], 2 * node.index, of_base);
        if (shares) return raised(graph, graph.raw(Op::power, {operands.front()}, -1), -node.index);
        return raised(graph, operands.front(), node.index);
    });
}

// ---- phases: the operands known first are combined first, so that their part can be hoisted

namespace {

std::string positive_label(const Constant& negative) {
    if (negative.label.empty()) return "";
    return negative.label.rfind("-(", 0) == 0 && negative.label.back() == ')'
               ? negative.label.substr(2, negative.label.size() - 3)
               : "-(" + negative.label + ")";
}

}  // namespace

Programs group_by_phase(const Programs& programs) {
    // Products that have a name of their own keep their sign.
    std::set<std::vector<Id>> named;
    for (const auto& [id, name] : programs.names) named.insert(programs.graph[id].operands);
    return rewrite(programs, [&named](Graph& graph, const Graph& before, Id id, std::vector<Id> operands) {
        const Node& node = before[id];
        if (node.op != Op::add && node.op != Op::multiply) return same(graph, node, std::move(operands));
        // A minus sign stays with the later operand, where it is a subtraction: what is hoisted keeps its name and
        // sign.
        std::vector<Id> early;
        for (const Id operand : node.operands)
            if (before[operand].phase <= Phase::step_size) early.push_back(operand);
        const bool minus = node.op == Op::multiply && node.phase > Phase::step_size &&
                           graph.is_constant(operands.front()) && graph.is_negative(operands.front()) &&
                           !named.contains(early);
        if (minus) {
            operands.front() = graph.constant(-graph.constant_of(operands.front()).value,
                                              positive_label(graph.constant_of(operands.front())));
            if (graph.is_number(operands.front(), 1)) operands.erase(operands.begin());
        }
        std::vector<Id> group;
        for (const Phase phase : {Phase::constant, Phase::parameter, Phase::step_size, Phase::step, Phase::iterate}) {
            std::vector<Id> here;
            for (const Id operand : operands)
                if (graph[operand].phase == phase) here.push_back(operand);
            if (here.empty()) continue;
            // What came before forms one operand; a lone constant stays beside what it multiplies or is added to.
            if (group.size() > 1) group = {graph.raw(node.op, group)};
            group.insert(group.end(), here.begin(), here.end());
        }
        if (minus) group.insert(group.begin(), graph.number(-1));
        // A sum begins with a term that has no minus sign, where there is one.
        if (node.op == Op::add) {
            const auto first =
                std::find_if(group.begin(), group.end(), [&graph](Id term) { return !graph.is_negative(term); });
            if (first != group.end()) std::rotate(group.begin(), first, first + 1);
        }
        return graph.raw(node.op, std::move(group));
    });
}

// ---- share: operand pairs that several sums or products contain are computed once

Programs share_pairs(const Programs& programs) {
    // Sums and products of the graph as operand lists, rewritten in place; extracted pairs become new nodes of `graph`.
    Programs work = rewrite(programs, [](Graph& graph, const Graph& before, Id id, std::vector<Id> operands) {
        return same(graph, before[id], std::move(operands));
    });
    Graph& graph = work.graph;
    const std::vector<Id> order = graph.topological(roots_of(work));
    std::map<Id, std::vector<Id>> lists;
    for (const Id id : order)
        if (graph[id].op == Op::add || graph[id].op == Op::multiply) lists[id] = graph[id].operands;
    using Pair = std::array<Id, 3>;  // op, smaller, larger
    // In rounds: all pairs are counted, then the most frequent ones taken out, each list changing once a round.
    for (bool changed = true; changed;) {
        changed = false;
        std::map<Pair, std::set<Id>> users;
        for (const auto& [id, operands] : lists)
            for (std::size_t i = 0; i < operands.size(); ++i)
                for (std::size_t j = i + 1; j < operands.size(); ++j) {
                    const auto [low, high] = std::minmax(operands[i], operands[j]);
                    users[{static_cast<Id>(graph[id].op), low, high}].insert(id);
                }
        std::vector<std::pair<Pair, std::set<Id>>> frequent;
        for (auto& [pair, ids] : users)
            if (ids.size() > 1) frequent.emplace_back(pair, std::move(ids));
        std::stable_sort(frequent.begin(), frequent.end(),
                         [](const auto& x, const auto& y) { return x.second.size() > y.second.size(); });
        std::set<Id> touched;
        for (auto& [key, ids] : frequent) {
            std::erase_if(ids, [&touched](Id id) { return touched.contains(id); });
            // A pair that is a whole node already gains nothing unless a longer list contains it.
            const bool in_longer =
                std::any_of(ids.begin(), ids.end(), [&lists](Id id) { return lists[id].size() > 2; });
            if (ids.size() < 2 || !in_longer) continue;
            const auto [op, low, high] = key;
            // The pair in the order in which its first user holds it.
            std::vector<Id> pair;
            for (const Id operand : lists[*ids.begin()])
                if ((operand == low || operand == high) && pair.size() < 2) pair.push_back(operand);
            const Id shared = graph.raw(static_cast<Op>(op), pair);
            for (const Id id : ids) {
                std::vector<Id>& operands = lists[id];
                operands.erase(std::find(operands.begin(), operands.end(), low));
                operands.erase(std::find(operands.begin(), operands.end(), high));
                operands.insert(operands.begin(), shared);
            }
            lists[shared] = pair;  // also when one of the users was the pair itself
            touched.insert(ids.begin(), ids.end());
            touched.insert(shared);
            changed = true;
        }
    }
    // Rebuild from the lists.
    Programs result;
    for (const Input& input : graph.inputs()) result.graph.input(input);
    std::map<Id, Id> image;
    const std::function<Id(Id)> build = [&](Id id) -> Id {
        if (const auto known = image.find(id); known != image.end()) return known->second;
        const Node node = graph[id];
        Id built = 0;
        if (node.op == Op::constant) {
            built = result.graph.constant(graph.constant_of(id).value, graph.constant_of(id).label);
        } else if (node.op == Op::input) {
            built = result.graph.input(graph.input_of(id));
        } else {
            const auto list = lists.find(id);
            const std::vector<Id> sources = list == lists.end() ? node.operands : list->second;
            std::vector<Id> operands;
            for (const Id source : sources) operands.push_back(build(source));
            built = list != lists.end() && operands.size() == 1 ? operands.front()
                                                                : result.graph.raw(node.op, operands, node.index);
        }
        return image[id] = built;
    };
    result.programs = work.programs;
    for (Program& program : result.programs)
        for (Output& output : program.outputs) output.value = build(output.value);
    for (const auto& [id, name] : work.names) result.names.emplace_back(build(id), name);
    return result;
}

}  // namespace lobatto
