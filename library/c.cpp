// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto.h on lobatto.hpp: handles that remember what went wrong.
#include <cmath>
#include <new>
#include <utility>

#include "library/include/lobatto/lobatto.h"
#include "library/include/lobatto/lobatto.hpp"

namespace lobatto::api {

namespace {

// What each handle has.
template <class Value>
struct Handle {
    std::optional<Value> value;
    int status = 0;
    std::string message;

    // Runs the work, whose exceptions become status and message. It may return whether the motion goes on.
    template <class Work>
    int attempt(Work&& work) noexcept {
        status = 0;
        try {
            message.clear();
            if constexpr (std::is_same_v<decltype(work()), bool>) {
                if (!work()) status = stopped;
            } else {
                work();
            }
        } catch (const Error& error) {
            fail(error.exit_code(), error.what());
        } catch (const std::exception& error) {
            fail(4, error.what());
        } catch (...) {
            fail(4, "unknown error");
        }
        return status;
    }

    static constexpr int stopped = 1;

private:
    void fail(int code, const char* text) noexcept {
        status = code;
        try {
            message = text;
        } catch (...) {  // no memory: the status says it
        }
    }
};

Settings settings_of(const lobatto_settings* given) {
    Settings settings;
    if (given == nullptr) return settings;
    const auto put = [](std::string& text, const char* word) {
        if (word != nullptr) text = word;
    };
    if (given->points != 0) settings.points = given->points;
    if (given->stages != 0) settings.stages = given->stages;
    if (given->splitting != 0) settings.splitting = given->splitting;
    if (given->tolerance != 0) settings.tolerance = given->tolerance;
    put(settings.arithmetic, given->arithmetic);
    put(settings.numbers, given->numbers);
    put(settings.step, given->step);
    put(settings.until, given->until);
    if (given->every != 0) settings.every = given->every;
    for (const char* const* set = given->set; set != nullptr && *set != nullptr; ++set) {
        const std::string argument = *set;
        const std::size_t equals = argument.find('=');
        if (equals == std::string::npos) throw InputError("set: expected name=value, not '" + argument + "'");
        settings.set.emplace_back(argument.substr(0, equals), argument.substr(equals + 1));
    }
    return settings;
}

const char* text(const std::string* string) {
    return string == nullptr ? nullptr : string->c_str();
}

// Element `index` of a list of what may have failed.
template <class List>
const typename List::value_type* element(const List* list, std::size_t index) {
    return list != nullptr && index < list->size() ? &(*list)[index] : nullptr;
}

const double* data(const std::vector<double>& values) {
    return values.empty() ? nullptr : values.data();
}

}  // namespace

}  // namespace lobatto::api

using lobatto::api::Handle;
namespace api = lobatto::api;

struct lobatto_scene : Handle<api::Scene> {
    const api::Variable* coordinate(std::size_t index) const {
        return value ? api::element(&value->coordinates(), index) : nullptr;
    }
    const api::Variable* parameter(std::size_t index) const {
        return value ? api::element(&value->parameters(), index) : nullptr;
    }
};
struct lobatto_integrator : Handle<api::Stepper> {
    template <class Work>
    int with_stepper(Work&& work) noexcept {
        return value ? attempt([&] { return work(*value); }) : status;
    }
};
struct lobatto_trajectory : Handle<api::Trajectory> {};
struct lobatto_sweep : Handle<api::Sweep> {};

namespace {

const api::Scene& scene_of(const lobatto_scene* scene) {
    if (scene == nullptr) throw api::InputError("there is no scene: NULL was given");
    if (!scene->value) throw api::InputError("the scene was not read: " + scene->message);
    return *scene->value;
}

}  // namespace

