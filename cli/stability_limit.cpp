// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/stability_limit.hpp"

#include <cmath>
#include <limits>

#include "cli/error_estimate.hpp"
#include "generator/propagation.hpp"

namespace lobatto {

double stability_limit(const Quadrature& quadrature) {
    if (quadrature.method.family == Family::gauss) return std::numeric_limits<double>::infinity();
    const Propagation step = propagation(quadrature);
    const auto a = coefficients_of(step.a, step.z), delta = coefficients_of(step.delta, step.z);
    const auto amplifies = [&](long double x) {  // cosh of the growth exponent
        const long double trace = value_of(a, x * x) / value_of(delta, x * x);
        return !(std::fabs(trace) <= 1 + 0.5e-12L);
    };
    const long double ladder = 1e-4L;
    long double x = ladder;
    while (!amplifies(x)) x += ladder;
    long double stable = x - ladder, unstable = x;
    for (int halving = 0; halving < 40; ++halving) {
        const long double middle = (stable + unstable) / 2;
        (amplifies(middle) ? unstable : stable) = middle;
    }
    return static_cast<double>(stable);
}

}  // namespace lobatto
