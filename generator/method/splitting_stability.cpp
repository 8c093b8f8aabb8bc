// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/method/splitting_stability.hpp"

#include <cln/cln.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace lobatto {

namespace {

// One step of q'' = -omega^2 q as a matrix in (q, (h/m) p): its upper left entry a, and -b/z and c of (D20).
struct Entries {
    long double a, b, c;
};

class Oscillator {
public:
    explicit Oscillator(const Quadrature& quadrature) {
        const auto number = [](const GiNaC::ex& value) {  // as the sum of two doubles
            const auto exact = cln::the<cln::cl_R>(GiNaC::ex_to<GiNaC::numeric>(value).to_cl_N());
            const double first = cln::double_approx(exact);
            const cln::cl_R rest = exact - cln::rational(cln::cl_DF(first));
            return first + static_cast<long double>(cln::double_approx(rest));
        };
        for (const GiNaC::ex& b : quadrature.b) kicks_.push_back(number(b));
        for (std::size_t i = 0; i + 1 < quadrature.c.size(); ++i)
            drifts_.push_back(number(quadrature.c[i + 1] - quadrature.c[i]));
    }

    Entries at(long double x) const {
        const long double z = x * x;
        long double q[2] = {1, 0}, p[2] = {0, 1};
        for (std::size_t i = 0; i < kicks_.size(); ++i)
            for (int k = 0; k < 2; ++k) {
                p[k] -= z * kicks_[i] * q[k];
                if (i < drifts_.size()) q[k] += drifts_[i] * p[k];
            }
        return {q[0], -p[0] / z, q[1]};
    }

private:
    std::vector<long double> kicks_, drifts_;
};

constexpr long double stride = 0.005L, furthest = 100, between = 1e-9L;

}  // namespace

std::vector<UnstableSteps> unstable_steps(const Quadrature& quadrature) {
    const Oscillator oscillator(quadrature);
    const auto rate_at = [&](long double x) {
        const long double a = std::fabs(oscillator.at(x).a);
        return a > 1 ? static_cast<double>(std::acosh(a)) : 0.0;
    };
    // Where b or c changes its sign between two points.
    const auto zero_of = [&](long double Entries::*entry, long double low, long double high) {
        const bool sign = oscillator.at(low).*entry > 0;
        while (high - low > 1e-13L) {
            const long double middle = (low + high) / 2;
            ((oscillator.at(middle).*entry > 0) == sign ? low : high) = middle;
        }
        return (low + high) / 2;
    };
    std::vector<UnstableSteps> result;
    std::vector<long double> limits;
    Entries before = oscillator.at(stride);
    for (long double x = stride; x < furthest; x += stride) {
        const Entries here = oscillator.at(x + stride);
        for (long double Entries::*const entry : {&Entries::b, &Entries::c})
            if ((before.*entry > 0) != (here.*entry > 0)) limits.push_back(zero_of(entry, x, x + stride));
        before = here;
        std::sort(limits.begin(), limits.end());
        while (limits.size() >= 2) {
            const long double from = limits[0], to = limits[1];
            double rate = 0;
            for (int i = 1; i < 64; ++i) rate = std::max(rate, rate_at(from + (to - from) * i / 64));
            limits.erase(limits.begin(), limits.begin() + 2);
            if (rate == 0) continue;
            // Where b and c vanish together, to the digits known, no step lies between two intervals.
            if (!result.empty() && from - result.back().to < between)
                result.back() = {result.back().from, static_cast<double>(to), std::max(result.back().rate, rate)};
            else
                result.push_back({static_cast<double>(from), static_cast<double>(to), rate});
        }
    }
    if (!limits.empty() && !result.empty() && limits[0] - result.back().to < between)
        result.back().to = std::numeric_limits<double>::infinity();
    else if (!limits.empty())
        result.push_back({static_cast<double>(limits[0]), std::numeric_limits<double>::infinity(), rate_at(furthest)});
    return result;
}

}  // namespace lobatto
