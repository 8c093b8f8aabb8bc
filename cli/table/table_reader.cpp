// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/table/table_reader.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <iterator>

#include "generator/formula/text/source.hpp"
#include "runtime/error.hpp"

namespace lobatto {

void TableReader::fail(const std::string& why) const {
    throw InputError(fmt::format("{}: cannot read it: {}", path_, why));
}

TableReader::TableReader(const std::string& path, TableFormat format, const std::string& json)
    : path_(path), format_(format) {
    if (format == TableFormat::h5) {
        hdf5_ = std::make_unique<Hdf5Reader>(path);
        head_ = hdf5_->head();
        rows_told_ = hdf5_->rows();
        return;
    }
    file_.open(path, std::ios::binary);
    if (!file_) fail(std::strerror(errno));
    std::optional<TableHead> head;
    std::size_t length = 0;
    if (format == TableFormat::csv) {
        std::string text;
        for (std::string line; std::getline(file_, line) && !file_.eof();) {
            text += line + '\n';
            if (!line.starts_with('#')) break;
        }
        head = read_csv_head(text, length);
        if (!head) fail("it does not begin as tables of Lobatto do");
    } else {
        std::ifstream beside(json);
        head = read_json_head({std::istreambuf_iterator<char>(beside), {}});
        if (!head) fail(fmt::format("{}, which says what is in it, is missing or damaged", json));
        length = npy_head(head->columns, 0).size();
        std::string begin(length, '\0');
        file_.read(begin.data(), static_cast<std::streamsize>(length));
        const std::string ours = npy_head(head->columns, 0);
        const std::size_t same = ours.find("'shape': (");
        if (!file_ || begin.compare(0, same, ours, 0, same) != 0)
            fail(fmt::format("it has other columns than {} says", json));
        rows_told_ = std::atoll(begin.c_str() + same + std::strlen("'shape': ("));
    }
    if (head->columns.empty()) fail("it has no columns");
    head_ = *head;
    head_bytes_ = at_ = static_cast<std::int64_t>(length);
}

std::size_t TableReader::read(std::vector<TableCell>& cells, std::size_t most) {
    cells.clear();
    ends_.clear();
    const std::size_t width = head_.columns.size();
    if (format_ == TableFormat::csv) {
        while (ends_.size() < most && read_line(cells)) ends_.push_back(at_);
        return ends_.size();
    }
    std::size_t rows = most;
    cells.resize(width * most);
    if (format_ == TableFormat::h5) {
        rows = static_cast<std::size_t>(std::min<std::int64_t>(static_cast<std::int64_t>(most), hdf5_->rows() - row_));
        if (rows > 0) hdf5_->read(row_, rows, cells.data());
    } else {
        file_.read(reinterpret_cast<char*>(cells.data()), static_cast<std::streamsize>(8 * cells.size()));
        rows = static_cast<std::size_t>(file_.gcount()) / (8 * width);
    }
    cells.resize(width * rows);
    row_ += static_cast<std::int64_t>(rows);
    for (std::size_t row = 0; row < rows; ++row)
        ends_.push_back(at_ + static_cast<std::int64_t>(8 * width * (row + 1)));
    at_ += static_cast<std::int64_t>(8 * width * rows);
    return rows;
}

bool TableReader::read_line(std::vector<TableCell>& cells) {
    std::string line;
    if (!std::getline(file_, line) || file_.eof()) return false;  // torn: without its end
    if (line.starts_with(rows_of_shard)) {
        rows_told_ = std::atoll(line.c_str() + rows_of_shard.size());
        return false;
    }
    const char *at = line.data(), *const end = at + line.size();
    for (std::size_t c = 0; c < head_.columns.size(); ++c) {
        const auto put = [&](auto number) {
            const auto read = std::from_chars(at, end, number);
            const bool ends = read.ptr == end ? c + 1 == head_.columns.size() : *read.ptr == ',';
            if (read.ec != std::errc() || !ends)
                fail(fmt::format("it is damaged: '{}' is no row of its columns", line.substr(0, 60)));
            at = read.ptr + (read.ptr == end ? 0 : 1);
            cells.push_back(cell_of(number));
        };
        if (head_.columns[c].whole)
            put(std::int64_t{0});
        else
            put(0.0);
    }
    at_ += static_cast<std::int64_t>(line.size()) + 1;
    return true;
}

}  // namespace lobatto
