// SPDX-License-Identifier: GPL-2.0-or-later
// Why a step failed, where a formula has no value ahead (beyond the end of measured values, or of a root at a switch),
// or where that of the clock grows beyond all bounds.
#pragma once

#include <string>

#include "analysis/accuracy/formulas/domains.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

// With what to do, without a place; empty: no formula is to blame. `kernel` computes in double.
std::string stopped_at_formula(const Scene& scene, const Domains& domains, const Kernel& kernel,
                               const TrajectoryRequest& request, const TrajectoryResult& result);

}  // namespace lobatto
