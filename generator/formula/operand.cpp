// SPDX-License-Identifier: GPL-2.0-or-later
// Beside every constant goes its value at 60 digits; sizes are estimated before anything is computed.
#include "generator/formula/operand.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "generator/formula/spline.hpp"

namespace lobatto {
namespace {

using GiNaC::ex;
using GiNaC::ex_to;
using GiNaC::is_a;
using GiNaC::numeric;

// b bits: 2^(b-1) <= max(|numerator|, denominator) < 2^b.
int bits(const numeric& number) {
    return std::max(abs(number.numer()).int_length(), number.denom().int_length());
}

double size_of(const numeric& number) {
    return std::fabs(number.to_double());
}

// The extent of a whole expression. `left` counts down; at 0 the expression is too large and the rest is not looked at.
void visit(const ex& expression, int level, int function_level, double& left, Bounds& extent) {
    if (--left < 0) return;
    ++extent.size;
    extent.levels = std::max(extent.levels, level);
    extent.function_depth = std::max(extent.function_depth, function_level);
    if (is_a<numeric>(expression)) {
        const numeric& number = ex_to<numeric>(expression);
        extent.real = extent.real && number.is_real();
        if (extent.real) extent.number_bits = std::max(extent.number_bits, double(bits(number)));
        return;
    }
    if (is_a<GiNaC::power>(expression) && is_a<numeric>(expression.op(1)) && !is_a<numeric>(expression.op(0))) {
        const numeric n = ex_to<numeric>(expression.op(1));
        if (n.is_integer()) extent.exponent = std::max(extent.exponent, size_of(n));
    }
    const bool function = is_a<GiNaC::function>(expression);
    for (const ex& operand : expression) visit(operand, level + 1, function_level + function, left, extent);
}

bool within_limits(const Bounds& extent) {
    return extent.number_bits <= ExpressionLimits::number_bits && extent.exponent <= ExpressionLimits::exponent &&
           extent.size <= ExpressionLimits::size && extent.levels <= ExpressionLimits::levels &&
           extent.function_depth <= ExpressionLimits::function_depth;
}

// The number that stands before the names of a sum or product.
bool has_complex_coefficient(const ex& expression) {
    if (!is_a<GiNaC::add>(expression) && !is_a<GiNaC::mul>(expression)) return false;
    const ex last = expression.op(expression.nops() - 1);
    return is_a<numeric>(last) && !ex_to<numeric>(last).is_real();
}

// What two operands hold side by side, with an operation above them.
Bounds joined(const Bounds& a, const Bounds& b) {
    Bounds both;
    both.number_bits = std::max(a.number_bits, b.number_bits);
    both.exponent = std::max(a.exponent, b.exponent);
    both.size = a.size + b.size + 1;
    both.levels = std::max(a.levels, b.levels) + 1;
    both.function_depth = std::max(a.function_depth, b.function_depth);
    return both;
}

// A number times a sum, or a product to a power, becomes one of each term or factor.
Bounds distributed(const Bounds& a, const ex& over) {
    Bounds result = a;
    result.size += 2 * static_cast<double>(over.nops());
    result.levels += 1;
    return result;
}

// The size of an expression and an upper bound for that of its derivative.
struct Slope {
    double size = 1, derivative = 0;
};

Slope slope_of(const ex& expression, const GiNaC::exmap& moving) {
    if (expression.nops() == 0) return {1, moving.count(expression) > 0 ? 1. : 0.};
    std::vector<Slope> parts;
    Slope whole;
    for (const ex& operand : expression) {
        parts.push_back(slope_of(operand, moving));
        whole.size += parts.back().size;
    }
    for (const Slope& part : parts) {
        if (part.derivative == 0) continue;
        whole.derivative += part.derivative + (is_a<GiNaC::add>(expression) ? 1 : 2 * whole.size + 8);
    }
    return whole;
}

}  // namespace

void Work::spend(double operations) {
    left_ -= operations;
    if (left_ < 0)
        throw Refusal(fmt::format("the formulas of the scene, their sums written out, have more than {} operations",
                                  ExpressionLimits::operations));
}

Operand operand_of(const ex& expression) {
    Operand operand;
    operand.expression = expression;
    operand.extent = {};
    operand.extent.size = 0;
    double left = ExpressionLimits::size;
    visit(expression, 1, 0, left, operand.extent);
    for (auto part = expression.preorder_begin(); part != expression.preorder_end(); ++part)
        if (is_a<GiNaC::symbol>(*part)) return operand;
    operand.value = is_a<numeric>(expression) ? ex_to<numeric>(expression) : real_value(expression);
    return operand;
}

void Arithmetic::fail_number() const {
    throw Refusal(fmt::format("an exact number of more than {} bits (about {} digits) occurs here",
                              ExpressionLimits::number_bits, ExpressionLimits::number_bits * 3 / 10));
}

void Arithmetic::fail_size() const {
    throw Refusal(fmt::format("{}, written out, has more than {} numbers, names and operations", formula_,
                              ExpressionLimits::size));
}

// Replaces the upper bounds by what there is.
void Arithmetic::measure(Operand& operand) const {
    Bounds extent;
    extent.size = 0;
    double left = ExpressionLimits::size + 1;
    visit(operand.expression, 1, 0, left, extent);
    operand.extent = extent;
    work_.spend(extent.size / 20);  // a look is so much cheaper than an operation
}

void Arithmetic::check(Operand& result) const {
    if (!within_limits(result.extent) || has_complex_coefficient(result.expression)) measure(result);
    const Bounds& extent = result.extent;
    if (!extent.real) throw Refusal(fmt::format("{} is not a real number here", formula_));
    if (extent.number_bits > ExpressionLimits::number_bits) fail_number();
    if (extent.exponent > ExpressionLimits::exponent)
        throw Refusal(
            fmt::format("an exponent beyond {}; write the formula with smaller powers", ExpressionLimits::exponent));
    if (extent.size > ExpressionLimits::size) fail_size();
    if (extent.levels > ExpressionLimits::levels)
        throw Refusal(fmt::format("{}, with the definitions in it, is nested more than {} deep", formula_,
                                  ExpressionLimits::levels));
    if (extent.function_depth > ExpressionLimits::function_depth)
        throw Refusal(fmt::format("functions of functions in {} are more than {} deep; write it with fewer", formula_,
                                  ExpressionLimits::function_depth));
}

// Computes an expression, and its value when all operands have one; what is too large or not real, and what GiNaC
// throws, is refused.
template <typename Compute, typename Value>
Operand Arithmetic::compute(const std::string& operation, const std::vector<const Operand*>& operands,
                            const Bounds& bound, const Compute& expression, const Value& value) const {
    const bool stays_rational = operation == "+" || operation == "-" || operation == "*";
    double parts = 1;
    Operand result;
    bool constant = true, rational = true;
    for (const Operand* operand : operands) {
        parts += static_cast<double>(operand->expression.nops()) / 3;
        constant = constant && operand->value;
        rational = rational && is_a<numeric>(operand->expression);
        result.moves = result.moves || operand->moves;
        result.velocities = result.velocities || operand->velocities;
        result.inputs = result.inputs || operand->inputs;
    }
    work_.spend(parts);
    try {
        if (constant && !(rational && stays_rational)) result.value = value();
        result.expression = expression();
        result.extent = bound;
        if (is_a<numeric>(result.expression)) {
            const numeric& number = ex_to<numeric>(result.expression);
            result.extent = {};
            result.extent.number_bits = bits(number);
            result.extent.real = number.is_real();
            result.value = number;
        }
        check(result);
        return result;
    } catch (const NoValue& error) {
        throw Refusal(fmt::format("{} has no finite real value here: {}", formula_, error.what()));
    } catch (const Refusal&) {
        throw;
    } catch (const std::exception&) {  // a pole that only GiNaC sees
        throw Refusal(
            fmt::format("{} has no finite real value here: the result of {} is not finite", formula_, operation));
    }
}

// The number of digits, and so of bits, is checked first.
Operand Arithmetic::number(const std::string& written) const {
    std::string digits = written;
    long exponent = 0;
    if (const std::size_t e = digits.find_first_of("eE"); e != std::string::npos) {
        const std::string power = digits.substr(e + 1);
        exponent = power.size() > 6 ? ExpressionLimits::number_bits : std::stol(power);
        digits.resize(e);
    }
    if (const std::size_t point = digits.find('.'); point != std::string::npos) {
        exponent -= static_cast<long>(digits.size() - point - 1);
        digits.erase(point, 1);
    }
    digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size() - 1));
    constexpr long most_digits = ExpressionLimits::number_bits * 3 / 10;  // 10 > 2^(10/3)
    if (static_cast<long>(digits.size()) > most_digits || std::abs(exponent) > most_digits) fail_number();
    const numeric exact = numeric(digits.c_str()) * GiNaC::pow(numeric(10), numeric(exponent));
    return compute(
        written, {}, {}, [&]() -> ex { return exact; }, [&] { return exact; });
}

