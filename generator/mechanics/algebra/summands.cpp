// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/algebra/summands.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;

ex with_operand(const ex& part, std::size_t i, const ex& x) {
    if (GiNaC::is_a<GiNaC::power>(part)) return GiNaC::pow(x, part.op(1));
    GiNaC::exvector operands(part.begin(), part.end());
    operands[i] = x;
    if (GiNaC::is_a<GiNaC::mul>(part)) return GiNaC::mul(operands);
    return GiNaC::function(GiNaC::ex_to<GiNaC::function>(part).get_serial(), operands);
}

class Summands {
public:
    // A part of the formula, and the derivative of the whole in it.
    void take(const ex& part, const ex& effect) {
        if (GiNaC::is_a<GiNaC::add>(part)) {
            for (const ex& summand : part) {
                add(effect * summand);
                take(summand, effect);
            }
        } else if (GiNaC::is_a<GiNaC::power>(part)) {
            take_operand(part, 0, effect);
        } else if (GiNaC::is_a<GiNaC::mul>(part) || GiNaC::is_a<GiNaC::function>(part)) {
            for (std::size_t i = 0; i < part.nops(); ++i) take_operand(part, i, effect);
        }
    }
    void add(const ex& summand) {
        if (known_.insert(summand).second && known_.count(-summand) == 0) all_.push_back(summand);
    }
    std::vector<ex> all() { return std::move(all_); }

private:
    void take_operand(const ex& part, std::size_t i, const ex& effect) {
        const ex operand = part.op(i);
        if (operand.nops() == 0) return;  // a symbol or a number
        const GiNaC::symbol place;
        take(operand, effect * with_operand(part, i, place).diff(place).subs(place == operand));
    }

    std::vector<ex> all_;
    GiNaC::exset known_;
};

}  // namespace

std::vector<ex> summands_of(const ex& f) {
    Summands summands;
    if (!GiNaC::is_a<GiNaC::add>(f)) summands.add(f);
    summands.take(f, 1);
    return summands.all();
}

}  // namespace lobatto
