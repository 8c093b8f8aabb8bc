// SPDX-License-Identifier: GPL-2.0-or-later
// What was found of a system and how a step is taken, in words for a newcomer.
#pragma once

#include <string>
#include <vector>

#include "generator/mechanics/derivation.hpp"

namespace lobatto {

enum class MatrixOfStep { none, full, banded };
const char* word_of(MatrixOfStep matrix);  // "nothing to solve", "full matrix", "banded matrix"

// Equations that are solved together.
struct GroupSolve {
    std::vector<int> coordinates;  // indices in the scene; behind its coordinates the multipliers of its constraints
    int unknowns = 0;
    int band = 0;  // of the matrix, on either side of its diagonal; unknowns - 1 when it is full
    MatrixOfStep matrix = MatrixOfStep::none;
};

// "Kinetic minus potential energy, with constant masses."
std::string kind_of(const Derivation& derivation);
// What a step computes: "Only the positions at the 2 points inside the step are unknown; its end follows from them."
std::string form_of(const Derivation& derivation);
// Unknowns of the equations of one step.
int unknowns_of(const Derivation& derivation);
std::vector<GroupSolve> solves_of(const Derivation& derivation);
// "Newton's iteration; {x, y}: 4 equations as a full matrix; ..."
std::string solver_text(const Derivation& derivation);

// Multiplications of one elimination with all of them, about.
long elimination_of(const Derivation& derivation);

}  // namespace lobatto
