// SPDX-License-Identifier: GPL-2.0-or-later
// Files of input and the layout of errors: place, message, line, caret. Nothing of a file reaches a terminal raw.
#include "generator/formula/text/source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace lobatto {
namespace {

constexpr std::size_t largest_file = 1'000'000;  // bytes
constexpr std::size_t widest_line = 200;         // characters; longer lines are shown as a window around the caret
constexpr std::string_view replacement = "\uFFFD";

// The UTF-8 code point at the front of a text, in bytes and by value; a wrong byte is one character without a value.
struct CodePoint {
    std::size_t length = 1;
    std::uint32_t value = 0xFFFD;
};

CodePoint first_code_point(std::string_view text) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const std::uint32_t lead = byte(0);
    if (lead < 0x80) return {1, lead};
    const std::size_t length = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
    if (lead < 0xC2 || lead > 0xF4 || text.size() < length) return {};
    std::uint32_t value = lead & (0xFFu >> (length + 1));
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte(i) & 0xC0) != 0x80) return {};
        value = (value << 6) | (byte(i) & 0x3Fu);
    }
    constexpr std::uint32_t smallest[] = {0, 0, 0x80, 0x800, 0x10000};
    if (value < smallest[length] || value > 0x10FFFF || (value >= 0xD800 && value < 0xE000)) return {};
    return {length, value};
}

// Control characters, and marks that reverse or hide the text around them.
bool is_hidden(std::uint32_t c) {
    return c < 0x20 || (c >= 0x7F && c < 0xA0) || c == 0x61C || (c >= 0x200B && c <= 0x200F) ||
           (c >= 0x2028 && c <= 0x202E) || (c >= 0x2060 && c <= 0x206F) || c == 0xFEFF || (c >= 0xE0000 && c < 0xE1000);
}

// A text as one terminal cell a character: each element is one character, safe to print.
std::vector<std::string_view> printable_characters(std::string_view text) {
    std::vector<std::string_view> characters;
    while (!text.empty()) {
        const auto [length, value] = first_code_point(text);
        const bool wrong = value == 0xFFFD || is_hidden(value);
        characters.push_back(value == '\t' ? " " : wrong ? replacement : text.substr(0, length));
        text.remove_prefix(length);
    }
    return characters;
}

std::string_view line_of(std::string_view content, int line) {
    for (int i = 1; i < line; ++i) {
        const std::size_t end = content.find('\n');
        if (end == std::string_view::npos) return {};
        content.remove_prefix(end + 1);
    }
    content = content.substr(0, content.find('\n'));
    if (content.ends_with('\r')) content.remove_suffix(1);
    return content;
}

}  // namespace

std::string printable(std::string_view text) {
    return fmt::format("{}", fmt::join(printable_characters(text), ""));
}

bool is_printable(std::string_view text) {
    return printable(text) == text;
}

std::size_t character_length(std::string_view text) {
    return first_code_point(text).length;
}

Source::Source(std::string path, std::string content) : path_(std::move(path)), content_(std::move(content)) {
    if (content_.starts_with("\xEF\xBB\xBF")) content_.erase(0, 3);  // byte order mark
    if (content_.size() > largest_file)
        throw InputError(fmt::format("{}: the file has {} bytes; a scene has at most {}", printable(path_),
                                     content_.size(), largest_file));
}

Source Source::read(const std::string& path, const std::string& what) {
    const auto refuse = [&](const std::string& why) {
        throw InputError(fmt::format("{}: cannot read the {}: {}", printable(path), what, why));
    };
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    if (path.empty()) throw InputError("the scene has an empty name: give a file, such as scenes/pendulum.toml");
    if (error == std::errc::too_many_symbolic_link_levels) refuse("its symbolic links lead to one another in a circle");
    if (error && error != std::errc::no_such_file_or_directory && error != std::errc::not_a_directory)
        refuse(error.message());
    if (!std::filesystem::exists(status)) refuse("there is no such file");
    if (std::filesystem::is_directory(status)) refuse("it is a directory");
    if (std::filesystem::is_socket(status)) refuse("it is a socket");
    // A named pipe may wait for its writer for ever. The pipe behind /dev/stdin or <(command) has no path of its own.
    if (std::filesystem::is_fifo(status) && !std::filesystem::canonical(path, error).empty())
        refuse("it is a named pipe; give a file, or /dev/stdin for the output of another program");
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file) refuse(std::strerror(errno));
    std::string content(largest_file + 4, '\0');  // one byte more than a byte order mark and the largest file
    file.read(content.data(), static_cast<std::streamsize>(content.size()));
    content.resize(static_cast<std::size_t>(file.gcount()));
    if (file.bad()) refuse("the file could not be read to its end");
    if (what != "scene" && content.size() > largest_file)
        refuse(fmt::format("it has more than {} bytes", largest_file));
    return Source(path, std::move(content));
}

void Source::fail(Position position, const std::string& message) const {
    const auto characters = printable_characters(line_of(content_, position.line));
    const std::size_t caret = std::min(static_cast<std::size_t>(position.column - 1), characters.size());
    const bool whole = characters.size() <= widest_line;
    const std::size_t begin = whole || caret < widest_line / 2 ? 0 : caret - widest_line / 2;
    const std::size_t end = whole ? characters.size() : std::min(characters.size(), begin + widest_line);
    const std::string before = begin > 0 ? "..." : "";
    std::string shown;
    for (std::size_t i = begin; i < end; ++i) shown += characters[i];
    if (end < characters.size()) shown += "...";
    const std::string place = fmt::format("{}:{}:{}", printable(path_), position.line, position.column);
    const std::string number = fmt::format("{:>3}", position.line);
    throw InputError(fmt::format("{}: {}\n{} | {}{}\n{} | {}^", place, printable(message), number, before, shown,
                                 std::string(number.size(), ' '), std::string(before.size() + caret - begin, ' ')));
}

}  // namespace lobatto
