// SPDX-License-Identifier: GPL-2.0-or-later
// lobatto.hpp for Python: classes and functions of the module lobatto._lobatto, which python/lobatto makes pleasant.
//
// Arrays are NumPy's. Those of results own what C++ computed: nothing is copied. Long computations run without the
// interpreter's lock and look for Ctrl-C ten times a second.
#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <lobatto/lobatto.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "settings.hpp"

namespace py = pybind11;
namespace lob = lobatto::api;

namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

// An array that owns the numbers; rows x columns where there are columns.
template <class Number>
py::array owned(std::vector<Number> numbers, py::ssize_t columns = 0) {
    auto* const kept = new std::vector<Number>(std::move(numbers));
    const py::capsule owner(kept, [](void* memory) { delete static_cast<std::vector<Number>*>(memory); });
    const auto size = static_cast<py::ssize_t>(kept->size());
    std::vector<py::ssize_t> shape{size};
    if (columns > 0) shape = {size / columns, columns};
    return py::array_t<Number>(shape, kept->data(), owner);
}

// A row of a stepper, looked at where it lies.
py::array view(const double* numbers, std::size_t count, const py::object& owner) {
    py::array_t<double> array(static_cast<py::ssize_t>(count), numbers, owner);
    array.attr("flags").attr("writeable") = false;
    return array;
}

std::vector<double> vector_of(const Array& array) {
    return {array.data(), array.data() + array.size()};
}

const double* row_of(const Array& array, std::size_t count, const char* what) {
    if (array.ndim() != 1 || static_cast<std::size_t>(array.size()) != count)
        throw lob::InputError(std::string(what) + " is a list of " + std::to_string(count) +
                              (count == 1 ? " number, such as [1.0]" : " numbers, one for each coordinate"));
    return array.data();
}

// Numbers that are all there.
Array whole(const py::object& values, const char* what) {
    if (py::module_::import("numpy.ma").attr("is_masked")(values).cast<bool>())
        throw lob::InputError(std::string(what) + " has masked values");
    return values.cast<Array>();
}

// Whether nobody pressed Ctrl-C, and what the caller's own function says.
template <class... Arguments>
std::function<bool(Arguments...)> watched(const py::object& progress) {
    return [progress](Arguments... arguments) {
        const py::gil_scoped_acquire lock;
        if (PyErr_CheckSignals() != 0) return false;  // its exception stays set
        if (progress.is_none()) return true;
        const py::object answer = progress(arguments...);
        return answer.is_none() || answer.cast<bool>();
    };
}

// What was computed without the interpreter's lock, or the exception that Ctrl-C left. All that takes the lock of
// formulas goes through here: who has that one waits for the interpreter's, to look for Ctrl-C.
template <class Work>
auto unlocked(const Work& work) {
    try {
        auto result = [&] {
            const py::gil_scoped_release release;
            return work();
        }();
        if (PyErr_Occurred() != nullptr) throw py::error_already_set();
        return result;
    } catch (const lob::Error&) {
        if (PyErr_Occurred() != nullptr) throw py::error_already_set();
        throw;
    }
}

// Of a stepper that takes steps, while the interpreter's lock may be another thread's. The lock guards the set.
class InUse {
public:
    explicit InUse(const lob::Stepper& stepper) : stepper_(&stepper) {
        if (!all().insert(stepper_).second)
            throw lob::InputError(
                "this Stepper is taking steps; give each thread one of its own, a copy() from before they begin");
    }
    ~InUse() { all().erase(stepper_); }
    InUse(const InUse&) = delete;
    InUse& operator=(const InUse&) = delete;

private:
    static std::set<const lob::Stepper*>& all() {
        static std::set<const lob::Stepper*> all;
        return all;
    }

    const lob::Stepper* stepper_;
};

