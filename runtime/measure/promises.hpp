// SPDX-License-Identifier: MIT
// What a symmetric variational integrator promises on a given motion: to run backwards, to keep energy errors bounded.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "runtime/build/library.hpp"
#include "runtime/measure/measured_order.hpp"

namespace lobatto {

// Forwards and, with -h, backwards again. The distance from the start, and the rounding that explains it: that of all
// steps, times what the way back makes of a small disturbance (the norm of the inverse of the flow's derivative; of a
// symplectic flow, that of the derivative itself).
struct Return {
    std::int64_t steps = 0;  // one way; fewer than asked for when a step failed
    double distance = 0;     // of positions relative to the farthest that one moves, or of momenta likewise
    double rounding = 0;     // both infinite when a step fails on the way
    bool rests = false;      // no position moves by more than 1e-8 of the largest: rounding is no part of a way
};
template <class real>
Return there_and_back(const Kernel& kernel, const std::vector<real>& parameters, const std::vector<real>& q,
                      const std::vector<real>& p, real step, std::int64_t steps, bool symplectic = true);

// |T d - D(d)| relative to |T d|, entries relative to the size of their component, over all 2n directions d, where D is
// the difference (8 (step(z + e d) - step(z - e d)) - (step(z + 2e d) - step(z - 2e d))) / 12e, and e is 3e-5, 1e-6 or
// 1e-9 of what the component moves in the step, whichever agrees best: whether the tangent map is the derivative of the
// step. Both errors are below 1e-18.
double tangent_defect(const Kernel& kernel, const QuadrupleStart& start, double step);

// |H in double - H in quadruple| at states (q, p), largest, relative to the largest |kinetic| + |potential energy|
// among them: whether the formula of H loses its digits by cancellation. States whose energy is too large for a double
// are left out; not a number when there are no others.
double energy_defect(const Kernel& kernel, const Kernel& exact_kernel, const std::vector<double>& parameters,
                     double step, const std::vector<std::pair<std::vector<double>, std::vector<double>>>& states);

// The means of H - H(0) over both halves of a long run, and how far it swings: a drift moves the mean.
struct EnergyDrift {
    std::int64_t steps = 0;  // good steps, at most those asked for
    double swing = 0;        // max - min of H - H(0)
    double drift = 0;        // |mean of the second half - mean of the first|
    double rounding = 0;     // of H along the run, adding up step by step
    bool bounded = false;    // whether the motion stays within four times the region of its first half
    bool chaotic = false;  // whether it makes more than 1e7 times as much of a small disturbance: errors of the energy
                           // then wander, with no mean to return to
};
EnergyDrift energy_drift(const Kernel& kernel, const std::vector<double>& parameters, const std::vector<double>& q,
                         const std::vector<double>& p, double step, std::int64_t steps);

}  // namespace lobatto
