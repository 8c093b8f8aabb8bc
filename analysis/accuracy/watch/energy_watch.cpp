// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/watch/energy_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "analysis/accuracy/companion/at_rest.hpp"
#include "analysis/accuracy/watch/exact_energy.hpp"

namespace lobatto {

namespace {

constexpr std::size_t most_states = 16;  // for the mean kinetic energy
constexpr double departed = 0.5;         // of it
constexpr double walk = 2;               // times the rms of a random walk
constexpr int fewest_states = 3;         // of a mean of some
constexpr double coarse = 0.05;          // third differences of the energy over second ones
constexpr double most_energy = 1e300;    // sums of it stay numbers
constexpr double a_rounding = 0x1p-52;   // of what the energy is computed from: below it no double can tell

struct State {
    double time;
    std::vector<double> q, p, v;  // v is empty where momenta determine none
    std::vector<double> v_later;  // about what the force of a step makes of it: at turning points v tells nothing
};
State state_of(const LoadedStepper<double>& stepper, const std::vector<double>& row, double step) {
    const auto middle = row.begin() + 1 + std::ssize(row) / 2;
    State state{row[0], {row.begin() + 1, middle}, {middle, row.end()}, {}, {}};
    if (stepper.velocity(state.time, state.q, state.p, state.v) != LOBATTO_OK) state.v.clear();
    if (state.v.empty()) return state;
    std::vector<double> momentum, force, kicked = state.p;
    stepper.slopes(state.time, state.q, state.v, momentum, force);
    for (std::size_t k = 0; k < kicked.size(); ++k) kicked[k] += step * force[k];
    if (stepper.velocity(state.time, state.q, kicked, state.v_later) != LOBATTO_OK) state.v_later = state.v;
    return state;
}

// Whether from one double to the next the energy changes as no parabola does, for one of the positions, at all these
// states: its rounding is larger than the shape of the potential, as at 1e17 radians of a pendulum.
bool is_too_coarse(ExactEnergy& energy, const std::vector<State>& states, double step) {
    const auto may_be = [&](std::size_t k) {
        return std::all_of(states.begin(), states.end(), [&](const State& state) {
            return !state.v.empty() && std::fabs(state.q[k]) > 1e10 * std::fabs(step * state.v[k]) &&
                   std::fabs(state.q[k]) > 1e10 * std::fabs(step * state.v_later[k]);
        });
    };
    for (std::size_t k = 0; k < states.front().q.size(); ++k) {
        if (!may_be(k)) continue;
        cln::cl_R second = 0, third = 0;
        for (const State& state : states) {
            std::vector<double> q = state.q;
            std::vector<cln::cl_R> H;
            for (int j = 0; j < 8; ++j, q[k] = std::nextafter(q[k], HUGE_VAL))
                if (const auto here = energy.at(q, state.v)) H.push_back(here->value);
            for (std::size_t j = 3; j < H.size(); ++j) {
                const cln::cl_R bend = H[j] - 2 * H[j - 1] + H[j - 2], before = H[j - 1] - 2 * H[j - 2] + H[j - 3];
                second = second + square(bend);
                third = third + square(bend - before);
            }
        }
        if (third > cln::rational(cln::cl_R(coarse * coarse)) * second) return true;
    }
    return false;
}

// What rounding in so many steps, a random walk of each position, does to the energy; of the velocity as much again.
cln::cl_R rounding_of(ExactEnergy& energy, const State& state, double steps) {
    cln::cl_R change = 0;
    const auto here = energy.at(state.q, state.v);
    for (std::size_t k = 0; here && k < state.q.size(); ++k)
        for (const double sign : {-1.0, 1.0}) {
            std::vector<double> q = state.q;
            q[k] += sign * walk * std::sqrt(1 + steps) * a_rounding * std::fabs(q[k]);
            if (const auto there = energy.at(q, state.v, true)) change = change + cln::abs(there->value - here->value);
        }
    return change;
}

// Kinetic energies at some times of a run, and at those where its energy error has doubled.
struct KineticCourse {
    double begin;
    std::vector<std::pair<double, double>> some, leaving;  // time, energy

