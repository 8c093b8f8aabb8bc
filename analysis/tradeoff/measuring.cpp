// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/measuring.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "analysis/gradients.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "runtime/measure/extrapolation.hpp"
#include "runtime/run/timing.hpp"

namespace lobatto {

namespace {

constexpr double lost = 0.01;            // of the amplitude: the motion is another one
constexpr std::int64_t energies = 128;   // samples at which the energy is looked at
constexpr std::int64_t looks = 1500;     // steps whose error is looked at
constexpr int defect_limit = 32;         // coordinates; tangent maps of more take long
constexpr double timing_seconds = 4e-3;  // of repetitions in all
constexpr int most_repetitions = 5;
constexpr double block_seconds = 0.05;      // between two looks at the interruption
constexpr std::int64_t most_of_chain = 16;  // times the steps that a candidate is to take

// A run of the kernel with records at the samples, in blocks so that it can be interrupted. With a clock the samples
// are arrivals, beside the chain of its steps.
template <class real>
struct TimedRun {
    LoadedStepper<real> stepper;
    StartIn<real> start;
    double until;
    real h;
    std::size_t n;           // coordinates of the scene; a kernel with a clock may have the time beside them
    std::vector<real> rows;  // meetings x (1 + 2n)
    std::int64_t meetings, every;
    double seconds = 0, took = 0;  // of processor time, all calls and the last
    std::int64_t steps = 0, iterations = 0;
    lobatto_status status = LOBATTO_OK;

    TimedRun(const Kernel& kernel, const ExactStart& exact, const Candidate& candidate, const Measurer& measurer,
             double end, int samples)
        : stepper(kernel),
          until(end),
          h(step_of(candidate, measurer.span(candidate.member.clock))),
          n(exact.q.size()),
          meetings(std::gcd(candidate.steps, std::int64_t(samples))),
          every(candidate.steps / meetings) {
        start = start_in<real>(exact, kernel, h);
    }

    // With a clock a double, as scenes are given it.
    static real step_of(const Candidate& candidate, double span) {
        if (candidate.member.clock != StepClock::none)
            return static_cast<real>(span / static_cast<double>(candidate.steps));
        return static_cast<real>(span) / static_cast<real>(candidate.steps);
    }
    std::size_t columns() const { return 1 + 2 * n; }
    std::size_t columns_of_kernel() const { return 1 + 2 * start.q.size(); }

    bool begin() {
        seconds = 0;
        steps = iterations = 0;
        status = stepper.prepare(start.parameters, h);
        if (status == LOBATTO_OK) status = stepper.start(0, start.q, start.p);
        return status == LOBATTO_OK;
    }

    // As far as the call comes; whether all is well.
    bool advance(lobatto_advance& call, const volatile int* interrupted) {
        if (interrupted != nullptr && *interrupted != 0) throw Interrupted();
        const double began = processor_seconds();
        status = stepper.advance(call);
        took = processor_seconds() - began;
        seconds += took;
        steps += stepper.kernel()->clocked != 0 ? call.chain_steps : call.steps_done;
        iterations += call.iterations;
        return status == LOBATTO_OK;
    }

    // On a motion that is lost the steps of a chain may shrink to nothing.
    void give_up_endless_chain(const Candidate& candidate) {
        if (status == LOBATTO_OK && steps > most_of_chain * candidate.steps) status = LOBATTO_TIME_STANDS_STILL;
    }

    void go(const Candidate& candidate, const volatile int* interrupted, double limit) {
        const bool is_clocked = candidate.member.clock != StepClock::none;
        const std::int64_t all = is_clocked ? meetings : candidate.steps;
        std::int64_t done = 0, written = 0, block = std::min<std::int64_t>(all, 4096);
        rows.resize(static_cast<std::size_t>(meetings) * columns_of_kernel());
        for (begin(); status == LOBATTO_OK && done < all && seconds < limit;) {
            lobatto_advance call{};
            call.steps = std::min(block, all - done);
            call.tolerance = candidate.tolerance;
            call.record_every = is_clocked ? 1 : every;
            call.interval = until / static_cast<double>(meetings);
            call.end = until;
            call.records = rows.data() + static_cast<std::size_t>(written) * columns_of_kernel();
            call.capacity = meetings - written + 1;
            advance(call, interrupted);
            done += call.steps_done;
            written += call.records_written;
            if (call.steps_done == block && took < block_seconds / 4) block *= 2;
            if (is_clocked) give_up_endless_chain(candidate);
        }
        if (written < meetings && status == LOBATTO_OK) status = LOBATTO_NOT_FINITE;
        keep_columns();
    }

