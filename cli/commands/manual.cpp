// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto manual: its own manual pages, and completions for shells.
#include <fmt/format.h>

#include "cli/commands/commands.hpp"
#include "cli/options/output_path.hpp"
#include "cli/print/manual.hpp"
#include "generator/formula/text/source.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

struct ManualCommand {
    std::string folder, shell;
};

Shell shell_of(const std::string& word) {
    return word == "bash" ? Shell::bash : word == "zsh" ? Shell::zsh : Shell::fish;
}

void write_manual(const CommandLine& program, const ManualCommand& options) {
    if (options.shell.empty() && options.folder.empty())
        throw InputError(
            "lobatto manual: name a folder for the manual pages with -o, or a shell with --completions bash");
    if (!options.shell.empty()) {
        fmt::print("{}", completions(program, shell_of(options.shell)));
        return;
    }
    output_folder(options.folder, "");
    const auto pages = manual_pages(program);
    for (const auto& [name, text] : pages) keep_foreign(options.folder + "/" + name);
    for (const auto& [name, text] : pages) write_whole(options.folder + "/" + name, "the page", text);
    fmt::print("{} pages in {}; read them with `man {}/lobatto.1`\n", pages.size(), options.folder, options.folder);
}

}  // namespace

void add_manual(CommandLine& program) {
    const auto options = std::make_shared<ManualCommand>();
    Command command = program.command("manual", "Write manual pages, or completions for a shell, from these helps");
    const Option folder =
        command.option("-o,--output", options->folder, "Folder for the manual pages").shown_as("FOLDER");
    command.option("--completions", options->shell, "Print them for this shell")
        .shown_as("SHELL")
        .one_of(std::vector<std::string>{"bash", "zsh", "fish"})
        .excludes(folder);
    command.footer("Example:\n  lobatto manual --completions bash > lobatto.bash");
    command.does([&program, options] { write_manual(program, *options); });
}

}  // namespace lobatto
