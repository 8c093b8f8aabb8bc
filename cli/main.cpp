// SPDX-License-Identifier: GPL-2.0-or-later
// The program: its commands, and how errors are told.
#include <fcntl.h>
#include <fmt/color.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>

#include "cli/commands/commands.hpp"
#include "cli/print/tell.hpp"
#include "library/errors.hpp"
#include "runtime/error.hpp"

namespace {

using namespace lobatto;

// An error is told although the output's reader has gone.
void flush_before_error() {
    std::signal(SIGPIPE, SIG_IGN);
    std::cout.flush();
}

int complain(const api::Error& error) {
    flush_before_error();
    const bool styled = isatty(STDERR_FILENO) && std::getenv("NO_COLOR") == nullptr;
    tell("{} {}\n",
         fmt::styled("lobatto:", styled ? fmt::emphasis::bold | fmt::fg(fmt::terminal_color::red) : fmt::text_style()),
         error.what());
    return error.exit_code();
}

// What was printed must have arrived: a full disk behind `> file` is an error, whether a write was buffered or not.
void run_to_the_last_byte(CommandLine& program, int argc, char** argv) {
    const auto refused = [](int why) {
        throw MachineError(fmt::format("cannot write to standard output: {}. Is the disk full?", std::strerror(why)));
    };
    try {
        program.run(argc, argv);
    } catch (const std::system_error& error) {
        if (std::ferror(stdout) == 0) throw;
        refused(error.code().value());
    }
    if (!std::cout.flush() || std::fflush(stdout) != 0) refused(errno);
}

void describe(CommandLine& program) {
    program.version("lobatto " LOBATTO_VERSION);
#ifdef LOBATTO_MPI  // each process would do the whole work of another command
    add_sweep(program);
#else
    add_new(program);
    add_check(program);
    add_derive(program);
    add_emit(program);
    add_run(program);
    add_stability(program);
    add_roundoff(program);
    add_sweep(program);
    add_merge(program);
    add_tradeoff(program);
    add_tune(program);
    add_verify(program);
    add_view(program);
    add_plot(program);
    add_schema(program);
    add_manual(program);
    add_gallery(program);
    add_paper(program);
#endif
    // Last, because a command takes over the footer that its parent has at that moment.
    program.footer(
        "Example:\n"
        "  lobatto run scenes/pendulum.toml\n\n"
        "`lobatto COMMAND --help` explains a command. In the source tree, `./lobatto test` runs the tests.\n"
        "Exit codes: 0 done, 2 wrong input, 3 failed computation, 4 failed compiler or machine, 130 interrupted.");
}

}  // namespace

// If a standard stream is closed, the next file that is opened would get its number, and our messages. So /dev/null is
// opened in its place, for reading only except for standard error: writing to a closed standard output stays an error.
static void keep_streams_apart() {
    for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (::fcntl(descriptor, F_GETFD) < 0)
            static_cast<void>(::open("/dev/null", descriptor == STDERR_FILENO ? O_WRONLY : O_RDONLY));
}

int main(int argc, char** argv) {
    keep_streams_apart();
    // `lobatto derive scene | head -1` ends quietly, even when the parent process ignores closed pipes.
    std::signal(SIGPIPE, SIG_DFL);
    std::signal(SIGCHLD, SIG_DFL);  // else nobody can wait for a compiler
    std::signal(SIGXFSZ, SIG_IGN);  // a file that may not grow is an error of write(2)
    CommandLine program(
        "Lobatto is a compiler for mechanics: it turns a Lagrangian into a symplectic integrator in C++.", "lobatto");
    try {
        describe(program);
        api::guarded([&] { run_to_the_last_byte(program, argc, argv); });
        return 0;
    } catch (const ExitCode& end) {
        return end.code;
    } catch (const WrongArguments& error) {
        return complain(api::InputError(error.message));
    } catch (const api::InputError& error) {
        // Begins with file:line:column, as editors expect of a compiler.
        flush_before_error();
        tell("{}\n", error.what());
        return error.exit_code();
    } catch (const api::Error& error) {
        return complain(error);
    }
}
