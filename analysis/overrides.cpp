// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/overrides.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "analysis/initial_value.hpp"
#include "generator/formula/expression.hpp"
#include "generator/formula/text/suggest.hpp"

namespace lobatto {

namespace {

constexpr double most_every = 9e15;  // the steps that a run can have

[[noreturn]] void fail_unknown(const Source& source, const Scene& scene, const std::string& name) {
    for (const Parameter& constant : scene.constants) {
        if (constant.written == name)
            source.fail(
                {1, 1},
                fmt::format(
                    "'{}' is declared constant in {}, so it is part of the kernel; only run-time parameters can be set",
                    name, scene.path));
    }
    std::vector<std::string> names;
    for (const Parameter& parameter : scene.parameters)
        if (!parameter.is_side) names.push_back(parameter.written);
    const std::vector<std::string> initial = initial_names(scene);
    const std::string declared =
        names.empty() ? scene.path + " has no run-time parameters" : "declared: " + listing(names);
    names.insert(names.end(), initial.begin(), initial.end());
    source.fail({1, 1}, fmt::format("unknown parameter '{}'; {}; of the start: {}.{}", name, declared, listing(initial),
                                    suggestion(name, names)));
}

// Before the equals sign, without blanks beside it: of "m = 2" it is m.
std::string name_in(const std::string& argument) {
    const std::string name = argument.substr(0, argument.find('='));
    const std::size_t begin = name.find_first_not_of(' '), end = name.find_last_not_of(' ');
    return begin == std::string::npos ? "" : name.substr(begin, end + 1 - begin);
}

GiNaC::ex in_parameters(const std::string& option, const std::string& argument, const std::string& what,
                        const Scene& scene, std::size_t begin = 0) {
    Names names = parameter_names(scene);
    const Scope scope{&names, what, false, {}};
    GiNaC::exmap values;
    for (const Parameter& parameter : scene.parameters)  // whose own values may be formulas, as 2*pi
        values[parameter.symbol] = scene.evaluate(parameter.value, "the parameter " + parameter.name);
    const Source source(option, argument);
    const Text text = text_of(argument, begin);
    const GiNaC::ex expression = parse_expression(source, text, scope);
    value_in_range(source, text.at.front(), expression, what, values);
    return expression;
}

// Whether the name is one of a parameter.
bool sets_parameter(const std::string& argument, Scene& scene) {
    const Source source("--set", argument);
    const std::size_t equals = argument.find('=');
    if (equals == std::string::npos) source.fail({1, 1}, "expected name=value, such as --set m=2");
    const std::string name = name_in(argument);
    const auto parameter = std::find_if(scene.parameters.begin(), scene.parameters.end(), [&](const Parameter& p) {
        return !p.is_side && (p.written == name || p.name == name);
    });
    if (parameter == scene.parameters.end()) return false;
    const Scope scope{nullptr, fmt::format("the value of {}", name), false, {}};
    const Text text = text_of(argument, equals + 1);
    parameter->value = parse_expression(source, text, scope);
    value_in_range(source, text.at.front(), parameter->value, scope.formula);
    return true;
}

void set_initial_value(const std::string& argument, Scene& scene) {
    const Source source("--set", argument);
    const std::string name = name_in(argument);
    const auto found = initial_value(scene, name, "set", [&](const std::string& message) {
        source.fail({1, 1}, message);
    });
    if (!found) fail_unknown(source, scene, name);
    (found->is_rate ? scene.initial_rate : scene.initial_position)[found->index] =
        in_parameters("--set", argument, "the initial value " + name, scene, argument.find('=') + 1);
}

void keep_every(double every, Scene& scene) {
    const std::string given = fmt::format("{}", every);
    if (scene.clock) {
        if (!(every > 0) || !std::isfinite(every))
            throw InputError(fmt::format(
                "--every: with a clock it is the time from one kept state to the next, above 0, not {}", given));
        scene.outputs.interval = in_parameters("--every", given, "the time between two states", scene);
        return;
    }
    if (every > most_every)
        throw InputError(fmt::format("--every: {} is more than a run has steps; at most 9e15", given));
    if (!(every >= 1) || every != std::floor(every))
        throw InputError(
            fmt::format("--every: {} is not a number of states; give 1 to keep each, 10 to keep every tenth", given));
    if (every > 1 && scene.outputs.dense > 0)
        throw InputError(
            fmt::format("--every: the scene asks for states between two steps (dense = {}), so all steps are kept",
                        scene.outputs.dense));
    scene.outputs.every = static_cast<std::int64_t>(every);
}

}  // namespace

Text text_of(const std::string& argument, std::size_t begin, std::size_t end) {
    end = std::min(end, argument.size());
    Text text{argument.substr(begin, end - begin), {}};
    int column = 0;
    for (std::size_t i = 0; i <= end; ++i) {
        const bool starts_character = i == argument.size() || (static_cast<unsigned char>(argument[i]) & 0xC0) != 0x80;
        if (starts_character) ++column;
        if (i >= begin) text.at.push_back({1, column});
    }
    return text;
}

void apply(const Overrides& overrides, Scene& scene) {
    std::set<std::string> names;
    std::vector<std::string> of_start;  // may hold parameters, whose values are set first
    for (const std::string& argument : overrides.set) {
        const std::string name = name_in(argument);
        if (!names.insert(name).second)
            throw InputError(fmt::format("--set: '{}' is set twice; leave one of both out", name));
        if (!sets_parameter(argument, scene)) of_start.push_back(argument);
    }
    for (const std::string& argument : of_start) set_initial_value(argument, scene);
    if (!overrides.step.empty()) scene.run.step = in_parameters("--step", overrides.step, "the step", scene);
    if (!overrides.until.empty()) scene.run.until = in_parameters("--until", overrides.until, "the end time", scene);
    if (overrides.every) keep_every(*overrides.every, scene);
}

std::function<Scene()> with_values(const Scene& scene, const Overrides& overrides) {
    if (overrides.set.empty()) return {};
    return [scene, values = Overrides{overrides.set, "", "", std::nullopt}] {
        Scene changed = scene;
        apply(values, changed);
        return changed;
    };
}

std::int64_t kept_by_sweeps(const Overrides& overrides, const Scene& scene) {
    if (!overrides.every) return 0;
    return scene.clock ? 1 : static_cast<std::int64_t>(*overrides.every);
}

}  // namespace lobatto