// In parts of about a twentieth of a second, between which Ctrl-C is heard; the motion stays where it was then.
bool advance(lob::Stepper& stepper, std::int64_t steps) {
    using Clock = std::chrono::steady_clock;
    bool goes_on = true;
    for (std::int64_t block = 256; goes_on && steps > block;) {
        const Clock::time_point start = Clock::now();
        goes_on = unlocked([&] { return stepper.advance(block); });
        const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        steps -= block;
        block = std::max<std::int64_t>(
            static_cast<std::int64_t>(static_cast<double>(block) * std::min(0.05 / seconds, 8.0)), 1);
    }
    return goes_on && unlocked([&] { return stepper.advance(steps); });
}
// A step, or with a clock the way to the next of the scene's times, tells how long the others are.
bool advance_to(lob::Stepper& stepper, double t) {
    constexpr double few = 256;
    const double about = (t - stepper.t()) / (stepper.next_time() - stepper.t());
    if (about > few && about < 9e15) {
        if (!unlocked([&] { return stepper.advance(1); })) return false;
        const double now = stepper.t(), length = stepper.next_time() - now;
        const double rounding = 4 * std::numeric_limits<double>::epsilon() * std::fmax(std::fabs(t), 1) / length;
        const double steps = std::floor((t - now) / length * (1 - rounding)) - 2;
        if (steps > few && steps < 9e15 && !advance(stepper, static_cast<std::int64_t>(steps))) return false;
    }
    return unlocked([&] { return stepper.advance_to(t); });
}

void start(lob::Stepper& stepper, double t, const py::object& q, const py::object& p, const py::object& velocity,
           const py::object& inputs) {
    if (p.is_none() == velocity.is_none()) throw lob::InputError("start: give p or velocity, one of them");
    const std::size_t n = stepper.coordinates();
    const Array position = whole(q, "q"), rate = p.is_none() ? whole(velocity, "velocity") : whole(p, "p");
    const Array values = inputs.is_none() ? Array(0) : whole(inputs, "inputs");
    const double* const given = inputs.is_none() ? nullptr : row_of(values, stepper.inputs(), "inputs");
    if (p.is_none())
        stepper.start_from_velocity(t, row_of(position, n, "q"), row_of(rate, n, "velocity"), given);
    else
        stepper.start(t, row_of(position, n, "q"), row_of(rate, n, "p"), given);
}
template <class Stepper, class Function, class... Arguments>
auto alone(Stepper& stepper, Function function, const Arguments&... arguments) {
    const InUse in_use(stepper);
    return std::invoke(function, stepper, arguments...);
}
py::object copy_of(const lob::Stepper& stepper) {
    return py::cast(lob::Stepper(stepper));
}
py::object state_at(const lob::Stepper& stepper, double t) {
    auto [q, velocity] = stepper.at(t);
    return py::cast(std::pair(owned(std::move(q)), owned(std::move(velocity))));
}
py::dict columns_of(const lob::Stepper& stepper) {
    py::dict all;
    const std::vector<double> values = stepper.columns();
    for (std::size_t i = 0; i < values.size(); ++i) all[py::str(stepper.column_names()[i])] = values[i];
    return all;
}
py::object sensitivity_of(const lob::Stepper& stepper, const std::string& name) {
    return owned(alone(stepper, &lob::Stepper::sensitivity, name));
}
py::object tangent_of(const lob::Stepper& stepper) {
    return owned(stepper.tangent(), static_cast<py::ssize_t>(2 * stepper.coordinates()));
}

// What the last holder of a scene destroys are formulas, too.
struct Freed {
    template <class T>
    void operator()(T* held) const {
        const py::gil_scoped_release release;
        delete held;
    }
};

std::pair<py::array, py::array> states_at(const lob::Stepper& stepper, const Array& t, const Array& q, const Array& p,
                                          std::int64_t dense, const Array& times) {
    lob::Trajectory run;
    run.t = vector_of(t);
    run.q = vector_of(q);
    run.p = vector_of(p);
    run.dense = dense;
    const std::vector<double> all = vector_of(times);
    auto states = unlocked([&] { return lob::states_at(stepper, run, all); });
    const auto columns = static_cast<py::ssize_t>(stepper.coordinates());
    return {owned(std::move(states.first), columns), owned(std::move(states.second), columns)};
}

py::list events_of(const std::vector<lob::EventHit>& hits, const std::vector<std::string>& names) {
    py::list events;
    for (const lob::EventHit& hit : hits)
        events.append(py::make_tuple(names[static_cast<std::size_t>(hit.kind)], hit.t, owned(hit.q), owned(hit.p)));
    return events;
}