extern "C" {

const char* lobatto_version(void) {
    static const std::string text = api::version();
    return text.c_str();
}

lobatto_scene* lobatto_scene_read(const char* path) {
    auto* const scene = new (std::nothrow) lobatto_scene;
    if (scene != nullptr) scene->attempt([&] { scene->value.emplace(std::string(path == nullptr ? "" : path)); });
    return scene;
}
lobatto_scene* lobatto_scene_from_text(const char* text, const char* path) {
    auto* const scene = new (std::nothrow) lobatto_scene;
    if (scene != nullptr)
        scene->attempt([&] {
            scene->value = api::Scene::from_text(text == nullptr ? "" : text, path == nullptr ? "scene.toml" : path);
        });
    return scene;
}
void lobatto_scene_free(lobatto_scene* scene) {
    delete scene;
}
int lobatto_scene_status(const lobatto_scene* scene) {
    return scene->status;
}
const char* lobatto_scene_message(const lobatto_scene* scene) {
    return scene->message.c_str();
}
const char* lobatto_scene_name(const lobatto_scene* scene) {
    return scene->value ? scene->value->name().c_str() : nullptr;
}
const char* lobatto_scene_title(const lobatto_scene* scene) {
    return scene->value ? scene->value->title().c_str() : nullptr;
}
size_t lobatto_scene_coordinates(const lobatto_scene* scene) {
    return scene->value ? scene->value->coordinates().size() : 0;
}
const char* lobatto_scene_coordinate_name(const lobatto_scene* scene, size_t index) {
    const api::Variable* const found = scene->coordinate(index);
    return found == nullptr ? nullptr : found->name.c_str();
}
const char* lobatto_scene_coordinate_unit(const lobatto_scene* scene, size_t index) {
    const api::Variable* const found = scene->coordinate(index);
    return found == nullptr ? nullptr : found->unit.c_str();
}
size_t lobatto_scene_parameters(const lobatto_scene* scene) {
    return scene->value ? scene->value->parameters().size() : 0;
}
const char* lobatto_scene_parameter_name(const lobatto_scene* scene, size_t index) {
    const api::Variable* const found = scene->parameter(index);
    return found == nullptr ? nullptr : found->name.c_str();
}
const char* lobatto_scene_parameter_unit(const lobatto_scene* scene, size_t index) {
    const api::Variable* const found = scene->parameter(index);
    return found == nullptr ? nullptr : found->unit.c_str();
}
double lobatto_scene_parameter_value(const lobatto_scene* scene, size_t index) {
    const api::Variable* const found = scene->parameter(index);
    return found == nullptr ? 0 : found->value;
}
size_t lobatto_scene_inputs(const lobatto_scene* scene) {
    return scene->value ? scene->value->inputs().size() : 0;
}
const char* lobatto_scene_input_name(const lobatto_scene* scene, size_t index) {
    const api::Variable* const found = scene->value ? api::element(&scene->value->inputs(), index) : nullptr;
    return found == nullptr ? nullptr : found->name.c_str();
}
size_t lobatto_scene_events(const lobatto_scene* scene) {
    return scene->value ? scene->value->events().size() : 0;
}
const char* lobatto_scene_event_text(const lobatto_scene* scene, size_t index) {
    return api::text(scene->value ? api::element(&scene->value->events(), index) : nullptr);
}

lobatto_integrator* lobatto_integrator_new(const lobatto_scene* scene, const lobatto_settings* settings) {
    auto* const integrator = new (std::nothrow) lobatto_integrator;
    if (integrator != nullptr)
        integrator->attempt(
            [&] { integrator->value.emplace(api::compile(scene_of(scene), api::settings_of(settings))); });
    return integrator;
}
lobatto_integrator* lobatto_integrator_copy(const lobatto_integrator* integrator) {
    auto* const copy = new (std::nothrow) lobatto_integrator;
    if (copy == nullptr) return copy;
    const int failed = copy->attempt([&] {
        copy->value = integrator->value;
        copy->message = integrator->message;
    });
    if (failed == 0) copy->status = integrator->status;
    return copy;
}
void lobatto_integrator_free(lobatto_integrator* integrator) {
    delete integrator;
}
int lobatto_integrator_status(const lobatto_integrator* integrator) {
    return integrator->status;
}
const char* lobatto_integrator_message(const lobatto_integrator* integrator) {
    return integrator->message.c_str();
}
int lobatto_integrator_start(lobatto_integrator* integrator, double t, const double* q, const double* p) {
    return integrator->with_stepper([&](api::Stepper& stepper) { stepper.start(t, q, p); });
}
int lobatto_integrator_start_from_velocity(lobatto_integrator* integrator, double t, const double* q,
                                           const double* velocity) {
    return integrator->with_stepper([&](api::Stepper& stepper) { stepper.start_from_velocity(t, q, velocity); });
}
int lobatto_integrator_advance(lobatto_integrator* integrator, int64_t steps) {
    return integrator->with_stepper([&](api::Stepper& stepper) { return stepper.advance(steps); });
}
int lobatto_integrator_advance_to(lobatto_integrator* integrator, double t) {
    return integrator->with_stepper([&](api::Stepper& stepper) { return stepper.advance_to(t); });
}
int lobatto_integrator_set(lobatto_integrator* integrator, const char* parameter, double value) {
    return integrator->with_stepper(
        [&](api::Stepper& stepper) { stepper.set(parameter == nullptr ? "" : parameter, value); });
}
int lobatto_integrator_set_inputs(lobatto_integrator* integrator, const double* values) {
    return integrator->with_stepper([&](api::Stepper& stepper) { stepper.set_inputs(values); });
}
int lobatto_integrator_velocity(lobatto_integrator* integrator, double* velocity) {
    return integrator->with_stepper([&](api::Stepper& stepper) {
        const std::vector<double> values = stepper.velocity();
        std::copy(values.begin(), values.end(), velocity);
    });
}
int lobatto_integrator_at(lobatto_integrator* integrator, double t, double* q, double* velocity) {
    return integrator->with_stepper([&](api::Stepper& stepper) {
        const auto state = stepper.at(t);
        std::copy(state.first.begin(), state.first.end(), q);
        std::copy(state.second.begin(), state.second.end(), velocity);
    });
}
size_t lobatto_integrator_coordinates(const lobatto_integrator* integrator) {
    return integrator->value ? integrator->value->coordinates() : 0;
}
double lobatto_integrator_step_size(const lobatto_integrator* integrator) {
    return integrator->value ? integrator->value->step_size() : 0;
}
double lobatto_integrator_t(const lobatto_integrator* integrator) {
    return integrator->value ? integrator->value->t() : 0;
}
const double* lobatto_integrator_q(const lobatto_integrator* integrator) {
    return integrator->value ? integrator->value->q() : nullptr;
}
const double* lobatto_integrator_p(const lobatto_integrator* integrator) {
    return integrator->value ? integrator->value->p() : nullptr;
}
double lobatto_integrator_energy(const lobatto_integrator* integrator) {
    return integrator->value ? integrator->value->energy() : std::nan("");
}

lobatto_trajectory* lobatto_run(const lobatto_scene* scene, const lobatto_settings* settings, int measure) {
    auto* const trajectory = new (std::nothrow) lobatto_trajectory;
    if (trajectory == nullptr) return trajectory;
    trajectory->attempt([&] {
        api::RunOptions options;
        static_cast<api::Settings&>(options) = api::settings_of(settings);
        options.measure = measure != 0;
        try {
            trajectory->value = api::run(scene_of(scene), options);
        } catch (const api::RunFailure& failure) {
            trajectory->value = failure.trajectory();
            throw;
        }
        return trajectory->value->stopped_by.empty();
    });
    return trajectory;
}
void lobatto_trajectory_free(lobatto_trajectory* trajectory) {
    delete trajectory;
}
int lobatto_trajectory_status(const lobatto_trajectory* trajectory) {
    return trajectory->status;
}
const char* lobatto_trajectory_message(const lobatto_trajectory* trajectory) {
    return trajectory->message.c_str();
}
size_t lobatto_trajectory_count(const lobatto_trajectory* trajectory) {
    return trajectory->value ? trajectory->value->count : 0;
}
const double* lobatto_trajectory_t(const lobatto_trajectory* trajectory) {
    return trajectory->value ? api::data(trajectory->value->t) : nullptr;
}
const double* lobatto_trajectory_q(const lobatto_trajectory* trajectory) {
    return trajectory->value ? api::data(trajectory->value->q) : nullptr;
}
const double* lobatto_trajectory_p(const lobatto_trajectory* trajectory) {
    return trajectory->value ? api::data(trajectory->value->p) : nullptr;
}
const double* lobatto_trajectory_energy(const lobatto_trajectory* trajectory) {
    return trajectory->value ? api::data(trajectory->value->energy) : nullptr;
}
double lobatto_trajectory_error(const lobatto_trajectory* trajectory) {
    return trajectory->value ? trajectory->value->error.value_or(std::nan("")) : std::nan("");
}

lobatto_sweep* lobatto_sweep_run(const lobatto_scene* scene, const lobatto_settings* settings, size_t count,
                                 size_t columns, const char* const* names, const double* const* values) {
    auto* const sweep = new (std::nothrow) lobatto_sweep;
    if (sweep == nullptr) return sweep;
    sweep->attempt([&] {
        api::Starts starts;
        starts.count = count;
        for (size_t c = 0; c < columns; ++c) starts.columns[names[c]].assign(values[c], values[c] + count);
        api::SweepOptions options;
        static_cast<api::Settings&>(options) = api::settings_of(settings);
        sweep->value = api::sweep(scene_of(scene), starts, options);
    });
    return sweep;
}
void lobatto_sweep_free(lobatto_sweep* sweep) {
    delete sweep;
}
int lobatto_sweep_status(const lobatto_sweep* sweep) {
    return sweep->status;
}
const char* lobatto_sweep_message(const lobatto_sweep* sweep) {
    return sweep->message.c_str();
}
size_t lobatto_sweep_count(const lobatto_sweep* sweep) {
    return sweep->value ? sweep->value->count : 0;
}
const int* lobatto_sweep_statuses(const lobatto_sweep* sweep) {
    return sweep->value ? sweep->value->status.data() : nullptr;
}
const char* lobatto_sweep_status_text(const lobatto_sweep* sweep, int status) {
    return api::text(sweep->value && status >= 0
                         ? api::element(&sweep->value->statuses, static_cast<std::size_t>(status))
                         : nullptr);
}
const double* lobatto_sweep_t(const lobatto_sweep* sweep) {
    return sweep->value ? api::data(sweep->value->t) : nullptr;
}
const double* lobatto_sweep_q(const lobatto_sweep* sweep) {
    return sweep->value ? api::data(sweep->value->q) : nullptr;
}
const double* lobatto_sweep_p(const lobatto_sweep* sweep) {
    return sweep->value ? api::data(sweep->value->p) : nullptr;
}

}  // extern "C"
