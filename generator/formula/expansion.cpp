// SPDX-License-Identifier: GPL-2.0-or-later
#include "generator/formula/expansion.hpp"

namespace lobatto {

double terms_when_expanded(const GiNaC::ex& expression) {
    if (GiNaC::is_a<GiNaC::add>(expression)) {
        double sum = 0;
        for (const GiNaC::ex& term : expression) sum += terms_when_expanded(term);
        return sum;
    }
    if (GiNaC::is_a<GiNaC::mul>(expression)) {
        double product = 1;
        for (const GiNaC::ex& factor : expression) product *= terms_when_expanded(factor);
        return product;
    }
    if (GiNaC::is_a<GiNaC::function>(expression)) return terms_when_expanded(expression.op(0));
    if (GiNaC::is_a<GiNaC::power>(expression) && expression.op(1).info(GiNaC::info_flags::posint)) {
        const double terms = terms_when_expanded(expression.op(0));
        const double exponent = GiNaC::ex_to<GiNaC::numeric>(expression.op(1)).to_double();
        double combinations = 1;  // (terms + exponent - 1 over exponent)
        for (int i = 1; i <= exponent && combinations < 1e9 && terms > 1; ++i) combinations *= (terms + i - 1) / i;
        return combinations;
    }
    return 1;
}

GiNaC::ex expanded(const GiNaC::ex& expression) {
    return terms_when_expanded(expression) <= most_terms ? expression.expand() : expression;
}

}  // namespace lobatto
