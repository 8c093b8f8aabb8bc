// SPDX-License-Identifier: GPL-2.0-or-later
// Where results go.
#pragma once

#include <string>

#include "cli/options/command_line.hpp"

namespace lobatto {

// `given`, or without one out/NAME; makes the folder then. Throws MachineError.
std::string output_path(const std::string& given, const std::string& name);

// The same for a folder of results, which is made, and in which files can be made: before they are computed.
std::string output_folder(const std::string& given, const std::string& name);

// How the scene's results are named by default: as its file, without the ending.
std::string result_name(const std::string& scene);

// InputError when `path`, where a result is to go, is the scene itself.
void keep_scene(const std::string& scene, const std::string& path);

// InputError where `path` ends otherwise; a device is good under any name.
void require_ending(const std::string& path, const std::string& ending);

// InputError where a file that is not ours stands in the place of a result, or where its name is too long for the files
// that stand beside it while it is written. `mark`: in lower case, what the beginning of ours has; empty: what all
// files with this ending have.
void keep_foreign(const std::string& path, const std::string& mark = "");

// --json: what a command reports as JSON, by its schema in docs/schemas/.
Option add_json_option(Command& command, bool& json);

}  // namespace lobatto
