// SPDX-License-Identifier: GPL-2.0-or-later
// Hash-consed expression graph in an order of its own: what GiNaC derives, ready for passes and printing.
//
// GiNaC orders terms by address, differently in every process. Here every sum and product is sorted by structure
// (inputs by their declared order), so the same scene gives the same graph, the same text and the same rounding,
// always.
#pragma once

#include <cln/real.h>
#include <ginac/ginac.h>

#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <vector>

namespace lobatto {

using Id = std::int32_t;

enum class Op : std::uint8_t {
    constant,
    input,
    power,  // operand ^ integer exponent
    sqrt,
    sin,
    cos,
    tan,
    exp,
    log,
    sinh,
    cosh,
    tanh,
    asin,
    acos,
    atan,
    sincos_pair,  // sine and cosine of one argument, computed together
    pair_sine,
    pair_cosine,  // the two halves of a sincos_pair
    raise,        // first operand ^ second operand, any real exponent
    multiply,
    add,            // n-ary
    atan2,          // of two operands, y and x
    side,           // 1 where x > 0, -1 elsewhere; of formulas that no kernel holds
    positive_part,  // x where x > 0, 0 elsewhere (generator/formula/switch.hpp)
    table           // a derivative of a spline; index: 4 times its number plus the order
};

// When a value is known; of an operation, the maximum over its operands. Hoisting is a partition by phase.
enum class Phase : std::uint8_t { constant, parameter, step_size, step, iterate };

struct Node {
    Op op = Op::constant;
    Phase phase = Phase::constant;
    int index = 0;             // constant, input: which; power: the exponent; table
    std::vector<Id> operands;  // add, multiply: sorted
};

// A constant: rational when known exactly, else a float of number_digits or more; how it reads ("sqrt(5)/10") when it
// is not rational. Floats without a label, from the tables of long rules, read as digits.
struct Constant {
    cln::cl_R value;
    std::string label;
};

// An input: how C++ reaches it, and how a person names it (in text, and as local name in emitted code when it is an
// identifier).
struct Input {
    std::string code;  // q[0]
    std::string name;  // theta
    Phase phase = Phase::iterate;
    double start = 0.5;  // near this value the formulas are real, as far as is known
};

// Decimal digits that every computation on constants has at least: working_digits() (formula/real.hpp).
constexpr int number_digits = 60;

// A value left the real numbers: square root or logarithm of a negative number, division by zero.
class DomainError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

class Graph {
public:
    // Leaves.
    Id constant(const cln::cl_R& value, const std::string& label = "");
    Id number(long numerator, long denominator = 1);
    Id input(const Input& input);

    // Operations in canonical form: nested sums and products are flattened, plain constants combined, equal terms
    // and factors collected, operands sorted.
    Id add(const std::vector<Id>& terms);
    Id multiply(const std::vector<Id>& factors);
    Id power(Id base, int exponent);
    Id function(Op op, Id argument);
    Id raise(Id base, Id exponent);
    Id negate(Id x) { return multiply({number(-1), x}); }
    Id subtract(Id x, Id y) { return add({x, negate(y)}); }
    Id divide(Id x, Id y) { return multiply({x, power(y, -1)}); }

    // A node exactly as given, for passes that choose the shape themselves (x * x instead of x^2). Operands keep their
    // order.
    Id raw(Op op, std::vector<Id> operands, int index = 0);

    // A GiNaC expression, with the inputs that its symbols stand for.
    Id from(const GiNaC::ex& expression, const GiNaC::exmap& symbols_to_inputs);

    const Node& operator[](Id id) const { return nodes_[static_cast<std::size_t>(id)]; }
    const Constant& constant_of(Id id) const { return constants_[static_cast<std::size_t>((*this)[id].index)]; }
    const Input& input_of(Id id) const { return inputs_[static_cast<std::size_t>((*this)[id].index)]; }
    const std::vector<Input>& inputs() const { return inputs_; }
    Id size() const { return static_cast<Id>(nodes_.size()); }
    bool is_constant(Id id) const { return (*this)[id].op == Op::constant; }
    bool is_number(Id id, long value) const;
    bool is_negative(Id id) const;  // a constant below zero, or a product that starts with one

    // Total order by structure: constants, inputs in order, powers, functions, products, sums. Independent of ids.
    int compare(Id a, Id b) const;

    // Values of all nodes that `roots` need, at inputs (by input index), to number_digits. DomainError when one is not
    // real.
    std::vector<cln::cl_R> evaluate(const std::vector<cln::cl_R>& inputs, const std::vector<Id>& roots) const;

    // The nodes that the roots need, every operand before its user, in an order that depends on structure only.
    std::vector<Id> topological(const std::vector<Id>& roots) const;

private:
    Id intern(Node node);
    bool leads_with_minus(Id id) const;
    Id negate_terms(Id sum);
    void append_factor(std::vector<Id>& factors, Id base, int exponent);

    std::vector<Node> nodes_;
    std::vector<Constant> constants_;
    std::vector<Input> inputs_;
    std::unordered_map<std::string, Id> known_;
    std::unordered_map<std::uintptr_t, Id> constant_words_;            // by identity
    std::unordered_map<std::uint32_t, std::vector<Id>> constant_ids_;  // by the hash of the value
};

// The value of a constant operation, to number_digits.
cln::cl_R apply(Op op, int exponent, const std::vector<cln::cl_R>& operands);
bool is_rational(const cln::cl_R& value);
bool is_plain(const Constant& constant);  // rational, or a float without label: read as digits, and may be combined

}  // namespace lobatto
