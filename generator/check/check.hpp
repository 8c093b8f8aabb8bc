// SPDX-License-Identifier: GPL-2.0-or-later
// Identities that must hold for every scene: the derivation checked by second routes, exactly or at 40 digits.
#pragma once

#include <cln/cln.h>

#include <string>
#include <vector>

#include "generator/mechanics/derivation.hpp"
#include "generator/programs/programs.hpp"

namespace lobatto {

struct Check {
    std::string claim;   // "the stage matrix is symplectic"
    bool holds = false;  // exact, or measured <= bound
    bool exact = false;  // shown by symbols; else measured at seeded points near the scene's start
    double measured = 0;
    double bound = 0;
    std::string meaning;  // what a failure says
};

// Bounds of what is measured, relative: identities in 60-digit arithmetic; central differences of step 1e-20 in it,
// whose truncation and rounding are both about 1e-40 times higher derivatives.
constexpr double identity_bound = 1e-40;
constexpr double difference_bound = 1e-32;

std::vector<Check> check_quadrature(const Quadrature& quadrature);
// The discrete equations against derivatives of L_d, the solved forms against combinations of them, the Jacobians
// against derivatives and central differences. Beyond the limit of what is written out, and for the general form, those
// of check_action.
std::vector<Check> check_equations(const Derivation& derivation);
// One node's formulas and their sums over the nodes against differences of the action, in numbers.
std::vector<Check> check_action(const Derivation& derivation);
// The programs that are emitted against the formulas of the discretisation.
std::vector<Check> check_programs(const Derivation& derivation, const Programs& optimised);

// One step that a kernel took. All numbers are those of the kernel, exactly.
struct TakenStep {
    std::vector<cln::cl_R> parameters;
    cln::cl_R time, step;
    // At the control points, controls x n. Start and end alone where the method is explicit or the system linear.
    std::vector<std::vector<cln::cl_R>> positions;
    std::vector<cln::cl_R> p0, p1;
    cln::cl_R epsilon;  // relative rounding of the kernel's numbers
};
// What the step leaves in the discrete Euler-Lagrange equations (D28), in units of what the rounding of its positions
// and momenta leaves there.
double equations_left(const Derivation& derivation, const TakenStep& step);

}  // namespace lobatto
