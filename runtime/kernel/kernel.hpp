// SPDX-License-Identifier: MIT
// What emitted kernels stand on: Stepper<K>, the life in time of a kernel K. C++17, no allocation.
#ifndef LOBATTO_KERNEL_HPP
#define LOBATTO_KERNEL_HPP

#include "base/many_digits.hpp"  // whose functions packs look for

#include "base/angles.hpp"
#include "base/arc.hpp"
#include "base/contract.hpp"
#include "base/double_double_functions.hpp"
#include "base/exponential.hpp"
#include "base/full_matrix.hpp"
#include "base/numbers.hpp"
#include "base/pack.hpp"
#include "base/rows.hpp"
#include "base/shifts.hpp"
#include "base/solve.hpp"
#include "base/spline.hpp"
#include "base/trigonometry.hpp"
#include "iteration/constrained_fixed_point.hpp"
#include "iteration/convergence.hpp"
#include "iteration/ensemble_fixed_point.hpp"
#include "iteration/fixed_point.hpp"
#include "iteration/galerkin.hpp"
#include "iteration/galerkin_equations.hpp"
#include "iteration/galerkin_newton.hpp"
#include "iteration/neighbours.hpp"
#include "iteration/newton.hpp"
#include "iteration/refinement.hpp"
#include "iteration/stage_coefficients.hpp"
#include "iteration/stage_equations.hpp"
#include "iteration/stage_map.hpp"
#include "iteration/tangent.hpp"
#include "iteration/velocity_of_momentum.hpp"
#include "steppers/clean.hpp"
#include "steppers/clocked.hpp"
#include "steppers/ensemble.hpp"
#include "steppers/events.hpp"
#include "steppers/general.hpp"
#include "steppers/impacts.hpp"
#include "steppers/inputs.hpp"
#include "steppers/lent_steps.hpp"
#include "steppers/linear.hpp"
#include "steppers/refilled.hpp"
#include "steppers/separable.hpp"
#include "steppers/splitting.hpp"

#endif
