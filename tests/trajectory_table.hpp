// SPDX-License-Identifier: GPL-2.0-or-later
// Tables of runs and sweeps, read back.
#pragma once

#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/files/cells.hpp"

namespace lobatto::test {

struct TrajectoryTable {
    std::vector<std::string> comments;  // the lines that begin with '#', without "# "
    std::vector<std::string> columns;
    std::vector<std::vector<double>> rows;
};

// The last line of an unfinished file may be torn; it is left out.
inline TrajectoryTable read_trajectory(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error("cannot read " + path);
    TrajectoryTable table;
    for (std::string line; std::getline(file, line) && !file.eof();) {
        if (line.starts_with("# ")) {
            table.comments.push_back(line.substr(2));
        } else if (table.columns.empty()) {
            for (const std::string_view cell : cells_of(line)) table.columns.emplace_back(cell);
        } else {
            table.rows.emplace_back();
            for (const std::string_view cell : cells_of(line)) {
                const std::optional<double> number = number_in(cell);
                if (!number) throw std::runtime_error(path + ": '" + std::string(cell) + "' is not a number");
                table.rows.back().push_back(*number);
            }
        }
    }
    return table;
}

}  // namespace lobatto::test
