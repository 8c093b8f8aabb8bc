// SPDX-License-Identifier: MIT
// The cells of a line of a table with commas, and the numbers in them.
#pragma once

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>
#include <vector>

namespace lobatto {

// Parts of `line`, at least one; an empty line has one empty cell.
inline std::vector<std::string_view> cells_of(std::string_view line) {
    std::vector<std::string_view> cells;
    for (std::size_t begin = 0; begin <= line.size();) {
        const std::size_t end = std::min(line.find(',', begin), line.size());
        cells.push_back(line.substr(begin, end - begin));
        begin = end + 1;
    }
    return cells;
}

// Without the blanks and quotation marks around it.
inline std::string_view bare(std::string_view cell) {
    constexpr std::string_view around = " \t\r\"";
    const std::size_t first = std::min(cell.find_first_not_of(around), cell.size());
    return cell.substr(first, cell.find_last_not_of(around) + 1 - first);
}

// Of all that is in the cell, with or without a sign.
inline std::optional<double> number_in(std::string_view cell) {
    if (cell.starts_with('+') && !cell.starts_with("+-")) cell.remove_prefix(1);
    double value = 0;
    const auto read = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (read.ec != std::errc() || read.ptr != cell.data() + cell.size()) return std::nullopt;
    return value;
}

}  // namespace lobatto
