// SPDX-License-Identifier: GPL-2.0-or-later
// The summands of a formula: the terms of all sums in it, with their effect on the whole.
#include "generator/mechanics/algebra/summands.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace lobatto;
using GiNaC::ex;

namespace {

const GiNaC::symbol x("x"), a("a"), b("b");

// Whether these are all, but for their order and signs.
bool are_all(const std::vector<ex>& found, const std::vector<ex>& expected) {
    return found.size() == expected.size() && std::all_of(expected.begin(), expected.end(), [&](const ex& one) {
               return std::any_of(found.begin(), found.end(), [&](const ex& other) {
                   return (one - other).expand().is_zero() || (one + other).expand().is_zero();
               });
           });
}

}  // namespace

TEST_CASE("the summands of a formula are those of all sums in it, with their effect on the whole") {
    CHECK(are_all(summands_of(x + a - 1), {x, a, 1}));
    CHECK(are_all(summands_of(GiNaC::pow(x - a, 2) + b), {GiNaC::pow(x - a, 2), b, 2 * (x - a) * x, 2 * (x - a) * a}));
    CHECK(are_all(summands_of(3 * GiNaC::cos(x) - 3), {3 * GiNaC::cos(x), 3}));
    CHECK(are_all(summands_of(GiNaC::exp(x - a)), {GiNaC::exp(x - a), GiNaC::exp(x - a) * x, GiNaC::exp(x - a) * a}));
    CHECK(are_all(summands_of(x * (a + 1) - b), {x * (a + 1), b, x * a, x}));
    CHECK(are_all(summands_of(x * a), {x * a}));
    CHECK(are_all(summands_of(x), {x}));
}

TEST_CASE("a summand that differs from another by its sign alone counts once") {
    CHECK(are_all(summands_of((x - a) * b + (a - x)), {(x - a) * b, x, a, x * b, a * b}));
}
