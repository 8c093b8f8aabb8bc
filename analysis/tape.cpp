// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tape.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>

#include "generator/formula/real.hpp"
#include "generator/formula/spline.hpp"

namespace lobatto {

using GiNaC::ex;

namespace {

double positive_part(double x) {
    return x < 0 ? 0 : x;
}
double side_of(double x) {
    return x > 0 ? 1 : x <= 0 ? -1 : x;  // of what is no number none
}

// GiNaC's order of sums and products changes from process to process, and so would the rounding. This one follows from
// what the operands are; not from their signs, which it chooses by its own order: (a - b)^3 is -(b - a)^3.
class Order {
public:
    explicit Order(const Tape::Variables& variables) : variables_(variables) {}

    std::vector<ex> operands(const ex& formula) {
        std::vector<ex> all;
        for (std::size_t i = 0; i < formula.nops(); ++i) all.push_back(formula.op(i));
        if (GiNaC::is_a<GiNaC::add>(formula) || GiNaC::is_a<GiNaC::mul>(formula))
            std::stable_sort(all.begin(), all.end(), [&](const ex& a, const ex& b) { return of(a) < of(b); });
        return all;
    }

private:
    static std::uint64_t mixed(std::uint64_t hash, std::uint64_t more) {
        hash = (hash ^ more) * 0x9E3779B97F4A7C15u;
        return hash ^ (hash >> 29);
    }
    std::uint64_t of(const ex& formula) {
        const auto known = known_.find(formula);
        return known != known_.end() ? known->second : known_.emplace(formula, computed(formula)).first->second;
    }
    std::uint64_t computed(const ex& formula) {
        if (GiNaC::is_a<GiNaC::symbol>(formula)) {
            const auto found = variables_.number.find(formula);
            return mixed(1, found == variables_.number.end() ? 0 : found->second + 1);
        }
        const bool is_product = GiNaC::is_a<GiNaC::mul>(formula);
        std::uint64_t hash = is_product ? 2 : GiNaC::is_a<GiNaC::add>(formula) ? 3 : 4;
        if (GiNaC::is_a<GiNaC::function>(formula)) {
            for (const char letter : GiNaC::ex_to<GiNaC::function>(formula).get_name())
                hash = mixed(hash, static_cast<unsigned char>(letter));
        } else if (!is_product && hash != 3 && !GiNaC::is_a<GiNaC::power>(formula)) {
            const ex number = formula.evalf();
            if (!GiNaC::is_a<GiNaC::numeric>(number)) return 5;
            return mixed(5, std::bit_cast<std::uint64_t>(
                                std::fabs(GiNaC::ex_to<GiNaC::numeric>(GiNaC::real_part(number)).to_double())));
        }
        std::vector<ex> all = operands(formula);
        if (is_product) std::erase_if(all, [](const ex& factor) { return factor.is_equal(-1); });
        if (is_product && all.size() == 1) return of(all.front());
        for (const ex& operand : all) hash = mixed(hash, of(operand));
        return hash;
    }

    const Tape::Variables& variables_;
    std::map<ex, std::uint64_t, GiNaC::ex_is_less> known_;
};

// Exactly, as C++ reads it.
std::string literal(double number) {
    if (std::isinf(number)) return number > 0 ? "(1.0 / 0.0)" : "(-1.0 / 0.0)";
    return fmt::format("({:a})", number);
}

}  // namespace

std::optional<Tape> Tape::of(const ex& formula, const Variables& variables) {
    Tape tape;
    Seen seen;
    Order order(variables);
    const auto operands = [&](const ex& of) { return order.operands(of); };
    if (!tape.append(formula, variables, operands, seen)) return std::nullopt;
    return tape;
}

bool Tape::append(const ex& formula, const Variables& variables, const Operands& operands_of, Seen& seen) {
    static const std::map<std::string, double (*)(double)> functions{
        {"sin", std::sin},   {"cos", std::cos},   {"tan", std::tan},   {"exp", std::exp},
        {"log", std::log},   {"sinh", std::sinh}, {"cosh", std::cosh}, {"tanh", std::tanh},
        {"asin", std::asin}, {"acos", std::acos}, {"atan", std::atan}, {"positive_part", positive_part},
        {"side_of", side_of}};
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
        const std::vector<ex> operands = operands_of(formula);
        for (std::size_t i = is_table_value(formula) ? 2 : 0; i < operands.size(); ++i)
            if (!append(operands[i], variables, operands_of, seen)) return false;
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
            instruction.name = found->first.c_str();
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

std::string Tape::text(const std::string& result, const std::string& indent) const {
    std::string statements;
    std::vector<std::string> stack, memory(slots_);
    for (const Instruction& instruction : instructions_) {
        if (instruction.operands == 0) {
            stack.push_back(instruction.operation == Operation::number   ? fmt::format("({:a})", instruction.number)
                            : instruction.operation == Operation::recall ? memory[*instruction.slot]
                                                                         : fmt::format("x[{}]", instruction.variable));
            continue;
        }
        const auto first = stack.end() - instruction.operands;
        std::string value = *first;
        if (instruction.operation == Operation::call)
            value = instruction.function == positive_part ? fmt::format("{0} < 0 ? 0 : {0}", *first)
                    : instruction.function == side_of
                        ? fmt::format("{0} > 0 ? 1 : {0} <= 0 ? -1 : {0}", *first)
                        : fmt::format("LOBATTO_LIBRARY({})({})", instruction.name, *first);
        if (instruction.operation == Operation::angle)
            value = fmt::format("LOBATTO_LIBRARY(atan2)({}, {})", first[0], first[1]);
        if (instruction.operation == Operation::power)
            value = first[1] == literal(2) ? fmt::format("{0} * {0}", first[0])
                                           : fmt::format("LOBATTO_LIBRARY(pow)({}, {})", first[0], first[1]);
        if (instruction.operation == Operation::sum) value = fmt::format("{}", fmt::join(first, stack.end(), " + "));
        if (instruction.operation == Operation::product)
            value = fmt::format("{}", fmt::join(first, stack.end(), " * "));
        const std::string name = fmt::format("t{}", &instruction - instructions_.data());
        statements += fmt::format("{}const double {} = {};\n", indent, name, value);
        stack.erase(first, stack.end());
        stack.push_back(name);
        if (instruction.slot) memory[*instruction.slot] = name;
    }
    return statements + fmt::format("{}{} = {} + 0.0;\n", indent, result, stack.back());
}

}  // namespace lobatto
