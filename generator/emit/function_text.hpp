// SPDX-License-Identifier: GPL-2.0-or-later
// The body of one emitted function: which values get a name, in which order, on which line.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "generator/graph/notation.hpp"
#include "generator/graph/passes.hpp"

namespace lobatto {

// Values of the phases parameter and step size that later phases use: the fields of the emitted struct Coefficients.
struct Hoisted {
    explicit Hoisted(const Programs& programs);
    std::vector<Id> order;            // operands before users, parameters and h first
    std::map<Id, std::string> names;  // field names: the scene's, those of the derivation, else k1, k2, ...
};

// How a function is written.
struct FunctionStyle {
    Precision precision = Precision::double_;
    Phase given = Phase::constant;      // values up to this stage that have a name are not computed
    bool any_number = false;            // a template on the type of numbers: locals are `auto`
    bool fuses = false;                 // products are added by fused_sum()
    Notation notation = Notation::cpp;  // or Notation::plain
    std::map<Id, int> angles;           // pairs of sine and cosine that the argument `angle` gives, numbered
};

// Assignments as C++ lines, indented by 8. `external` names what the function is given (inputs, fields of k). Values
// used more than once become locals t1, t2, ... or bear the name the derivation gave them.
class FunctionText {
public:
    FunctionText(const Programs& programs, const std::vector<Output>& statements, const Naming& external,
                 const FunctionStyle& style);
    const std::string& lines() const { return text_; }

private:
    std::string text_;
};

// A line broken at spaces to at most 120 columns; continuation lines begin with `indent`. Ends with a newline.
std::string wrapped(const std::string& line, const std::string& indent);

// Text that may stand in a // comment: one line, printable.
std::string comment_safe(const std::string& text);

// Whether text contains the identifier as a whole word.
bool mentions(const std::string& text, const std::string& identifier);

}  // namespace lobatto
