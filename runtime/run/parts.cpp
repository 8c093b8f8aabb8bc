// SPDX-License-Identifier: MIT
#include "runtime/run/parts.hpp"

#include <algorithm>
#include <cmath>

namespace lobatto {

namespace {

// The terms become others with the same sum, of which the last is the rounded sum (T. Ogita, S. Rump and S. Oishi
// 2005: error-free vector transformations, repeated). `parts`: of the numbers they are made of.
double rounded_sum(std::vector<double>& terms, std::size_t parts) {
    for (std::size_t pass = 0; pass < std::max<std::size_t>(4, parts + 1); ++pass)
        for (std::size_t i = 1; i < terms.size(); ++i) {
            const double a = terms[i - 1], b = terms[i], sum = a + b, part = sum - a;
            terms[i - 1] = (a - (sum - part)) + (b - part);
            terms[i] = sum;
        }
    return terms.back();
}

}  // namespace

std::vector<double> as_parts(const std::vector<double>& x, std::size_t parts) {
    std::vector<double> whole(x.size() * parts, 0.0);
    for (std::size_t i = 0; i < x.size(); ++i) whole[i * parts] = x[i];
    return whole;
}

std::vector<double> rounded(const std::vector<double>& whole, std::size_t parts) {
    std::vector<double> x(whole.size() / parts);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = whole[i * parts];
    return x;
}

double difference(const double* x, const double* y, std::size_t parts) {
    if (parts == 1 || !std::isfinite(x[0] - y[0])) return x[0] - y[0];
    std::vector<double> terms;
    for (std::size_t j = parts; j-- > 0;) {
        terms.push_back(-y[j]);
        terms.push_back(x[j]);
    }
    return rounded_sum(terms, parts);
}

std::vector<double> minus(const std::vector<double>& x, double y) {
    std::vector<double> terms(x.rbegin(), x.rend()), result;
    terms.push_back(-y);
    for (std::size_t j = 0; j < x.size(); ++j) {
        result.push_back(rounded_sum(terms, x.size()));
        terms.push_back(-result.back());
    }
    return result;
}

std::vector<double> times_fraction(const std::vector<double>& x, std::int64_t numerator, std::int64_t denominator) {
    const auto up = static_cast<double>(numerator), down = static_cast<double>(denominator);
    std::vector<double> terms, result;
    const auto add_product = [&terms](double a, double b) {
        terms.push_back(std::fma(a, b, -(a * b)));
        terms.push_back(a * b);
    };
    for (auto part = x.rbegin(); part != x.rend(); ++part) add_product(*part, up);
    // The remainder, divided: part by part.
    for (std::size_t j = 0; j < x.size(); ++j) {
        result.push_back(rounded_sum(terms, x.size()) / down);
        add_product(-result.back(), down);
    }
    return result;
}

}  // namespace lobatto
