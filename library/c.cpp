// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto.h on lobatto.hpp: scenes, trajectories step by step, runs and sweeps.
#include <fmt/format.h>

#include <cmath>

#include "library/handles.hpp"

using lobatto::api::Handle;
namespace api = lobatto::api;

struct lobatto_integrator : Handle<api::Stepper> {
    std::vector<api::EventHit> hits;  // taken last, and as C sees them
    std::vector<lobatto_event> events;
    std::vector<double> multipliers, columns;
};
struct lobatto_trajectory : Handle<api::Trajectory> {
    std::vector<lobatto_event> events;
};
struct lobatto_sweep : Handle<api::Sweep> {};

namespace {

std::vector<lobatto_event> events_of(const std::vector<api::EventHit>& hits) {
    std::vector<lobatto_event> events;
    for (const api::EventHit& hit : hits) events.push_back({hit.kind, hit.t, hit.q.data(), hit.p.data()});
    return events;
}

const api::Variable* coordinate_of(const lobatto_scene* scene, std::size_t index) {
    return api::read(scene, nullptr, [&](const auto& value) { return api::element(value.coordinates(), index); });
}
const api::Variable* parameter_of(const lobatto_scene* scene, std::size_t index) {
    return api::read(scene, nullptr, [&](const auto& value) { return api::element(value.parameters(), index); });
}

// What a caller gives, or a place for what is asked for.
void require(const void* pointer, const char* name) {
    if (pointer == nullptr) throw api::InputError(fmt::format("{}: NULL was given", name));
}

template <class Work>
int with_stepper(lobatto_integrator* integrator, Work&& work) noexcept {
    if (integrator == nullptr || !integrator->value) return api::status_of(integrator);
    return integrator->attempt([&] { return work(*integrator->value); });
}

}  // namespace

