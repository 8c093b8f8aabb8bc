// SPDX-License-Identifier: GPL-2.0-or-later
// What a sweep keeps of each trajectory instead of its states: the time of the first event, how many there were, the
// largest, least, mean and last value of a formula. Formulas are looked at after every step, and where a stop ended it;
// means are taken by the trapezoidal rule, with a clock as clocked_mean.hpp says.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/clocked_mean.hpp"
#include "analysis/tape.hpp"
#include "generator/scene/scene.hpp"
#include "runtime/kernel/kept.hpp"
#include "runtime/run/ensemble/ensemble.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

// With a clock: its rate in the scene that the kernel is of, its steps, and the times at which states are asked for,
// from `time` on (time_after).
struct ClockedSteps {
    GiNaC::ex rate;
    double step = 0;
    Arrivals arrivals;
    double time = 0;
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
    ClockedSteps clocked_;
    std::int64_t arrived_ = 0;
};

}  // namespace lobatto
