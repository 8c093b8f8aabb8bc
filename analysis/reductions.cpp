// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/reductions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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

void ClockedMean::begin(double step) {
    *this = {};
    step_ = step;
}

void ClockedMean::go_to(const Point& end) {
    sum_ += (end_->value * end_->rate + end.value * end.rate) / 2;
    weight_ += (end_->rate + end.rate) / 2;
    end_ = end;
}

// Of the states since then some that are asked for may be ends of steps, too: those that are nearest to them. If the
// last one is no end, it stays.
void ClockedMean::pass_steps(bool last_is_end) {
    const Point begin = *end_;
    const auto way_to = [&](std::size_t i) { return way(i == 0 ? begin : since_[i - 1], since_[i]); };
    double whole = 0, gone = 0;
    for (std::size_t i = 0; i < since_.size(); ++i) whole += way_to(i);
    const auto steps = std::max(1L, std::lround(whole / step_));
    const double length = last_is_end ? whole / static_cast<double>(steps) : step_;
    std::size_t passed = 0;
    long ended = 1;
    for (std::size_t i = 0; i + 1 < since_.size() && ended < steps; ++i) {
        gone += way_to(i);
        const double end = static_cast<double>(ended) * length;
        if (std::fabs(gone - end) > std::fabs(gone + way_to(i + 1) - end)) continue;
        go_to(since_[i]);
        passed = i + 1;
        ++ended;
    }
    if (last_is_end) go_to(since_.back());
    since_.erase(since_.begin(), last_is_end ? since_.end() : since_.begin() + static_cast<std::ptrdiff_t>(passed));
}

void ClockedMean::observe(double time, double value, double rate, bool is_asked) {
    if (!first_) {
        first_ = end_ = Point{time, value, rate};
        return;
    }
    if (!last_is_asked_) pass_steps(true);
    since_.push_back({time, value, rate});
    last_is_asked_ = is_asked;
}

double ClockedMean::result() const {
    if (!first_ || since_.empty()) return first_ ? first_->value : KeptNumber::none;
    ClockedMean all = *this;
    all.pass_steps(false);
    const Point &end = *all.end_, &last = all.since_.back();
    const double whole = end.time - first_->time, rest = last.time - end.time,
                 of_rest = (end.value * end.rate + last.value * last.rate) / (end.rate + last.rate);
    return ((all.weight_ > 0 ? all.sum_ / all.weight_ * whole : 0) + of_rest * rest) / (whole + rest);
}

Reductions::Reductions(const Scene& scene, const ClockedSteps& clocked)
    : n_(scene.coordinates.size()),
      parameters_(scene.parameters.size()),
      arrivals_(clocked.arrivals),
      step_(clocked.step) {
    const std::vector<GiNaC::symbol> variables = variables_of(scene);
    variables_.resize(variables.size());
    if (step_ != 0) rate_ = Tape::of(clocked.rate, variables);
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
        part.mean.begin(step_);
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
    if (arrivals_.interval == 0) return false;
    double next = first_time_ + static_cast<double>(arrived_) * arrivals_.interval;
    if ((next - arrivals_.end) * arrivals_.interval > 0) next = arrivals_.end;
    if (time != next) return false;
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
