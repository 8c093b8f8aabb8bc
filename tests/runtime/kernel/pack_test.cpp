// SPDX-License-Identifier: GPL-2.0-or-later
// runtime/kernel/base/pack.hpp: every operation of a pack is that of its lanes.
#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>
#include <type_traits>

#include "runtime/kernel/kernel.hpp"

using namespace lobatto;

namespace {

template <class real_, int width_>
struct Kind {
    using real = real_;
    static constexpr int width = width_;
};

template <class P>
P random_pack(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> x(-2, 2);
    P result;
    for (int lane = 0; lane < lanes_of<P>; ++lane) result.set(lane, static_cast<real_of<P>>(x(random)));
    return result;
}

}  // namespace

TEST_CASE_TEMPLATE("arithmetic of packs is that of their lanes", K, Kind<double, 1>, Kind<double, 2>, Kind<double, 4>,
                   Kind<double, 8>, Kind<float, 1>, Kind<float, 2>, Kind<float, 4>, Kind<float, 8>, Kind<float, 16>,
                   Kind<long double, 1>, Kind<long double, 4>) {
    using real = typename K::real;
    using P = Pack<real, K::width>;
    static_assert(lanes_of<P> == K::width && std::is_same_v<real_of<P>, real>);
    const P a = random_pack<P>(1), b = random_pack<P>(2), c = random_pack<P>(3);
    P d = a;
    d += b;
    d *= c;
    d -= a;
    d /= b;
    const P root = lobatto::sqrt(lobatto::fabs(a)), product = fused(a, b, real(0.5)), mixed = real(2) - a * real(3);
    const auto below = a < b;
    const P chosen = select(below & !(c > real(0)), a, real(7)), least = minimum(a, b), most = maximum(a, b);
    real total = 0, top = a[0];
    bool some = false, every = true;
    for (int lane = 0; lane < K::width; ++lane) {
        const real x = a[lane], y = b[lane], z = c[lane];
        CHECK(d[lane] == ((x + y) * z - x) / y);
        CHECK((-a)[lane] == -x);
        CHECK(root[lane] == std::sqrt(std::fabs(x)));
        CHECK(product[lane] == lobatto::fused(x, y, real(0.5)));
        CHECK(mixed[lane] == real(2) - x * real(3));
        CHECK(below[lane] == (x < y));
        CHECK((a <= b)[lane] == (x <= y));
        CHECK((a >= b)[lane] == (x >= y));
        CHECK((a == a)[lane]);
        CHECK((a != b)[lane] == (x != y));
        CHECK((below | (a > b))[lane] == (x != y));
        CHECK(chosen[lane] == (x < y && !(z > 0) ? x : real(7)));
        CHECK(least[lane] == std::min(x, y));
        CHECK(most[lane] == std::max(x, y));
        total += x;
        top = std::max(top, x);
        some = some || x < y;
        every = every && x < y;
    }
    CHECK(std::fabs(sum(a) - total) <= real(64) * Limits<real>::epsilon);
    CHECK(largest(a) == top);
    CHECK(any(below) == some);
    CHECK(all(below) == every);
}

TEST_CASE_TEMPLATE("one lane alone is found by any, and missed by all", K, Kind<double, 1>, Kind<double, 2>,
                   Kind<double, 4>, Kind<double, 8>, Kind<float, 2>, Kind<float, 16>, Kind<long double, 2>) {
    for (int lane = 0; lane < K::width; ++lane) {
        Mask<typename K::real, K::width> one = false, others = true;
        CHECK_FALSE(any(one));
        CHECK(all(others));
        one.set(lane, true);
        others.set(lane, false);
        CHECK(any(one));
        CHECK_FALSE(all(others));
        CHECK(one[lane]);
        CHECK(all(one | others));
        CHECK_FALSE(any(one & others));
    }
}

TEST_CASE_TEMPLATE("packs are loaded from and stored to any address", K, Kind<double, 2>, Kind<double, 8>,
                   Kind<float, 2>, Kind<float, 16>) {
    using P = Pack<typename K::real, K::width>;
    typename K::real from[K::width + 3], to[K::width + 3] = {};
    for (int i = 0; i < K::width + 3; ++i) from[i] = static_cast<typename K::real>(i);
    P::load(from + 1).store(to + 2);
    CHECK(to[1] == 0);
    for (int i = 0; i < K::width; ++i) CHECK(to[i + 2] == from[i + 1]);
    CHECK(to[K::width + 2] == 0);
}

TEST_CASE_TEMPLATE("a rough inverse is right to a seventh over the whole range", K, Kind<double, 4>, Kind<float, 8>) {
    using real = typename K::real;
    using P = Pack<real, K::width>;
    const real largest = std::numeric_limits<real>::max() / 4;
    for (real x = std::numeric_limits<real>::min(); x < largest; x *= real(1.03))
        REQUIRE(std::fabs(rough_inverse(P(x))[0] * x - 1) < real(1) / 7);
}

TEST_CASE("a pack keeps the sign of zero, and no comparison with NaN but != holds") {
    using P = Pack<double, 8>;
    CHECK(std::signbit(P(-0.0)[5]));
    CHECK_FALSE(std::signbit(P(0.0)[5]));
    CHECK(std::signbit((-P(0.0))[5]));
    const P none = std::numeric_limits<double>::quiet_NaN();
    CHECK_FALSE(any((none < 1.0) | (none >= 1.0) | (none == none)));
    CHECK(all(none != none));
}

TEST_CASE("plain numbers have the names of packs") {
    CHECK(lanes_of<double> == 1);
    CHECK(std::is_same_v<real_of<float>, float>);
    CHECK(lobatto::select(2.0 < 3.0, 1.0, 4.0) == 1.0);
    CHECK(lobatto::any(true));
    CHECK_FALSE(lobatto::all(false));
    CHECK(lobatto::fused(2.0L, 3.0L, 4.0L) == 10);
    CHECK(lobatto::minimum(2.0f, 3.0f) + lobatto::maximum(2.0f, 3.0f) == 5);
    CHECK(lobatto::sum(3.0) == lobatto::largest(3.0));
    CHECK(rounded_once(1 + 0x1p-30, 1 - 0x1p-30, -1.0) == -0x1p-60);
}
