// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/companion/ensemble_companion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "analysis/accuracy/companion/amplitude.hpp"
#include "analysis/accuracy/companion/at_rest.hpp"
#include "analysis/accuracy/companion/companion.hpp"
#include "analysis/accuracy/companion/distance.hpp"
#include "analysis/accuracy/companion/errors_of_steps.hpp"
#include "analysis/accuracy/companion/place.hpp"
#include "runtime/build/number_stepper.hpp"
#include "runtime/run/parts.hpp"
#include "runtime/stopwatch.hpp"

namespace lobatto {

namespace {

// Of companions that are computed together; a device has many trajectories at a time.
constexpr std::int64_t numbers_at_once = 1 << 20, numbers_on_device = 1 << 24;
constexpr double seconds_at_once = 1;      // a sweep that is killed has no rows of those that were computed last
constexpr std::int64_t between_looks = 8;  // steps of a companion, at least
constexpr std::int64_t few_comparisons = 8;

const double unknown = std::numeric_limits<double>::quiet_NaN();

// In how many parts a companion looks at its way from one comparison to the next: states that are kept after whole
// periods are all at one place, and tell no amplitude. Of few comparisons it looks as often as it can.
std::int64_t looks_of(std::int64_t every, std::int64_t steps) {
    const std::int64_t between = steps / every < few_comparisons ? 1 : between_looks;
    for (const std::int64_t parts : {13, 11, 7, 5, 3})
        if (every % parts != 0 && every / parts >= between) return parts;
    return 1;
}

// Steps for `every` of the sweep: about 3/2 of them, without a common divisor, in equal parts.
std::int64_t steps_taken(std::int64_t every, std::int64_t steps) {
    const std::int64_t parts = looks_of(every, steps);
    std::int64_t taken = (companion_steps(every) + parts - 1) / parts * parts;
    while (std::gcd(every, taken) != 1) taken += parts;
    return taken;
}

// q and p of a kept state, with all digits.
const double* whole_row(const Records& kept, std::int64_t i) {
    return kept.whole == nullptr ? kept.rows + i * kept.columns + 1 : kept.whole + (i * kept.columns + 1) * kept.parts;
}

}  // namespace

EnsembleCompanion::EnsembleCompanion(const Outline& outline, const Kernel& kernel, const Kernel& plain,
                                     const EnsembleRequest& request)
    : outline_(outline),
      kernel_(kernel),
      parts_(static_cast<std::size_t>(kernel->parts)),
      request_(request),
      groups_(amplitude_groups(outline.scene)),
      meets_wall_(stands_in_walls(outline.scene)),
      narrow_(outline.system),
      constraints_(outline.system),
      stepper_(plain) {}

void EnsembleCompanion::compute(std::int64_t first) {
    const auto n = static_cast<std::int64_t>(groups_.size());
    const std::int64_t every = request_.every == 0 ? request_.steps : std::min(request_.every, request_.steps),
                       rows = (request_.steps / every + 1) * looks_of(every, request_.steps),
                       numbers = request_.device ? numbers_on_device : numbers_at_once,
                       room = numbers / ((8 + 2 * rows) * n * kernel_->parts),
                       group = 64 * std::max(request_.threads, 1),
                       fast = request_.device        ? room
                              : seconds_of_one_ == 0 ? group
                                                     : std::llround(seconds_at_once / seconds_of_one_),
                       count = std::min(std::max(std::min(room, fast), group), request_.first + request_.count - first);
    const Stopwatch watch;
    first_ = first;
    known_.assign(static_cast<std::size_t>(count), {});
    const std::int64_t whole = request_.steps / every * every;
    take(0, whole, every);
    if (whole < request_.steps) take(whole, request_.steps - whole, request_.steps - whole);
    seconds_of_one_ = std::fmax(watch.seconds(), 1e-9) / static_cast<double>(count);
}

void EnsembleCompanion::take(std::int64_t begin, std::int64_t steps, std::int64_t every) {
    const std::size_t n = groups_.size();
    EnsembleRequest companion = request_;
    companion.tolerance = request_.tolerance * finer_iteration;
    companion.first = 0;
    companion.count = std::ssize(known_);
    companion.start = [&](std::int64_t index, EnsembleStart& start) {
        request_.start(first_ + index, start);
        const std::vector<double>& rows = known_[static_cast<std::size_t>(index)].rows;
        if (begin == 0) {
            move_beside(kernel_, parts_ == 1 ? start.q : start.whole_q);
        } else if (rows.size() >= 2 * n * parts_) {
            const auto one = static_cast<std::ptrdiff_t>(n * parts_);
            (parts_ == 1 ? start.q : start.whole_q).assign(rows.end() - 2 * one, rows.end() - one);
            (parts_ == 1 ? start.rate : start.whole_rate).assign(rows.end() - one, rows.end());
        }
    };
    companion.from_velocities = request_.from_velocities && begin == 0;
    companion.time = time_after(request_, begin);
    const bool is_clocked = request_.arrivals.interval != 0;  // then both arrive at the same times
    const std::int64_t taken = is_clocked ? every : steps_taken(every, request_.steps),
                       looks = is_clocked ? 1 : looks_of(every, request_.steps);
    companion.step = is_clocked ? request_.step / clocked_ratio
                                : request_.step * static_cast<double>(every) / static_cast<double>(taken);
    if (parts_ > 1) companion.whole_step = times_fraction(request_.whole_step, every, taken);
    companion.steps = steps / every * taken;
    companion.every = taken / looks;
    companion.stops = false;
    companion.reducer = nullptr;
    companion.progress = nullptr;
    companion.sink = [&](const EnsembleTrajectory& trajectory) {
        Known& known = known_[static_cast<std::size_t>(trajectory.index)];
        if (begin == 0 || known.status == LOBATTO_OK) known.status = trajectory.status;
        std::vector<double> least, most;
        for (std::int64_t i = 0; i < trajectory.kept.count; ++i) {
            widen_to(least, most, trajectory.kept.rows + i * trajectory.kept.columns + 1, 2 * n);
            if (i == 0 || i % looks != 0) continue;
            const double* const whole = whole_row(trajectory.kept, i);
            known.rows.insert(known.rows.end(), whole, whole + 2 * n * parts_);
            for (std::vector<double>* const range : {&least, &most}) {
                known.ranges.insert(known.ranges.end(), range->begin(), range->end());
                range->clear();
            }
        }
    };
    if (integrate(kernel_, companion).interrupted) known_.clear();
}

bool EnsembleCompanion::has_pulses(const EnsembleStart& start) {
    if (start.parameters == pulse_parameters_ && !start.parameters.empty()) return has_pulses_;
    pulse_parameters_ = start.parameters;
    const double end = request_.time + static_cast<double>(request_.steps) * request_.step;
    has_pulses_ = !find_pulses(outline_, start.parameters, request_.time, end, std::fabs(request_.step)).empty();
    return has_pulses_;
}

bool EnsembleCompanion::meets_narrow_terms(const EnsembleTrajectory& trajectory, const EnsembleStart& start) {
    if (narrow_.empty() || request_.arrivals.interval != 0) return false;
    if (stepper_.prepare(start.parameters, request_.step) != LOBATTO_OK) return false;
    narrow_.set_parameters(start.parameters);
    const auto n = static_cast<std::ptrdiff_t>(groups_.size());
    const auto reach = static_cast<double>(request_.every == 0 ? request_.steps : request_.every);
    for (std::int64_t i = 0; i < trajectory.kept.count; ++i) {
        const double* const row = trajectory.kept.rows + i * trajectory.kept.columns;
        NarrowTerms::State state{row[0], {row + 1, row + 1 + n}, {}};
        if (stepper_.velocity(row[0], state.q, {row + 1 + n, row + 1 + 2 * n}, state.v) != LOBATTO_OK ||
            narrow_.may_be_met(state, request_.step, reach))
            return true;
    }
    return false;
}

bool EnsembleCompanion::goes_alone(const EnsembleTrajectory& trajectory, const EnsembleStart& start) {
    if (trajectory.has_near_cuts || meets_narrow_terms(trajectory, start)) return true;
    const bool is_clocked = request_.arrivals.interval != 0;  // events alone may hold the time then
    if (outline_.system.autonomous || is_clocked) return false;
    return (request_.every < fewest_driven_steps && request_.every > 0) || has_pulses(start);
}

// As of a run: companions take short steps at pulses, each at its own.
EnsembleCompanion::Error EnsembleCompanion::alone(const EnsembleTrajectory& trajectory,
                                                  const EnsembleStart& start) const {
    TrajectoryRequest request;
    request.parameters = start.parameters;
    request.q = start.q;
    LoadedStepper<double> stepper(stepper_.kernel());
    if (stepper.prepare(start.parameters, request_.step) != LOBATTO_OK) return {unknown, true};
    request.p = request_.from_velocities ? stepper.momentum(request_.time, start.q, start.rate) : start.rate;
    if (parts_ > 1) {
        request.whole_parameters = start.whole_parameters;
        request.whole_q = start.whole_q;
        request.whole_p = start.whole_rate;
        request.whole_step = request_.whole_step;
        NumberStepper numbers(kernel_);
        if (numbers.prepare(request.whole_parameters, request.whole_step) != LOBATTO_OK) return {unknown, true};
        if (request_.from_velocities)
            request.whole_p = numbers.momentum(as_parts({request_.time}, parts_), start.whole_q, start.whole_rate);
    }
    request.time = request_.time;
    request.step = request_.step;
    const bool is_stopped = trajectory.stop >= 0;
    request.steps = is_stopped ? std::min(trajectory.steps_done + 1, request_.steps) : request_.steps;
    request.every = request_.every == 0 ? request_.steps : request_.every;
    request.arrivals = request_.arrivals;
    request.tolerance = request_.tolerance;
    Companion companion(outline_, kernel_, request, kernel_->epsilon);
    Records kept = trajectory.kept;
    if (is_stopped) --kept.count;
    companion.observe(kept);
    TrajectoryResult result;
    result.steps_done = trajectory.steps_done;
    result.time = time_after(request_, trajectory.steps_done);
    if (is_stopped) {  // in the last row, between two steps
        Records stop = trajectory.kept;
        stop.rows += kept.count * stop.columns;
        if (stop.whole != nullptr) stop.whole += kept.count * stop.columns * stop.parts;
        stop.count = 1;
        stop.is_stop = true;
        companion.observe(stop);
        result.stop = trajectory.stop;
        result.time = stop.rows[0];
    }
    companion.compute_here();
    const std::optional<MeasuredError> error = companion.finish(result);
    if (!error && is_stopped) return {unknown, false};  // the companion cannot go so far
    if (!error || error->companion_stopped) return {unknown, true};
    return {error->end, error->is_lost()};
}

std::vector<double> EnsembleCompanion::amplitudes(
    const Records& kept, const Known& known, const std::vector<double>& parameters, std::int64_t comparisons,
    const std::function<std::pair<double, double>(std::size_t, std::size_t)>& pair) {
    const std::size_t n = groups_.size();
    std::vector<double> least, most, of_companion[2];
    for (std::int64_t i = 0; i < kept.count; ++i) widen_to(least, most, kept.rows + i * kept.columns + 1, 2 * n);
    const std::vector<double> run_half = half_of(least, most);
    const auto range_of_companion = [&](std::int64_t i) {
        return known.ranges.data() + i * static_cast<std::int64_t>(2 * n);
    };
    for (std::int64_t i = 0; i < 2 * comparisons; ++i)
        widen_to(of_companion[0], of_companion[1], range_of_companion(i), 2 * n);
    if (comparisons > 0 && rests_beside_companion({kept.rows + 1, kept.rows + kept.columns}, least, most,
                                                  of_companion[0], of_companion[1], kernel_->epsilon))
        return std::vector<double>(2 * n, 0.0);
    for (std::int64_t i = 0; i < 2 * comparisons; ++i) widen_to(least, most, range_of_companion(i), 2 * n);
    std::vector<double> by_constraints;
    for (std::int64_t i = 0; i < kept.count && !constraints_.empty(); ++i) {
        const double* const row = kept.rows + i * kept.columns;
        constraints_.widen(by_constraints, row[0], row + 1, parameters);
    }
    const std::vector<double> places = places_of(least, most, by_constraints);
    std::vector<double> amplitude = amplitudes_of(least, most, places, groups_, kernel_->epsilon);
    leave_out_noise(amplitude, static_cast<std::size_t>(comparisons), {kept.rows + 1, kept.rows + kept.columns}, pair);
    const auto row_at = [&](std::int64_t i) {
        return std::vector<double>(kept.rows + i * kept.columns, kept.rows + (i + 1) * kept.columns);
    };
    if (kernel_->impacts > 0 && stepper_.prepare(parameters, request_.step) == LOBATTO_OK)
        widen_by_pace(amplitude, meets_wall_, pace_at(stepper_, request_.step, row_at(0)));
    if (comparisons == 0) return amplitude;
    leave_out_errors_of_steps(
        amplitude, run_half, half_of(of_companion[0], of_companion[1]), [&](const std::vector<bool>& asked) {
            Rows rows;
            if (!outline_.scene.is_cut() && stepper_.prepare(parameters, request_.step) == LOBATTO_OK)
                for (std::int64_t i = 0; i < kept.count; ++i) rows.push_back(row_at(i));
            return rests_beside(stepper_, request_.step, rows, amplitude, asked);
        });
    const auto first = known.ranges.begin(), middle = first + std::ssize(amplitude);
    leave_out_rounding(
        amplitude, static_cast<std::size_t>(comparisons), places, static_cast<double>(request_.steps), kernel_->epsilon,
        {half_of({first, middle}, {middle, middle + std::ssize(amplitude)}), static_cast<double>(every())}, pair);
    return amplitude;
}

// From the last comparison before a stop to there, in place of what a companion knows beyond. Kept states: the start,
// those of comparisons, and where it was stopped. False: it does not come there.
bool EnsembleCompanion::go_to_stop(Known& known, const Records& kept, const EnsembleStart& start) const {
    const std::size_t n = groups_.size(), one = 2 * n * parts_;
    const auto before = static_cast<std::size_t>(std::max<std::int64_t>(kept.count - 2, 0));
    if (known.rows.size() < before * one) return false;
    known.rows.resize(before * one);
    known.ranges.resize(before * 4 * n);
    const bool is_clocked = request_.arrivals.interval != 0;
    const auto steps = static_cast<std::int64_t>(before) * every();
    const std::vector<double> stop(kept.rows + (kept.count - 1) * kept.columns, kept.rows + kept.count * kept.columns);
    CompanionPlace place{NumberStepper(kernel_), {}, {}, {}, {}, {}};
    if (before > 0) {
        const auto last = known.rows.end() - static_cast<std::ptrdiff_t>(one),
                   middle = last + static_cast<std::ptrdiff_t>(one / 2);
        place.q.assign(last, middle);
        place.p.assign(middle, known.rows.end());
    } else {
        place.q = parts_ == 1 ? start.q : start.whole_q;
        place.p.assign(whole_row(kept, 0) + one / 2, whole_row(kept, 0) + one);
        move_beside(kernel_, place.q);
    }
    const double from = time_after(request_, steps), way = stop[0] - from;
    place.time = as_parts({from}, parts_);
    const std::vector<double>& parameters = parts_ == 1 ? start.parameters : start.whole_parameters;
    if (is_clocked) {
        place.arrivals = {std::numeric_limits<double>::infinity(), stop[0], false};
        place.set_step({request_.step / clocked_ratio}, parameters);
        while (place.advance(1, request_.tolerance * finer_iteration) == 0 && place.status == LOBATTO_OK) {
        }  // a call takes so many steps
    } else if (way * request_.step > 0) {
        const double ratio = static_cast<double>(steps_taken(every(), request_.steps)) / static_cast<double>(every());
        const std::int64_t taken = std::max<std::int64_t>(1, std::llround(std::ceil(way / request_.step * ratio)));
        place.set_step(times_fraction(as_parts({way}, parts_), 1, taken), parameters);
        place.advance(taken, request_.tolerance * finer_iteration);
    }
    if (place.status != LOBATTO_OK) return false;
    const std::vector<double> row = place.row(), plain = place.rounded_row();
    known.rows.insert(known.rows.end(), row.begin(), row.end());
    for (int range = 0; range < 2; ++range) known.ranges.insert(known.ranges.end(), plain.begin(), plain.end());
    return true;
}

EnsembleCompanion::Error EnsembleCompanion::of(const EnsembleTrajectory& trajectory) {
    if (request_.steps == 0) return {0, false};
    EnsembleStart start;
    start.parameters.resize(static_cast<std::size_t>(kernel_->parameters));
    start.q.resize(groups_.size());
    start.rate.resize(groups_.size());
    request_.start(trajectory.index, start);
    if (goes_alone(trajectory, start)) return alone(trajectory, start);
    if (known_.empty() || trajectory.index >= first_ + std::ssize(known_)) compute(trajectory.index);
    const std::int64_t place = trajectory.index - first_;
    if (place >= std::ssize(known_)) return {unknown, false, true};
    Known& known = known_[static_cast<std::size_t>(place)];
    const std::size_t n = groups_.size();
    const Records& kept = trajectory.kept;
    const bool is_stopped = trajectory.stop >= 0;
    if (is_stopped ? !go_to_stop(known, kept, start) : known.status != LOBATTO_OK) return {unknown, true};
    const std::int64_t comparisons = std::ssize(known.rows) / static_cast<std::int64_t>(2 * n * parts_);
    const std::int64_t skipped = kept.count - comparisons;
    const auto run_at = [&](std::int64_t j) { return whole_row(kept, skipped + j); };
    const auto companion_at = [&](std::int64_t j) {
        return known.rows.data() + j * static_cast<std::int64_t>(2 * n * parts_);
    };
    const auto pair = [&](std::size_t j, std::size_t i) {
        const auto at = static_cast<std::int64_t>(j);
        return std::pair(run_at(at)[i * parts_], companion_at(at)[i * parts_]);
    };
    const std::vector<double> amplitude = amplitudes(kept, known, start.parameters, comparisons, pair);
    const double ratio = request_.arrivals.interval != 0
                             ? clocked_ratio
                             : static_cast<double>(steps_taken(every(), request_.steps)) / static_cast<double>(every()),
                 of_run = error_of_run(ratio, kernel_->order);
    Error error{0, false};
    double largest = 0;
    for (std::int64_t j = 0; j < comparisons; ++j) {
        const Distance distance =
            distance_between(run_at(j), companion_at(j), parts_, amplitude, of_run, momenta_alone(kernel_));
        error.relative = distance.relative;
        error.lost = error.lost || distance.is_lost();
        largest = std::fmax(largest, error.relative);
    }
    if (largest > by_chance) error.relative = largest;
    const bool rests = std::all_of(amplitude.begin(), amplitude.end(), [](double size) { return size == 0; });
    if (rests && comparisons > 0 && outline_.system.autonomous && !outline_.scene.clock && !outline_.scene.is_cut() &&
        kernel_->real_kind == LOBATTO_DOUBLE && stepper_.prepare(start.parameters, request_.step) == LOBATTO_OK) {
        const double* const first = kept.rows;
        const std::vector<double> q(first + 1, first + 1 + n), p(first + 1 + n, first + 1 + 2 * n);
        if (is_held_by_rounding(stepper_, first[0], q, p, request_.step, request_.steps)) return {1, true};
    }
    return error;
}

}  // namespace lobatto
