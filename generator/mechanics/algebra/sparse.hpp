// SPDX-License-Identifier: GPL-2.0-or-later
// A matrix of formulas of which most are zero.
#pragma once

#include <ginac/ginac.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

namespace lobatto {

class SparseMatrix {
public:
    SparseMatrix() = default;
    SparseMatrix(int rows, int columns) : rows_(rows), columns_(columns) {}

    int rows() const { return rows_; }
    int columns() const { return columns_; }
    // Zero where nothing was put.
    GiNaC::ex operator()(std::size_t row, std::size_t column) const {
        const auto entry = entries_.find({static_cast<int>(row), static_cast<int>(column)});
        return entry == entries_.end() ? GiNaC::ex(0) : entry->second;
    }
    void put(int row, int column, const GiNaC::ex& value) { entries_[{row, column}] = value; }
    // Row by row; none is identically zero.
    const std::map<std::pair<int, int>, GiNaC::ex>& entries() const { return entries_; }
    bool holds_any(const std::vector<GiNaC::symbol>& symbols) const {
        return std::any_of(entries_.begin(), entries_.end(), [&](const auto& entry) {
            return std::any_of(symbols.begin(), symbols.end(), [&](const auto& s) { return entry.second.has(s); });
        });
    }
    GiNaC::matrix dense() const {
        GiNaC::matrix result(static_cast<unsigned>(rows_), static_cast<unsigned>(columns_));
        for (const auto& [place, value] : entries_)
            result(static_cast<unsigned>(place.first), static_cast<unsigned>(place.second)) = value;
        return result;
    }

private:
    int rows_ = 0, columns_ = 0;
    std::map<std::pair<int, int>, GiNaC::ex> entries_;
};

}  // namespace lobatto
