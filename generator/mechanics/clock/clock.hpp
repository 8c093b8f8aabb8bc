// SPDX-License-Identifier: GPL-2.0-or-later
// A scene in the time of its clock: dt = g(q) dtau, the same orbits, and steps of equal length in tau.
#pragma once

#include "generator/scene/scene.hpp"

namespace lobatto {

// The scene of the Lagrangian (D42)
//     Lambda(q, w) = g(q) (L(q, w / g(q)) + E),    w = dq/dtau,
// of K = g (H - E), whose orbits with K = 0 are those of H = E. Momenta dLambda/dw = dL/dv are the physical ones. The
// coordinates' velocity symbols stand for w from then on; E, the energy at the start, is one more parameter, the last
// (kernels set it when they start). Scenes without a clock, and those that are transformed already, come back as they
// are. InputError where the clock is not positive at the start.
//
// Where the time is a coordinate, with w_t = dt/dtau, it is (D64)
//     Lambda(q, t, w, w_t) = w_t L(q, w / w_t, t) + sigma g^a (w_t / g - 1)^2 / 2
// of K + K^2 / (2 sigma g^a), K = g (H + p_t); the last parameter is sigma. Forces are those in the time of the clock.
Scene in_clock_time(const Scene& scene);

// a: 1/3, with which both terms change alike along orbits under Newton's attraction, where g^(1/3) is a root; else 0.
GiNaC::numeric pace_exponent(const GiNaC::ex& g);

// g(q, t). InputError where it has no value at the start.
GiNaC::ex clock_rate(const Scene& scene);

// InputError where a scene with a clock is given to what knows none: "lobatto stability".
void refuse_clock(const Scene& scene, const std::string& what);

}  // namespace lobatto
