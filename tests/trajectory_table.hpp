// SPDX-License-Identifier: GPL-2.0-or-later
// Tables of runs and sweeps, read back.
#pragma once

#include <algorithm>
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

inline std::vector<double> column_of(const TrajectoryTable& table, const std::string& name) {
    const auto found = std::find(table.columns.begin(), table.columns.end(), name);
    if (found == table.columns.end()) throw std::runtime_error("the table has no column " + name);
    std::vector<double> values;
    for (const std::vector<double>& row : table.rows)
        values.push_back(row[static_cast<std::size_t>(found - table.columns.begin())]);
    return values;
}

}  // namespace lobatto::test
