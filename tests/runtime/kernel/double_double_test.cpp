// SPDX-License-Identifier: GPL-2.0-or-later
// DoubleDouble: operations and functions against 60 digits by CLN, at random and at hard arguments, in every lane.
#include "runtime/kernel/base/double_double_functions.hpp"

#include <cln/cln.h>
#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <random>
#include <string>

namespace {

using lobatto::DoubleDouble;
using lobatto::Pack;
using Wide = cln::cl_F;

const cln::float_format_t sixty_digits = cln::float_format(80);

Wide wide(const DoubleDouble& x) {
    return cln::cl_float(cln::rational(cln::cl_float(x.high)) + cln::rational(cln::cl_float(x.low)), sixty_digits);
}
DoubleDouble narrow(const Wide& x) {
    const double high = cln::double_approx(x);
    return {high, cln::double_approx(x - cln::cl_float(cln::rational(cln::cl_float(high)), sixty_digits))};
}

std::mt19937_64 generator(7);

DoubleDouble random_between(double least, double most) {
    std::uniform_real_distribution<double> uniform(least, most), unit(-0.5, 0.5);
    const double high = uniform(generator);
    const DoubleDouble x(high, 0.0);
    return x + DoubleDouble(std::ldexp(unit(generator), std::ilogb(high) - 52), 0.0);
}

// In units of 2^-106 of what it should be.
double error(const DoubleDouble& value, const Wide& want) {
    if (!(value.high - value.high == 0)) return HUGE_VAL;
    const Wide difference = cln::abs(wide(value) - want);
    if (cln::zerop(want)) return cln::double_approx(difference) == 0 ? 0 : HUGE_VAL;
    return cln::double_approx(cln::scale_float(difference / cln::abs(want), 106));
}

using Alone = std::function<DoubleDouble(const DoubleDouble&)>;
using Four = std::function<Pack<DoubleDouble, 4>(const Pack<DoubleDouble, 4>&)>;

// The largest error of `count` arguments, and that lanes have the bits of one alone.
double worst(const Alone& alone, const Four& four, const std::function<Wide(const Wide&)>& exact, double least,
             double most, int count = 400) {
    double largest = 0;
    for (int i = 0; i < count; i += 4) {
        DoubleDouble x[4], y[4];
        for (DoubleDouble& argument : x) argument = random_between(least, most);
        four(Pack<DoubleDouble, 4>::load(x)).store(y);
        for (int lane = 0; lane < 4; ++lane) {
            const DoubleDouble one = alone(x[lane]);
            CHECK(one.high == y[lane].high);
            CHECK(one.low == y[lane].low);
            largest = std::fmax(largest, error(one, exact(wide(x[lane]))));
        }
    }
    return largest;
}

#define LOBATTO_WORST(name, exact, least, most)                            \
    worst([](const DoubleDouble& x) { return lobatto::name(x); },          \
          [](const Pack<DoubleDouble, 4>& x) { return lobatto::name(x); }, \
          [](const Wide& x) { return cln::cl_float(cln::realpart(exact), sixty_digits); }, least, most)

}  // namespace

TEST_CASE("operations of double-double err by a few units of its last place") {
    double sum = 0, product = 0, quotient = 0, fused = 0;
    for (int i = 0; i < 2000; ++i) {
        const DoubleDouble a = random_between(0.1, 9), b = random_between(0.1, 9), c = random_between(0.1, 9);
        sum = std::fmax(sum, error(a + b, wide(a) + wide(b)));
        product = std::fmax(product, error(a * b, wide(a) * wide(b)));
        quotient = std::fmax(quotient, error(a / b, wide(a) / wide(b)));
        fused = std::fmax(fused, error(lobatto::fused(a, b, c), wide(a) * wide(b) + wide(c)));
    }
    CHECK(sum < 3);        // 1.9
    CHECK(product < 6);    // 2.6
    CHECK(quotient < 10);  // 6.3
    CHECK(fused < 6);      // 3.1
    // A difference errs by units of its operands: what they had been rounded to.
    const DoubleDouble a = random_between(1, 2), b = a * DoubleDouble(1 + 1e-10);
    CHECK(error(b - a, wide(b) - wide(a)) < 4e10);
    // At compile time and at run time there are the same bits, with FMA and without.
    constexpr DoubleDouble third = DoubleDouble(1) / 3, root_sum = third * third + third;
    volatile double three = 3;
    const DoubleDouble later = DoubleDouble(1) / DoubleDouble(three);
    CHECK((later * later + later == root_sum));
}

