// SPDX-License-Identifier: GPL-2.0-or-later
// Where steps of a splitting method stay bounded, for linear systems.
#pragma once

#include <vector>

#include "generator/method/quadrature.hpp"

namespace lobatto {

// In `from` < h omega < `to` states grow by a factor of up to exp(rate) a step, the largest of 63 places: |trace| = 2
// cosh(rate) > 2.
struct UnstableSteps {
    double from = 0, to = 0, rate = 0;
};

// The unstable intervals; the last one has no end. Between them steps are bounded. The zeros of b and c of (D20), which
// have one sign there, are found in 64-bit arithmetic to 1e-12: the coefficients are decimals of 15 digits, and exact
// polynomials of them fill pages.
std::vector<UnstableSteps> unstable_steps(const Quadrature& quadrature);

}  // namespace lobatto
