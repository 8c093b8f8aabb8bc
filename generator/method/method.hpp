// SPDX-License-Identifier: GPL-2.0-or-later
// A member of the family of integrators: its quadrature, its number of points, how accurately its steps are solved.
#pragma once

#include <string>
#include <vector>

#include "generator/graph/precision.hpp"

namespace lobatto {

enum class Family { lobatto, gauss, splitting };
const char* word_of(Family family);               // as a scene has it: "lobatto", "gauss", "splitting"
Family family_of(const std::string& word);        // std::invalid_argument where it is none of these
const std::vector<int>& sizes_of(Family family);  // the points or stages there are, ascending

// How a step is computed: as fast as possible, or so that what rounding leaves is random (steppers/clean.hpp).
enum class StepArithmetic { plain, clean };

// Quadrature points of one step: Lobatto with 2 to 12, Gauss with 1 to 10 (its stages), explicit splitting methods with
// 6, 11, 14, 17 or 35 (stages).
struct Method {
    Family family = Family::lobatto;
    int points = 4;
    double tolerance = 0;  // of the last increment, relative to the displacement in a step; 0: to rounding
    StepArithmetic arithmetic = StepArithmetic::plain;
    Precision numbers = Precision::double_;

    int order() const;
    std::string name() const;  // "Lobatto, 4 points", "Gauss, 1 stage", "splitting, 11 stages"
};

// Whether steps end at the tolerance. Those of splitting methods, in clean arithmetic, of linear systems, and of
// constant masses in double-double are solved to rounding at no further cost.
bool heeds_tolerance(const Method& method, bool is_linear, bool has_constant_masses);

// Why a method cannot be computed in its numbers; empty: it can. The coefficients of some are known to few digits.
std::string reason_against_numbers(const Method& method);

}  // namespace lobatto
