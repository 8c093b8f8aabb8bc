// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/step_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "analysis/accuracy/companion/companion.hpp"
#include "analysis/accuracy/force_rounding.hpp"
#include "analysis/accuracy/formulas/constraint_sizes.hpp"
#include "analysis/stability/limit.hpp"
#include "runtime/measure/frequency.hpp"

namespace lobatto {

namespace {

constexpr std::size_t most_judged_states = 64;
constexpr int frequency_looks = 32;          // at some of them
constexpr std::size_t frequency_limit = 64;  // coordinates
constexpr std::size_t force_looks = 6;       // at states
constexpr int short_steps = 30;              // in the time in which a fast damping ends
constexpr double notable_kept = 0.02;        // of the amplitude
// Rounding of forces beside their size that is worth a warning, and beside the measured error.
constexpr double loud_rounding = 1e-6, seen_by_companions = 10;

}  // namespace

StepJudge::StepJudge(const Scene& scene)
    : groups_(amplitude_groups(scene)), rows_a_step_(1 + scene.outputs.dense), some_(most_judged_states) {}

void StepJudge::observe(const Records& records) {
    const std::size_t columns = static_cast<std::size_t>(records.columns);
    for (std::int64_t i = 0; i < records.count; ++i) {
        const double* const row = records.rows + static_cast<std::size_t>(i) * columns;
        if (least_.empty()) least_.assign(row + 1, row + columns), most_ = least_;
        for (std::size_t k = 1; k < columns; ++k) {
            least_[k - 1] = std::min(least_[k - 1], row[k]);
            most_[k - 1] = std::max(most_[k - 1], row[k]);
        }
        const std::int64_t number = seen_++;
        if (number % rows_a_step_ != 0) continue;
        hardest_.observe({row, row + columns}, records.energy != nullptr ? records.energy[i] : std::nan(""));
        some_.observe(number, row, columns);
    }
}

std::vector<double> StepJudge::save() const {
    std::vector<double> all{static_cast<double>(seen_)};
    all.insert(all.end(), least_.begin(), least_.end());
    all.insert(all.end(), most_.begin(), most_.end());
    const std::vector<double> by_hardest = hardest_.save();
    all.push_back(static_cast<double>(by_hardest.size()));
    all.insert(all.end(), by_hardest.begin(), by_hardest.end());
    some_.save(all);
    return all;
}

void StepJudge::restore(const std::vector<double>& saved) {
    const std::ptrdiff_t width = 2 * std::ssize(groups_);
    auto at = saved.begin();
    const auto take = [&](std::ptrdiff_t count) {
        std::vector<double> part(at, at + count);
        at += count;
        return part;
    };
    if (std::ssize(saved) < 1 + 2 * width) return;  // nothing was kept yet
    seen_ = std::llround(*at++);
    least_ = take(width);
    most_ = take(width);
    const std::ptrdiff_t by_hardest = std::llround(*at++);
    hardest_.restore(take(by_hardest), static_cast<std::size_t>(1 + width));
    some_.restore(saved.data() + (at - saved.begin()), saved.data() + saved.size(),
                  static_cast<std::size_t>(1 + width));
}

// Which coordinates errors alone move (rests_beside).
std::vector<bool> StepJudge::resting(LoadedStepper<double>& stepper, const TrajectoryRequest& request,
                                     const std::vector<double>& sizes) const {
    Rows rows{{request.time}};
    rows[0].insert(rows[0].end(), request.q.begin(), request.q.end());
    rows[0].insert(rows[0].end(), request.p.begin(), request.p.end());
    for (const SomeStates::State& state : some_.scattered()) rows.push_back(state.row);
    return rests_beside(stepper, request.step, rows, sizes, slight(sizes));
}

namespace {

// By how much of their amplitude momenta leave the way of a step when it is taken in short steps: Gauss's steps keep
// for good what a fast damping takes away at once, and so do all shorter ones that are still long beside it.
double kept_by_long_step(LoadedStepper<double>& stepper, const TrajectoryRequest& request,
                         const TrajectoryResult& result, double radians, const std::vector<double>& scale) {
    const auto after = [&](double step, std::int64_t steps) -> std::vector<double> {
        lobatto_advance some{};
        some.steps = steps;
        if (stepper.prepare(request.parameters, step) != LOBATTO_OK ||
            stepper.start(result.time, result.q, result.p) != LOBATTO_OK || stepper.advance(some) != LOBATTO_OK)
            return {};
        double time{};
        std::vector<double> q, p;
        stepper.state(time, q, p);
        return p;
    };
    const std::vector<double> by_one = after(request.step, 1), by_many = after(request.step / radians, short_steps);
    if (by_one.empty() || by_many.empty()) return 0;
    const std::size_t n = result.q.size();
    double largest = 0;
    for (std::size_t k = 0; k < n; ++k) {
        const double on_the_way = result.p[k] + short_steps / radians * (by_one[k] - result.p[k]);
        largest = std::fmax(largest, std::fabs(by_many[k] - on_the_way) / scale[n + k]);
    }
    return largest;
}

}  // namespace

StepJudge::Judgement StepJudge::judge(const Outline& outline, const Kernel& kernel, const TrajectoryRequest& request,
                                      const TrajectoryResult& result) const {
    Judgement judgement;
    LoadedStepper<double> stepper(kernel);
    if (some_.empty() || stepper.prepare(request.parameters, request.step) != LOBATTO_OK) return judgement;
    const std::size_t n = groups_.size();
    std::vector<double> scale(2 * n, 0.0);
    for (std::size_t i = 0; i < 2 * n; ++i)
        for (std::size_t j = 0; j < n; ++j)
            if (groups_[j] == groups_[i % n]) {
                const std::size_t other = i < n ? j : n + j;
                scale[i] = std::max(scale[i], (most_[other] - least_[other]) / 2);
            }
    for (double& value : scale)
        if (!(value > 0)) value = 1;
    const auto look_at = [&](double time, const std::vector<double>& q, const std::vector<double>& p) {
        const double radians = std::fabs(request.step) * largest_frequency_near(stepper, time, q, p, scale);
        if (radians > judgement.radians) judgement.radians = radians;
    };
    int looks = 0;
    for (const SomeStates::State& state : some_.scattered()) {
        if (n > frequency_limit || looks++ == frequency_looks) break;
        const auto middle = state.row.begin() + 1 + static_cast<std::ptrdiff_t>(n);
        const std::vector<double> q(state.row.begin() + 1, middle), p(middle, state.row.end());
        look_at(state.row[0], q, p);
        // Inside the step too: at the ends all may be slow.
        lobatto_advance one{};
        one.steps = 1;
        std::vector<double> within, velocity;
        if (kernel->has_dense == 0 || stepper.start(state.row[0], q, p) != LOBATTO_OK ||
            stepper.advance(one) != LOBATTO_OK || stepper.dense(0.5, within, velocity) != LOBATTO_OK)
            continue;
        const double time = state.row[0] + request.step / 2;
        look_at(time, within, stepper.momentum(time, within, velocity));
    }
    judgement.limit = stability_limit(outline.quadrature, judgement.radians);
    if (judgement.radians > short_steps && outline.system.has_forces()) {
        judgement.kept = kept_by_long_step(stepper, request, result, judgement.radians, scale);
        if (stepper.prepare(request.parameters, request.step) != LOBATTO_OK) return judgement;
    }

    // Coordinates that rounding alone moves tell nothing, as the radius of a circular orbit.
    std::vector<double> by_constraints;
    const ConstraintSizes constraints(outline.system);
    for (const SomeStates::State& state : some_.scattered())
        constraints.widen(by_constraints, state.row[0], state.row.data() + 1, request.parameters);
    const std::vector<bool> moves =
        moving(least_, most_, places_of(least_, most_, by_constraints), rounding_of_run(kernel->epsilon));
    std::vector<double> measure = scale, sizes(2 * n, 0.0);
    for (std::size_t i = 0; i < 2 * n; ++i)
        if (moves[i]) sizes[i] = scale[i];
    const std::vector<double> levels = noise_levels(sizes);
    // On the straight way between two states, off the constraints, what they hold is fast.
    const double least = outline.scene.constraints.empty() ? 1 : std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < 2 * n; ++i)
        if (measure[i] < levels[i]) measure[i] = least * levels[i];
    const std::vector<bool> rests = resting(stepper, request, sizes);
    for (std::size_t k = 0; k < n; ++k)
        for (const std::size_t i : {k, n + k})
            if (!moves[k] || !moves[i] || rests[k]) measure[i] = std::numeric_limits<double>::infinity();
    const std::optional<double> unresolved = first_unresolved(stepper, hardest_.states(), request.every, result.time,
                                                              request.parameters, request.step, measure);
    if (unresolved) judgement.unresolved = {1 + std::llround((*unresolved - request.time) / request.step), *unresolved};
    std::vector<std::vector<double>> rows;
    for (const SomeStates::State& state : some_.scattered())
        if (rows.size() < force_looks) rows.push_back(state.row);
    std::vector<bool> swings(n);  // by more than the roundings of all steps
    for (std::size_t k = 0; k < n; ++k)
        swings[k] = moves[k] && scale[k] >= levels[k] &&
                    most_[k] - least_[k] > kernel->epsilon * static_cast<double>(result.steps_done) *
                                               std::fmax(std::fabs(most_[k]), std::fabs(least_[k]));
    if (outline.scene.constraints.empty())
        judgement.rounding = force_rounding(outline, stepper, request.parameters, rows, swings, groups_);
    return judgement;
}

