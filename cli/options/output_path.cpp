// SPDX-License-Identifier: GPL-2.0-or-later
// Where results go.
#include "cli/options/output_path.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <filesystem>
#include <fstream>

#include "generator/formula/text/source.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"

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

std::string output_folder(const std::string& given, const std::string& name) {
    if (is_standard_output(given)) throw InputError("-o -: several files are written; name a folder for them");
    const std::string folder = output_path(given, name);
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error)
        throw MachineError(
            fmt::format("cannot create the folder {}: {}. Choose another place with -o", folder, error.message()));
    if (::faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) != 0) fail_to_write("results", folder, errno);
    return folder;
}

std::string result_name(const std::string& scene) {
    return std::filesystem::path(scene).stem().string();
}

bool is_standard_output(const std::string& path) {
    return path == standard_output || path == "/dev/stdout" || path == "/dev/fd/1" || path == "/proc/self/fd/1";
}

void keep_scene(const std::string& scene, const std::string& path) {
    std::error_code none;
    if (path == standard_output) return;
    // Regular files only: a terminal is good as both.
    for (const char* ending : {"", ".partial", ".checkpoint"})
        if (std::filesystem::is_regular_file(path + ending, none) &&
            std::filesystem::equivalent(path + ending, scene, none))
            throw InputError(
                fmt::format("{}: the result would overwrite the scene {}; give it another name", path, scene));
}

void keep_foreign(const std::string& path) {
    constexpr std::size_t looked_at = 4096;  // bytes: all text that Lobatto writes names it in its first lines
    std::error_code none;
    if (path == standard_output || !std::filesystem::is_regular_file(path, none)) return;
    std::string begin(looked_at, '\0');
    std::ifstream file(path, std::ios::binary);
    file.read(begin.data(), static_cast<std::streamsize>(looked_at));
    begin.resize(static_cast<std::size_t>(file.gcount()));
    std::transform(begin.begin(), begin.end(), begin.begin(), [](unsigned char c) { return std::tolower(c); });
    // Binary files do not name the program that wrote them: files of these formats may be overwritten.
    const bool names_nobody = begin.starts_with("\x93numpy") || begin.starts_with("\x89hdf") ||
                              begin.starts_with("\x89png") || begin.starts_with("gif8") || begin.find("ftyp") == 4;
    if (!begin.empty() && begin.find("lobatto") == std::string::npos && begin.find("gnuplot") == std::string::npos &&
        !names_nobody)
        throw InputError(fmt::format(
            "{} is there, and Lobatto did not write it. Move it away, or choose another place with -o", path));
}

Option add_json_option(Command& command, bool& json) {
    return command.flag("--json", json, "Print JSON instead, for machines (docs/machines.md)");
}

}  // namespace lobatto
