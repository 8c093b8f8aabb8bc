// SPDX-License-Identifier: GPL-2.0-or-later
// A derivation for machines: JSON with every formula as text, keys in a fixed order (docs/derivation.md, last section).
#include <nlohmann/json.hpp>

#include "generator/describe/describe.hpp"
#include "generator/graph/notation.hpp"

namespace lobatto {

namespace {

using Json = nlohmann::ordered_json;

// A string, a list of strings, or a list of rows, as the shape says.
Json value_of(const Formula& formula) {
    if (formula.shape.empty()) return canonical_text(formula.values.front());
    Json all = Json::array();
    for (const GiNaC::ex& value : formula.values) all.push_back(canonical_text(value));
    if (formula.shape.size() == 1) return all;
    Json rows = Json::array();
    for (std::size_t i = 0; i < formula.shape[0]; ++i) {
        Json row = Json::array();
        for (std::size_t j = 0; j < formula.shape[1]; ++j) row.push_back(all[i * formula.shape[1] + j]);
        rows.push_back(row);
    }
    return rows;
}

}  // namespace

std::string json_of(const Description& description) {
    Json document;
    document["format"] = 1;
    document["scene"] = description.name;
    document["title"] = description.title;
    document["facts"] = Json::object();
    for (const auto& [name, value] : description.facts) document["facts"][name] = value;
    document["formulas"] = Json::array();
    for (const Section& section : description.sections)
        for (const Formula& formula : section.formulas) {
            Json left = formula.left;
            if (formula.shape.size() != 1) left = formula.left.front();
            document["formulas"].push_back({{"id", formula.id},
                                            {"number", formula.number},
                                            {"paper", formula.paper},
                                            {"section", section.title},
                                            {"meaning", formula.meaning},
                                            {"shape", formula.shape},
                                            {"left", left},
                                            {"value", value_of(formula)}});
        }
    document["structure"] = Json::array();
    for (const Finding& finding : description.findings)
        document["structure"].push_back({{"name", finding.name}, {"holds", finding.holds}, {"reason", finding.reason}});
    return document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace lobatto
