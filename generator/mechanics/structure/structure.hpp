// SPDX-License-Identifier: GPL-2.0-or-later
// What a scene's system lets the kernel leave out, each finding with its reason.
#pragma once

#include <ginac/ginac.h>

#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "generator/mechanics/repeated/elements.hpp"
#include "generator/mechanics/structure/closed_solution.hpp"
#include "generator/mechanics/structure/findings.hpp"
#include "generator/mechanics/structure/groups.hpp"
#include "generator/mechanics/structure/hamiltonian.hpp"
#include "generator/mechanics/system/system.hpp"
#include "generator/method/quadrature.hpp"

namespace lobatto {

// L without the cyclic coordinates: their velocities eliminated for their momenta P (Routh). Variables z = (v, q, P),
// v and q of the active coordinates. Without cyclic coordinates R = L.
struct Routhian {
    std::vector<int> active, cyclic;  // coordinates, in scene order
    std::vector<GiNaC::symbol> P;     // one a cyclic coordinate
    // One a constraint; with constraints nothing is cyclic, and R = L + phi . multipliers.
    std::vector<GiNaC::symbol> multipliers;
    std::vector<GiNaC::symbol> z;     // 2 active + cyclic + multipliers
    std::vector<GiNaC::ex> gradient;  // dR/dz; beside dR/dq stands the force F; dR/dP = -v of the cyclic
    SparseMatrix second;              // its derivative in z, not symmetric where forces are
};

// The forms of a step, each with what was found for it.
//
// What the forms of a constant mass matrix share.
struct ConstantMassForm {
    bool is_explicit = false;                  // nothing is solved for (steppers/splitting.hpp)
    bool diagonal_mass = false;                // no two velocities are multiplied
    std::vector<std::pair<int, int>> entries;  // where M^-1 V'' is not identically zero, row by row
};
// One affine map, no equations: autonomous linear systems with few coordinates.
struct LinearMapForm : ConstantMassForm {};
// Only the interior nodes are implicit (D11 ... D17).
struct SeparableForm : ConstantMassForm {
    bool clean = false;             // steps are round-off-clean (steppers/clean.hpp), in loops
    bool neighbours = false;        // the formulas of loops go along neighbouring coordinates
    FixedEnds fixed_ends;           // of neighbours
    bool diagonal_part = false;     // the constant part of M^-1 V'' is diagonal, and taken into the stage map (D31)
    bool absorbed = false;          // Newton's iteration has the Jacobian of V's quadratic part (D31)
    SparseMatrix constant_hessian;  // the part of V'' that does not depend on q
};
// Any L: all nodes but the first are implicit (D25 ... D30).
struct GeneralForm {
    bool full = false;  // asked for: nothing is looked for, matrices are full
    Routhian routhian;
    std::optional<Hamiltonian> hamiltonian;  // iterations take velocities and forces of momenta (D62)
};
enum class StepForm { linear_map, separable, general };  // in the order of Structure's variant

// What the structure of a system lets a kernel leave out: all of it, or nothing (`--general`).
enum class Shortcuts { all, none };

struct Structure {
    std::variant<LinearMapForm, SeparableForm, GeneralForm> of_form;
    bool linear = false;  // constant second derivatives: one correction, its Jacobian factored once a step size
    bool looped = false;  // terms of L that repeat are written once, in loops over tables
    Elements elements;    // looped: of V in q, or of L in z
    std::vector<Group> groups;
    std::optional<ClosedSolution> closed_solution;

    StepForm form() const { return static_cast<StepForm>(of_form.index()); }
    // Of both forms with constant mass.
    const ConstantMassForm& constant_mass() const;
    const SeparableForm& separable() const { return std::get<SeparableForm>(of_form); }
    const Routhian& routhian() const { return std::get<GeneralForm>(of_form).routhian; }
    const std::optional<Hamiltonian>& hamiltonian() const { return std::get<GeneralForm>(of_form).hamiltonian; }
    // A linear map is taken as a separable step.
    void iterate();
    // Of any form: false where the form has no such thing.
    bool is_explicit() const { return form() != StepForm::general && constant_mass().is_explicit; }
    bool clean() const { return form() == StepForm::separable && separable().clean; }
    bool neighbours() const { return form() == StepForm::separable && separable().neighbours; }
    bool diagonal_part() const { return form() == StepForm::separable && separable().diagonal_part; }
    bool absorbed() const { return form() == StepForm::separable && separable().absorbed; }
    Shortcuts shortcuts() const { return full() ? Shortcuts::none : Shortcuts::all; }
    bool full() const { return form() == StepForm::general && std::get<GeneralForm>(of_form).full; }
};

// Coordinates of a linear map; unknowns of a separable step whose constant mass matrix is full.
constexpr int linear_map_limit = 16, full_mass_limit = 4;
// Terms of L from which on loops are looked for.
constexpr int looped_from = 32;

// The findings are what the structure rests on, and what was looked for in vain, in words. `general`: find nothing, for
// comparison.
std::pair<Structure, std::vector<Finding>> find_structure(const Scene& scene, const System& system,
                                                          const Quadrature& quadrature,
                                                          Shortcuts shortcuts = Shortcuts::all);

}  // namespace lobatto
