// SPDX-License-Identifier: GPL-2.0-or-later
// The symbols that the formulas of a system are written in.
#pragma once

#include <ginac/ginac.h>

#include <vector>

namespace lobatto {

struct SystemSymbols {
    int n = 0;                              // coordinates
    std::vector<GiNaC::symbol> q, v;        // n each: positions, velocities
    GiNaC::symbol t;                        // time
    std::vector<GiNaC::symbol> parameters;  // run-time parameters, scene order
    std::vector<GiNaC::symbol> inputs;      // those of them that may change between steps
};

}  // namespace lobatto
