// SPDX-License-Identifier: GPL-2.0-or-later
// Names in a formula: what each stands for, its subscripts, and the errors about it.
#include <fmt/format.h>

#include <algorithm>

#include "generator/formula/parser.hpp"
#include "generator/formula/text/suggest.hpp"

namespace lobatto {
namespace {

// What other languages have.
std::string advice_for_function(const std::string& name, const std::vector<std::string>& names) {
    static const std::map<std::string, const char*> others{{"ln", " Write log."},
                                                           {"pow", " Write x^2."},
                                                           {"sqr", " Write x^2."},
                                                           {"fabs", " Write abs."},
                                                           {"sgn", " Write sign."},
                                                           {"arcsin", " Write asin."},
                                                           {"arccos", " Write acos."},
                                                           {"arctan", " Write atan."},
                                                           {"arctan2", " Write atan2."},
                                                           {"log10", " Write log(x)/log(10)."},
                                                           {"diff", " The velocity of x is written x'."},
                                                           {"Derivative", " The velocity of x is written x'."},
                                                           {"where", " Write if(condition, then, otherwise)."},
                                                           {"heaviside", " Write if(x > 0, 1, 0)."}};
    const std::string last = name.substr(name.find_last_of('.') + 1);  // np.cos
    if (const auto found = others.find(last); found != others.end()) return found->second;
    if (last != name && std::find(names.begin(), names.end(), last) != names.end())
        return fmt::format(" Write {}.", last);
    return suggestion(name, names);
}

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

}  // namespace

void Parser::refuse_without_parenthesis(const Token& name, const std::string& form) const {
    if (token().is('^')) fail(token(), fmt::format("write {0}(...)^2 instead of {0}^2(...)", name.text));
    if (!token().is('(')) fail(name, fmt::format("{} needs parentheses: write {}", name.text, form));
}

// The index of a sum or a definition has no other meaning.
void Parser::refuse_index(const Token& index) const {
    std::string meaning;
    if (const Name* name = find(index.text)) meaning = kind_of(*name);
    if (index.text == "pi") meaning = "the number 3.14159...";
    if (is_function_name(std::string(index.text))) meaning = "the name of a function";
    if (std::find(indices_.begin(), indices_.end(), index.text) != indices_.end()) meaning = "an index already";
    if (!meaning.empty())
        fail(index, fmt::format("'{}' is {}; give the index another name", index.text.substr(0, 40), meaning));
}

// i, j, k of a definition or a force.
std::vector<Token> Parser::read_indices() {
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

const Name* Parser::find(std::string_view name) const {
    if (scope_.names == nullptr) return nullptr;
    const auto found = scope_.names->all.find(name);
    return found == scope_.names->all.end() ? nullptr : &found->second;
}

Syntax Parser::read_name(const Token& at) {
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

void Parser::read_subscripts(Syntax& formula, std::string_view base) {
    const Name& name = *formula.name;
    const std::size_t expected = name.definition ? name.definition->indices.size() : name.array ? 1 : 0;
    const Token open = token();
    if (!open.is('[') && expected == 0) return;
    if (!open.is('[') && name.definition)
        fail(formula.at, fmt::format("the definition {0} has indices: write {0}[{1}]", base,
                                     fmt::join(name.definition->indices, ",")));
    if (!open.is('[')) fail(formula.at, fmt::format("{0} is an array: write {0}[1], or {0}[i] in a sum over i", base));
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
void Parser::read_point(Syntax& formula, std::string_view base) {
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

void Parser::refuse_by_role(const Syntax& formula, std::string_view base) const {
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

[[noreturn]] void Parser::fail_unknown(const Token& at) const {
    const std::string shown(at.text.substr(0, 40)), name(at.text);
    if (token().is('(')) {
        std::vector<std::string> names;
        for (const Function& function : functions()) names.push_back(function.name);
        names.insert(names.end(), {"sum", "mod", "table"});
        for (const auto& [pieced, form] : pieced_functions()) names.push_back(pieced);
        const std::string near = advice_for_function(name, names);
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
        fail(at,
             fmt::format("unknown name '{}' in {}: only numbers, pi and functions of them may stand here; formulas of "
                         "other names stand under [definitions]",
                         shown, scope_.formula));
    std::string advice = suggestion(name, near);
    for (const std::string_view ending : {"_dot", "dot"}) {  // people's name for a velocity
        const std::string of = name.ends_with(ending) ? name.substr(0, name.size() - ending.size()) : "";
        if (std::find(declared.begin(), declared.end(), of + "'") != declared.end())
            advice = fmt::format(" The velocity of {0} is written {0}'.", of);
    }
    const auto is_declared = [&](const std::string& written) {
        return std::find(declared.begin(), declared.end(), written) != declared.end();
    };
    if (scope_.motion_allowed && advice.empty() && name.ends_with("'") && name.size() > 3)
        if (advice = suggestion(name.substr(0, name.size() - 1), near); !advice.empty())
            advice.replace(advice.rfind("'?"), 2, "''?");  // the velocity of that
    if (scope_.motion_allowed && advice.empty() && name.ends_with("'"))
        advice = fmt::format(
            " A coordinate {0} needs a line {0} = {{ position = ..., velocity = ... }} under "
            "[coordinates].",
            name.substr(0, name.find('\'')));
    if (name == "e" && token().is('^')) advice = " Write exp(...).";
    if (scope_.motion_allowed && advice.empty() && (name == "v" || name == "qdot"))
        for (const std::string& written : declared)
            if (advice.empty() && is_declared(written + "'"))
                advice = fmt::format(" The velocity of {0} is written {0}'.", written);
    fail(at, fmt::format("unknown name '{}' in {}; declared: {}.{}", shown, scope_.formula, listing(declared), advice));
}

[[noreturn]] void Parser::fail_time(const Token& at) const {
    for (const auto& [name, meaning] : scope_.names->all)
        if (meaning.role == Name::Role::time) fail(at, fmt::format("the time of this scene is called {}", name));
    fail(at, "the scene declares no time: add the line time = \"t\" before its first [table]");
}

}  // namespace lobatto
