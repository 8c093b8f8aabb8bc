// SPDX-License-Identifier: GPL-2.0-or-later
// Where results go.
#pragma once

#include <string>

namespace lobatto {

// `given`, or without one out/NAME; makes the folder then. Throws MachineError.
std::string output_path(const std::string& given, const std::string& name);

}  // namespace lobatto
