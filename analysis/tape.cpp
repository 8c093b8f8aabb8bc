// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tape.hpp"

#include <cmath>
#include <map>
#include <string>

#include "generator/formula/real.hpp"
#include "generator/formula/spline.hpp"

namespace lobatto {

using GiNaC::ex;

std::optional<Tape> Tape::of(const ex& formula, const Variables& variables) {
    Tape tape;
    Seen seen;
    if (!tape.append(formula, variables, seen)) return std::nullopt;
    return tape;
}

bool Tape::append(const ex& formula, const Variables& variables, Seen& seen) {
    static const std::map<std::string, double (*)(double)> functions{
        {"sin", std::sin},   {"cos", std::cos},   {"tan", std::tan},   {"exp", std::exp},
        {"log", std::log},   {"sinh", std::sinh}, {"cosh", std::cosh}, {"tanh", std::tanh},
        {"asin", std::asin}, {"acos", std::acos}, {"atan", std::atan}};
    Instruction instruction{Operation::number};
    const bool is_function = GiNaC::is_a<GiNaC::function>(formula), is_power = GiNaC::is_a<GiNaC::power>(formula);
    if (GiNaC::is_a<GiNaC::symbol>(formula)) {
        const auto found = variables.number.find(formula);
        if (found == variables.number.end()) return false;
        instruction.operation = Operation::variable;
        instruction.variable = found->second;
    } else if (const auto before = seen.find(formula); before != seen.end()) {
        std::optional<std::size_t>& slot = instructions_[before->second].slot;
        if (!slot) slot = slots_++;
        instruction.operation = Operation::recall;
        instruction.slot = slot;
    } else if (is_function || is_power || GiNaC::is_a<GiNaC::add>(formula) || GiNaC::is_a<GiNaC::mul>(formula)) {
        for (std::size_t i = is_table_value(formula) ? 2 : 0; i < formula.nops(); ++i)
            if (!append(formula.op(i), variables, seen)) return false;
        instruction.operands = static_cast<int>(formula.nops());
        instruction.operation = is_function                        ? Operation::call
                                : is_power                         ? Operation::power
                                : GiNaC::is_a<GiNaC::add>(formula) ? Operation::sum
                                                                   : Operation::product;
        if (is_table_value(formula)) {
            instruction.operation = Operation::table;
            instruction.operands = 1;
            instruction.spline = &spline_of(GiNaC::ex_to<GiNaC::numeric>(formula.op(0)).to_int());
            instruction.order = GiNaC::ex_to<GiNaC::numeric>(formula.op(1)).to_int();
        } else if (is_function && formula.nops() == 2) {
            if (!is_angle(formula)) return false;
            instruction.operation = Operation::angle;
        } else if (is_function) {
            const auto found = functions.find(GiNaC::ex_to<GiNaC::function>(formula).get_name());
            if (found == functions.end()) return false;
            instruction.function = found->second;
        }
        seen.emplace(formula, instructions_.size());
    } else {
        const ex number = formula.evalf();
        if (!GiNaC::is_a<GiNaC::numeric>(number) || !GiNaC::ex_to<GiNaC::numeric>(number).is_real()) return false;
        instruction.number = GiNaC::ex_to<GiNaC::numeric>(number).to_double();
    }
    instructions_.push_back(instruction);
    return true;
}

Tape::Value Tape::sized(const std::vector<double>& variables) const {
    static thread_local std::vector<double> stack, memory;
    stack.clear();
    memory.resize(slots_);
    double size = 0;
    for (const Instruction& instruction : instructions_) {
        if (instruction.operands == 0) {
            stack.push_back(instruction.operation == Operation::number   ? instruction.number
                            : instruction.operation == Operation::recall ? memory[*instruction.slot]
                                                                         : variables[instruction.variable]);
            size = std::fabs(stack.back());
            continue;
        }
        const auto first = stack.end() - instruction.operands;
        double result = *first;
        if (instruction.operation == Operation::call) result = instruction.function(*first);
        if (instruction.operation == Operation::power) result = std::pow(first[0], first[1]);
        if (instruction.operation == Operation::table) result = (*instruction.spline)(instruction.order, *first);
        if (instruction.operation == Operation::angle) result = std::atan2(first[0], first[1]);
        size = std::fabs(result);
        for (auto operand = first + 1; operand != stack.end(); ++operand) {
            if (instruction.operation == Operation::sum) {
                result += *operand;
                size = std::fmax(size, std::fabs(*operand));
            }
            if (instruction.operation == Operation::product) size = std::fabs(result *= *operand);
        }
        stack.erase(first, stack.end());
        stack.push_back(result);
        if (instruction.slot) memory[*instruction.slot] = result;
    }
    return {stack.back(), size};
}

}  // namespace lobatto
