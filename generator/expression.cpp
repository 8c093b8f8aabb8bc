// SPDX-License-Identifier: GPL-2.0-or-later
// Recursive descent over the tokens of a formula. Beside every constant subexpression goes its value at 60 digits, so
// that what has no finite real value is refused where it stands; sizes are estimated before anything is computed.
//     sum     = product { (+ | -) product }
//     product = signed { (* | /) signed }
//     signed  = { + | - } power
//     power   = primary [ ^ signed ]
//     primary = number | name | function ( sum ) | ( sum )
#include "generator/expression.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>

#include "generator/real.hpp"
#include "generator/suggest.hpp"
#include "generator/token.hpp"

namespace lobatto {
namespace {

using GiNaC::ex;
using GiNaC::ex_to;
using GiNaC::is_a;
using GiNaC::numeric;

struct Operand {
    ex expression;
    std::optional<numeric> value;  // present when the expression is constant
};

// b bits: 2^(b-1) <= max(|numerator|, denominator) < 2^b.
int bits(const numeric& number) {
    return std::max(abs(number.numer()).int_length(), number.denom().int_length());
}

// The largest exact number in an expression, and the largest exponent of anything but a number.
struct Extent {
    int number_bits = 0;
    numeric exponent = 0;
    bool real = true;

    void visit(const ex& expression) {
        if (is_a<numeric>(expression)) {
            real = real && expression.info(GiNaC::info_flags::real);
            if (real) number_bits = std::max(number_bits, bits(ex_to<numeric>(expression)));
        }
        if (is_a<GiNaC::power>(expression) && is_a<numeric>(expression.op(1))) {
            const numeric n = abs(ex_to<numeric>(expression.op(1)));
            if (!is_a<numeric>(expression.op(0)) && n.is_integer() && n > exponent) exponent = n;
        }
        for (const ex& operand : expression) visit(operand);
    }
};

class Parser {
public:
    Parser(const Source& source, const Text& text, const Scope& scope, std::map<std::string, bool>* used)
        : source_(source), scope_(scope), used_(used), tokens_(tokenise(source, text, scope.formula)) {}

    ex run() {
        if (token().kind == Token::Kind::end) fail(token(), fmt::format("{} is empty", scope_.formula));
        const Operand whole = read_sum();
        if (token().is(')')) fail(token(), "this ) closes nothing: remove it, or add a ( before it");
        if (token().kind != Token::Kind::end) fail_missing_operator();
        return whole.expression;
    }

private:
    const Token& token() const { return tokens_[next_]; }
    [[noreturn]] void fail(const Token& at, const std::string& message) const { source_.fail(at.at, message); }

    [[noreturn]] void fail_missing_operator() const {
        const std::string_view left = tokens_[next_ - 1].text, right = token().text;
        fail(token(), fmt::format("missing operator: write {}*{}", left.substr(0, 40), right.substr(0, 40)));
    }

    // Computes an expression; what GiNaC throws, and what is too large or not real, is an error at the operator.
    template <typename Compute>
    Operand compute(const Token& at, const std::vector<Operand>& operands, const Compute& expression,
                    const std::function<numeric(const std::vector<numeric>&)>& value) const {
        try {
            std::vector<numeric> values;
            for (const Operand& operand : operands)
                if (operand.value) values.push_back(*operand.value);
            Operand result;
            if (values.size() == operands.size()) result.value = value(values);
            result.expression = expression();
            bound(at, result.expression);
            if (is_a<numeric>(result.expression)) result.value = real_value(ex_to<numeric>(result.expression));
            return result;
        } catch (const NoValue& error) {
            fail(at, fmt::format("{} has no finite real value here: {}", scope_.formula, error.what()));
        } catch (const InputError&) {
            throw;
        } catch (const std::exception&) {  // a pole that only GiNaC sees
            fail(at, fmt::format("{} has no finite real value here: the result of {} is not finite", scope_.formula,
                                 at.text));
        }
    }

