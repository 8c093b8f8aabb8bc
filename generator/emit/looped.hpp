// SPDX-License-Identifier: GPL-2.0-or-later
// The text of kernels with loops over repeated terms: their tables and the bodies of their functions.
#pragma once

#include <string>
#include <vector>

#include "generator/emit/function_text.hpp"
#include "generator/mechanics/derivation.hpp"
#include "generator/programs/looped.hpp"

namespace lobatto {

// A formula as a function of one row or of rows side by side.
struct RowFunction {
    std::string name;
    int variables;
    std::string body;
};

// What the emitter asks for: constant tables, fields of Coefficients, their values, and the body of a function.
class LoopedText {
public:
    LoopedText(const Derivation& derivation, const Programs& programs, Precision precision, Naming names);

    std::string tables() const;
    std::string fields() const;
    std::vector<Output> prepared() const;  // values of those fields
    std::string after_prepare() const;     // what follows them
    std::string body(const std::string& function) const;
    std::vector<RowFunction> row_functions() const;  // where neighbouring coordinates lie in lanes

private:
    const Program& program(const std::string& name) const;
    std::string statements(const std::string& name, const std::string& indent) const;
    const Element& element_of(int number) const {
        return d_.structure.elements.repeated[static_cast<std::size_t>(number)];
    }
    std::string loops(LoopPart::Of part, const char* variables) const;

    const Derivation& d_;
    const Programs& p_;
    Precision precision_;
    FunctionStyle style_;
    Naming names_;
    std::string along_rows() const;
    bool general_, neighbours_;
    int elements_;  // how many
};

}  // namespace lobatto
