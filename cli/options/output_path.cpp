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

void keep_scene(const std::string& scene, const std::string& path) {
    std::error_code none;
    if (is_standard_output(path)) return;
    // Regular files only: a terminal is good as both.
    for (const char* ending : {"", ".partial", ".checkpoint"})
        if (std::filesystem::is_regular_file(path + ending, none) &&
            std::filesystem::equivalent(path + ending, scene, none))
            throw InputError(
                fmt::format("{}: the result would overwrite the scene {}; give it another name", path, scene));
}

void require_ending(const std::string& path, const std::string& ending) {
    std::error_code none;
    const bool is_device = std::filesystem::exists(path, none) && !std::filesystem::is_regular_file(path, none) &&
                           !std::filesystem::is_directory(path, none);
    if (!is_standard_output(path) && !is_device && !path.ends_with(ending))
        throw InputError(fmt::format("-o: {} is no {}", path, ending));
}

namespace {

// Of a file's name, in bytes: file systems have 255, and NAME.checkpoint.partial may stand beside it.
constexpr std::size_t longest_name = 230;

// In lower case, by their endings: what stands in the first lines of the files that we write, and in no others.
constexpr std::pair<std::string_view, std::string_view> marks[] = {
    {".csv", "# lobatto"},
    {".h5", "lobatto"},
    {".hpp", "// written by lobatto from a scene file"},
    {".html", "<meta name=\"generator\" content=\"lobatto\">"},
    {".json", "\"lobatto\": \""},
    {".1", ".th lobatto"},
    {".md", "written by `lobatto "},
};

std::string mark_of(const std::string& path) {
    for (const auto& [ending, mark] : marks)
        if (path.ends_with(ending)) return std::string(mark);
    return "";
}

// In lower case: text names Lobatto in its first lines, HDF5 in one of its first blocks.
std::string begin_of(const std::string& path) {
    const std::size_t looked_at = path.ends_with(".h5") ? 1 << 20 : 4096;  // bytes
    std::string begin(looked_at, '\0');
    std::ifstream file(path, std::ios::binary);
    file.read(begin.data(), static_cast<std::streamsize>(looked_at));
    begin.resize(static_cast<std::size_t>(file.gcount()));
    std::transform(begin.begin(), begin.end(), begin.begin(), [](unsigned char c) { return std::tolower(c); });
    return begin;
}

}  // namespace

void keep_foreign(const std::string& path, const std::string& given_mark) {
    std::error_code none;
    if (is_standard_output(path)) return;
    const std::size_t bytes = std::filesystem::path(path).filename().string().size();
    if (bytes > longest_name)
        throw InputError(
            fmt::format("{}: the name of this file has {} bytes, and at most {} are possible, for others are named "
                        "after it; choose a shorter name with -o",
                        path, bytes, longest_name));
    const std::filesystem::path folder = std::filesystem::path(path).parent_path();
    if (!folder.empty() && !std::filesystem::exists(folder, none)) fail_to_write("results", path, ENOENT);
    if (!std::filesystem::is_regular_file(path, none)) return;
    const std::string begin = begin_of(path), mark = given_mark.empty() ? mark_of(path) : given_mark;
    const auto holds = [&](const std::string& part) { return begin.find(part) != std::string::npos; };
    // Pictures do not name the program that wrote them: they may be overwritten. What an array is of stands beside it.
    const bool names_nobody = (path.ends_with(".png") && begin.starts_with("\x89png")) ||
                              (path.ends_with(".gif") && begin.starts_with("gif8")) ||
                              (path.ends_with(".mp4") && begin.substr(0, 8).ends_with("ftyp"));
    const bool is_ours =
        (!mark.empty() && (path.ends_with(".csv") && given_mark.empty() ? begin.starts_with(mark) : holds(mark))) ||
        (path.ends_with(".svg") && begin.starts_with("<?xml") && holds("produced by gnuplot")) ||
        (begin.starts_with("\x93numpy") && begin_of(path + ".json").find(mark_of(".json")) != std::string::npos);
    if (!begin.empty() && !is_ours && !names_nobody)
        throw InputError(fmt::format(
            "{} is there, and Lobatto did not write it. Move it away, or choose another place with -o", path));
}

Option add_json_option(Command& command, bool& json) {
    return command.flag("--json", json, "Print JSON instead, for machines (docs/machines.md)");
}

}  // namespace lobatto
