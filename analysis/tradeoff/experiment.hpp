// SPDX-License-Identifier: GPL-2.0-or-later
// All that measuring a scene needs, brought together: its kernels, its reference, a store, a clock.
#pragma once

#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include "analysis/tradeoff/kernel_builder.hpp"
#include "analysis/tradeoff/measurement_store.hpp"
#include "analysis/tradeoff/measuring.hpp"
#include "runtime/stopwatch.hpp"

namespace lobatto {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double most_steps = 1e9;  // of a candidate to the end

struct ExperimentRequest {
    double seconds = 20;        // of wall time
    double wanted = 1e-18;      // the disagreement of the two references that is good enough
    std::string store;          // its file; empty: none
    std::vector<Member> first;  // kernels that will be needed whatever is found, those that the scene allows
    bool tries_clocks = true;   // beside the scene's own steps: equal ones, and clock = "auto"
    const volatile int* interrupted = nullptr;
    std::function<void(const std::string&)> say = [](const std::string&) {};  // what is being done
};

class Experiment {
public:
    // `written`: the scene as its file has it, which one kernel serves; `scene` with what the command line replaces.
    // Computes the reference. Throws as its parts do; InputError when there is no time to integrate over.
    Experiment(const Scene& written, const Scene& scene, ExperimentRequest request);

    const Scene& scene() const { return scene_; }
    const Reference& reference() const { return reference_; }
    KernelBuilder& kernel_builder() { return kernels_; }
    const Derivation& derivation() const { return kernels_.derivation(); }
    const Measurer& measurer() const { return *measurer_; }
    const MeasurementStore& store() const { return store_; }
    bool conserves() const { return conserves_; }
    const ExperimentRequest& request() const { return request_; }

    // Whether the two references differ by more than the errors that are of interest.
    bool is_chaotic() const { return reference_.disagreement.back() > trusted; }
    static constexpr double trusted = 1e-9;
    // What is to be small: the error; of a chaotic motion the energy error, or without energy 1/t, t the time until
    // which the true motion was followed.
    double figure(const Measurement& measurement) const;

    double until() const { return reference_.until; }
    // The numbers of steps that are tried, and the least of them.
    StepLadder ladder(double ratio) const { return {reference_.samples, ratio}; }
    double fewest_steps(StepClock clock) const;
    // Of this scene (generator/method/method.hpp).
    bool heeds_tolerance(const Member& member) const;
    // Of h times the frequency; not a number where none is known: with clocks, constraints and cut steps.
    double stability_limit_of(const Member& member) const;
    // With fewer, equal ones the steps of this member are unstable at most places of the motion.
    double fewest_stable_steps(const Member& member) const;
    // What the steps of a candidate divide: the end, and with a clock about the end in its time. It is a convention,
    // the same for all members: the end of a pilot run. Candidates take their steps until they are there.
    double span(StepClock clock) const { return measurer_->span(clock); }
    double elapsed() const;
    double left() const { return request_.seconds - elapsed(); }
    // Throws Interrupted when the flag is raised.
    void check_interruption() const;

    // From the store, or measured now, everything or error and time only. What takes longer than `limit` is left, and
    // not stored.
    Measurement measure(const Candidate& candidate, bool all = true, double limit = infinity);
    // Times it again, `repetitions` times, and keeps the least.
    Measurement time_again(const Measurement& measurement, int repetitions);

private:
    double rate_at(StepClock clock, const std::vector<GiNaC::ex>& positions, double time) const;
    bool varies(StepClock clock) const;
    void find_span(StepClock clock);

    Stopwatch watch_;
    Scene scene_;
    ExperimentRequest request_;
    ExactStart start_;
    KernelBuilder kernels_;
    bool conserves_;
    Reference reference_;
    std::optional<Measurer> measurer_;
    MeasurementStore store_;
    std::map<StepClock, double> radians_;  // that the fastest oscillation at the start would take to the end
    bool knows_symmetries_ = false;
};

// The end time of a scene, > 0; InputError.
double end_of(const Scene& scene);

}  // namespace lobatto
