// SPDX-License-Identifier: GPL-2.0-or-later
// Motions of rigid bodies on joints against the same systems written by hand.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "generator/pipeline.hpp"
#include "runtime/run/trajectory.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

const std::string run = "[method]\npoints = 8\n[run]\nstep = 0.05\nuntil = 3\n";

std::vector<double> end_of(const std::string& text) {
    const Scene scene = read_scene(Source("bodies.toml", text + run));
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    const TrajectoryResult result = integrate(kernel, request_of(scene, steps_of(scene, {}).count, stepper));
    REQUIRE(result.status == LOBATTO_OK);
    return result.q;
}

// The column j of the rotation of a quaternion, of any length.
std::vector<double> column(const std::vector<double>& q, int j) {
    const double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    const double R[3][3] = {{q[0] * q[0] + q[1] * q[1] - q[2] * q[2] - q[3] * q[3], 2 * (q[1] * q[2] - q[0] * q[3]),
                             2 * (q[1] * q[3] + q[0] * q[2])},
                            {2 * (q[1] * q[2] + q[0] * q[3]), q[0] * q[0] - q[1] * q[1] + q[2] * q[2] - q[3] * q[3],
                             2 * (q[2] * q[3] - q[0] * q[1])},
                            {2 * (q[1] * q[3] - q[0] * q[2]), 2 * (q[2] * q[3] + q[0] * q[1]),
                             q[0] * q[0] - q[1] * q[1] - q[2] * q[2] + q[3] * q[3]}};
    return {R[0][j] / n, R[1][j] / n, R[2][j] / n};
}

}  // namespace

TEST_CASE("plane bodies on hinges are the double pendulum in angles, those on a slider a pendulum on a cart" *
          doctest::test_suite("slow")) {
    const std::vector<double> joints = end_of(
        "lagrangian = \"-upper.y - 2*lower.y\"\n[bodies]\nupper = { mass = 1, inertia = 0.3, position = [0, -1] }\n"
        "lower = { mass = 2, inertia = 0.2, position = [0, -3] }\n[joints]\n"
        "shoulder = { type = \"hinge\", bodies = [\"ground\", \"upper\"], point = [0, 0], angle = 1 }\n"
        "elbow = { type = \"hinge\", bodies = [\"upper\", \"lower\"], point = [0, -2], angle = 0.5, velocity = 0.3 "
        "}\n");
    const std::vector<double> angles = end_of(
        "lagrangian = \"(x1'^2 + y1'^2)/2 + 0.15*a'^2 + x2'^2 + y2'^2 + 0.1*b'^2 - y1 - 2*y2\"\n[definitions]\n"
        "x1 = \"sin(a)\"\ny1 = \"-cos(a)\"\nx2 = \"2*x1 + sin(b)\"\ny2 = \"2*y1 - cos(b)\"\n[coordinates]\n"
        "a = { position = 1, velocity = 0 }\nb = { position = 1.5, velocity = 0.3 }\n");
    CHECK(std::fabs(joints[0] - angles[0]) < 1e-12);
    CHECK(std::fabs(joints[0] + joints[1] - angles[1]) < 1e-12);

    const std::vector<double> cart = end_of(
        "lagrangian = \"-bob.y - cart.y\"\n[bodies]\ncart = { mass = 3, inertia = 1 }\n"
        "bob = { mass = 1, inertia = 0.2, position = [0, -1] }\n[joints]\n"
        "rail = { type = \"slider\", bodies = [\"ground\", \"cart\"], axis = [3, 4], velocity = 0.5 }\n"
        "swing = { type = \"hinge\", bodies = [\"cart\", \"bob\"], point = [0, 0], angle = 1 }\n");
    const std::vector<double> by_hand = end_of(
        "lagrangian = \"1.5*s'^2 + (x'^2 + y'^2)/2 + 0.1*a'^2 - y - 0.8*s\"\n[definitions]\nx = \"0.6*s + sin(a)\"\n"
        "y = \"0.8*s - cos(a)\"\n[coordinates]\ns = { position = 0, velocity = 0.5 }\na = { position = 1, velocity = 0 "
        "}\n");
    CHECK(std::fabs(cart[0] - by_hand[0]) < 1e-12);
    CHECK(std::fabs(cart[1] - by_hand[1]) < 1e-12);
}