std::vector<std::string> StepJudge::warnings(const Judgement& judgement, double error) {
    std::vector<std::string> texts;
    if (judgement.rounding > loud_rounding && judgement.rounding > seen_by_companions * error)
        texts.push_back(fmt::format(
            "the forces lose digits, because terms in their formulas nearly cancel: their rounding is {:.1g} of their "
            "size. The error may be as large, and no second run in double shows it. Write the formulas without "
            "differences of nearly equal terms, or take --companion double-double or numbers = \"double-double\"",
            judgement.rounding));
    if (judgement.radians > judgement.limit)
        texts.push_back(fmt::format(
            "the step is beyond the linear stability limit: h omega = {:.4g} is more than {:.4g}, omega the largest "
            "frequency met. Take a step below {:.2g} times this one, or Gauss, which has no limit",
            judgement.radians, judgement.limit, part_below(judgement.limit, judgement.radians)));
    else if (judgement.kept > notable_kept)
        texts.push_back(fmt::format(
            "a damping is far faster than the step (h omega = {:.3g}), and these steps do not see it: velocities keep "
            "what they had at the start, {:.2g} of their amplitude at the end. Start with velocities to which the "
            "damping leads, or leave the small mass or inductance out",
            judgement.radians, judgement.kept));
    if (judgement.unresolved)
        texts.push_back(fmt::format(
            "in step {}, from t = {:.6g} on, the motion is not resolved: shorter steps lead to another place, or the "
            "step jumps over a singularity. Take a shorter step, or coordinates without a singularity there",
            judgement.unresolved->step, judgement.unresolved->time));
    return texts;
}

}  // namespace lobatto