    // Every step of a chain, and the end.
    void go_along_chain(const Candidate& candidate, const volatile int* interrupted) {
        constexpr std::int64_t room = 4096;
        rows.clear();
        bool has_arrived = false;
        for (begin(); status == LOBATTO_OK && !has_arrived;) {
            const std::size_t size = rows.size();
            rows.resize(size + room * columns_of_kernel());
            lobatto_advance call{};
            call.steps = call.record_every = call.chain_records = 1;
            call.tolerance = candidate.tolerance;
            call.interval = call.end = until;
            call.records = rows.data() + size;
            call.capacity = room;
            advance(call, interrupted);
            give_up_endless_chain(candidate);
            has_arrived = call.steps_done == 1;
            rows.resize(size + static_cast<std::size_t>(call.records_written) * columns_of_kernel());
        }
        keep_columns();
        meetings = static_cast<std::int64_t>(rows.size() / columns());
    }

    // Where it was at a meeting; 0: at the start.
    double time(std::int64_t meeting) const {
        return until * static_cast<double>(meeting) / static_cast<double>(meetings);
    }
    template <class Wide>
    std::vector<Wide> positions(std::int64_t meeting) const {
        return meeting == 0 ? std::vector<Wide>(start.q.data(), start.q.data() + n) : part<Wide>(meeting, 0);
    }
    template <class Wide>
    std::vector<Wide> momenta(std::int64_t meeting) const {
        return meeting == 0 ? std::vector<Wide>(start.p.data(), start.p.data() + n) : part<Wide>(meeting, 1);
    }

private:
    // Of rows of the kernel those of the scene.
    void keep_columns() {
        const std::size_t width = columns_of_kernel(), extra = start.q.size() - n;
        if (extra == 0) return;
        auto to = rows.begin();
        for (auto row = rows.begin(); row != rows.end(); row += static_cast<std::ptrdiff_t>(width)) {
            to = std::copy_n(row, 1 + n, to);
            to = std::copy_n(row + static_cast<std::ptrdiff_t>(1 + n + extra), n, to);
        }
        rows.erase(to, rows.end());
    }

    template <class Wide>
    std::vector<Wide> part(std::int64_t meeting, std::size_t number) const {
        const real* const first = rows.data() + static_cast<std::size_t>(meeting - 1) * columns() + 1 + number * n;
        return std::vector<Wide>(first, first + n);
    }
};

// The slope of the straight line of least squares.
double slope_of(const std::vector<double>& x, const std::vector<double>& y) {
    const double count = static_cast<double>(x.size());
    const double mean_x = std::accumulate(x.begin(), x.end(), 0.0) / count,
                 mean_y = std::accumulate(y.begin(), y.end(), 0.0) / count;
    double xx = 0, xy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        xx += (x[i] - mean_x) * (x[i] - mean_x);
        xy += (x[i] - mean_x) * (y[i] - mean_y);
    }
    return xx > 0 ? xy / xx : 0;
}

// The errors of states at the samples that the run meets.
template <class real>
void compare_with_reference(const TimedRun<real>& run, const Reference& reference, Measurement& result,
                            Measurer::Course* course) {
    using Wide = std::conditional_t<std::is_same_v<real, float>, double, real>;
    const std::size_t n = reference.n;
    const auto error_at = [&](std::int64_t meeting) {
        const real* const row = run.rows.data() + static_cast<std::size_t>(meeting - 1) * run.columns() + 1;
        const auto sample = static_cast<std::size_t>(meeting * reference.samples / run.meetings);
        const double* const high = reference.high.data() + sample * 2 * n;
        const double* const low = reference.low.data() + sample * 2 * n;
        double worst = 0;
        for (std::size_t k = 0; k < reference.compared; ++k) {
            const Wide difference =
                (static_cast<Wide>(row[k]) - static_cast<Wide>(high[k])) - static_cast<Wide>(low[k]);
            const double error = std::fabs(static_cast<double>(difference)) / reference.scale[k];
            if (!(error <= worst)) worst = error;
        }
        return worst;
    };
    result.reaches = reference.until;
    bool is_lost = false;
    for (std::int64_t meeting = 1; meeting <= run.meetings; ++meeting) {
        const double error = error_at(meeting);
        if (!(error <= result.error)) result.error = error;
        result.error_end = error;
        if (!is_lost && !(error < lost)) {
            is_lost = true;
            result.reaches = run.time(meeting - 1);
        }
        if (course != nullptr) {
            course->time.push_back(run.time(meeting));
            course->error.push_back(error);
        }
    }
    if (!std::isfinite(result.error)) result.complete = false;
}

// The energy in the reference's precision, of the start as rounded and of the states as they are. `exact`: a kernel of
// the system in that precision.
template <class Exact, class real>
void look_at_energy(const TimedRun<real>& run, const Reference& reference, const Kernel& exact,
                    const ExactStart& exact_start, Measurement& result, Measurer::Course* course) {
    LoadedStepper<Exact> stepper(exact);
    const StartIn<Exact> start = start_in<Exact>(exact_start, exact, static_cast<Exact>(run.h));
    stepper.prepare(start.parameters, static_cast<Exact>(run.h));
    std::vector<double> times, errors;
    Exact first = 0;
    const std::int64_t every = std::max<std::int64_t>(1, run.meetings / (course != nullptr ? run.meetings : energies));
    for (std::int64_t meeting = 0; meeting <= run.meetings; meeting += every) {
        const double time = run.time(meeting);
        Exact energy = 0;
        if (stepper.energy(static_cast<Exact>(time), run.template positions<Exact>(meeting),
                           run.template momenta<Exact>(meeting), energy) != LOBATTO_OK)
            return;
        if (meeting == 0) first = energy;
        times.push_back(time);
        errors.push_back(static_cast<double>(energy - first) / reference.energy_scale);
    }
    result.energy_error = 0;
    for (const double error : errors) result.energy_error = std::max(result.energy_error, std::fabs(error));
    result.drift = slope_of(times, errors);
    if (course != nullptr) course->energy.assign(errors.begin() + 1, errors.end());
}

// Of the momenta that the symmetries conserve, relative to their parts, in quadruple precision.
template <class real>
double largest_momentum_error(const TimedRun<real>& run, const std::vector<Symmetry>& symmetries) {
    using Wide = __float128;
    double worst = 0;
    for (const Symmetry& symmetry : symmetries) {
        Wide first = 0;
        double largest = 0, size = 0;
        for (std::int64_t meeting = 0; meeting <= run.meetings; ++meeting) {
            const std::vector<Wide> q = run.template positions<Wide>(meeting), p = run.template momenta<Wide>(meeting);
            const std::size_t n = q.size();
            Wide momentum = 0;
            for (std::size_t i = 0; i < n; ++i) {
                Wide direction = symmetry.d[i];
                for (std::size_t j = 0; j < n; ++j) direction += static_cast<Wide>(symmetry.B[i * n + j]) * q[j];
                momentum += p[i] * direction;
                size = std::max(size, std::fabs(static_cast<double>(p[i] * direction)));
            }
            if (meeting == 0) first = momentum;
            largest = std::max(largest, std::fabs(static_cast<double>(momentum - first)));
        }
        if (size > 0) worst = std::max(worst, largest / size);
    }
    return worst;
}

}  // namespace

