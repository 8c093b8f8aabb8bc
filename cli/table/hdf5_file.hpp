// SPDX-License-Identifier: GPL-2.0-or-later
// Tables as HDF5, by its library; a program can be built without it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "cli/table/table_head.hpp"

namespace lobatto {

bool has_hdf5();
// MachineError, which names the package, where this program was built without HDF5.
void require_hdf5(const std::string& path);

// A file with one data set `table`, a one-dimensional array of records with the names of the columns, int64 and
// float64, little-endian. Its attributes: `columns`, `units`; those of the file: `lobatto` (the version), `kind`,
// `scene_text`, each fact of the head, and `head`, all of it as JSON. No times: equal tables are equal files. It
// appears whole or not at all. `records(row, count)`: the bytes of `count` rows from `row` on.
void write_hdf5(const std::string& path, const TableHead& head, std::int64_t rows,
                const std::function<std::string(std::int64_t row, std::size_t count)>& records);

// The other way. MachineError for what is no such file.
class Hdf5Reader {
public:
    explicit Hdf5Reader(const std::string& path);
    ~Hdf5Reader();
    Hdf5Reader(const Hdf5Reader&) = delete;
    Hdf5Reader& operator=(const Hdf5Reader&) = delete;

    const TableHead& head() const { return head_; }
    std::int64_t rows() const { return rows_; }
    void read(std::int64_t row, std::size_t count, TableCell* cells) const;

private:
    void close() const;

    std::string path_;
    std::int64_t file_ = -1, table_ = -1, record_ = -1;  // handles of HDF5
    TableHead head_;
    std::int64_t rows_ = 0;
};

}  // namespace lobatto
