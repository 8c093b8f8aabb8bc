// SPDX-License-Identifier: GPL-2.0-or-later
// The mean over time of a formula f along a motion with a clock, dt = g dtau. Its steps are equally long in tau, so the
// trapezoidal rule there, for f g, is as good as the steps are over whole periods; in t it is not, with few steps. Over
// parts of periods its two ends are corrected by differences of the values next to them (Gregory's rule), of the orders
// that get smaller: those of what changes much within a step do not.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

namespace lobatto {

class ClockedMean {
public:
    // Steps of this length in tau.
    void begin(double step);
    // At the next state; `is_asked`: it is asked for at its time. That it is the end of a step, too, is seen by the way
    // to the end of the next one.
    void observe(double time, double value, double rate, bool is_asked);
    double result() const;

private:
    struct Point {
        double time = 0, value = 0, rate = 0;
    };
    static double way(const Point& from, const Point& to) {  // in tau, about
        return 2 * (to.time - from.time) / (from.rate + to.rate);
    }
    void go_to(const Point& end);
    void pass_steps(bool last_is_end);
    void keep_near_ends(const Point& end);
    struct Ends {  // differences of the orders 1, 2, ...
        std::vector<double> head, tail, rate_head, rate_tail;
    };
    Ends differences() const;
    static std::size_t resolved_orders(const Ends& ends);
    // From the end of the last step to `last`: the mean there.
    double mean_of_rest(const Point& last, std::size_t orders) const;

    double step_ = 0;
    std::optional<Point> first_, end_;  // the start, and the last end of a step that others follow
    std::vector<Point> since_;          // states after that; the last may be the end of a step
    bool last_is_asked_ = true;
    double sum_ = 0, weight_ = 0;  // the trapezoidal rule for f g and for g, in steps
    std::vector<Point> head_;      // the first ends of steps
    std::deque<Point> tail_;       // the last ones, the last of all in front
};

}  // namespace lobatto
