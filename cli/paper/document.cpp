// SPDX-License-Identifier: GPL-2.0-or-later
// Formulas, tables and figures as text.
#include "cli/paper/document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace lobatto {

using paper::Verdict;

namespace {

constexpr Verdict verdicts[] = {Verdict::verified, Verdict::up_to_factor, Verdict::misprint, Verdict::inconsistent,
                                Verdict::definition};

// In a Markdown table a bar ends the cell, even inside code.
std::string cell(std::string text) {
    for (std::size_t at = text.find('|'); at != std::string::npos; at = text.find('|', at + 2)) text.insert(at, "\\");
    return text;
}

std::string code(const std::string& text) {
    return "`" + cell(text) + "`";
}

std::ptrdiff_t count(const std::vector<paper::Finding>& findings, Verdict verdict) {
    return std::count_if(findings.begin(), findings.end(),
                         [=](const paper::Finding& finding) { return finding.verdict == verdict; });
}

std::string counts(const std::vector<paper::Finding>& findings) {
    std::string text;
    for (Verdict verdict : verdicts)
        text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count(findings, verdict), name(verdict));
    return text;
}

// The verdict with what belongs to it.
std::string verdict_cell(const paper::Finding& finding) {
    std::string text = "**" + name(finding.verdict) + "**";
    if (finding.verdict == Verdict::up_to_factor) text += " " + code(finding.mended);
    if (finding.verdict == Verdict::misprint) text += ", see above";
    if (finding.verdict == Verdict::inconsistent) text += ": " + cell(finding.mended);
    return text;
}

std::string ratio_text(const TableRow& row, int k) {
    return row.rounding ? "rounding" : fmt::format("{:.4f}", row.lobatto[k] / row.printed[k]);
}

// The order between a mesh and the one before; below 1e-13 the error is rounding.
std::string order_text(const double (&errors)[3], int k) {
    if (k == 0) return "";
    return errors[k - 1] < 1e-13 ? "–" : fmt::format("{:.2f}", TableRow::order(errors[k - 1], errors[k]));
}

}  // namespace

std::string walk_document(const std::vector<paper::Finding>& findings) {
    std::string text = fmt::format(
        "# The paper, formula by formula\n\n"
        "Written by `lobatto paper`. It reads F. Dubois and J. A. Rojas-Quintero, *A variational symplectic scheme "
        "based on "
        "Lobatto's quadrature*, Lecture Notes in Computer Science 16034 (2025), 332–342: every displayed formula, and "
        "every "
        "sentence that carries mathematics. Each is compared as printed with what the definitions give: moments of the "
        "quadrature, Lagrange polynomials, the discrete Lagrangian differentiated. The comparison is exact, over "
        "ℚ(√5), and is "
        "repeated with 50 digits at two points. A formula stands up to a factor when it is the derived equation in "
        "another "
        "normalisation.\n\n"
        "Of {} statements: {}. The scheme itself is right in every formula that defines it, and the published errors "
        "are "
        "reproduced; the misprints touch neither the scheme, nor its order, nor the published errors.\n\n## "
        "Misprints\n\n",
        findings.size(), counts(findings));
    for (const paper::Finding& finding : findings) {
        if (finding.verdict != Verdict::misprint) continue;
        text += fmt::format("**{}** (section {}): {}\n\n", finding.label, finding.section, finding.what);
        // A whole matrix is in the table below; the correction names its element.
        if (finding.printed.size() < 300) text += fmt::format("- printed: `{}`\n", finding.printed);
        text += fmt::format("- correct: `{}`\n- numbers: {}\n\n", finding.mended, finding.demonstration);
    }
    text +=
        "## All statements\n\nUnnumbered formulas are named by the label before or after them. The paper's brackets, "
        "products and indices are written on one line: `q_{1−ξ}`, `V′_ξ`.\n";
    std::string section;
    for (const paper::Finding& finding : findings) {
        if (finding.section != section) {
            section = finding.section;
            text += fmt::format("\n### Section {}\n\n| where | printed | verdict | derived from |\n|---|---|---|---|\n",
                                section);
        }
        const std::string route = finding.verdict == Verdict::misprint ? "" : cell(finding.demonstration);
        text += fmt::format("| **{}**<br>{} | {} | {} | {} |\n", cell(finding.label), cell(finding.what),
                            code(finding.printed), verdict_cell(finding), route);
    }
    return text;
}

std::string table_document(const PaperTable& table) {
    std::string text = fmt::format(
        "\n## {}\n\n| error | N | paper | Lobatto | ratio | order | Simpson | order | implicit midpoint | order |\n"
        "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
        table.title);
    for (const TableRow& row : table.rows)
        for (int k = 0; k < 3; ++k)
            text += fmt::format("| {} | {} | {:.2e} | {:.2e} | {} | {} | {:.2e} | {} | {:.2e} | {} |\n",
                                k == 0 ? row.quantity : "", table.meshes[k], row.printed[k], row.lobatto[k],
                                ratio_text(row, k), order_text(row.lobatto, k), row.simpson[k],
                                order_text(row.simpson, k), row.midpoint[k], order_text(row.midpoint, k));
    return text;
}

