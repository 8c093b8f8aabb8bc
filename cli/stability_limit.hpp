// SPDX-License-Identifier: GPL-2.0-or-later
// How long a step of a member of the family may be before it amplifies an oscillation.
#pragma once

#include "generator/quadrature.hpp"

namespace lobatto {

// The largest h omega up to which the step of the harmonic oscillator is stable: |a/delta| <= 1 in its propagation
// (D20), found by evaluating it. Resonances that amplify by less than 1e-6 a step are passed over: those of Lobatto's
// high orders near multiples of pi are narrower than what any step would meet. Infinite for Gauss.
double stability_limit(const Quadrature& quadrature);

}  // namespace lobatto
