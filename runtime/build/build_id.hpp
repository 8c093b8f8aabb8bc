// SPDX-License-Identifier: MIT
// Which build of this program or library runs.
#pragma once

#include <string>

namespace lobatto {

// The linker's digest of the program or library that this function is part of, as hexadecimal digits: another build of
// other code has another. Empty where it was linked without one.
std::string build_id();

}  // namespace lobatto
