// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/initial_value.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace lobatto {

namespace {

// The rate that a scene gives: q' or p_q, as it is written and by its plain name.
std::vector<std::string> rate_names(const Scene& scene, const Coordinate& coordinate) {
    if (scene.start == Start::velocity) return {coordinate.written + "'", coordinate.name + "'"};
    return {"p_" + coordinate.name};
}

std::size_t moving(const Scene& scene) {
    return scene.coordinates.size() - (scene.has_time_coordinate() ? 1 : 0);
}

}  // namespace

std::optional<InitialValue> initial_value(const Scene& scene, const std::string& name, const std::string& verb,
                                          const std::function<void(const std::string&)>& fail) {
    for (std::size_t k = 0; k < scene.coordinates.size(); ++k) {
        const Coordinate& coordinate = scene.coordinates[k];
        const bool is_position = name == coordinate.written || name == coordinate.name;
        const bool is_velocity = name == coordinate.written + "'" || name == coordinate.name + "'";
        const bool is_momentum = name == "p_" + coordinate.name;
        if (k == moving(scene)) {
            if (is_position || is_velocity || is_momentum)
                fail(fmt::format("{} is of the time, which a clock counts from 0; it cannot be {}", name,
                                 verb == "vary" ? "varied" : verb));
            continue;
        }
        if (is_position) return InitialValue{false, k};
        if (is_velocity || is_momentum) {
            const std::vector<std::string> rates = rate_names(scene, coordinate);
            if (std::find(rates.begin(), rates.end(), name) != rates.end()) return InitialValue{true, k};
            fail(fmt::format("{} gives initial {}, not {}; {} {} instead", scene.path,
                             is_velocity ? "momenta" : "velocities", is_velocity ? "velocities" : "momenta", verb,
                             rates.front()));
        }
    }
    for (const Eliminated& x : scene.eliminated)
        for (const std::string& one : {x.coordinate.written, x.coordinate.name})
            if (name == one || name == one + "'")
                fail(fmt::format("{} is eliminated and follows from others ({}); {} those", one, x.constraint.text,
                                 verb));
    return std::nullopt;
}

std::vector<std::string> initial_names(const Scene& scene) {
    std::vector<std::string> names;
    for (std::size_t k = 0; k < moving(scene); ++k) {
        names.push_back(scene.coordinates[k].written);
        names.push_back(rate_names(scene, scene.coordinates[k]).front());
    }
    return names;
}

}  // namespace lobatto
