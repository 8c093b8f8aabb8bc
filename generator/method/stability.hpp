// SPDX-License-Identifier: GPL-2.0-or-later
// Where the steps of a linear system stay bounded, exactly: the zeros of 4 - trace^2.
#pragma once

#include <ginac/ginac.h>

#include <optional>
#include <string>
#include <vector>

#include "generator/method/propagation.hpp"
#include "generator/method/real_roots.hpp"

namespace lobatto {

// Steps are bounded where |trace| < 2, for trace = 2 a/delta of (D20). By a^2 - b c = delta^2 this says b c < 0: the
// limits are zeros of b and c (D36). delta has positive coefficients: no step has a pole at z > 0.

// Neighbouring limits enclose an interval: interval k lies between limit k - 1 (or 0) and limit k (or infinity).
struct StabilityInterval {
    bool stable = true;
    // Of unstable intervals: in one step states grow by a factor exp(rate), rate = arcosh |trace/2|.
    double rate = 0;               // the largest, or its limit for z -> infinity; may be infinite
    std::optional<RealRoot> peak;  // where; nothing: in that limit
};

// |trace| = 2 at one z without a change of sign.
struct Contact {
    RealRoot z;
    bool identity = false;  // b and c both vanish: the step is +-1, and nothing grows there
};

struct Stability {
    Method method;
    Propagation step;
    RationalPolynomial trace_above, trace_below;  // trace = above/below in lowest terms, integer coefficients
    std::vector<RealRoot> limits;                 // where 4 - trace^2 changes sign, ascending
    std::vector<StabilityInterval> intervals;     // of z > 0, one more than limits
    std::vector<Contact> contacts;
    // The angle of a step is x (1 + phase_error x^phase_order + ...) for the exact flow's x = h omega = sqrt(z).
    GiNaC::numeric phase_error;
    int phase_order = 0;

    GiNaC::numeric trace(const GiNaC::numeric& z) const;
};

Stability stability(const Quadrature& quadrature);

// arcosh |trace/2| where |trace| > 2, else 0.
double rate_of_step(const Stability& stability, const GiNaC::numeric& z);

// Why no z > 0 is unstable, as facts that can be checked by hand; nothing for members with limits.
struct ProofOfStability {
    RationalPolynomial c, delta;            // b = -z c: so 4 - trace^2 = z (2 c/delta)^2
    std::vector<int> at_zero, at_infinity;  // signs of delta's Sturm chain: as many changes, so no zero between
};
std::optional<ProofOfStability> proof_of_stability(const Stability& stability);

}  // namespace lobatto
