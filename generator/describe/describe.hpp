// SPDX-License-Identifier: GPL-2.0-or-later
// A derivation as a list of numbered formulas, and that list for people, for LaTeX and for machines.
#pragma once

#include <ginac/ginac.h>

#include <string>
#include <utility>
#include <vector>

#include "generator/mechanics/structure/structure.hpp"

namespace lobatto {

struct Derivation;

// One result: a scalar, a vector or a matrix of formulas, in symbols whose names are all different.
struct Formula {
    std::string id;                  // for machines: discrete_lagrangian
    std::string number;              // in docs/derivation.md: D4
    std::string paper;               // label in the paper, "" when it has none
    std::string meaning;             // one line
    std::vector<std::string> left;   // what each value equals: one name a value, or one for a whole matrix
    std::vector<std::size_t> shape;  // {}: scalar; {rows}; {rows, columns}
    std::vector<GiNaC::ex> values;   // row-major
};

struct Section {
    std::string title;
    std::vector<Formula> formulas;
};

struct Description {
    std::string name;                                        // of the scene: pendulum
    std::string title;                                       // A plane pendulum
    std::vector<std::pair<std::string, std::string>> facts;  // "Lagrangian", "L = m*q'^2/2"
    std::vector<Section> sections;
    std::vector<Finding> findings;
};

Description describe(const Derivation& derivation);

std::string text_of(const Description& description);
std::string latex_of(const Description& description);  // a complete document
std::string json_of(const Description& description);   // docs/derivation.md, last section

// A sum cut before its + and - signs that stand outside all brackets, into lines of about `width`.
std::vector<std::string> cut_at_signs(const std::string& formula, std::size_t width);

}  // namespace lobatto
