// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/plot/number_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "cli/table/hdf5_file.hpp"
#include "generator/formula/text/source.hpp"
#include "generator/formula/text/suggest.hpp"
#include "runtime/error.hpp"
#include "runtime/files/cells.hpp"
#include "runtime/files/npy.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
    throw InputError(fmt::format("{}: {}", path, why));
}

// Of the head of a table: "kernel" and its value.
void read_fact(std::string_view what, std::string_view value, NumberTable& table) {
    if (what == "scene") table.title = value;
    if (what == "kind") table.kind = value;
    if (what == "method" || what == "kernel" || what == "parameters") table.origin += fmt::format("{}; ", value);
}

// "# columns: t, x [m]": the units.
void read_comment(std::string_view comment, NumberTable& table) {
    constexpr std::string_view mark = "columns: ";
    constexpr std::string_view kind = "lobatto ";
    if (comment.starts_with(kind)) read_fact("kind", comment.substr(kind.size()), table);
    if (const std::size_t end = comment.find(": "); end != std::string_view::npos)
        read_fact(comment.substr(0, end), comment.substr(end + 2), table);
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
            read_comment(line.substr(std::min<std::size_t>(2, line.size())), table);
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
        // Empty cells and words such as "done" are not drawn.
        for (std::size_t i = 0; i < cells.size(); ++i)
            table.columns[i].values.push_back(
                number_in(bare(cells[i])).value_or(std::numeric_limits<double>::quiet_NaN()));
    }
    if (!has_names) refuse(path, "there is no line with the names of columns, as in t,x,y");
    return table;
}

// Columns without names are called 0, 1, ...
NumberTable from_npy(const std::string& path, const std::string& text) {
    NumberTable table;
    try {
        NpyArray array = read_npy(text);
        for (std::size_t k = 0; k < array.columns.size(); ++k)
            table.columns.push_back(
                {k < array.names.size() ? array.names[k] : std::to_string(k), "", std::move(array.columns[k])});
    } catch (const std::invalid_argument& error) {
        refuse(path, error.what());
    }
    const auto facts = nlohmann::json::parse(read_whole(path + ".json").value_or(""), nullptr, false);
    for (const char* what : {"kind", "scene", "method", "kernel", "parameters"})
        if (facts.is_object() && facts.contains(what) && facts[what].is_string())
            read_fact(what, facts[what].get<std::string>(), table);
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
        for (const auto& [what, value] : reader.head().facts) read_fact(what, value, table);
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

NumberTable read_number_table(const std::string& path, bool may_be_empty) {
    const std::optional<std::string> whole = read_whole(path);
    if (!whole) refuse(path, fmt::format("cannot read it: {}", std::strerror(errno)));
    const std::string& text = *whole;
    NumberTable table = text.starts_with("\x89HDF")     ? from_hdf5(path)
                        : text.starts_with("\x93NUMPY") ? from_npy(path, text)
                                                        : from_csv(path, text);
    table.path = path;
    if (table.columns.front().values.empty() && !may_be_empty) refuse(path, "there are no rows in it");
    return table;
}

}  // namespace lobatto
