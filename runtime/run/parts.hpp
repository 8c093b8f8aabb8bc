// SPDX-License-Identifier: MIT
// Numbers of any kernel as sums of doubles, `parts` each, of which the first is the rounded value (NumberStepper).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace lobatto {

// x, one double each, with zeros after them.
std::vector<double> as_parts(const std::vector<double>& x, std::size_t parts);
// The first of each.
std::vector<double> rounded(const std::vector<double>& whole, std::size_t parts);
// x - y.
double difference(const double* x, const double* y, std::size_t parts);
// One number minus a double.
std::vector<double> minus(const std::vector<double>& x, double y);
// One number times a fraction, |numerator| and denominator below 2^53.
std::vector<double> times_fraction(const std::vector<double>& x, std::int64_t numerator, std::int64_t denominator);

}  // namespace lobatto
