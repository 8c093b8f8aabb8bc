// SPDX-License-Identifier: GPL-2.0-or-later
// Values of constant expressions: 60 digits or more, every intermediate result a finite real number of bounded size.
#pragma once

#include <ginac/ginac.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace lobatto {

// Decimal digits of every computation on constants. 60 at first; once numbers with more digits were asked for, as many
// as those need, until the process ends.
int working_digits();
void need_digits(int digits);  // before anything is computed that is to have so many

// Why an expression has no value, as a clause: "log of 0 is not finite".
class NoValue : public std::domain_error {
public:
    using std::domain_error::domain_error;
};

// A function a formula may call: on expressions (exact) and on numbers (60 digits).
struct Function {
    std::string name;
    GiNaC::ex (*symbolic)(const GiNaC::ex&);
    GiNaC::numeric (*value)(const GiNaC::numeric&);
};
const std::vector<Function>& functions();
const Function* find_function(const std::string& name);  // nullptr: there is none of this name
// Functions that are put together from smooth pieces, and others of two arguments, by their forms: abs(a), max(a, b)
const std::vector<std::pair<std::string, std::string>>& pieced_functions();
bool is_function_name(const std::string& name);  // also sum and mod

// A number at 60 digits.
GiNaC::numeric real_value(const GiNaC::numeric& exact);
// All throw NoValue.
GiNaC::numeric real_sum(const std::vector<GiNaC::numeric>& terms);  // a sum that cancels to rounding is exactly 0
GiNaC::numeric real_product(const std::vector<GiNaC::numeric>& factors);
GiNaC::numeric real_power(const GiNaC::numeric& base, const GiNaC::numeric& exponent);
GiNaC::numeric real_function(const Function& function, const GiNaC::numeric& argument);
GiNaC::numeric real_angle(const GiNaC::numeric& y, const GiNaC::numeric& x);  // atan2(y, x)
bool is_angle(const GiNaC::ex& expression);                                   // atan2(y, x) of GiNaC
// A root or another broken power, atan2 or a table: it may jump or bend. Everything else is analytic.
bool is_pieced(const GiNaC::ex& expression);
GiNaC::numeric real_table(int number, int order, const GiNaC::numeric& u);  // a value of a spline
// The value of a whole expression, its symbols replaced by numbers (60 digits) before anything is computed.
GiNaC::numeric real_value(const GiNaC::ex& expression, const GiNaC::exmap& symbols = {});

}  // namespace lobatto
