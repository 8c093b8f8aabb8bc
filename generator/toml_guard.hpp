// SPDX-License-Identifier: GPL-2.0-or-later
// Refuses, with InputError, the few texts that toml++ 3.3 does not survive.
#pragma once

#include "generator/source.hpp"

namespace lobatto {

void refuse_hostile_toml(const Source& source);

}  // namespace lobatto
