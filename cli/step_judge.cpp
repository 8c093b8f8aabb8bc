// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/step_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "cli/error_estimate.hpp"
#include "cli/stability_limit.hpp"
#include "runtime/frequency.hpp"
#include "runtime/polynomial_estimate.hpp"

namespace lobatto {

namespace {

constexpr std::size_t most_states = 32;
constexpr std::size_t frequency_limit = 64;  // coordinates
constexpr double far = 100;  // times the error wanted: estimates may be off by nearly as much (docs/choosing.md)

}  // namespace

std::vector<int> unit_groups(const Scene& scene) {
    std::map<std::string, int> numbers;
    std::vector<int> groups;
    for (const Coordinate& coordinate : scene.coordinates)
        groups.push_back(numbers.try_emplace(coordinate.unit, static_cast<int>(numbers.size())).first->second);
    return groups;
}

StepJudge::StepJudge(const Scene& scene) : groups_(unit_groups(scene)) {}

void StepJudge::look(const Records& records) {
    const std::size_t columns = static_cast<std::size_t>(records.columns);
    for (std::int64_t i = 0; i < records.count; ++i) {
        const double* const row = records.rows + static_cast<std::size_t>(i) * columns;
        if (least_.empty()) least_.assign(row + 1, row + columns), most_ = least_;
        for (std::size_t k = 1; k < columns; ++k) {
            least_[k - 1] = std::min(least_[k - 1], row[k]);
            most_[k - 1] = std::max(most_[k - 1], row[k]);
        }
        if (seen_++ % stride_ != 0) continue;
        some_.emplace_back(row, row + columns);
        if (some_.size() < 2 * most_states) continue;
        for (std::size_t j = 0; j < most_states; ++j) some_[j] = some_[2 * j];  // every other one
        some_.resize(most_states);
        stride_ *= 2;
    }
}

std::vector<double> StepJudge::seen() const {
    std::vector<double> all{static_cast<double>(seen_), static_cast<double>(stride_)};
    all.insert(all.end(), least_.begin(), least_.end());
    all.insert(all.end(), most_.begin(), most_.end());
    for (const std::vector<double>& row : some_) all.insert(all.end(), row.begin(), row.end());
    return all;
}

void StepJudge::go_on_after(const std::vector<double>& seen) {
    const std::ptrdiff_t width = 2 * std::ssize(groups_);
    auto at = seen.begin();
    const auto take = [&](std::ptrdiff_t count) {
        std::vector<double> part(at, at + count);
        at += count;
        return part;
    };
    if (std::ssize(seen) < 2 + 2 * width) return;  // nothing was kept yet
    seen_ = std::llround(*at++);
    stride_ = std::llround(*at++);
    least_ = take(width);
    most_ = take(width);
    while (seen.end() - at > width) some_.push_back(take(1 + width));
}

StepJudge::Judgement StepJudge::judge(const Derivation& derivation, const Kernel& kernel,
                                      const TrajectoryRequest& request, const TrajectoryResult& result) const {
    Judgement judgement;
    judgement.limit = stability_limit(derivation.quadrature);
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
    double jump = 0;
    for (const std::vector<double>& row : some_) {
        const auto middle = row.begin() + 1 + static_cast<std::ptrdiff_t>(n);
        const std::vector<double> q(row.begin() + 1, middle), p(middle, row.end());
        const auto look_at = [&](double time, const std::vector<double>& position,
                                 const std::vector<double>& momentum) {
            const double frequency =
                n <= frequency_limit ? largest_frequency(stepper, time, position, momentum) : std::nan("");
            if (request.step * frequency > judgement.radians) judgement.radians = request.step * frequency;
        };
        look_at(row[0], q, p);
        if (kernel->has_dense == 0) continue;
        const double here = polynomial_defect(stepper, row[0], q, p, scale);
        if (here > jump) jump = here;
        // Inside the step too: at the ends all may be slow.
        std::vector<double> middle_q, middle_v;
        const double time = row[0] + 1.5 * request.step;
        if (stepper.dense(0.5, middle_q, middle_v) == LOBATTO_OK)
            look_at(time, middle_q, stepper.momentum(time, middle_q, middle_v));
    }
    const double steps = static_cast<double>(result.steps_done);
    const double estimate = ErrorEstimate(derivation.quadrature).after(steps, jump);
    // Polynomials that miss one another by as much as the motion itself tell nothing. What a tolerance leaves out, a
    // random part of it in each step, comes on top.
    if (kernel->has_dense != 0 && estimate < 1)
        judgement.error = std::fmin(1, estimate + request.tolerance * std::sqrt(steps));
    return judgement;
}

std::vector<std::string> StepJudge::warnings(const Judgement& judgement, double wanted_error) {
    std::vector<std::string> texts;
    if (judgement.radians > judgement.limit)
        texts.push_back(fmt::format(
            "the step is beyond the linear stability limit: h omega = {:.3g} is more than {:.4g}, omega the largest "
            "frequency met. Take a step below {:.2g} times this one, or Gauss, which has no limit",
            judgement.radians, judgement.limit, judgement.limit / judgement.radians));
    if (wanted_error > 0 && judgement.error && *judgement.error > far * wanted_error)
        texts.push_back(
            fmt::format("the scene asks for an error of {:.2g}, and the steps' polynomials speak of {:.1g}; "
                        "`lobatto tune` chooses a step",
                        wanted_error, *judgement.error));
    return texts;
}

}  // namespace lobatto
