// SPDX-License-Identifier: GPL-2.0-or-later
// Manual pages and completions for shells, from what the helps say.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "cli/options/command_line.hpp"

namespace lobatto {

// Files of section 1: "lobatto.1", "lobatto-run.1", …, and their texts.
std::vector<std::pair<std::string, std::string>> manual_pages(const CommandLine& program);

enum class Shell { bash, zsh, fish };
std::string completions(const CommandLine& program, Shell shell);

}  // namespace lobatto
