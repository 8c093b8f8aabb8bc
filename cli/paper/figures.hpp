// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's figures 1 to 4: data as CSV, drawings as SVG by gnuplot.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace lobatto {

// How fast the running maximum of |H - H(0)| grows: least-squares slope over the run, per period.
struct Growth {
    double step = 0;
    double printed = 0;         // the caption's
    double slope = 0;           // in double arithmetic
    double slope_extended = 0;  // in extended arithmetic (64-bit significand)
    double largest = 0;         // the maximum itself at the end
    // What rounding does until then: the largest |H_d/H_d(0) - 1| of the oscillator, |H - H without rounding|/(m
    // omega^2) of the pendulum.
    double rounding_plain = 0, rounding_clean = 0;
};

struct Figure {
    std::string name;  // figure2: figure2.svg, figure2.csv
    std::string title;
    std::string caption;
    std::vector<Growth> growth;  // figures 2 and 4
    std::string remark;          // on the growth
};

// Runs the experiments, writes NAME.csv and NAME.svg into `folder`. MachineError when gnuplot is missing or fails.
// `say` hears which one, and which part of the work is behind.
std::vector<Figure> draw_figures(const std::string& folder, const std::function<void(const std::string&, double)>& say);

}  // namespace lobatto
