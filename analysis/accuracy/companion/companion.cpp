// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/companion/companion.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "analysis/accuracy/companion/distance.hpp"
#include "runtime/run/parts.hpp"
#include "runtime/stopwatch.hpp"

namespace lobatto {

namespace {

constexpr std::size_t most_numbers = 16384;  // of all comparisons together, positions and momenta
constexpr std::int64_t most_comparisons = 256;
constexpr std::int64_t amplitude_looks = 512;  // at the companion's way, for its amplitude, at least
constexpr std::int64_t most_at_once = 65536;   // steps or arrivals, before it hears that nobody waits
constexpr double short_run = 1;                // seconds: of these the companion always reaches the end
constexpr double graded = 8;            // steps are at most this part of the distance to a pulse, or half of its width
constexpr double finest = 0x1p-30;      // steps are never shorter than this part of those of the run
constexpr double same_time = 0x1p-48;   // relative: times that differ by no more differ by rounding
constexpr double same_as_rounded = 16;  // likewise, roundings of the kernel's numbers
// Evaluations of terms along steps of the companion, for what is narrow in them: three of each in a step without.
constexpr std::int64_t most_evaluations = 12'000'000;
constexpr int polls = 500;  // while the companion is waited for: from one question whether to wait on to the next

}  // namespace

std::int64_t companion_steps(std::int64_t steps) {
    std::int64_t taken = steps + (steps + 1) / 2;
    while (std::gcd(steps, taken) != 1) ++taken;
    return taken;
}

Companion::Companion(const Outline& outline, const Kernel& kernel, const TrajectoryRequest& request, double run_epsilon)
    : kernel_(kernel),
      parts_(static_cast<std::size_t>(kernel->parts)),
      run_epsilon_(run_epsilon),
      is_finer_(kernel->epsilon < run_epsilon),
      groups_(amplitude_groups(outline.scene)),
      meets_wall_(stands_in_walls(outline.scene)),
      rows_a_step_(1 + request.dense),
      narrow_(outline.system),
      constraints_(outline.system),
      parameters_(request.parameters),
      changes_energy_(!outline.conserves_energy() && kernel->has_energy != 0),
      contacts_(outline.scene.is_cut(), request_) {
    narrow_.set_parameters(request.parameters);
    const auto all_of = [this](const std::vector<double>& whole, const std::vector<double>& doubles) {
        return whole.empty() ? as_parts(doubles, parts_) : whole;
    };
    request_.whole_parameters = all_of(request.whole_parameters, request.parameters);
    request_.whole_step = all_of(request.whole_step, {request.step});
    request_.whole_q = all_of(request.whole_q, request.q);
    request_.whole_p = all_of(request.whole_p, request.p);
    request_.q = request.q;
    request_.p = request.p;
    request_.time = request.time;
    request_.step = request.step;
    request_.steps = request.steps;
    request_.arrivals = request.arrivals;
    request_.arrivals.keeps_chain = false;
    request_.every = request.every;
    request_.tolerance = request.tolerance * finer_iteration;
    pulses_ = find_pulses(outline, request.parameters, request.time, time_after(request, request.steps),
                          std::fabs(request.step));
    knots_ = find_knots(outline, request.parameters, request.time, time_after(request, request.steps));
    const std::int64_t comparisons =
        std::clamp<std::int64_t>(static_cast<std::int64_t>(most_numbers / (2 * groups_.size())), 1, most_comparisons);
    const std::int64_t kept = (request_.steps + request_.every - 1) / request_.every;
    stride_ = request_.every * std::max<std::int64_t>(1, (kept + comparisons - 1) / comparisons);
    is_driven_ = !outline.system.autonomous && !is_clocked();
    if (is_driven_) stride_ *= (fewest_driven_steps + stride_ - 1) / stride_;
}

Companion::~Companion() {
    end();
}

void Companion::end() {
    cancelled_ = true;
    if (thread_.joinable()) thread_.join();
}

void Companion::observe(const Records& records) {
    const std::size_t count = 2 * groups_.size();
    for (std::int64_t i = 0; i < records.count; ++i) {
        const double* const row = records.rows + i * records.columns + 1;
        widen_to(range_.least, range_.most, row, count);
        if (records.is_stop) {
            const auto parts = static_cast<std::size_t>(records.whole != nullptr ? records.parts : 1);
            stop_time_ = as_parts({row[-1]}, parts_);
            if (parts > 1) std::copy_n(records.whole + i * records.columns * records.parts, parts, stop_time_.data());
            stop_ = point_of(records, i, at_stop);
            continue;
        }
        // With a clock the states at its steps stand between the arrivals, which are told by their times.
        const bool is_arrival = request_.arrivals.interval == 0 || row[-1] == time_after(request_, seen_);
        if (!is_arrival) continue;
        const std::int64_t number = seen_++;
        if (number % rows_a_step_ != 0) continue;
        const std::int64_t steps = std::min(number / rows_a_step_ * request_.every, request_.steps);
        if (steps == 0 || (steps % stride_ != 0 && steps != request_.steps)) continue;
        run_.push_back(point_of(records, i, steps));
    }
}

Companion::Point Companion::point_of(const Records& records, std::int64_t row, std::int64_t steps) const {
    const std::size_t count = 2 * groups_.size();
    const auto parts = static_cast<std::size_t>(records.whole != nullptr ? records.parts : 1);
    const double* const whole = parts > 1 ? records.whole + (row * records.columns + 1) * records.parts
                                          : records.rows + row * records.columns + 1;
    Point point{steps, std::vector<double>(count * parts_, 0.0)};
    for (std::size_t k = 0; k < count; ++k)
        std::copy_n(whole + k * parts, parts, point.row.data() + k * parts_);  // finer numbers end with zeros
    return point;
}

double Companion::time_of(const Point& point) const {
    return point.steps == at_stop ? stop_time_.front() : time_after(request_, point.steps);
}

Companion::Segment Companion::segment(std::size_t number) const {
    Segment result;
    result.begin = static_cast<std::int64_t>(number) * stride_;
    result.steps = std::min(stride_, request_.steps - result.begin);
    const std::int64_t steps = is_driven_ ? std::max(result.steps, fewest_driven_steps) : result.steps;
    result.taken = is_clocked() ? result.steps : steps > 0 ? companion_steps(steps) : 0;
    return result;
}

// Steps of the companion for one of the run. With a clock both arrive at the same times, whatever their steps.
double Companion::ratio_of(const Segment& part) const {
    return is_clocked() ? clocked_ratio : static_cast<double>(part.taken) / static_cast<double>(part.steps);
}

void Companion::start() {
    if (request_.steps > 0) thread_ = std::thread([this] { compute(); });
}

void Companion::compute_here() {
    is_here_ = true;
    compute();
}

bool Companion::is_near_pulse(double from, double step) const {
    return is_too_long(pulses_, graded, from, step) || contacts_.is_near(from, step);
}

// A knot that the step crosses, not one at which it begins or ends but for rounding.
std::optional<double> Companion::knot_within(double from, double step) const {
    const double rounding = std::fmax(same_time, same_as_rounded * kernel_->epsilon);
    const double margin = std::fmax(finest * std::fabs(step), rounding * std::fabs(from + step));
    const double begin = std::fmin(from, from + step) + margin, end = std::fmax(from, from + step) - margin;
    const auto first = std::lower_bound(knots_.begin(), knots_.end(), begin);
    if (first == knots_.end() || *first >= end) return std::nullopt;
    return *first;
}

bool Companion::can_halve(double from, double step) const {
    return std::fabs(step) > finest * std::fmax(std::fabs(request_.step), std::fabs(from));
}

// Steps shorter and shorter towards a pulse, each on one side of all knots.
void Companion::take_finely(CompanionPlace& place, double from, const std::vector<double>& step) {
    if (place.status != LOBATTO_OK || cancelled_) return;
    const double size = step.front();
    if (const std::optional<double> knot = knot_within(from, size)) {
        take_finely(place, from, as_parts({*knot - from}, parts_));
        take_finely(place, *knot, minus(step, *knot - from));
        return;
    }
    if (is_near_pulse(from, size) && can_halve(from, size)) {
        const std::vector<double> half = times_fraction(step, 1, 2);
        take_finely(place, from, half);
        take_finely(place, from + size / 2, half);
        return;
    }
    take_one(place, from, step);
}

// One step; shorter ones in its place, if the motion met something narrow in it.
void Companion::take_one(CompanionPlace& place, double from, const std::vector<double>& step) {
    place.before = place.state();
    contacts_.begin(place, from);
    place.set_step(step, request_.whole_parameters);
    place.advance(1, request_.tolerance);
    if (place.status != LOBATTO_OK) return;
    const std::optional<Pulse> term = narrow_term(place, step);
    if (term)
        insert_in_order(pulses_, *term);
    else if (!contacts_.is_met(place, step))
        return;
    if (!can_halve(from, step.front()) || !is_near_pulse(from, step.front())) return;
    place.go_back(place.before);
    take_finely(place, from, step);
}

// That the motion met in the last step.
std::optional<Pulse> Companion::narrow_term(CompanionPlace& place, const std::vector<double>& step) {
    if (narrow_.empty() || evaluations_ >= most_evaluations) return std::nullopt;
    const CompanionPlace::State& before = place.before;
    const double from = before.time.front();
    NarrowTerms::State begin{from, rounded(before.q, parts_), {}},
        end{from + step.front(), rounded(place.q, parts_), {}};
    if (place.stepper.velocity(before.time, before.q, before.p, begin.v) != LOBATTO_OK ||
        place.stepper.velocity(place.time, place.q, place.p, end.v) != LOBATTO_OK)
        return std::nullopt;
    begin.v = rounded(begin.v, parts_);
    end.v = rounded(end.v, parts_);
    return narrow_.on_the_way(begin, end, evaluations_);
}

std::vector<double> Companion::step_of(const Segment& part) const {
    return is_clocked() ? as_parts({request_.step / ratio_of(part)}, parts_)
                        : times_fraction(request_.whole_step, part.steps, part.taken);
}

void Companion::take(CompanionPlace& place, const Segment& part) {
    const double from = time_after(request_, part.begin), size = request_.step / ratio_of(part);
    const std::vector<double> whole_size = step_of(part);
    const std::int64_t piece = std::clamp<std::int64_t>(request_.steps / amplitude_looks, 1, most_at_once);
    std::int64_t done = 0;
    contacts_.set_whole_step(size);
    while (done < part.taken && place.status == LOBATTO_OK && !cancelled_) {
        const double here = from + static_cast<double>(done) * size;
        if (done == part.taken / 2) contacts_.look_at_usual_change();
        const bool looks =
            !is_clocked() && (contacts_.is_sought() || (!narrow_.empty() && evaluations_ < most_evaluations));
        std::int64_t count = 0;
        const bool is_even = pulses_.empty() && knots_.empty() && !contacts_.is_any();
        while (!looks && count < std::min(piece, part.taken - done) &&
               (is_even || !needs_parts(here + static_cast<double>(count) * size, size)))
            count = is_even ? std::min(piece, part.taken - done) : count + 1;
        if (count == 0) {
            take_finely(place, here, whole_size);
            ++done;
            if (done == part.taken && place.status == LOBATTO_OK && place.before.time.front() == here)
                contacts_.divide_rest(place, whole_size);   // it was taken in one piece
            if (parts_ == 1 && place.status == LOBATTO_OK)  // the roundings of its parts do not add up
                place.time[0] = from + static_cast<double>(done) * size;
        } else {
            place.set_step(whole_size, request_.whole_parameters);
            done += place.advance(count, request_.tolerance);
        }
        const std::vector<double> row = place.rounded_row();
        widen_to(way_.least, way_.most, row.data(), row.size());
    }
}

// Where the companion is after so many comparisons; at first, beside the start.
CompanionPlace Companion::place_after(std::size_t comparisons) {
    CompanionPlace place{NumberStepper(kernel_), as_parts({request_.time}, parts_),
                         as_parts({0}, parts_),  request_.whole_q,
                         request_.whole_p,       request_.arrivals};
    if (comparisons > 0) {
        const Point& point = companion_[comparisons - 1];
        const auto middle = point.row.begin() + std::ssize(place.q);
        place.q.assign(point.row.begin(), middle);
        place.p.assign(middle, point.row.end());
        place.time = is_clocked() ? as_parts({time_after(request_, point.steps)}, parts_)
                                  : times_fraction(request_.whole_step, point.steps, 1);
        if (!is_clocked()) place.time[0] += request_.time;
    }
    if (comparisons == 0 && !is_finer_) {
        std::vector<double> moved = place.q;
        move_beside(kernel_, moved);
        if (place.stepper.prepare(request_.whole_parameters, request_.whole_step) == LOBATTO_OK &&
            place.stepper.start(place.time, moved, place.p) == LOBATTO_OK)
            place.q = moved;  // else the start is at the edge of where the Lagrangian is real
    }
    return place;
}

// From the last comparison before the stop to there, if the companion has come so far. `longest`: seconds.
void Companion::compare_at_stop(double longest) {
    if (stop_time_.empty() || companion_.size() < run_.size()) return;
    companion_.resize(run_.size());
    companion_ranges_.resize(run_.size());
    const std::int64_t begin = run_.empty() ? 0 : run_.back().steps;
    const double from = time_after(request_, begin);
    CompanionPlace place = place_after(run_.size());
    std::vector<double> way = minus(stop_time_, request_.time);
    for (const double part : times_fraction(request_.whole_step, begin, 1)) way = minus(way, part);
    way_ = {};
    cancelled_ = false;
    if (is_clocked()) {
        place.arrivals = {std::numeric_limits<double>::infinity(), stop_time_.front(), false};
        place.set_step(step_of(segment(0)), request_.whole_parameters);
        const Stopwatch watch;
        while (place.advance(1, request_.tolerance) == 0 && place.status == LOBATTO_OK)  // a call takes so many steps
            if (is_short_of_stop_ = watch.seconds() > longest; is_short_of_stop_) return;
    } else if (way.front() * request_.step > 0) {
        const double wanted = std::ceil(way.front() / request_.step * ratio_of(segment(0)));
        const std::int64_t steps = std::max<std::int64_t>(1, std::llround(wanted));
        const std::vector<double> step = times_fraction(way, 1, steps);
        contacts_.set_whole_step(step.front());
        const bool is_even = pulses_.empty() && knots_.empty() && narrow_.empty() && !contacts_.is_sought();
        const Stopwatch watch;
        for (std::int64_t done = 0; done < steps && place.status == LOBATTO_OK;) {
            if (is_short_of_stop_ = watch.seconds() > longest; is_short_of_stop_) return;
            if (is_even) {
                place.set_step(step, request_.whole_parameters);
                done += place.advance(std::min(steps - done, most_at_once), request_.tolerance);
            } else {
                take_finely(place, from + static_cast<double>(done++) * step.front(), step);
                if (parts_ == 1) place.time[0] = from + static_cast<double>(done) * step.front();
            }
        }
    } else {
        return;  // the stop is the last comparison
    }
    if (place.status != LOBATTO_OK) return;
    const std::vector<double> row = place.rounded_row();
    widen_to(way_.least, way_.most, row.data(), row.size());
    stopped_.reset();
    run_.push_back(stop_);
    companion_.push_back({at_stop, place.row()});
    companion_ranges_.push_back(std::exchange(way_, {}));
}

void Companion::compute() {
    std::size_t done = 0;
    {
        const std::lock_guard lock(mutex_);
        done = companion_.size();
    }
    CompanionPlace place = place_after(done);
    // A start is refused at some states on a wall that the motion passes. So where parts of steps fail, the way is
    // taken again in whole ones, from the last place where no new start is needed.
    std::size_t whole_until = 0, safe = done;
    CompanionPlace::State safe_state = place.state();
    for (Segment part = segment(done); part.steps > 0 && !(is_here_ && has_caught_up()); part = segment(++done)) {
        contacts_.set_divided(done >= whole_until);
        if (contacts_.is_sought() && place.step == step_of(part)) {
            safe = done;
            safe_state = place.state();
        }
        take(place, part);
        if (cancelled_) return;
        const std::lock_guard lock(mutex_);
        if (place.status != LOBATTO_OK && contacts_.is_sought()) {
            whole_until = done + 1;
            companion_.resize(companion_.size() - (done - safe));
            companion_ranges_.resize(companion_.size());
            done = safe - 1;  // and on with the next one
            place.go_back(safe_state);
            way_ = {};
            continue;
        }
        if (place.status != LOBATTO_OK) {
            stopped_ = place.time[0];
            break;
        }
        companion_.push_back({part.begin + part.steps, place.row()});
        companion_ranges_.push_back(std::exchange(way_, {}));
    }
    finished_ = true;
}

std::vector<double> Companion::save() const {
    const std::lock_guard lock(mutex_);
    std::vector<double> all{kernel_->epsilon, static_cast<double>(seen_), static_cast<double>(run_.size()),
                            static_cast<double>(companion_.size())};
    const auto put = [&](const std::vector<double>& numbers) {
        all.push_back(static_cast<double>(numbers.size()));
        all.insert(all.end(), numbers.begin(), numbers.end());
    };
    put(range_.least);
    put(range_.most);
    for (const Range& range : companion_ranges_) {
        put(range.least);
        put(range.most);
    }
    for (const auto* points : {&run_, &companion_})
        for (const Point& point : *points) {
            all.push_back(static_cast<double>(point.steps));
            all.insert(all.end(), point.row.begin(), point.row.end());
        }
    return all;
}

bool Companion::restore(const std::vector<double>& saved) {
    auto at = saved.begin();
    const auto take = [&](std::ptrdiff_t count) {
        if (saved.end() - at < count) return std::vector<double>();
        std::vector<double> part(at, at + count);
        at += count;
        return part;
    };
    const std::vector<double> counts = take(4);
    if (counts.empty() || counts[0] != kernel_->epsilon) return false;
    seen_ = std::llround(counts[1]);
    const auto get = [&] {
        const std::vector<double> size = take(1);
        return size.empty() ? size : take(std::llround(size[0]));
    };
    const auto get_range = [&] {
        const std::vector<double> least = get();
        return Range{least, get()};
    };
    range_ = get_range();
    for (std::int64_t i = 0; i < std::llround(counts[3]); ++i) companion_ranges_.push_back(get_range());
    for (const auto& [points, count] : {std::pair{&run_, counts[2]}, std::pair{&companion_, counts[3]}})
        for (std::int64_t i = 0; i < std::llround(count); ++i) {
            const std::vector<double> point = take(1 + 2 * std::ssize(groups_) * static_cast<std::ptrdiff_t>(parts_));
            if (!point.empty()) points->push_back({std::llround(point[0]), {point.begin() + 1, point.end()}});
        }
    return true;
}

// Where a stop ended the run before its time: whether nothing is left to compare.
bool Companion::has_caught_up() const {
    const std::lock_guard lock(mutex_);
    return companion_.size() >= run_.size();
}

bool Companion::has_compared() const {
    const std::lock_guard lock(mutex_);
    return !companion_.empty();
}

std::optional<MeasuredError> Companion::finish(const TrajectoryResult& result, const std::function<bool()>& asked) {
    int count = 0;
    bool is_wanted = true;
    const auto goes_on = [&] {
        if (asked && is_wanted && ++count % polls == 0) is_wanted = asked();
        return is_wanted;
    };
    const bool has_end =
        result.status == LOBATTO_OK && !result.interrupted && (result.steps_done > 0 || result.stop >= 0);
    if (has_end) {
        const bool begins_now = !thread_.joinable() && !finished_;  // there is one processor: it waited until now
        if (begins_now) start();
        const Stopwatch watch;
        const double longest = is_finer_ || result.seconds < short_run ? std::numeric_limits<double>::infinity()
                               : begins_now                            ? result.seconds / 2
                                                                       : 0,
                     to_first = 4 * result.seconds;  // where few states are kept
        while (goes_on() && !finished_ && !has_caught_up() &&
               watch.seconds() < (has_compared() ? longest : std::fmax(longest, to_first)))
            std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    cancelled_ = true;
    if (thread_.joinable()) thread_.join();
    // A companion that fails in the step of the stop may have gone too far: to where the motion rests.
    if (has_end && stopped_ && !stop_time_.empty() &&
        std::fabs(stop_time_.front() - *stopped_) <= std::fabs(request_.step))
        run_.resize(std::min(run_.size(), companion_.size()));
    if (has_end && result.stop >= 0 && goes_on())
        compare_at_stop(is_finer_ || result.seconds < short_run ? std::numeric_limits<double>::infinity()
                                                                : result.seconds / 2);
    if (!has_end || run_.empty() || (companion_.empty() && !stopped_)) return std::nullopt;
    return compare(result);
}

}  // namespace lobatto
