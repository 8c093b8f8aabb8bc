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
// are. InputError where there is no such Lagrangian: explicit time, forces, a clock that is not positive at the start.
Scene in_clock_time(const Scene& scene);

// g(q). InputError as above.
GiNaC::ex clock_rate(const Scene& scene);

// InputError where a scene with a clock is given to what knows none: "lobatto stability".
void refuse_clock(const Scene& scene, const std::string& what);

}  // namespace lobatto
