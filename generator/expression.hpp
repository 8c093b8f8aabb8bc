// SPDX-License-Identifier: GPL-2.0-or-later
// Text of a formula to a GiNaC expression: positions kept, sizes bounded, numbers exact.
#pragma once

#include <ginac/ginac.h>

#include <map>
#include <string>

#include "generator/source.hpp"

namespace lobatto {

// What a name means where a formula stands.
struct Name {
    enum class Role { position, velocity, parameter };
    GiNaC::ex value;  // the symbol; for a constant parameter its exact value
    Role role = Role::parameter;
};

// The names a formula may use, and how to speak of the formula in an error ("the Lagrangian").
struct Scope {
    std::map<std::string, Name> names;  // velocities are written and listed as q'
    std::string formula;                // "the Lagrangian", "the initial position of q"
    bool velocities_allowed = true;     // false: q' gets its own error
    bool positions_allowed = true;      // false: only parameters and numbers
};

// Bounds, stated in docs/scene_format.md and in the errors.
struct ExpressionLimits {
    static constexpr int depth = 200;          // nested parentheses, functions, signs and powers
    static constexpr int function_depth = 16;  // functions in arguments of functions
    static constexpr int length = 100000;      // bytes of one formula
    static constexpr int exponent = 64;        // |integer exponent| of anything but a number
    static constexpr int number_bits = 4096;   // size of an exact number
};

// Grammar: + - * / ^ (right-associative; -x^2 is -(x^2), 2^-1 is allowed), parentheses, numbers (0.1 is exactly 1/10),
// pi, and the functions sqrt sin cos tan exp log sinh cosh tanh asin acos atan. Throws InputError.
// `used` collects the names that occur.
GiNaC::ex parse_expression(const Source& source, const Text& text, const Scope& scope,
                           std::map<std::string, bool>* used = nullptr);

// The value of what was parsed, its symbols replaced by numbers. InputError at `at`, with the name of the formula, when
// it is not a real number that a double can hold with room to spare: 0, or of a size between 1e-300 and 1e300.
GiNaC::numeric value_in_range(const Source& source, Position at, const GiNaC::ex& expression,
                              const std::string& formula, const GiNaC::exmap& symbols = {});

}  // namespace lobatto
