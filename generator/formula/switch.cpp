// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/formula/switch.hpp"

namespace lobatto {
namespace {

using GiNaC::ex;

ex positive_part_value(const ex& u) {
    if (!GiNaC::is_a<GiNaC::numeric>(u)) return positive_part(u).hold();
    return GiNaC::ex_to<GiNaC::numeric>(u).is_negative() ? ex(0) : u;
}
ex positive_part_slope(const ex& /*u*/, unsigned /*argument*/) {
    return 1;
}
ex side_value(const ex& u) {
    if (!GiNaC::is_a<GiNaC::numeric>(u)) return side_of(u).hold();
    return GiNaC::ex_to<GiNaC::numeric>(u).is_positive() ? 1 : -1;
}

bool is_call(const ex& expression, unsigned function) {
    return GiNaC::is_a<GiNaC::function>(expression) &&
           GiNaC::ex_to<GiNaC::function>(expression).get_serial() == function;
}

}  // namespace

// The program and the library may both be in one process: two of each name.
REGISTER_FUNCTION(positive_part, eval_func(positive_part_value).derivative_func(positive_part_slope).overloaded(2))
REGISTER_FUNCTION(side_of, eval_func(side_value).overloaded(2))

bool is_positive_part(const ex& expression) {
    return is_call(expression, positive_part_SERIAL::serial);
}

bool is_side(const ex& expression) {
    return is_call(expression, side_of_SERIAL::serial);
}

}  // namespace lobatto
