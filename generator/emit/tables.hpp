// SPDX-License-Identifier: GPL-2.0-or-later
// The constants of a kernel: shapes, claims, quadrature tables, and the order in which unknowns are solved.
#pragma once

#include <ginac/ginac.h>

#include <string>
#include <vector>

#include "generator/graph/notation.hpp"

namespace lobatto {

struct Derivation;
struct System;

// Coordinates up to which a step's tangent map is worth its 4 n^2 numbers.
constexpr int tangent_limit = 64;
bool has_tangent(const Derivation& derivation);

// Whether vector registers know these numbers.
bool has_lanes(Precision precision);
// Whether all masses are 1, whatever the parameters.
bool has_unit_masses(const System& system);

std::string shapes(const Derivation& derivation, Precision precision, const std::string& name);
std::string tables(const Derivation& derivation, Precision precision);
std::string type_name(Precision precision);
// static constexpr int NAME[...] = {...}; and real NAME[...] likewise.
std::string integer_table(const std::string& name, const std::vector<int>& values);
std::string number_table(const std::string& name, const std::vector<GiNaC::ex>& values, Precision precision);
std::string value_table(const std::string& name, const std::vector<cln::cl_R>& values, Precision precision);

}  // namespace lobatto
