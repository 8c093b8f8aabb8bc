// SPDX-License-Identifier: GPL-2.0-or-later
// The paper, formula by formula: each is read as printed, derived anew from its definition, and the two are compared
// exactly.
//
// F. Dubois, J. A. Rojas-Quintero, "A variational symplectic scheme based on Lobatto's quadrature", LNCS 16034 (2025),
// 332-342.
#pragma once

#include <ginac/ginac.h>

#include <functional>
#include <string>
#include <vector>

namespace lobatto::paper {

enum class Verdict {
    verified,      // printed and derived agree exactly
    up_to_factor,  // the printed equation is the derived one times a stated factor: another normalisation
    misprint,      // they differ; the corrected formula agrees exactly
    definition,    // the formula introduces a notation: nothing to derive, consistent with what follows
    inconsistent   // two places of the text contradict each other, or a figure cannot be reproduced
};

// What must agree.
enum class Kind {
    value,    // "name = value": the value equals the derived one
    equation  // "left = right": left - right equals the derived residual, or a factor without unknowns times it
};

// One formula of a statement, in the paper's form. `text` is both what is compared and what is shown (see `spell`).
struct Part {
    std::string text;   // "name = value" or "left = right"; lists and matrices as {a, b}, {{a, b}, {c, d}}
    GiNaC::ex derived;  // from the definition; a list for a list
    Kind kind = Kind::value;
    GiNaC::exmap values =
        {};  // substituted into the printed formula: symbols known from elsewhere (xi = 1/2 - sqrt(5)/10)
    std::string factor = "";     // printed = factor * derived
    std::string corrected = "";  // the whole text, mended
};

struct Statement {
    std::string label;    // eq:lobattoQuad, or "after eq:qxiq1mxi: L_r"
    std::string section;  // "2"
    std::string what;     // one line
    std::vector<Part> parts;
    std::string route;                                // how it was derived
    std::function<std::string()> demonstration = {};  // of a misprint: numbers
    // A claim in words: the sentence as printed, whether it holds, and what holds instead.
    std::string sentence = "";
    std::function<bool()> holds = {};
    std::string instead = "";
    bool introduces = false;   // a definition
    bool contradicts = false;  // the text against itself
};

struct Finding {
    std::string label, section, what;
    std::string printed;  // readable text
    Verdict verdict = Verdict::verified;
    std::string mended;         // the factor, or the corrected formula
    std::string demonstration;  // numbers for a misprint, the route otherwise
};

// All statements, in the order of the paper.
std::vector<Statement> statements();

// Compares; every decision is taken symbolically and again with 50 digits at two points. Throws std::logic_error when
// the two routes disagree or a stated correction or factor is itself wrong.
Finding judge(const Statement& statement);

// A misprint is resolved when its correction is known and agrees with the derivation.
bool is_resolved(const Finding& finding);

std::string name(Verdict verdict);

// "q_xi = 5*h^2*omega" to "q_ξ = 5·h²·ω".
std::string spell(const std::string& text);

}  // namespace lobatto::paper