TEST_CASE("a torque on a body is a force along its angular velocity, by the lines of the documents") {
    std::string forces;
    std::istringstream document(test::read_file(LOBATTO_SOURCE_DIR "/docs/scene_format.md"));
    for (std::string line; std::getline(document, line);)
        if (line.starts_with("\"top.omega[")) forces += line + "\n";
    REQUIRE(std::count(forces.begin(), forces.end(), '\n') == 3);
    const std::vector<double> q = end_of(
        "lagrangian = \"0\"\n[bodies]\ntop = { mass = 1, inertia = [0.75, 0.6, 0.5], angular_velocity = [0.2, -0.1, "
        "0.3] "
        "}\n[forces]\n" +
        forces + "[parameters]\ntau1 = 0.1\ntau2 = -0.2\ntau3 = 0.15\n");
    // Euler's equations, by the classical Runge-Kutta method.
    using State = std::array<double, 7>;  // the quaternion, and the angular velocity
    const auto rate = [](const State& x) {
        const auto& [a, b, c, d, u, v, w] = x;
        return State{-(b * u + c * v + d * w) / 2,       (a * u + c * w - d * v) / 2,
                     (a * v + d * u - b * w) / 2,        (a * w + b * v - c * u) / 2,
                     (0.1 + (0.6 - 0.5) * v * w) / 0.75, (-0.2 + (0.5 - 0.75) * w * u) / 0.6,
                     (0.15 + (0.75 - 0.6) * u * v) / 0.5};
    };
    const auto moved = [](State x, const State& f, double h) {
        for (std::size_t i = 0; i < 7; ++i) x[i] += h * f[i];
        return x;
    };
    State x{1, 0, 0, 0, 0.2, -0.1, 0.3};
    const double h = 1e-3;
    for (int step = 0; step < 3000; ++step) {
        const State k1 = rate(x), k2 = rate(moved(x, k1, h / 2)), k3 = rate(moved(x, k2, h / 2)),
                    k4 = rate(moved(x, k3, h));
        for (std::size_t i = 0; i < 7; ++i) x[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
    }
    REQUIRE(q.size() == 7);
    for (std::size_t i = 0; i < 4; ++i) CHECK(q[3 + i] == doctest::Approx(x[i]).epsilon(1e-9));
}

// Kane's formulas, the partial velocities written by hand.
TEST_CASE("forces on the point of an arm, torques on its links and dampers between them are those on its angles") {
    const std::string arm =
        "[bodies]\na = { mass = 1, inertia = 0.1, position = [0.5, 0] }\n"
        "b = { mass = 1, inertia = 0.1, position = [1.5, 0] }\n[joints]\n"
        "j = { type = \"hinge\", bodies = [\"ground\", \"a\"], point = [0, 0] }\n"
        "k = { type = \"hinge\", bodies = [\"a\", \"b\"], point = [1, 0], velocity = 0.3 }\n";
    const std::vector<double> along = end_of(arm +
                                             "[definitions]\ntip = \"b.y(0.5, 0)\"\nbend = \"k.angle' + j.angle'/10\"\n"
                                             "[forces]\n\"b.omega\" = \"-5*b.omega\"\n\"a.angle\" = 2\n"
                                             "tip = \"0.7*cos(b.x)\"\nbend = \"-bend/5\"\n");
    const std::vector<double> by_hand =
        end_of(arm +
               "[definitions]\nF = \"0.7*cos(b.x)\"\nx1 = \"cos(j.angle)\"\nx2 = \"cos(j.angle + k.angle)\"\n"
               "w = \"j.angle' + k.angle'\"\nbend = \"k.angle' + j.angle'/10\"\n[forces]\n"
               "\"j.angle\" = \"-5*w + 2 + F*(x1 + x2) - bend/50\"\n\"k.angle\" = \"-5*w + F*x2 - bend/5\"\n");
    REQUIRE(along.size() == 2);
    for (std::size_t i = 0; i < 2; ++i) CHECK(along[i] == doctest::Approx(by_hand[i]).epsilon(1e-13));
    CHECK(std::fabs(along[0]) > 0.1);
}

TEST_CASE("a hinge in space leaves one angle, with the moment of inertia about its axis") {
    // About (0, 3, 4)/5 through the origin: J = e I e + m d^2, d the distance of (1, 0, 0).
    const std::vector<double> hinge = end_of(
        "lagrangian = \"-2*door.z\"\n[bodies]\ndoor = { mass = 2, inertia = [1, 2, 2.5, 0.1, 0.2, 0.3], position = "
        "[1, 0, 0] }\n[joints]\n"
        "a = { type = \"hinge\", bodies = [\"ground\", \"door\"], point = [0, 0, 0], axis = [0, 3, 4], velocity = 1 "
        "}\n");
    const std::vector<double> angle = end_of(
        "lagrangian = \"((2*9 + 2.5*16 + 2*0.3*12)/25 + 2)*a'^2/2 + 2*0.6*sin(a)\"\n[coordinates]\n"
        "a = { position = 0, velocity = 1 }\n");
    CHECK(std::fabs(hinge[0] - angle[0]) < 1e-12);
}

TEST_CASE("a body on a joint moves like a free one that constraints hold" * doctest::test_suite("slow")) {
    const std::string body =
        "[bodies]\narm = { mass = 2, inertia = [1, 1.5, 0.8], position = [1, 0, 0], orientation = [2, 0, 1, 0], ";
    const std::string potential = "lagrangian = \"-2*arm.z\"\n";
    const std::vector<double> ball =
        end_of(potential + body +
               "angular_velocity = [1, 2, 3] }\n[joints]\n"
               "a = { type = \"ball\", bodies = [\"ground\", \"arm\"], point = [0, 0, 0] }\n");
    // The origin is at -R^T (1, 0, 0) = (-3, 0, -4)/5 in the body; its velocity is R (w x (3, 0, 4)/5).
    const std::vector<double> held = end_of(
        potential + body +
        "angular_velocity = [1, 2, 3], velocity = [0, 1, -2] }\n[constraints]\n"
        "x = \"arm.x(-3/5, 0, -4/5) = 0\"\ny = \"arm.y(-3/5, 0, -4/5) = 0\"\nz = \"arm.z(-3/5, 0, -4/5) = 0\"\n");
    for (int j = 0; j < 3; ++j)
        for (std::size_t i = 0; i < 3; ++i)
            CHECK(std::fabs(column(ball, j)[i] - column({held.begin() + 3, held.end()}, j)[i]) < 1e-11);
}

TEST_CASE("a distance is a rod, and two hinges and one more close a loop") {
    // A point on a rod, as a body that does not turn.
    const std::vector<double> rod = end_of(
        "lagrangian = \"-bob.y\"\n[bodies]\nbob = { mass = 1, inertia = 1, position = [0.6, -0.8] }\n[joints]\n"
        "rod = { type = \"distance\", bodies = [\"ground\", \"bob\"], from = [0, 0], to = [0.6, -0.8] }\n");
    const std::vector<double> angle =
        end_of("lagrangian = \"a'^2/2 + cos(a)\"\n[coordinates]\na = { position = \"asin(0.6)\", velocity = 0 }\n");
    CHECK(std::fabs(rod[0] - std::sin(angle[0])) < 1e-12);
    CHECK(std::fabs(rod[1] + std::cos(angle[0])) < 1e-12);

    // A parallelogram: the coupler does not turn, so that all is one pendulum.
    const std::vector<double> loop = end_of(
        "lagrangian = \"-a.y - b.y - c.y\"\n[bodies]\na = { mass = 1, inertia = 0.1, position = [0, -0.5] }\n"
        "b = { mass = 1, inertia = 0.1, position = [1, -1] }\nc = { mass = 1, inertia = 0.1, position = [2, -0.5] }\n"
        "[joints]\np = { type = \"hinge\", bodies = [\"ground\", \"a\"], point = [0, 0], angle = 1 }\n"
        "q = { type = \"hinge\", bodies = [\"a\", \"b\"], point = [0, -1], angle = -1 }\n"
        "r = { type = \"hinge\", bodies = [\"ground\", \"c\"], point = [2, 0], angle = 1 }\n"
        "s = { type = \"hinge\", bodies = [\"c\", \"b\"], point = [2, -1] }\n");
    const std::vector<double> one = end_of(
        "lagrangian = \"(0.2 + 0.5 + 1)*a'^2/2 + 2*cos(a)\"\n[coordinates]\na = { position = 1, velocity = 0 }\n");
    CHECK(std::fabs(loop[0] - one[0]) < 1e-12);
    CHECK(std::fabs(loop[1] + one[0]) < 1e-12);
}

TEST_CASE("a joint that is a constraint moves its bodies as one that they hang on" * doctest::test_suite("slow")) {
    const std::string bodies =
        "lagrangian = \"-2*top.z - arm.z\"\n[bodies]\n"
        "top = { mass = 2, inertia = [0.3, 0.4, 0.2], position = [0, 0, 1], velocity = [0.3, 0, 1], angular_velocity = "
        "[0.5, 0.2, 1] }\n"
        "arm = { mass = 1, inertia = [0.1, 0.1, 0.02], position = [0.5, 0, 1]";
    const std::string joint =
        "[joints]\nshoulder = { type = \"ball\", bodies = [\"top\", \"arm\"], point = [0.2, 0, 1]";
    // Of its point (0.2, 0, 0): v + omega x r = (0.3, 0.2, 1 - 0.04). The arm does not turn.
    const std::vector<double> hung = end_of(bodies + " }\n" + joint + " }\n"),
                              held = end_of(bodies + ", velocity = [0.3, 0.2, 0.96] }\n" + joint +
                                            ", constraint = true }\n");
    REQUIRE(hung.size() == 3 + 4 + 4);
    REQUIRE(held.size() == 3 + 4 + 3 + 4);
    for (int k = 0; k < 3; ++k) CHECK(std::fabs(hung[std::size_t(k)] - held[std::size_t(k)]) < 1e-9);
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) {
            const auto at = [&](const std::vector<double>& q, std::ptrdiff_t first) {
                return column({q.begin() + first, q.begin() + first + 4}, j)[std::size_t(i)];
            };
            CHECK(std::fabs(at(hung, 3) - at(held, 3)) < 1e-9);
            CHECK(std::fabs(at(hung, 7) - at(held, 10)) < 1e-9);
        }
}
