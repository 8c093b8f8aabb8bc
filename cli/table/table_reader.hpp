// SPDX-License-Identifier: GPL-2.0-or-later
// Tables read back: those that are whole, and what a killed process leaves of one.
#pragma once

#include <cstdint>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/table/hdf5_file.hpp"
#include "cli/table/table_file.hpp"
#include "cli/table/table_head.hpp"

namespace lobatto {

class TableReader {
public:
    // `path`: of the table, whose name may end otherwise; `json`: of what a .npy says of itself. MachineError where it
    // cannot be read or is no table.
    TableReader(const std::string& path, TableFormat format, const std::string& json);

    const TableHead& head() const { return head_; }
    // The next rows, at most so many, in place of those in `cells`; their number, 0 at the end. A row that is torn, at
    // the end of what a killed process leaves, is left out. MachineError where there is something else than numbers.
    std::size_t read(std::vector<TableCell>& cells, std::size_t most);
    // How many bytes there are up to the end of row `row` of those read last; of CSV and .npy.
    std::int64_t bytes_to(std::size_t row) const { return ends_[row]; }
    std::int64_t head_bytes() const { return head_bytes_; }
    // How many rows the file says that it has: at its begin, a .csv of a shard at its end, where it was read to there.
    std::optional<std::int64_t> rows_told() const { return rows_told_; }

private:
    [[noreturn]] void fail(const std::string& why) const;
    bool read_line(std::vector<TableCell>& cells);

    std::string path_;
    TableFormat format_;
    TableHead head_;
    std::ifstream file_;
    std::unique_ptr<Hdf5Reader> hdf5_;
    std::int64_t head_bytes_ = 0, at_ = 0, row_ = 0;
    std::vector<std::int64_t> ends_;
    std::optional<std::int64_t> rows_told_;
};

}  // namespace lobatto
