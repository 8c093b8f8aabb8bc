// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/clocked_mean.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace lobatto {

void ClockedMean::begin(double step) {
    *this = {};
    step_ = step;
}

void ClockedMean::go_to(const Point& end) {
    sum_ += (end_->value * end_->rate + end.value * end.rate) / 2;
    weight_ += (end_->rate + end.rate) / 2;
    end_ = end;
}

// Of the states since then some that are asked for may be ends of steps, too: those that are nearest to them. If the
// last one is no end, it stays.
void ClockedMean::pass_steps(bool last_is_end) {
    const Point begin = *end_;
    const auto way_to = [&](std::size_t i) { return way(i == 0 ? begin : since_[i - 1], since_[i]); };
    double whole = 0, gone = 0;
    for (std::size_t i = 0; i < since_.size(); ++i) whole += way_to(i);
    const auto steps = std::max(1L, std::lround(whole / step_));
    const double length = last_is_end ? whole / static_cast<double>(steps) : step_;
    std::size_t passed = 0;
    long ended = 1;
    for (std::size_t i = 0; i + 1 < since_.size() && ended < steps; ++i) {
        gone += way_to(i);
        const double end = static_cast<double>(ended) * length;
        if (std::fabs(gone - end) > std::fabs(gone + way_to(i + 1) - end)) continue;
        go_to(since_[i]);
        passed = i + 1;
        ++ended;
    }
    if (last_is_end) go_to(since_.back());
    since_.erase(since_.begin(), last_is_end ? since_.end() : since_.begin() + static_cast<std::ptrdiff_t>(passed));
}

void ClockedMean::observe(double time, double value, double rate, bool is_asked) {
    if (!first_) {
        first_ = end_ = Point{time, value, rate};
        return;
    }
    if (!last_is_asked_) pass_steps(true);
    since_.push_back({time, value, rate});
    last_is_asked_ = is_asked;
}

double ClockedMean::result() const {
    if (!first_ || since_.empty()) return first_ ? first_->value : std::numeric_limits<double>::quiet_NaN();
    ClockedMean all = *this;
    all.pass_steps(false);
    const Point &end = *all.end_, &last = all.since_.back();
    const double whole = end.time - first_->time, rest = last.time - end.time,
                 of_rest = (end.value * end.rate + last.value * last.rate) / (end.rate + last.rate);
    return ((all.weight_ > 0 ? all.sum_ / all.weight_ * whole : 0) + of_rest * rest) / (whole + rest);
}

}  // namespace lobatto
