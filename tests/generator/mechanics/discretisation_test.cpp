// SPDX-License-Identifier: GPL-2.0-or-later
// The discrete equations of 4 points against the paper's own formulas.
#include "generator/mechanics/discretisation.hpp"

#include <doctest/doctest.h>

#include "tests/scenes/scenes.hpp"

using namespace lobatto;
using GiNaC::ex;
using GiNaC::numeric;

namespace {

bool equal(const ex& x, const ex& y) {
    return expand_exactly(x - y).is_zero();
}

// One coordinate with 4 points in the potential m V(q): the paper's q_l, q_xi, q_{1-xi}, q_r.
struct Paper {
    explicit Paper(const std::string& potential)
        : derivation(
              derive(test::scene_of("m*q'^2/2 - " + potential, "q = { position = 1, velocity = 0 }", 4, "m = 2"))),
          d(derivation.discretisation()),
          h(d.h),
          m(derivation.system.parameters[0]),
          ql(d.Q[0][0]),
          qx(d.Q[1][0]),
          qy(d.Q[2][0]),
          qr(d.Q[3][0]) {}
    ex force(const ex& position) const {
        return derivation.system.gradient[0].subs(derivation.system.q[0] == position);
    }
    Derivation derivation;
    const Discretisation& d;
    ex h, m, ql, qx, qy, qr, root5 = GiNaC::sqrt(ex(5));
};

}  // namespace

TEST_CASE("the discrete Lagrangian of the oscillator is the paper's eq:discreteLagrangian") {
    const Paper p("m*9*q^2/2");
    const ex bracket = 26 * (p.ql * p.ql + p.qr * p.qr) - 2 * p.ql * p.qr +
                       50 * (p.qx * p.qx - p.qx * p.qy + p.qy * p.qy) - 25 * (p.ql + p.qr) * (p.qx + p.qy) -
                       15 * p.root5 * (p.ql - p.qr) * (p.qx - p.qy);
    const ex potential = p.ql * p.ql + p.qr * p.qr + 5 * (p.qx * p.qx + p.qy * p.qy);
    CHECK(equal(p.d.L_d, p.m / (12 * p.h) * bracket - p.m * p.h * 9 / 24 * potential));
}

TEST_CASE("the interior equations in solved form are the paper's eq:internesNL") {
    const Paper p("m*(1 - cos(q))");
    const ex V_x = p.force(p.qx), V_y = p.force(p.qy), factor = p.h * p.h / (30 * p.m);
    CHECK(equal(p.d.full_system[0],
                p.qx - factor * (V_y + 2 * V_x) - (5 + p.root5) / 10 * p.ql - (5 - p.root5) / 10 * p.qr));
    CHECK(equal(p.d.full_system[1],
                p.qy - factor * (2 * V_y + V_x) - (5 - p.root5) / 10 * p.ql - (5 + p.root5) / 10 * p.qr));
}

TEST_CASE("the discrete dynamics are the paper's eq:discreteDynamics") {
    const Paper p("m*(1 - cos(q))");
    const ex V_l = p.force(p.ql), V_x = p.force(p.qx), V_y = p.force(p.qy), V_r = p.force(p.qr);
    const ex p0 = p.d.p0[0], p1 = p.d.p1[0];
    CHECK(equal(p.d.full_system[2], p1 - p0 + p.h / 12 * (V_l + 5 * (V_x + V_y) + V_r)));
    CHECK(equal(p.d.full_system[3], p.qr - p.ql - p.h * p.h / (24 * p.m) * (V_r + p.root5 * (V_y - V_x) - V_l) -
                                        p.h / (2 * p.m) * (p1 + p0)));
}

TEST_CASE("with two points the step is Stoermer and Verlet's: no unknowns, q1 = q0 + h v") {
    const Derivation derivation = derive(test::pendulum_scene(2));
    const Discretisation& d = derivation.discretisation();
    CHECK(d.interior.empty());
    CHECK(d.reduced_system.empty());
    CHECK(equal(d.arrival_position[0], d.Q[0][0] + d.h * d.drift_velocity[0]));
}

TEST_CASE("the Jacobian of several coupled coordinates is the derivative of the system") {
    const Derivation derivation = derive(test::coupled_scene(3));
    const Discretisation& d = derivation.discretisation();
    REQUIRE(d.full_unknowns.size() == 6);
    for (unsigned i = 0; i < 6; ++i)
        for (unsigned j = 0; j < 6; ++j) CHECK(equal(d.full_jacobian(i, j), d.full_system[i].diff(d.full_unknowns[j])));
}

TEST_CASE("Gauss with one stage is the implicit midpoint rule: L_d = h L((q0 + q1)/2, (q1 - q0)/h)") {
    Scene scene = test::pendulum_scene(4);
    scene.method = {Family::gauss, 1};
    const Derivation derivation = derive(scene);
    const Discretisation& d = derivation.discretisation();
    const ex m = derivation.system.parameters[0], omega = derivation.system.parameters[1];
    const ex q0 = d.Q[0][0], q1 = d.Q[1][0];
    REQUIRE(d.Q.size() == 2);
    CHECK(equal(d.L_d,
                m * GiNaC::pow(q1 - q0, 2) / (2 * d.h) - d.h * m * omega * omega * (1 - GiNaC::cos((q0 + q1) / 2))));
    CHECK(d.full_system.empty());
    // One stage Y = (q0 + q1)/2: Y = q0 + h/2 v - h^2/4 W(Y).
    REQUIRE(d.reduced_system.size() == 1);
    const ex Y = d.Y[1][0];
    CHECK(equal(d.reduced_system[0], Y - q0 - d.h / 2 * d.p0[0] / m + d.h * d.h / 4 * omega * omega * GiNaC::sin(Y)));
}

TEST_CASE("forces and time enter the slopes by the quadrature of the action: Lobatto with two points") {
    const Derivation derivation =
        derive(read_scene(Source("test.toml",
                                 "title = \"Test\"\ntime = \"t\"\nlagrangian = \"q'^2*(1 + q^2)/2\"\n[coordinates]\n"
                                 "q = { position = 1, velocity = 1 }\n[forces]\nq = \"t*q'\"\n[method]\npoints = 2\n"
                                 "[run]\nstep = 0.1\nuntil = 1\n")));
    const Discretisation& d = derivation.discretisation();
    const ex q0 = d.Q[0][0], q1 = d.Q[1][0], h = d.h, v = (q1 - q0) / h;
    CHECK(equal(d.L_d, h / 4 * v * v * (2 + q0 * q0 + q1 * q1)));
    CHECK(equal(d.left_momentum[0], v * (2 + q0 * q0 + q1 * q1) / 2 - h / 2 * (q0 * v * v + d.t0 * v)));
    CHECK(equal(d.right_momentum[0], v * (2 + q0 * q0 + q1 * q1) / 2 + h / 2 * (q1 * v * v + (d.t0 + h) * v)));
}