    void bound(const Token& at, const ex& expression) const {
        Extent extent;
        extent.visit(expression);
        if (!extent.real) fail(at, fmt::format("{} is not a real number here", scope_.formula));
        if (extent.number_bits > ExpressionLimits::number_bits) fail_number(at);
        if (extent.exponent > ExpressionLimits::exponent)
            fail(at, fmt::format("an exponent beyond {}; write the formula with smaller powers",
                                 ExpressionLimits::exponent));
    }
    [[noreturn]] void fail_number(const Token& at) const {
        fail(at, fmt::format("an exact number of more than {} bits (about {} digits) occurs here",
                             ExpressionLimits::number_bits, ExpressionLimits::number_bits * 3 / 10));
    }

    // Combines neighbours in pairs, so that long sums cost n log n and no intermediate number can grow unseen.
    using Combine = Operand (Parser::*)(const Token& at, const Operand& left, const Operand& right) const;
    struct Part {
        Operand operand;
        Token at;  // the operator before it
    };
    Operand fold(std::vector<Part> parts, Combine combine) const {
        while (parts.size() > 1) {
            std::vector<Part> pairs;
            for (std::size_t i = 0; i < parts.size(); i += 2) {
                pairs.push_back(parts[i]);
                if (i + 1 < parts.size())
                    pairs.back().operand = (this->*combine)(parts[i + 1].at, parts[i].operand, parts[i + 1].operand);
            }
            parts = std::move(pairs);
        }
        return parts.front().operand;
    }
    Operand add(const Token& at, const Operand& a, const Operand& b) const {
        return compute(
            at, {a, b}, [&] { return a.expression + b.expression; }, real_sum);
    }
    Operand multiply(const Token& at, const Operand& a, const Operand& b) const {
        return compute(
            at, {a, b}, [&] { return a.expression * b.expression; }, real_product);
    }
    Operand negate(const Operand& a) const {
        Operand result{-a.expression, a.value};
        if (result.value) result.value = -*result.value;
        return result;
    }
    Operand invert(const Token& at, const Operand& a) const {
        if (a.expression.is_zero() || (a.value && a.value->is_zero()))
            fail(at, fmt::format("division by zero in {}", scope_.formula));
        return raise(at, a, {-1, numeric(-1)});
    }

    Operand raise(const Token& at, const Operand& base, const Operand& exponent) const {
        if (is_a<numeric>(exponent.expression)) {
            const numeric n = ex_to<numeric>(exponent.expression);
            if (is_a<numeric>(base.expression)) {
                // The size of b^n, before it is computed, is at least this; 1 and -1 have one bit and stay small.
                if ((bits(ex_to<numeric>(base.expression)) - 1) * abs(n) > ExpressionLimits::number_bits)
                    fail_number(at);
            } else if (n.is_integer() && abs(n) > ExpressionLimits::exponent) {
                fail(at, fmt::format("the exponent is beyond {}; write the formula with smaller powers",
                                     ExpressionLimits::exponent));
            }
        }
        if (base.value && base.value->is_zero() && exponent.value && exponent.value->is_negative())
            fail(at, fmt::format("division by zero in {}", scope_.formula));
        if (base.expression.is_zero() && !exponent.value) fail(at, "0 to a power that is not a number");
        return compute(
            at, {base, exponent}, [&] { return GiNaC::pow(base.expression, exponent.expression); },
            [](const std::vector<numeric>& v) { return real_power(v[0], v[1]); });
    }

    Operand read_sum() {
        std::vector<Part> terms{{read_product(), token()}};
        while (token().is('+') || token().is('-')) {
            const Token sign = tokens_[next_++];
            const Operand term = read_product();
            terms.push_back({sign.is('-') ? negate(term) : term, sign});
        }
        return fold(std::move(terms), &Parser::add);
    }

    Operand read_product() {
        std::vector<Part> factors{{read_signed(), token()}};
        while (token().is('*') || token().is('/')) {
            const Token sign = tokens_[next_++];
            const Operand factor = read_signed();
            factors.push_back({sign.is('/') ? invert(sign, factor) : factor, sign});
        }
        return fold(std::move(factors), &Parser::multiply);
    }

