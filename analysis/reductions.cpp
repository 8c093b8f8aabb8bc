// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/reductions.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace lobatto {

namespace {

const double none = KeptNumber::none;

Kept kept_of(Reduction::Of of) {
    switch (of) {
        case Reduction::Of::first:
            return Kept::first;
        case Reduction::Of::count:
            return Kept::count;
        case Reduction::Of::max:
            return Kept::max;
        case Reduction::Of::min:
            return Kept::min;
        case Reduction::Of::mean:
            return Kept::mean;
        case Reduction::Of::last:
            break;
    }
    return Kept::last;
}

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

Reductions::Reductions(const Scene& scene, const ClockedSteps& clocked)
    : n_(scene.coordinates.size()), parameters_(scene.parameters.size()), clocked_(clocked) {
    const std::vector<GiNaC::symbol> variables = variables_of(scene);
    variables_.resize(variables.size());
    if (clocked.step != 0) rate_ = Tape::of(clocked.rate, variables);
    for (const Reduction& kept : scene.outputs.kept) {
        Part part{kept_of(kept.of), kept.event, std::nullopt};
        if (part.of != Kept::first && part.of != Kept::count) {
            const GiNaC::ex value = scene.along_motion(kept.value);
            part.formula = Tape::of(value, variables);
            if (!part.formula) throw InputError(fmt::format("{}: cannot be evaluated along a trajectory", kept.text));
            needs_energy_ = needs_energy_ || value.has(scene.outputs.energy_of_kept);
            for (const Coordinate& coordinate : scene.coordinates)
                needs_velocity_ = needs_velocity_ || value.has(coordinate.velocity);
        }
        parts_.push_back(part);
    }
}

void Reductions::begin(const LoadedStepper<double>& stepper, const EnsembleStart& start) {
    stepper_ = &stepper;
    std::copy(start.parameters.begin(), start.parameters.end(), variables_.begin());
    has_begun_ = false;
    for (Part& part : parts_) {
        part.number.begin(part.of);
        part.mean.begin(clocked_.step);
    }
    arrived_ = 0;
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
        if (!has_begun_) first_time_ = row[0];
        const bool is_asked = is_arrival(row[0]);
        for (Part& part : parts_) {
            if (!part.formula) continue;
            const double value = (*part.formula)(variables_);
            part.number.observe(part.of, value, row[0] - last_time_, !has_begun_);
            if (rate_ && part.of == Kept::mean) part.mean.observe(row[0], value, (*rate_)(variables_), is_asked);
        }
        last_time_ = row[0];
        has_begun_ = true;
    }
}

// Of a motion with a clock: whether a state is one of those that are asked for at equal times.
bool Reductions::is_arrival(double time) {
    if (!rate_ || time != time_after(clocked_, arrived_)) return false;
    ++arrived_;
    return true;
}

void Reductions::observe_events(const double* rows, std::int64_t count) {
    const std::size_t columns = 2 + 2 * n_;
    for (std::int64_t i = 0; i < count; ++i) {
        const double* const row = rows + static_cast<std::size_t>(i) * columns;
        for (Part& part : parts_) {
            if (!part.formula && part.event == static_cast<std::size_t>(row[0]))
                part.number.observe_event(part.of, row[1]);
        }
    }
}

std::vector<double> Reductions::values() const {
    std::vector<double> values;
    for (const Part& part : parts_)
        values.push_back(rate_ && part.of == Kept::mean ? part.mean.result()
                                                        : part.number.result(part.of, last_time_ - first_time_));
    return values;
}

std::string Reductions::text() const {
    std::string of, events, formulas;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
        const Part& part = parts_[i];
        of += fmt::format("{}Kept({})", i == 0 ? "" : ", ", static_cast<int>(part.of));
        events += fmt::format("{}{}", i == 0 ? "" : ", ", part.formula ? -1 : static_cast<int>(part.event));
        if (!part.formula) continue;
        formulas += "        {\n" + part.formula->text(fmt::format("values[{}]", i), "            ") + "        }\n";
    }
    return fmt::format(
        "namespace lobatto {{\n"
        "struct KeptFormulas {{\n"
        "    static constexpr int parts = {0};\n"
        "    static constexpr bool needs_velocity = {1}, needs_energy = {2};\n"
        "    LOBATTO_DEVICE static Kept of(int part) {{\n"
        "        constexpr Kept all[] = {{{3}}};\n"
        "        return all[part];\n"
        "    }}\n"
        "    LOBATTO_DEVICE static int event(int part) {{\n"
        "        constexpr int all[] = {{{4}}};\n"
        "        return all[part];\n"
        "    }}\n"
        "    LOBATTO_DEVICE static void values([[maybe_unused]] const double* x, [[maybe_unused]] double* values) {{\n"
        "{5}"
        "    }}\n"
        "}};\n"
        "}}  // namespace lobatto\n",
        parts_.size(), needs_velocity_, needs_energy_, of, events, formulas);
}

}  // namespace lobatto
