// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/sweep/starts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/exact_start.hpp"
#include "analysis/method_choice.hpp"
#include "generator/mechanics/start.hpp"
#include "runtime/run/parts.hpp"

namespace lobatto {

namespace {

constexpr double most_trajectories = 1e12;
constexpr std::int64_t most_settings = 10'000;

using Role = VariedName::Role;

[[noreturn]] void varied_twice(const std::string& vary, const std::string& name) {
    const std::string message = fmt::format("'{}' is varied twice; give all its values at once", name);
    if (vary.empty()) throw InputError(message);
    Source("--vary", vary).fail({1, 1}, message);
}

bool is_family(Role role) {
    return role == Role::points || role == Role::stages || role == Role::splitting;
}

}  // namespace

SweepStarts::SweepStarts(const Scene& scene, const StartsRequest& request, std::recursive_mutex& algebra)
    : scene_(scene),
      seed_(request.seed),
      parts_(static_cast<std::size_t>(lobatto::parts_of(scene.method.numbers))),
      algebra_(algebra) {
    std::vector<Axis> axes;
    for (const std::string& argument : request.vary) axes.push_back(read_axis(scene, argument));
    add_axes(axes, request.zip, true);
    const std::size_t settings = dimensions_.size();
    if (request.table) add_table(*request.table);
    if (!request.file.empty()) add_table(read_starts(scene, request.file));
    add_axes(axes, request.zip, false);
    add_draws(request);
    count_all();
    of_setting_ = settings == 0 ? count_ : dimensions_[settings - 1].stride;
    if (settings > 0 && count_ / of_setting_ > most_settings)
        throw InputError(
            fmt::format("--vary: {} settings of the method; each is a sweep of its own, so at most {}: "
                        "give fewer values",
                        count_ / of_setting_, most_settings));
    if (scene.run.assemble && !scene.constraints.empty()) {
        if (scene.start == Start::momentum)
            throw InputError(fmt::format(
                "{}: sweeps assemble starts by their velocities: give velocities in place of momenta", scene.path));
        assembled_ = build_system(scene);
    }
    find_dependents();
    check_orientations();
}

// The lists of settings, or the others. Those that run together are one dimension, which counts as one of settings
// when one of them is.
void SweepStarts::add_axes(std::vector<Axis>& axes, bool zip, bool settings) {
    const bool any_setting =
        std::any_of(axes.begin(), axes.end(), [](const Axis& axis) { return axis.of.is_setting(); });
    if (zip && axes.size() < 2)
        throw InputError("--zip: lists that run together are two or more; give --vary twice, or leave --zip out");
    const auto shortest_first = [](const Axis& a, const Axis& b) { return a.count < b.count; };
    if (zip) {
        const auto [shortest, longest] = std::minmax_element(axes.begin(), axes.end(), shortest_first);
        if (shortest->count != longest->count)
            throw InputError(
                fmt::format("--zip: lists that run together are equally long, but {} has {} values and {} has {}",
                            shortest->of.name, shortest->count, longest->of.name, longest->count));
    }
    for (Axis& axis : axes) {
        if ((zip ? any_setting : axis.of.is_setting()) != settings) continue;
        if (!zip || &axis == &axes.front()) dimensions_.push_back({axis.count});
        sources_.emplace_back("vary", axis.of.name + " = " + axis.written);
        Values values{dimensions_.size() - 1, std::nullopt, {}, std::nullopt};
        const VariedName name = axis.of;
        const std::string written = axis.written;
        values.axis.emplace(std::move(axis));
        add(name, written, std::move(values));
    }
    if (zip && settings == any_setting) sources_.emplace_back("zip", "lists run together");
}

void SweepStarts::add_table(StartTable table) {
    dimensions_.push_back({table.rows});
    if (!table.digest.empty()) sources_.emplace_back("starts", fmt::format("{} rows of {}", table.rows, table.digest));
    for (std::size_t c = 0; c < table.names.size(); ++c) {
        const auto fail = [&](const std::string& message) {
            throw InputError(table.path.empty() ? message : fmt::format("--starts: {}: {}", table.path, message));
        };
        const VariedName name = varied_name(scene_, table.names[c], "column", fail);
        if (name.is_setting())
            fail(fmt::format("'{}' is a setting of the method and no start: `lobatto sweep --vary` varies it",
                             name.name));
        add(name, table.path, {dimensions_.size() - 1, std::nullopt, std::move(table.columns[c]), std::nullopt});
    }
}

void SweepStarts::add_draws(const StartsRequest& request) {
    if (request.random && (*request.random < 1 || static_cast<double>(*request.random) > most_trajectories))
        throw InputError(fmt::format("--random: {} is not a number of rows; give one from 1 to {:.0e}", *request.random,
                                     most_trajectories));
    if (request.random && request.draw.empty())
        throw InputError("--random: nothing is drawn; say what, such as --draw \"q ~ normal(0, 0.1)\"");
    if (!request.random && !request.draw.empty())
        throw InputError("--draw: say how many rows are drawn, such as --random 1000 --seed 1");
    if (!request.random) return;
    dimensions_.push_back({*request.random});
    sources_.emplace_back("random", fmt::format("{} rows of each combination, seed {}", *request.random, request.seed));
    for (const std::string& argument : request.draw) {
        const Draw draw = read_draw(scene_, argument);
        sources_.emplace_back("draw", draw.of.name + " ~ " + draw.written);
        add(draw.of, draw.written, {dimensions_.size() - 1, std::nullopt, {}, draw});
    }
}

void SweepStarts::add(const VariedName& name, const std::string& written, Values values) {
    for (const Column& other : columns_) {
        if (other.of.role == name.role && other.of.index == name.index)
            varied_twice(values.axis ? name.name + "=" + values.axis->axis().written : "", name.name);
        if (is_family(other.of.role) && is_family(name.role))
            throw InputError(
                fmt::format("--vary: {} and {} are of two families; vary one of both", other.of.name, name.name));
    }
    columns_.push_back({name, written});
    values_.push_back(std::move(values));
}

void SweepStarts::count_all() {
    double trajectories = 1;
    for (const Dimension& dimension : dimensions_) trajectories *= static_cast<double>(dimension.count);
    if (trajectories > most_trajectories)
        throw InputError(
            fmt::format("--vary: all combinations make {:.3g} trajectories; at most {:.0e}: give fewer values",
                        trajectories, most_trajectories));
    for (std::size_t d = dimensions_.size(); d-- > 0;) {
        dimensions_[d].stride = count_;
        count_ *= dimensions_[d].count;
    }
}

bool SweepStarts::varies(VariedName::Role role, std::size_t index) const {
    return std::any_of(columns_.begin(), columns_.end(),
                       [&](const Column& column) { return column.of.role == role && column.of.index == index; });
}

// The start of the scene; what is varied, or follows from it, is replaced for each trajectory.
void SweepStarts::find_dependents() {
    for (const Parameter& parameter : scene_.parameters) {
        exact_base_.parameters.push_back(scene_.evaluate(parameter.value, "the parameter " + parameter.name));
        base_.parameters.push_back(exact_base_.parameters.back().to_double());
    }
    std::vector<GiNaC::symbol> symbols;
    for (const Parameter& parameter : scene_.parameters) symbols.push_back(parameter.symbol);
    for (const Requirement& requirement : scene_.requirements)
        if (std::any_of(columns_.begin(), columns_.end(), [&](const Column& column) {
                return column.of.role == Role::parameter && requirement.value.has(symbols[column.of.index]);
            }))
            required_.push_back(
                {Tape::of(requirement.value, symbols).value(), requirement.may_vanish, requirement.complaint});
    const auto put = [&](Role role, std::size_t k, const GiNaC::ex& value, const std::string& what,
                         std::vector<double>& numbers, std::vector<GiNaC::numeric>& exact_numbers) {
        bool depends = false;
        for (const Column& column : columns_)
            depends =
                depends || (column.of.role == Role::parameter && value.has(scene_.parameters[column.of.index].symbol));
        const bool given = varies(role, k);
        if (depends && !given) dependents_.push_back({role == Role::position, k});
        const bool is_replaced = depends || given;
        exact_numbers.push_back(is_replaced ? GiNaC::numeric(0)
                                            : scene_.evaluate(value, what + scene_.coordinates[k].name));
        numbers.push_back(is_replaced ? std::numeric_limits<double>::quiet_NaN() : exact_numbers.back().to_double());
    };
    const char* const rate = scene_.start == Start::velocity ? "the initial velocity of " : "the initial momentum of ";
    for (std::size_t k = 0; k < scene_.coordinates.size(); ++k) {
        put(Role::position, k, scene_.initial_position[k], "the initial position of ", base_.q, exact_base_.q);
        put(Role::rate, k, scene_.initial_rate[k], rate, base_.rate, exact_base_.rate);
    }
}

// The rate of a quaternion tells an angular velocity only together with the quaternion. A sweep that varied parts of
// the quaternion alone would change the angular velocity.
void SweepStarts::check_orientations() const {
    const auto coordinate_of = [&](const GiNaC::symbol& position) {
        return static_cast<std::size_t>(std::find_if(scene_.coordinates.begin(), scene_.coordinates.end(),
                                                     [&](const Coordinate& one) { return one.position == position; }) -
                                        scene_.coordinates.begin());
    };
    for (const auto& quaternion : scene_.quaternions) {
        std::optional<std::size_t> varied, turning;
        for (const GiNaC::symbol& part : quaternion) {
            const std::size_t k = coordinate_of(part);
            if (k == scene_.coordinates.size()) continue;
            if (varies(Role::position, k)) varied = k;
            if (!varies(Role::rate, k) && base_.rate[k] != 0) turning = k;
        }
        if (varied && turning)
            throw InputError(fmt::format(
                "'{}' is a part of an orientation, and the rate of {} would stay, so the angular velocity would "
                "change; vary a parameter that stands in the formulas of `orientation`",
                scene_.coordinates[*varied].written, scene_.coordinates[*turning].written));
    }
}

std::int64_t SweepStarts::place(std::int64_t trajectory, std::size_t column) const {
    const Dimension& dimension = dimensions_[values_[column].dimension];
    return trajectory / dimension.stride % dimension.count;
}

double SweepStarts::value(std::int64_t trajectory, std::size_t column) const {
    const Values& values = values_[column];
    // The same starts for each setting, so that settings can be compared.
    if (values.draw) return values.draw->value(seed_, trajectory % of_setting_);
    const std::int64_t at = place(trajectory, column);
    return values.axis ? (*values.axis)(at, algebra_) : values.listed[static_cast<std::size_t>(at)];
}

GiNaC::numeric SweepStarts::exact(std::int64_t trajectory, std::size_t column) const {
    const Values& values = values_[column];
    if (values.axis) return values.axis->axis().exact(place(trajectory, column));
    // CLN has no number below the smallest normal double.
    const double number = value(trajectory, column);
    return std::fabs(number) < std::numeric_limits<double>::min() ? GiNaC::numeric(0) : GiNaC::numeric(number);
}

Scene SweepStarts::with_settings(Scene scene, std::int64_t trajectory) const {
    MethodChoice method;
    for (std::size_t c = 0; c < columns_.size(); ++c) {
        if (!columns_[c].of.is_setting()) continue;
        const double number = value(trajectory, c);
        switch (columns_[c].of.role) {
            case Role::step:
                scene.run.step = exact(trajectory, c);
                break;
            case Role::points:
                method.points = static_cast<int>(number);
                break;
            case Role::stages:
                method.stages = static_cast<int>(number);
                break;
            case Role::splitting:
                method.splitting = static_cast<int>(number);
                break;
            default:
                method.tolerance = number;
        }
    }
    method.apply(scene);
    return scene;
}

void SweepStarts::start(std::int64_t trajectory, EnsembleStart& start) const {
    start = base_;
    bool has_values = true;
    for (std::size_t c = 0; c < columns_.size(); ++c) {
        const VariedName& name = columns_[c].of;
        if (name.is_setting()) continue;
        std::vector<double>& numbers = name.role == Role::parameter  ? start.parameters
                                       : name.role == Role::position ? start.q
                                                                     : start.rate;
        numbers[name.index] = value(trajectory, c);
        has_values = has_values && std::isfinite(numbers[name.index]);
    }
    if (std::any_of(required_.begin(), required_.end(),
                    [&](const Required& required) { return !required.holds(start.parameters); }))
        start.q.front() = std::numeric_limits<double>::quiet_NaN();  // refused as what has no value
    if (dependents_.empty() && !assembled_ && parts_ == 1) return;
    if (!has_values) {  // nor has what follows from them
        start.q.front() = std::numeric_limits<double>::quiet_NaN();
        start.whole_parameters = as_parts(start.parameters, parts_);
        start.whole_q = as_parts(start.q, parts_);
        start.whole_rate = as_parts(start.rate, parts_);
        return;
    }
    const std::lock_guard lock(algebra_);
    Exact to_all_digits = exact_base_;
    std::vector<GiNaC::ex> parameters;
    for (const Parameter& parameter : scene_.parameters) parameters.push_back(parameter.value);
    for (std::size_t c = 0; c < columns_.size(); ++c) {
        const VariedName& name = columns_[c].of;
        if (name.is_setting()) continue;
        const GiNaC::numeric number = exact(trajectory, c);
        if (name.role == Role::parameter) parameters[name.index] = number;
        (name.role == Role::parameter  ? to_all_digits.parameters
         : name.role == Role::position ? to_all_digits.q
                                       : to_all_digits.rate)[name.index] = number;
    }
    for (const auto& [position, k] : dependents_) {
        double& number = (position ? start.q : start.rate)[k];
        try {
            const GiNaC::numeric found =
                scene_.evaluate((position ? scene_.initial_position : scene_.initial_rate)[k], "", parameters);
            (position ? to_all_digits.q : to_all_digits.rate)[k] = found;
            number = found.to_double();
        } catch (const InputError&) {  // a root of a negative number, for example
            number = std::numeric_limits<double>::quiet_NaN();
        }
    }
    if (assembled_) assemble(parameters, start, to_all_digits);
    if (parts_ == 1) return;
    const auto whole = [this](const std::vector<GiNaC::numeric>& values, const std::vector<double>& numbers) {
        std::vector<double> parts = parts_of(values, parts_);
        for (std::size_t i = 0; i < numbers.size(); ++i)
            if (std::isnan(numbers[i])) parts[i * parts_] = numbers[i];
        return parts;
    };
    start.whole_parameters = whole(to_all_digits.parameters, start.parameters);
    start.whole_q = whole(to_all_digits.q, start.q);
    start.whole_rate = whole(to_all_digits.rate, start.rate);
}

std::string SweepStarts::complaint(std::int64_t trajectory) const {
    std::vector<double> parameters = base_.parameters;
    for (std::size_t c = 0; c < columns_.size(); ++c)
        if (columns_[c].of.role == Role::parameter) parameters[columns_[c].of.index] = value(trajectory, c);
    for (const Required& required : required_)
        if (!required.holds(parameters)) return required.complaint;
    return "";
}

// (D47) The nearest start that keeps the constraints; where there is none the given one, which the kernel refuses.
void SweepStarts::assemble(const std::vector<GiNaC::ex>& parameters, EnsembleStart& start, Exact& exact) const {
    Scene scene = scene_;
    for (std::size_t i = 0; i < parameters.size(); ++i) scene.parameters[i].value = parameters[i];
    for (std::size_t k = 0; k < start.q.size(); ++k) {
        if (!std::isfinite(start.q[k]) || !std::isfinite(start.rate[k])) return;
        scene.initial_position[k] = parts_ == 1 ? GiNaC::numeric(start.q[k]) : exact.q[k];
        scene.initial_rate[k] = parts_ == 1 ? GiNaC::numeric(start.rate[k]) : exact.rate[k];
    }
    try {
        const StartOnConstraints found = start_on_constraints(scene, *assembled_);
        for (std::size_t k = 0; k < start.q.size(); ++k) {
            exact.q[k] = GiNaC::numeric(found.q[k]);
            exact.rate[k] = GiNaC::numeric(found.v[k]);
            start.q[k] = cln::double_approx(found.q[k]);
            start.rate[k] = cln::double_approx(found.v[k]);
        }
    } catch (const InputError&) {
    }
}

std::string SweepStarts::text_of(std::int64_t trajectory, bool settings_alone) const {
    std::string text;
    for (std::size_t c = 0; c < columns_.size(); ++c)
        if (!settings_alone || columns_[c].of.is_setting())
            text += fmt::format("{}{} = {:.12g}", text.empty() ? "" : ", ", columns_[c].of.name, value(trajectory, c));
    return text;
}

}  // namespace lobatto
