// SPDX-License-Identifier: MIT
// Solutions in closed form, to measure errors against.
#pragma once

namespace lobatto {

struct PhasePoint {
    long double q = 0;
    long double velocity = 0;
};

// q'' = -w2 q, any sign of w2 (and zero).
PhasePoint harmonic_solution(long double omega_squared, long double q0, long double velocity0, long double time);

// q'' = -w2 sin q, any sign of w2 (and zero): libration, separatrix and rotation, by Jacobi elliptic functions
// (descending Landen / AGM), accurate to a few units of long double relative to the phase omega t. A rotation counts
// its turns: q is not reduced.
PhasePoint pendulum_solution(long double omega_squared, long double q0, long double velocity0, long double time);

// Period of the libration with amplitude q0 (velocity 0), w2 > 0: 4 K(sin(q0/2)) / omega.
long double pendulum_period(long double omega_squared, long double amplitude);

}  // namespace lobatto
