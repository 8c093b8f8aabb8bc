// SPDX-License-Identifier: GPL-2.0-or-later
// The texts of the kernel support headers, carried inside the program so that it needs no source tree.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lobatto {

struct SupportPart {
    std::string_view name, text;  // FOLDER/NAME.hpp and what it says
};

// The parts of runtime/kernel/kernel.hpp; each stands after those that it includes.
extern const std::vector<SupportPart> support_parts;
extern const std::string_view kernel_abi_h_text;               // runtime/kernel/abi.h
extern const std::string_view kernel_export_lanes_hpp_text;    // runtime/kernel/export/lanes.hpp
extern const std::string_view kernel_export_advance_hpp_text;  // runtime/kernel/export/advance.hpp
extern const std::string_view kernel_export_export_hpp_text;   // runtime/kernel/export/export.hpp
extern const std::string_view kernel_kept_hpp_text;            // runtime/kernel/kept.hpp
extern const std::string_view kernel_device_lanes_hpp_text;    // runtime/kernel/device_lanes.hpp
extern const std::string_view kernel_device_host_hpp_text;     // runtime/kernel/device_host.hpp

// The named parts and those that they include, as one file. Throws std::logic_error for a name that is none.
std::string support_text(const std::vector<std::string>& names);
// The parts, with those that trajectories side by side need too.
std::vector<std::string> with_ensemble(std::vector<std::string> names);
// And those that end at times of their own.
std::vector<std::string> with_refilled_ensemble(std::vector<std::string> names);
// All parts as one file: runtime/kernel/kernel.hpp.
std::string support_text();

}  // namespace lobatto