    // Every way to nest passes through here.
    Operand read_signed() {
        if (++depth_ > ExpressionLimits::depth)
            fail(token(), fmt::format("{} is nested more than {} deep; write it with fewer parentheses and powers",
                                      scope_.formula, ExpressionLimits::depth));
        bool negative = false;
        for (; token().is('+') || token().is('-'); ++next_) negative ^= token().is('-');
        const Operand power = read_power();
        --depth_;
        return negative ? negate(power) : power;
    }

    Operand read_power() {
        const Operand base = read_primary();
        if (!token().is('^')) return base;
        const Token sign = tokens_[next_++];
        return raise(sign, base, read_signed());
    }

    Operand read_primary() {
        const Token first = token();
        if (first.kind == Token::Kind::number) return ++next_, follow(read_number(first));
        if (first.is('(')) return follow(read_parenthesis());
        if (first.kind == Token::Kind::name) {
            ++next_;
            const Function* function = find_function(std::string(first.text));
            return follow(function != nullptr ? read_call(first, *function) : read_name(first));
        }
        if (first.kind == Token::Kind::end && next_ > 0)
            fail(first, fmt::format("{} ends after '{}': a number, a name or ( is missing", scope_.formula,
                                    tokens_[next_ - 1].text));
        if (first.is(')') && next_ > 0 && tokens_[next_ - 1].is('(')) fail(first, "nothing stands between ( and )");
        fail(first, fmt::format("a number, a name or ( is missing before '{}'", first.text));
    }

    // After something complete, nothing that begins something new.
    Operand follow(const Operand& operand) const {
        if (token().kind == Token::Kind::number || token().kind == Token::Kind::name || token().is('('))
            fail_missing_operator();
        return operand;
    }

    Operand read_parenthesis() {
        const Token open = tokens_[next_++];
        const Operand inside = read_sum();
        if (token().kind == Token::Kind::end) fail(open, "this ( is not closed: add a )");
        ++next_;  // the only thing that ends a sum, but for the end, is )
        return inside;
    }

    // Exact: 0.1 is 1/10. The number of digits, and so of bits, is checked first.
    Operand read_number(const Token& number) const {
        std::string digits(number.text);
        long exponent = 0;
        if (const std::size_t e = digits.find_first_of("eE"); e != std::string::npos) {
            const std::string written = digits.substr(e + 1);
            exponent = written.size() > 6 ? ExpressionLimits::number_bits : std::stol(written);
            digits.resize(e);
        }
        if (const std::size_t point = digits.find('.'); point != std::string::npos) {
            exponent -= static_cast<long>(digits.size() - point - 1);
            digits.erase(point, 1);
        }
        digits.erase(0, std::min(digits.find_first_not_of('0'), digits.size() - 1));
        constexpr long most_digits = ExpressionLimits::number_bits * 3 / 10;  // 10 > 2^(10/3)
        if (static_cast<long>(digits.size()) > most_digits || std::abs(exponent) > most_digits) fail_number(number);
        const numeric exact = numeric(digits.c_str()) * GiNaC::pow(numeric(10), numeric(exponent));
        return compute(
            number, {}, [&]() -> ex { return exact; }, real_sum);
    }

    Operand read_call(const Token& name, const Function& function) {
        if (token().is('^')) fail(token(), fmt::format("write {0}(...)^2 instead of {0}^2(...)", name.text));
        if (!token().is('('))
            fail(name, fmt::format("{0} needs parentheses: write {0}({1})", name.text,
                                   token().kind == Token::Kind::end ? "..." : token().text.substr(0, 40)));
        if (++function_depth_ > ExpressionLimits::function_depth)
            fail(name, fmt::format("functions of functions in {} are more than {} deep; write it with fewer",
                                   scope_.formula, ExpressionLimits::function_depth));
        const Operand argument = read_parenthesis();
        --function_depth_;
        return compute(
            name, {argument}, [&] { return function.symbolic(argument.expression); },
            [&](const std::vector<numeric>& v) { return real_function(function, v[0]); });
    }

