// SPDX-License-Identifier: GPL-2.0-or-later
// The JSON schema of a scene file (draft 7), for editors: made from the keys that the reader knows.
#pragma once

#include <string>

namespace lobatto {

// What it refuses is refused by read_scene too. Formulas are texts to it: `lobatto check` looks into them.
std::string scene_schema();

}  // namespace lobatto
