// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/table/table_file.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>

#include "cli/table/hdf5_file.hpp"
#include "generator/formula/text/source.hpp"
#include "runtime/files/partial_file.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

namespace {

constexpr std::size_t block_bytes = 1 << 16;
constexpr std::chrono::milliseconds block_time{100};

void append_binary(std::string& block, TableCell cell) {
    char bytes[8];
    for (int byte = 0; byte < 8; ++byte) bytes[byte] = static_cast<char>(cell >> (8 * byte) & 0xff);
    block.append(bytes, sizeof bytes);
}

}  // namespace

TableFormat table_format(const std::string& path) {
    std::error_code none;
    const bool is_stream = is_standard_output(path) ||
                           (std::filesystem::exists(path, none) && !std::filesystem::is_regular_file(path, none) &&
                            !std::filesystem::is_directory(path, none));
    if (is_stream || path.ends_with(".csv")) return TableFormat::csv;
    if (path.ends_with(".npy")) return TableFormat::npy;
    if (path.ends_with(".h5")) {
        require_hdf5(path);
        return TableFormat::h5;
    }
    throw InputError(fmt::format(
        "-o: {} has an ending that is not known; it says what is written: .csv, .npy (NumPy) or .h5 (HDF5)", path));
}

const char* ending_of(TableFormat format) {
    return format == TableFormat::csv ? ".csv" : format == TableFormat::npy ? ".npy" : ".h5";
}

TableFile::TableFile(const std::string& path, TableFormat format, const TableHead& head, std::int64_t kept,
                     std::int64_t rows)
    : path_(path),
      format_(format),
      head_(head),
      file_(path, "the table", kept),
      rows_(rows),
      flushed_(std::chrono::steady_clock::now()) {
    if (format != TableFormat::csv && !file_.is_regular())
        throw InputError(fmt::format(
            "-o: {} is no regular file, but the head of a {} says how many rows follow and is written last; name "
            "a file, or take --format csv",
            path, ending_of(format)));
    constexpr std::size_t most_head = 60'000;  // bytes of HDF5's description of a record
    std::size_t described = 0;
    for (const TableColumn& column : head.columns) described += column.name.size() + 48;
    if (format == TableFormat::h5 && described > most_head) {
        discard();
        throw InputError(
            fmt::format("-o: {} columns are more than a record of HDF5 can have; name a .npy", head.columns.size()));
    }
    if (format != TableFormat::csv) write_whole(partial_json(), "what the table says of itself", json_head(head));
    if (kept == 0) block_ = format == TableFormat::csv ? csv_head(head) : npy_head(head.columns, 0);
    flush();
}

std::string TableFile::partial_json() const {
    return path_ + ".partial.json";
}

void TableFile::add(const TableCell* cells, std::size_t rows) {
    const std::vector<TableColumn>& columns = head_.columns;
    for (std::size_t row = 0; row < rows; ++row, cells += columns.size()) {
        for (std::size_t c = 0; c < columns.size(); ++c) {
            if (format_ != TableFormat::csv) {
                append_binary(block_, cells[c]);
                continue;
            }
            if (columns[c].whole)
                block_ += fmt::format_int(whole_in(cells[c])).c_str();
            else
                append_number(block_, real_in(cells[c]));
            block_ += c + 1 < columns.size() ? ',' : '\n';
        }
        ++rows_;
        if (block_.size() >= block_bytes) flush();
    }
    if (std::chrono::steady_clock::now() - flushed_ > block_time) flush();
}

void TableFile::flush() {
    file_.write(block_);
    if (format_ != TableFormat::csv) file_.write_at_begin(npy_head(head_.columns, rows_));
    block_.clear();
    flushed_ = std::chrono::steady_clock::now();
}

void TableFile::discard() {
    file_.discard();
    if (format_ != TableFormat::csv) std::remove(partial_json().c_str());
}

void TableFile::finish() {
    if (format_ == TableFormat::csv && head_.shard) block_ += fmt::format("{}{}\n", rows_of_shard, rows_);
    flush();
    if (format_ == TableFormat::h5) {
        write_hdf5(path_, head_, rows_, [&](std::int64_t row, std::size_t count) {
            const std::size_t row_bytes = 8 * head_.columns.size(), begin = npy_head(head_.columns, rows_).size();
            return file_.read(static_cast<std::int64_t>(begin) + row * static_cast<std::int64_t>(row_bytes),
                              count * row_bytes);
        });
        return discard();
    }
    if (format_ == TableFormat::npy && std::rename(partial_json().c_str(), (path_ + ".json").c_str()) != 0)
        fail_to_write("what the table says of itself", path_ + ".json", errno);
    file_.finish();
}

}  // namespace lobatto
