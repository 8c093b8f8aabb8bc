// SPDX-License-Identifier: GPL-2.0-or-later
// The exact coefficients, against the paper (4 points) and closed forms known otherwise (2, 3 and 5 points).
#include "generator/quadrature.hpp"

#include <doctest/doctest.h>

#include "generator/propagation.hpp"

using namespace lobatto;
using GiNaC::ex;
using GiNaC::numeric;

namespace {

ex root(int radicand) {
    return GiNaC::sqrt(ex(radicand));
}

bool equal(const ex& x, const ex& y) {
    return expand_exactly(x - y).is_zero();
}

}  // namespace

TEST_CASE("four points have the paper's nodes, weights and basis") {
    const Quadrature q = quadrature_of({Family::lobatto, 4});
    const ex xi = numeric(1, 2) - root(5) / 10;
    CHECK(equal(q.c[1], xi));
    CHECK(equal(q.c[2], 1 - xi));
    for (const std::size_t i : {0u, 3u}) CHECK(equal(q.b[i], numeric(1, 12)));
    for (const std::size_t i : {1u, 2u}) CHECK(equal(q.b[i], numeric(5, 12)));
    const ex t = q.theta;
    CHECK(equal(q.basis[0], 5 * (t - xi) * (t - (1 - xi)) * (1 - t)));
    CHECK(equal(q.basis[1], -5 * root(5) * t * (1 - t) * (t - (1 - xi))));
    CHECK(equal(q.basis[2], 5 * root(5) * t * (1 - t) * (t - xi)));
    CHECK(equal(q.basis[3], 5 * t * (t - xi) * (t - (1 - xi))));
}

TEST_CASE("four points have the paper's rigidity matrix K") {
    const Quadrature q = quadrature_of({Family::lobatto, 4});
    const ex left = -5 * root(5) / 4 - numeric(25, 12), right = 5 * root(5) / 4 - numeric(25, 12);
    const ex K[4][4] = {{numeric(13, 3), left, right, numeric(-1, 6)},
                        {left, numeric(25, 3), numeric(-25, 6), right},
                        {right, numeric(-25, 6), numeric(25, 3), left},
                        {numeric(-1, 6), right, left, numeric(13, 3)}};
    for (unsigned i = 0; i < 4; ++i)
        for (unsigned j = 0; j < 4; ++j) CHECK(equal(q.K(i, j), K[i][j]));
}

TEST_CASE("four points have the stage matrix A = [1/60, (11 - 5 sqrt 5)/120; (11 + 5 sqrt 5)/120, 1/60]") {
    const Quadrature q = quadrature_of({Family::lobatto, 4});
    CHECK(equal(q.A(0, 0), numeric(1, 60)));
    CHECK(equal(q.A(0, 1), (11 - 5 * root(5)) / 120));
    CHECK(equal(q.A(1, 0), (11 + 5 * root(5)) / 120));
    CHECK(equal(q.A(1, 1), numeric(1, 60)));
}

TEST_CASE("two points are the trapezoidal rule, three are Simpson's, five have the weights 1/20, 49/180, 16/45") {
    const auto weights = [](int points, const std::vector<ex>& expected) {
        const Quadrature q = quadrature_of({Family::lobatto, points});
        REQUIRE(q.b.size() == expected.size());
        for (std::size_t i = 0; i < expected.size(); ++i) CHECK(equal(q.b[i], expected[i]));
    };
    weights(2, {numeric(1, 2), numeric(1, 2)});
    weights(3, {numeric(1, 6), numeric(2, 3), numeric(1, 6)});
    weights(5, {numeric(1, 20), numeric(49, 180), numeric(16, 45), numeric(49, 180), numeric(1, 20)});
    CHECK(equal(quadrature_of({Family::lobatto, 3}).A(0, 0), numeric(1, 24)));
    CHECK(equal(quadrature_of({Family::lobatto, 5}).c[1], (7 - root(21)) / 14));
}

TEST_CASE("the determinant of the oscillator's propagation is exactly 1 for 2 to 5 points") {
    for (int points = 2; points <= 5; ++points) {
        const Propagation p = propagation(quadrature_of({Family::lobatto, points}));
        CHECK(equal(p.a * p.a - p.b * p.c, p.delta * p.delta));
        CHECK(p.a.subs(p.z == 0).is_equal(1));
        CHECK(p.c.subs(p.z == 0).is_equal(1));  // q1 = q0 + (h/m) p0 when nothing pulls
        CHECK(p.b.subs(p.z == 0).is_zero());
        CHECK(p.b.coeff(p.z, 1).is_equal(-1));
        CHECK(p.delta.subs(p.z == 0).is_equal(1));
    }
}

TEST_CASE("four points propagate the oscillator by the paper's polynomials in z = h^2 omega^2") {
    const Propagation p = propagation(quadrature_of({Family::lobatto, 4}));
    const ex z = p.z;
    CHECK(equal(p.delta, 1 + z / 30 + z * z / 1800));
    CHECK(equal(p.a, 1 - 7 * z / 15 + 23 * z * z / 900 - z * z * z / 3600));
    CHECK(equal(p.b, z * (z - 60) * (z * z - 84 * z + 720) / 43200));
    CHECK(equal(p.c, 1 - 2 * z / 15 + z * z / 300));
}

TEST_CASE("two points propagate the oscillator as Stoermer and Verlet do, three as Simpson's rule") {
    const Propagation verlet = propagation(quadrature_of({Family::lobatto, 2}));
    CHECK(equal(verlet.delta, 1));
    CHECK(equal(verlet.a, 1 - verlet.z / 2));
    CHECK(equal(verlet.b, -verlet.z * (1 - verlet.z / 4)));
    CHECK(equal(verlet.c, 1));
    const Propagation simpson = propagation(quadrature_of({Family::lobatto, 3}));
    const ex z = simpson.z;
    // The middle position is (q0 + q1)/2 (1 - z/24 ...): eliminated by hand.
    CHECK(equal(simpson.delta, 1 + z / 24));
    CHECK(equal(simpson.a, 1 - 11 * z / 24 + z * z / 48));
    CHECK(equal(simpson.c, 1 - z / 8));
}
