// SPDX-License-Identifier: GPL-2.0-or-later
// The numbers a kernel computes with, from float to quadruple, and of as many digits as are asked for.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace lobatto {

// float, double, long double, two doubles as one number (106 bits), __float128 (113 bits); and behind these
// in_digits(50), numbers of that many decimal digits at least.
enum class Precision : int { single, double_, extended, double_double, quadruple };

constexpr int fewest_digits = 20, most_digits = 140;  // decimals that can be asked for
Precision in_digits(int decimals);
bool has_many_digits(Precision precision);  // whether it is one of in_digits()
int asked_digits(Precision precision);      // of one of in_digits()

constexpr Precision all_precisions[] = {Precision::single, Precision::double_, Precision::extended,
                                        Precision::double_double, Precision::quadruple};

std::string precision_name(Precision precision);  // "float", "double", ... "quadruple", "50 digits"
std::optional<Precision> precision_of(const std::string& name);
std::string precision_list();                    // all of them, for errors
double rounding_of(Precision precision);         // its epsilon
void need_digits_for(Precision precision);       // of constants: need_digits() of generator/formula/real.hpp
int bits_of(Precision precision);                // of a number's significand
int parts_of(Precision precision);               // doubles of which such a number is the sum
int decimals_of(Precision precision);            // that such a number always keeps
long largest_exponent_of(Precision precision);   // of two
long smallest_exponent_of(Precision precision);  // of two, of numbers that keep all bits

}  // namespace lobatto
