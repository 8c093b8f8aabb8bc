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

// Values of stage parameter or step size that later stages use: the fields of the emitted struct Coefficients.
struct Hoisted {
    explicit Hoisted(const Programs& programs);
    std::vector<Id> order;            // operands before users, parameters and h first
    std::map<Id, std::string> names;  // field names: the scene's, those of the derivation, else k1, k2, ...
};

// One assignment: `target = value;`. "require reciprocal" ends the function with false where the value is none, "return
// reciprocal" in any case.
struct Statement {
    std::string target;
    Id value = 0;
};

// Assignments as C++ lines, indented by 8. `external` names what the function is given (inputs, fields of k); a value
// of a stage up to `given` that has no such name is a mistake of ours. Values used more than once become locals t1, t2,
// ... or bear the name the derivation gave them; in a template on the type of numbers (`any_number`) they are `auto`.
// Products are added by fused_sum() where it `fuses`. Sine and cosine of the pairs numbered in `angles` are asked from
// the argument `angle`.
class FunctionText {
public:
    FunctionText(const Programs& programs, const std::vector<Statement>& statements, const Naming& external,
                 Precision precision, Stage given, bool any_number = false, bool fuses = false,
                 const std::map<Id, int>& angles = {});
    const std::string& lines() const { return text_; }

private:
    std::string text_;
};

// A line broken at spaces to at most 120 columns; continuation lines begin with `indent`. Ends with a newline.
std::string wrapped(const std::string& line, const std::string& indent);

// Whether text contains the identifier as a whole word.
bool mentions(const std::string& text, const std::string& identifier);

}  // namespace lobatto
