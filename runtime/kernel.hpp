// SPDX-License-Identifier: MIT
// What emitted kernels stand on: Stepper<K>, the life in time of a kernel K. C++17, no allocation.
#ifndef LOBATTO_KERNEL_HPP
#define LOBATTO_KERNEL_HPP

#include "kernel_angles.hpp"
#include "kernel_clean.hpp"
#include "kernel_contract.hpp"
#include "kernel_ensemble.hpp"
#include "kernel_ensemble_sweeps.hpp"
#include "kernel_events.hpp"
#include "kernel_explicit.hpp"
#include "kernel_functions.hpp"
#include "kernel_galerkin.hpp"
#include "kernel_general.hpp"
#include "kernel_linear.hpp"
#include "kernel_neighbours.hpp"
#include "kernel_numbers.hpp"
#include "kernel_pack.hpp"
#include "kernel_rows.hpp"
#include "kernel_separable.hpp"
#include "kernel_solve.hpp"
#include "kernel_stage_map.hpp"
#include "kernel_sweeps.hpp"

#endif
