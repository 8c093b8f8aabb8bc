// SPDX-License-Identifier: GPL-2.0-or-later
// The commands of the program, one file each.
//
// add_NAME adds the subcommand NAME to the program: a description of one line, its arguments, a callback that does the
// work, and a footer that is an example, indented by two blanks and preceded by the word "Example":
//     command->footer("Example:\n  lobatto run scenes/pendulum.toml");
// A callback returns for exit code 0 and throws for the others: InputError (2), ComputationError (3), MachineError (4),
// or CLI::RuntimeError(code) when everything worth saying has been printed.
#pragma once

#include <CLI/CLI.hpp>

namespace lobatto {

void add_check(CLI::App& program);
void add_derive(CLI::App& program);
void add_emit(CLI::App& program);
void add_gallery(CLI::App& program);
void add_run(CLI::App& program);
void add_paper(CLI::App& program);
void add_stability(CLI::App& program);
void add_roundoff(CLI::App& program);
void add_sweep(CLI::App& program);
void add_tradeoff(CLI::App& program);
void add_tune(CLI::App& program);
void add_verify(CLI::App& program);

}  // namespace lobatto
