// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/plot/number_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include "cli/table/hdf5_file.hpp"
#include "generator/formula/source.hpp"
#include "generator/formula/suggest.hpp"
#include "runtime/error.hpp"

namespace lobatto {

namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
    throw InputError(fmt::format("{}: {}", path, why));
}

std::string contents_of(const std::string& path) {
    std::error_code none;
    if (std::filesystem::is_directory(path, none)) refuse(path, "it is a folder");
    std::ifstream file(path, std::ios::binary);
    if (!file) refuse(path, fmt::format("cannot read it: {}", std::strerror(errno)));
    std::string text(std::istreambuf_iterator<char>(file), {});
    if (file.bad()) refuse(path, fmt::format("cannot read it: {}", std::strerror(errno)));
    return text;
}

std::vector<std::string_view> cells_of(std::string_view line) {
    std::vector<std::string_view> cells;
    for (std::size_t begin = 0; begin <= line.size();) {
        const std::size_t end = std::min(line.find(',', begin), line.size());
        cells.push_back(line.substr(begin, end - begin));
        begin = end + 1;
    }
    return cells;
}

// Empty cells and those of other words ("done") are no numbers, and not drawn.
double number_of(std::string_view cell) {
    while (cell.starts_with(' ')) cell.remove_prefix(1);
    while (cell.ends_with(' ')) cell.remove_suffix(1);
    if (cell.starts_with('+')) cell.remove_prefix(1);
    double value = 0;
    const auto read = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    return read.ec == std::errc() && read.ptr == cell.data() + cell.size() ? value
                                                                           : std::numeric_limits<double>::quiet_NaN();
}

// "# columns: t, x [m]": the units.
void read_units(std::string_view comment, NumberTable& table) {
    constexpr std::string_view mark = "columns: ";
    if (comment.starts_with("scene: ")) table.title = comment.substr(7);
    if (!comment.starts_with(mark)) return;
    comment.remove_prefix(mark.size());
    for (std::string_view cell : cells_of(comment)) {
        while (cell.starts_with(' ')) cell.remove_prefix(1);
        const std::size_t open = cell.find(" [");
        table.columns.push_back({std::string(cell.substr(0, open)), "", {}});
        if (open != std::string_view::npos && cell.ends_with(']'))
            table.columns.back().unit = cell.substr(open + 2, cell.size() - open - 3);
    }
}

NumberTable from_csv(const std::string& path, const std::string& text) {
    NumberTable table;
    bool has_names = false;
    int number = 0;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        std::string_view line(text.data() + begin, end - begin);
        const bool is_torn = end == text.size();
        begin = end + 1;
        ++number;
        if (line.ends_with('\r')) line.remove_suffix(1);
        if (line.starts_with('#')) {
            read_units(line.substr(std::min<std::size_t>(2, line.size())), table);
            continue;
        }
        if (line.empty()) continue;
        const std::vector<std::string_view> cells = cells_of(line);
        if (!has_names) {
            has_names = true;
            const bool known = table.columns.size() == cells.size();
            if (!known) table.columns.assign(cells.size(), {});
            for (std::size_t i = 0; i < cells.size(); ++i) table.columns[i].name = cells[i];
            continue;
        }
        if (is_torn && text.starts_with("# lobatto")) break;  // the last line of a run that was killed
        if (cells.size() != table.columns.size()) {
            if (is_torn) break;
            refuse(path, fmt::format("line {} has {} numbers, but there are {} columns", number, cells.size(),
                                     table.columns.size()));
        }
        for (std::size_t i = 0; i < cells.size(); ++i) table.columns[i].values.push_back(number_of(cells[i]));
    }
    if (!has_names) refuse(path, "there is no line with the names of columns, as in t,x,y");
    return table;
}

// What is left of the dictionary at the head of a .npy.
struct Head {
    std::string_view text;

    // What stands behind 'key':.
    std::string_view after(const std::string& key) const {
        const std::size_t at = text.find("'" + key + "':");
        return at == std::string_view::npos ? std::string_view() : text.substr(at + key.size() + 3);
    }
};

// The texts in quotes up to the closing bracket.
std::vector<std::string> quoted_in(std::string_view text) {
    std::vector<std::string> all;
    for (std::size_t i = 0; i < text.size() && text[i] != ']'; ++i)
        if (text[i] == '\'' || text[i] == '"') {
            const std::size_t end = text.find(text[i], i + 1);
            if (end == std::string_view::npos) break;
            all.emplace_back(text.substr(i + 1, end - i - 1));
            i = end;
        }
    return all;
}

std::vector<std::size_t> shape_in(std::string_view text) {
    std::vector<std::size_t> shape;
    const std::size_t close = text.find(')');
    for (std::size_t i = 0; i < close && i < text.size();) {
        std::size_t value = 0;
        const auto read = std::from_chars(text.data() + i, text.data() + close, value);
        if (read.ec == std::errc()) shape.push_back(value);
        i = read.ec == std::errc() ? static_cast<std::size_t>(read.ptr - text.data()) : i + 1;
    }
    return shape;
}

