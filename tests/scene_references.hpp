// SPDX-License-Identifier: GPL-2.0-or-later
// Where the systems of scenes/ are at a given time, computed without any code of this project.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace lobatto::test {

// The state of a scene at a time, by columns of its trajectory, and how far the scene's own step and method may be off.
struct SceneReference {
    std::string scene;
    double time;
    std::vector<std::pair<std::string, double>> state;
    double tolerance;  // absolute, for each number of the state
};

const SceneReference& scene_reference(const std::string& scene);

}  // namespace lobatto::test
