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
struct Scene;
struct OptimisedPrograms;
enum class Form;

struct EmitOptions {
    Precision precision = Precision::double_;
    // The text of parts of runtime/kernel/kernel.hpp, to carry inside; without it the header includes "kernel.hpp".
    std::function<std::string(const std::vector<std::string>& parts)> support_text;
};

struct KernelSource {
    Form form{};         // of its steps (generator/mechanics/structure/structure.hpp)
    std::string name;    // struct lobatto::kernels::NAME, a C identifier
    std::string header;  // the whole text of NAME.hpp, for people
    // The struct in it without the values of the scene: what is compiled to run. Starts, steps and values of parameters
    // that ask for the same formulas share it.
    std::string formulas;
    // The parts of runtime/kernel/kernel.hpp that one trajectory stands on, beside those that they include.
    std::vector<std::string> support;
    std::string digest;              // of the formulas: 16 hexadecimal digits
    std::vector<PassReport> report;  // first row: as derived
};

// Whether a program steps it by lobatto::HybridStepper, which looks for events; else by lobatto::Stepper.
bool has_hybrid_stepper(const Scene& scene);
// "tolerance = 1e-09": how a program that holds the kernel's text asks its stepper for the tolerance of the scene.
std::string tolerance_setting(const Scene& scene);

// Writes the programs out. Throws DomainError when a number is beyond the range of the kernel's number type.
KernelSource emit_kernel(const Derivation& derivation, const OptimisedPrograms& optimised, const EmitOptions& options);

}  // namespace lobatto