std::string figure_document(const std::vector<Figure>& figures) {
    std::string text = "\n## Figures\n";
    for (const Figure& figure : figures) {
        text += fmt::format("\n### {}\n\n![{}](paper/{}.svg)\n\n{} Data: [{}.csv](paper/{}.csv).\n", figure.title,
                            figure.title, figure.name, figure.caption, figure.name, figure.name);
        if (figure.growth.empty()) continue;
        text +=
            "\nGrowth of the running maximum, least-squares slope per period:\n\n"
            "| h | paper's caption | ours, double | ours, extended | maximum | rounding, plain | rounding, clean |\n"
            "|--:|--:|--:|--:|--:|--:|--:|\n";
        for (const Growth& growth : figure.growth)
            text += fmt::format("| {} | {:.2e} | {:.2e} | {:.2e} | {:.2e} | {:.1e} | {:.1e} |\n", growth.step,
                                growth.printed, growth.slope, growth.slope_extended, growth.largest,
                                growth.rounding_plain, growth.rounding_clean);
        text += "\n" + figure.remark + "\n";
    }
    return text;
}

std::string walk_lines(const std::vector<paper::Finding>& findings) {
    std::size_t widest = 0;
    const auto width = [](const std::string& label) {  // code points
        return static_cast<std::size_t>(
            std::count_if(label.begin(), label.end(), [](char c) { return (c & 0xC0) != 0x80; }));
    };
    for (const paper::Finding& finding : findings) widest = std::max(widest, width(finding.label));
    std::string text;
    for (const paper::Finding& finding : findings) {
        text += fmt::format("§{} {}{}  {:<22}  {}\n", finding.section, finding.label,
                            std::string(widest - width(finding.label), ' '), name(finding.verdict), finding.what);
        if (finding.verdict == Verdict::misprint || finding.verdict == Verdict::inconsistent)
            text += fmt::format("     {} {}\n",
                                finding.verdict == Verdict::misprint ? "correct:" : "instead:", finding.mended);
    }
    return text + fmt::format("{} statements: {}.\n", findings.size(), counts(findings));
}

std::string table_lines(const PaperTable& table) {
    std::string text =
        fmt::format("\n{}\n{:<20}{:>5}{:>11}{:>11}{:>10}{:>7}{:>11}{:>7}{:>11}{:>7}\n", table.title, "error", "N",
                    "paper", "Lobatto", "ratio", "order", "Simpson", "order", "midpoint", "order");
    for (const TableRow& row : table.rows)
        for (int k = 0; k < 3; ++k)
            text += fmt::format("{:<20}{:>5}{:>11.2e}{:>11.2e}{:>10}{:>7}{:>11.2e}{:>7}{:>11.2e}{:>7}\n",
                                k == 0 ? row.quantity : "", table.meshes[k], row.printed[k], row.lobatto[k],
                                ratio_text(row, k), order_text(row.lobatto, k), row.simpson[k],
                                order_text(row.simpson, k), row.midpoint[k], order_text(row.midpoint, k));
    return text;
}

std::string growth_lines(const std::vector<Figure>& figures) {
    std::string text;
    for (const Figure& figure : figures) {
        if (figure.growth.empty()) continue;
        text +=
            fmt::format("\n{}: growth per period\n{:>8}{:>11}{:>14}{:>16}{:>11}{:>17}{:>17}\n", figure.title, "h",
                        "caption", "ours, double", "ours, extended", "maximum", "rounding, plain", "rounding, clean");
        for (const Growth& growth : figure.growth)
            text += fmt::format("{:>8}{:>11.2e}{:>14.2e}{:>16.2e}{:>11.2e}{:>17.1e}{:>17.1e}\n", growth.step,
                                growth.printed, growth.slope, growth.slope_extended, growth.largest,
                                growth.rounding_plain, growth.rounding_clean);
    }
    return text;
}

namespace {

const char* word_of(paper::Verdict verdict) {
    switch (verdict) {
        case paper::Verdict::verified:
            return "verified";
        case paper::Verdict::up_to_factor:
            return "up to a factor";
        case paper::Verdict::misprint:
            return "misprint";
        case paper::Verdict::definition:
            return "definition";
        case paper::Verdict::inconsistent:
            break;
    }
    return "inconsistent";
}

}  // namespace

std::string paper_json(const std::string& document, const std::vector<paper::Finding>& findings,
                       const std::vector<PaperTable>& tables) {
    nlohmann::ordered_json json = {{"format", 1}, {"command", "paper"}, {"document", document}};
    json["statements"] = nlohmann::ordered_json::array();
    for (const paper::Finding& finding : findings)
        json["statements"].push_back({{"label", finding.label},
                                      {"what", finding.what},
                                      {"verdict", word_of(finding.verdict)},
                                      {"resolved", paper::is_resolved(finding)},
                                      {"demonstration", finding.demonstration}});
    json["tables"] = nlohmann::ordered_json::array();
    for (const PaperTable& table : tables)
        json["tables"].push_back({{"title", table.title}, {"reproduced", table.reproduced()}});
    return json.dump() + "\n";
}

}  // namespace lobatto