Operand Arithmetic::add(const Operand& a, const Operand& b) const {
    Bounds bound = joined(a.extent, b.extent);
    bound.number_bits = a.extent.number_bits + b.extent.number_bits + 1;
    return compute(
        "+", {&a, &b}, bound, [&] { return a.expression + b.expression; },
        [&] {
            return real_sum({*a.value, *b.value});
        });
}

Operand Arithmetic::multiply(const Operand& a, const Operand& b) const {
    Bounds bound = joined(distributed(a.extent, a.expression), distributed(b.extent, b.expression));
    bound.number_bits = a.extent.number_bits + b.extent.number_bits;
    bound.exponent = a.extent.exponent + b.extent.exponent + 2;  // q*q is a square
    Operand product = compute(
        "*", {&a, &b}, bound, [&] { return a.expression * b.expression; },
        [&] {
            return real_product({*a.value, *b.value});
        });
    if (a.beyond_switch || b.beyond_switch)
        product.beyond_switch = a.beyond_switch.value_or(a.expression) * b.beyond_switch.value_or(b.expression);
    return product;
}

Operand Arithmetic::negate(const Operand& a) const {
    Operand negative = compute(
        "-", {&a}, distributed(a.extent, a.expression), [&] { return -a.expression; }, [&] { return -*a.value; });
    if (a.beyond_switch) negative.beyond_switch = -*a.beyond_switch;
    return negative;
}

