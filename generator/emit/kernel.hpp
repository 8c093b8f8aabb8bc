// SPDX-License-Identifier: GPL-2.0-or-later
// Graph to the C++ text of a kernel.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "generator/graph/notation.hpp"
#include "generator/graph/optimise.hpp"

namespace lobatto {

struct Derivation;
struct OptimisedPrograms;
enum class StepForm;

struct EmitOptions {
    Precision precision = Precision::double_;
    // The text of parts of runtime/kernel/kernel.hpp, to carry inside; without it the header includes "kernel.hpp".
    std::function<std::string(const std::vector<std::string>& parts)> support_text;
};

struct KernelSource {
    StepForm form{};   // of its steps (generator/mechanics/structure/structure.hpp)
    std::string name;  // struct lobatto::kernels::NAME, a C identifier
    // The struct without the values of the scene: what is compiled to run. Starts, steps and values of parameters that
    // ask for the same formulas share it.
    std::string formulas;
    std::string header;  // the whole text of NAME.hpp, for people: header.hpp
    // The parts of runtime/kernel/kernel.hpp that one trajectory stands on, beside those that they include.
    std::vector<std::string> support;
    std::string digest;              // of the formulas: 16 hexadecimal digits
    std::vector<PassReport> report;  // first row: as derived
};

// Writes the programs out. Throws DomainError when a number is beyond the range of the kernel's number type.
KernelSource emit_kernel(const Derivation& derivation, const OptimisedPrograms& optimised, const EmitOptions& options);

}  // namespace lobatto
