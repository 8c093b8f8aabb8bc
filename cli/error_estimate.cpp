// SPDX-License-Identifier: GPL-2.0-or-later
#include "cli/error_estimate.hpp"

#include <algorithm>
#include <cmath>

#include "generator/propagation.hpp"

namespace lobatto {

std::vector<long double> coefficients_of(const GiNaC::ex& polynomial, const GiNaC::symbol& z) {
    std::vector<long double> result;
    for (int power = 0; power <= polynomial.degree(z); ++power) {
        const GiNaC::numeric exact = GiNaC::ex_to<GiNaC::numeric>(polynomial.coeff(z, power).evalf());
        const double high = exact.to_double();
        result.push_back(static_cast<long double>(high) +
                         static_cast<long double>((exact - GiNaC::numeric(high)).to_double()));
    }
    return result;
}

long double value_of(const std::vector<long double>& polynomial, long double z) {
    long double sum = 0;
    for (std::size_t i = polynomial.size(); i-- > 0;) sum = sum * z + polynomial[i];
    return sum;
}

ErrorEstimate::ErrorEstimate(const Quadrature& quadrature) {
    for (const GiNaC::ex& point : quadrature.control)
        control_.push_back(GiNaC::ex_to<GiNaC::numeric>(point.evalf()).to_double());
    const auto lagrange = [&](std::size_t j, double theta) {
        double product = 1;
        for (std::size_t i = 0; i < control_.size(); ++i)
            if (i != j) product *= (theta - control_[i]) / (control_[j] - control_[i]);
        return product;
    };
    for (const double theta : {0.25, 0.5, 0.75}) {
        std::vector<double> ahead, here;
        for (std::size_t j = 0; j < control_.size(); ++j) {
            ahead.push_back(lagrange(j, 1 + theta));
            here.push_back(lagrange(j, theta));
        }
        ahead_.push_back(ahead);
        here_.push_back(here);
    }
    const Propagation step = propagation(quadrature);
    a_ = coefficients_of(step.a, step.z);
    delta_ = coefficients_of(step.delta, step.z);
}

double ErrorEstimate::jump(double z) const {
    double largest = 0;
    for (std::size_t i = 0; i < ahead_.size(); ++i) {
        std::complex<double> sum = 0;
        for (std::size_t j = 0; j < control_.size(); ++j)
            sum +=
                ahead_[i][j] * std::polar(1.0, z * control_[j]) - here_[i][j] * std::polar(1.0, z * (1 + control_[j]));
        largest = std::max(largest, std::abs(sum));
    }
    return largest;
}

double ErrorEstimate::phase(double z) const {
    const long double square = static_cast<long double>(z) * z;
    const long double cosine = value_of(a_, square) / value_of(delta_, square);
    if (!(std::fabs(cosine) < 1)) return 1;
    return static_cast<double>(std::fabs(std::acos(cosine) - static_cast<long double>(z)));
}

double ErrorEstimate::after(double steps, double jump_of_step) const {
    if (!(jump_of_step > 0)) return 0;
    if (jump(longest_) <= jump_of_step) return 1;
    double below = 0, above = longest_;
    for (int halving = 0; halving < 50; ++halving) {
        const double middle = (below + above) / 2;
        (jump(middle) < jump_of_step ? below : above) = middle;
    }
    return std::min(1.0, steps * phase(above));
}

}  // namespace lobatto
