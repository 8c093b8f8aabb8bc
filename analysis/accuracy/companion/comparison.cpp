// SPDX-License-Identifier: GPL-2.0-or-later
// What the difference between a run and its companion says of the error.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "analysis/accuracy/companion/amplitude.hpp"
#include "analysis/accuracy/companion/at_rest.hpp"
#include "analysis/accuracy/companion/companion.hpp"
#include "analysis/accuracy/companion/distance.hpp"
#include "runtime/run/parts.hpp"

namespace lobatto {

namespace {

constexpr int most_coupled = 16;    // coordinates of which that is looked for
constexpr std::size_t windows = 8;  // in time, between the first error and the first that is as large as it can be
// Doublings of errors that grow exponentially, from the first window to the last: more than errors have that grow with
// a power of the time. Those that grow unevenly need more; those that jump once, as when a long orbit passes a pole, do
// not count.
constexpr double exponential = 14, certain = 25;
constexpr double largest_jump = 0.45;  // of all doublings, from one window to the next
constexpr int between = 16;            // parts of a step
constexpr double most_beyond = 8;      // times what was compared: exponential growth might not be seen in it yet
// Times what was compared: a momentum, or the change of the energy in time, of a rest that is another motion.
constexpr double much_faster = 1.5, much_more_power = 2;

using ErrorCourse = std::vector<std::pair<double, double>>;  // time, how far the motions are apart

// The time in which errors double, if they grow exponentially: all the way, not in jumps.
std::optional<double> doubling_of(const ErrorCourse& course) {
    const auto first = std::find_if(course.begin(), course.end(), [](const auto& c) { return c.second > 0; });
    auto last = std::find_if(first, course.end(), [](const auto& c) { return c.second > out_of_step / 2; });
    if (last == course.end() && first != course.end()) last = std::prev(course.end());
    if (first == course.end() || last - first < static_cast<std::ptrdiff_t>(windows)) return std::nullopt;
    const double window = (last->first - first->first) / static_cast<double>(windows);
    std::array<double, windows> largest{};  // until the end of each, in powers of 2
    auto place = first;
    double most = 0;
    for (std::size_t i = 0; i < windows; ++i) {
        const double end = first->first + window * static_cast<double>(i + 1);
        for (; place <= last && (i + 1 == windows || place->first <= end); ++place)
            most = std::fmax(most, place->second);
        largest[i] = std::log2(most);
    }
    const double growth = largest.back() - largest.front(), mean = growth / static_cast<double>(windows - 1);
    double spread = 0;
    for (std::size_t i = 1; i < windows; ++i) {
        const double step = largest[i] - largest[i - 1];
        if (step > largest_jump * growth) return std::nullopt;
        spread += (step - mean) * (step - mean) / static_cast<double>(windows - 1);
    }
    const bool is_even = std::sqrt(spread) < mean;
    if (!(growth > (is_even ? exponential : certain))) return std::nullopt;
    return window * static_cast<double>(windows - 1) / growth;
}

// `row`: q, p.
void lose(MeasuredError& error, double time, const std::vector<double>& row) {
    const auto middle = row.begin() + std::ssize(row) / 2;
    error.lost_after = time;
    error.lost_q.assign(row.begin(), middle);
    error.lost_p.assign(middle, row.end());
}

}  // namespace

// t, q, p of the run: 0 its start, then its comparisons.
std::vector<double> Companion::row_at(std::size_t comparison) const {
    std::vector<double> row{request_.time};
    if (comparison == 0) {
        row.insert(row.end(), request_.q.begin(), request_.q.end());
        row.insert(row.end(), request_.p.begin(), request_.p.end());
    } else {
        row[0] = time_of(run_[comparison - 1]);
        const std::vector<double> state = rounded(run_[comparison - 1].row, parts_);
        row.insert(row.end(), state.begin(), state.end());
    }
    return row;
}

// Of a kernel in double: what velocities and forces tell of amplitudes.
void Companion::look_at_paces(std::vector<double>& amplitudes, std::size_t comparisons,
                              const std::vector<double>& of_run, const std::vector<double>& of_companion) const {
    LoadedStepper<double> stepper(kernel_);
    if (stepper.prepare(request_.whole_parameters, request_.step) != LOBATTO_OK) return;
    if (kernel_->impacts > 0) widen_by_pace(amplitudes, meets_wall_, pace_at(stepper, request_.step, row_at(0)));
    const bool is_smooth = pulses_.empty() && knots_.empty() && !contacts_.is_sought();
    if (!is_smooth || comparisons == 0) return;
    leave_out_errors_of_steps(amplitudes, of_run, of_companion, [&](const std::vector<bool>& asked) {
        Rows rows;
        for (std::size_t j = 0; j <= comparisons; ++j) rows.push_back(row_at(j));
        return rests_beside(stepper, request_.step, rows, amplitudes, asked);
    });
}

std::vector<double> Companion::amplitudes(std::size_t comparisons) const {
    const std::size_t n = groups_.size();
    Range all = range_, of_companion;
    for (std::size_t j = 0; j < comparisons; ++j)
        for (const std::vector<double>& row : {companion_ranges_[j].least, companion_ranges_[j].most})
            if (!row.empty()) {
                widen_to(all.least, all.most, row.data(), row.size());
                widen_to(of_companion.least, of_companion.most, row.data(), row.size());
            }
    const std::vector<double> first = row_at(0);
    if (comparisons > 0 && rests_beside_companion({first.begin() + 1, first.end()}, range_.least, range_.most,
                                                  of_companion.least, of_companion.most, run_epsilon_))
        return std::vector<double>(2 * n, 0.0);
    std::vector<double> by_constraints;
    constraints_.widen(by_constraints, request_.time, request_.q.data(), parameters_);
    for (std::size_t j = 0; j < comparisons && !constraints_.empty(); ++j)
        constraints_.widen(by_constraints, time_of(run_[j]), rounded(run_[j].row, parts_).data(), parameters_);
    const std::vector<double> places = places_of(all.least, all.most, by_constraints);
    std::vector<double> shared = amplitudes_of(all.least, all.most, places, groups_, run_epsilon_);
    // What forces that cancel leave of one another moves a coordinate too, and tells nothing.
    NumberStepper stepper(kernel_);
    std::vector<double> T;
    if (kernel_->has_tangent != 0 && n <= most_coupled &&
        stepper.prepare(request_.whole_parameters, request_.whole_step) == LOBATTO_OK &&
        stepper.tangent(as_parts({request_.time}, parts_), request_.whole_q, request_.whole_p, T) == LOBATTO_OK) {
        T = rounded(T, parts_);
        const std::vector<double> found = shared;
        for (std::size_t i = 0; i < 2 * n; ++i)
            for (std::size_t j = 0; j < 2 * n; ++j)
                if (i % n != j % n && found[i] > 0)
                    shared[i] = std::fmax(shared[i], noise * std::fabs(T[i * 2 * n + j]) * found[j]);
    }
    const auto pair = [&](std::size_t j, std::size_t i) {
        return std::pair(run_[j].row[i * parts_], companion_[j].row[i * parts_]);
    };
    std::vector<double> start = rounded(request_.whole_q, parts_), momenta = rounded(request_.whole_p, parts_);
    start.insert(start.end(), momenta.begin(), momenta.end());
    leave_out_noise(shared, comparisons, start, pair);
    if (kernel_->real_kind == LOBATTO_DOUBLE)
        look_at_paces(shared, comparisons, half_of(range_.least, range_.most),
                      half_of(of_companion.least, of_companion.most));
    if (comparisons == 0) return shared;
    const Range& until_first = companion_ranges_.front();
    leave_out_rounding(shared, comparisons, places, static_cast<double>(request_.steps), run_epsilon_,
                       {half_of(until_first.least, until_first.most), static_cast<double>(segment(0).steps)}, pair);
    return shared;
}

// At its steps, and between them: there may be a whole oscillation in each.
bool Companion::run_rests() const {
    const std::vector<double> row = row_at(0), start(row.begin() + 1, row.end());
    if (is_clocked() || !rests(start, range_.least, range_.most, run_epsilon_)) return false;
    CompanionPlace place{NumberStepper(kernel_), as_parts({request_.time}, parts_),
                         as_parts({0}, parts_),  request_.whole_q,
                         request_.whole_p,       request_.arrivals};
    place.set_step(times_fraction(request_.whole_step, 1, between), request_.whole_parameters);
    place.advance(between / 2, 0);
    Range range;
    widen_to(range.least, range.most, start.data(), start.size());
    widen_to(range.least, range.most, place.rounded_row().data(), start.size());
    return place.status == LOBATTO_OK && rests(start, range.least, range.most, run_epsilon_);
}

bool Companion::is_held(const std::vector<double>& amplitude) const {
    const bool has_none = std::all_of(amplitude.begin(), amplitude.end(), [](double size) { return size == 0; });
    if (!has_none || is_driven_ || is_clocked() || contacts_.is_sought() || kernel_->real_kind != LOBATTO_DOUBLE)
        return false;
    LoadedStepper<double> stepper(kernel_);
    return stepper.prepare(request_.whole_parameters, request_.step) == LOBATTO_OK &&
           is_held_by_rounding(stepper, request_.time, request_.q, request_.p, request_.step, request_.steps);
}

// A wrong motion may grow, and its amplitude with it. When it began to be wrong is told by the amplitude until then.
void Companion::lose_where_it_began(MeasuredError& error, const std::vector<double>& amplitude, double of_run) const {
    constexpr double least = 1e-3;  // of the amplitude: what is less may be rounding
    constexpr int in_a_row = 3;     // comparisons, or all until it was lost by the whole amplitude
    Range range;
    const std::vector<double> start = row_at(0);
    widen_to(range.least, range.most, start.data() + 1, start.size() - 1);
    int lost = 0;
    std::vector<double> began;
    for (std::size_t j = 0; time_of(run_[j]) != *error.lost_after; ++j) {
        const std::vector<double> here = row_at(j + 1);
        for (const std::vector<double>& row :
             {std::vector<double>(here.begin() + 1, here.end()), companion_ranges_[j].least, companion_ranges_[j].most})
            if (!row.empty()) widen_to(range.least, range.most, row.data(), row.size());
        std::vector<double> until_then = half_of(range.least, range.most);
        for (std::size_t i = 0; i < amplitude.size(); ++i)
            until_then[i] = std::fmin(amplitude[i], std::fmax(until_then[i], least * amplitude[i]));
        const Distance distance = distance_between(run_[j].row.data(), companion_[j].row.data(), parts_, until_then,
                                                   of_run, momenta_alone(kernel_));
        lost = distance.is_lost() ? lost + 1 : 0;
        if (lost == 1) began = here;
        if (lost == in_a_row) break;
    }
    if (lost > 0) lose(error, began[0], {began.begin() + 1, began.end()});
}

// Whether the run beyond so many comparisons is no faster than before, and does not win or lose energy much faster.
// Else its error grows otherwise there than it did.
bool Companion::goes_on_alike(std::size_t comparisons, const std::vector<double>& amplitude,
                              const TrajectoryResult& result) const {
    const std::size_t n = groups_.size();
    Rows until_there, beyond;
    for (std::size_t j = 0; j <= comparisons; ++j) until_there.push_back(row_at(j));
    for (std::size_t j = comparisons; j <= run_.size(); ++j) beyond.push_back(row_at(j));
    std::vector<double> end{result.time};
    end.insert(end.end(), result.q.begin(), result.q.end());
    end.insert(end.end(), result.p.begin(), result.p.end());
    beyond.push_back(end);
    for (std::size_t i = n; i < 2 * n; ++i) {
        double most = 0, most_beyond_it = 0;
        for (std::size_t j = 0; j < comparisons; ++j)
            for (const auto* range : {&companion_ranges_[j].least, &companion_ranges_[j].most})
                if (!range->empty()) most = std::fmax(most, std::fabs((*range)[i]));
        for (const std::vector<double>& row : beyond) most_beyond_it = std::fmax(most_beyond_it, std::fabs(row[1 + i]));
        if (amplitude[i] > 0 && most_beyond_it > much_faster * most) return false;
    }
    return !changes_energy_ || power(beyond) <= much_more_power * power(until_there);
}

// The most that the energy changes from the first of these states on, in the time between the first and the last.
double Companion::power(const Rows& rows) const {
    NumberStepper stepper(kernel_);
    if (stepper.prepare(request_.whole_parameters, request_.whole_step) != LOBATTO_OK) return 0;
    const auto n = static_cast<std::ptrdiff_t>(groups_.size());
    const auto energy_of = [&](const std::vector<double>& row) {
        const std::vector<double> time = as_parts({row[0]}, parts_),
                                  q = as_parts({row.begin() + 1, row.begin() + 1 + n}, parts_),
                                  p = as_parts({row.begin() + 1 + n, row.end()}, parts_);
        std::vector<double> energy(parts_, 0.0);
        stepper.energy(time.data(), q.data(), p.data(), energy.data());
        return energy[0];
    };
    const double energy = energy_of(rows.front());
    double most = 0;
    for (const std::vector<double>& row : rows) most = std::fmax(most, std::fabs(energy_of(row) - energy));
    return most / std::fabs(rows.back()[0] - rows.front()[0]);
}

MeasuredError Companion::compare(const TrajectoryResult& result) const {
    const std::size_t count = std::min(run_.size(), companion_.size());
    const std::vector<double> amplitude = amplitudes(count);
    MeasuredError error;
    // If a stop ended the run, the companion went on. A failure after the time of the stop does not count.
    const bool is_beyond = stopped_ && (*stopped_ - result.time) * request_.step >= 0;
    const std::optional<double> stopped = is_beyond ? std::nullopt : stopped_;
    error.companion_stopped = stopped;
    ErrorCourse course;
    const double of_run = error_of_run(ratio_of(segment(0)), kernel_->order);
    Distance last, worst;
    for (std::size_t j = 0; j < count; ++j) {
        const Distance distance = distance_between(run_[j].row.data(), companion_[j].row.data(), parts_, amplitude,
                                                   of_run, momenta_alone(kernel_));
        error.until = time_of(run_[j]);
        if (j == 0 || distance.relative > worst.relative) worst = distance;
        last = distance;
        course.emplace_back(std::fabs(error.until - request_.time), std::fmax(worst.relative, distance.apart));
        if (!error.lost_after && distance.is_lost()) lose(error, error.until, rounded(run_[j].row, parts_));
    }
    if (error.lost_after) lose_where_it_began(error, amplitude, of_run);
    if (!error.lost_after && stopped && count > 0) {
        lose(error, *stopped, rounded(run_[count - 1].row, parts_));
    } else if (!error.lost_after && stopped) {
        error.lost_after = stopped;
        error.lost_q = request_.q;
        error.lost_p = request_.p;
    }
    if (!error.lost_after && count > 0 && is_held(amplitude))
        lose(error, time_of(run_[count - 1]), run_[count - 1].row);
    error.complete = count == run_.size() && !is_short_of_stop_;
    error.rests = run_rests();
    if (!error.rests) error.doubling = doubling_of(course);  // else what grows are amplitudes, of the companion
    // Errors that grow exponentially do not shrink again: two motions that were out of step have met by chance.
    const auto large = std::find_if(course.begin(), course.end(), [](const auto& c) { return c.second > by_chance; });
    if (!error.lost_after && error.doubling && large != course.end() && last.relative < worst.relative / 4) {
        const Point& point = run_[static_cast<std::size_t>(large - course.begin())];
        lose(error, time_of(point), rounded(point.row, parts_));
    }
    // Two motions so far apart may be near one another at one time, as pendulums are where they turn: the largest
    // difference is what is known.
    error.end_is_largest = worst.relative > by_chance && last.relative < worst.relative;
    const Distance& known = error.end_is_largest ? worst : last;
    error.end = known.relative;
    error.absolute = known.absolute;
    error.coordinate = known.coordinate;
    error.largest = worst.relative;
    error.at_end = error.end;
    if (!error.complete && !course.empty()) {
        const double whole = std::fabs(result.time - request_.time), part = course.back().first;
        if (error.doubling)
            error.at_end *= std::exp2((whole - part) / *error.doubling);
        else
            error.at_end = whole > most_beyond * part ? std::nan("") : error.at_end * whole * whole / (part * part);
        if (!goes_on_alike(count, amplitude, result)) error.at_end = std::nan("");
    }
    return error;
}

}  // namespace lobatto
