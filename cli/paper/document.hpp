// SPDX-License-Identifier: GPL-2.0-or-later
// The validation against the paper as text: Markdown for docs/paper.md, lines for a terminal.
#pragma once

#include <string>
#include <vector>

#include "cli/paper/figures.hpp"
#include "cli/paper/tables.hpp"
#include "generator/paper/paper.hpp"

namespace lobatto {

// Summary, misprints, the whole walk: depends on nothing but the derivations.
std::string walk_document(const std::vector<paper::Finding>& findings);
std::string table_document(const PaperTable& table);
std::string figure_document(const std::vector<Figure>& figures);

std::string walk_lines(const std::vector<paper::Finding>& findings);
std::string table_lines(const PaperTable& table);
std::string growth_lines(const std::vector<Figure>& figures);

// For machines: one line of JSON (docs/schemas/paper.json).
std::string paper_json(const std::string& document, const std::vector<paper::Finding>& findings,
                       const std::vector<PaperTable>& tables);

}  // namespace lobatto
