// SPDX-License-Identifier: GPL-2.0-or-later
// Where results go.
#include "cli/output_path.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "runtime/error.hpp"

namespace lobatto {

std::string output_path(const std::string& given, const std::string& name) {
    if (!given.empty()) return given;
    std::error_code error;
    std::filesystem::create_directory("out", error);
    if (error)
        throw MachineError(
            fmt::format("cannot create the folder out here: {}. Choose another place with -o", error.message()));
    return "out/" + name;
}

}  // namespace lobatto
