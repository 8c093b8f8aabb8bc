// SPDX-License-Identifier: GPL-2.0-or-later
// Graph to C++ text: the only file that prints C++.
#pragma once

#include <string>
#include <vector>

#include "generator/graph/notation.hpp"
#include "generator/graph/optimise.hpp"

namespace lobatto {

struct Derivation;
enum class Form;

struct EmitOptions {
    Precision precision = Precision::double_;
    std::string standalone_support;  // text of runtime/kernel/kernel.hpp to carry inside; empty: the header includes
                                     // "kernel.hpp"
};

struct KernelSource {
    Form form{};                     // of its steps (generator/mechanics/structure.hpp)
    std::string name;                // struct lobatto::kernels::NAME, a C identifier
    std::string header;              // the whole text of NAME.hpp
    std::string stepper;             // the part of runtime/kernel/kernel.hpp that its Stepper is in; empty: any
    std::string digest;              // 16 hexadecimal digits of the header's formulas
    std::vector<PassReport> report;  // first row: as derived
};

// Optimises the programs and writes them out. Throws DomainError when the formulas are real nowhere.
KernelSource emit_kernel(const Derivation& derivation, Programs programs, const EmitOptions& options);

}  // namespace lobatto
