// SPDX-License-Identifier: GPL-2.0-or-later
// The judge: printed against derived.
#include "generator/paper/paper.hpp"

#include <stdexcept>

#include "generator/paper/symbols.hpp"

namespace lobatto::paper {

using GiNaC::ex;

namespace {

// The printed side of a part: the value after "=", or left minus right.
ex printed_side(const std::string& text, Kind kind, const GiNaC::exmap& values) {
    const auto sign = text.find(" = ");
    if (sign == std::string::npos) throw std::logic_error("paper: no ' = ' in \"" + text + "\"");
    const ex right = read(text.substr(sign + 3));
    return (kind == Kind::value ? right : read(text.substr(0, sign)) - right).subs(values);
}

bool all_equal(const ex& a, const ex& b) {
    const auto left = elements(a), right = elements(b);
    if (left.size() != right.size()) return false;
    for (size_t i = 0; i < left.size(); ++i)
        if (!equal(left[i], right[i])) return false;
    return true;
}

// Without unknowns: numbers, m, h and omega only.
bool is_scaling(const ex& factor) {
    for (auto it = factor.preorder_begin(); it != factor.preorder_end(); ++it)
        if (GiNaC::is_a<GiNaC::symbol>(*it) && !it->is_equal(symbol("m")) && !it->is_equal(symbol("h")) &&
            !it->is_equal(symbol("omega")))
            return false;
    return true;
}

// "" when no factor without unknowns leads from one to the other.
std::string factor_between(const ex& printed, const ex& derived) {
    if (derived.is_zero()) return "";
    const ex ratio = (printed / derived).normal();
    return is_scaling(ratio) && !ratio.is_zero() ? decimal(at_sample(ratio, 0)) : "";
}

// Where lists first differ; -1 when they do not, 0 for single expressions.
int first_difference(const ex& printed, const ex& derived) {
    const auto left = elements(printed), right = elements(derived);
    for (size_t i = 0; i < left.size() && i < right.size(); ++i)
        if (!equal(left[i], right[i])) return static_cast<int>(i);
    return -1;
}

// Both values of the element that differs, at the sample point.
std::string difference(const ex& printed, const ex& derived) {
    const int i = first_difference(printed, derived);
    if (i < 0) return "";
    const ex left = elements(printed)[static_cast<size_t>(i)], right = elements(derived)[static_cast<size_t>(i)];
    const std::string place = sample_text(left + symbol("unit") * right);
    return "printed " + decimal(at_sample(left, 0)) + ", derived " + decimal(at_sample(right, 0)) +
           (place.empty() ? "" : " at " + place);
}

// Element `index` of "name = {{a, b}, {c, d}}" as "element (2, 1) = c"; other texts whole.
std::string element_text(const std::string& text, int index) {
    const auto open = text.find('{');
    if (open == std::string::npos) return text;
    std::string element;
    int row = 1, column = 1, depth = 0;
    for (size_t i = open; i < text.size() && index >= 0; ++i) {
        const char c = text[i];
        depth += c == '(' ? 1 : c == ')' ? -1 : 0;
        if (c == ',' && depth == 0) {
            if (--index < 0) break;
            const bool ends_row = text[i - 1] == '}';
            row += ends_row ? 1 : 0;
            column = ends_row ? 1 : column + 1;
            element.clear();
        } else if (c != '{' && c != '}' && !(c == ' ' && element.empty())) {
            element += c;
        }
    }
    return "element (" + std::to_string(row) + ", " + std::to_string(column) + ") = " + element;
}

const char* const no_correction = "no correction is known";

struct PartVerdict {
    Verdict verdict = Verdict::verified;
    std::string mended, difference;
};

PartVerdict judge_part(const Part& part) {
    const ex printed = printed_side(part.text, part.kind, part.values);
    if (all_equal(printed, part.derived)) {
        if (!part.corrected.empty()) throw std::logic_error("paper: \"" + part.text + "\" needs no correction");
        return {};
    }
    if (!part.factor.empty() && all_equal(printed, read(part.factor) * part.derived))
        return {Verdict::up_to_factor, spell(part.factor), ""};
    if (part.kind == Kind::equation) {
        const std::string factor = factor_between(printed, part.derived);
        if (!factor.empty()) return {Verdict::up_to_factor, factor, ""};
    }
    if (part.corrected.empty()) return {Verdict::misprint, no_correction, difference(printed, part.derived)};
    const ex corrected = printed_side(part.corrected, part.kind, part.values);
    const bool right = all_equal(corrected, part.derived) ||
                       (part.kind == Kind::equation && !factor_between(corrected, part.derived).empty());
    if (!right)
        throw std::logic_error("paper: the correction \"" + part.corrected +
                               "\" is itself wrong: " + difference(corrected, part.derived));
    return {Verdict::misprint, spell(element_text(part.corrected, first_difference(printed, part.derived))),
            difference(printed, part.derived)};
}

void append(std::string& text, const std::string& more, const std::string& separator) {
    if (!more.empty() && text != more) text += (text.empty() ? "" : separator) + more;
}

}  // namespace

std::vector<Statement> statements() {
    std::vector<Statement> list;
    sections_2_and_3(list);
    section_4(list);
    section_5(list);
    section_6(list);
    return list;
}

Finding judge(const Statement& statement) {
    Finding finding{statement.label, statement.section, statement.what, statement.sentence, Verdict::verified, "", ""};
    for (const Part& part : statement.parts) {
        append(finding.printed, spell(part.text), finding.printed.ends_with(':') ? " " : "; ");
        const PartVerdict verdict = judge_part(part);
        append(finding.mended, verdict.mended, "; ");
        append(finding.demonstration, verdict.difference, "; ");
        if (verdict.verdict == Verdict::misprint || finding.verdict == Verdict::verified)
            finding.verdict = verdict.verdict;
    }
    if (statement.holds && !statement.holds()) {
        finding.verdict = Verdict::misprint;
        append(finding.mended, statement.instead, "; ");
    }
    if (finding.verdict == Verdict::misprint) {
        if (statement.demonstration) finding.demonstration = statement.demonstration();
        return finding;
    }
    if (statement.contradicts) {
        finding.verdict = Verdict::inconsistent;
        finding.mended = statement.instead;
    }
    if (statement.introduces) finding.verdict = Verdict::definition;
    finding.demonstration = statement.route;
    return finding;
}

bool is_resolved(const Finding& finding) {
    return finding.verdict != Verdict::misprint ||
           (!finding.mended.empty() && finding.mended.find(no_correction) == std::string::npos);
}

std::string name(Verdict verdict) {
    switch (verdict) {
        case Verdict::verified:
            return "verified";
        case Verdict::up_to_factor:
            return "verified up to a factor";
        case Verdict::misprint:
            return "misprint";
        case Verdict::definition:
            return "definition";
        case Verdict::inconsistent:
            return "inconsistent text";
    }
    throw std::logic_error("paper: unknown verdict");
}

}  // namespace lobatto::paper