Operand Arithmetic::invert(const Operand& a) const {
    if (a.expression.is_zero() || (a.value && a.value->is_zero()))
        throw Refusal(fmt::format("division by zero in {}", formula_));
    return raise(a, operand_of(-1));
}

Operand Arithmetic::beyond_switch(Operand a) const {
    if (!a.beyond_switch) return a;
    a.expression = *a.beyond_switch;
    measure(a);
    return a;
}

Operand Arithmetic::raise(const Operand& base, const Operand& exponent) const {
    Bounds bound = joined(distributed(base.extent, base.expression), exponent.extent);
    if (is_a<numeric>(exponent.expression)) {
        const numeric n = ex_to<numeric>(exponent.expression);
        const bool number = is_a<numeric>(base.expression);
        // The size of b^n, before it is computed, is at least this; 1 and -1 have one bit and stay small.
        if (number && (bits(ex_to<numeric>(base.expression)) - 1) * abs(n) > ExpressionLimits::number_bits)
            fail_number();
        if (!number && n.is_integer() && abs(n) > ExpressionLimits::exponent)
            throw Refusal(fmt::format("the exponent is beyond {}; write the formula with smaller powers",
                                      ExpressionLimits::exponent));
        // The numbers among the factors of the base come out of the power.
        Operand measured = base;
        const double times = size_of(n) + 1;
        const double most = double{ExpressionLimits::number_bits} * (ExpressionLimits::exponent + 1);
        if (!number && base.extent.number_bits * times > most) measure(measured);
        if (!number && measured.extent.number_bits > 1 && (measured.extent.number_bits - 1) * (times - 1) > most)
            fail_number();
        bound.number_bits = std::max(exponent.extent.number_bits, measured.extent.number_bits * times);
        bound.exponent = std::max(1., measured.extent.exponent) * times;
    }
    if (base.value && base.value->is_zero() && exponent.value && exponent.value->is_negative())
        throw Refusal(fmt::format("division by zero in {}", formula_));
    if (base.expression.is_zero() && !exponent.value) throw Refusal("0 to a power that is not a number");
    if (is_a<numeric>(base.expression) && ex_to<numeric>(base.expression).is_negative() && !exponent.value)
        throw Refusal("a negative number to a power that is not a number; it is real for whole powers only");
    const auto power = [&] {  // GiNaC leaves 0^(2^(1/3)) as it is, and fails to derive it
        const bool is_zero = base.expression.is_zero() && !is_a<numeric>(exponent.expression);
        return is_zero ? ex(0) : GiNaC::pow(base.expression, exponent.expression);
    };
    return compute("^", {&base, &exponent}, bound, power,
                   [&] { return real_power(real_value(*base.value), real_value(*exponent.value)); });
}

