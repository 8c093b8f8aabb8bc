// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/step_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "analysis/accuracy/error_estimate.hpp"
#include "analysis/accuracy/exact_energy.hpp"
#include "analysis/stability/limit.hpp"
#include "runtime/measure/frequency.hpp"

namespace lobatto {

namespace {

constexpr std::size_t most_judged_states = 64;
constexpr int frequency_looks = 32;          // at some of them
constexpr std::size_t frequency_limit = 64;  // coordinates
constexpr double far = 1000;                 // times the error wanted: estimates may be off by nearly as much
constexpr double coarse_energy = 0x1p-40;    // of what energies are computed from: their rounding does not matter
constexpr double still = 0x1p-40;            // of the place: what rounding moves it by
constexpr double quickly = 30;               // times further apart than motions of different frequencies get

// Bijective, and in no way regular (S. Vigna's splitmix64); 0 stays 0.
std::uint64_t scrambled(std::int64_t number) {
    std::uint64_t z = static_cast<std::uint64_t>(number) * 0x9e3779b97f4a7c15;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
}

// Above that of the first state; in 60 digits where in double they are rounding, as of small motions.
std::vector<double> energies_along(const Derivation& derivation, const LoadedStepper<double>& stepper,
                                   const States<double>& states, const std::vector<double>& parameters) {
    std::vector<double> energies = energies_of(stepper, states);
    if (derivation.system.q.size() > ExactEnergy::most_coordinates) return energies;
    ExactEnergy exact(derivation, parameters);
    std::optional<cln::cl_R> first;
    double largest = 0;
    for (const double energy : energies) largest = std::fmax(largest, std::fabs(energy));
    for (std::size_t i = 0; i < states.size(); ++i) {
        const std::vector<double>& state = states[i];
        const auto middle = state.begin() + 1 + static_cast<std::ptrdiff_t>(state.size() / 2);
        const std::vector<double> q(state.begin() + 1, middle);
        std::vector<double> v;
        if (stepper.velocity(state[0], q, {middle, state.end()}, v) != LOBATTO_OK) continue;
        const auto here = exact.at(q, v);
        if (!here) continue;
        if (!first) first = here->value;
        if (i == 0 && largest > coarse_energy * cln::double_approx(here->size)) return energies;
        energies[i] = cln::double_approx(here->value - *first);
    }
    return energies;
}

}  // namespace

std::vector<int> unit_groups(const Scene& scene) {
    std::map<std::string, int> numbers;
    std::vector<int> groups;
    for (const Coordinate& coordinate : scene.coordinates)
        groups.push_back(numbers.try_emplace(coordinate.unit, static_cast<int>(numbers.size())).first->second);
    return groups;
}

StepJudge::StepJudge(const Scene& scene) : groups_(unit_groups(scene)), rows_a_step_(1 + scene.outputs.dense) {}

void StepJudge::keep(std::int64_t number, std::vector<double> row) {
    const std::uint64_t place = scrambled(number);
    if (some_.size() == most_judged_states) {
        if (place > std::prev(some_.end())->first) return;
        some_.erase(std::prev(some_.end()));
    }
    some_.emplace(place, State{number, std::move(row)});
}

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
        if (some_.size() < most_judged_states || scrambled(number) < some_.rbegin()->first)
            keep(number, {row, row + columns});
    }
}

std::vector<double> StepJudge::save() const {
    std::vector<double> all{static_cast<double>(seen_)};
    all.insert(all.end(), least_.begin(), least_.end());
    all.insert(all.end(), most_.begin(), most_.end());
    const std::vector<double> by_hardest = hardest_.save();
    all.push_back(static_cast<double>(by_hardest.size()));
    all.insert(all.end(), by_hardest.begin(), by_hardest.end());
    for (const auto& [place, state] : some_) {
        all.push_back(static_cast<double>(state.number));
        all.insert(all.end(), state.row.begin(), state.row.end());
    }
    return all;
}

void StepJudge::restore(const std::vector<double>& seen) {
    const std::ptrdiff_t width = 2 * std::ssize(groups_);
    auto at = seen.begin();
    const auto take = [&](std::ptrdiff_t count) {
        std::vector<double> part(at, at + count);
        at += count;
        return part;
    };
    if (std::ssize(seen) < 1 + 2 * width) return;  // nothing was kept yet
    seen_ = std::llround(*at++);
    least_ = take(width);
    most_ = take(width);
    const std::ptrdiff_t by_hardest = std::llround(*at++);
    hardest_.restore(take(by_hardest), static_cast<std::size_t>(1 + width));
    while (seen.end() - at > 1 + width) {
        const std::int64_t number = std::llround(*at++);
        keep(number, take(1 + width));
    }
}

