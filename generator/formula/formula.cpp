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

#include "generator/formula/names.hpp"
#include "generator/formula/suggest.hpp"

namespace lobatto {
namespace {

using Kind = Syntax::Kind;

// What stands where it has no meaning, and what to write.
constexpr std::pair<char, std::string_view> stray_signs[] = {
    {'[', "write ( instead"},
    {']', "write ) instead"},
    {',', "decimals have a point, and functions have no more arguments"},
    {'=', "a formula is one side only"},
    {'.', "two points stand only in a sum, as in sum(i = 1 .. n, formula)"},
    {'\'', "a prime belongs directly after the name of a coordinate"}};

constexpr std::string_view form_of_series = "a sum is written sum(i = 1 .. n, formula)";

std::string kind_of(const Name& name) {
    switch (name.role) {
        case Name::Role::coordinate:
            return "a coordinate";
        case Name::Role::parameter:
            return "a parameter";
        case Name::Role::input:
            return "an input";
        case Name::Role::definition:
            return "a definition";
        case Name::Role::time:
            break;
    }
    return "the time";
}

class Parser {
public:
    Parser(const Source& source, const Text& text, const Scope& scope)
        : source_(source), scope_(scope), indices_(scope.indices), tokens_(tokenise(source, text, scope.formula)) {}

    Syntax formula() {
        refuse_emptiness();
        Syntax whole = read_sum();
        refuse_rest();
        return whole;
    }

    EventSyntax crossing() {
        refuse_emptiness();
        has_direction_ = true;
        Syntax left = read_sum();
        if (!token().is('=')) fail_rest("an event is written x = 0, x = 0 rising or x = y falling");
        const Token equals = tokens_[next_++];
        Syntax right = read_sum();
        EventSyntax crossing;
        if (at_direction()) crossing.direction = tokens_[next_++].text == "rising" ? 1 : -1;
        if (token().is('=')) fail(token(), "an event has one =");
        refuse_rest();
        Syntax& difference = crossing.difference;
        difference = node(Kind::sum, equals);
        difference.signs = {equals, equals};
        difference.operands.push_back(std::move(left));
        difference.operands.push_back(node(Kind::negation, equals, std::move(right)));
        return crossing;
    }

