// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/sweep/start_table.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <stdexcept>

#include "analysis/sweep/axis.hpp"
#include "runtime/build/sha256.hpp"
#include "runtime/files/cells.hpp"
#include "runtime/files/npy.hpp"
#include "runtime/files/partial_file.hpp"

namespace lobatto {

namespace {

class CsvStarts {
public:
    CsvStarts(const std::string& text, StartTable& table) : text_(text), table_(table) {}

    void read() {
        std::size_t begin = text_.starts_with("\xEF\xBB\xBF") ? 3 : 0;  // byte order mark
        while (begin < text_.size()) {
            ++line_;
            const std::size_t end = std::min(text_.find('\n', begin), text_.size());
            const std::string_view line(text_.data() + begin, end - begin);
            begin = end + 1;
            if (line.starts_with('#') || bare(line).empty()) continue;
            if (table_.names.empty())
                read_names(line);
            else
                read_row(line);
        }
        if (table_.names.empty())
            throw InputError(fmt::format("{}: no line with the names of columns, such as q,q',omega", table_.path));
    }

private:
    [[noreturn]] void fail(std::size_t column, const std::string& message) const {
        throw InputError(fmt::format("{}:{}:{}: {}", table_.path, line_, column + 1, message));
    }

    void read_names(std::string_view line) {
        for (const std::string_view cell : cells_of(line)) {
            table_.names.emplace_back(bare(cell));
            if (table_.names.back().empty())
                fail(static_cast<std::size_t>(cell.data() - line.data()), "a column without a name");
        }
        const std::string& first = table_.names.front();
        if (number_in(first))
            fail(0, fmt::format("'{}' is a number, but the first line names the columns, such as q,q',omega", first));
        table_.columns.resize(table_.names.size());
    }

    void read_row(std::string_view line) {
        const std::vector<std::string_view> cells = cells_of(line);
        for (std::size_t column = 0; column < cells.size(); ++column) {
            const auto at = static_cast<std::size_t>(cells[column].data() - line.data());
            if (column == table_.names.size())
                fail(at, fmt::format("more values than the {} columns that were named", table_.names.size()));
            const std::string_view value = bare(cells[column]);
            const std::optional<double> number = number_in(value);
            if (!number || !std::isfinite(*number))
                fail(at, fmt::format("'{}' is no finite number, of the column {}", value, table_.names[column]));
            table_.columns[column].push_back(*number);
        }
        if (cells.size() < table_.names.size())
            fail(line.size(), fmt::format("no value of the column {}", table_.names[cells.size()]));
    }

    const std::string& text_;
    StartTable& table_;
    std::size_t line_ = 0;
};

// Numbers without names are the scene's positions, and then its velocities or momenta.
void read_npy_starts(const Scene& scene, const std::string& bytes, StartTable& table) {
    const auto fail = [&](const std::string& why) {
        throw InputError(fmt::format("--starts: {}: {}", table.path, why));
    };
    NpyArray array;
    try {
        array = read_npy(bytes);
    } catch (const std::invalid_argument& error) {
        fail(error.what());
    }
    table.columns = std::move(array.columns);
    table.names = std::move(array.names);
    if (!table.names.empty()) return;
    const std::size_t n = scene.coordinates.size() - (scene.has_time_coordinate() ? 1 : 0),
                      width = table.columns.size();
    const bool has_velocities = scene.start == Start::velocity;
    if (array.shape.size() != 2 || (width != n && width != 2 * n))
        fail(
            fmt::format("an array without names has two dimensions and {} or {} columns, positions and then {}; "
                        "this one has {}. Records have names: numpy.rec.fromarrays(columns, names='q,...')",
                        n, 2 * n, has_velocities ? "velocities" : "momenta",
                        array.shape.size() == 2 ? fmt::format("{} columns", width) : "one dimension"));
    for (std::size_t c = 0; c < width; ++c) {
        const Coordinate& coordinate = scene.coordinates[c % n];
        table.names.push_back(c < n            ? coordinate.written
                              : has_velocities ? coordinate.written + "'"
                                               : "p_" + coordinate.name);
    }
}

}  // namespace

StartTable read_starts(const Scene& scene, const std::string& path) {
    StartTable table;
    table.path = path;
    const bool is_csv = path.ends_with(".csv");
    if (!is_csv && !path.ends_with(".npy"))
        throw InputError(
            fmt::format("--starts: {} has an ending that is not known; starts are read from .csv and .npy", path));
    if (std::error_code none; std::filesystem::is_fifo(path, none))  // it may wait for its writer for ever
        throw InputError(fmt::format("--starts: {} is a named pipe; give a file", path));
    const std::optional<std::string> whole = read_whole(path);
    if (!whole) throw InputError(fmt::format("--starts: cannot read {}: {}", path, std::strerror(errno)));
    const std::string& content = *whole;
    if (is_csv)
        CsvStarts(content, table).read();
    else
        read_npy_starts(scene, content, table);
    table.rows = std::ssize(table.columns.front());
    if (table.rows == 0) throw InputError(fmt::format("--starts: {} has no row", path));
    for (std::size_t c = 0; c < table.names.size(); ++c) {
        if (table.names[c].ends_with("(0)")) table.names[c].resize(table.names[c].size() - 3);
        for (std::int64_t i = 0; i < table.rows; ++i)
            if (!std::isfinite(table.columns[c][static_cast<std::size_t>(i)]))
                throw InputError(
                    fmt::format("--starts: {}: row {} of the column {} is no finite number", path, i, table.names[c]));
    }
    table.digest = sha256(content).substr(0, 16);
    return table;
}

}  // namespace lobatto
