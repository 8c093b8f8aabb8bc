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
    // At the next state; `is_step`: at the end of a step, not one that is asked for between two.
    void observe(double time, double value, double rate, bool is_step);
    double result() const;

private:
    struct Point {
        double time = 0, value = 0, rate = 0;
        bool is_step = false;
    };
    std::optional<double> begin_;
    Point step_, last_;  // at the last step that others follow, and of all
    double sum_ = 0, weight_ = 0;
};

class Reductions : public Reducer {
public:
    // `arrivals`: of the trajectories, with a clock. InputError for a formula that cannot be evaluated. The scene
    // outlives it.
    explicit Reductions(const Scene& scene, const Arrivals& arrivals = {});

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
    std::int64_t arrived_ = 0;
};

}  // namespace lobatto
