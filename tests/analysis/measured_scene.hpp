// SPDX-License-Identifier: GPL-2.0-or-later
// A scene of a test that `lobatto run` runs, and what it says of the error.
#pragma once

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

namespace lobatto::test {

inline std::string timed_scene(const std::string& lagrangian, const std::string& coordinates, const std::string& method,
                               double step, double until, const std::string& rest = "") {
    return fmt::format(
        "lagrangian = \"{}\"\ntime = \"t\"\n[coordinates]\n{}\n[method]\n{}\n[run]\nstep = {}\nuntil = {}\n{}",
        lagrangian, coordinates, method, step, until, rest);
}

class MeasuredScene {
public:
    explicit MeasuredScene(const std::string& scene) { write_text(folder / "scene.toml", scene); }
    Finished run(std::vector<std::string> options = {}) const {
        options.insert(options.begin(), {LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv"});
        return test::run(options);
    }
    std::vector<double> end() const { return read_trajectory(folder / "run.csv").rows.back(); }

    TemporaryFolder folder;
};

// What the table says: the absolute error at the end, in the coordinate where it is largest.
inline double absolute_error(const std::string& table) {
    const std::size_t row = table.find("  measured error");
    REQUIRE(row != std::string::npos);
    const std::string line = table.substr(row, table.find('\n', row) - row);
    const std::size_t bracket = line.find('(');
    INFO(line);
    REQUIRE(bracket != std::string::npos);
    return std::strtod(line.c_str() + bracket + 1, nullptr);
}

}  // namespace lobatto::test
