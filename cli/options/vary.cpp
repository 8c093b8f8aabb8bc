// SPDX-License-Identifier: GPL-2.0-or-later
// --vary: names of a scene with many values each, and the grid of trajectories they make.
#include "cli/options/vary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/overrides.hpp"
#include "generator/formula/expression.hpp"
#include "generator/formula/suggest.hpp"
#include "generator/mechanics/start.hpp"

namespace lobatto {

namespace {

constexpr long most_values = 10'000'000;  // of a name: they are kept
constexpr double most_trajectories = 1e9;

std::size_t at(std::int64_t index) {
    return static_cast<std::size_t>(index);
}

class AxisReader {
public:
    AxisReader(const Scene& scene, const std::string& argument)
        : scene_(scene), argument_(argument), source_("--vary", argument) {}

    Axis run() {
        const std::size_t equals = argument_.find('=');
        if (equals == std::string::npos || equals == 0)
            source_.fail({1, 1}, "expected NAME=FROM:TO:COUNT or NAME=a,b,c, such as --vary q=0:3:1000");
        axis_.name = argument_.substr(0, equals);
        axis_.written = argument_.substr(equals + 1);
        find_name();
        read_values(equals + 1);
        return std::move(axis_);
    }

private:
    std::string rate_name(const Coordinate& coordinate) const {
        return scene_.start == Start::velocity ? coordinate.written + "'" : "p_" + coordinate.name;
    }

    void find_name() {
        const std::string& name = axis_.name;
        const auto is = [&](Axis::Role role, std::size_t index) {
            axis_.role = role;
            axis_.index = index;
        };
        std::vector<std::string> names;
        for (std::size_t i = 0; i < scene_.parameters.size(); ++i) {
            names.push_back(scene_.parameters[i].written);
            if (name == names.back()) return is(Axis::Role::parameter, i);
        }
        for (std::size_t k = 0; k < scene_.coordinates.size(); ++k) {
            const Coordinate& coordinate = scene_.coordinates[k];
            names.push_back(coordinate.written);
            if (name == names.back()) return is(Axis::Role::position, k);
            names.push_back(rate_name(coordinate));
            if (name == names.back()) return is(Axis::Role::rate, k);
            const bool velocity = name == coordinate.written + "'";
            if (velocity || name == "p_" + coordinate.name)
                source_.fail({1, 1}, fmt::format("{} gives initial {}, not {}; vary {} instead", scene_.path,
                                                 velocity ? "momenta" : "velocities",
                                                 velocity ? "velocities" : "momenta", names.back()));
        }
        for (const Parameter& constant : scene_.constants)
            if (constant.written == name)
                source_.fail({1, 1}, fmt::format("'{}' is declared constant in {}, so it is part of the kernel; only "
                                                 "run-time parameters can be varied",
                                                 name, scene_.path));
        source_.fail({1, 1}, fmt::format("unknown name '{}'; what can be varied: {}.{}", name, listing(names),
                                         suggestion(name, names)));
    }

    // Where the parts between separators outside parentheses begin, and one past the end.
    std::vector<std::size_t> parts(std::size_t begin, char separator) const {
        std::vector<std::size_t> begins{begin};
        int depth = 0;
        for (std::size_t i = begin; i < argument_.size(); ++i) {
            if (argument_[i] == '(') ++depth;
            if (argument_[i] == ')') --depth;
            if (argument_[i] == separator && depth <= 0) begins.push_back(i + 1);
        }
        begins.push_back(argument_.size() + 1);
        return begins;
    }

    Text part(const std::vector<std::size_t>& begins, std::size_t i) const {
        return text_of(argument_, begins[i], begins[i + 1] - 1);
    }

    GiNaC::numeric number(const Text& text, const std::string& what) const {
        const Scope scope{nullptr, what, false, {}};
        return value_in_range(source_, text.at.front(), parse_expression(source_, text, scope), what);
    }

