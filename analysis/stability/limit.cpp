// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/stability/limit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "generator/method/splitting_stability.hpp"
#include "generator/method/stability.hpp"

namespace lobatto {

namespace {

constexpr double negligible = 1e-6;  // growth of a step
constexpr double most = 1e9;         // (h omega)^2, beyond all limits

// Whether b c of (D20) vanishes somewhere in 0 < z <= up_to^2: a count by Sturm's theorem, without looking where.
bool has_limit(const Quadrature& quadrature, double up_to) {
    const Propagation step = propagation(quadrature);
    const SturmChain chain(rational_polynomial((-step.b / step.z).expand() * step.c, step.z));
    return chain.zeros(0, static_cast<long>(std::min(std::ceil(up_to * up_to), most))) > 0;
}

}  // namespace

double stability_limit(const Quadrature& quadrature, double up_to) {
    constexpr double none = std::numeric_limits<double>::infinity();
    if (quadrature.is_explicit()) {
        for (const UnstableSteps& steps : unstable_steps(quadrature))
            if (steps.rate >= negligible) return steps.from;
        return none;
    }
    if (quadrature.method.family == Family::gauss || !has_limit(quadrature, up_to)) return none;
    const Stability exact = stability(quadrature);
    for (std::size_t k = 0; k < exact.limits.size(); ++k)
        if (const StabilityInterval& beyond = exact.intervals[k + 1]; !beyond.stable && beyond.rate >= negligible)
            return std::sqrt(exact.limits[k].approximation(20).to_double());
    return none;
}

double part_below(double limit, double radians) {
    const double part = limit / radians, unit = std::pow(10, std::floor(std::log10(part)) - 1);
    return std::floor(part / unit) * unit;
}

}  // namespace lobatto