    Operand read_name(const Token& token_of_name) {
        const std::string name(token_of_name.text);
        if (name == "pi") return {GiNaC::Pi, real_value(GiNaC::Pi)};
        const auto found = scope_.names.find(name);
        if (found == scope_.names.end()) fail_unknown(token_of_name, name);
        const Name& meaning = found->second;
        if (meaning.role == Name::Role::velocity && !scope_.velocities_allowed)
            fail(token_of_name, fmt::format("the velocity {} cannot occur in {}: write it with numbers and parameters",
                                            name, scope_.formula));
        if (meaning.role == Name::Role::position && !scope_.positions_allowed)
            fail(token_of_name,
                 fmt::format("the coordinate {} cannot occur in {}: write it with numbers and parameters", name,
                             scope_.formula));
        if (used_ != nullptr) (*used_)[name] = true;
        Operand operand{meaning.value, std::nullopt};
        if (!has_symbols(meaning.value)) operand.value = real_value(meaning.value);
        return operand;
    }

    static bool has_symbols(const ex& expression) {
        for (auto i = expression.preorder_begin(); i != expression.preorder_end(); ++i)
            if (is_a<GiNaC::symbol>(*i)) return true;
        return false;
    }

    [[noreturn]] void fail_unknown(const Token& at, const std::string& name) const {
        const std::string shown = name.substr(0, 40);
        if (at.primed) {
            const std::string base = name.substr(0, name.size() - 1);
            if (scope_.names.count(base) > 0 && scope_.names.at(base).role == Name::Role::parameter)
                fail(at, fmt::format("{} is a parameter and has no velocity; only coordinates have one", base));
        }
        std::vector<std::string> declared;
        for (const auto& [declared_name, meaning] : scope_.names) {
            const bool allowed = (meaning.role != Name::Role::velocity || scope_.velocities_allowed) &&
                                 (meaning.role != Name::Role::position || scope_.positions_allowed);
            if (allowed) declared.push_back(declared_name);
        }
        if (token().is('(')) {
            std::vector<std::string> names;
            for (const Function& function : functions()) names.push_back(function.name);
            const std::string near = name == "ln" ? " Write log." : suggestion(name, names);
            fail(at, fmt::format("unknown function '{}' in {}; there are {}.{}", shown, scope_.formula, listing(names),
                                 near));
        }
        if (declared.empty())
            fail(at, fmt::format("unknown name '{}' in {}: only numbers, pi and functions of them may stand here",
                                 shown, scope_.formula));
        fail(at, fmt::format("unknown name '{}' in {}; declared: {}.{}", shown, scope_.formula, listing(declared),
                             suggestion(name, declared)));
    }

    const Source& source_;
    const Scope& scope_;
    std::map<std::string, bool>* used_;
    const std::vector<Token> tokens_;
    std::size_t next_ = 0;
    int depth_ = 0;
    int function_depth_ = 0;
};

}  // namespace

GiNaC::ex parse_expression(const Source& source, const Text& text, const Scope& scope,
                           std::map<std::string, bool>* used) {
    if (text.value.size() > ExpressionLimits::length)
        source.fail(text.at.front(), fmt::format("{} has {} characters; at most {} are read", scope.formula,
                                                 text.value.size(), ExpressionLimits::length));
    return Parser(source, text, scope, used).run();
}

GiNaC::numeric value_in_range(const Source& source, Position at, const GiNaC::ex& expression,
                              const std::string& formula, const GiNaC::exmap& symbols) {
    static const numeric largest = GiNaC::pow(numeric(10), numeric(300));
    try {
        const numeric value = real_value(expression, symbols);
        if (!value.is_zero() && (abs(value) > largest || abs(value) < 1 / largest))
            source.fail(at, fmt::format("{} must be 0, or of a size between 1e-300 and 1e300", formula));
        return value;
    } catch (const NoValue& error) {
        source.fail(at, fmt::format("{} has no finite real value: {}", formula, error.what()));
    }
}

}  // namespace lobatto
