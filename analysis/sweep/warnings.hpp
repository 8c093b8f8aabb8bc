// SPDX-License-Identifier: GPL-2.0-or-later
// What a sweep warns of when it has ended.
#pragma once

#include <string>
#include <vector>

#include "analysis/sweep/study.hpp"
#include "analysis/sweep/tally.hpp"

namespace lobatto {

// A step or an end that a varied parameter decides; a large error. Sentences without their period.
std::vector<std::string> warnings_of(const SweepStudy& study, const Worst& error);

}  // namespace lobatto
