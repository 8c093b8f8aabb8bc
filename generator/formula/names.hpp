// SPDX-License-Identifier: GPL-2.0-or-later
// What the names of a scene mean in its formulas.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "generator/formula/formula.hpp"
#include "generator/formula/operand.hpp"

namespace lobatto {

// An abbreviation r, or r[i,j] with indices; its values are computed when they are needed, once for each subscript.
struct Definition {
    std::string label;  // "the definition r"
    std::vector<std::string> indices;
    Syntax formula;
    bool given = false;            // by a body: its values are known before they are asked for
    std::vector<long> sizes = {};  // then: the largest indices
    struct Value {
        bool needed = false, complete = false;  // needed and not complete: being computed
        Operand value;
        std::optional<Operand> rate;  // its time derivative
    };
    std::map<std::vector<long>, Value> values;
};

struct Name {
    enum class Role { coordinate, parameter, input, time, definition };
    Role role = Role::parameter;
    bool array = false;                      // of coordinates or parameters, written x[1] ... x[n]
    std::vector<Operand> values;             // one, or one an element; a constant parameter's is its exact value
    std::vector<Operand> velocities;         // coordinates only
    std::shared_ptr<Definition> definition;  // definitions only
    std::vector<Operand> row;  // of the x, y or z of a body: of its rotation, for points such as x(a, b, c)
    bool used = false;
};

// A name as formulas write it, x[i]', and without its brackets, as people misspell it.
struct Spelling {
    std::string written, plain;
};

// What a formula asks of a part of it, as written: a formula may cancel what has no value, as in sqrt(a)^2 or a/a, and
// still it is an error where it stands.
struct DomainCondition {
    enum class Kind : std::uint8_t { any, nonzero, nonnegative, positive, within_one, power };
    Kind kind = Kind::nonzero;
    GiNaC::ex expression;
    GiNaC::ex exponent;      // of a power: of numbers and parameters where its kind is `power`
    GiNaC::ex argument = 0;  // of a table: where its value is asked for; else 0
    std::string operation;   // "a square root"
    Position at;
    bool of_motion = true;  // else of the step or the end time

    // What the base of a power is asked for.
    static Kind of_base(bool whole_exponent, bool negative_exponent) {
        if (whole_exponent) return negative_exponent ? Kind::nonzero : Kind::any;
        return negative_exponent ? Kind::positive : Kind::nonnegative;
    }
};

// Where a formula goes from one smooth piece to another: u = 0. On either side its `side` is constant, 1 or -1.
struct Switch {
    GiNaC::ex value;  // u
    GiNaC::symbol side;
    std::string text;  // "abs in the Lagrangian"
    Position at;
    bool may_jump = false;  // of sign and if, whose pieces may differ where u = 0
    bool refracts = false;  // the Lagrangian may jump at a place u(q, t) = 0
};

// A file of measured values: the number of its spline, and where it is named first.
struct TableUse {
    int spline;
    Position at;
};

struct Names {
    std::vector<Switch> switches;
    std::vector<DomainCondition> conditions;
    bool records = true;  // conditions
    std::map<std::string, Name, std::less<>> all;
    std::map<std::string, TableUse, std::less<>> tables;  // files that were read
    Flow flow;
    Work work;

    Name& add_parameter(const std::string& name, const std::vector<GiNaC::ex>& values, bool array = false);
    Name& add_input(const std::string& name, const std::vector<GiNaC::ex>& values, bool array = false);
    Name& add_coordinate(const std::string& name, const std::vector<GiNaC::symbol>& positions,
                         const std::vector<GiNaC::symbol>& velocities, bool array = false);
    Name& add_time(const std::string& name, const GiNaC::symbol& time);

    // The side of the switch u, which is known or new; `function`: abs, sign ...
    GiNaC::symbol side_of(const GiNaC::ex& u, const std::string& function, const std::string& formula, Position at);

    // For suggestions; without those that move unless they are allowed.
    std::vector<Spelling> spellings(bool motion_allowed) const;
};

}  // namespace lobatto
