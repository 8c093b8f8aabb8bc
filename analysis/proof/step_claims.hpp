// SPDX-License-Identifier: GPL-2.0-or-later
// What is proved of single steps and short runs: their equations, Jacobians and tangent maps, and the way back.
#pragma once

#include <utility>
#include <vector>

#include "analysis/exact_start.hpp"
#include "analysis/proof/proof_row.hpp"
#include "generator/mechanics/derivation.hpp"
#include "runtime/measure/measured_order.hpp"

namespace lobatto {

constexpr std::size_t tangent_limit = 32;      // coordinates; beyond, matrices of 2n x 2n take too long
constexpr std::int64_t steps_of_proof = 1000;  // of a short run

// The scene's start, parameters and step in the kernel's number type.
template <class real>
struct StartWithStep : StartIn<real> {
    real step;
};

template <class real>
StartWithStep<real> start_with_step(const ExactStart& start, const GiNaC::numeric& step, const Kernel& kernel) {
    const real h = number_of<real>(step);
    return {start_in<real>(start, kernel, h), h};
}

// The states (q, p) at each hundredth step of a short run, as far as it goes.
using States = std::vector<std::pair<std::vector<double>, std::vector<double>>>;
States states_along(const Kernel& kernel, const StartWithStep<double>& start);

// What the compiled steps leave in the equations that they were derived from, whatever iteration found them.
void prove_taken_steps(std::vector<ProofRow>& rows, const Derivation& derivation, const Kernel& kernel,
                       const Kernel& exact_kernel, const Kernel& ensemble, const StartWithStep<double>& start,
                       const StartWithStep<__float128>& exact);

// A start from which differences are smooth: on a knot of measured values their error would be of the first order.
QuadrupleStart beside_knots(const Scene& scene, const Kernel& kernel, const QuadrupleStart& start, double step);

// Tangent maps at `states`, and steps back; `smooth`: where differences are taken.
void prove_symplecticity(std::vector<ProofRow>& rows, const Kernel& kernel, const Kernel& exact_kernel,
                         const StartWithStep<double>& start, const StartWithStep<__float128>& exact,
                         const States& states, const QuadrupleStart& smooth, bool forced);

// (D45) On the manifold of the constraints, in differences.
void prove_symplecticity_on_constraints(std::vector<ProofRow>& rows, const Kernel& exact_kernel,
                                        const QuadrupleStart& start, __float128 step, bool forced);

}  // namespace lobatto
