// SPDX-License-Identifier: GPL-2.0-or-later
// Sums of doubles as decimals: what is written reads back to the same bits, and says the number.
#include "runtime/files/decimal.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "runtime/run/parts.hpp"

using namespace lobatto;

namespace {

std::string text_of(const std::vector<double>& parts) {
    return decimal_text(parts.data(), static_cast<int>(parts.size()));
}
std::vector<double> parts_of(const std::string& text, int count) {
    std::vector<double> parts(static_cast<std::size_t>(count));
    CHECK(read_decimal(text, parts.data(), count));
    return parts;
}

}  // namespace

TEST_CASE("sums of one, two and three doubles read back to the same bits") {
    std::mt19937_64 generator(5);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (const int count : {1, 2, 3})
        for (int i = 0; i < 300; ++i) {
            std::vector<double> parts;
            double size = std::ldexp(1.0, static_cast<int>(600 * unit(generator)));
            for (int j = 0; j < count; ++j) {
                parts.push_back(size * unit(generator));
                size = std::ldexp(std::fabs(parts.back()), -54);
            }
            const std::string text = text_of(parts);
            CAPTURE(text);
            CHECK(parts_of(text, count) == parts);
        }
}

TEST_CASE("decimals have the digits that a number needs, and no more") {
    CHECK(text_of({0.1}) == "0.1");
    CHECK(text_of({0.1, 0.0}) == "0.1000000000000000055511151231257827021181583404541015625");
    CHECK(text_of(parts_of("0.1", 2)) == "0.1");
    CHECK(text_of(parts_of("3.14159265358979323846264338327950", 2)) == "3.1415926535897932384626433832795");
    CHECK(text_of({1.0, 0x1p-200}) ==
          "1.00000000000000000000000000000000000000000000000000000000000062230152778611417071440641");
    CHECK(text_of({-0.0, 0.0}) == "-0");
    CHECK(text_of({3.0, 0.0}) == "3");
    CHECK(text_of({std::numeric_limits<double>::infinity(), 0.0}) == "inf");
    CHECK(text_of({std::nan(""), std::nan("")}) == "nan");
    CHECK(text_of(parts_of("-1.5e-40", 2)) == "-1.5e-40");
    CHECK(text_of(parts_of("6.02214076e+23", 3)) == "6.02214076e+23");
    double parts[2];
    for (const char* const wrong : {"", "x", "1.5x", "1e", "--1"}) CHECK_FALSE(read_decimal(wrong, parts, 2));
}

TEST_CASE("a fraction of a sum of doubles is right to all its parts") {
    const std::vector<double> tenth = parts_of("0.1", 2), third = times_fraction({1.0, 0.0}, 1, 3);
    CHECK(times_fraction(tenth, 10, 1)[0] == 1);
    CHECK(std::fabs(times_fraction(tenth, 10, 1)[1]) < 1e-31);
    CHECK(minus({1.0, 0.0}, 1e-20) == std::vector<double>{1.0, -1e-20});
    CHECK(third == parts_of("0.33333333333333333333333333333333333333333333", 2));
    CHECK(std::fabs(difference(third.data(), parts_of("0.3333333333333333333333", 2).data(), 2) - 1.0 / 3 * 1e-22) <
          1e-32);
}
