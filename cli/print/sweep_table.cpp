// SPDX-License-Identifier: GPL-2.0-or-later
// A table that is written row by row, as CSV or as an array of NumPy (.npy).
#include "cli/print/sweep_table.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "generator/formula/source.hpp"
#include "runtime/run/output.hpp"

namespace lobatto {

namespace {

constexpr std::size_t block_bytes = 1 << 16;
constexpr std::chrono::milliseconds block_time{100};

// A text of Python; names of columns hold no backslash and no double quote.
std::string quoted(const std::string& name) {
    const char quote = name.find('\'') == std::string::npos ? '\'' : '"';
    return quote + name + quote;
}

}  // namespace

SweepTable::SweepTable(const std::string& path, Format format, const std::vector<std::string>& comments,
                       const std::vector<Column>& columns)
    : file_(path, "the table"), format_(format), columns_(columns), flushed_(std::chrono::steady_clock::now()) {
    if (format == Format::npy) {
        if (!file_.is_regular())
            throw InputError(fmt::format(
                "-o: {} is no regular file, but the head of a .npy says how many rows follow and is written last; name "
                "a file, or take --format csv",
                path));
        block_ = npy_head();
    } else {
        for (const std::string& comment : comments) block_ += "# " + comment + '\n';
        block_ += "# columns:";
        for (const Column& column : columns)
            block_ += fmt::format("{} {}{}", &column == columns.data() ? "" : ",", column.name,
                                  column.unit.empty() ? "" : " [" + column.unit + "]");
        for (const Column& column : columns) block_ += (&column == columns.data() ? '\n' : ',') + column.name;
        block_ += '\n';
    }
    flush();
}

// NumPy's format 1.0, or 2.0 for heads above 64 kB: magic, version, length of the dictionary, the dictionary, blanks
// to a multiple of 64 bytes. Its length is the same for any number of rows.
std::string SweepTable::npy_head() const {
    std::string fields;
    for (const Column& column : columns_)
        fields += fmt::format("({}, '{}'), ", quoted(column.name), column.whole ? "<i8" : "<f8");
    std::string dictionary = fmt::format("{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}", fields, rows_);
    constexpr std::size_t digits = 20, alignment = 64;
    const std::size_t longest = dictionary.size() - std::to_string(rows_).size() + digits + 1;
    const bool large = longest + alignment > 0xffff;
    const std::size_t before = large ? 12 : 10;
    const std::size_t whole = (before + longest + alignment - 1) / alignment * alignment;
    dictionary.resize(whole - before, ' ');
    dictionary.back() = '\n';
    std::string head = "\x93NUMPY";
    head += large ? '\x02' : '\x01';
    head += '\0';
    for (std::size_t byte = 0; byte < before - 8; ++byte)
        head += static_cast<char>(dictionary.size() >> (8 * byte) & 0xff);
    return head + dictionary;
}

template <class Number>
void SweepTable::add_binary(Number value) {
    std::uint64_t bits = 0;
    static_assert(sizeof bits == sizeof value);
    std::memcpy(&bits, &value, sizeof bits);
    for (int byte = 0; byte < 8; ++byte) block_ += static_cast<char>(bits >> (8 * byte) & 0xff);
}

void SweepTable::add(std::int64_t value) {
    if (format_ == Format::npy) return add_binary(value);
    block_ += fmt::format_int(value).c_str();
    block_ += ',';
}

void SweepTable::add(double value) {
    if (format_ == Format::npy) return add_binary(value);
    append_number(block_, std::isnan(value) ? std::fabs(value) : value);  // its sign is no information
    block_ += ',';
}

void SweepTable::end_row() {
    ++rows_;
    if (format_ == Format::csv) block_.back() = '\n';
    if (block_.size() >= block_bytes || std::chrono::steady_clock::now() - flushed_ > block_time) flush();
}

void SweepTable::flush() {
    file_.write(block_);
    if (format_ == Format::npy && rows_ > 0) file_.write_at_begin(npy_head());
    block_.clear();
    flushed_ = std::chrono::steady_clock::now();
}

void SweepTable::finish() {
    flush();
    file_.finish();
}

}  // namespace lobatto
