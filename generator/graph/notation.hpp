// SPDX-License-Identifier: GPL-2.0-or-later
// The graph as written formulas: for people, for LaTeX and for C++.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>

#include "generator/graph/graph.hpp"
#include "generator/graph/precision.hpp"

namespace lobatto {

enum class Notation { text, latex, cpp, plain };  // cpp: with the functions of lobatto::; plain: with those of std::

// How a node that has a name of its own reads (an input, a temporary); empty: print its operation.
using Naming = std::function<std::string(Id)>;

// The formula of a node. C++ literals are shortest round-trip for double, DoubleDouble(high, low) for double-double,
// and 9, 21, 36 digits with suffix f, L, Q otherwise. Where it `fuses`, C++ adds products by lobatto::fused_sum(a, b,
// c) = a b + c of base/pack.hpp. In a template, which may be asked to compute in double, literals of double-double are
// lobatto::literal<number>(high, low).
std::string formula(const Graph& graph, Id id, Notation notation, const Naming& naming = {},
                    Precision precision = Precision::double_, bool fuses = false, bool in_template = false);

// A number in scientific or plain decimal notation, rounded once to the given count of significant digits.
std::string decimal(const cln::cl_R& value, int digits);

// A GiNaC expression as a person reads it, in an order that does not change from run to run. Symbols are ordered by
// name.
std::string canonical_text(const GiNaC::ex& expression, Notation notation = Notation::text);
// For messages: of a long one only how long it is.
std::string short_text(const GiNaC::ex& expression);

// A name for LaTeX: theta_1' becomes \dot{\theta}_{1}. One that begins with a backslash is LaTeX already.
std::string latex_name(const std::string& name);
// x1 and x_1 are both x_{1}: of names of one document that LaTeX would write alike, all but the clearest one, each with
// LaTeX that spells it out, \mathrm{x1}.
std::map<std::string, std::string> latex_as_written(const std::set<std::string>& names);

}  // namespace lobatto