    Subject subject() {
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

private:
    const Token& token() const { return tokens_[next_]; }
    [[noreturn]] void fail(const Token& at, const std::string& message) const { source_.fail(at.at, message); }

    void refuse_emptiness() const {
        if (token().kind == Token::Kind::end) fail(token(), fmt::format("{} is empty", scope_.formula));
    }

    [[noreturn]] void fail_missing_operator() const {
        const std::string_view left = tokens_[next_ - 1].text, right = token().text;
        fail(token(), fmt::format("missing operator: write {}*{}", left.substr(0, 40), right.substr(0, 40)));
    }

    // What follows something complete is a sign or the end.
    void refuse_rest() const {
        if (token().kind != Token::Kind::end) fail_rest("");
    }
    [[noreturn]] void fail_rest(const std::string& at_end) const {
        if (token().kind == Token::Kind::end) fail(token(), at_end);
        if (token().is(')')) fail(token(), "this ) closes nothing: remove it, or add a ( before it");
        for (const auto& [sign, mend] : stray_signs)
            if (token().is(sign))
                fail(token(), fmt::format("unexpected character '{}' in {}: {}", token().text, scope_.formula, mend));
        fail_missing_operator();
    }

    void expect(char sign, const Token& open) {
        if (token().kind == Token::Kind::end)
            fail(open, fmt::format("this {} is not closed: add a {}", open.text, sign));
        if (!token().is(sign) && token().is(')'))
            fail(token(), fmt::format("this ) closes nothing: a {} is missing before it", sign));
        if (!token().is(sign)) fail_rest("");
        ++next_;
    }

    static Syntax node(Kind kind, const Token& at) {
        Syntax formula;
        formula.kind = kind;
        formula.at = at;
        return formula;
    }
    template <typename... Operands>
    static Syntax node(Kind kind, const Token& at, Operands&&... operands) {
        Syntax formula = node(kind, at);
        (formula.operands.push_back(std::forward<Operands>(operands)), ...);
        return formula;
    }

    Syntax read_sum() {
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

    Syntax read_product() {
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

    static Syntax unwrapped(Syntax whole) {
        if (whole.operands.size() > 1) return whole;
        Syntax only = std::move(whole.operands.front());
        return only;
    }

    // Every way to nest passes through here.
    Syntax read_signed() {
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

    Syntax read_power() {
        Syntax base = read_primary();
        if (!token().is('^')) return base;
        const Token sign = tokens_[next_++];
        return node(Kind::power, sign, std::move(base), read_signed());
    }

    Syntax read_primary() {
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
        fail(first, fmt::format("a number, a name or ( is missing before '{}'", first.text));
    }

    bool at_direction() const {
        return has_direction_ && token().kind == Token::Kind::name &&
               (token().text == "rising" || token().text == "falling");
    }

    // After something complete, nothing that begins something new.
    Syntax follow(Syntax operand) const {
        const bool begins = token().kind == Token::Kind::number || token().kind == Token::Kind::name || token().is('(');
        if (begins && !at_direction()) fail_missing_operator();
        return operand;
    }

    Syntax read_parenthesis() {
        const Token open = tokens_[next_++];
        Syntax inside = read_sum();
        expect(')', open);
        return inside;
    }

    void refuse_without_parenthesis(const Token& name, const std::string& form) const {
        if (token().is('^')) fail(token(), fmt::format("write {0}(...)^2 instead of {0}^2(...)", name.text));
        if (!token().is('(')) fail(name, fmt::format("{} needs parentheses: write {}", name.text, form));
    }

    Syntax read_call(const Token& name, const Function& function) {
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

    Syntax read_series(const Token& name) {
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

    Syntax read_remainder(const Token& name) {
        refuse_without_parenthesis(name, "mod(a, b)");
        const Token open = tokens_[next_++];
        Syntax remainder = node(Kind::remainder, name, read_sum());
        if (!token().is(',')) fail(token(), "a remainder is written mod(a, b)");
        ++next_;
        remainder.operands.push_back(read_sum());
        expect(')', open);
        return remainder;
    }

    Syntax read_table(const Token& name) {
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
    Syntax read_pieced(const Token& name) {
        const auto form = std::find_if(pieced_functions().begin(), pieced_functions().end(), [&](const auto& function) {
                              return function.first == name.text;
                          })->second;
        refuse_without_parenthesis(name, form);
        const Token open = tokens_[next_++];
        Syntax pieced = node(Kind::pieced, name, read_sum());
        if (name.text == "if") {
            if (!token().is('<') && !token().is('>')) fail(token(), "a condition is written if(a > b, c, d)");
            const bool is_less = tokens_[next_++].is('<');
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

    // The index of a sum or a definition has no other meaning.
    void refuse_index(const Token& index) const {
        std::string meaning;
        if (const Name* name = find(index.text)) meaning = kind_of(*name);
        if (index.text == "pi") meaning = "the number 3.14159...";
        if (is_function_name(std::string(index.text))) meaning = "the name of a function";
        if (std::find(indices_.begin(), indices_.end(), index.text) != indices_.end()) meaning = "an index already";
        if (!meaning.empty())
            fail(index, fmt::format("'{}' is {}; give the index another name", index.text.substr(0, 40), meaning));
    }

    // i, j, k of a definition or a force.
    std::vector<Token> read_indices() {
        std::vector<Token> names;
        for (;;) {
            if (token().kind != Token::Kind::name || token().primed)
                fail(token(), "the names of indices stand in brackets, as in \"r[i,j]\"");
            refuse_index(token());
            names.push_back(token());
            indices_.emplace_back(token().text);
            ++next_;
            if (!token().is(',')) return names;
            ++next_;
        }
    }

    const Name* find(std::string_view name) const {
        if (scope_.names == nullptr) return nullptr;
        const auto found = scope_.names->all.find(name);
        return found == scope_.names->all.end() ? nullptr : &found->second;
    }

    Syntax read_name(const Token& at) {
        const std::string_view base = at.name();
        if (at.text == "pi") return node(Kind::pi, at);
        const auto index = std::find(indices_.begin(), indices_.end(), base);
        if (index != indices_.end()) {
            if (at.primed) fail(at, fmt::format("{} is an index and has no velocity; only coordinates have one", base));
            Syntax formula = node(Kind::index, at);
            formula.index = static_cast<std::size_t>(index - indices_.begin());
            return formula;
        }
        const Name* meaning = find(base);
        if (meaning == nullptr) fail_unknown(at);
        if (at.primed && token().is('['))
            fail(at, fmt::format("the prime stands after the brackets: write {}[...]'", base));
        Syntax formula = node(Kind::name, at);
        formula.name = meaning;
        formula.primed = at.primed;
        if (token().is('(') && !meaning->row.empty())
            read_point(formula, base);
        else
            read_subscripts(formula, base);
        refuse_by_role(formula, base);
        scope_.names->all.find(base)->second.used = true;
        return formula;
    }

    void read_subscripts(Syntax& formula, std::string_view base) {
        const Name& name = *formula.name;
        const std::size_t expected = name.definition ? name.definition->indices.size() : name.array ? 1 : 0;
        const Token open = token();
        if (!open.is('[') && expected == 0) return;
        if (!open.is('[') && name.definition)
            fail(formula.at, fmt::format("the definition {0} has indices: write {0}[{1}]", base,
                                         fmt::join(name.definition->indices, ",")));
        if (!open.is('['))
            fail(formula.at, fmt::format("{0} is an array: write {0}[1], or {0}[i] in a sum over i", base));
        if (expected == 0)
            fail(open, fmt::format("{0} is {1}, not an array: write {0} without brackets", base, kind_of(name)));
        do {
            ++next_;
            formula.operands.push_back(read_sum());
        } while (token().is(','));
        expect(']', open);
        if (formula.operands.size() != expected)
            fail(open, name.definition ? fmt::format("the definition {0} is written {0}[{1}]", base,
                                                     fmt::join(name.definition->indices, ","))
                                       : fmt::format("an array has one index: write {}[i]", base));
        if (token().is('\'')) {
            formula.primed = true;
            ++next_;
        }
    }

    // top.x(a, b, c): where a point of a body is.
    void read_point(Syntax& formula, std::string_view base) {
        const Token open = token();
        const std::size_t expected = formula.name->row.size();
        const std::string form = fmt::format("{}({})", base, expected == 2 ? "a, b" : "a, b, c");
        if (formula.primed) fail(formula.at, fmt::format("{} is a place; points have no velocity in formulas", form));
        formula.kind = Kind::point;
        do {
            ++next_;
            formula.operands.push_back(read_sum());
        } while (token().is(','));
        expect(')', open);
        if (formula.operands.size() != expected) fail(open, fmt::format("a point of a body is written {}", form));
    }

    void refuse_by_role(const Syntax& formula, std::string_view base) const {
        const Name::Role role = formula.name->role;
        if (formula.primed && role != Name::Role::coordinate && role != Name::Role::definition)
            fail(formula.at,
                 fmt::format("{} is {} and has no velocity; only coordinates have one", base, kind_of(*formula.name)));
        if (scope_.motion_allowed) return;
        std::string what;
        if (role == Name::Role::coordinate) what = formula.primed ? "the velocity" : "the coordinate";
        if (role == Name::Role::time) what = "the time";
        if (role == Name::Role::input) what = "the input";
        if (formula.primed && role == Name::Role::definition) what = "the velocity";
        if (!what.empty())
            fail(formula.at, fmt::format("{} {}{} cannot occur in {}: write it with numbers and parameters", what, base,
                                         formula.primed ? "'" : "", scope_.formula));
    }

    [[noreturn]] void fail_unknown(const Token& at) const {
        const std::string shown(at.text.substr(0, 40)), name(at.text);
        if (token().is('(')) {
            std::vector<std::string> names;
            for (const Function& function : functions()) names.push_back(function.name);
            names.insert(names.end(), {"sum", "mod", "table"});
            for (const auto& [pieced, form] : pieced_functions()) names.push_back(pieced);
            const std::string near = name == "ln" ? " Write log." : suggestion(name, names);
            fail(at, fmt::format("unknown function '{}' in {}; there are {}.{}", shown, scope_.formula,
                                 fmt::join(names, ", "), near));
        }
        std::vector<std::string> declared = indices_, near = indices_;
        if (scope_.names != nullptr) {
            if (name == "t" && scope_.motion_allowed) fail_time(at);
            for (const Spelling& spelling : scope_.names->spellings(scope_.motion_allowed)) {
                declared.push_back(spelling.written);
                near.push_back(spelling.plain);
            }
        }
        if (declared.empty())
            fail(at, fmt::format("unknown name '{}' in {}: only numbers, pi and functions of them may stand here",
                                 shown, scope_.formula));
        fail(at, fmt::format("unknown name '{}' in {}; declared: {}.{}", shown, scope_.formula, listing(declared),
                             suggestion(name, near)));
    }

    [[noreturn]] void fail_time(const Token& at) const {
        for (const auto& [name, meaning] : scope_.names->all)
            if (meaning.role == Name::Role::time) fail(at, fmt::format("the time of this scene is called {}", name));
        fail(at, "the scene declares no time: add the line time = \"t\" before its first [table]");
    }

    const Source& source_;
    const Scope& scope_;
    std::vector<std::string> indices_;
    const std::vector<Token> tokens_;
    std::size_t next_ = 0;
    int depth_ = 0;
    int function_depth_ = 0;
    bool has_direction_ = false;
};

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
    return parser_of(source, text, scope).crossing();
}

Subject parse_subject(const Source& source, const Text& text, const Scope& scope) {
    return parser_of(source, text, scope).subject();
}

}  // namespace lobatto