double number_at(const std::string& text, std::size_t at, bool whole) {
    std::uint64_t bits = 0;
    for (std::size_t byte = 0; byte < 8; ++byte)
        bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(text[at + byte])) << (8 * byte);
    return whole ? static_cast<double>(static_cast<std::int64_t>(bits)) : std::bit_cast<double>(bits);
}

// One-dimensional arrays of records of 8-byte numbers, and two-dimensional ones of them.
NumberTable from_npy(const std::string& path, const std::string& text) {
    const auto byte = [&](std::size_t at) { return static_cast<std::size_t>(static_cast<unsigned char>(text[at])); };
    if (text.size() < 12) refuse(path, "the head of a .npy is missing");
    const bool is_long = byte(6) > 1;
    std::size_t length = byte(8) | byte(9) << 8;
    if (is_long) length |= byte(10) << 16 | byte(11) << 24;
    const std::size_t begin = (is_long ? 12U : 10U) + length;
    if (begin > text.size()) refuse(path, "the head of a .npy is torn");
    const Head head{std::string_view(text).substr(is_long ? 12 : 10, length)};
    const std::string_view type = head.after("descr");
    std::vector<std::size_t> shape = shape_in(head.after("shape"));
    if (shape.size() == 2 && shape[1] > (text.size() - begin) / 8) refuse(path, "it is shorter than its head says");
    NumberTable table;
    std::vector<bool> whole;
    std::vector<std::string> words = quoted_in(type);
    const bool records = type.find('[') < type.find('\'');
    if (!records && shape.size() == 2 && !words.empty()) {  // columns are called 0, 1, ...
        std::vector<std::string> named;
        for (std::size_t k = 0; k < shape[1]; ++k) {
            named.push_back(std::to_string(k));
            named.push_back(words.front());
        }
        words = named;
        shape.pop_back();
    }
    for (std::size_t i = 0; i + 1 < words.size(); i += 2) {
        if (words[i + 1] != "<f8" && words[i + 1] != "<i8")
            refuse(path, fmt::format("its numbers are of type {}; only <f8 and <i8 are read", words[i + 1]));
        table.columns.push_back({words[i], "", {}});
        whole.push_back(words[i + 1] == "<i8");
    }
    if (table.columns.empty() || shape.size() != 1 || head.after("fortran_order").find("True") < 8)
        refuse(path, "it is no array of records, and no array of rows and columns");
    const std::size_t width = 8 * table.columns.size(), rows = std::min(shape[0], (text.size() - begin) / width);
    for (std::size_t i = 0; i < rows; ++i)
        for (std::size_t k = 0; k < table.columns.size(); ++k)
            table.columns[k].values.push_back(number_at(text, begin + i * width + 8 * k, whole[k]));
    return table;
}

// By the library; what it cannot read is a wrong file, not a broken machine.
NumberTable from_hdf5(const std::string& path) {
    require_hdf5(path);
    NumberTable table;
    try {
        const Hdf5Reader reader(path);
        const auto rows = static_cast<std::size_t>(reader.rows());
        std::vector<TableCell> cells(rows * reader.head().columns.size());
        if (rows > 0) reader.read(0, rows, cells.data());
        std::size_t c = 0;
        for (const TableColumn& column : reader.head().columns) {
            table.columns.push_back({column.name, column.unit, {}});
            for (std::size_t i = 0; i < rows; ++i) {
                const TableCell cell = cells[i * reader.head().columns.size() + c];
                table.columns.back().values.push_back(column.whole ? static_cast<double>(whole_in(cell))
                                                                   : real_in(cell));
            }
            ++c;
        }
        for (const auto& [what, value] : reader.head().facts)
            if (what == "scene") table.title = value;
    } catch (const MachineError& error) {
        throw InputError(error.what());
    }
    return table;
}

// x[3] is the column x_3.
std::string column_name(const std::string& name) {
    const std::size_t open = name.find('[');
    if (open == std::string::npos || !name.ends_with(']')) return name;
    return name.substr(0, open) + "_" + name.substr(open + 1, name.size() - open - 2);
}

}  // namespace

bool NumberTable::has(const std::string& name) const {
    return std::any_of(columns.begin(), columns.end(),
                       [&](const Column& one) { return one.name == column_name(name); });
}

const NumberTable::Column& NumberTable::column(const std::string& name) const {
    const std::string wanted = column_name(name);
    std::vector<std::string> names;
    for (const Column& one : columns) {
        if (one.name == wanted) return one;
        names.push_back(one.name);
    }
    refuse(path,
           fmt::format("there is no column '{}'; there are {}.{}", name, listing(names), suggestion(wanted, names)));
}

NumberTable read_number_table(const std::string& path) {
    const std::string text = contents_of(path);
    NumberTable table = text.starts_with("\x89HDF")     ? from_hdf5(path)
                        : text.starts_with("\x93NUMPY") ? from_npy(path, text)
                                                        : from_csv(path, text);
    table.path = path;
    if (table.columns.front().values.empty()) refuse(path, "there are no rows in it");
    return table;
}

}  // namespace lobatto
