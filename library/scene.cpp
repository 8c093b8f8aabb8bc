// SPDX-License-Identifier: GPL-2.0-or-later
// Scenes of the library: read, and changed by settings.
#include <fmt/format.h>

#include "analysis/checked_scene.hpp"
#include "analysis/stability/json.hpp"
#include "generator/describe/describe.hpp"
#include "generator/formula/text/suggest.hpp"
#include "library/whole.hpp"

namespace lobatto::api {

std::string version() {
    return LOBATTO_VERSION;
}

std::recursive_mutex& algebra() {
    static auto* const mutex = new std::recursive_mutex;  // for as long as static scenes of programs live
    return *mutex;
}

MethodChoice method_of(const Settings& settings) {
    return {settings.points,     settings.stages,  settings.splitting, settings.tolerance,
            settings.arithmetic, settings.numbers, settings.clock};
}

std::pair<std::string, std::string> named_value(const std::string& argument) {
    const std::size_t equals = argument.find('=');
    if (equals == std::string::npos) Source("--set", argument).fail({1, 1}, "expected name=value, such as --set m=2");
    return {argument.substr(0, equals), argument.substr(equals + 1)};
}

void refuse_values(const Settings& settings, const std::string& what) {
    const char* const given = !settings.set.empty()     ? "set"
                              : !settings.step.empty()  ? "step"
                              : !settings.until.empty() ? "until"
                              : settings.every          ? "every"
                                                        : nullptr;
    if (given != nullptr)
        throw lobatto::InputError(what + " takes the scene's own values; leave out '" + given +
                                  "', or write it into the scene");
}

Overrides overrides_of(const Settings& settings) {
    Overrides overrides;
    for (const auto& [name, value] : settings.set) overrides.set.push_back(name + "=" + value);
    overrides.step = settings.step;
    overrides.until = settings.until;
    overrides.every = settings.every;
    return overrides;
}

lobatto::Scene with_method(const Scene& scene, const Settings& settings) {
    lobatto::Scene result = scene.parts().scene;
    method_of(settings).apply(result);
    return result;
}

std::vector<Variable> coordinates_of(const lobatto::Scene& scene) {
    std::vector<Variable> variables;
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k)
        variables.push_back({scene.coordinates[k].name, scene.coordinates[k].unit,
                             scene.evaluate(scene.initial_position[k], "an initial position").to_double()});
    return variables;
}

namespace {

Variable variable_of(const lobatto::Scene& scene, const Parameter& parameter) {
    return {parameter.name, parameter.unit, scene.evaluate(parameter.value, parameter.name).to_double()};
}

}  // namespace

std::vector<Variable> parameters_of(const lobatto::Scene& scene) {
    std::vector<Variable> variables;
    for (const Parameter& parameter : scene.parameters)
        if (!parameter.is_side)
            variables.push_back(variable_of(scene, parameter));  // the sides of switches are the last
    return variables;
}
std::vector<Variable> inputs_of(const lobatto::Scene& scene) {
    std::vector<Variable> variables;
    for (const Parameter& parameter : scene.parameters)
        if (parameter.is_input) variables.push_back(variable_of(scene, parameter));
    return variables;
}

std::vector<std::string> events_of(const lobatto::Scene& scene) {
    std::vector<std::string> texts;
    for (const Event& event : scene.reported()) texts.push_back(event.text);
    return texts;
}

std::size_t index_of(const std::vector<Variable>& parameters, const std::string& name) {
    std::string in_table = name;  // tau[2] is tau_2 there
    if (name.ends_with(']')) {
        std::replace(in_table.begin(), in_table.end(), '[', '_');
        in_table.pop_back();
    }
    const auto found =
        std::find_if(parameters.begin(), parameters.end(), [&](const Variable& one) { return one.name == in_table; });
    if (found != parameters.end()) return static_cast<std::size_t>(found - parameters.begin());
    std::vector<std::string> names;
    for (const Variable& parameter : parameters) names.push_back(parameter.name);
    if (names.empty()) throw InputError(fmt::format("unknown parameter '{}': the scene declares none", name));
    throw InputError(
        fmt::format("unknown parameter '{}'; declared: {}.{}", name, listing(names), suggestion(name, names)));
}

namespace {

std::shared_ptr<const Scene::Parts> parts_of(lobatto::Scene read) {
    const auto parts = shared_in_algebra(new Scene::Parts{std::move(read), {}, {}, {}, {}, 0, 0});
    const lobatto::Scene& scene = parts->scene;
    parts->coordinates = coordinates_of(scene);
    parts->parameters = parameters_of(scene);
    parts->inputs = inputs_of(scene);
    parts->events = events_of(scene);
    parts->step = scene.evaluate(scene.run.step, "the step").to_double();
    parts->until = scene.evaluate(scene.run.until, "the end time").to_double();
    return parts;
}

}  // namespace

Scene::Scene(const std::string& path) : parts_(in_algebra([&] { return parts_of(read_scene(Source::read(path))); })) {}
Scene::Scene(std::shared_ptr<const Parts> parts) : parts_(std::move(parts)) {}

Scene scene_of(lobatto::Scene changed) {
    return in_algebra([&] { return Scene(parts_of(std::move(changed))); });
}

Scene Scene::from_text(const std::string& text, const std::string& path) {
    return in_algebra([&] { return Scene(parts_of(read_scene(Source(path, text)))); });
}

const std::string& Scene::path() const {
    return parts_->scene.path;
}
const std::string& Scene::name() const {
    return parts_->scene.name;
}
const std::string& Scene::title() const {
    return parts_->scene.title;
}
const std::string& Scene::text() const {
    return parts_->scene.source.content();
}
const std::string& Scene::lagrangian() const {
    return parts_->scene.lagrangian_text;
}
const std::vector<Variable>& Scene::coordinates() const {
    return parts_->coordinates;
}
const std::vector<Variable>& Scene::parameters() const {
    return parts_->parameters;
}
const std::vector<Variable>& Scene::inputs() const {
    return parts_->inputs;
}
const std::vector<std::string>& Scene::events() const {
    return parts_->events;
}
std::string Scene::method() const {
    return parts_->scene.method.name();
}
double Scene::step() const {
    return parts_->step;
}
double Scene::until() const {
    return parts_->until;
}
bool Scene::starts_with_momenta() const {
    return parts_->scene.start == Start::momentum;
}

std::string Scene::derivation(const Settings& settings) const {
    return in_algebra([&] { return text_of(described(*this, settings)); });
}
std::string Scene::derivation_latex(const Settings& settings) const {
    return in_algebra([&] { return latex_of(described(*this, settings)); });
}
std::string Scene::derivation_json(const Settings& settings) const {
    return in_algebra([&] { return json_of(described(*this, settings)); });
}

std::pair<std::string, std::string> Scene::emit(const Settings& settings) const {
    return in_algebra([&] {
        const KernelSource source = emitted(*this, settings, {});
        return std::pair(source.name + ".hpp", source.header);
    });
}
std::pair<std::string, std::string> Scene::emit_plain(const Settings& settings) const {
    return in_algebra([&] {
        const PlainSource source = plainly_emitted(*this, settings);
        return std::pair(source.name + ".hpp", source.header);
    });
}

std::string Scene::check_json(const Settings& settings) const {
    return in_algebra([&] { return json_of(checked(*this, settings)); });
}
std::string Scene::stability_json(const Settings& settings) const {
    return in_algebra([&] { return json_of(stability_of(*this, settings)); });
}

}  // namespace lobatto::api
