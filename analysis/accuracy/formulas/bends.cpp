// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/accuracy/formulas/bends.hpp"

#include <algorithm>
#include <cmath>

namespace lobatto {

std::vector<Bend> bends_of(const Spline& spline) {
    std::vector<double> x, second;
    double least = HUGE_VAL, most = -HUGE_VAL;
    for (const cln::cl_R& knot : spline.x()) {
        x.push_back(cln::double_approx(knot));
        const double value = spline(0, x.back());
        second.push_back(std::fabs(spline(2, x.back())));
        least = std::fmin(least, value);
        most = std::fmax(most, value);
    }
    std::vector<Bend> bends;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const bool is_largest =
            (i == 0 || second[i] >= second[i - 1]) && (i + 1 == x.size() || second[i] >= second[i + 1]);
        if (is_largest && second[i] > 0) bends.push_back({x[i], std::sqrt((most - least) / second[i])});
    }
    std::stable_sort(bends.begin(), bends.end(), [](const Bend& a, const Bend& b) { return a.width < b.width; });
    return bends;
}

}  // namespace lobatto
