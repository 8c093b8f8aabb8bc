// SPDX-License-Identifier: GPL-2.0-or-later
// The numbers a kernel computes with, from float to quadruple.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace lobatto {

// float, double, long double, two doubles as one number (106 bits), __float128 (113 bits).
enum class Precision { single, double_, extended, double_double, quadruple };

constexpr Precision all_precisions[] = {Precision::single, Precision::double_, Precision::extended,
                                        Precision::double_double, Precision::quadruple};

std::string precision_name(Precision precision);  // "float", "double", "long double", "double-double", "quadruple"
std::optional<Precision> precision_of(const std::string& name);
std::string precision_list();                    // all of them, quoted, for errors
double rounding_of(Precision precision);         // its epsilon
int bits_of(Precision precision);                // of a number's significand
int decimals_of(Precision precision);            // that such a number always keeps
long largest_exponent_of(Precision precision);   // of two
long smallest_exponent_of(Precision precision);  // of two, of numbers that keep all bits

}  // namespace lobatto
