// SPDX-License-Identifier: GPL-2.0-or-later
// The error of a run, measured: a companion beside it, in a thread of its own, takes the same motion in about 3/2 of
// the steps. With a method of order p the difference D of the two is (1 - r^-p) times the error of the run, r the ratio
// of their steps; where rounding decides, D is the error itself, about.
//
// Where explicit time makes short pulses, or the motion meets terms that are narrower than a step (narrow_terms.hpp),
// which steps may miss, the companion takes short ones; likewise between two cuts at walls and switches that are near
// to one another, because a contact in one piece of a step has the same error in both. Its steps end at the knots of
// measured values in time. In equally many times it takes steps of a number without a common divisor with that of the
// run: oscillations that look constant to the one do not to the other.
//
// The companion begins four units in the last place beside the start: what no number of steps can know, and what grows
// where nearby trajectories diverge, is an error too.
//
// A companion may compute in finer numbers than the run, from the start of the scene with all their digits. Then D is
// the error where rounding decides, too; else it is only of the same size.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "analysis/accuracy/companion/amplitude.hpp"
#include "analysis/accuracy/companion/errors_of_steps.hpp"
#include "analysis/accuracy/companion/measured_error.hpp"
#include "analysis/accuracy/companion/place.hpp"
#include "analysis/accuracy/companion/short_contacts.hpp"
#include "analysis/accuracy/formulas/constraint_sizes.hpp"
#include "analysis/accuracy/formulas/narrow_terms.hpp"
#include "analysis/accuracy/formulas/pulses.hpp"
#include "generator/mechanics/outline.hpp"
#include "runtime/run/trajectory.hpp"

namespace lobatto {

// Of a companion, for so many steps of the run: about 3/2 of them, without a common divisor.
std::int64_t companion_steps(std::int64_t steps);
// Of a run with explicit time between two comparisons, at least: in fewer steps common divisors cannot be avoided.
inline constexpr std::int64_t fewest_driven_steps = 8;

// Of a companion with a clock: its steps for one of the run, both equally long in the time of the clock. It is no
// fraction, 2 sqrt(3) - 2: else both would come to the same places, and shorten the same step to a given time.
inline constexpr double clocked_ratio = 1.4641016151377546;

// Of the run's tolerance, the companion's: what the run leaves of its equations is measured, too.
inline constexpr double finer_iteration = 1e-3;

class Companion {
public:
    // All arguments are copied; `kernel` shares its library. `request`: the run's; its whole numbers are those of
    // `kernel`, which are the run's too, or finer. `run_epsilon`: of the run's.
    Companion(const Outline& outline, const Kernel& kernel, const TrajectoryRequest& request, double run_epsilon);
    ~Companion();

    // The kept states of the run go by.
    void observe(const Records& records);
    // Computes no more.
    void end();
    // Begins to compute. Before, `restore` may say what an earlier part of the run had.
    void start();
    // Instead: computes in this thread, as far as the run was observed.
    void compute_here();
    std::vector<double> save() const;
    // False: that part had no companion, or one in other numbers.
    bool restore(const std::vector<double>& saved);

    // Where a stop ended the run, the companion is compared there too.
    // Waits for the companion, where it computes in finer numbers or the run took less than a second of processor time,
    // and compares what there is; else that is as much as was computed beside the run. Nothing: the run was stopped, or
    // took no step. asked: now and then, whether to wait on.
    std::optional<MeasuredError> finish(const TrajectoryResult& result, const std::function<bool()>& asked = {});

private:
    struct Point {
        std::int64_t steps;       // of the run; `at_stop`
        std::vector<double> row;  // q, p, as parts
    };
    static constexpr std::int64_t at_stop = -1;  // between two steps
    struct Range {
        std::vector<double> least, most;  // 2n
    };
    struct Segment {
        std::int64_t begin = 0, steps = 0;  // of the run
        std::int64_t taken = 0;             // of the companion
    };

    double time_of(const Point& point) const;
    Point point_of(const Records& records, std::int64_t row, std::int64_t steps) const;
    CompanionPlace place_after(std::size_t comparisons);
    void compare_at_stop(double longest);
    Segment segment(std::size_t number) const;
    bool is_clocked() const { return request_.arrivals.interval != 0; }
    double ratio_of(const Segment& part) const;
    void compute();
    std::vector<double> step_of(const Segment& part) const;
    void take(CompanionPlace& place, const Segment& part);
    // `step` has all digits: steps and the parts of them end at the times of the run.
    void take_finely(CompanionPlace& place, double from, const std::vector<double>& step);
    void take_one(CompanionPlace& place, double from, const std::vector<double>& step);
    std::optional<Pulse> narrow_term(CompanionPlace& place, const std::vector<double>& step);
    bool has_caught_up() const;
    bool has_compared() const;
    bool can_halve(double from, double step) const;
    bool is_near_pulse(double from, double step) const;
    std::optional<double> knot_within(double from, double step) const;
    bool needs_parts(double from, double step) const { return is_near_pulse(from, step) || knot_within(from, step); }
    // 2n, of the motion until so many comparisons; 0: of what does not move, or by rounding alone.
    std::vector<double> amplitudes(std::size_t comparisons) const;
    std::vector<double> row_at(std::size_t comparison) const;
    bool run_rests() const;
    // Whether it rests because rounding holds it.
    bool is_held(const std::vector<double>& amplitude) const;
    void look_at_paces(std::vector<double>& amplitudes, std::size_t comparisons, const std::vector<double>& of_run,
                       const std::vector<double>& of_companion) const;
    bool goes_on_alike(std::size_t comparisons, const std::vector<double>& amplitude,
                       const TrajectoryResult& result) const;
    double power(const Rows& rows) const;
    MeasuredError compare(const TrajectoryResult& result) const;
    void lose_where_it_began(MeasuredError& error, const std::vector<double>& amplitude, double of_run) const;

    Kernel kernel_;
    std::size_t parts_;   // of its numbers
    double run_epsilon_;  // of those of the run
    bool is_finer_;       // than those
    TrajectoryRequest request_;
    std::vector<int> groups_;
    std::vector<bool> meets_wall_;  // n
    int rows_a_step_;
    std::vector<Pulse> pulses_;    // which the steps of the run may miss: the companion's are fine there
    NarrowTerms narrow_;           // likewise, where the motion meets them
    ConstraintSizes constraints_;  // what rounding in them moves positions by
    std::vector<double> parameters_;
    std::vector<double> knots_;     // of measured values in time, at which its steps end
    std::int64_t evaluations_ = 0;  // of terms, along steps of the companion
    bool is_driven_ = false;        // explicit time, without a clock
    bool changes_energy_;           // as forces and explicit time do
    ShortContacts contacts_;        // which the steps of the run may miss, too
    Range way_;                     // since the last comparison
    std::int64_t stride_;           // steps of the run between comparisons
    std::int64_t seen_ = 0;
    std::vector<Point> run_;         // of the run, at comparisons
    std::vector<double> stop_time_;  // where a stop ended it, as parts; empty: none did
    Point stop_{at_stop, {}};
    bool is_short_of_stop_ = false;        // to go there took too long
    Range range_;                          // of the run's kept states
    mutable std::mutex mutex_;             // guards what follows
    std::vector<Point> companion_;         // of the companion
    std::vector<Range> companion_ranges_;  // on the way to each: the run may stop before the companion does
    std::optional<double> stopped_;        // where the companion stopped with another status than ok
    std::atomic<bool> cancelled_{false}, finished_{false};
    bool is_here_ = false;  // no other thread computes
    std::thread thread_;
};

}  // namespace lobatto
