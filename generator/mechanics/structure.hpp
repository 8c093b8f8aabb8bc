// SPDX-License-Identifier: GPL-2.0-or-later
// What a scene's system lets the kernel leave out, each finding with its reason.
#pragma once

#include <ginac/ginac.h>

#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "generator/mechanics/elements.hpp"
#include "generator/mechanics/system.hpp"
#include "generator/method/quadrature.hpp"

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

// How a step is taken.
enum class Form {
    linear_map,  // one affine map, no equations: autonomous linear systems with few coordinates
    separable,   // constant mass matrix: only the interior nodes are implicit (D11 ... D17)
    general      // any L: all nodes but the first are implicit (D25 ... D30)
};

// L without the cyclic coordinates: their velocities eliminated for their momenta P (Routh). Variables z = (v, q, P),
// v and q of the active coordinates. Without cyclic coordinates R = L.
struct Routhian {
    std::vector<int> active, cyclic;  // coordinates, in scene order
    std::vector<GiNaC::symbol> P;     // one a cyclic coordinate
    std::vector<GiNaC::symbol> z;     // 2 active + cyclic
    std::vector<GiNaC::ex> gradient;  // dR/dz; beside dR/dq stands the force F; dR/dP = -v of the cyclic
    SparseMatrix second;              // its derivative in z, not symmetric where forces are
};

// Coordinates whose equations are solved together, in an order that keeps coupled ones near.
struct Group {
    std::vector<int> coordinates;  // indices into the unknowns' coordinates
    int bandwidth = 0;             // the largest distance in this order of two that are coupled
};

struct Structure {
    Form form = Form::separable;
    bool general = false;        // all that follows was switched off
    bool is_explicit = false;    // separable: nothing is solved for (steppers/splitting.hpp)
    bool clean = false;          // separable: steps are round-off-clean (steppers/clean.hpp), in loops
    bool linear = false;         // constant second derivatives: one correction, its Jacobian factored once a step size
    bool diagonal_mass = false;  // of a separable system
    bool looped = false;         // terms of L that repeat are written once, in loops over tables
    Elements elements;           // looped: of V in q, or of L in z
    FixedEnds fixed_ends;        // of neighbours
    bool neighbours = false;     // looped, and its formulas go along neighbouring coordinates
    bool diagonal_part =
        false;              // separable: the constant part of M^-1 V'' is diagonal, and taken into the stage map (D31)
    bool absorbed = false;  // separable: Newton's iteration has the Jacobian of V's quadratic part (D31)
    SparseMatrix constant_hessian;             // the part of V'' that does not depend on q
    std::vector<std::pair<int, int>> entries;  // separable: where M^-1 V'' is not identically zero, row by row
    Routhian routhian;                         // general
    std::vector<Group> groups;
    std::optional<ClosedSolution> closed_solution;
    std::vector<Finding> findings;  // all of the above and what was looked for in vain, in words
};

// Coordinates of a linear map; unknowns of a separable step whose constant mass matrix is full.
constexpr int linear_map_limit = 16, full_mass_limit = 4;
// Terms of L from which on loops are looked for.
constexpr int looped_from = 32;
// The additive part of a second derivative that does not depend on some variables.
class ConstantPart {
public:
    explicit ConstantPart(const std::vector<GiNaC::symbol>& variables);
    GiNaC::ex of(const GiNaC::ex& value) const;

private:
    bool holds_variable(const GiNaC::ex& value) const;
    std::set<GiNaC::ex, GiNaC::ex_is_less> variables_;
};

// `general`: find nothing, for comparison.
Structure find_structure(const Scene& scene, const System& system, const Quadrature& quadrature, bool general = false);

}  // namespace lobatto
