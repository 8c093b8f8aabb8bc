// SPDX-License-Identifier: GPL-2.0-or-later
// Exact arithmetic on expressions whose sizes are known, so that nothing too large and nothing without a finite real
// value is ever computed.
#pragma once

#include <ginac/ginac.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "generator/formula/real.hpp"

namespace lobatto {

// Bounds, stated in docs/scene_format.md and in the errors.
struct ExpressionLimits {
    static constexpr int depth = 200;              // nested parentheses, functions, signs and powers of one formula
    static constexpr int levels = 500;             // of an expression, definitions and sums written out
    static constexpr int function_depth = 16;      // functions in arguments of functions
    static constexpr int length = 100000;          // bytes of one formula
    static constexpr int exponent = 64;            // |integer exponent| of anything but a number
    static constexpr int number_bits = 4096;       // size of an exact number
    static constexpr long size = 1'000'000;        // numbers, names and operations of an expression, written out
    static constexpr long operations = 2'000'000;  // of all formulas of a scene, sums written out
};

// Upper bounds of what an expression holds. They grow with every operation, without a look at the whole expression; the
// whole is measured only when a bound passes its limit.
struct Bounds {
    double number_bits = 0;  // of the largest exact number
    double exponent = 0;     // the largest whole exponent of anything but a number
    double size = 1;         // numbers, names and operations
    int levels = 1;
    int function_depth = 0;
    bool real = true;  // free of complex numbers
};

struct Operand {
    GiNaC::ex expression;
    std::optional<GiNaC::numeric> value;  // present when the expression is constant: exact, or 60 digits
    Bounds extent;
    // What occurs in it.
    bool moves = false;  // positions or the time
    bool velocities = false;
    bool inputs = false;
    // Of a product with a factor max(u, 0) or abs(u): the product with the positive part of that factor
    // (switch.hpp).
    std::optional<GiNaC::ex> beyond_switch = {};
};

// What a formula asks for and cannot have, as a sentence without its place.
class Refusal : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

// What the formulas of one scene may cost; shared by all of them.
class Work {
public:
    void spend(double operations);  // throws Refusal

private:
    double left_ = ExpressionLimits::operations;
};

// How what moves goes on for an infinitesimal time: q -> q + dt q', t -> t + dt.
struct Flow {
    GiNaC::symbol dt{"dt"};
    GiNaC::exmap next;
};

// Its functions throw Refusal; `formula` is how to speak of what is computed ("the Lagrangian").
class Arithmetic {
public:
    Arithmetic(const std::string& formula, Work& work) : formula_(formula), work_(work) {}

    Operand number(const std::string& written) const;  // "0.1" is 1/10
    Operand add(const Operand& a, const Operand& b) const;
    Operand multiply(const Operand& a, const Operand& b) const;
    Operand negate(const Operand& a) const;
    Operand invert(const Operand& a) const;
    Operand beyond_switch(Operand a) const;  // as the base of a broken power
    Operand raise(const Operand& base, const Operand& exponent) const;
    Operand call(const Function& function, const Operand& argument) const;
    Operand angle(const Operand& y, const Operand& x) const;   // atan2(y, x)
    Operand table(int spline, const Operand& argument) const;  // its value there
    // d/dt of an expression without velocities.
    Operand derivative(const Operand& a, const Flow& flow) const;

private:
    template <typename Compute, typename Value>
    Operand compute(const std::string& operation, const std::vector<const Operand*>& operands, const Bounds& bound,
                    const Compute& expression, const Value& value) const;
    void check(Operand& result) const;
    void check_call(Operand& result) const;
    void measure(Operand& operand) const;
    [[noreturn]] void fail_number() const;
    [[noreturn]] void fail_size() const;

    const std::string& formula_;
    Work& work_;
};

// Of an expression that is known to be small: a symbol, a number.
Operand operand_of(const GiNaC::ex& expression);

}  // namespace lobatto
