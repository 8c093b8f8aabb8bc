// SPDX-License-Identifier: GPL-2.0-or-later
// A measurement as JSON and as a row of CSV: the same names, the same numbers.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "analysis/tradeoff/candidate.hpp"

namespace lobatto {

nlohmann::ordered_json json_of(const Measurement& measurement);
Measurement measurement_of(const nlohmann::json& json);  // throws nlohmann::json::exception

std::string csv_header();
std::string csv_row(const Measurement& measurement);

}  // namespace lobatto
