// SPDX-License-Identifier: GPL-2.0-or-later
// What is said of a sweep as a whole: how many failed and why, how numbers are spread, what was worst.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "analysis/sweep/rows.hpp"

namespace lobatto {

// How a number is spread over the trajectories that succeeded; not numbers when there is none.
struct Spread {
    double least, largest, mean, rms;
};

class Sums {
public:
    void add(double x);  // what is no number is left out
    std::int64_t count() const { return count_; }
    Spread spread() const;

private:
    std::int64_t count_ = 0;
    double least_ = 0, largest_ = 0;
    long double sum_ = 0, squares_ = 0;
};

// The largest of some numbers, and of which trajectory it is; index -1: there was none.
struct Worst {
    double value = 0;
    std::int64_t index = -1;
    void see(double x, std::int64_t of);
};

// Of the trajectories of one setting of the method.
struct SettingTally {
    std::int64_t trajectories = 0, read_back = 0, failed = 0, unmeasured = 0, steps_done = 0;
    Worst energy_error, error;
};

class SweepTally {
public:
    SweepTally(std::size_t coordinates, std::int64_t count_of_setting);

    // Figures in the order of the trajectories; `state`: q, p at the end.
    void add(const SweepFigures& figures, const double* state);

    std::int64_t trajectories() const { return trajectories_; }
    std::int64_t failed() const { return trajectories_ - count_of_[LOBATTO_OK]; }
    std::int64_t count_of(int status) const { return count_of_[static_cast<std::size_t>(status)]; }
    // How many of those that succeeded a stop ended, from 1 on; 0: none did.
    std::int64_t count_of_stop(std::size_t stop) const { return stop < stops_.size() ? stops_[stop] : 0; }
    const std::vector<SweepFigures>& first_failures() const { return failures_; }  // five at most
    // Of all that succeeded, but for those that were read back from a table without these columns.
    const Sums& q(std::size_t k) const { return q_[k]; }
    const Sums& p(std::size_t k) const { return p_[k]; }
    const Sums& energy_error() const { return energy_error_; }
    const std::vector<SettingTally>& settings() const { return settings_; }
    Worst worst_error() const;
    // What was added until now was read back from a table: it does not tell the largest energy error between its times.
    void mark_read_back();
    std::int64_t read_back() const { return read_back_; }

private:
    std::size_t n_;
    std::int64_t count_of_setting_, trajectories_ = 0;
    std::array<std::int64_t, LOBATTO_STATUSES> count_of_{};
    std::vector<std::int64_t> stops_;
    std::vector<SweepFigures> failures_;
    std::vector<Sums> q_, p_;
    Sums energy_error_;
    std::int64_t read_back_ = 0;
    std::vector<SettingTally> settings_;
};

}  // namespace lobatto
