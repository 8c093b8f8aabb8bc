// SPDX-License-Identifier: GPL-2.0-or-later
// Recursive descent over the tokens of a formula.
//     sum     = product { (+ | -) product }
//     product = signed { (* | /) signed }
//     signed  = { + | - } power
//     power   = primary [ ^ signed ]
//     primary = number | name [ '[' sum { , sum } ']' ] [ ' ] | function ( sum ) | ( sum )
//             | name ( sum { , sum } )  of a body
//             | sum ( name = sum .. sum , sum ) | mod ( sum , sum ) | table ( "file" , sum )
#include "generator/formula/formula.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "generator/formula/parser.hpp"
#include "generator/formula/text/suggest.hpp"

namespace lobatto {
namespace {

// What stands where it has no meaning, and what to write.
constexpr std::pair<char, std::string_view> stray_signs[] = {
    {'[', "write ( instead"},
    {']', "write ) instead"},
    {',', "decimals have a point, and functions have no more arguments"},
    {'=', "a formula is one side only"},
    {'.', "two points stand only in a sum, as in sum(i = 1 .. n, formula)"},
    {'\'', "a prime belongs directly after the name of a coordinate"},
    {'<', "a comparison stands only in if(a < b, c, d); an event is written a = b falling"},
    {'>', "a comparison stands only in if(a > b, c, d); an event is written a = b rising"}};

constexpr std::string_view form_of_series = "a sum is written sum(i = 1 .. n, formula)";

}  // namespace

Syntax Parser::formula() {
    refuse_emptiness();
    Syntax whole = read_sum();
    refuse_rest();
    return whole;
}

EventSyntax Parser::crossing(const std::string& what, const std::string& form) {
    refuse_emptiness();
    has_direction_ = true;
    Syntax left = read_sum();
    if (!token().is('=')) fail_rest(what + " is written " + form);
    const Token equals = tokens_[next_++];
    Syntax right = read_sum();
    EventSyntax crossing;
    if (at_direction()) crossing.direction = tokens_[next_++].text == "rising" ? 1 : -1;
    if (token().is('=')) fail(token(), what + " has one =");
    refuse_rest();
    Syntax& difference = crossing.difference;
    difference = node(Kind::sum, equals);
    difference.signs = {equals, equals};
    difference.operands.push_back(std::move(left));
    difference.operands.push_back(node(Kind::negation, equals, std::move(right)));
    return crossing;
}

Subject Parser::subject() {
    Subject subject;
    subject.name = token();
    if (token().kind != Token::Kind::name || token().primed)
        fail(token(), fmt::format("a line of {} begins with a name, as in x = or \"x[i]\" =", scope_.formula));
    ++next_;
    if (token().is('[')) {
        const Token open = tokens_[next_++];
        subject.subscripted = true;
        const bool names = token().kind == Token::Kind::name && !token().primed && find(token().text) == nullptr;
        if (names) {
            subject.indices = read_indices();
        } else {
            subject.subscript = read_sum();
        }
        expect(']', open);
    }
    if (token().kind != Token::Kind::end)
        fail(token(), fmt::format("'{}' is too much here: a line of {} begins with x = or \"x[i]\" =", token().text,
                                  scope_.formula));
    return subject;
}

void Parser::refuse_emptiness() const {
    if (token().kind == Token::Kind::end) fail(token(), fmt::format("{} is empty", scope_.formula));
}

[[noreturn]] void Parser::fail_missing_operator() const {
    const std::string_view left = tokens_[next_ - 1].text, right = token().text;
    const bool is_unknown =
        token().kind == Token::Kind::name && !at_direction() && find(token().text) == nullptr && right.size() > 2;
    if (has_direction_ && is_unknown && !suggestion(std::string(right), {"rising", "falling"}).empty())
        fail(token(), fmt::format("'{}' is no direction: write rising or falling", right.substr(0, 40)));
    if (has_direction_ && token().kind == Token::Kind::name && !at_direction() && find(right) == nullptr)
        fail(token(), fmt::format("'{}' is no direction: after an event write rising or falling, or nothing",
                                  right.substr(0, 40)));
    if (find(right) == nullptr && (right == "and" || right == "or" || right == "not"))
        fail(token(), fmt::format("there is no '{}' in formulas: write one if inside another", right));
    static constexpr std::array units{"m",  "s",  "kg",  "N",  "rad", "deg", "Hz", "mm",      "cm",
                                      "km", "ms", "min", "Nm", "J",   "W",   "Pa", "degrees", "seconds"};
    const bool calls = next_ + 1 < tokens_.size() && tokens_[next_ + 1].is('(');  // min(q, 1)
    if (tokens_[next_ - 1].kind == Token::Kind::number && find(right) == nullptr && !calls &&
        std::find(units.begin(), units.end(), right) != units.end())
        fail(token(), right.starts_with("deg")
                          ? fmt::format("angles are in radians: write {}*pi/180", left)
                          : fmt::format("numbers have no units: leave '{0}' out, or write {1}*{0} for a parameter {0}",
                                        right, left));
    fail(token(), fmt::format("missing operator: write {}*{}", left.substr(0, 40), right.substr(0, 40)));
}

// What follows something complete is a sign or the end.
void Parser::refuse_rest() const {
    if (token().kind != Token::Kind::end) fail_rest("");
}

[[noreturn]] void Parser::fail_rest(const std::string& at_end) const {
    if (token().kind == Token::Kind::end) fail(token(), at_end);
    if (token().is(')')) fail(token(), "this ) closes nothing: remove it, or add a ( before it");
    for (const auto& [sign, mend] : stray_signs)
        if (token().is(sign))
            fail(token(), fmt::format("unexpected character '{}' in {}: {}", token().text, scope_.formula, mend));
    fail_missing_operator();
}

void Parser::expect(char sign, const Token& open) {
    if (token().kind == Token::Kind::end) fail(open, fmt::format("this {} is not closed: add a {}", open.text, sign));
    if (!token().is(sign) && token().is(')'))
        fail(token(), fmt::format("this ) closes nothing: a {} is missing before it", sign));
    if (!token().is(sign)) fail_rest("");
    ++next_;
}

Syntax Parser::read_sum() {
    Syntax whole = node(Kind::sum, token());
    whole.signs.push_back(token());
    whole.operands.push_back(read_product());
    while (token().is('+') || token().is('-')) {
        const Token sign = tokens_[next_++];
        whole.signs.push_back(sign);
        Syntax term = read_product();
        whole.operands.push_back(sign.is('-') ? node(Kind::negation, sign, std::move(term)) : std::move(term));
    }
    return unwrapped(std::move(whole));
}

Syntax Parser::read_product() {
    Syntax whole = node(Kind::product, token());
    whole.signs.push_back(token());
    whole.operands.push_back(read_signed());
    while (token().is('*') || token().is('/')) {
        const Token sign = tokens_[next_++];
        whole.signs.push_back(sign);
        Syntax factor = read_signed();
        whole.operands.push_back(sign.is('/') ? node(Kind::inverse, sign, std::move(factor)) : std::move(factor));
    }
    return unwrapped(std::move(whole));
}

Syntax Parser::unwrapped(Syntax whole) {
    if (whole.operands.size() > 1) return whole;
    Syntax only = std::move(whole.operands.front());
    return only;
}

// Every way to nest passes through here.
Syntax Parser::read_signed() {
    if (++depth_ > ExpressionLimits::depth)
        fail(token(), fmt::format("{} is nested more than {} deep; write it with fewer parentheses and powers",
                                  scope_.formula, ExpressionLimits::depth));
    const Token first = token();
    bool negative = false;
    for (; token().is('+') || token().is('-'); ++next_) negative ^= token().is('-');
    Syntax power = read_power();
    --depth_;
    return negative ? node(Kind::negation, first, std::move(power)) : power;
}

Syntax Parser::read_power() {
    Syntax base = read_primary();
    if (!token().is('^')) return base;
    const Token sign = tokens_[next_++];
    return node(Kind::power, sign, std::move(base), read_signed());
}

Syntax Parser::read_primary() {
    const Token first = token();
    if (first.kind == Token::Kind::number) return ++next_, follow(node(Kind::number, first));
    if (first.is('(')) return follow(read_parenthesis());
    if (first.kind == Token::Kind::name) {
        ++next_;
        if (first.text == "sum") return follow(read_series(first));
        if (first.text == "mod") return follow(read_remainder(first));
        if (first.text == "table") return follow(read_table(first));
        const Function* function = find_function(std::string(first.text));
        if (function == nullptr && is_function_name(std::string(first.text))) return follow(read_pieced(first));
        return follow(function != nullptr ? read_call(first, *function) : read_name(first));
    }
    if (first.kind == Token::Kind::end && next_ > 0)
        fail(first, fmt::format("{} ends after '{}': a number, a name or ( is missing", scope_.formula,
                                tokens_[next_ - 1].text));
    if (first.is(')') && next_ > 0 && tokens_[next_ - 1].is('(')) fail(first, "nothing stands between ( and )");
    if (first.is('[') || first.is('.') || first.is('\'')) fail_rest("");
    if (first.is('=') && next_ > 0 && tokens_[next_ - 1].is('=')) fail(first, "write one =, not ==");
    fail(first, fmt::format("a number, a name or ( is missing before '{}'", first.text));
}

bool Parser::at_direction() const {
    return has_direction_ && token().kind == Token::Kind::name &&
           (token().text == "rising" || token().text == "falling");
}

// After something complete, nothing that begins something new.
Syntax Parser::follow(Syntax operand) const {
    const bool begins = token().kind == Token::Kind::number || token().kind == Token::Kind::name || token().is('(');
    if (begins && !at_direction()) fail_missing_operator();
    return operand;
}

Syntax Parser::read_parenthesis() {
    const Token open = tokens_[next_++];
    Syntax inside = read_sum();
    expect(')', open);
    return inside;
}

Syntax Parser::read_call(const Token& name, const Function& function) {
    const bool end = token().kind == Token::Kind::end;
    refuse_without_parenthesis(name, fmt::format("{}({})", name.text, end ? "..." : token().text.substr(0, 40)));
    if (++function_depth_ > ExpressionLimits::function_depth)
        fail(name, fmt::format("functions of functions in {} are more than {} deep; write it with fewer",
                               scope_.formula, ExpressionLimits::function_depth));
    Syntax call = node(Kind::call, name, read_parenthesis());
    --function_depth_;
    call.function = &function;
    return call;
}

Syntax Parser::read_series(const Token& name) {
    refuse_without_parenthesis(name, "sum(i = 1 .. n, formula)");
    const Token open = tokens_[next_++];
    const Token index = token();
    if (index.kind != Token::Kind::name || index.primed || !tokens_[next_ + 1].is('='))
        fail(index, std::string(form_of_series));
    refuse_index(index);
    next_ += 2;
    Syntax series = node(Kind::series, name, read_sum());
    if (!token().is('.')) fail(token(), std::string(form_of_series));
    ++next_;
    series.operands.push_back(read_sum());
    if (!token().is(',')) fail(token(), std::string(form_of_series));
    ++next_;
    series.index_name = index.text;
    indices_.emplace_back(index.text);
    series.operands.push_back(read_sum());
    indices_.pop_back();
    expect(')', open);
    return series;
}

Syntax Parser::read_remainder(const Token& name) {
    refuse_without_parenthesis(name, "mod(a, b)");
    const Token open = tokens_[next_++];
    Syntax remainder = node(Kind::remainder, name, read_sum());
    if (!token().is(',')) fail(token(), "a remainder is written mod(a, b)");
    ++next_;
    remainder.operands.push_back(read_sum());
    expect(')', open);
    return remainder;
}

Syntax Parser::read_table(const Token& name) {
    constexpr std::string_view form = "table(\"file.csv\", a)";
    refuse_without_parenthesis(name, std::string(form));
    const Token open = tokens_[next_++], file = token();
    if (file.kind != Token::Kind::text)
        fail(file, fmt::format("measured values are written {}, with the name of a file in quotes", form));
    if (!tokens_[++next_].is(',')) fail(token(), fmt::format("measured values are written {}", form));
    ++next_;
    if (++function_depth_ > ExpressionLimits::function_depth)
        fail(name, fmt::format("functions of functions in {} are more than {} deep; write it with fewer",
                               scope_.formula, ExpressionLimits::function_depth));
    Syntax table = node(Kind::table, name, read_sum());
    --function_depth_;
    table.file = file;
    expect(')', open);
    return table;
}

// The order of a and b in if(a < b, c, d) is turned round.
Syntax Parser::read_pieced(const Token& name) {
    const auto form = std::find_if(pieced_functions().begin(), pieced_functions().end(), [&](const auto& function) {
                          return function.first == name.text;
                      })->second;
    refuse_without_parenthesis(name, form);
    const Token open = tokens_[next_++];
    Syntax pieced = node(Kind::pieced, name, read_sum());
    if (name.text == "if") {
        if (!token().is('<') && !token().is('>')) fail(token(), "a condition is written if(a > b, c, d)");
        const bool is_less = tokens_[next_++].is('<');
        if (token().is('='))
            fail(token(), is_less ? "there is no <=: write if(a > b, d, c) in place of if(a <= b, c, d)"
                                  : "there is no >=: write if(a < b, d, c) in place of if(a >= b, c, d)");
        pieced.operands.push_back(read_sum());
        if (is_less) std::swap(pieced.operands[0], pieced.operands[1]);
    }
    const auto wanted =
        static_cast<std::size_t>(std::count(form.begin(), form.end(), ',')) + (name.text == "if" ? 2 : 1);
    while (pieced.operands.size() < wanted) {
        if (!token().is(',')) fail(token(), fmt::format("{} is written {}", name.text, form));
        ++next_;
        pieced.operands.push_back(read_sum());
    }
    expect(')', open);
    return pieced;
}

namespace {

Parser parser_of(const Source& source, const Text& text, const Scope& scope) {
    if (text.value.size() > ExpressionLimits::length)
        source.fail(text.at.front(), fmt::format("{} has {} characters; at most {} are read", scope.formula,
                                                 text.value.size(), ExpressionLimits::length));
    return Parser(source, text, scope);
}

}  // namespace

Syntax parse_formula(const Source& source, const Text& text, const Scope& scope) {
    return parser_of(source, text, scope).formula();
}

EventSyntax parse_crossing(const Source& source, const Text& text, const Scope& scope) {
    return parser_of(source, text, scope).crossing("an event", "x = 0, x = 0 rising or x = y falling");
}

EventSyntax parse_equation(const Source& source, const Text& text, const Scope& scope) {
    return parser_of(source, text, scope).crossing("an equation", "x^2 + y^2 = 1");
}

Subject parse_subject(const Source& source, const Text& text, const Scope& scope) {
    return parser_of(source, text, scope).subject();
}

}  // namespace lobatto
