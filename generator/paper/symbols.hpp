// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's notation: one table of names, their spelling and a value to evaluate at; and the exact tests that use it.
#pragma once

#include <ginac/ginac.h>

#include <string>
#include <vector>

#include "generator/paper/paper.hpp"

namespace lobatto::paper {

// The symbol of a name of the table. std::logic_error when there is none.
GiNaC::ex symbol(const std::string& name);

// A formula in the table's names, exactly.
GiNaC::ex read(const std::string& text);

// Elements of a list, a list of lists or a single expression, row by row.
std::vector<GiNaC::ex> elements(const GiNaC::ex& expression);

// a - b = 0 as rational functions over Q(sqrt 5): normal form, confirmed with 50 digits at two points.
bool equal(const GiNaC::ex& a, const GiNaC::ex& b);

// The value at the table's first or second sample point, `digits` decimal digits.
GiNaC::numeric at_sample(const GiNaC::ex& expression, int point, int digits = 60);
// The same with names given values of their own.
GiNaC::numeric at(const GiNaC::ex& expression, const GiNaC::exmap& values, int digits = 60);

// "h = 1/5, m = 13/10" for the symbols of an expression.
std::string sample_text(const GiNaC::ex& expression);

// 10 significant digits.
std::string decimal(const GiNaC::numeric& value, int digits = 10);

// The ingredients of every derivation, exact.
GiNaC::ex node();                         // xi = 1/2 - sqrt(5)/10
std::vector<GiNaC::ex> nodes();           // 0, xi, 1 - xi, 1
std::vector<GiNaC::ex> weights();         // 1/12, 5/12, 5/12, 1/12, from the moment conditions
std::vector<GiNaC::ex> lagrange_basis();  // in theta, from the product formula
// Definite integral over [0, 1] of a polynomial in theta.
GiNaC::ex integrate_polynomial(const GiNaC::ex& polynomial);

void sections_2_and_3(std::vector<Statement>& list);
void section_4(std::vector<Statement>& list);
void section_5(std::vector<Statement>& list);
void section_6(std::vector<Statement>& list);

}  // namespace lobatto::paper
