// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/scene/time_coordinate.hpp"

#include <algorithm>

namespace lobatto {

namespace {

bool is_taken(const Scene& scene, const std::string& name) {
    const auto is_named = [&](const auto& one) { return one.name == name || one.name == "p_" + name; };
    const auto in = [&](const auto& all) { return std::any_of(all.begin(), all.end(), is_named); };
    return scene.time.get_name() == name || in(scene.coordinates) || in(scene.parameters) || in(scene.constants) ||
           in(scene.outputs.columns);
}

}  // namespace

bool needs_time_coordinate(const Scene& scene) {
    const bool is_forced = std::any_of(scene.coordinates.begin(), scene.coordinates.end(),
                                       [](const Coordinate& one) { return !one.force.is_zero(); });
    return is_forced || scene.lagrangian.has(scene.time) || (scene.clock && scene.clock->rate.has(scene.time));
}

void add_time_coordinate(Scene& scene) {
    if (!scene.clock || scene.clock->has_time_coordinate || !needs_time_coordinate(scene)) return;
    std::string name = "time";
    while (is_taken(scene, name)) name += '_';
    Coordinate time{name, "", GiNaC::symbol(name), GiNaC::symbol(name + "'")};
    scene.coordinates.push_back(time);
    scene.initial_position.emplace_back(0);
    scene.initial_rate.emplace_back(scene.start == Start::velocity ? 1 : 0);  // kernels know the momentum at the start
    if (!scene.outputs.momenta_of_kept.empty()) scene.outputs.momenta_of_kept.emplace_back("p_" + name);
    scene.clock->has_time_coordinate = true;
    scene.clock->energy = GiNaC::symbol("sigma_of_start");
}

Scene without_time_coordinate(Scene scene) {
    if (!scene.has_time_coordinate()) return scene;
    scene.coordinates.pop_back();
    scene.initial_position.pop_back();
    scene.initial_rate.pop_back();
    if (!scene.outputs.momenta_of_kept.empty()) scene.outputs.momenta_of_kept.pop_back();
    scene.clock->has_time_coordinate = false;
    scene.clock->energy = Clock().energy;
    return scene;
}

}  // namespace lobatto
