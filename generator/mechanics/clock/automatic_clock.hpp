// SPDX-License-Identifier: GPL-2.0-or-later
// A clock from the terms of a Lagrangian that grow without bound, as 1/r does in close encounters.
#pragma once

#include "generator/scene/scene.hpp"

namespace lobatto {

// 1 at the start, and in proportion to (Omega^2 + sum of omega^2)^(-1/2), the frequencies near each pole and those that
// are the same everywhere (D65); or to U^-(1/k + 1/2) for U the sum of the terms, each with the sign that makes it
// positive at the start, and k the least degree of their poles: near a pole r^-k a motion of that energy turns in a
// time r / sqrt(r^-k). InputError where no term has a pole.
GiNaC::ex automatic_clock(const Scene& scene);

// Whether there is one, of a motion without constraints, cuts and inputs.
bool has_automatic_clock(const Scene& scene);

// The scene with that clock, or with equal steps in t. Where that changes what a step is, all states at its steps are
// kept: the scene's own word on it counts steps without a clock, and is a time with one.
Scene with_automatic_clock(Scene scene);
Scene with_equal_steps(Scene scene);

}  // namespace lobatto