Operand Arithmetic::call(const Function& function, const Operand& argument) const {
    Bounds bound = argument.extent;
    bound.size += 2;
    bound.levels += 1;
    bound.function_depth += 1;
    Operand result = compute(
        function.name, {&argument}, bound, [&] { return function.symbolic(argument.expression); },
        [&] { return real_function(function, real_value(*argument.value)); });
    check_call(result);
    return result;
}

void Arithmetic::check_call(Operand& result) const {
    const bool as_written = is_a<GiNaC::function>(result.expression) || is_a<numeric>(result.expression);
    if (as_written) return;  // sqrt(q) is a power, sin(asin(q)) is q
    measure(result);
    check(result);
}

Operand Arithmetic::angle(const Operand& y, const Operand& x) const {
    Bounds bound = joined(y.extent, x.extent);
    bound.function_depth += 1;
    if (y.expression.is_zero() && x.expression.is_zero()) throw Refusal("atan2(0, 0) is no angle");
    Operand result = compute(
        "atan2", {&y, &x}, bound, [&] { return GiNaC::atan2(y.expression, x.expression); },
        [&] { return real_angle(real_value(*y.value), real_value(*x.value)); });
    check_call(result);
    return result;
}

Operand Arithmetic::table(int spline, const Operand& argument) const {
    Bounds bound = argument.extent;
    bound.size += 4;
    bound.levels += 1;
    bound.function_depth += 1;
    return compute(
        "a table", {&argument}, bound, [&] { return ex(table_value(spline, 0, argument.expression)); },
        [&] { return real_table(spline, 0, real_value(*argument.value)); });
}

Operand Arithmetic::derivative(const Operand& a, const Flow& flow) const {
    const Slope slope = slope_of(a.expression, flow.next);
    if (slope.derivative > ExpressionLimits::size) fail_size();
    work_.spend(slope.size + slope.derivative / 4);
    Operand result;
    try {
        result.expression = a.expression.subs(flow.next, GiNaC::subs_options::no_pattern)
                                .diff(flow.dt)
                                .subs(flow.dt == 0, GiNaC::subs_options::no_pattern);
    } catch (const std::exception&) {
        throw Refusal(fmt::format("the time derivative in {} is not finite", formula_));
    }
    measure(result);
    check(result);
    result.moves = a.moves;
    result.velocities = true;
    if (is_a<numeric>(result.expression)) result.value = ex_to<numeric>(result.expression);
    return result;
}

}  // namespace lobatto
