// SPDX-License-Identifier: GPL-2.0-or-later
// A table that is written row by row: as CSV, as an array of NumPy (.npy), or as HDF5 (.h5).
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "cli/table/table_head.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

enum class TableFormat { csv, npy, h5 };

// By the ending of the name. InputError for one that is not known, which names those that are; "-", pipes and devices
// are CSV. MachineError for .h5 where this program was built without HDF5.
TableFormat table_format(const std::string& path);
const char* ending_of(TableFormat format);

// Whole rows are written block by block, so that a killed process leaves a readable NAME.partial; for the rest see
// PartialFile. A .npy is a one-dimensional array of records, little-endian, 8 bytes a number; how many is said in its
// head, which is written again with each block. What it says of itself stands in NAME.json. A .h5 has the same records
// in one data set `table`; it is made at the end, of a partial file that is a .npy.
class TableFile {
public:
    // `kept`: how many bytes of NAME.partial, which hold `rows` rows, stay, to go on after them. Throws MachineError
    // when the machine refuses, InputError for a .npy or .h5 that is no regular file.
    TableFile(const std::string& path, TableFormat format, const TableHead& head, std::int64_t kept = 0,
              std::int64_t rows = 0);

    void add(const TableCell* cells, std::size_t rows);
    std::int64_t rows() const { return rows_; }
    void flush();  // all rows so far stand in NAME.partial
    void finish();
    void discard();  // nothing of it stays

private:
    std::string partial_json() const;

    std::string path_;
    TableFormat format_;
    TableHead head_;
    PartialFile file_;
    std::string block_;
    std::int64_t rows_ = 0;
    std::chrono::steady_clock::time_point flushed_;
};

}  // namespace lobatto
