// SPDX-License-Identifier: GPL-2.0-or-later
// Hash-consed expression graph in an order of its own: leaves, canonical operations, order.
#include "generator/graph/graph.hpp"

#include <cln/cln.h>

#include <algorithm>

namespace lobatto {

bool is_rational(const cln::cl_R& value) {
    return cln:: instanceof (value, cln::cl_RA_ring);
}

bool is_plain(const Constant& constant) {
    return is_rational(constant.value) || constant.label.empty();
}

Id Graph::intern(Node node) {
    std::string key;
    const auto put = [&key](std::int32_t number) { key.append(reinterpret_cast<const char*>(&number), sizeof number); };
    put(static_cast<std::int32_t>(node.op));
    put(node.index);
    for (const Id operand : node.operands) put(operand);
    const auto [place, is_new] = known_.emplace(std::move(key), size());
    if (!is_new) return place->second;
    for (const Id operand : node.operands) node.phase = std::max(node.phase, (*this)[operand].phase);
    nodes_.push_back(std::move(node));
    return place->second;
}

Id Graph::constant(const cln::cl_R& value, const std::string& label) {
    // The same object of CLN, kept alive here, is the same value: most constants come from another graph.
    if (const auto known = constant_words_.find(value.word); known != constant_words_.end()) return known->second;
    std::vector<Id>& same_hash = constant_ids_[cln::equal_hashcode(value)];
    for (const Id id : same_hash)
        if (is_rational(value) == is_rational(constant_of(id).value) && constant_of(id).value == value) return id;
    same_hash.push_back(size());
    constant_words_.emplace(value.word, size());
    constants_.push_back({value, label});
    nodes_.push_back({Op::constant, Phase::constant, static_cast<int>(constants_.size()) - 1, {}});
    return size() - 1;
}

Id Graph::number(long numerator, long denominator) {
    return constant(cln::cl_RA(cln::cl_I(numerator)) / cln::cl_RA(cln::cl_I(denominator)));
}

Id Graph::input(const Input& input) {
    const auto [place, is_new] = known_.emplace("input " + input.code + " " + input.name, size());
    if (!is_new) return place->second;
    inputs_.push_back(input);
    nodes_.push_back({Op::input, input.phase, static_cast<int>(inputs_.size()) - 1, {}});
    return place->second;
}

Id Graph::raw(Op op, std::vector<Id> operands, int index) {
    return intern({op, Phase::constant, index, std::move(operands)});
}

bool Graph::is_number(Id id, long value) const {
    return is_constant(id) && constant_of(id).value == cln::cl_I(value);
}

bool Graph::is_negative(Id id) const {
    if (is_constant(id)) return cln::minusp(constant_of(id).value);
    const Node& node = (*this)[id];
    return node.op == Op::multiply && is_constant(node.operands.front()) && is_negative(node.operands.front());
}

Id Graph::add(const std::vector<Id>& terms) {
    std::vector<Id> flat;
    for (const Id term : terms) {
        if ((*this)[term].op == Op::add) {
            const auto& inner = (*this)[term].operands;
            flat.insert(flat.end(), inner.begin(), inner.end());
        } else {
            flat.push_back(term);
        }
    }
    // Collect: rest of the term -> coefficient.
    cln::cl_R constant_term = 0;
    std::vector<std::pair<Id, cln::cl_R>> collected;
    std::unordered_map<Id, std::size_t> place;
    for (const Id term : flat) {
        if (is_constant(term) && is_plain(constant_of(term))) {
            constant_term = constant_term + constant_of(term).value;
            continue;
        }
        cln::cl_R coefficient = 1;
        Id rest = term;
        const Node& node = (*this)[term];
        if (node.op == Op::multiply && is_constant(node.operands.front()) &&
            is_plain(constant_of(node.operands.front()))) {
            coefficient = constant_of(node.operands.front()).value;
            std::vector<Id> others(node.operands.begin() + 1, node.operands.end());
            rest = others.size() == 1 ? others.front() : intern({Op::multiply, Phase::constant, 0, std::move(others)});
        }
        const auto [known, is_new] = place.emplace(rest, collected.size());
        if (is_new)
            collected.emplace_back(rest, coefficient);
        else
            collected[known->second].second = collected[known->second].second + coefficient;
    }
    std::erase_if(collected, [](const auto& item) { return cln::zerop(item.second); });
    std::sort(collected.begin(), collected.end(),
              [this](const auto& x, const auto& y) { return compare(x.first, y.first) < 0; });
    std::vector<Id> operands;
    for (const auto& [rest, coefficient] : collected)
        operands.push_back(coefficient == 1 ? rest : multiply({constant(coefficient), rest}));
    if (!cln::zerop(constant_term)) operands.push_back(constant(constant_term));
    if (operands.empty()) return number(0);
    if (operands.size() == 1) return operands.front();
    return intern({Op::add, Phase::constant, 0, std::move(operands)});
}

Id Graph::multiply(const std::vector<Id>& factors) {
    std::vector<Id> flat;
    for (const Id factor : factors) {
        if ((*this)[factor].op == Op::multiply) {
            const auto& inner = (*this)[factor].operands;
            flat.insert(flat.end(), inner.begin(), inner.end());
        } else {
            flat.push_back(factor);
        }
    }
    // Collect: base -> integer exponent.
    cln::cl_R coefficient = 1;
    std::vector<std::pair<Id, int>> collected;
    std::unordered_map<Id, std::size_t> place;
    for (const Id factor : flat) {
        const Node& node = (*this)[factor];
        if (is_constant(factor) && is_plain(constant_of(factor))) {
            coefficient = coefficient * constant_of(factor).value;
            continue;
        }
        const Id base = node.op == Op::power ? node.operands.front() : factor;
        const int exponent = node.op == Op::power ? node.index : 1;
        const auto [known, is_new] = place.emplace(base, collected.size());
        if (is_new)
            collected.emplace_back(base, exponent);
        else
            collected[known->second].second += exponent;
    }
    if (cln::zerop(coefficient)) return number(0);
    std::erase_if(collected, [](const auto& item) { return item.second == 0; });
    std::sort(collected.begin(), collected.end(),
              [this](const auto& x, const auto& y) { return compare(x.first, y.first) < 0; });
    std::vector<Id> operands;
    bool simpler = false;  // sqrt(5)^2 became 5: collect once more
    for (const auto& [base, exponent] : collected) {
        operands.push_back(power(base, exponent));
        const Node& result = (*this)[operands.back()];
        simpler = simpler || result.op == Op::multiply ||
                  (is_constant(operands.back()) && is_plain(constant_of(operands.back())));
    }
    if (simpler) {
        operands.push_back(constant(coefficient));
        return multiply(operands);
    }
    if (operands.empty()) return constant(coefficient);
    if (coefficient != 1) {
        // A constant times a sum is distributed: sums stay flat, so that equal terms meet.
        if (operands.size() == 1 && (*this)[operands.front()].op == Op::add) {
            std::vector<Id> terms;
            const std::vector<Id> inner = (*this)[operands.front()].operands;
            for (const Id term : inner) terms.push_back(multiply({constant(coefficient), term}));
            return add(terms);
        }
        operands.insert(operands.begin(), constant(coefficient));
    }
    if (operands.size() == 1) return operands.front();
    return intern({Op::multiply, Phase::constant, 0, std::move(operands)});
}

Id Graph::power(Id base, int exponent) {
    if (exponent == 0) return number(1);
    if (exponent == 1) return base;
    const Node& node = (*this)[base];
    if (is_constant(base) && is_plain(constant_of(base))) {
        const cln::cl_R& value = constant_of(base).value;
        if (!cln::zerop(value)) return constant(cln::the<cln::cl_R>(cln::expt(value, exponent)));
    }
    if (node.op == Op::power) return power(node.operands.front(), node.index * exponent);
    if (node.op == Op::multiply) {
        std::vector<Id> factors;
        const std::vector<Id> inner = node.operands;
        for (const Id factor : inner) factors.push_back(power(factor, exponent));
        return multiply(factors);
    }
    if (node.op == Op::sqrt && exponent % 2 == 0) return power(node.operands.front(), exponent / 2);
    return intern({Op::power, Phase::constant, exponent, {base}});
}

Id Graph::function(Op op, Id argument) {
    return intern({op, Phase::constant, 0, {argument}});
}

Id Graph::raise(Id base, Id exponent) {
    return intern({Op::raise, Phase::constant, 0, {base, exponent}});
}

int Graph::compare(Id a, Id b) const {
    if (a == b) return 0;
    const Node& x = (*this)[a];
    const Node& y = (*this)[b];
    // A power stands beside its base, so that q^3 and q^2 are neighbours.
    const Id base_x = x.op == Op::power ? x.operands.front() : a;
    const Id base_y = y.op == Op::power ? y.operands.front() : b;
    if (base_x != a || base_y != b) {
        const int order = compare(base_x, base_y);
        if (order != 0) return order;
        const int exponent_x = x.op == Op::power ? x.index : 1;
        const int exponent_y = y.op == Op::power ? y.index : 1;
        return exponent_x < exponent_y ? -1 : 1;
    }
    if (x.op != y.op) return x.op < y.op ? -1 : 1;
    if (x.op == Op::constant) return constant_of(a).value < constant_of(b).value ? -1 : 1;
    if (x.op == Op::input) {
        return x.index < y.index ? -1 : 1;
    }
    for (std::size_t i = 0; i < x.operands.size() && i < y.operands.size(); ++i) {
        const int order = compare(x.operands[i], y.operands[i]);
        if (order != 0) return order;
    }
    if (x.operands.size() != y.operands.size()) return x.operands.size() < y.operands.size() ? -1 : 1;
    return x.index < y.index ? -1 : 1;
}

std::vector<Id> Graph::topological(const std::vector<Id>& roots) const {
    std::vector<Id> order;
    std::vector<char> state(nodes_.size(), 0);  // 1: on the stack, 2: done
    std::vector<Id> stack;
    for (const Id root : roots) {
        stack.push_back(root);
        while (!stack.empty()) {
            const Id id = stack.back();
            char& seen = state[static_cast<std::size_t>(id)];
            if (seen == 2) {
                stack.pop_back();
            } else if (seen == 1) {
                seen = 2;
                order.push_back(id);
                stack.pop_back();
            } else {
                seen = 1;
                const auto& operands = (*this)[id].operands;
                for (auto operand = operands.rbegin(); operand != operands.rend(); ++operand)
                    if (state[static_cast<std::size_t>(*operand)] == 0) stack.push_back(*operand);
            }
        }
    }
    return order;
}

}  // namespace lobatto
