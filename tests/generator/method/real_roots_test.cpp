// SPDX-License-Identifier: GPL-2.0-or-later
// Zeros of rational polynomials: counted by Sturm's theorem, isolated, refined, written with radicals.
#include "generator/method/real_roots.hpp"

#include <doctest/doctest.h>

#include <random>

#include "generator/graph/notation.hpp"

namespace {

using namespace lobatto;
using GiNaC::ex;
using GiNaC::numeric;

const GiNaC::symbol z("z");

}  // namespace

TEST_CASE("every positive zero of a polynomial is found once, with its multiplicity, whatever its neighbours") {
    // Rational zeros from 1e-6 to 1e6, two of them 1e-9 apart, some twice or three times; negative and complex ones
    // too.
    const std::vector<std::pair<numeric, int>> planted = {
        {numeric(1, 1000000), 1}, {numeric(1, 3), 2}, {1, 1}, {1 + numeric(1, 1000000000), 3}, {7, 1}, {1000000, 2}};
    ex product = (z + 2) * GiNaC::pow(z + 5, 2) * (z * z + z + 1) * (z * z + 4) * 17;
    for (const auto& [zero, multiplicity] : planted) product *= GiNaC::pow(z - zero, multiplicity);
    const std::vector<RealRoot> roots = positive_roots(product, z);
    REQUIRE(roots.size() == planted.size());
    for (std::size_t i = 0; i < roots.size(); ++i) {
        CHECK(roots[i].low == planted[i].first);
        CHECK(roots[i].high == planted[i].first);
        CHECK(roots[i].multiplicity == planted[i].second);
        CHECK(roots[i].exact()->is_equal(planted[i].first));
    }
}

TEST_CASE("irrational zeros are separated, refined to any width, and as many as a fine grid finds") {
    std::mt19937 generator(7);
    int found = 0;
    for (int trial = 0; trial < 40; ++trial) {
        RationalPolynomial f;
        for (int k = 0; k <= 7; ++k) f.push_back(static_cast<int>(generator() % 201) - 100 + (k == 7 ? 300 : 0));
        ex polynomial = 0;
        for (int k = 0; k <= 7; ++k) polynomial += f[static_cast<std::size_t>(k)] * GiNaC::pow(z, k);
        std::vector<RealRoot> roots = positive_roots(polynomial, z);
        int changes = 0;
        double before = f[0].to_double();
        for (int i = 1; i <= 20000; ++i) {  // the zeros lie below 1 + 100/200
            double now = 0;
            for (std::size_t k = 8; k-- > 0;) now = now * i * 1e-4 + f[k].to_double();
            if (now * before < 0) ++changes;
            if (now != 0) before = now;
        }
        CHECK(static_cast<int>(roots.size()) == changes);
        found += changes;
        for (std::size_t i = 0; i < roots.size(); ++i) {
            if (i > 0) CHECK(roots[i - 1].high < roots[i].low);
            roots[i].refine(numeric(10).power(-50));
            CHECK(roots[i].high - roots[i].low <= numeric(10).power(-50));
            CHECK(value(roots[i].polynomial, roots[i].low) * value(roots[i].polynomial, roots[i].high) <= 0);
        }
    }
    CHECK(found > 20);  // or nothing was tested
}

TEST_CASE("zeros of quadratics are written with radicals, in lowest terms") {
    const auto texts = [](const ex& f) {
        std::string text;
        for (const RealRoot& root : positive_roots(f, z)) text += radicals_of(root) + "; ";
        return text;
    };
    CHECK(texts(z * z - 84 * z + 720) == "42 - 6*sqrt(29); 42 + 6*sqrt(29); ");
    CHECK(texts(z * z - 8) == "2*sqrt(2); ");
    CHECK(texts(4 * z * z - 4 * z + numeric(1, 2)) == "1/2 - sqrt(2)/4; 1/2 + sqrt(2)/4; ");
    CHECK(texts((z - 10) * (z - numeric(2, 3))) == "2/3; 10; ");
    CHECK(!positive_roots(z * z * z - 2, z).front().exact());
    CHECK(radicals_of(positive_roots(z * z * z - 2, z).front()) == "");
    CHECK(radicals_of_square_root(positive_roots(z - 8, z).front()) == "sqrt(8)");
    CHECK(radicals_of_square_root(positive_roots(4 * z - 9, z).front()) == "3/2");
    CHECK(radicals_of_square_root(positive_roots(z * z - 84 * z + 720, z).front()) == "sqrt(42 - 6*sqrt(29))");
    // The radicals are the zero.
    for (const RealRoot& root : positive_roots((3 * z * z - 7 * z + 2) * (z * z - 10 * z + 1) * (z * z + z - 5), z))
        if (const auto exact = root.exact())
            CHECK(abs(GiNaC::ex_to<numeric>(GiNaC::evalf(*exact)) - root.approximation(20)) < numeric(1e-12));
}

TEST_CASE("decimals of zeros are right to the last digit") {
    // Two well-known numbers.
    CHECK(decimal_of(positive_roots(z * z * z - 2, z).front(), 30) == "1.25992104989487316476721060728");
    CHECK(decimal_of(positive_roots(z * z - 2, z).front(), 30) == "1.41421356237309504880168872421");
    CHECK(decimal_of_square_root(positive_roots(z - 2, z).front(), 30) == "1.41421356237309504880168872421");
    CHECK(decimal_of(positive_roots(8 * z - 1, z).front(), 30) == "0.125");
}

TEST_CASE("Sturm's chain counts the zeros of an interval") {
    const SturmChain chain(rational_polynomial((z - 1) * (z - 2) * (z - 3) * (z * z + 1), z));
    CHECK(chain.zeros(0, 10) == 3);
    CHECK(chain.zeros(1, 3) == 2);  // the lower end is left out
    CHECK(chain.zeros(numeric(3, 2), numeric(5, 2)) == 1);
    CHECK(chain.zeros_beyond(2) == 1);
    CHECK(chain.zeros_beyond(3) == 0);
}

TEST_CASE("what is no polynomial over the rationals is refused") {
    CHECK_THROWS_AS(rational_polynomial(GiNaC::sin(z), z), std::invalid_argument);
    CHECK_THROWS_AS(rational_polynomial(GiNaC::sqrt(ex(2)) * z, z), std::invalid_argument);
    CHECK_THROWS_AS(rational_polynomial(z * GiNaC::symbol("y"), z), std::invalid_argument);
    CHECK_THROWS_AS(positive_roots(0, z), std::invalid_argument);
    CHECK(positive_roots(5, z).empty());
}

TEST_CASE("polynomials are written in ascending powers") {
    CHECK(text_of(rational_polynomial(1 - 7 * z / 15 + 23 * z * z / 900 - GiNaC::pow(z, 3) / 3600, z), "z") ==
          "1 - 7*z/15 + 23*z^2/900 - z^3/3600");
    CHECK(text_of(rational_polynomial(-z, z), "z") == "-z");
    CHECK(text_of({}, "z") == "0");
}
