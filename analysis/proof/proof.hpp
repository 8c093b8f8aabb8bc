// SPDX-License-Identifier: GPL-2.0-or-later
// Everything that can be checked of a scene without a paper, from the quadrature to the running kernel.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "analysis/method_choice.hpp"
#include "analysis/proof/proof_row.hpp"
#include "runtime/measure/measured_order.hpp"

namespace lobatto {

struct Proof {
    std::string title, method;
    std::vector<ProofRow> rows;
    MeasuredOrder convergence;  // without rows where it was not measured
};

// InputError, ComputationError where not even a first step can be taken.
// `say` hears what is being checked, and about which part of all work is behind.
Proof prove(
    const Scene& written, const MethodChoice& method,
    const std::function<void(const std::string&, double)>& say = [](const std::string&, double) {});

}  // namespace lobatto
