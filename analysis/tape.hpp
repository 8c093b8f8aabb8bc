// SPDX-License-Identifier: GPL-2.0-or-later
// A formula in double, as instructions one after another: for what is looked at often and needs few digits.
#pragma once

#include <ginac/ginac.h>

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace lobatto {

class Spline;

class Tape {
public:
    // Symbols, numbered in this order.
    struct Variables {
        Variables(const std::vector<GiNaC::symbol>& symbols) {  // NOLINT(google-explicit-constructor)
            for (const auto& symbol : symbols) number.emplace(symbol, number.size());
        }
        std::map<GiNaC::ex, std::size_t, GiNaC::ex_is_less> number;
    };
    // Nothing: the formula holds a function or a symbol that is not known.
    static std::optional<Tape> of(const GiNaC::ex& formula, const Variables& variables);

    struct Value {
        double value, size;  // size: the largest term, of a sum
    };
    Value sized(const std::vector<double>& variables) const;
    // Zero has no sign: that of -(a - b) and b - a would be another.
    double operator()(const std::vector<double>& variables) const { return sized(variables).value + 0.0; }
    // The same as C++ statements that set `result`; the variables are x[0], x[1], ... Without tables.
    std::string text(const std::string& result, const std::string& indent) const;

private:
    enum class Operation { number, variable, recall, sum, product, power, call, angle, table };
    struct Instruction {
        Operation operation;
        double number = 0;
        std::size_t variable = 0;
        int operands = 0;
        double (*function)(double) = nullptr;
        const char* name = nullptr;      // of the function
        const Spline* spline = nullptr;  // table
        int order = 0;
        std::optional<std::size_t> slot = std::nullopt;  // of the memory: where its result stays, or is found again
    };
    using Seen = std::map<GiNaC::ex, std::size_t, GiNaC::ex_is_less>;  // parts of the formula, and their instructions
    using Operands =
        std::function<std::vector<GiNaC::ex>(const GiNaC::ex&)>;  // in an order that is the same everywhere
    bool append(const GiNaC::ex& formula, const Variables& variables, const Operands& operands_of, Seen& seen);

    std::vector<Instruction> instructions_;  // operands come before what is done with them
    std::size_t slots_ = 0;
};

}  // namespace lobatto
