// SPDX-License-Identifier: GPL-2.0-or-later
// Where the steps of a linear system stay bounded, exactly: the zeros of 4 - trace^2.
#include "generator/method/stability.hpp"

#include <cln/cln.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lobatto {

namespace {

using GiNaC::ex;
using GiNaC::numeric;

constexpr int digits = 60;

// arcosh |t| = ln(|t| + sqrt(t^2 - 1)); for the tiny rates of narrow gaps exact in its leading digits.
double rate_of(const numeric& half_trace) {
    const numeric size = abs(half_trace);
    if (size <= 1) return 0;
    const cln::cl_R exact = cln::cl_float(cln::the<cln::cl_R>(size.to_cl_N()), cln::float_format(digits));
    return cln::double_approx(cln::ln(exact + cln::sqrt(exact * exact - 1)));
}

// trace = 2 a/delta, both multiplied by one number.
void find_trace(Stability& result, const RationalPolynomial& a, const RationalPolynomial& delta) {
    RationalPolynomial both = delta;
    for (const numeric& coefficient : a) both.push_back(2 * coefficient);
    const numeric scale = primitive(both).front() / both.front();  // delta(0) = 1
    for (const numeric& coefficient : a) result.trace_above.push_back(2 * coefficient * abs(scale));
    for (const numeric& coefficient : delta) result.trace_below.push_back(coefficient * abs(scale));
}

// a/delta - cos(x) = -C x^{k+2} + ... at x = h omega, so that the angle is x + C x^{k+1} + ...; z = x^2.
void find_phase_error(Stability& result, const RationalPolynomial& a, const RationalPolynomial& delta) {
    RationalPolynomial quotient;  // of the series a/delta
    numeric factorial = 1;        // (2 k)!
    for (std::size_t k = 0;; ++k) {
        numeric coefficient = k < a.size() ? a[k] : numeric(0);
        for (std::size_t j = 1; j <= k && j < delta.size(); ++j) coefficient -= delta[j] * quotient[k - j];
        quotient.push_back(coefficient);
        const long twice = static_cast<long>(2 * k);
        if (k > 0) factorial *= numeric(twice) * (twice - 1);
        const numeric error = quotient.back() - (k % 2 == 0 ? 1 : -1) / factorial;
        if (error.is_zero()) continue;
        result.phase_error = -error;
        result.phase_order = static_cast<int>(twice) - 2;
        return;
    }
}

// The largest rate between two limits: where the trace turns, or in the limit z -> infinity.
void find_peak(StabilityInterval& interval, const Stability& of, const std::vector<RealRoot>& turns,
               const RealRoot& begin, const RealRoot* end) {
    for (const RealRoot& turn : turns) {
        if (turn.high < begin.low || (end != nullptr && turn.low > end->high)) continue;
        const double rate = rate_of_step(of, turn.approximation(digits));
        if (rate <= interval.rate) continue;
        interval.rate = rate;
        interval.peak = turn;
    }
    if (end != nullptr) return;
    const bool bounded = of.trace_above.size() <= of.trace_below.size();
    const double limit = bounded ? rate_of(of.trace_above.back() / (2 * of.trace_below.back()))
                                 : std::numeric_limits<double>::infinity();
    if (limit <= interval.rate) return;
    interval.rate = limit;
    interval.peak.reset();
}

}  // namespace

Stability stability(const Quadrature& quadrature) {
    Stability result;
    result.method = quadrature.method;
    result.step = propagation(quadrature);
    const Propagation& step = result.step;
    const RationalPolynomial a = rational_polynomial(step.a, step.z), delta = rational_polynomial(step.delta, step.z);
    find_trace(result, a, delta);
    find_phase_error(result, a, delta);

    const ex rising = (-step.b / step.z).expand();
    const auto divides = [&](const RationalPolynomial& factor, const ex& polynomial) {
        const std::vector<RealRoot> roots = positive_roots(polynomial, step.z);
        return std::any_of(roots.begin(), roots.end(), [&](const RealRoot& root) { return root.polynomial == factor; });
    };
    for (RealRoot& root : positive_roots(rising * step.c, step.z)) {
        root.refine(root.high * numeric(10).power(-digits));
        if (root.multiplicity % 2 != 0)
            result.limits.push_back(root);
        else
            result.contacts.push_back({root, divides(root.polynomial, rising) && divides(root.polynomial, step.c)});
    }

    std::vector<RealRoot> turns =
        positive_roots(step.a.diff(step.z) * step.delta - step.a * step.delta.diff(step.z), step.z);
    for (RealRoot& turn : turns) turn.refine(turn.high * numeric(10).power(-digits));
    for (std::size_t k = 0; k <= result.limits.size(); ++k) {
        StabilityInterval interval;
        interval.stable = k % 2 == 0;
        if (!interval.stable)
            find_peak(interval, result, turns, result.limits[k - 1],
                      k < result.limits.size() ? &result.limits[k] : nullptr);
        result.intervals.push_back(interval);
    }
    return result;
}

numeric Stability::trace(const numeric& z) const {
    return value(trace_above, z) / value(trace_below, z);
}

double rate_of_step(const Stability& stability, const numeric& z) {
    return rate_of(stability.trace(z) / 2);
}

std::optional<ProofOfStability> proof_of_stability(const Stability& stability) {
    const Propagation& step = stability.step;
    if (!(step.b + step.z * step.c).expand().is_zero()) return std::nullopt;
    const RationalPolynomial delta = rational_polynomial(step.delta, step.z);
    const SturmChain chain(delta);
    if (chain.zeros_beyond(0) != 0) return std::nullopt;
    return ProofOfStability{rational_polynomial(step.c, step.z), delta, chain.signs(0), chain.signs_at_infinity()};
}

}  // namespace lobatto
