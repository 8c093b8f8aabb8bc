// SPDX-License-Identifier: GPL-2.0-or-later
// Sweeps in a folder of their own, and their tables: for the tests of starts, parts and formats.
#pragma once

#include <doctest/doctest.h>

#include <string>
#include <vector>

#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

namespace lobatto::test {

const std::string pendulum_file = LOBATTO_SOURCE_DIR "/scenes/pendulum.toml";

class SweepFolder {
public:
    std::string file(const std::string& name) const { return folder_ / name; }

    Finished lobatto(std::vector<std::string> words) const {
        words.insert(words.begin(), LOBATTO_PROGRAM);
        return run(words);
    }
    // A sweep of the pendulum.
    Finished sweep(const std::string& name, std::vector<std::string> words) const {
        words.insert(words.begin(), {"sweep", pendulum_file, "-o", file(name)});
        return lobatto(words);
    }
    // One that succeeds; what is in its table.
    std::string bytes(const std::string& name, const std::vector<std::string>& words) const {
        const Finished done = sweep(name, words);
        CHECK_MESSAGE(done.err == "", done.err);
        CHECK(done.exit_code == 0);
        return read_file(file(name));
    }
    TrajectoryTable table(const std::vector<std::string>& words) const {
        bytes("table.csv", words);
        return read_trajectory(file("table.csv"));
    }
    // One that is refused: what is said.
    std::string refusal(const std::string& name, const std::vector<std::string>& words, int exit_code = 2) const {
        const Finished done = sweep(name, words);
        CHECK_MESSAGE(done.exit_code == exit_code, done.err);
        return done.err;
    }

private:
    TemporaryFolder folder_;
};

}  // namespace lobatto::test