py::dict dict_of(lob::Trajectory&& run) {
    const auto n = static_cast<py::ssize_t>(run.coordinates.size());
    py::dict dict;
    dict["coordinates"] = run.coordinates;
    dict["t"] = owned(std::move(run.t));
    dict["q"] = owned(std::move(run.q), n);
    dict["p"] = owned(std::move(run.p), n);
    dict["H"] = run.energy.empty() ? py::object(py::none()) : py::object(owned(std::move(run.energy)));
    dict["columns"] = owned(std::move(run.columns), static_cast<py::ssize_t>(run.column_names.size()));
    dict["column_names"] = run.column_names;
    dict["events"] = events_of(run.events, run.event_names);
    dict["event_names"] = run.event_names;
    dict["steps"] = run.steps;
    dict["seconds"] = run.seconds;
    dict["stopped_by"] = run.stopped_by;
    dict["reaches_end"] = run.reaches_end;
    dict["interrupted"] = run.interrupted;
    dict["method"] = run.method;
    dict["digest"] = run.digest;
    dict["step"] = run.step;
    dict["dense"] = run.dense;
    dict["error"] = run.error;
    dict["largest_error"] = run.largest_error;
    dict["doubling"] = run.doubling;
    dict["warnings"] = run.warnings;
    return dict;
}

py::dict run(const lob::Scene& scene, bool measure, const std::string& companion, bool beyond_horizon,
             const py::object& progress, const py::kwargs& given) {
    lob::RunOptions options;
    static_cast<lob::Settings&>(options) = settings_of(given);
    options.measure = measure;
    options.companion = companion;
    options.beyond_horizon = beyond_horizon;
    options.progress = watched<double>(progress);
    return dict_of(unlocked([&] { return lob::run(scene, options); }));
}

// None where none were kept.
py::object states_of(lob::Sweep::States&& states, py::ssize_t n) {
    if (states.first.empty()) return py::none();
    py::dict dict;
    dict["first"] = owned(std::move(states.first));
    dict["t"] = owned(std::move(states.t));
    dict["q"] = owned(std::move(states.q), n);
    dict["p"] = owned(std::move(states.p), n);
    dict["energy_error"] = owned(std::move(states.energy_error));
    return dict;
}

py::dict sweep(const lob::Scene& scene, const py::dict& columns, const std::vector<std::string>& keep, int threads,
               bool measure, bool beyond_horizon, const py::object& progress, const py::kwargs& given) {
    lob::Starts starts;
    for (const auto& [name, values] : columns) {
        const auto array = values.cast<Array>();
        starts.columns[std::string(py::str(name))].assign(array.data(), array.data() + array.size());
        starts.count = static_cast<std::size_t>(array.size());
    }
    lob::SweepOptions options;
    static_cast<lob::Settings&>(options) = settings_of(given);
    options.keep = keep;
    options.threads = threads;
    options.measure = measure;
    options.beyond_horizon = beyond_horizon;
    options.progress = watched<double>(progress);
    lob::Sweep result = unlocked([&] { return lob::sweep(scene, starts, options); });
    const auto n = static_cast<py::ssize_t>(result.coordinates.size());
    py::dict dict, kept;
    const std::size_t kinds = result.kept_names.size();
    for (std::size_t k = 0; k < kinds; ++k) {
        std::vector<double> column(result.count);
        for (std::size_t i = 0; i < result.count; ++i) column[i] = result.kept[i * kinds + k];
        kept[py::str(result.kept_names[k])] = owned(std::move(column));
    }
    dict["coordinates"] = result.coordinates;
    dict["status"] = owned(std::move(result.status));
    dict["steps"] = owned(std::move(result.steps));
    dict["stop"] = owned(std::move(result.stop));
    dict["t"] = owned(std::move(result.t));
    dict["q"] = owned(std::move(result.q), n);
    dict["p"] = owned(std::move(result.p), n);
    dict["energy_error"] = owned(std::move(result.energy_error));
    dict["error"] = result.error.empty() ? py::object(py::none()) : py::object(owned(std::move(result.error)));
    dict["kept"] = kept;
    dict["statuses"] = result.statuses;
    dict["interrupted"] = result.interrupted;
    dict["warnings"] = result.warnings;
    dict["_states"] = states_of(std::move(result.states), n);
    return dict;
}

