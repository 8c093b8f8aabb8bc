// SPDX-License-Identifier: GPL-2.0-or-later
// What a scene's system lets the kernel leave out, each finding with its reason.
#pragma once

#include <ginac/ginac.h>

#include <optional>
#include <string>
#include <vector>

#include "generator/system.hpp"

namespace lobatto {

struct Finding {
    std::string name;  // "linear system"
    bool holds = false;
    std::string reason;  // "every second derivative of V is free of q"
};

// A one-coordinate system with a solution in closed form.
struct ClosedSolution {
    enum class Kind { harmonic, pendulum };  // q'' = -w2 q; q'' = -w2 sin(q) (Jacobi elliptic functions)
    Kind kind = Kind::harmonic;
    GiNaC::ex omega_squared;  // w2, in parameters
};

struct Structure {
    bool linear = false;  // V at most quadratic: the step is an affine map
    bool diagonal_mass = false;
    std::vector<std::pair<int, int>> entries;  // where M^-1 V'' is not identically zero, row by row
    std::optional<ClosedSolution> closed_solution;
    std::vector<Finding> findings;  // all of the above and what was looked for in vain, in words
};

Structure find_structure(const System& system);

}  // namespace lobatto
