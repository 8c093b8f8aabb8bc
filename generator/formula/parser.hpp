// SPDX-License-Identifier: GPL-2.0-or-later
// Reads the tokens of a formula: grammar in formula.cpp, names in formula_names.cpp.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "generator/formula/formula.hpp"
#include "generator/formula/names.hpp"

namespace lobatto {

class Parser {
public:
    Parser(const Source& source, const Text& text, const Scope& scope)
        : source_(source), scope_(scope), indices_(scope.indices), tokens_(tokenise(source, text, scope.formula)) {}

    Syntax formula();
    // `what`, and the form in which it is written, stand in errors.
    EventSyntax crossing(const std::string& what, const std::string& form);
    Subject subject();

private:
    using Kind = Syntax::Kind;

    const Token& token() const { return tokens_[next_]; }
    [[noreturn]] void fail(const Token& at, const std::string& message) const { source_.fail(at.at, message); }

    void refuse_emptiness() const;
    [[noreturn]] void fail_missing_operator() const;

    // What follows something complete is a sign or the end.
    void refuse_rest() const;
    [[noreturn]] void fail_rest(const std::string& at_end) const;
    void expect(char sign, const Token& open);

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

    Syntax read_sum();
    Syntax read_product();
    static Syntax unwrapped(Syntax whole);

    // Every way to nest passes through here.
    Syntax read_signed();
    Syntax read_power();
    Syntax read_primary();
    bool at_direction() const;

    // After something complete, nothing that begins something new.
    Syntax follow(Syntax operand) const;
    Syntax read_parenthesis();
    void refuse_without_parenthesis(const Token& name, const std::string& form) const;
    Syntax read_call(const Token& name, const Function& function);
    Syntax read_series(const Token& name);
    Syntax read_remainder(const Token& name);
    Syntax read_table(const Token& name);

    // The order of a and b in if(a < b, c, d) is turned round.
    Syntax read_pieced(const Token& name);

    // The index of a sum or a definition has no other meaning.
    void refuse_index(const Token& index) const;

    // i, j, k of a definition or a force.
    std::vector<Token> read_indices();
    const Name* find(std::string_view name) const;
    Syntax read_name(const Token& at);
    void read_subscripts(Syntax& formula, std::string_view base);

    // top.x(a, b, c): where a point of a body is.
    void read_point(Syntax& formula, std::string_view base);
    void refuse_by_role(const Syntax& formula, std::string_view base) const;
    [[noreturn]] void fail_unknown(const Token& at) const;
    [[noreturn]] void fail_time(const Token& at) const;

    const Source& source_;
    const Scope& scope_;
    std::vector<std::string> indices_;
    const std::vector<Token> tokens_;
    std::size_t next_ = 0;
    int depth_ = 0;
    int function_depth_ = 0;
    bool has_direction_ = false;
};

}  // namespace lobatto
