// SPDX-License-Identifier: GPL-2.0-or-later
// What the measurements say: a table for the terminal, CSV and JSON for machines, pictures and a page for people.
#pragma once

#include <string>
#include <vector>

#include "analysis/tradeoff/experiment.hpp"

namespace lobatto {

// What is to be said before any number: what the errors are errors of.
std::string reference_text(const Experiment& experiment);

// Pareto's front, thinned to about two rows a decade.
std::vector<Measurement> front_rows_of(const Experiment& experiment);
std::string front_table(const Experiment& experiment);

std::string csv_of(const Experiment& experiment);
std::string json_of(const Experiment& experiment);

}  // namespace lobatto
