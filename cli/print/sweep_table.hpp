// SPDX-License-Identifier: GPL-2.0-or-later
// A table that is written row by row, as CSV or as an array of NumPy (.npy).
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/run/partial_file.hpp"

namespace lobatto {

struct Column {
    std::string name, unit;  // unit "" when unknown
    bool whole = false;      // int64, else double
};

// Whole rows are written block by block, so that a killed run leaves a readable NAME.partial; for the rest see
// PartialFile. Comments stand in CSV alone. A .npy is a one-dimensional array of records, little-endian, 8 bytes a
// number; how many is said in its head, which is written again with each block.
class SweepTable {
public:
    enum class Format { csv, npy };

    // Throws MachineError when the machine refuses, InputError for a .npy that is no regular file.
    SweepTable(const std::string& path, Format format, const std::vector<std::string>& comments,
               const std::vector<Column>& columns);

    void add(std::int64_t value);
    void add(double value);
    void end_row();
    std::int64_t rows() const { return rows_; }
    void finish();

private:
    std::string npy_head() const;
    void flush();
    template <class Number>
    void add_binary(Number value);

    PartialFile file_;
    Format format_;
    std::vector<Column> columns_;
    std::string block_;
    std::int64_t rows_ = 0;
    std::chrono::steady_clock::time_point flushed_;
};

}  // namespace lobatto
