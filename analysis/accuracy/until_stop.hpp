// SPDX-License-Identifier: GPL-2.0-or-later
// Where a motion ends that a stop of its scene ends.
#pragma once

#include "generator/scene/scene.hpp"

namespace lobatto {

// The scene with the last step before its stop as the end time, if the motion meets one: for commands that look at a
// motion to its end, and at what is beyond a stop in no case. Other scenes come back as they are.
Scene ending_at_stop(Scene scene);

}  // namespace lobatto
