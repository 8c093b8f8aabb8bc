// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/clocked_mean.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace lobatto {

namespace {

// Gregory's rule: the integral over steps is the trapezoidal sum less these times the differences of each order at the
// last value, backward, and at the first one, forward with the sign of (-1)^order.
constexpr std::array<double, 6> gregory{1.0 / 12, 1.0 / 24, 19.0 / 720, 3.0 / 160, 863.0 / 60480, 275.0 / 24192};
constexpr double resolved = 0.7;  // of a difference, the next one, at most

// Gauss's quadrature on [-1, 1] with 4 points.
constexpr std::array<double, 4> gauss_node{-0.8611363115940526, -0.3399810435848563, 0.3399810435848563,
                                           0.8611363115940526},
    gauss_weight{0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538};

// The differences from the first of these values on, of the orders 1, 2, ...: f0 - f1, f0 - 2 f1 + f2, ...
std::vector<double> differences_of(std::vector<double> values) {
    std::vector<double> found;
    while (values.size() > 1) {
        for (std::size_t i = 0; i + 1 < values.size(); ++i) values[i] -= values[i + 1];
        values.pop_back();
        found.push_back(values.front());
    }
    return found;
}

// The integral from 0 to theta of the polynomial through values at theta, 0, -1, -2, ...
double integral_until(double theta, const std::vector<double>& values) {
    double sum = 0;
    const auto node = [&](std::size_t i) { return i == 0 ? theta : 1 - static_cast<double>(i); };
    for (std::size_t g = 0; g < gauss_node.size(); ++g) {
        const double x = theta / 2 * (1 + gauss_node[g]);
        double here = 0;
        for (std::size_t i = 0; i < values.size(); ++i) {
            double term = values[i];
            for (std::size_t j = 0; j < values.size(); ++j)
                if (j != i) term *= (x - node(j)) / (node(i) - node(j));
            here += term;
        }
        sum += gauss_weight[g] * theta / 2 * here;
    }
    return sum;
}

}  // namespace

void ClockedMean::begin(double step) {
    *this = {};
    step_ = step;
}

void ClockedMean::go_to(const Point& end) {
    sum_ += (end_->value * end_->rate + end.value * end.rate) / 2;
    weight_ += (end_->rate + end.rate) / 2;
    end_ = end;
    keep_near_ends(end);
}

void ClockedMean::keep_near_ends(const Point& end) {
    if (head_.size() <= gregory.size()) head_.push_back(end);
    tail_.push_front(end);
    if (tail_.size() > gregory.size() + 1) tail_.pop_back();
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
        keep_near_ends(*end_);
        return;
    }
    if (!last_is_asked_) pass_steps(true);
    since_.push_back({time, value, rate});
    last_is_asked_ = is_asked;
}

// The two ends, of f g and of g.
ClockedMean::Ends ClockedMean::differences() const {
    const auto of = [](const auto& points, const auto& number) {
        std::vector<double> values;
        for (const Point& point : points) values.push_back(number(point));
        return differences_of(std::move(values));
    };
    const auto product = [](const Point& point) { return point.value * point.rate; };
    const auto rate = [](const Point& point) { return point.rate; };
    return {of(head_, product), of(tail_, product), of(head_, rate), of(tail_, rate)};
}

// As many as get smaller at both ends.
std::size_t ClockedMean::resolved_orders(const Ends& ends) {
    const auto size = [&](std::size_t k) { return std::fabs(ends.head[k]) + std::fabs(ends.tail[k]); };
    std::size_t orders = 0;
    while (orders + 1 < ends.head.size() && size(orders + 1) <= resolved * size(orders)) ++orders;
    return orders;
}

double ClockedMean::mean_of_rest(const Point& last, std::size_t orders) const {
    std::vector<double> products{last.value * last.rate}, rates{last.rate};
    for (std::size_t i = 0; i <= orders; ++i) {
        products.push_back(tail_[i].value * tail_[i].rate);
        rates.push_back(tail_[i].rate);
    }
    const double rest = (last.time - end_->time) / step_;
    double theta = way(*end_, last) / step_;
    for (int i = 0; i < 8 && orders > 0; ++i) theta *= rest / integral_until(theta, rates);
    return integral_until(theta, products) / integral_until(theta, rates);
}

double ClockedMean::result() const {
    if (!first_ || since_.empty()) return first_ ? first_->value : std::numeric_limits<double>::quiet_NaN();
    ClockedMean all = *this;
    all.pass_steps(false);
    const Ends ends = all.differences();
    const std::size_t orders = resolved_orders(ends);
    double sum = all.sum_, weight = all.weight_;
    for (std::size_t k = 0; k < orders; ++k) {
        sum -= gregory[k] * (ends.head[k] + ends.tail[k]);
        weight -= gregory[k] * (ends.rate_head[k] + ends.rate_tail[k]);
    }
    const Point& last = all.since_.back();
    const double whole = all.end_->time - first_->time, rest = last.time - all.end_->time;
    return ((whole != 0 ? sum / weight * whole : 0) + (rest != 0 ? all.mean_of_rest(last, orders) * rest : 0)) /
           (whole + rest);
}

}  // namespace lobatto
