// SPDX-License-Identifier: GPL-2.0-or-later
// What is proved of motions: the order of convergence, momenta and energies, and where a motion tells nothing of them.
#pragma once

#include <string>
#include <vector>

#include "analysis/proof/proof_row.hpp"
#include "analysis/proof/step_claims.hpp"
#include "generator/mechanics/outline.hpp"

namespace lobatto {

ProofRow order_row(const MeasuredOrder& convergence, const Kernel& kernel, const QuadrupleStart& start);

void prove_momenta(std::vector<ProofRow>& rows, const Kernel& kernel, const StartWithStep<double>& start,
                   const Scene& scene);

// `unkept_by`: what lets the motion lose its energy; "" where it keeps it. `has_knots`: of measured values, across
// which the forces have too few derivatives for a bounded energy error.
void prove_energies(std::vector<ProofRow>& rows, const Kernel& kernel, const Kernel& exact_kernel,
                    const StartWithStep<double>& start, const States& states, const std::string& unkept_by,
                    bool has_knots);

// What steps that are too long do to a motion tells nothing of the kernel. `turned`: h omega. Of the rows from
// `of_steps` on.
void excuse_long_steps(std::vector<ProofRow>& rows, std::size_t of_steps, double turned);
// Nor does rounding that moves a mechanism at rest.
void excuse_rest(std::vector<ProofRow>& rows, std::size_t of_motion, const SystemOutline& system,
                 const StartWithStep<double>& start, const States& states);

}  // namespace lobatto
