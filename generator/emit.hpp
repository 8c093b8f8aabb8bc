// SPDX-License-Identifier: GPL-2.0-or-later
// Graph to C++ text: the only file that prints C++.
#pragma once

#include <string>
#include <vector>

namespace lobatto {

struct Derivation;

enum class Precision { single, double_, extended, quadruple };  // float, double, long double, __float128

struct EmitOptions {
    Precision precision = Precision::double_;
    std::string standalone_support;  // text of runtime/kernel.hpp to carry inside; empty: the header includes "kernel.hpp"
};

// Operations of the emitted programs, per pass.
struct PassReport {
    std::string pass;            // "fold constants"
    long additions = 0, multiplications = 0, divisions = 0, functions = 0;  // after the pass, one evaluation of every program
    double disagreement = 0;     // largest relative difference to the graph before the pass, at seeded points, 40 digits
    long total() const { return additions + multiplications + divisions + functions; }
};

struct KernelSource {
    std::string name;      // struct lobatto::kernels::NAME, a C identifier
    std::string header;    // the whole text of NAME.hpp
    std::string digest;    // 16 hexadecimal digits of the header's formulas
    std::string manifest;  // JSON: scene, method, shapes, parameters, structure, operation counts
    std::vector<PassReport> report;  // first row: as derived
};

}  // namespace lobatto