py::dict tune(const lob::Scene& scene, double error, double budget, const py::object& progress,
              const py::kwargs& given) {
    const lob::Settings settings = settings_of(given);
    const auto going_on = watched<const std::string&>(progress);
    const lob::Choice choice = unlocked([&] { return lob::tune(scene, error, settings, budget, going_on); });
    py::dict dict;
    dict["settings"] = dict_of_settings(choice.settings);
    dict["method"] = choice.method;
    dict["step"] = choice.step;
    dict["until"] = choice.until;
    dict["predicted_error"] = choice.predicted_error;
    dict["seconds"] = choice.seconds;
    dict["complete"] = choice.complete;
    return dict;
}

// Python's exceptions, with the texts and the exit codes of the command line.
void add_errors(py::module_& module) {
    static py::exception<lob::Error> error(module, "Error", PyExc_RuntimeError);
    const auto under = [](PyObject* other) { return py::make_tuple(error, py::handle(other)); };
    static py::exception<lob::InputError> input(module, "InputError", under(PyExc_ValueError));
    static py::exception<lob::ComputationError> computation(module, "ComputationError", under(PyExc_ArithmeticError));
    static py::exception<lob::MachineError> machine(module, "MachineError", under(PyExc_OSError));
    static py::exception<lob::RunFailure> failure(module, "RunFailure", computation);
    py::register_exception_translator([](std::exception_ptr thrown) {
        try {
            std::rethrow_exception(std::move(thrown));
        } catch (const lob::RunFailure& caught) {
            py::object exception = static_cast<py::object>(failure)(caught.what());
            exception.attr("trajectory") = dict_of(lob::Trajectory(caught.trajectory()));
            PyErr_SetObject(failure.ptr(), exception.ptr());
        } catch (const lob::InputError& caught) {
            PyErr_SetString(input.ptr(), caught.what());
        } catch (const lob::ComputationError& caught) {
            PyErr_SetString(computation.ptr(), caught.what());
        } catch (const lob::MachineError& caught) {
            PyErr_SetString(machine.ptr(), caught.what());
        }
    });
}

void add_scene(py::module_& module) {
    py::class_<lob::Variable>(module, "Variable", "A coordinate or a parameter.")
        .def(py::pickle(
            [](const lob::Variable& variable) { return py::make_tuple(variable.name, variable.unit, variable.value); },
            [](const py::tuple& state) {
                return lob::Variable{state[0].cast<std::string>(), state[1].cast<std::string>(),
                                     state[2].cast<double>()};
            }))
        .def_readonly("name", &lob::Variable::name)
        .def_readonly("unit", &lob::Variable::unit)
        .def_readonly("value", &lob::Variable::value, "A coordinate's initial position; a parameter's value.")
        .def("__repr__", [](const lob::Variable& variable) {
            return "Variable(" + variable.name + " = " + std::string(py::repr(py::float_(variable.value))) +
                   (variable.unit.empty() ? "" : " " + variable.unit) + ")";
        });
    const auto text = [](auto function) {
        return [function](const lob::Scene& scene, const py::kwargs& given) {
            const lob::Settings settings = settings_of(given);
            return unlocked([&] { return (scene.*function)(settings); });
        };
    };
    using Scenes = py::class_<lob::Scene, std::unique_ptr<lob::Scene, Freed>>;
    const py::call_guard<py::gil_scoped_release> without_lock;
    Scenes(module, "Scene", "A mechanical system, read from a scene file and checked.")
        .def(py::init([](const std::filesystem::path& path) {
                 if (path.string().find('\n') != std::string::npos)
                     throw lob::InputError(
                         "this is the text of a scene, not the path of its file: write Scene.from_text(text)");
                 return lob::Scene(path.string());
             }),
             py::arg("path"), without_lock)
        .def(py::pickle([](const lob::Scene& scene) { return py::make_tuple(scene.text(), scene.path()); },
                        [](const py::tuple& state) {
                            const auto text = state[0].cast<std::string>(), path = state[1].cast<std::string>();
                            return unlocked([&] { return lob::Scene::from_text(text, path); });
                        }))
        .def_static("from_text", &lob::Scene::from_text, py::arg("text"), py::arg("path") = "scene.toml", without_lock,
                    "The text of a scene file; `path` stands in errors.")
        .def_property_readonly("path", &lob::Scene::path)
        .def_property_readonly("name", &lob::Scene::name)
        .def_property_readonly("title", &lob::Scene::title)
        .def_property_readonly("text", &lob::Scene::text, "Of the scene file.")
        .def_property_readonly("lagrangian", &lob::Scene::lagrangian)
        .def_property_readonly("coordinates", &lob::Scene::coordinates)
        .def_property_readonly("parameters", &lob::Scene::parameters, "Inputs too.")
        .def_property_readonly("inputs", &lob::Scene::inputs)
        .def_property_readonly("events", &lob::Scene::events)
        .def_property_readonly("method", &lob::Scene::method)
        .def_property_readonly("step", &lob::Scene::step)
        .def_property_readonly("until", &lob::Scene::until)
        .def_property_readonly("starts_with_momenta", &lob::Scene::starts_with_momenta)
        .def("_derivation_text", text(&lob::Scene::derivation))
        .def("_derivation_latex", text(&lob::Scene::derivation_latex))
        .def("_derivation_json", text(&lob::Scene::derivation_json))
        .def("_check_json", text(&lob::Scene::check_json))
        .def("_stability_json", text(&lob::Scene::stability_json))
        .def("emit", text(&lob::Scene::emit), "The integrator as one C++17 header: (file name, text).")
        .def("emit_plain", text(&lob::Scene::emit_plain), "The integrator as a textbook prints it: (file name, text).")
        .def("__repr__",
             [](const lob::Scene& scene) { return "Scene('" + scene.path() + "': " + scene.title() + ")"; });
}

