// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto new: a commented scene to begin with.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <filesystem>

#include "cli/commands/commands.hpp"
#include "cli/print/embedded.hpp"
#include "generator/formula/text/source.hpp"
#include "generator/formula/text/suggest.hpp"
#include "runtime/build/compiler.hpp"
#include "runtime/error.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

struct NewCommand {
    std::string kind, name;
    bool list = false;
};

std::string kind_of(const EmbeddedText& one) {
    return std::string(one.name.substr(0, one.name.rfind('.')));
}

// Its first line, without the mark of a comment.
std::string_view line_of(const EmbeddedText& one) {
    return one.text.substr(2, one.text.find('\n') - 2);
}

void print_list() {
    for (const EmbeddedText& one : scene_templates) fmt::print("  {:<18}{}\n", kind_of(one), line_of(one));
}

// "my_arm.toml": My arm.
std::string title_of(const std::string& path) {
    std::string title = std::filesystem::path(path).stem().string();
    for (char& c : title)
        if (c == '_' || c == '-') c = ' ';
    if (!title.empty() && title.front() >= 'a' && title.front() <= 'z') title.front() -= 'a' - 'A';
    return title;
}

void make_new(const NewCommand& options) {
    if (options.list) return print_list();
    std::vector<std::string> kinds;
    for (const EmbeddedText& one : scene_templates) kinds.push_back(kind_of(one));
    if (options.kind.empty())
        throw InputError(
            fmt::format("lobatto new: of which kind? There are {}; `lobatto new --list` says what they are",
                        fmt::join(kinds, ", ")));
    const auto found = std::find(kinds.begin(), kinds.end(), options.kind);
    if (found == kinds.end())
        throw InputError(fmt::format("lobatto new: there is no kind '{}'; there are {}.{}", options.kind,
                                     fmt::join(kinds, ", "), suggestion(options.kind, kinds)));
    std::string path = options.name.empty() ? options.kind : options.name;
    if (!path.ends_with(".toml")) path += ".toml";
    const std::string title = title_of(path);
    const bool has_letter =
        std::any_of(title.begin(), title.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c > 0x7f; });
    if (!has_letter || title.front() == '.' || !is_printable(title) ||
        std::filesystem::path(path).filename().string().front() == '-' ||
        title.find_first_of("\"\\") != std::string::npos)
        throw InputError(fmt::format("lobatto new: '{}' cannot be the name of a scene; use letters and digits", path));
    std::error_code ignored;
    if (std::filesystem::exists(path, ignored))
        throw InputError(fmt::format("lobatto new: {} exists; give another name, or remove it", path));
    std::string text(scene_templates[static_cast<std::size_t>(found - kinds.begin())].text);
    const std::string mark = "@TITLE@";
    text.replace(text.find(mark), mark.size(), title);
    write_whole(path, "the scene", text, "choose another name");
    fmt::print("{} is a scene of kind {}. Open it in an editor, and try\n  lobatto run {}\n  lobatto view {}\n", path,
               options.kind, shell_word(path), shell_word(path));
}

}  // namespace

void add_new(CommandLine& program) {
    Command command = program.command("new", "Write a commented scene to begin with");
    const auto options = std::make_shared<NewCommand>();
    command.option("KIND", options->kind, "What it is of; --list shows them");
    command.option("NAME", options->name, "The file, NAME or NAME.toml (default: as the kind)");
    command.flag("--list", options->list, "Show the kinds with a line each");
    command.footer("Example:\n  lobatto new --list");
    command.does([options] { make_new(*options); });
}

}  // namespace lobatto
