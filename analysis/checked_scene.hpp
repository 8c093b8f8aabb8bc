// SPDX-License-Identifier: GPL-2.0-or-later
// What the generator found in a scene, what its kernel gives beside the motion, and what that costs.
#pragma once

#include <string>
#include <vector>

#include "generator/mechanics/derivation.hpp"

namespace lobatto {

// What a kernel gives beside the motion: whether it was asked for, in words, and its operations.
struct CheckedOutput {
    std::string name;
    bool asked = false;
    std::string text;
    long operations = 0;
};

struct Checked {
    Derivation derivation, without;  // without shortcuts
    long operations = 0, operations_without = 0;
    std::vector<CheckedOutput> outputs;
    double seconds = 0;  // to derive and write the kernel
};

// `general`: with no shortcut.
Checked check_scene(Scene scene, Shortcuts shortcuts = Shortcuts::all);
// For machines.
std::string json_of(const Checked& checked);

}  // namespace lobatto
