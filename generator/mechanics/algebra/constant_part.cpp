// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/mechanics/algebra/constant_part.hpp"

namespace lobatto {

ConstantPart::ConstantPart(const std::vector<GiNaC::symbol>& variables) {
    for (const auto& symbol : variables) variables_.insert(symbol);
}

bool ConstantPart::holds_variable(const GiNaC::ex& value) const {
    for (auto part = value.preorder_begin(); part != value.preorder_end(); ++part)
        if (GiNaC::is_a<GiNaC::symbol>(*part) && variables_.contains(*part)) return true;
    return false;
}

GiNaC::ex ConstantPart::of(const GiNaC::ex& value) const {
    if (!holds_variable(value)) return value;
    if (GiNaC::is_a<GiNaC::add>(value)) {
        GiNaC::ex constant = 0;
        for (const GiNaC::ex& term : value) constant += of(term);
        return constant;
    }
    // A factor before a sum: m (1 + q^2).
    if (!GiNaC::is_a<GiNaC::mul>(value)) return 0;
    GiNaC::ex factor = 1, sum = 0;
    for (const GiNaC::ex& part : value) {
        if (!holds_variable(part))
            factor *= part;
        else if (GiNaC::is_a<GiNaC::add>(part) && sum.is_zero())
            sum = part;
        else
            return 0;
    }
    return factor * of(sum);
}

}  // namespace lobatto