    bool is_until(double end, double time) const { return std::fabs(time - begin) <= std::fabs(end - begin); }
    // The start is no moment like others: it does not count. Nothing of a few.
    std::optional<double> mean_until(double end) const {
        double sum = 0;
        int states = 0;
        for (std::size_t i = 1; i < some.size(); ++i)
            if (some[i].second > 0 && is_until(end, some[i].first)) sum += some[i].second, ++states;
        return states >= fewest_states ? std::optional(sum / states) : std::nullopt;
    }
    double largest_until(double end) const {
        double largest = 0;
        for (const auto* course : {&some, &leaving})
            for (const auto& [time, moving] : *course)
                if (is_until(end, time)) largest = std::fmax(largest, moving);
        return largest;
    }
};

constexpr double halved = 0.5, off_dead_points = 0.47;  // a half of the step may end at the dead point, too

std::string why(const Scene& scene, double step, bool jumps, bool too_coarse) {
    const auto jump = std::find_if(scene.switches.begin(), scene.switches.end(), [&](const Switch& one) {
        return one.may_jump && !one.refracts && scene.lagrangian.has(one.side);
    });
    if (jump != scene.switches.end() && !jumps)
        return fmt::format(
            "The step is too long for the forces met there, or the Lagrangian jumps where it goes from one piece to "
            "another ({}): try a smaller step, such as h = {:.6g}; both pieces need one value there.",
            jump->text, step / 2);
    if (jump != scene.switches.end())
        return fmt::format(
            "The Lagrangian jumps where it goes from one piece to another ({}), which no motion follows, or the step "
            "is too long: write it so that both pieces have one value there, or try a smaller step, such as h = "
            "{:.6g}.",
            jump->text, step / 2);
    if (too_coarse)
        return "Positions are so large that the potential changes its shape from one number to the next. Try to "
               "measure positions from a place nearer to the motion.";
    return fmt::format(
        "The step is too long for the method to be stable or for the forces met there, or it has gone past a "
        "singularity of the potential{}. Try a smaller step, such as h = {:.6g}, an earlier end, or start elsewhere.",
        scene.constraints.empty() ? "" : ", or past a place where constraints depend on one another (a dead point)",
        (scene.constraints.empty() ? halved : off_dead_points) * step);
}

}  // namespace

bool EnergyWatch::can_watch(const Outline& outline) {
    return outline.conserves_energy() && outline.system.q.size() <= ExactEnergy::most_coordinates;
}

EnergyWatch::EnergyWatch(const Outline& outline, const Kernel& kernel)
    : watches_(kernel->has_energy != 0 && can_watch(outline)),
      columns_(1 + 2 * outline.system.q.size()),
      rows_a_step_(1 + outline.scene.outputs.dense),
      some_(most_states) {}

void EnergyWatch::observe(const Records& records) {
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
        some_.observe((seen_ - 1) / rows_a_step_, row, columns_);
    }
}

std::vector<double> EnergyWatch::save() const {
    std::vector<double> all{static_cast<double>(seen_), energy_start_, energy_error_, static_cast<double>(lost_),
                            static_cast<double>(leaving_.size())};
    for (const std::vector<double>& row : leaving_) all.insert(all.end(), row.begin(), row.end());
    some_.save(all);
    return all;
}

void EnergyWatch::restore(const std::vector<double>& saved) {
    auto at = saved.begin();
    seen_ = std::llround(*at++);
    energy_start_ = *at++;
    energy_error_ = *at++;
    lost_ = *at++ != 0;
    const auto leaving = static_cast<std::size_t>(std::llround(*at++));
    for (; leaving_.size() < leaving; at += static_cast<std::ptrdiff_t>(columns_))
        leaving_.emplace_back(at, at + static_cast<std::ptrdiff_t>(columns_));
    some_.restore(saved.data() + (at - saved.begin()), saved.data() + saved.size(), columns_);
}