lob::Stepper stepper_of(const lob::Scene& scene, const py::kwargs& given) {
    const lob::Settings settings = settings_of(given);
    return unlocked([&] { return lob::Stepper(lob::compile(scene, settings)); });
}
lob::Stepper stepper_of_file(const py::object& path, const py::kwargs& given) {
    return stepper_of(lob::Scene(py::cast<std::string>(py::module_::import("os").attr("fspath")(path))), given);
}

void add_stepper(py::module_& module) {
    const auto vector = [](const py::object& self, const double* (lob::Stepper::*function)() const) {
        const auto& stepper = self.cast<const lob::Stepper&>();
        return view((stepper.*function)(), stepper.coordinates(), self);
    };
    using Steppers = py::class_<lob::Stepper, std::unique_ptr<lob::Stepper, Freed>>;
    Steppers(module, "Stepper",
             "A trajectory that the caller takes forward.\n\n"
             "q and p are read-only views of where the motion is now; copy them to keep them.")
        .def(py::init(&stepper_of), py::arg("scene"))
        .def(py::init(&stepper_of_file), py::arg("path"))
        .def(
            "step", [](lob::Stepper& stepper) { return alone(stepper, &lob::Stepper::step); },
            "One step. False where a stop of the scene ended the motion.")
        .def(
            "advance", [](lob::Stepper& stepper, std::int64_t steps) { return alone(stepper, &advance, steps); },
            py::arg("steps"), "So many steps. False where a stop ended the motion.")
        .def(
            "advance_to", [](lob::Stepper& stepper, double t) { return alone(stepper, &advance_to, t); }, py::arg("t"),
            "Equal steps while they fit, then a shorter one that ends at t exactly.")
        .def(
            "start",
            [](lob::Stepper& stepper, double t, const py::object& q, const py::object& p, const py::object& velocity,
               const py::object& inputs) { alone(stepper, &start, t, q, p, velocity, inputs); },
            py::arg("t"), py::arg("q"), py::arg("p") = py::none(), py::kw_only(), py::arg("velocity") = py::none(),
            py::arg("inputs") = py::none(),
            "Another place to go on from: positions, and momenta or velocities; with other inputs, if given.")
        .def(
            "set",
            [](lob::Stepper& stepper, const std::string& name, double value) {
                alone(stepper, &lob::Stepper::set, name, value);
            },
            py::arg("name"), py::arg("value"), "A parameter or an input, from the next step on.")
        .def(
            "set_inputs",
            [](lob::Stepper& stepper, const Array& values) {
                const std::size_t wanted = stepper.inputs();
                if (values.ndim() != 1 || static_cast<std::size_t>(values.size()) != wanted)
                    throw lob::InputError("set_inputs needs " + std::to_string(wanted) +
                                          " numbers, one for each input of the scene");
                alone(stepper, &lob::Stepper::set_inputs, values.data());
            },
            py::arg("values"), "All inputs of the scene, in its order, from the next step on.")
        .def("parameter", &lob::Stepper::parameter, py::arg("name"))
        .def(
            "copy", [](const lob::Stepper& stepper) { return alone(stepper, &copy_of); }, "A second motion from here.")
        .def("__copy__", [](const lob::Stepper& stepper) { return alone(stepper, &copy_of); })
        .def("__deepcopy__", [](const lob::Stepper& stepper, const py::dict&) { return alone(stepper, &copy_of); })
        .def_property_readonly("t", &lob::Stepper::t)
        .def_property_readonly("q", [vector](const py::object& self) { return vector(self, &lob::Stepper::q); })
        .def_property_readonly("p", [vector](const py::object& self) { return vector(self, &lob::Stepper::p); })
        .def_property_readonly("velocity", [](const lob::Stepper& stepper) { return owned(stepper.velocity()); })
        .def_property_readonly(
            "H", &lob::Stepper::energy,
            "The energy; not a number where the scene leaves it out and the motion does not conserve it.")
        .def_property_readonly("multipliers", [](const lob::Stepper& stepper) { return owned(stepper.multipliers()); })
        .def_property_readonly("columns", &columns_of,
                               "What follows from the coordinates, by name: eliminated ones and "
                               "their velocities, rotations and places of bodies.")
        .def_property_readonly("step_size", &lob::Stepper::step_size)
        .def(
            "at", [](const lob::Stepper& stepper, double t) { return alone(stepper, &state_at, t); }, py::arg("t"),
            "Position and velocity at a time inside the last step, on its own polynomial: velocities to a lower order "
            "than "
            "those of the steps.")
        .def(
            "tangent", [](const lob::Stepper& stepper) { return alone(stepper, &tangent_of); },
            "d(q1, p1)/d(q, p) of the next step, 2n x 2n; with a clock there is none.")
        .def("sensitivity", &sensitivity_of, py::arg("name"),
             "d(q1, p1)/d(parameter or input) of the next step, 2n, to about ten digits.")
        .def(
            "take_events", [](lob::Stepper& stepper) { return events_of(stepper.take_events(), stepper.events()); },
            "Events, stops and impacts since the last call: (what, t, q, p); of an impact the momenta after it.")
        .def_property_readonly("next_time", &lob::Stepper::next_time,
                               "Where step() leads to, unless a stop comes before it.")
        .def("_states_at", &states_at);
}

}  // namespace

PYBIND11_MODULE(_lobatto, module) {
    module.attr("__version__") = lob::version();
    add_errors(module);
    add_scene(module);
    add_stepper(module);
    module.def("run", &run, py::arg("scene"), py::arg("measure"), py::arg("companion"), py::arg("beyond_horizon"),
               py::arg("progress"));
    module.def("sweep", &sweep, py::arg("scene"), py::arg("starts"), py::arg("keep"), py::arg("threads"),
               py::arg("measure"), py::arg("beyond_horizon"), py::arg("progress"));
    module.def("tune", &tune, py::arg("scene"), py::arg("error"), py::arg("budget"), py::arg("progress"));
    module.def("verify", [](const lob::Scene& scene, const py::kwargs& given) {
        const lob::Settings settings = settings_of(given);
        const auto going_on = watched<const std::string&>(py::none());  // hears Ctrl-C
        const auto claims = unlocked([&] { return lob::verify(scene, settings, going_on); });
        py::list rows;
        for (const lob::Claim& claim : claims)
            rows.append(py::make_tuple(claim.claim, claim.measured, claim.bound, claim.holds));
        return rows;
    });
}
