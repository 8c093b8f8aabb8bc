// SPDX-License-Identifier: GPL-2.0-or-later
// The integrator of a scene as a textbook prints it: one C++17 header with scalar formulas and loops, to read and copy.
#pragma once

#include <string>

#include "generator/graph/notation.hpp"

namespace lobatto {

struct Derivation;
struct OptimisedPrograms;

// Coordinates whose formulas are all written out.
constexpr int plain_limit = 64;

struct PlainSource {
    std::string name;    // of the namespace, a C identifier
    std::string header;  // the whole text of NAME.hpp
};

// `derivation`: of the separable form, without loops over repeated terms, or of the general form without shortcuts, at
// most plain_limit coordinates, any method in plain arithmetic. Precision: float, double or long double.
PlainSource emit_plain(const Derivation& derivation, const OptimisedPrograms& optimised, Precision precision);

}  // namespace lobatto