extern "C" {

const char* lobatto_version(void) {
    static const std::string text = api::version();
    return text.c_str();
}

lobatto_scene* lobatto_scene_read(const char* path) {
    return api::made<lobatto_scene>(
        [&](lobatto_scene& scene) { scene.value.emplace(std::string(path == nullptr ? "" : path)); });
}
lobatto_scene* lobatto_scene_from_text(const char* text, const char* path) {
    return api::made<lobatto_scene>([&](lobatto_scene& scene) {
        scene.value = api::Scene::from_text(text == nullptr ? "" : text, path == nullptr ? "scene.toml" : path);
    });
}
void lobatto_scene_free(lobatto_scene* scene) {
    delete scene;
}
int lobatto_scene_status(const lobatto_scene* scene) {
    return api::status_of(scene);
}
const char* lobatto_scene_message(const lobatto_scene* scene) {
    return api::message_of(scene);
}
const char* lobatto_scene_name(const lobatto_scene* scene) {
    return api::read(scene, nullptr, [](const auto& value) { return value.name().c_str(); });
}
const char* lobatto_scene_title(const lobatto_scene* scene) {
    return api::read(scene, nullptr, [](const auto& value) { return value.title().c_str(); });
}
size_t lobatto_scene_coordinates(const lobatto_scene* scene) {
    return api::read(scene, 0, [](const auto& value) { return value.coordinates().size(); });
}
const char* lobatto_scene_coordinate_name(const lobatto_scene* scene, size_t index) {
    const api::Variable* const found = coordinate_of(scene, index);
    return found == nullptr ? nullptr : found->name.c_str();
}
const char* lobatto_scene_coordinate_unit(const lobatto_scene* scene, size_t index) {
    const api::Variable* const found = coordinate_of(scene, index);
    return found == nullptr ? nullptr : found->unit.c_str();
}
size_t lobatto_scene_parameters(const lobatto_scene* scene) {
    return api::read(scene, 0, [](const auto& value) { return value.parameters().size(); });
}
const char* lobatto_scene_parameter_name(const lobatto_scene* scene, size_t index) {
    const api::Variable* const found = parameter_of(scene, index);
    return found == nullptr ? nullptr : found->name.c_str();
}
const char* lobatto_scene_parameter_unit(const lobatto_scene* scene, size_t index) {
    const api::Variable* const found = parameter_of(scene, index);
    return found == nullptr ? nullptr : found->unit.c_str();
}
double lobatto_scene_parameter_value(const lobatto_scene* scene, size_t index) {
    const api::Variable* const found = parameter_of(scene, index);
    return found == nullptr ? 0 : found->value;
}
size_t lobatto_scene_inputs(const lobatto_scene* scene) {
    return api::read(scene, 0, [](const auto& value) { return value.inputs().size(); });
}
const char* lobatto_scene_input_name(const lobatto_scene* scene, size_t index) {
    const api::Variable* const found =
        api::read(scene, nullptr, [&](const auto& value) { return api::element(value.inputs(), index); });
    return found == nullptr ? nullptr : found->name.c_str();
}
size_t lobatto_scene_events(const lobatto_scene* scene) {
    return api::read(scene, 0, [](const auto& value) { return value.events().size(); });
}
const char* lobatto_scene_event_text(const lobatto_scene* scene, size_t index) {
    return api::read(scene, nullptr, [&](const auto& value) { return api::text(value.events(), index); });
}

lobatto_integrator* lobatto_integrator_new(const lobatto_scene* scene, const lobatto_settings* settings) {
    return api::made<lobatto_integrator>([&](lobatto_integrator& integrator) {
        integrator.value.emplace(api::compile(api::scene_of(scene), api::settings_of(settings)));
    });
}
lobatto_integrator* lobatto_integrator_copy(const lobatto_integrator* integrator) {
    auto* const copy = new (std::nothrow) lobatto_integrator;
    if (copy == nullptr) return copy;
    const int failed = copy->attempt([&] {
        if (integrator == nullptr) throw api::InputError("there is no integrator: NULL was given");
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
    return api::status_of(integrator);
}
const char* lobatto_integrator_message(const lobatto_integrator* integrator) {
    return api::message_of(integrator);
}
int lobatto_integrator_start(lobatto_integrator* integrator, double t, const double* q, const double* p) {
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        require(q, "q");
        require(p, "p");
        stepper.start(t, q, p);
    });
}
int lobatto_integrator_start_from_velocity(lobatto_integrator* integrator, double t, const double* q,
                                           const double* velocity) {
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        require(q, "q");
        require(velocity, "velocity");
        stepper.start_from_velocity(t, q, velocity);
    });
}
int lobatto_integrator_start_with_inputs(lobatto_integrator* integrator, double t, const double* q, const double* p,
                                         const double* inputs) {
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        require(q, "q");
        require(p, "p");
        require(inputs, "inputs");
        stepper.start(t, q, p, inputs);
    });
}
int lobatto_integrator_advance(lobatto_integrator* integrator, int64_t steps) {
    return with_stepper(integrator, [&](api::Stepper& stepper) { return stepper.advance(steps); });
}
int lobatto_integrator_advance_to(lobatto_integrator* integrator, double t) {
    return with_stepper(integrator, [&](api::Stepper& stepper) { return stepper.advance_to(t); });
}
int lobatto_integrator_set(lobatto_integrator* integrator, const char* parameter, double value) {
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        require(parameter, "parameter");
        stepper.set(parameter, value);
    });
}
int lobatto_integrator_set_inputs(lobatto_integrator* integrator, const double* values) {
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        if (values == nullptr) throw api::InputError("set_inputs: NULL was given; give a value for each input");
        stepper.set_inputs(values);
    });
}
int lobatto_integrator_velocity(lobatto_integrator* integrator, double* velocity) {
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        require(velocity, "velocity");
        const std::vector<double> values = stepper.velocity();
        std::copy(values.begin(), values.end(), velocity);
    });
}
int lobatto_integrator_at(lobatto_integrator* integrator, double t, double* q, double* velocity) {
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        require(q, "q");
        require(velocity, "velocity");
        const auto state = stepper.at(t);
        std::copy(state.first.begin(), state.first.end(), q);
        std::copy(state.second.begin(), state.second.end(), velocity);
    });
}
int lobatto_integrator_tangent(lobatto_integrator* integrator, double* tangent) {
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        require(tangent, "tangent");
        const std::vector<double> values = stepper.tangent();
        std::copy(values.begin(), values.end(), tangent);
    });
}
int lobatto_integrator_parameter(lobatto_integrator* integrator, const char* parameter, double* value) {
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        require(parameter, "parameter");
        require(value, "value");
        *value = stepper.parameter(parameter);
    });
}
int lobatto_integrator_take_events(lobatto_integrator* integrator, const lobatto_event** events, size_t* count) {
    if (events != nullptr) *events = nullptr;
    if (count != nullptr) *count = 0;
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        require(events, "events");
        require(count, "count");
        integrator->hits = stepper.take_events();
        integrator->events = events_of(integrator->hits);
        *events = api::data(integrator->events);
        *count = integrator->events.size();
    });
}
int lobatto_integrator_multipliers(lobatto_integrator* integrator, const double** multipliers, size_t* count) {
    if (multipliers != nullptr) *multipliers = nullptr;
    if (count != nullptr) *count = 0;
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        require(multipliers, "multipliers");
        require(count, "count");
        integrator->multipliers = stepper.multipliers();
        *multipliers = api::data(integrator->multipliers);
        *count = integrator->multipliers.size();
    });
}
int lobatto_integrator_columns(lobatto_integrator* integrator, const double** columns, size_t* count) {
    if (columns != nullptr) *columns = nullptr;
    if (count != nullptr) *count = 0;
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        require(columns, "columns");
        require(count, "count");
        integrator->columns = stepper.columns();
        *columns = api::data(integrator->columns);
        *count = integrator->columns.size();
    });
}
const char* lobatto_integrator_column(const lobatto_integrator* integrator, size_t index) {
    return api::read(integrator, nullptr, [&](const auto& value) { return api::text(value.column_names(), index); });
}
int lobatto_integrator_sensitivity(lobatto_integrator* integrator, const char* parameter, double* derivative) {
    return with_stepper(integrator, [&](api::Stepper& stepper) {
        require(parameter, "parameter");
        require(derivative, "derivative");
        const std::vector<double> all = stepper.sensitivity(parameter);
        std::copy(all.begin(), all.end(), derivative);
    });
}
size_t lobatto_integrator_coordinates(const lobatto_integrator* integrator) {
    return api::read(integrator, 0, [](const auto& value) { return value.coordinates(); });
}
double lobatto_integrator_step_size(const lobatto_integrator* integrator) {
    return api::read(integrator, 0, [](const auto& value) { return value.step_size(); });
}
double lobatto_integrator_t(const lobatto_integrator* integrator) {
    return api::read(integrator, 0, [](const auto& value) { return value.t(); });
}
const double* lobatto_integrator_q(const lobatto_integrator* integrator) {
    return api::read(integrator, nullptr, [](const auto& value) { return value.q(); });
}
const double* lobatto_integrator_p(const lobatto_integrator* integrator) {
    return api::read(integrator, nullptr, [](const auto& value) { return value.p(); });
}
double lobatto_integrator_energy(const lobatto_integrator* integrator) {
    return api::read(integrator, std::nan(""), [](const auto& value) { return value.energy(); });
}

