// SPDX-License-Identifier: GPL-2.0-or-later
// The texts of the kernel support headers, carried inside the program so that it needs no source tree.
#pragma once

#include <string>

namespace lobatto {

extern const std::string kernel_hpp_text;         // runtime/kernel.hpp with the parts that it includes, as one file
extern const std::string kernel_abi_h_text;       // runtime/kernel_abi.h
extern const std::string kernel_export_hpp_text;  // runtime/kernel_export.hpp

}  // namespace lobatto
