// SPDX-License-Identifier: GPL-2.0-or-later
// Whether constant masses make a kinetic energy that is positive. One that is not is allowed, but mostly a mistaken
// sign, or a value that no body has. (Masses that change are metrics such as those of relativity; nothing is said of
// them, nor where constraints make up for what a mass lacks.)
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/tape.hpp"
#include "generator/mechanics/outline.hpp"

namespace lobatto {

class ConstantMasses {
public:
    explicit ConstantMasses(const Outline& outline);

    // What is not positive with these parameters, as a clause: "the mass of x is negative"; empty: all is.
    std::string complaint(const std::vector<double>& parameters) const;

private:
    struct Entry {
        std::size_t row, column;
        Tape value;
    };
    std::vector<std::string> coordinates_;
    std::vector<Entry> entries_;  // of dp/dv, in the order of rows; none where nothing is said
};

}  // namespace lobatto
