// SPDX-License-Identifier: GPL-2.0-or-later
// A sweep that is ready to be computed, a range at a time: by sweep() of lobatto.hpp, by `lobatto sweep`, its shards
// and its ranks.
#pragma once

#include <memory>

#include "analysis/sweep/study.hpp"
#include "library/parts.hpp"

namespace lobatto::api {

using OpenedSweep = std::unique_ptr<SweepStudy, DestroyInAlgebra>;

// The columns, as a sweep takes them.
StartsRequest request_of(const Starts& starts);
// Reads what is kept, derives, compiles, and refuses what makes no sense. Throws Error.
OpenedSweep open_sweep(const Scene& scene, const StartsRequest& starts, const SweepOptions& options);

}  // namespace lobatto::api