Measurer::Measurer(const Reference& reference, const ExactStart& start, Kernel exact, bool conserves,
                   const volatile int* interrupted)
    : reference_(reference),
      start_(start),
      exact_(std::move(exact)),
      conserves_(conserves && exact_->has_energy != 0),
      interrupted_(interrupted) {}

template <class real>
Measurement Measurer::measure_in(const Kernel& kernel, const Candidate& candidate, bool all, double limit,
                                 Course* course) const {
    TimedRun<real> run(kernel, start_, candidate, *this, reference_.until, reference_.samples);
    run.go(candidate, interrupted_, limit);
    Measurement result;
    result.candidate = candidate;
    result.step = static_cast<double>(run.h);
    result.complete = run.status == LOBATTO_OK;
    result.seconds = run.seconds;
    if (!result.complete) return result;
    compare_with_reference(run, reference_, result, course);
    const Timing chain = candidate.member.clock == StepClock::none  // else arrivals took steps of their own
                             ? Timing{true, run.seconds, run.steps, run.iterations}
                             : time_in<real>(kernel, candidate);
    result.seconds = chain.seconds;
    const auto iterations = static_cast<double>(chain.iterations), steps = static_cast<double>(chain.steps);
    result.iterations = iterations / steps;
    result.gradients = gradients_of(kernel.table(), iterations, steps);
    result.energy_error = result.drift = result.momentum_error = result.defect = std::nan("");
    if (!all || !result.complete) return result;

    double spent = chain.seconds;
    for (int repetition = 0; repetition < most_repetitions && spent < timing_seconds; ++repetition) {
        const Timing again = time_in<real>(kernel, candidate);
        result.seconds = std::min(result.seconds, again.seconds);
        spent += again.seconds;
    }
    if (conserves_ && reference_.energy_scale > 0) {
        if (reference_.precision == Precision::quadruple)
            look_at_energy<__float128>(run, reference_, exact_, start_, result, course);
        else
            look_at_energy<long double>(run, reference_, exact_, start_, result, course);
    }
    if (!symmetries_.empty()) result.momentum_error = largest_momentum_error(run, symmetries_);
    run.stepper.prepare(run.start.parameters, run.h);
    if (kernel->has_tangent != 0 && static_cast<int>(reference_.n) <= defect_limit && conserves_ &&
        candidate.tolerance == 0)
        result.defect = static_cast<double>(symplectic_defect(run.stepper, run.start.q, run.start.p));
    return result;
}

