// SPDX-License-Identifier: GPL-2.0-or-later
// Short events in the explicit time of a Lagrangian, a force or a constraint: pulses, switches, near poles. Narrower
// than the distance of a step's nodes they may fall between all of them, and no step tells that they are there; but
// formulas do. And the knots of measured values in time, across which a step has less than its order.
#pragma once

#include <ginac/ginac.h>

#include <algorithm>
#include <vector>

#include "generator/mechanics/outline.hpp"

namespace lobatto {

struct Pulse {
    double time;   // of its middle
    double width;  // on this scale the formula changes there
};

// Whether a part of a formula is a power b^e whose exponent holds one of these, and so exp(e log b); that exponent.
template <class Symbols>
bool is_exponential(const GiNaC::ex& part, const Symbols& symbols) {
    return GiNaC::is_a<GiNaC::power>(part) &&
           std::any_of(symbols.begin(), symbols.end(), [&](const auto& one) { return part.op(1).has(one); });
}
inline GiNaC::ex natural_exponent(const GiNaC::ex& power) {
    return power.op(1) * GiNaC::log(power.op(0));
}

// In the order of time: one more among them; whether a step is longer than half of the width of one of them, or than
// the distance to it over `grading`.
void insert_in_order(std::vector<Pulse>& pulses, const Pulse& one);
bool is_too_long(const std::vector<Pulse>& pulses, double grading, double from, double step);

// Those between two times that are narrower than `widest`, with the parameters at these values (scene order): of
// exp(u), and b^u, where u(t) is largest, of u^4 and higher powers where |u| is largest, of u^-k near complex roots of
// u, of tanh, atan, sinh, cosh and exp of a linear u where u passes zero, of a table of a linear u where it bends most,
// of if and its kin where u passes zero twice; u holds the time and parameters alone. In the order of time, at most
// 1000.
std::vector<Pulse> find_pulses(const Outline& outline, const std::vector<double>& parameters, double begin, double end,
                               double widest);

// The knots of tables of a linear u(t), in the order of time: the third derivative jumps there, and only steps that end
// at them keep their order.
std::vector<double> find_knots(const Outline& outline, const std::vector<double>& parameters, double begin, double end);

}  // namespace lobatto
