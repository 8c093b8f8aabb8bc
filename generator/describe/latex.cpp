// SPDX-License-Identifier: GPL-2.0-or-later
// A derivation as a LaTeX document that stands on amsmath and graphicx alone.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "generator/describe/describe.hpp"
#include "generator/formula/text/source.hpp"
#include "generator/graph/notation.hpp"

namespace lobatto {

namespace {

constexpr std::size_t line_width = 200;  // LaTeX source of a line; \fit shrinks what is still too wide

const char* const preamble = R"(\documentclass[a4paper]{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\usepackage{amsmath}
\usepackage{graphicx}
\usepackage[margin=25mm]{geometry}
\setlength{\parindent}{0pt}
\newsavebox{\formula}
% A formula wider than the line is scaled down to it.
\newcommand{\fit}[1]{\sbox{\formula}{$\displaystyle #1$}%
  \ifdim\wd\formula>\linewidth\resizebox{\linewidth}{!}{\usebox{\formula}}\else\usebox{\formula}\fi}
)";

// Text outside formulas. What pdflatex has no letter for is shown as its code point.
std::string escaped(const std::string& text) {
    static const std::pair<char, const char*> special[] = {{'\\', "\\textbackslash{}"},
                                                           {'{', "\\{"},
                                                           {'}', "\\}"},
                                                           {'$', "\\$"},
                                                           {'&', "\\&"},
                                                           {'#', "\\#"},
                                                           {'%', "\\%"},
                                                           {'_', "\\_"},
                                                           {'<', "\\textless{}"},
                                                           {'>', "\\textgreater{}"},
                                                           {'^', "\\textasciicircum{}"},
                                                           {'~', "\\textasciitilde{}"},
                                                           {'|', "\\textbar{}"},
                                                           {'"', "\\textquotedbl{}"},
                                                           {'*', "{*}"},
                                                           {'\'', "{\\textquotesingle}"},
                                                           {'-', "{-}"},
                                                           {'[', "{[}"},
                                                           {']', "{]}"},
                                                           {'`', "{`}"}};
    std::string safe;
    for (std::size_t i = 0; i < text.size();) {
        const std::size_t length = character_length(std::string_view(text).substr(i));
        if (length == 1) {
            const auto found = std::find_if(std::begin(special), std::end(special),
                                            [&](const auto& entry) { return entry.first == text[i]; });
            safe += found == std::end(special) ? std::string(1, text[i]) : found->second;
        } else {
            unsigned long code = static_cast<unsigned char>(text[i]) & (0xFFu >> (length + 1));
            for (std::size_t j = 1; j < length; ++j)
                code = code << 6 | (static_cast<unsigned char>(text[i + j]) & 0x3Fu);
            const bool is_latin = code >= 0xA1 && code <= 0x17F;
            safe += is_latin ? text.substr(i, length) : fmt::format("U+{:04X}", code);
        }
        i += length;
    }
    return safe;
}

std::string display(const std::string& body) {
    return "\\[\n\\fit{" + body + "}\n\\]\n";
}

std::string latex_equation(const std::string& left, const std::string& right) {
    const std::vector<std::string> lines = cut_at_signs(right, line_width);
    if (lines.size() == 1) return display(left + " = " + right);
    std::string body = "\\begin{aligned}\n" + left + " ={}& " + lines.front();
    for (std::size_t i = 1; i < lines.size(); ++i) body += " \\\\\n &{} " + lines[i];
    return display(body + "\n\\end{aligned}");
}

std::string latex_matrix(const Formula& formula, const std::string& left, const std::vector<std::string>& entries) {
    std::string body = left + " = \\begin{bmatrix}\n";
    for (std::size_t i = 0; i < entries.size(); ++i) {
        const bool last = (i + 1) % formula.shape[1] == 0;
        body += entries[i] + (!last ? " & " : i + 1 < entries.size() ? " \\\\[0.6ex]\n" : "\n");
    }
    return display(body + "\\end{bmatrix}");
}

// The names of a description in LaTeX, all different.
class DistinctNames {
public:
    explicit DistinctNames(const Description& description) {
        std::map<std::string, GiNaC::symbol> symbols;
        std::set<std::string> names;
        for (const Section& section : description.sections)
            for (const Formula& formula : section.formulas) {
                names.insert(formula.left.begin(), formula.left.end());
                for (const GiNaC::ex& value : formula.values)
                    for (auto part = value.preorder_begin(); part != value.preorder_end(); ++part)
                        if (GiNaC::is_a<GiNaC::symbol>(*part)) {
                            const auto& symbol = GiNaC::ex_to<GiNaC::symbol>(*part);
                            symbols.emplace(symbol.get_name(), symbol);
                            names.insert(symbol.get_name());
                        }
            }
        as_written_ = latex_as_written(names);
        for (const auto& [name, latex] : as_written_)
            if (const auto found = symbols.find(name); found != symbols.end())
                display_[found->second] = GiNaC::symbol(latex);
    }
    std::string of(const std::string& name) const {
        const auto found = as_written_.find(name);
        return latex_name(found == as_written_.end() ? name : found->second);
    }
    GiNaC::ex in(const GiNaC::ex& value) const { return value.subs(display_, GiNaC::subs_options::no_pattern); }

private:
    std::map<std::string, std::string> as_written_;
    GiNaC::exmap display_;
};

}  // namespace

std::string latex_of(const Description& description) {
    const DistinctNames names(description);
    std::size_t widest = 10;
    for (const Section& section : description.sections)
        for (const Formula& formula : section.formulas)
            if (formula.shape.size() == 2) widest = std::max(widest, formula.shape[1]);
    std::string text = preamble;
    text += fmt::format("\\setcounter{{MaxMatrixCols}}{{{}}}\n", widest);
    text += "\\title{" + escaped(description.title) + "}\n\\author{derived by Lobatto}\n\\date{}\n";
    text += "\\begin{document}\n\\maketitle\n\n\\begin{description}\n";
    for (const auto& [name, value] : description.facts) text += "\\item[" + name + "] " + escaped(value) + "\n";
    text += "\\end{description}\nNumbers (D..) are those of docs/derivation.md.\n";
    for (const Section& section : description.sections) {
        text += "\n\\section*{" + escaped(section.title) + "}\n";
        for (const Formula& formula : section.formulas) {
            text += fmt::format("\n\\medskip({}) {}{}\n", formula.number, escaped(formula.meaning),
                                formula.paper.empty() ? "" : " [paper: " + escaped(formula.paper) + "]");
            std::vector<std::string> values;
            for (const GiNaC::ex& value : formula.values)
                values.push_back(canonical_text(names.in(value), Notation::latex));
            if (formula.shape.size() == 2)
                text += latex_matrix(formula, names.of(formula.left[0]), values);
            else
                for (std::size_t i = 0; i < values.size(); ++i)
                    text += latex_equation(names.of(formula.left[i]), values[i]);
        }
    }
    text += "\n\\section*{Structure}\n\\begin{description}\n";
    for (const Finding& finding : description.findings)
        text +=
            "\\item[" + escaped(finding.name) + (finding.holds ? "] yes: " : "] no: ") + escaped(finding.reason) + "\n";
    return text + "\\end{description}\n\\end{document}\n";
}

}  // namespace lobatto
