// SPDX-License-Identifier: GPL-2.0-or-later
// Scenes of the library: read, described, emitted.
#include "analysis/checked_scene.hpp"
#include "analysis/kernel/support_text.hpp"
#include "analysis/stability/json.hpp"
#include "generator/describe/describe.hpp"
#include "generator/mechanics/clock/clock.hpp"
#include "generator/mechanics/constraints/constraints.hpp"
#include "generator/mechanics/constraints/impacts.hpp"
#include "generator/pipeline.hpp"
#include "library/parts.hpp"

namespace lobatto::api {

std::string version() {
    return LOBATTO_VERSION;
}

std::recursive_mutex& algebra() {
    static std::recursive_mutex mutex;
    return mutex;
}

void rethrow() {
    try {
        throw;
    } catch (const Error&) {
        throw;
    } catch (const lobatto::InputError& error) {
        throw InputError(error.what());
    } catch (const lobatto::ComputationError& error) {
        throw ComputationError(error.what());
    } catch (const lobatto::MachineError& error) {
        throw MachineError(error.what());
    } catch (const std::system_error& error) {
        throw MachineError(error.what());
    } catch (const std::bad_alloc&) {
        throw MachineError("out of memory");
    } catch (const std::exception& error) {
        throw MachineError(std::string("internal error: ") + error.what() +
                           "\nThis is a mistake in Lobatto, not in your scene. Please report it with the scene.");
    }
}

MethodChoice method_of(const Settings& settings) {
    const int named = settings.points.has_value() + settings.stages.has_value() + settings.splitting.has_value();
    if (named > 1) throw InputError("points, stages and splitting name different methods; give one of them");
    MethodChoice choice{settings.points, settings.stages, settings.splitting, settings.tolerance, {}, {}};
    if (!settings.arithmetic.empty()) choice.arithmetic = settings.arithmetic;
    if (!settings.numbers.empty()) choice.numbers = settings.numbers;
    return choice;
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
    for (const Parameter& parameter : scene.parameters) variables.push_back(variable_of(scene, parameter));
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

namespace {

std::shared_ptr<const Scene::Parts> parts_of(const Source& source) {
    auto parts = std::make_shared<Scene::Parts>(Scene::Parts{read_scene(source), {}, {}, {}, {}, 0, 0});
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

Scene::Scene(const std::string& path) : parts_(in_algebra([&] { return parts_of(Source::read(path)); })) {}
Scene::Scene(std::shared_ptr<const Parts> parts) : parts_(std::move(parts)) {}

Scene Scene::from_text(const std::string& text, const std::string& path) {
    return in_algebra([&] { return Scene(parts_of(Source(path, text))); });
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
    return in_algebra([&] { return text_of(describe(derive(with_method(*this, settings)))); });
}
std::string Scene::derivation_latex(const Settings& settings) const {
    return in_algebra([&] { return latex_of(describe(derive(with_method(*this, settings)))); });
}
std::string Scene::derivation_json(const Settings& settings) const {
    return in_algebra([&] { return json_of(describe(derive(with_method(*this, settings)))); });
}

std::pair<std::string, std::string> Scene::emit(const Settings& settings) const {
    return in_algebra([&] {
        const lobatto::Scene scene = with_method(*this, settings);
        EmitOptions options{scene.method.numbers, {}};
        options.support_text = [](const std::vector<std::string>& parts) { return support_text(parts); };
        const KernelSource source = lobatto::emit(derive_kernel(scene), options);
        return std::pair(source.name + ".hpp", source.header);
    });
}
std::pair<std::string, std::string> Scene::emit_plain(const Settings& settings) const {
    return in_algebra([&] {
        const lobatto::Scene scene = with_method(*this, settings);
        const PlainSource source = lobatto::emit_plain(scene, scene.method.numbers);
        return std::pair(source.name + ".hpp", source.header);
    });
}

std::string Scene::check_json(const Settings& settings) const {
    return in_algebra([&] { return json_of(check_scene(with_method(*this, settings))); });
}
std::string Scene::stability_json(const Settings& settings) const {
    return in_algebra([&] {
        const lobatto::Scene scene = with_method(*this, settings);
        refuse_clock(scene, "stability");
        refuse_constraints(scene, "stability");
        refuse_impacts(scene, "stability");
        MethodChoice::require_double(scene, "stability");
        if (scene.method.family == Family::splitting)
            throw InputError(scene.path +
                             ": what is exact of stability is of Lobatto and Gauss; choose points or stages");
        return json_of(stability_report(scene, overrides_of(settings)));
    });
}

}  // namespace lobatto::api
