// SPDX-License-Identifier: GPL-2.0-or-later
// How the polynomials' jump tells the error of a scene, once measured for each member; and how well both estimates do.
#pragma once

#include <string>
#include <vector>

#include "analysis/tradeoff/candidate.hpp"

namespace lobatto {

// error = factor * steps * jump^power (error_power): the power is known, the factor is the median over the
// member's runs to stagnation.
struct Calibration {
    struct Law {
        Member member;
        double power = 0, factor = 0;
        int runs = 0;
        double error(const Measurement& measurement) const;
    };
    std::vector<Law> laws;  // of members with three runs at least, in double precision

    // True error over the estimate, ascending: of the laws, each run left out of its own; of `lobatto run`.
    std::vector<double> by_laws, by_run;
};

// The runs to stagnation in double precision whose errors are at most 0.1, at least `least` (what the reference leaves
// to be seen), and well above the least of all, which is rounding's.
std::vector<Measurement> telling(const std::vector<Measurement>& measurements, double least);

Calibration calibrate(const std::vector<Measurement>& telling);

// The value below which this part of the sorted list lies.
double part_of(const std::vector<double>& sorted, double part);

// Some lines for the terminal; empty when too little was measured.
std::string calibration_text(const Calibration& calibration);

}  // namespace lobatto
