// SPDX-License-Identifier: GPL-2.0-or-later
// The commands of the program, one file each.
//
// add_NAME adds the subcommand NAME to the program: a description of one line, its arguments, a callback that does the
// work, and a footer that is an example, indented by two blanks and preceded by the word "Example":
//     command.footer("Example:\n  lobatto run scenes/pendulum.toml");
// A callback returns for exit code 0 and throws for the others: InputError (2), ComputationError (3), MachineError (4),
// or ExitCode(code) when everything worth saying has been printed.
#pragma once

#include "cli/options/command_line.hpp"

namespace lobatto {

void add_check(CommandLine& program);
void add_derive(CommandLine& program);
void add_emit(CommandLine& program);
void add_gallery(CommandLine& program);
void add_merge(CommandLine& program);
void add_run(CommandLine& program);
void add_manual(CommandLine& program);
void add_new(CommandLine& program);
void add_paper(CommandLine& program);
void add_plot(CommandLine& program);
void add_stability(CommandLine& program);
void add_roundoff(CommandLine& program);
void add_schema(CommandLine& program);
void add_sweep(CommandLine& program);
void add_tradeoff(CommandLine& program);
void add_tune(CommandLine& program);
void add_verify(CommandLine& program);
void add_view(CommandLine& program);

}  // namespace lobatto