    void read_values(std::size_t begin) {
        const std::vector<std::size_t> range = parts(begin, ':');
        if (range.size() == 2) return read_list(parts(begin, ','));
        if (range.size() != 4 && range.size() != 5)
            source_.fail(part(range, 0).at.front(),
                         "expected FROM:TO:COUNT, FROM:TO:COUNT:log or values with commas, such as 0:3:1000");
        axis_.given = {number(part(range, 0), "the first value of " + axis_.name),
                       number(part(range, 1), "the last value of " + axis_.name)};
        axis_.spacing = Axis::Spacing::linear;
        if (range.size() == 5) {
            const Text word = part(range, 3);
            if (word.value != "log")
                source_.fail(word.at.front(),
                             fmt::format("'{}' is no spacing; there is log, or none for equal distances", word.value));
            if (!(axis_.given[0] * axis_.given[1]).is_positive())
                source_.fail(part(range, 0).at.front(),
                             fmt::format("equal ratios lead from {:.6g} to {:.6g} only when both have the same sign "
                                         "and neither is 0; leave :log out",
                                         axis_.given[0].to_double(), axis_.given[1].to_double()));
            axis_.spacing = Axis::Spacing::logarithmic;
        }
        const Text text = part(range, 2);
        const GiNaC::numeric count = number(text, "the number of values of " + axis_.name);
        const double nearest = std::round(count.to_double());
        if (count.to_double() != nearest || nearest < 1 || nearest > most_values)
            source_.fail(text.at.front(), fmt::format("the number of values is {:.10g}; it must be a whole number from "
                                                      "1 to {}",
                                                      count.to_double(), most_values));
        if (nearest == 1 && axis_.given[0] != axis_.given[1])
            source_.fail(text.at.front(),
                         fmt::format("one value does not lead from {:.6g} to {:.6g}: give a count of 2 or "
                                     "more, or {}={:.6g}",
                                     axis_.given[0].to_double(), axis_.given[1].to_double(), axis_.name,
                                     axis_.given[0].to_double()));
        axis_.values.resize(at(static_cast<std::int64_t>(nearest)));
        for (std::int64_t i = 0; i < axis_.count(); ++i) axis_.values[at(i)] = axis_.exact(i).to_double();
    }

    void read_list(const std::vector<std::size_t>& list) {
        for (std::size_t i = 0; i + 1 < list.size(); ++i) {
            axis_.given.push_back(number(part(list, i), "the value of " + axis_.name));
            axis_.values.push_back(axis_.given.back().to_double());
        }
    }

