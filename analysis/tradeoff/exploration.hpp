// SPDX-License-Identifier: GPL-2.0-or-later
// The trade of speed for accuracy over the whole family, from coarse to fine, refined where something wins.
#pragma once

#include <vector>

#include "analysis/tradeoff/experiment.hpp"

namespace lobatto {

// Returns when time is up or all has been seen: the members for which there was no time. What it measured is in the
// experiment's store.
std::vector<Member> explore(Experiment& experiment);
std::vector<Member> first_of_tour();  // the kernels it begins with

// Of all in the store those than which no other is both faster and more accurate; from coarse to fine.
std::vector<Measurement> pareto_front(const Experiment& experiment);

}  // namespace lobatto
