// SPDX-License-Identifier: GPL-2.0-or-later
// Kernels with loops over repeated terms: their programs, their tables and the bodies of their functions.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "generator/function_text.hpp"
#include "generator/pipeline.hpp"

namespace lobatto {

Programs looped_programs(const Derivation& derivation);

// The slots (i, j) of an element whose second derivative is not zero, row by row.
std::vector<std::pair<std::size_t, std::size_t>> pairs_of(const Element& element);
// Whether coefficients that vary are run-time parameters, not numbers.
bool has_parameters(const Element& element);

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
    std::vector<Statement> prepared() const;  // values of those fields
    std::string after_prepare() const;        // what follows them
    std::string body(const std::string& function) const;
    std::vector<RowFunction> row_functions() const;  // where neighbouring coordinates lie in lanes

private:
    const Program& program(const std::string& name) const;
    std::string statements(const std::string& name, const std::string& indent) const;
    std::string loops(const std::string& part, const char* variables) const;

    const Derivation& d_;
    const Programs& p_;
    Precision precision_;
    Naming names_;
    std::string along_rows() const;
    bool general_, neighbours_;
};

}  // namespace lobatto
