// SPDX-License-Identifier: GPL-2.0-or-later
// The rows of a sweep's table: what their columns are, how a trajectory becomes rows, and what rows say of it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "analysis/sweep/judges.hpp"
#include "analysis/sweep/starts.hpp"

namespace lobatto {

struct TableColumn {
    std::string name, unit;  // unit "" when unknown
    bool whole = false;      // int64, else double
};

// What the summary needs of one trajectory. Bytes of it travel between processes.
struct SweepFigures {
    std::int64_t index = 0, status = 0, steps_done = 0;
    double time = 0;                                    // at the end
    double error = 0;                                   // not a number: not measured
    double energy_error = 0, energy_error_largest = 0;  // not numbers: the scene keeps no energy
    std::int64_t stop = 0;                              // that ended it, from 1 on; 0: none
};

// Cells are 8 bytes: the bits of an int64 or a double, as the column says. A row is one cell for each column.
using TableCell = std::uint64_t;

class SweepRows {
public:
    // `every`: of so many states one is kept; 0: the last alone. `measures`: there is a column of errors.
    SweepRows(const Scene& scene, const SweepStarts& starts, std::int64_t every, bool measures);

    const std::vector<TableColumn>& columns() const { return columns_; }
    bool one_row_each() const { return every_ == 0; }
    std::size_t coordinates() const { return n_; }

    // Appends the rows of a trajectory whose states were kept each `kept_every`-th step. Its figures; its last state
    // goes to `state`: q, p.
    SweepFigures append(std::vector<TableCell>& rows, const EnsembleTrajectory& trajectory, std::int64_t kept_every,
                        const Verdict& verdict, double* state) const;

    // The other way: what the last row of a trajectory says. What it does not say is not a number.
    SweepFigures read(const TableCell* row, double* state) const;

private:
    void add_state(const std::string& name, const std::string& unit = "");

    static constexpr std::size_t none = static_cast<std::size_t>(-1);
    std::size_t add(const std::string& name, const std::string& unit = "");
    std::size_t add_own(std::string name, bool whole);

    const Scene& scene_;
    const SweepStarts& starts_;
    std::int64_t every_;
    std::size_t n_, parts_;
    std::vector<TableColumn> columns_;
    std::size_t status_, steps_, stop_ = none, time_, q_ = none, p_ = none, energy_ = none, error_ = none;
};

// The columns of a number that is a sum of doubles: x, x.rest, x.rest2 ...
std::string name_of_part(const std::string& name, std::size_t part);

TableCell cell_of(std::int64_t value);
TableCell cell_of(double value);
std::int64_t whole_in(TableCell cell);
double real_in(TableCell cell);

}  // namespace lobatto