StepJudge::Judgement StepJudge::judge(const Derivation& derivation, const Kernel& kernel,
                                      const TrajectoryRequest& request, const TrajectoryResult& result) const {
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
        const double radians = std::fabs(request.step) * largest_frequency(stepper, time, q, p, scale);
        if (radians > judgement.radians) judgement.radians = radians;
    };
    int looks = 0;
    for (const auto& [place, state] : some_) {
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
    judgement.limit = stability_limit(derivation.quadrature, judgement.radians);

    std::map<std::int64_t, std::vector<double>> in_time;
    for (const auto& [place, state] : some_) in_time.emplace(state.number, state.row);
    States<double> states;
    for (const auto& [number, row] : in_time) states.push_back(row);
    const ErrorEstimate estimate(derivation.quadrature);
    const bool conserves = kernel->has_energy != 0 && derivation.system.autonomous && !derivation.system.has_forces();
    const std::vector<double> energies =
        conserves ? energies_along(derivation, stepper, states, request.parameters) : std::vector<double>();
    Evidence evidence =
        evidence_of(stepper, states, request.parameters, request.step, scale, error_power(derivation.quadrature.method),
                    energies, conserves && derivation.quadrature.method.family == Family::lobatto);
    // Coordinates that rounding alone moves tell nothing, as the radius of a circular orbit.
    std::vector<double> moving = scale;
    bool any_moves = false;
    for (std::size_t k = 0; k < n; ++k) {
        const double way = (most_[k] - least_[k]) / 2, place = std::max(std::fabs(most_[k]), std::fabs(least_[k]));
        if (way > still * place)
            any_moves = true;
        else
            moving[k] = moving[n + k] = std::numeric_limits<double>::infinity();
    }
    if (!any_moves) evidence.certain = 0;
    const SingleSteps single =
        single_steps(stepper, hardest_.states(), request.every, result.time, request.parameters, request.step, moving);
    evidence.certain = std::fmax(evidence.certain, single.error);
    if (single.unresolved)
        judgement.unresolved = {1 + std::llround((*single.unresolved - request.time) / request.step),
                                *single.unresolved};
    const double steps = static_cast<double>(result.steps_done), duration = steps * std::fabs(request.step);
    const double random = std::numeric_limits<double>::epsilon() + request.tolerance;
    judgement.error = std::fmin(1, estimate.after(steps, duration, evidence, random));
    const double way = evidence.rate * duration;
    judgement.neighbours = evidence.growth == 0              ? Neighbours::unknown
                           : evidence.growth > quickly * way ? Neighbours::part_quickly
                                                             : Neighbours::stay;
    return judgement;
}

std::string StepJudge::Judgement::text() const {
    if (error >= 1) return "as large as the motion itself";
    const char* const supposed = neighbours == Neighbours::unknown        ? ", if nearby trajectories stay near"
                                 : neighbours == Neighbours::part_quickly ? "; nearby trajectories diverge quickly"
                                                                          : "";
    return fmt::format("{:.1g} of the amplitude at the end{}", error, supposed);
}

std::string StepJudge::loss(const Judgement& judgement, const TrajectoryRequest& request,
                            const TrajectoryResult& result) {
    return fmt::format(
        "the run is wrong somewhere on its way to its end, t = {:.6g}, q = {}, p = {}: its error is estimated as large "
        "as the motion itself, and the step is beyond the first limit of linear stability: h omega = {:.3g} is more "
        "than {:.4g}, omega the largest frequency met. Try a smaller step, such as h = {:.6g}, or Gauss, which has no "
        "limit.",
        result.time, list_text(result.q), list_text(result.p), judgement.radians, judgement.limit,
        request.step * judgement.limit / judgement.radians / 2);
}

std::vector<std::string> StepJudge::warnings(const Judgement& judgement, double wanted_error) {
    std::vector<std::string> texts;
    if (judgement.radians > judgement.limit)
        texts.push_back(fmt::format(
            "the step is beyond the linear stability limit: h omega = {:.3g} is more than {:.4g}, omega the largest "
            "frequency met. Take a step below {:.2g} times this one, or Gauss, which has no limit",
            judgement.radians, judgement.limit, judgement.limit / judgement.radians));
    if (judgement.unresolved)
        texts.push_back(fmt::format(
            "in step {}, from t = {:.6g} on, the motion is not resolved: half the step leads to another place, or the "
            "step jumps over a singularity. Take a shorter step, or coordinates without a singularity there",
            judgement.unresolved->step, judgement.unresolved->time));
    if (wanted_error > 0 && judgement.error > far * wanted_error)
        texts.push_back(fmt::format(
            "the scene asks for an error of {:.2g}, and it is probably near {:.1g}; `lobatto tune` chooses a step",
            wanted_error, judgement.error));
    return texts;
}

}  // namespace lobatto