lobatto_trajectory* lobatto_run(const lobatto_scene* scene, const lobatto_settings* settings, int measure) {
    return api::made<lobatto_trajectory>([&](lobatto_trajectory& trajectory) {
        api::RunOptions options;
        static_cast<api::Settings&>(options) = api::settings_of(settings);
        options.measure = measure != 0;
        try {
            trajectory.value = api::run(api::scene_of(scene), options);
        } catch (const api::RunFailure& failure) {
            trajectory.value = failure.trajectory();
            trajectory.events = events_of(trajectory.value->events);
            throw;
        }
        trajectory.events = events_of(trajectory.value->events);
        return trajectory.value->stopped_by.empty();
    });
}
void lobatto_trajectory_free(lobatto_trajectory* trajectory) {
    delete trajectory;
}
int lobatto_trajectory_status(const lobatto_trajectory* trajectory) {
    return api::status_of(trajectory);
}
const char* lobatto_trajectory_message(const lobatto_trajectory* trajectory) {
    return api::message_of(trajectory);
}
size_t lobatto_trajectory_count(const lobatto_trajectory* trajectory) {
    return api::read(trajectory, 0, [](const auto& value) { return value.count; });
}
const double* lobatto_trajectory_t(const lobatto_trajectory* trajectory) {
    return api::read(trajectory, nullptr, [](const auto& value) { return api::data(value.t); });
}
const double* lobatto_trajectory_q(const lobatto_trajectory* trajectory) {
    return api::read(trajectory, nullptr, [](const auto& value) { return api::data(value.q); });
}
const double* lobatto_trajectory_p(const lobatto_trajectory* trajectory) {
    return api::read(trajectory, nullptr, [](const auto& value) { return api::data(value.p); });
}
const double* lobatto_trajectory_energy(const lobatto_trajectory* trajectory) {
    return api::read(trajectory, nullptr, [](const auto& value) { return api::data(value.energy); });
}
const double* lobatto_trajectory_columns(const lobatto_trajectory* trajectory, size_t* columns) {
    if (columns != nullptr)
        *columns = api::read(trajectory, 0, [](const auto& value) { return value.column_names.size(); });
    return api::read(trajectory, nullptr, [](const auto& value) { return api::data(value.columns); });
}
const char* lobatto_trajectory_column(const lobatto_trajectory* trajectory, size_t index) {
    return api::read(trajectory, nullptr, [&](const auto& value) { return api::text(value.column_names, index); });
}
double lobatto_trajectory_error(const lobatto_trajectory* trajectory) {
    return api::read(trajectory, std::nan(""), [](const auto& value) { return value.error.value_or(std::nan("")); });
}
const lobatto_event* lobatto_trajectory_events(const lobatto_trajectory* trajectory, size_t* count) {
    if (count != nullptr) *count = trajectory == nullptr ? 0 : trajectory->events.size();
    return trajectory == nullptr ? nullptr : api::data(trajectory->events);
}
size_t lobatto_trajectory_warnings(const lobatto_trajectory* trajectory) {
    return api::read(trajectory, 0, [](const auto& value) { return value.warnings.size(); });
}
const char* lobatto_trajectory_warning(const lobatto_trajectory* trajectory, size_t index) {
    return api::read(trajectory, nullptr, [&](const auto& value) { return api::text(value.warnings, index); });
}

