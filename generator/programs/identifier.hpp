// SPDX-License-Identifier: GPL-2.0-or-later
// A name of the scene as a C++ identifier that no keyword, macro or emitted name takes away.
#pragma once

#include <string>

namespace lobatto {

// Different names give different identifiers: what is taken gets an underscore.
std::string identifier(const std::string& name);

}  // namespace lobatto
