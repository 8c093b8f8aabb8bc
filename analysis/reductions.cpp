// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/reductions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lobatto {

namespace {

const double none = std::numeric_limits<double>::quiet_NaN();

std::vector<GiNaC::symbol> variables_of(const Scene& scene) {
    std::vector<GiNaC::symbol> all;
    for (const Parameter& parameter : scene.parameters) all.push_back(parameter.symbol);
    all.push_back(scene.time);
    for (const Coordinate& coordinate : scene.coordinates) all.push_back(coordinate.position);
    for (const Coordinate& coordinate : scene.coordinates) all.push_back(coordinate.velocity);
    const std::vector<GiNaC::symbol>& momenta = scene.outputs.momenta_of_kept;
    all.insert(all.end(), momenta.begin(), momenta.end());
    all.push_back(scene.outputs.energy_of_kept);
    return all;
}

}  // namespace

Reductions::Reductions(const Scene& scene) : n_(scene.coordinates.size()), parameters_(scene.parameters.size()) {
    const std::vector<GiNaC::symbol> variables = variables_of(scene);
    variables_.resize(variables.size());
    for (const Reduction& kept : scene.outputs.kept) {
        Part part{kept.of, kept.event, std::nullopt};
        if (kept.of != Reduction::Of::first && kept.of != Reduction::Of::count) {
            part.formula = Tape::of(kept.value, variables);
            if (!part.formula) throw InputError(fmt::format("{}: cannot be evaluated along a trajectory", kept.text));
            needs_energy_ = needs_energy_ || kept.value.has(scene.outputs.energy_of_kept);
            for (const Coordinate& coordinate : scene.coordinates)
                needs_velocity_ = needs_velocity_ || kept.value.has(coordinate.velocity);
        }
        parts_.push_back(part);
    }
}

void Reductions::begin(const LoadedStepper<double>& stepper, const EnsembleStart& start) {
    stepper_ = &stepper;
    std::copy(start.parameters.begin(), start.parameters.end(), variables_.begin());
    has_begun_ = false;
    for (Part& part : parts_) part.value = part.of == Reduction::Of::count || part.of == Reduction::Of::mean ? 0 : none;
}

void Reductions::observe(const double* rows, std::int64_t count) {
    const std::size_t columns = 1 + 2 * n_;
    for (std::int64_t i = 0; i < count; ++i) {
        const double* const row = rows + static_cast<std::size_t>(i) * columns;
        q_.assign(row + 1, row + 1 + n_);
        p_.assign(row + 1 + n_, row + columns);
        double energy = none;
        if (!needs_velocity_ || stepper_->velocity(row[0], q_, p_, v_) != LOBATTO_OK) v_.assign(n_, none);
        if (needs_energy_ && stepper_->energy(row[0], q_, p_, energy) != LOBATTO_OK) energy = none;
        auto at = variables_.begin() + static_cast<std::ptrdiff_t>(parameters_);
        *at++ = row[0];
        at = std::copy(q_.begin(), q_.end(), at);
        at = std::copy(v_.begin(), v_.end(), at);
        at = std::copy(p_.begin(), p_.end(), at);
        *at = energy;
        for (Part& part : parts_)
            if (part.formula) look(part, (*part.formula)(variables_), row[0]);
        if (!has_begun_) first_time_ = row[0];
        last_time_ = row[0];
        has_begun_ = true;
    }
}

void Reductions::look(Part& part, double value, double time) const {
    if (part.of == Reduction::Of::last || std::isnan(value)) part.value = value;
    if (part.of == Reduction::Of::max && !(part.value >= value) && !(has_begun_ && std::isnan(part.value)))
        part.value = value;
    if (part.of == Reduction::Of::min && !(part.value <= value) && !(has_begun_ && std::isnan(part.value)))
        part.value = value;
    if (part.of == Reduction::Of::mean && has_begun_) part.value += (time - last_time_) * (value + part.before) / 2;
    part.before = value;
}

void Reductions::observe_events(const double* rows, std::int64_t count) {
    const std::size_t columns = 2 + 2 * n_;
    for (std::int64_t i = 0; i < count; ++i) {
        const double* const row = rows + static_cast<std::size_t>(i) * columns;
        for (Part& part : parts_) {
            if (part.formula || part.event != static_cast<std::size_t>(row[0])) continue;
            if (part.of == Reduction::Of::count) ++part.value;
            if (part.of == Reduction::Of::first && std::isnan(part.value)) part.value = row[1];
        }
    }
}

std::vector<double> Reductions::values() const {
    std::vector<double> values;
    for (const Part& part : parts_) {
        const bool is_mean = part.of == Reduction::Of::mean && last_time_ != first_time_;
        values.push_back(is_mean                          ? part.value / (last_time_ - first_time_)
                         : part.of == Reduction::Of::mean ? part.before
                                                          : part.value);
    }
    return values;
}

}  // namespace lobatto
