// SPDX-License-Identifier: GPL-2.0-or-later
// The functions of a kernel: how each is declared and what its comment says.
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "generator/mechanics/structure/structure.hpp"

namespace lobatto {

// The parameters are named as the programs' inputs are; `time` is added where a kernel depends on it.
struct Declaration {
    const char* program;
    const char* comment;
    const char* result;
    std::vector<std::pair<const char*, const char*>> parameters;  // type, name; `real` is any number in a template
    bool takes_time = false;
    bool any_number = false;  // a template on the type of its values: one state, or many side by side
};

const std::vector<Declaration>& declarations(StepForm form);

// A struct cannot have the name of one of its members.
const std::set<std::string>& member_names();  // the constants and types
bool is_member_name(const std::string& name);

}  // namespace lobatto
