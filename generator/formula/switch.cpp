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

bool is_tangent(const ex& expression) {
    return is_call(expression, GiNaC::tan_SERIAL::serial);
}

// The denominators in u that move: those of sums, products and powers, cosines of tangents; and whether one stands
// within another function.
struct Poles {
    GiNaC::exset denominators;
    bool within_function = false;
};
void find_poles(const ex& u, const std::function<bool(const ex&)>& moves, bool is_within, Poles& poles) {
    const bool is_power = GiNaC::is_a<GiNaC::power>(u);
    const bool is_rational = is_power || GiNaC::is_a<GiNaC::add>(u) || GiNaC::is_a<GiNaC::mul>(u);
    const bool is_pole = is_tangent(u) || (is_power && u.op(1).info(GiNaC::info_flags::negint) &&
                                           (is_within || u.op(1).info(GiNaC::info_flags::odd)));
    if (is_pole && moves(u.op(0))) {
        poles.denominators.insert(u.op(0));
        poles.within_function = poles.within_function || is_within;
    }
    const bool goes_within = is_within || !(is_rational || is_tangent(u));
    for (const ex& part : u) find_poles(part, moves, goes_within, poles);
}

struct WithoutTangents : GiNaC::map_function {
    ex operator()(const ex& u) override {
        const ex parts = u.map(*this);
        return is_tangent(parts) ? GiNaC::sin(parts.op(0)) / GiNaC::cos(parts.op(0)) : parts;
    }
};

}  // namespace

ex without_poles(const ex& u, const std::function<bool(const ex&)>& moves) {
    constexpr std::size_t few = 3;
    Poles poles;
    find_poles(u, moves, false, poles);
    if (poles.denominators.empty()) return u;
    if (poles.within_function || poles.denominators.size() > few) return GiNaC::atan(u);
    WithoutTangents without_tangents;
    const ex fraction = without_tangents(u).numer_denom();
    return fraction.op(0) * fraction.op(1);
}

// The program and the library may both be in one process: two of each name.
REGISTER_FUNCTION(positive_part, eval_func(positive_part_value).derivative_func(positive_part_slope).overloaded(2))
REGISTER_FUNCTION(side_of, eval_func(side_value).overloaded(2))

bool is_positive_part(const ex& expression) {
    return is_call(expression, positive_part_SERIAL::serial);
}

bool is_side(const ex& expression) {
    return is_call(expression, side_of_SERIAL::serial);
}

Operand power_base(const Operand& base, const Operand& exponent, const Arithmetic& arithmetic) {
    const bool is_broken = !exponent.value || (!exponent.value->is_integer() && *exponent.value > 1);
    return is_broken ? arithmetic.beyond_switch(base) : base;
}

int sign_of_pieces(const ex& u, const ex& first, const ex& second) {
    if (second.is_zero()) return first.is_equal(u) ? 1 : first.is_equal(-u) ? -1 : 0;
    if (first.is_zero()) return second.is_equal(-u) ? 1 : second.is_equal(u) ? -1 : 0;
    return 0;
}
Operand with_one_sign(int sign, Operand pieces) {
    if (sign != 0 && !pieces.value) pieces.beyond_switch = sign * positive_part(sign * pieces.expression);
    return pieces;
}

Operand as_side(const GiNaC::symbol& symbol, const Operand& u) {
    Operand side = operand_of(symbol);
    side.moves = u.moves;
    side.velocities = u.velocities;
    side.inputs = u.inputs;
    return side;
}

bool stays_zero(const ex& u, const std::vector<Switch>& switches) {
    constexpr std::size_t most = 8;
    constexpr int places = 3;
    std::vector<GiNaC::symbol> sides;
    for (const Switch& one : switches)
        if (u.has(one.side)) sides.push_back(one.side);
    if (sides.empty() || sides.size() > most) return false;
    GiNaC::exset symbols;
    for (auto part = u.preorder_begin(); part != u.preorder_end(); ++part)
        if (GiNaC::is_a<GiNaC::symbol>(*part)) symbols.insert(*part);
    const auto is_zero = [&](std::size_t choice, int place) {
        GiNaC::exmap values;
        long chance = 1 + place;
        for (const ex& symbol : symbols) values[symbol] = GiNaC::numeric(chance = chance * 7919 % 10007, 5003);
        for (std::size_t i = 0; i < sides.size(); ++i) values[sides[i]] = (choice >> i & 1) != 0 ? 1 : -1;
        try {
            return abs(real_value(u, values)) < GiNaC::numeric("1e-40");
        } catch (const NoValue&) {
            return false;
        }
    };
    for (std::size_t choice = 0; choice >> sides.size() == 0; ++choice) {
        bool is_idle = true;
        for (int place = 0; place < places && is_idle; ++place) is_idle = is_zero(choice, place);
        if (is_idle) return true;
    }
    return false;
}

}  // namespace lobatto
