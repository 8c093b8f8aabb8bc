// SPDX-License-Identifier: GPL-2.0-or-later
// Stands between a file and toml++ 3.3, which does not survive every text.
#pragma once

#include <string>

#include "generator/formula/text/source.hpp"

namespace lobatto {

// The text with every character beyond ASCII replaced by '?', so that lines and columns stay.
// Throws InputError for what toml++ must not see.
std::string guarded_toml(const Source& source);

}  // namespace lobatto