template <class real>
Timing Measurer::time_in(const Kernel& kernel, const Candidate& candidate) const {
    TimedRun<real> run(kernel, start_, candidate, *this, reference_.until, 1);
    run.go(candidate, interrupted_, std::numeric_limits<double>::infinity());
    return {run.status == LOBATTO_OK, run.seconds, run.steps, run.iterations};
}

template <class real, class Exact>
double Measurer::error_on_steps_in(const Kernel& kernel, const Candidate& candidate) const {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    TimedRun<real> run(kernel, start_, candidate, *this, reference_.until, 1);
    const bool is_clocked = candidate.member.clock != StepClock::none;
    std::int64_t stride = 1;  // of the rows
    if (is_clocked) {
        run.go_along_chain(candidate, interrupted_);
        stride = std::max<std::int64_t>(1, run.meetings / looks);
    } else {
        run.every = std::max<std::int64_t>(1, candidate.steps / looks);
        run.meetings = candidate.steps / run.every;
        run.go(candidate, interrupted_, infinity);
    }
    if (run.status != LOBATTO_OK) return infinity;

    const auto until = static_cast<Exact>(reference_.until);
    // Where steps are cut, steps that are parts of the candidate's; else by extrapolation.
    const std::int64_t parts = (reference_.steps + candidate.steps - 1) / candidate.steps;
    const bool is_cut = parts > 0;
    const Exact step = is_cut ? until / static_cast<Exact>(candidate.steps * parts) : until;
    const StartIn<Exact> start = start_in<Exact>(start_, exact_, step);
    LoadedStepper<Exact> stepper(exact_);
    stepper.prepare(start.parameters, step);
    if (is_cut && stepper.start(0, start.q, start.p) != LOBATTO_OK) return infinity;
    const double tolerance = std::is_same_v<Exact, __float128> ? 100 * reference_.tolerance : reference_.tolerance;
    Extrapolation<Exact> way(stepper, std::vector<Exact>(reference_.scale.begin(), reference_.scale.end()),
                             static_cast<Exact>(tolerance));
    way.start(0, start.q, start.p);
    std::vector<Exact> there, p;
    const auto go_on = [&](Exact time) {
        if (!is_cut) {
            const bool arrives = way.advance_to(time);
            there = way.state();
            return arrives;
        }
        lobatto_advance call{};
        call.steps = parts * run.every;
        Exact now;
        if (stepper.advance(call) != LOBATTO_OK || call.steps_done != call.steps) return false;
        stepper.state(now, there, p);
        there.insert(there.end(), p.begin(), p.end());
        return true;
    };
    double worst = 0;
    for (std::int64_t meeting = 1 + (run.meetings - 1) % stride; meeting <= run.meetings; meeting += stride) {
        if (interrupted_ != nullptr && *interrupted_ != 0) throw Interrupted();
        const real* const row = run.rows.data() + static_cast<std::size_t>(meeting - 1) * run.columns() + 1;
        const Exact time = is_clocked
                               ? static_cast<Exact>(row[-1])
                               : until * static_cast<Exact>(meeting * run.every) / static_cast<Exact>(candidate.steps);
        if (!go_on(time)) return infinity;
        for (std::size_t k = 0; k < reference_.compared; ++k) {
            const double error =
                std::fabs(static_cast<double>(static_cast<Exact>(row[k]) - there[k])) / reference_.scale[k];
            if (!(error <= worst)) worst = error;
        }
    }
    return worst;
}

double Measurer::error_on_steps(const Kernel& kernel, const Candidate& candidate) const {
    return with_type_of(candidate.member.precision, [&](auto type) {
        using real = decltype(type);
        return reference_.precision == Precision::quadruple ? error_on_steps_in<real, __float128>(kernel, candidate)
                                                            : error_on_steps_in<real, long double>(kernel, candidate);
    });
}

Measurement Measurer::measure(const Kernel& kernel, const Candidate& candidate, bool all, double limit) const {
    return with_type_of(candidate.member.precision,
                        [&](auto type) { return measure_in<decltype(type)>(kernel, candidate, all, limit, nullptr); });
}

Timing Measurer::time_once(const Kernel& kernel, const Candidate& candidate) const {
    return with_type_of(candidate.member.precision,
                        [&](auto type) { return time_in<decltype(type)>(kernel, candidate); });
}

Measurer::Course Measurer::course(const Kernel& kernel, const Candidate& candidate) const {
    Course course;
    with_type_of(candidate.member.precision, [&](auto type) {
        constexpr double endless = std::numeric_limits<double>::infinity();
        return measure_in<decltype(type)>(kernel, candidate, true, endless, &course);
    });
    return course;
}

}  // namespace lobatto
