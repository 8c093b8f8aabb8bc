// SPDX-License-Identifier: GPL-2.0-or-later
// The program: its commands, and what each kind of error means for the exit code.
#include <fmt/color.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iostream>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "cli/commands/commands.hpp"
#include "generator/formula/source.hpp"
#include "runtime/error.hpp"

namespace {

using namespace lobatto;

enum Exit { success = 0, wrong_input = 2, failed_computation = 3, failed_machine = 4 };

// An error is told although the output's reader has gone.
void flush_before_error() {
    std::signal(SIGPIPE, SIG_IGN);
    std::cout.flush();
}

int complain(Exit code, std::string_view message) {
    flush_before_error();
    const bool styled = isatty(STDERR_FILENO) && std::getenv("NO_COLOR") == nullptr;
    fmt::print(
        stderr, "{} {}\n",
        fmt::styled("lobatto:", styled ? fmt::emphasis::bold | fmt::fg(fmt::terminal_color::red) : fmt::text_style()),
        message);
    return code;
}

std::vector<std::string> command_names(const CLI::App& program) {
    std::vector<std::string> names;
    for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
        names.push_back(command->get_name());
    return names;
}

int complain_of_arguments(const CLI::App& program, const CLI::ParseError& error) {
    const auto chosen = program.get_subcommands();
    if (!chosen.empty())
        return complain(wrong_input, fmt::format("{}\n`lobatto {} --help` shows what can be given.", error.what(),
                                                 chosen.front()->get_name()));
    const auto extras = program.remaining();
    if (extras.empty() || extras.front().starts_with('-'))
        return complain(wrong_input, fmt::format("{}\n`lobatto --help` shows what can be given.", error.what()));
    const std::string& word = extras.front();
    const std::string hint = word.ends_with(".toml") ? fmt::format(" Did you mean `lobatto run {}`?", word) : "";
    return complain(wrong_input, fmt::format("unknown command '{}'; the commands are: {}.{}", word,
                                             fmt::join(command_names(program), ", "), hint));
}

// What was printed must have arrived: a full disk behind `> file` is an error, although every write was only buffered.
void flush_output() {
    if (!std::cout.flush() || std::fflush(stdout) != 0)
        throw MachineError(fmt::format("cannot write to standard output: {}. Is the disk full?", std::strerror(errno)));
}

void answer(CLI::App& program, int argc, char** argv) {
    try {
        program.parse(argc, argv);
        if (program.get_subcommands().empty()) std::cout << program.help();
    } catch (const CLI::Success& help_or_version) {
        program.exit(help_or_version);  // prints it
    }
}

void describe(CLI::App& program) {
    program.set_version_flag("--version", "lobatto " LOBATTO_VERSION);
    program.require_subcommand(0, 1);
    add_check(program);
    add_derive(program);
    add_emit(program);
    add_run(program);
    add_stability(program);
    add_roundoff(program);
    add_sweep(program);
    add_tradeoff(program);
    add_tune(program);
    add_verify(program);
    add_gallery(program);
    add_paper(program);
    // Last, because a command takes over the footer that its parent has at that moment.
    program.footer(
        "Example:\n"
        "  lobatto run scenes/pendulum.toml\n\n"
        "`lobatto COMMAND --help` explains a command. In the source tree, `./lobatto test` runs the tests.");
}

}  // namespace

int main(int argc, char** argv) {
    // `lobatto derive scene | head -1` ends quietly, even when the parent process ignores closed pipes.
    std::signal(SIGPIPE, SIG_DFL);
    std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error of write(2)
    CLI::App program("Lobatto is a compiler for mechanics: it turns a Lagrangian into a symplectic integrator in C++.",
                     "lobatto");
    try {
        describe(program);
        answer(program, argc, argv);
        flush_output();
        return success;
    } catch (const CLI::RuntimeError& end) {
        return end.get_exit_code();
    } catch (const CLI::ParseError& error) {
        return complain_of_arguments(program, error);
    } catch (const InputError& error) {
        // Begins with file:line:column, as editors expect of a compiler.
        flush_before_error();
        fmt::print(stderr, "{}\n", error.what());
        return wrong_input;
    } catch (const ComputationError& error) {
        return complain(failed_computation, error.what());
    } catch (const MachineError& error) {
        return complain(failed_machine, error.what());
    } catch (const std::system_error& error) {
        return complain(failed_machine, error.what());
    } catch (const std::bad_alloc&) {
        return complain(failed_machine, "out of memory");
    } catch (const std::exception& error) {
        return complain(
            failed_machine,
            fmt::format(
                "internal error: {}\n"
                "This is a mistake in Lobatto, not in your scene. Please report it with the command, the scene and "
                "the output of `lobatto --version`.",
                error.what()));
    }
}
