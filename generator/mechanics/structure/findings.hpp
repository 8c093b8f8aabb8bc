// SPDX-License-Identifier: GPL-2.0-or-later
// Findings that are only told: what a scene asks for, and why a system is not linear.
#pragma once

#include <string>
#include <vector>

#include "generator/mechanics/system/system.hpp"
#include "generator/scene/scene.hpp"

namespace lobatto {

struct Finding {
    std::string name;  // "linear system"
    bool holds = false;
    std::string reason;  // "every second derivative of V is free of q"
};

bool has_any(const GiNaC::ex& expression, const std::vector<GiNaC::symbol>& symbols);

std::string name_of(const System& system, int coordinate);
// x, y, z and 9 more
std::string names_of(const System& system, const std::vector<int>& coordinates);

// Coordinates that constraints eliminated, and why others were not.
std::vector<Finding> elimination_findings(const Scene& scene);
// Of a scene with constraints.
Finding constraint_finding(const Scene& scene, const System& system);
// Time, forces, inputs, measured values, constants.
std::vector<Finding> scene_findings(const Scene& scene, const System& system);
// Why a system is not linear, by a second derivative that is not constant: "d2V/dadb = 2*a depends on the position".
std::string curvature_text(const System& system);

}  // namespace lobatto
