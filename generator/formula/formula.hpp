// SPDX-License-Identifier: GPL-2.0-or-later
// A formula as a tree: its grammar, and what each name in it stands for.
#pragma once

#include <string>
#include <vector>

#include "generator/formula/operand.hpp"
#include "generator/formula/text/source.hpp"
#include "generator/formula/text/token.hpp"

namespace lobatto {

struct Name;
struct Names;

struct Syntax {
    enum class Kind {
        number,
        pi,
        index,    // of an enclosing sum, array or definition
        name,     // coordinate, parameter, time, definition; operands: the subscripts
        point,    // a coordinate of a point of a body, top.z(0, 0, l); operands: its place in the body
        sum,      // of its operands
        product,  // of its operands
        negation,
        inverse,
        power,
        call,
        series,     // sum(index = first .. last, term); operands: first, last, term
        remainder,  // mod(a, b)
        table,      // table("file", a)
        pieced      // abs(a), sign(a), min(a, b), max(a, b), hypot(a, b), atan2(a, b), if(a > b, c, d): a, b, c, d
    };
    Kind kind = Kind::number;
    Token at;  // a number, a name, an operator: what an error of it points at
    std::vector<Syntax> operands;
    std::vector<Token> signs;    // sum, product: the operator before each operand, its first token for the first
    const Name* name = nullptr;  // name
    bool primed = false;         // name: its rate of change
    std::size_t index = 0;       // index: how many indices enclose the one it is
    std::string index_name;      // series
    const Function* function = nullptr;  // call
    Token file;                          // table
};

// The names a formula may use, and how to speak of the formula in an error ("the Lagrangian").
struct Scope {
    Names* names = nullptr;            // nullptr: only numbers
    std::string formula;               // "the Lagrangian", "the initial position of q"
    bool motion_allowed = true;        // false: no positions, velocities and time
    std::vector<std::string> indices;  // that have a value when the formula is evaluated
};

// Grammar: + - * / ^ (right-associative; -x^2 is -(x^2), 2^-1 is allowed), parentheses, numbers, pi, the functions
// sqrt sin cos tan exp log sinh cosh tanh asin acos atan, x[i] and x[i]', sum(i = first .. last, formula), mod(a, b),
// table("file", a) and those of pieced_functions(). Throws InputError. Marks the names that occur as used. The tree
// refers to `text`.
Syntax parse_formula(const Source& source, const Text& text, const Scope& scope);

// "left = right", "left = right rising", "left = right falling".
struct EventSyntax {
    Syntax difference;  // left - right
    const Syntax& left() const { return difference.operands[0]; }
    const Syntax& right() const { return difference.operands[1].operands[0]; }
    int direction = 0;  // rising 1, falling -1
};
EventSyntax parse_crossing(const Source& source, const Text& text, const Scope& scope);
EventSyntax parse_equation(const Source& source, const Text& text, const Scope& scope);  // of a constraint

// A name to declare or to give a force to: "r", "r[i,j]", "x[3]".
struct Subject {
    Token name;
    std::vector<Token> indices;  // names between the brackets
    bool subscripted = false;
    Syntax subscript;  // when it is no name of an index: one subscript, in constants
};
Subject parse_subject(const Source& source, const Text& text, const Scope& scope);

}  // namespace lobatto
