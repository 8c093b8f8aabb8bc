// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/tradeoff/stability_limit.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "generator/propagation.hpp"

namespace lobatto {

namespace {

// Coefficients, lowest first.
std::vector<long double> coefficients(const GiNaC::ex& polynomial, const GiNaC::symbol& z) {
    std::vector<long double> result;
    for (int power = 0; power <= polynomial.degree(z); ++power)
        result.push_back(GiNaC::ex_to<GiNaC::numeric>(polynomial.coeff(z, power).evalf()).to_double());
    return result;
}

long double value(const std::vector<long double>& polynomial, long double z) {
    long double sum = 0;
    for (std::size_t i = polynomial.size(); i-- > 0;) sum = sum * z + polynomial[i];
    return sum;
}

}  // namespace

double stability_limit(const Method& method) {
    if (method.family == Family::gauss) return std::numeric_limits<double>::infinity();
    const Propagation step = propagation(quadrature_of(method));
    const auto a = coefficients(step.a, step.z), delta = coefficients(step.delta, step.z);
    const auto amplifies = [&](long double x) {  // cosh of the growth exponent
        const long double trace = value(a, x * x) / value(delta, x * x);
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
