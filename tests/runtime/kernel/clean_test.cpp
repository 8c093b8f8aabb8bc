// SPDX-License-Identifier: GPL-2.0-or-later
// Round-off-clean steps: the steps of plain arithmetic to rounding, which is small, unbiased and grows as it should.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

#include "runtime/kernel/kernel.hpp"
#include "tests/handwritten/chain.hpp"

using namespace lobatto;

namespace {

using Quad = __float128;

template <class number, class Tables>
using Rule = CleanFixedPoint<HandwrittenChain<number, Tables, 1, Chain::newton>>;

// The largest |eta_ij - eta_ji - (gamma_i - gamma_j)| and |beta_i + gamma_i - h| of a rule's coefficients at a step;
// and of these rounded one by one.
template <class number, class Tables>
std::pair<Quad, Quad> symplecticity(number h) {
    using R = Rule<number, Tables>;
    using Table = HandwrittenChain<number, Tables, 1, Chain::newton>;
    R rule;
    REQUIRE(rule.prepare(h) == Status::ok);
    const auto entry = [](const auto* values, int i) -> Quad { return lane_of(values[i / R::width], i % R::width); };
    Quad clean = 0, plain = 0;
    const auto larger = [](Quad a, Quad b) { return a > (b < 0 ? -b : b) ? a : b < 0 ? -b : b; };
    for (int i = 0; i < R::m; ++i) {
        clean = larger(clean, Quad(rule.beta[i + 1]) + entry(rule.gamma, i) - Quad(h));
        for (int j = 0; j < R::m; ++j) {
            clean = larger(
                clean, entry(rule.eta[j], i) - entry(rule.eta[i], j) - (entry(rule.gamma, i) - entry(rule.gamma, j)));
            const auto of = [&](int a, int b) -> Quad {
                return number(h * (Table::A[a * R::m + b] / Table::b[b + 1]));
            };
            plain = larger(
                plain, of(i, j) - of(j, i) - (Quad(number(h * Table::c[i + 1])) - Quad(number(h * Table::c[j + 1]))));
        }
    }
    return {clean, plain};
}

}  // namespace

TEST_CASE("the coefficients of clean steps are symplectic without any rounding, those of plain ones are not") {
    std::mt19937_64 random(1);
    int plain_fail = 0;
    const auto check = [&](auto number, auto tables) {
        using real = decltype(number);
        using Tables = decltype(tables);
        for (int i = 0; i < 200; ++i) {
            const double exponent = std::uniform_real_distribution<>(-30, 30)(random);
            const real h = static_cast<real>((i % 2 == 0 ? 1 : -1) * std::exp2(exponent / (sizeof(real) == 4 ? 3 : 1)));
            const auto [clean, plain] = symplecticity<real, Tables>(h);
            CHECK(clean == 0);
            plain_fail += plain != 0;
        }
    };
    check(1.0f, SeparableLobattoFour<float>());
    check(1.0, SeparableLobattoFour<double>());
    check(1.0L, SeparableLobattoFour<long double>());
    check(1.0, SeparableGaussTwo<double>());
    CHECK(plain_fail > 100);
}

TEST_CASE("error-free sums and products have no error") {
    std::mt19937_64 random(2);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 10000; ++i) {
        const double a = std::ldexp(normal(random), static_cast<int>(random() % 60)), b = normal(random);
        double error;
        const double sum = add_with_error(a, b, error);
        CHECK(Quad(sum) + Quad(error) == Quad(a) + Quad(b));
        const double product = multiply_with_error(a, b, error);
        CHECK(Quad(product) + Quad(error) == Quad(a) * Quad(b));
        const long double wide = static_cast<long double>(a) / 3;
        long double rest;
        const long double wide_sum = add_with_error(wide, static_cast<long double>(b), rest);
        CHECK(Quad(wide_sum) + Quad(rest) == Quad(wide) + Quad(b));
        // The product of two numbers of 64 bits has 128: of 113 the last are rounded.
        const long double short_one = static_cast<long double>(static_cast<float>(b)) / 1024;
        const long double wide_product = multiply_with_error(wide, short_one, rest);
        CHECK(Quad(wide_product) + Quad(rest) == Quad(wide) * Quad(short_one));
    }
}