TEST_CASE("functions of double-double are right to 31 digits") {
    const cln::cl_F pi = cln::pi(sixty_digits);
    CHECK(LOBATTO_WORST(sqrt, cln::sqrt(x), 0, 4) < 4);       // 1.3
    CHECK(LOBATTO_WORST(exp, cln::exp(x), -1, 1) < 4);        // 1.1
    CHECK(LOBATTO_WORST(exp, cln::exp(x), -600, 700) < 4);    // 1.4
    CHECK(LOBATTO_WORST(log, cln::ln(x), 0.9, 1.1) < 8);      // 4.7
    CHECK(LOBATTO_WORST(log, cln::ln(x), 1e-9, 1e9) < 4);     // 0.7
    CHECK(LOBATTO_WORST(sin, cln::sin(x), -4, 4) < 4);        // 1.5
    CHECK(LOBATTO_WORST(sin, cln::sin(x), -1e12, 1e12) < 4);  // 1.7
    CHECK(LOBATTO_WORST(sin, cln::sin(x), 1e13, 1e18) < 4);   // 1.7, beyond the quick reduction
    CHECK(LOBATTO_WORST(cos, cln::cos(x), -4, 4) < 4);        // 2.0
    CHECK(LOBATTO_WORST(cos, cln::cos(x), -1e6, 1e6) < 4);    // 2.4
    CHECK(LOBATTO_WORST(tan, cln::tan(x), -4, 4) < 12);       // 8.2
    CHECK(LOBATTO_WORST(asin, cln::asin(x), -1, 1) < 8);
    CHECK(LOBATTO_WORST(acos, cln::acos(x), -1, 1) < 8);
    CHECK(LOBATTO_WORST(acos, cln::acos(x), 0.9999999, 1) < 8);
    CHECK(LOBATTO_WORST(atan, cln::atan(x), -5, 5) < 4);  // 1.7
    for (const double other : {-1.5, 0.25, 3.0}) {
        const double above =
            worst([&](const DoubleDouble& x) { return lobatto::atan2(x, DoubleDouble(other)); },
                  [&](const Pack<DoubleDouble, 4>& x) { return lobatto::atan2(x, Pack<DoubleDouble, 4>(other)); },
                  [&](const Wide& x) {
                      return cln::cl_float(cln::atan(cln::cl_float(other, sixty_digits), x), sixty_digits);
                  },
                  -5, 5);
        const double along =
            worst([&](const DoubleDouble& x) { return lobatto::atan2(DoubleDouble(other), x); },
                  [&](const Pack<DoubleDouble, 4>& x) { return lobatto::atan2(Pack<DoubleDouble, 4>(other), x); },
                  [&](const Wide& x) {
                      return cln::cl_float(cln::atan(x, cln::cl_float(other, sixty_digits)), sixty_digits);
                  },
                  -5, 5);
        CHECK(above < 8);
        CHECK(along < 8);
    }
    CHECK(LOBATTO_WORST(sinh, cln::sinh(x), -2, 2) < 8);    // 4.9
    CHECK(LOBATTO_WORST(cosh, cln::cosh(x), -40, 40) < 4);  // 1.8
    CHECK(LOBATTO_WORST(tanh, cln::tanh(x), -3, 3) < 10);   // 6.5
    CHECK(LOBATTO_WORST(fabs, cln::abs(x), -3, 3) == 0);
    // The nearest numbers to multiples of pi/2, whose sine or cosine is as small as rounding leaves it.
    for (const int k : {1, 2, 3, 100, 1000001, 1000000003}) {
        const DoubleDouble x = narrow(cln::cl_float(pi * k / 2, sixty_digits));
        const DoubleDouble small = k % 2 == 0 ? lobatto::sin(x) : lobatto::cos(x);
        CHECK(error(small, k % 2 == 0 ? cln::sin(wide(x)) : cln::cos(wide(x))) < 1000);  // 186; of some 1e-24
    }
}

TEST_CASE("powers of double-double err by a few units and half of the exponent") {
    double largest = 0;
    for (int i = 0; i < 500; ++i) {
        const DoubleDouble x = random_between(0.01, 100), y = random_between(-8, 8);
        largest = std::fmax(largest, error(lobatto::pow(x, y), cln::exp(wide(y) * cln::ln(wide(x)))));
    }
    CHECK(largest < 16);
    CHECK((lobatto::pow(DoubleDouble(-2), DoubleDouble(3)) == DoubleDouble(-8)));
    CHECK((lobatto::pow(DoubleDouble(0), DoubleDouble(2)) == DoubleDouble(0)));
    CHECK(std::isnan(lobatto::pow(DoubleDouble(-2), DoubleDouble(0.5)).high));
}

TEST_CASE("what overflows in double-double is not finite, and stays so") {
    const DoubleDouble large(1e300), infinity(HUGE_VAL), none(std::nan(""));
    for (const DoubleDouble& x :
         {large * large, DoubleDouble(1) / DoubleDouble(0), lobatto::exp(DoubleDouble(1000)), infinity, none,
          none + DoubleDouble(1), infinity * DoubleDouble(2), lobatto::sqrt(DoubleDouble(-1)),
          lobatto::log(DoubleDouble(0)), lobatto::sin(infinity)})
        CHECK_FALSE(lobatto::is_finite(x));
    CHECK(lobatto::exp(DoubleDouble(-1000)).high == 0);
    CHECK(lobatto::sqrt(DoubleDouble(0)).high == 0);
    CHECK(lobatto::atan(infinity).high == doctest::Approx(std::atan(HUGE_VAL)));
    CHECK(lobatto::tanh(infinity).high == 1);
    CHECK_FALSE((none < DoubleDouble(1)));
    CHECK_FALSE((none == none));
    CHECK((DoubleDouble(1, 1e-20) > DoubleDouble(1, 0)));
    CHECK((largest(Pack<DoubleDouble, 4>(DoubleDouble(1, 1e-20))) == DoubleDouble(1, 1e-20)));
}
