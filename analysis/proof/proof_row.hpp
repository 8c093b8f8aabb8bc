// SPDX-License-Identifier: GPL-2.0-or-later
// A claim of `lobatto verify`, what was measured of it, and what is allowed: how a measurement becomes a row.
#pragma once

#include <string>
#include <vector>

#include "generator/check/check.hpp"
#include "generator/graph/graph.hpp"
#include "runtime/error.hpp"

namespace lobatto {

struct ProofRow {
    std::string claim, measured, bound;
    bool holds = false;
    std::string meaning;  // of a failure
};

ProofRow row_of(const Check& check);
ProofRow at_most(const std::string& claim, double measured, double bound, const std::string& meaning);
// A check that cannot tell, and why: no failure, and no success either.
ProofRow not_decided(const std::string& claim, const std::string& why);
// Of whole systems, not of single numbers.
ProofRow not_promised(const std::string& claim, const std::string& why);

// A row that is measured, or where the measurement itself cannot be made, says so.
template <class Measure>
ProofRow decided(const std::string& claim, const Measure& measure) {
    try {
        return measure();
    } catch (const ComputationError& error) {
        return not_decided(claim, error.what());
    }
}

// Checks of formulas at points near the start, if there are any where all of them have values.
template <class Work>
void near_the_start(std::vector<ProofRow>& rows, const std::string& claim, const Work& work) {
    try {
        for (const Check& check : work()) rows.push_back(row_of(check));
    } catch (const DomainError& error) {
        rows.push_back(not_decided(claim, std::string("no value at points near the start: ") + error.what()));
    }
}

}  // namespace lobatto
