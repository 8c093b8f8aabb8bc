// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/sweep/tally.hpp"

#include <cmath>
#include <limits>

namespace lobatto {

namespace {
constexpr std::size_t failures_kept = 5;
}

void Sums::add(double x) {
    if (std::isnan(x)) return;
    least_ = count_ == 0 || x < least_ ? x : least_;
    largest_ = count_ == 0 || x > largest_ ? x : largest_;
    ++count_;
    sum_ += x;
    squares_ += static_cast<long double>(x) * x;
}

Spread Sums::spread() const {
    constexpr double no_number = std::numeric_limits<double>::quiet_NaN();
    if (count_ == 0) return {no_number, no_number, no_number, no_number};
    const auto count = static_cast<long double>(count_);
    return {least_, largest_, static_cast<double>(sum_ / count), static_cast<double>(std::sqrt(squares_ / count))};
}

void Worst::see(double x, std::int64_t of) {
    if (std::isnan(x) || (index >= 0 && x <= value)) return;
    value = x;
    index = of;
}

SweepTally::SweepTally(std::size_t coordinates, std::int64_t count_of_setting)
    : n_(coordinates), count_of_setting_(count_of_setting), q_(coordinates), p_(coordinates) {}

void SweepTally::add(const SweepFigures& figures, const double* state) {
    const auto setting = static_cast<std::size_t>(figures.index / count_of_setting_);
    if (settings_.size() <= setting) settings_.resize(setting + 1);
    SettingTally& tally = settings_[setting];
    ++trajectories_, ++tally.trajectories;
    tally.steps_done += figures.steps_done;
    ++count_of_[static_cast<std::size_t>(figures.status)];
    if (figures.status != LOBATTO_OK) {
        ++tally.failed;
        if (failures_.size() < failures_kept) failures_.push_back(figures);
        return;
    }
    const auto stop = static_cast<std::size_t>(figures.stop);
    if (stops_.size() <= stop) stops_.resize(stop + 1);
    ++stops_[stop];
    tally.error.see(figures.error, figures.index);
    if (std::isnan(figures.error)) ++tally.unmeasured;
    tally.energy_error.see(figures.energy_error_largest, figures.index);
    energy_error_.add(figures.energy_error);
    for (std::size_t k = 0; k < n_; ++k) {
        q_[k].add(state[k]);
        p_[k].add(state[n_ + k]);
    }
}

void SweepTally::mark_read_back() {
    read_back_ = trajectories_;
    for (SettingTally& setting : settings_) setting.read_back = setting.trajectories;
}

Worst SweepTally::worst_error() const {
    Worst worst;
    for (const SettingTally& setting : settings_)
        if (setting.error.index >= 0) worst.see(setting.error.value, setting.error.index);
    return worst;
}

}  // namespace lobatto
