// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/energy_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/exact_energy.hpp"
#include "cli/summary.hpp"

namespace lobatto {

namespace {

constexpr std::size_t most_states = 8;  // for the mean kinetic energy
constexpr double departed = 0.5;        // of it
constexpr double a_rounding = 0x1p-52;  // of what the energy is computed from: below it no double can tell

struct State {
    double time;
    std::vector<double> q, p, v;  // v is empty where momenta determine none
};
State state_of(const LoadedStepper<double>& stepper, const std::vector<double>& row) {
    const auto middle = row.begin() + 1 + std::ssize(row) / 2;
    State state{row[0], {row.begin() + 1, middle}, {middle, row.end()}, {}};
    if (stepper.velocity(state.time, state.q, state.p, state.v) != LOBATTO_OK) state.v.clear();
    return state;
}

// Whether a step moves a coordinate by less than its rounding.
bool is_too_coarse(const State& state, double step) {
    for (std::size_t k = 0; k < state.v.size(); ++k)
        if (std::fabs(step * state.v[k]) < 0x1p-53 * std::fabs(state.q[k])) return true;
    return false;
}

std::string why(const State& state, double step) {
    if (is_too_coarse(state, step))
        return fmt::format(
            "Positions are so large that a step moves one of them by less than its rounding. Try to measure positions "
            "from a place nearer to the motion.");
    return fmt::format(
        "The step is too long for the method to be stable or for the forces met there, or it has gone past a "
        "singularity of the potential. Try a smaller step, such as h = {:.6g}, an earlier end, or start elsewhere.",
        step / 2);
}

}  // namespace

EnergyWatch::EnergyWatch(const Derivation& derivation, const Kernel& kernel)
    : watches_(kernel->has_energy != 0 && derivation.system.autonomous && !has_forces(derivation) &&
               derivation.system.q.size() <= ExactEnergy::most_coordinates),
      columns_(1 + 2 * derivation.system.q.size()),
      rows_a_step_(1 + derivation.scene.outputs.dense) {}

void EnergyWatch::look(const Records& records) {
    if (!watches_) return;
    for (std::int64_t i = 0; i < records.count; ++i) {
        if (seen_++ % rows_a_step_ != 0) continue;
        const double* const row = records.rows + static_cast<std::size_t>(i) * columns_;
        if (leaving_.empty()) energy_start_ = records.energy[i];
        const double error = std::fabs(records.energy[i] - energy_start_);
        const bool first_lost = std::isnan(error) && !lost_;
        if (leaving_.empty() || error > 2 * energy_error_ || first_lost) {
            leaving_.emplace_back(row, row + columns_);
            if (first_lost)
                lost_ = true;
            else
                energy_error_ = error;
        }
        if ((seen_ - 1) / rows_a_step_ % stride_ != 0) continue;
        some_.emplace_back(row, row + columns_);
        if (some_.size() < 2 * most_states) continue;
        for (std::size_t j = 0; j < most_states; ++j) some_[j] = some_[2 * j];  // every other one
        some_.resize(most_states);
        stride_ *= 2;
    }
}

std::vector<double> EnergyWatch::seen() const {
    std::vector<double> all{
        static_cast<double>(seen_), static_cast<double>(stride_),        energy_start_, energy_error_,
        static_cast<double>(lost_), static_cast<double>(leaving_.size())};
    for (const Rows& rows : {leaving_, some_})
        for (const std::vector<double>& row : rows) all.insert(all.end(), row.begin(), row.end());
    return all;
}

void EnergyWatch::go_on_after(const std::vector<double>& seen) {
    auto at = seen.begin();
    seen_ = std::llround(*at++);
    stride_ = std::llround(*at++);
    energy_start_ = *at++;
    energy_error_ = *at++;
    lost_ = *at++ != 0;
    const auto leaving = static_cast<std::size_t>(std::llround(*at++));
    for (; at < seen.end(); at += static_cast<std::ptrdiff_t>(columns_))
        (leaving_.size() < leaving ? leaving_ : some_).emplace_back(at, at + static_cast<std::ptrdiff_t>(columns_));
}

// In 60 digits: of small motions the energy in double is rounding.
std::string EnergyWatch::departure(const Derivation& derivation, const Kernel& kernel,
                                   const TrajectoryRequest& request) const {
    LoadedStepper<double> stepper(kernel);
    if (leaving_.size() < 2 || stepper.prepare(request.parameters, request.step) != LOBATTO_OK) return "";
    ExactEnergy energy(derivation, request.parameters);
    const auto energy_of = [&](const State& state) {
        return state.v.empty() ? std::nullopt : energy.at(state.q, state.v);
    };
    // The start is no moment like others: it counts where there is nothing else.
    double kinetic = 0, at_start = 0;
    int states = 0;
    for (std::size_t i = 0; i < some_.size(); ++i)
        if (const auto here = energy_of(state_of(stepper, some_[i])); here && here->moving) {
            (i == 0 ? at_start : kinetic) += std::fabs(cln::double_approx(*here->moving));
            states += i == 0 ? 0 : 1;
        }
    kinetic = states > 0 ? kinetic / states : at_start;
    const auto start = energy_of(state_of(stepper, leaving_.front()));
    if (!start || !(kinetic > 0)) return "";
    for (const std::vector<double>& row : leaving_) {
        const State state = state_of(stepper, row);
        if (state.v.empty()) continue;  // nothing can be told
        const auto here = energy_of(state);
        const double error = here ? std::fabs(cln::double_approx(here->value - start->value)) : HUGE_VAL;
        if (here && !(error >= departed * kinetic && error > a_rounding * cln::double_approx(here->size))) continue;
        return fmt::format(
            "the run is wrong from step {} on, at t = {:.6g}, q = {}, p = {}: the energy, which the motion conserves, "
            "{}. {}",
            std::llround((state.time - request.time) / request.step), state.time, list_text(state.q),
            list_text(state.p),
            here ? fmt::format("is off there by {:.2g} of the mean kinetic energy", error / kinetic)
                 : "is no real number there",
            why(state, request.step));
    }
    return "";
}

}  // namespace lobatto