EnergyWatch::States EnergyWatch::rows_of_some() const {
    States rows;
    for (SomeStates::State& state : some_.in_order()) rows.push_back(std::move(state.row));
    return rows;
}

// In 60 digits: of small motions the energy in double is rounding.
std::string EnergyWatch::departure(const Outline& outline, const Kernel& kernel, const TrajectoryRequest& request,
                                   bool jumps) const {
    LoadedStepper<double> stepper(kernel);
    if (leaving_.size() < 2 || stepper.prepare(request.parameters, request.step) != LOBATTO_OK ||
        is_at_rest(outline.system, rows_of_some(), request.parameters, kernel->epsilon))
        return "";
    ExactEnergy energy(outline, request.parameters);
    const auto energy_of = [&](const State& state) {
        return state.v.empty() ? std::nullopt : energy.at(state.q, state.v);
    };
    const auto kinetic_of = [&](const State& state) {
        const auto here = energy_of(state);
        return here && here->moving ? std::min(std::fabs(cln::double_approx(*here->moving)), most_energy) : 0;
    };
    std::vector<State> some;
    KineticCourse course{request.time, {}, {}};
    for (const std::vector<double>& row : rows_of_some()) {
        some.push_back(state_of(stepper, row, request.step));
        course.some.emplace_back(row[0], kinetic_of(some.back()));
    }
    const auto start = energy_of(state_of(stepper, leaving_.front(), request.step));
    const double mean = course.mean_until(HUGE_VAL).value_or(course.largest_until(HUGE_VAL));
    if (!start || !(mean > 0)) return "";
    const bool too_coarse = is_too_coarse(energy, some, request.step);
    struct Departure {
        State state;
        std::optional<cln::cl_R> error;  // none: the energy is not real
    };
    const auto first_beyond = [&](const auto& scale_of) -> std::optional<Departure> {
        for (const std::vector<double>& row : leaving_) {
            const State state = state_of(stepper, row, request.step);
            if (state.v.empty()) continue;  // nothing can be told
            const auto here = energy_of(state);
            if (!here) return Departure{state, std::nullopt};
            const cln::cl_R error = cln::abs(here->value - start->value);
            if (error < cln::cl_R(departed * scale_of(state))) continue;
            const double steps = std::fabs((state.time - request.time) / request.step);
            if (!too_coarse &&
                error <= cln::max(cln::rational(cln::cl_R(a_rounding)) * here->size, rounding_of(energy, state, steps)))
                continue;
            return Departure{state, error};
        }
        return std::nullopt;
    };
    if (!first_beyond([&](const State&) { return mean; })) return "";
    // The mean of all may come from what is wrong; when that began is told by the mean until then, or of few states by
    // the largest.
    for (const std::vector<double>& row : leaving_)
        course.leaving.emplace_back(row[0], kinetic_of(state_of(stepper, row, request.step)));
    const auto scale_at = [&](const State& state) {
        const auto until_then = course.mean_until(state.time);
        const double known = until_then ? std::max(*until_then, kinetic_of(state)) : course.largest_until(state.time);
        return known > 0 ? std::min(mean, known) : mean;
    };
    const auto [state, error] = *first_beyond(scale_at);
    return fmt::format(
        "the run is wrong {} on, at t = {:.6g}, q = {}, p = {}: the energy, which the motion conserves, {}. {}",
        outline.scene.clock ? "from there"
                            : fmt::format("{}from step {}", request.every > 1 ? "at the latest " : "",
                                          std::llround((state.time - request.time) / request.step)),
        state.time, list_text(state.q), list_text(state.p),
        error ? fmt::format("is off there by {:.2g} of the mean kinetic energy{}",
                            cln::double_approx(*error) / scale_at(state), scale_at(state) < mean ? " until then" : "")
              : "is no real number there",
        why(outline.scene, request.step, jumps, too_coarse));
}

}  // namespace lobatto