lobatto_sweep* lobatto_sweep_run(const lobatto_scene* scene, const lobatto_settings* settings, size_t count,
                                 size_t columns, const char* const* names, const double* const* values) {
    return api::made<lobatto_sweep>([&](lobatto_sweep& sweep) {
        api::Starts starts;
        starts.count = count;
        if (columns > 0) {
            require(names, "names");
            require(values, "values");
        }
        for (size_t c = 0; c < columns; ++c) {
            require(names[c], "a name of names");
            require(values[c], names[c]);
            if (starts.columns.contains(names[c]))
                throw api::InputError(fmt::format("the column '{}' is given twice", names[c]));
            starts.columns[names[c]].assign(values[c], values[c] + count);
        }
        api::SweepOptions options;
        static_cast<api::Settings&>(options) = api::settings_of(settings);
        options.measure = false;  // as lobatto.h says
        sweep.value = api::sweep(api::scene_of(scene), starts, options);
    });
}
void lobatto_sweep_free(lobatto_sweep* sweep) {
    delete sweep;
}
int lobatto_sweep_status(const lobatto_sweep* sweep) {
    return api::status_of(sweep);
}
const char* lobatto_sweep_message(const lobatto_sweep* sweep) {
    return api::message_of(sweep);
}
size_t lobatto_sweep_count(const lobatto_sweep* sweep) {
    return api::read(sweep, 0, [](const auto& value) { return value.count; });
}
const int* lobatto_sweep_statuses(const lobatto_sweep* sweep) {
    return api::read(sweep, nullptr, [](const auto& value) { return value.status.data(); });
}
const char* lobatto_sweep_status_text(const lobatto_sweep* sweep, int status) {
    return api::read(sweep, nullptr, [&](const auto& value) {
        return status < 0 ? nullptr : api::text(value.statuses, static_cast<std::size_t>(status));
    });
}
size_t lobatto_sweep_warnings(const lobatto_sweep* sweep) {
    return api::read(sweep, 0, [](const auto& value) { return value.warnings.size(); });
}
const char* lobatto_sweep_warning(const lobatto_sweep* sweep, size_t index) {
    return api::read(sweep, nullptr, [&](const auto& value) { return api::text(value.warnings, index); });
}
const double* lobatto_sweep_t(const lobatto_sweep* sweep) {
    return api::read(sweep, nullptr, [](const auto& value) { return api::data(value.t); });
}
const double* lobatto_sweep_q(const lobatto_sweep* sweep) {
    return api::read(sweep, nullptr, [](const auto& value) { return api::data(value.q); });
}
const double* lobatto_sweep_p(const lobatto_sweep* sweep) {
    return api::read(sweep, nullptr, [](const auto& value) { return api::data(value.p); });
}
const size_t* lobatto_sweep_states_first(const lobatto_sweep* sweep) {
    return api::read(sweep, nullptr, [](const auto& value) { return api::data(value.states.first); });
}
const double* lobatto_sweep_states_t(const lobatto_sweep* sweep) {
    return api::read(sweep, nullptr, [](const auto& value) { return api::data(value.states.t); });
}
const double* lobatto_sweep_states_q(const lobatto_sweep* sweep) {
    return api::read(sweep, nullptr, [](const auto& value) { return api::data(value.states.q); });
}
const double* lobatto_sweep_states_p(const lobatto_sweep* sweep) {
    return api::read(sweep, nullptr, [](const auto& value) { return api::data(value.states.p); });
}

}  // extern "C"
