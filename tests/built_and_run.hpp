// SPDX-License-Identifier: GPL-2.0-or-later
// Small programs of tests that stand on the support headers.
#pragma once

#include "tests/support.hpp"

namespace lobatto::test {

// Builds FOLDER/NAME.cpp with g++, the support headers and more arguments, and runs it where it can run here.
inline std::optional<Finished> built_and_run(const TemporaryFolder& folder, const std::string& name,
                                             const std::vector<std::string>& arguments, bool runs_here = true) {
    const std::string program = (folder / name).string();
    std::vector<std::string> command{"g++", "-std=c++17", "-ffp-contract=off"};
    command.insert(command.end(), arguments.begin(), arguments.end());
    command.insert(command.end(), {"-I", LOBATTO_SOURCE_DIR "/runtime/kernel", program + ".cpp", "-o", program});
    const Finished built = run(command);
    if (built.exit_code != 0) throw std::runtime_error(built.err);
    if (!runs_here) return std::nullopt;
    return run({"env", "ASAN_OPTIONS=detect_leaks=0", program});
}

}  // namespace lobatto::test
