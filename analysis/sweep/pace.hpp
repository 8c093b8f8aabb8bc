// SPDX-License-Identifier: GPL-2.0-or-later
// How fast a sweep would be on the processor and on a device, from trials of a fraction of a second.
#pragma once

#include <cstdint>

#include "runtime/run/ensemble/ensemble.hpp"

namespace lobatto {

// Whether all `trajectories` would take the processor longer than a device's compiler takes.
bool is_long(const Kernel& kernel, const EnsembleRequest& request, std::int64_t trajectories);
// `request` has a device: whether more steps are taken there in a second.
bool is_faster_on_device(const Kernel& kernel, const EnsembleRequest& request);

}  // namespace lobatto
