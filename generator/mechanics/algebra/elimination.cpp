// SPDX-License-Identifier: GPL-2.0-or-later
// Gaussian elimination of sparse matrices of 60-digit numbers.
#include "generator/mechanics/algebra/elimination.hpp"

#include <set>

namespace lobatto {

namespace {

std::size_t at(int index) {
    return static_cast<std::size_t>(index);
}

class Eliminator {
public:
    Eliminator(const std::map<std::pair<int, int>, Sized>& entries, std::vector<cln::cl_R> right)
        : n_(static_cast<int>(right.size())),
          right_(std::move(right)),
          rows_(at(n_)),
          columns_(at(n_)),
          sizes_(at(n_), cln::cl_R(0)),
          pivot_row_(at(n_), -1) {
        for (const auto& [place, value] : entries) {
            rows_[at(place.first)][place.second] = value.value;
            columns_[at(place.second)].insert(place.first);
            sizes_[at(place.first)] = cln::max(sizes_[at(place.first)], value.size);
        }
    }

    Elimination run() {
        for (int column = 0; column < n_; ++column) {
            const int pivot = pivot_of(column);
            if (pivot < 0) return {true, substitute(column)};
            pivot_row_[at(column)] = pivot;
            clear(column, pivot);
        }
        return {false, substitute(n_)};
    }

private:
    // The diagonal where it serves, else the shortest row: the matrix stays sparse. -1: there is none.
    int pivot_of(int column) const {
        static const cln::cl_R tiny = cln::expt(cln::cl_RA(10), -35);
        int pivot = -1;
        for (const int row : columns_[at(column)]) {
            if (cln::abs(rows_[at(row)].at(column)) <= tiny * sizes_[at(row)]) continue;
            if (pivot < 0 || row == column || (pivot != column && rows_[at(row)].size() < rows_[at(pivot)].size()))
                pivot = row;
        }
        return pivot;
    }

    // Takes the column out of all rows not yet used.
    void clear(int column, int pivot) {
        for (const auto& [j, value] : rows_[at(pivot)]) columns_[at(j)].erase(pivot);
        for (const int row : std::set<int>(columns_[at(column)])) {
            const cln::cl_R factor = rows_[at(row)].at(column) / rows_[at(pivot)].at(column);
            for (const auto& [j, value] : rows_[at(pivot)]) {
                if (j < column) continue;
                const auto [target, is_new] = rows_[at(row)].emplace(j, cln::cl_R(0));
                if (is_new) columns_[at(j)].insert(row);
                target->second = target->second - factor * value;
            }
            rows_[at(row)].erase(column);
            columns_[at(column)].erase(row);
            right_[at(row)] = right_[at(row)] - factor * right_[at(pivot)];
        }
    }

    // The components before `free` from the rows: x with A x = right when all are; else component `free` is 1, the
    // later ones are 0, and A x = 0.
    std::vector<cln::cl_R> substitute(int free) const {
        std::vector<cln::cl_R> x(at(n_), cln::cl_R(0));
        if (free < n_) x[at(free)] = 1;
        for (int k = free - 1; k >= 0; --k) {
            const auto& row = rows_[at(pivot_row_[at(k)])];
            cln::cl_R sum = free < n_ ? cln::cl_R(0) : right_[at(pivot_row_[at(k)])];
            for (auto entry = row.upper_bound(k); entry != row.end(); ++entry)
                sum = sum - entry->second * x[at(entry->first)];
            x[at(k)] = sum / row.at(k);
        }
        return x;
    }

    const int n_;
    std::vector<cln::cl_R> right_;
    std::vector<std::map<int, cln::cl_R>> rows_;
    std::vector<std::set<int>> columns_;  // the rows not yet used that have an entry there
    std::vector<cln::cl_R> sizes_;        // a row: the largest number its entries were computed from
    std::vector<int> pivot_row_;          // of each column
};

}  // namespace

Elimination eliminate(const std::map<std::pair<int, int>, Sized>& entries, std::vector<cln::cl_R> right) {
    return Eliminator(entries, std::move(right)).run();
}

}  // namespace lobatto
