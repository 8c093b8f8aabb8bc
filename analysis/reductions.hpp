// SPDX-License-Identifier: GPL-2.0-or-later
// What a sweep keeps of each trajectory instead of its states: the time of the first event, how many there were, the
// largest, least, mean and last value of a formula. Formulas are looked at after every step, and where a stop ended it;
// means are taken by the trapezoidal rule, with a clock in its time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/tape.hpp"
#include "generator/scene/scene.hpp"
#include "runtime/kernel/kept.hpp"
#include "runtime/run/ensemble/ensemble.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

// The mean over time of a formula f along a motion with a clock, dt = g dtau. Its steps are equally long in tau, so the
// trapezoidal rule there, for f g, is as good as the steps are over whole periods; in t it is not, with few steps.
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

    double step_ = 0;
    std::optional<Point> first_, end_;  // the start, and the last end of a step that others follow
    std::vector<Point> since_;          // states after that; the last may be the end of a step
    bool last_is_asked_ = true;
    double sum_ = 0, weight_ = 0;
};

// With a clock: the times at which states are asked for, its rate in the scene that the kernel is of, and its steps.
struct ClockedSteps {
    Arrivals arrivals;
    GiNaC::ex rate;
    double step = 0;
};

class Reductions : public Reducer {
public:
    // InputError for a formula that cannot be evaluated. The scene outlives it.
    explicit Reductions(const Scene& scene, const ClockedSteps& clocked = {});

    void begin(const LoadedStepper<double>& stepper, const EnsembleStart& start) override;
    void observe(const double* rows, std::int64_t count) override;
    void observe_events(const double* rows, std::int64_t count) override;
    // One for each Outputs::kept; not a number: an event that did not happen.
    std::vector<double> values() const override;

    // The same for a device: C++ text of KeptFormulas (runtime/kernel/device_lanes.hpp).
    std::string text() const;

private:
    struct Part {
        Kept of;
        std::size_t event;
        std::optional<Tape> formula;
        KeptNumber number = {};
        ClockedMean mean = {};
    };
    bool is_arrival(double time);

    std::vector<Part> parts_;
    std::size_t n_;
    bool needs_energy_ = false, needs_velocity_ = false;
    const LoadedStepper<double>* stepper_ = nullptr;
    std::vector<double> variables_;  // of the formulas: parameters, time, q, v, p, H
    std::vector<double> q_, v_, p_;  // of the state that is looked at
    std::size_t parameters_;
    double first_time_ = 0, last_time_ = 0;
    bool has_begun_ = false;
    std::optional<Tape> rate_;  // of the clock
    Arrivals arrivals_;
    double step_ = 0;
    std::int64_t arrived_ = 0;
};

}  // namespace lobatto
