// SPDX-License-Identifier: GPL-2.0-or-later
// A candidate, run and compared with the reference.
#pragma once

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "analysis/exact_start.hpp"
#include "analysis/tradeoff/candidate.hpp"
#include "analysis/tradeoff/reference.hpp"
#include "runtime/build/library.hpp"
#include "runtime/measure/symmetry.hpp"

namespace lobatto {

// Of a whole motion.
struct Timing {
    bool complete = false;
    double seconds = 0;  // of processor time
    std::int64_t steps = 0, iterations = 0;
};

class Measurer {
public:
    // `exact`: a kernel of the system in the reference's precision, for its energy. `conserves`: energy. All are kept
    // by reference, the kernel excepted.
    Measurer(const Reference& reference, const ExactStart& start, Kernel exact, bool conserves,
             const volatile int* interrupted);

    // What the steps of candidates with this clock divide; the end itself without one (Experiment::span).
    void know_span(StepClock clock, double span) { spans_[clock] = span; }
    double span(StepClock clock) const { return clock == StepClock::none ? reference_.until : spans_.at(clock); }

    // Errors and time. With `all` also energy, momenta, drift and defect, which take a moment longer. A run is left,
    // incomplete, after `limit` seconds.
    Measurement measure(const Kernel& kernel, const Candidate& candidate, bool all,
                        double limit = std::numeric_limits<double>::infinity()) const;
    // The largest error at the candidate's own steps, some 1500 of them, against explicit extrapolation that lands on
    // each; infinite when either fails. Between the samples of the reference the error may be larger than at them.
    double error_on_steps(const Kernel& kernel, const Candidate& candidate) const;
    // The time alone, as many runs as there are.
    Timing time_once(const Kernel& kernel, const Candidate& candidate) const;
    // The error and the relative energy error at each of the samples that the candidate meets: rows of t, error,
    // energy.
    struct Course {
        std::vector<double> time, error, energy;
    };
    Course course(const Kernel& kernel, const Candidate& candidate) const;
    void know_symmetries(std::vector<Symmetry> symmetries) { symmetries_ = std::move(symmetries); }

private:
    template <class real>
    Measurement measure_in(const Kernel& kernel, const Candidate& candidate, bool all, double limit,
                           Course* course) const;
    template <class real, class Exact>
    double error_on_steps_in(const Kernel& kernel, const Candidate& candidate) const;
    template <class real>
    Timing time_in(const Kernel& kernel, const Candidate& candidate) const;
    double exact_energy(double time, const std::vector<double>& high, const std::vector<double>& low) const;

    const Reference& reference_;
    const ExactStart& start_;
    Kernel exact_;
    bool conserves_;
    const volatile int* interrupted_;
    std::vector<Symmetry> symmetries_;
    std::map<StepClock, double> spans_;
};

}  // namespace lobatto
