// SPDX-License-Identifier: GPL-2.0-or-later
// A derivation for people: numbered formulas in plain text, at most 110 columns where they can be cut.
#include <fmt/format.h>

#include <algorithm>

#include "generator/describe/describe.hpp"
#include "generator/graph/notation.hpp"

namespace lobatto {

namespace {

constexpr std::size_t columns = 110;

std::string text_equation(const std::string& left, const std::string& right) {
    std::string text;
    const std::string indent(4 + left.size() + 3, ' ');
    for (const std::string& line : cut_at_signs(right, columns - indent.size()))
        text += (text.empty() ? "    " + left + " = " : indent) + line + "\n";
    return text;
}

// Rows in brackets when they fit, else one line for each entry that is not zero.
std::string text_matrix(const Formula& formula, const std::vector<std::string>& entries) {
    const std::size_t rows = formula.shape[0], width = formula.shape[1];
    std::vector<std::size_t> widest(width, 0);
    for (std::size_t i = 0; i < entries.size(); ++i) widest[i % width] = std::max(widest[i % width], entries[i].size());
    std::size_t total = 4 + formula.left[0].size() + 7;
    for (const std::size_t one : widest) total += one + 2;
    std::string text;
    if (total <= columns) {
        for (std::size_t i = 0; i < rows; ++i) {
            std::string line =
                "    " + (i == 0 ? formula.left[0] + " = " : std::string(formula.left[0].size() + 3, ' '));
            line += "[ ";
            for (std::size_t j = 0; j < width; ++j)
                line += fmt::format("{:>{}}{}", entries[i * width + j], widest[j], j + 1 < width ? "  " : " ]\n");
            text += line;
        }
        return text;
    }
    bool has_zeros = false;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        if (entries[i] == "0")
            has_zeros = true;
        else
            text += text_equation(fmt::format("{}[{},{}]", formula.left[0], i / width + 1, i % width + 1), entries[i]);
    }
    return text + (has_zeros ? "    all other entries are 0\n" : "");
}

std::string heading(const std::string& title) {
    return "\n" + title + "\n" + std::string(title.size(), '-') + "\n";
}

}  // namespace

std::vector<std::string> cut_at_signs(const std::string& formula, std::size_t width) {
    std::vector<std::string> lines;
    std::size_t begin = 0, cut = 0;
    int depth = 0;
    for (std::size_t i = 0; i < formula.size(); ++i) {
        const char c = formula[i];
        if (c == '(' || c == '{' || c == '[') ++depth;
        if (c == ')' || c == '}' || c == ']') --depth;
        const bool sign = i > 0 && depth == 0 && (c == '+' || c == '-') && formula[i - 1] == ' ';
        if (sign) {
            if (cut > begin && i - begin > width) {
                lines.push_back(formula.substr(begin, cut - begin - 1));
                begin = cut;
            }
            cut = i;
        }
    }
    if (cut > begin && formula.size() - begin > width) {
        lines.push_back(formula.substr(begin, cut - begin - 1));
        begin = cut;
    }
    lines.push_back(formula.substr(begin));
    return lines;
}

std::string text_of(const Description& description) {
    std::string text = description.title + "\n" + "\n";
    for (const auto& [name, value] : description.facts) text += fmt::format("{:<13}{}\n", name, value);
    text += "\nNumbers (D..) are those of docs/derivation.md.\n";
    for (const Section& section : description.sections) {
        text += heading(section.title);
        for (const Formula& formula : section.formulas) {
            text += fmt::format("\n({}) {}{}\n", formula.number, formula.meaning,
                                formula.paper.empty() ? "" : "   [paper: " + formula.paper + "]");
            std::vector<std::string> values;
            for (const GiNaC::ex& value : formula.values) values.push_back(canonical_text(value));
            if (formula.shape.size() == 2)
                text += text_matrix(formula, values);
            else
                for (std::size_t i = 0; i < values.size(); ++i) text += text_equation(formula.left[i], values[i]);
        }
    }
    text += heading("Structure") + "\n";
    for (const Finding& finding : description.findings)
        text += fmt::format("    {:<4}{}: {}\n", finding.holds ? "yes" : "no", finding.name, finding.reason);
    return text;
}

}  // namespace lobatto
