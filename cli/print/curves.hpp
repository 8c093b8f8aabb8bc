// SPDX-License-Identifier: GPL-2.0-or-later
// Curves on axes as a gnuplot script: with few points, and with a caption.
#pragma once

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

namespace lobatto {

struct Picture {
    std::string caption;  // one line
    std::string script;
    int width = 0, height = 0;
    std::size_t points = 0;
};

struct Point {
    double x = 0, y = 0;
};

struct Curve {
    std::vector<Point> points;
    std::string colour;
    double width = 0;   // 0: the thinner the longer
    bool dot = false;   // marks its end
    bool fill = false;  // white below: hides what lies behind
};

struct Axes {
    std::string x, y;    // labels
    bool equal = false;  // one unit is as long on both
    bool y_is_time = false;
};

struct Range {
    double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
    void take(double value) {
        low = std::min(low, value);
        high = std::max(high, value);
    }
    double length() const { return high - low; }
    void widen(double share) {
        const double margin = length() > 0 ? share * length() : 1;
        low -= margin;
        high += margin;
    }
};

// The script, and the size of the page.
Picture picture_of(const std::string& title, std::vector<Curve> curves, const Axes& axes, const std::string& caption);

}  // namespace lobatto
