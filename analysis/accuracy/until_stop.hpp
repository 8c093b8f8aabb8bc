// SPDX-License-Identifier: GPL-2.0-or-later
// Where a motion ends that a stop of its scene ends.
#pragma once

#include "generator/scene/scene.hpp"

namespace lobatto {

// The scene with the last step before its stop as the end time, with a clock the stop itself: for commands that look at
// a motion to its end. As it is where there is no stop, or none after the first step and within two seconds.
Scene ending_at_stop(Scene scene);

}  // namespace lobatto
