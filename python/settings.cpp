// SPDX-License-Identifier: GPL-2.0-or-later
#include "settings.hpp"

#include <cmath>
#include <string>
#include <type_traits>
#include <utility>

namespace py = pybind11;
namespace lob = lobatto::api;

namespace {

// The value of an argument; TypeError where it is of another kind.
template <class Number>
Number number_of(const std::string& name, const py::handle& value) {
    try {
        return value.cast<Number>();
    } catch (const py::cast_error&) {
        throw py::type_error(name + " needs a " + (std::is_integral_v<Number> ? "whole number" : "number") + ", not " +
                             std::string(py::repr(value)));
    }
}

// As the scene has it: a formula, or a number with all its digits.
std::string formula_of(const std::string& name, const py::handle& value) {
    if (py::isinstance<py::str>(value)) return std::string(py::str(value));
    const auto number = number_of<double>(name, value);
    if (!std::isfinite(number)) throw lob::InputError(name + ": " + std::string(py::repr(value)) + " is no value");
    return std::string(py::repr(py::float_(number)));
}

}  // namespace

lob::Settings settings_of(const py::kwargs& given) {
    lob::Settings settings;
    const auto text = [](const py::handle& value) { return std::string(py::str(value)); };
    for (const auto& [key, value] : given) {
        const std::string name = text(key);
        if (value.is_none()) continue;
        if (name == "points")
            settings.points = number_of<int>(name, value);
        else if (name == "stages")
            settings.stages = number_of<int>(name, value);
        else if (name == "splitting")
            settings.splitting = number_of<int>(name, value);
        else if (name == "tolerance")
            settings.tolerance = number_of<double>(name, value);
        else if (name == "every")
            settings.every = number_of<double>(name, value);
        else if (name == "arithmetic")
            settings.arithmetic = text(value);
        else if (name == "numbers")
            settings.numbers = text(value);
        else if (name == "clock")
            settings.clock = text(value);
        else if (name == "step")
            settings.step = formula_of(name, value);
        else if (name == "until")
            settings.until = formula_of(name, value);
        else if (name == "set")
            for (const auto& [parameter, formula] : value.cast<py::dict>())
                settings.set.emplace_back(text(parameter), formula_of(text(parameter), formula));
        else
            throw py::type_error("unknown setting '" + name +
                                 "'; there are points, stages, splitting, tolerance, arithmetic, numbers, clock, step, "
                                 "until, every and set");
    }
    return settings;
}

py::dict dict_of_settings(const lob::Settings& settings) {
    py::dict dict;
    if (settings.points) dict["points"] = *settings.points;
    if (settings.stages) dict["stages"] = *settings.stages;
    if (settings.splitting) dict["splitting"] = *settings.splitting;
    if (settings.tolerance) dict["tolerance"] = *settings.tolerance;
    if (settings.every) dict["every"] = *settings.every;
    for (const auto& [name, value] : {std::pair("arithmetic", settings.arithmetic),
                                      {"numbers", settings.numbers},
                                      {"clock", settings.clock},
                                      {"step", settings.step},
                                      {"until", settings.until}})
        if (!value.empty()) dict[name] = value;
    if (!settings.set.empty()) {
        py::dict set;
        for (const auto& [name, value] : settings.set) set[py::str(name)] = value;
        dict["set"] = set;
    }
    return dict;
}