    const Scene& scene_;
    const std::string& argument_;
    Source source_;
    Axis axis_;
};

}  // namespace

// Equal distances: from + (to - from) i/(count - 1), to 60 digits. Equal ratios: from (to/from)^(i/(count - 1)), to 64
// bits and then rounded.
GiNaC::numeric Axis::exact(std::int64_t i) const {
    if (spacing == Spacing::list) return given[at(i)];
    if (i == 0) return given[0];
    if (i == count() - 1) return given[1];
    if (spacing == Spacing::linear)
        return given[0] + (given[1] - given[0]) * GiNaC::numeric(static_cast<long>(i), static_cast<long>(count() - 1));
    const double from = given[0].to_double(), to = given[1].to_double();
    const long double share = static_cast<long double>(i) / static_cast<long double>(count() - 1);
    const auto logarithm = [](double x) { return std::log(static_cast<long double>(std::fabs(x))); };
    const long double size = std::exp((1 - share) * logarithm(from) + share * logarithm(to));
    return GiNaC::numeric(std::copysign(static_cast<double>(size), from));
}

Grid::Grid(const Scene& scene, const std::vector<std::string>& arguments) : scene_(scene) {
    double trajectories = 1;
    for (const std::string& argument : arguments) {
        axes_.push_back(AxisReader(scene, argument).run());
        const Axis& axis = axes_.back();
        const auto same = [&](const Axis& other) { return other.name == axis.name; };
        if (std::any_of(axes_.begin(), axes_.end() - 1, same))
            Source("--vary", argument)
                .fail({1, 1}, fmt::format("'{}' is varied twice; give all its values at once", axis.name));
        trajectories *= static_cast<double>(axis.count());
    }
    if (trajectories > most_trajectories)
        throw InputError(
            fmt::format("--vary: all combinations make {:.3g} trajectories; at most {:.0e}: give fewer values",
                        trajectories, most_trajectories));
    stride_.resize(axes_.size());
    for (std::size_t a = axes_.size(); a-- > 0;) {
        stride_[a] = count_;
        count_ *= axes_[a].count();
    }

    if (scene.run.assemble) {
        if (scene.start == Start::momentum)
            throw InputError(fmt::format(
                "{}: sweeps assemble starts by their velocities: give velocities in place of momenta", scene.path));
        assembled_ = build_system(scene);
    }
    const auto varied = [&](Axis::Role role, std::size_t index) {
        return std::any_of(axes_.begin(), axes_.end(),
                           [&](const Axis& axis) { return axis.role == role && axis.index == index; });
    };
    for (const Parameter& parameter : scene.parameters)
        base_.parameters.push_back(scene.evaluate(parameter.value, "the parameter " + parameter.name).to_double());
    const auto put = [&](Axis::Role role, std::size_t k, const GiNaC::ex& value, const std::string& what) {
        bool depends = false;
        for (const Axis& axis : axes_)
            depends = depends || (axis.role == Axis::Role::parameter && value.has(scene.parameters[axis.index].symbol));
        const bool given = varied(role, k);
        if (depends && !given) dependents_.push_back({role == Axis::Role::position, k});
        return depends || given ? std::numeric_limits<double>::quiet_NaN()  // always replaced
                                : scene.evaluate(value, what + scene.coordinates[k].name).to_double();
    };
    const char* const rate = scene.start == Start::velocity ? "the initial velocity of " : "the initial momentum of ";
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {
        base_.q.push_back(put(Axis::Role::position, k, scene.initial_position[k], "the initial position of "));
        base_.rate.push_back(put(Axis::Role::rate, k, scene.initial_rate[k], rate));
    }
}

std::int64_t Grid::place(std::int64_t trajectory, std::size_t axis) const {
    return trajectory / stride_[axis] % axes_[axis].count();
}

double Grid::value(std::int64_t trajectory, std::size_t axis) const {
    return axes_[axis].values[at(place(trajectory, axis))];
}

void Grid::start(std::int64_t trajectory, EnsembleStart& start) const {
    start = base_;
    for (std::size_t a = 0; a < axes_.size(); ++a) {
        const Axis& axis = axes_[a];
        std::vector<double>& numbers = axis.role == Axis::Role::parameter  ? start.parameters
                                       : axis.role == Axis::Role::position ? start.q
                                                                           : start.rate;
        numbers[axis.index] = value(trajectory, a);
    }
    if (dependents_.empty() && !assembled_) return;
    const std::lock_guard lock(algebra_);
    std::vector<GiNaC::ex> parameters;
    for (const Parameter& parameter : scene_.parameters) parameters.push_back(parameter.value);
    for (std::size_t a = 0; a < axes_.size(); ++a)
        if (axes_[a].role == Axis::Role::parameter) parameters[axes_[a].index] = axes_[a].exact(place(trajectory, a));
    for (const auto& [position, k] : dependents_) {
        double& number = (position ? start.q : start.rate)[k];
        try {
            number = scene_.evaluate((position ? scene_.initial_position : scene_.initial_rate)[k], "", parameters)
                         .to_double();
        } catch (const InputError&) {  // a root of a negative number, for example
            number = std::numeric_limits<double>::quiet_NaN();
        }
    }
    if (assembled_) assemble(parameters, start);
}

// (D47) The nearest start that keeps the constraints; not a number where there is none.
void Grid::assemble(const std::vector<GiNaC::ex>& parameters, EnsembleStart& start) const {
    Scene scene = scene_;
    for (std::size_t i = 0; i < parameters.size(); ++i) scene.parameters[i].value = parameters[i];
    for (std::size_t k = 0; k < start.q.size(); ++k) {
        if (!std::isfinite(start.q[k]) || !std::isfinite(start.rate[k])) return;
        scene.initial_position[k] = GiNaC::numeric(start.q[k]);
        scene.initial_rate[k] = GiNaC::numeric(start.rate[k]);
    }
    try {
        const StartOnConstraints found = start_on_constraints(scene, *assembled_);
        for (std::size_t k = 0; k < start.q.size(); ++k) {
            start.q[k] = cln::double_approx(found.q[k]);
            start.rate[k] = cln::double_approx(found.v[k]);
        }
    } catch (const InputError&) {
        start.q.assign(start.q.size(), std::numeric_limits<double>::quiet_NaN());
    }
}

}  // namespace lobatto
