// SPDX-License-Identifier: GPL-2.0-or-later
// What [bodies] and [joints] bring, and their mistakes.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "generator/scene/bodies/rigid_body.hpp"
#include "generator/scene/scene.hpp"

using namespace lobatto;
using GiNaC::ex;

namespace {

Scene scene_of(const std::string& text) {
    return read_scene(Source("top.toml", text + "[run]\nstep = 0.1\nuntil = 1\n"));
}

const std::string top = "top = { mass = 1, inertia = [1, 1, 0.5], position = [0, 0, 1] }\n";
const std::string arm = "arm = { mass = 1, inertia = 0.1, position = [1, 0] }\n";

std::string refusal(const std::string& text) {
    try {
        scene_of(text);
    } catch (const InputError& error) {
        const std::string all = error.what();
        return all.substr(0, all.find('\n'));
    }
    return "";
}
std::string of_body(const std::string& line) {
    return refusal("[bodies]\n" + line + "\n");
}
std::string of_joint(const std::string& line) {
    return refusal("[bodies]\n" + top + arm + "[joints]\n" + line + "\n");
}

// A number for each symbol.
double number(const ex& expression, const GiNaC::exmap& values) {
    return GiNaC::ex_to<GiNaC::numeric>(expression.subs(values).evalf()).to_double();
}

GiNaC::exmap arbitrary(const std::vector<GiNaC::symbol>& symbols) {
    GiNaC::exmap values;
    long k = 3;
    for (const GiNaC::symbol& symbol : symbols) values[symbol] = GiNaC::numeric(k = k * 7 % 19, 17);
    return values;
}

// Independent rows have a Gram determinant above 0.
double gram(const std::vector<ex>& equations, const std::vector<GiNaC::symbol>& in, const GiNaC::exmap& values) {
    const auto n = static_cast<unsigned>(equations.size());
    GiNaC::matrix products(n, n);
    for (unsigned i = 0; i < n; ++i)
        for (unsigned j = 0; j < n; ++j)
            for (const GiNaC::symbol& q : in)
                products(i, j) += number(equations[i].diff(q), values) * number(equations[j].diff(q), values);
    return GiNaC::ex_to<GiNaC::numeric>(products.determinant()).to_double();
}

}  // namespace

TEST_CASE("a body brings coordinates, their start and its kinetic energy") {
    const Scene scene = scene_of(
        "lagrangian = \"-g*top.z(0, 0, 2)\"\n[parameters]\ng = 3\n[bodies]\ntop = { mass = 2, inertia = [1, 2, 2.5], "
        "position = [0, 0, 1], orientation = [2, 0, 0, 0], velocity = [5, 0, 0], angular_velocity = [0, 0, 4] }\n");
    REQUIRE(scene.coordinates.size() == 7);
    CHECK(scene.coordinates[2].name == "top_z");
    CHECK(scene.coordinates[2].written == "top.z");
    CHECK(scene.coordinates[6].name == "top_q_4");
    CHECK(scene.coordinates[6].written == "top.q[4]");
    GiNaC::exmap start;
    for (std::size_t k = 0; k < 7; ++k) {
        start[scene.coordinates[k].position] = scene.initial_position[k];
        start[scene.coordinates[k].velocity] = scene.initial_rate[k];
    }
    CHECK(number(scene.initial_position[3], {}) == 1);  // of length 1
    CHECK(number(scene.initial_rate[6], {}) == 2);      // q' = q w / 2
    start[scene.parameters[0].symbol] = 3;
    CHECK(number(scene.lagrangian, start) == 2 * 25 / 2. + 2.5 * 16 / 2 - 3 * 3);
    CHECK(scene.lagrangian_text == "T(top) - g*top.z(0, 0, 2)");
}

TEST_CASE("a lever that vanishes whatever the parameters is left out, one that only the scene makes 0 is not") {
    const auto scene_at = [&](const std::string& parameters, const std::string& place, const std::string& turn) {
        return scene_of("lagrangian = \"-l*top.z\"\n[parameters]\nl = 1\n" + parameters +
                        "[bodies]\ntop = { mass = 2, inertia = [1, 2, 2.5], position = " + place +
                        ", orientation = " + turn +
                        " }\n[joints]\ntip = { type = \"ball\", bodies = [\"ground\", \"top\"], point = [0, 0, 0] }\n");
    };
    const std::string upright = "[1, 0, 0, 0]";
    const Scene drawn_upright = scene_at("", "[0, 0, 1]", upright);
    const auto is_the_same = [&](const Scene& scene) {
        GiNaC::exmap symbols{{scene.parameters[0].symbol, drawn_upright.parameters[0].symbol}};
        for (std::size_t k = 0; k < 4; ++k) {
            symbols[scene.coordinates[k].position] = drawn_upright.coordinates[k].position;
            symbols[scene.coordinates[k].velocity] = drawn_upright.coordinates[k].velocity;
        }
        return (scene.lagrangian.subs(symbols) - drawn_upright.lagrangian).is_zero();
    };
    CHECK(is_the_same(scene_at("", "[0, -1, 0]", "[\"cos(pi/4)\", \"sin(pi/4)\", 0, 0]")));
    CHECK(is_the_same(scene_at("", "[0, \"-sin(l)\", \"cos(l)\"]", "[\"cos(l/2)\", \"sin(l/2)\", 0, 0]")));
    const Scene aside = scene_at("d = 0\n", "[\"d\", 0, 1]", upright);
    CHECK_FALSE(is_the_same(aside));
    CHECK(aside.lagrangian.has(aside.parameters[1].symbol));
}

TEST_CASE("names of bodies stand in formulas, those of bodies on joints too") {
    const Scene scene = scene_of(
        "lagrangian = \"-arm.y - far.y(1, 0) + 0*far.x'*far.omega + 0*far.R[1,2]'\"\n[bodies]\n" + arm +
        "far = { mass = 1, inertia = 0.1, position = [3, 0] }\n[joints]\n"
        "a = { type = \"hinge\", bodies = [\"ground\", \"arm\"], point = [0, 0], angle = \"pi/2\", velocity = 2 }\n"
        "b = { type = \"hinge\", bodies = [\"arm\", \"far\"], point = [2, 0], velocity = 1 }\n");
    REQUIRE(scene.coordinates.size() == 2);
    CHECK(scene.coordinates[0].written == "a.angle");
    GiNaC::exmap start;
    for (std::size_t k = 0; k < 2; ++k) {
        start[scene.coordinates[k].position] = scene.initial_position[k];
        start[scene.coordinates[k].velocity] = scene.initial_rate[k];
    }
    // Both upright: arm at 1 with speed 2, far at 3 with 2*2 + 3, turning with 2 and 3.
    CHECK(number(scene.lagrangian, start) == doctest::Approx(4 / 2. + 49 / 2. + 0.1 * (4 + 9) / 2 - 1 - 4));
}

TEST_CASE("the orientation that is shown is the rotation of the body, on all joints") {
    const Scene scene = scene_of(
        "[bodies]\na = { mass = 1, inertia = [1, 2, 2.5], orientation = [3, 1, 0, 1] }\n"
        "b = { mass = 1, inertia = [1, 2, 2.5], position = [1, 0, 0], orientation = [1, 0, 2, 0] }\n"
        "c = { mass = 1, inertia = [1, 2, 2.5], position = [1, 1, 0], orientation = [1, 1, 1, 1] }\n"
        "d = { mass = 1, inertia = [1, 2, 2.5], position = [1, 1, 2] }\n[joints]\n"
        "ab = { type = \"hinge\", bodies = [\"a\", \"b\"], point = [1, 0, 0], axis = [1, 2, 2] }\n"
        "bc = { type = \"slider\", bodies = [\"b\", \"c\"], axis = [0, 3, 4] }\n"
        "cd = { type = \"ball\", bodies = [\"c\", \"d\"], point = [1, 1, 1] }\n");
    std::vector<GiNaC::symbol> symbols;
    for (const Coordinate& coordinate : scene.coordinates) symbols.push_back(coordinate.position);
    const GiNaC::exmap values = arbitrary(symbols);
    const std::vector<Column>& columns = scene.outputs.columns;
    REQUIRE(columns.size() == 7 + 3 * 10);  // those on joints: their places first
    for (std::size_t b = 0; b < 4; ++b) {
        Quaternion q;
        ex square = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            q[k] = number(columns[10 * b + k].value, values);
            square += q[k] * q[k];
        }
        CHECK(std::fabs(number(square, values) - 1) < 1e-14);
        const Matrix R = rotation_of(q);
        for (std::size_t i = 0; i < 9; ++i)
            CHECK(std::fabs(number(R[i / 3][i % 3] - scene.bodies[b].rotation[i], values)) < 1e-14);
    }
}

TEST_CASE("what a joint leaves free keeps its equations, which are independent") {
    std::map<std::string, std::vector<GiNaC::symbol>> s;
    const auto symbols = [&](const std::string& name, int count) {
        for (int k = 0; k < count; ++k) s[name].emplace_back(name + std::to_string(k));
        return s[name];
    };
    const auto a = symbols("a", 14), b = symbols("b", 14), c = symbols("c", 2);
    std::vector<GiNaC::symbol> all = a;
    all.insert(all.end(), b.begin(), b.end());
    all.insert(all.end(), c.begin(), c.end());
    const GiNaC::exmap values = arbitrary(all);
    for (const bool plane : {false, true})
        for (const Joint::Type type : {Joint::Type::ball, Joint::Type::hinge, Joint::Type::slider}) {
            if (plane && type == Joint::Type::ball) continue;
            RigidBody first, second;
            first.plane = second.plane = plane;
            first.drawn_place = {1, 2, plane ? 0 : 3};
            second.drawn_place = {4, 1, plane ? 0 : 2};
            first.drawn_angle = ex(1) / 3;
            second.drawn_angle = ex(1) / 5;
            first.drawn_rotation = plane ? rotation_in_plane(first.drawn_angle) : rotation_of({2, 1, 0, 3});
            second.drawn_rotation = plane ? rotation_in_plane(second.drawn_angle) : rotation_of({1, 1, 2, 0});
            if (plane)
                move_free_in_plane(first, {a[0], a[1], 0}, {a[7], a[8], 0}, a[2], a[9]);
            else
                move_free(first, {a[0], a[1], a[2]}, {a[7], a[8], a[9]}, {a[3], a[4], a[5], a[6]},
                          {a[10], a[11], a[12], a[13]});
            Joint joint;
            joint.type = type;
            joint.point = {2, 2, plane ? 0 : 1};
            joint.axis = plane ? type == Joint::Type::hinge ? Vector{0, 0, 1} : Vector{ex(3) / 5, ex(4) / 5, 0}
                               : Vector{ex(2) / 3, ex(1) / 3, ex(2) / 3};
            RigidBody hung = second;
            if (type == Joint::Type::ball) hang_on_ball(hung, joint, &first, {b[3], b[4], b[5], b[6]}, {0, 0, 0, 0});
            if (type == Joint::Type::hinge) hang_on_hinge(hung, joint, &first, c[0], c[1]);
            if (type == Joint::Type::slider) hang_on_slider(hung, joint, &first, c[0], c[1]);
            const std::vector<ex> equations = equations_of(joint, &first, hung, 1);
            CHECK(equations.size() == (plane ? 2 : type == Joint::Type::ball ? 3 : 5));
            for (const ex& equation : equations) CHECK(std::fabs(number(equation, values)) < 1e-13);
            // Of a free body in that place.
            RigidBody free = second;
            if (plane)
                move_free_in_plane(free, {b[0], b[1], 0}, {0, 0, 0}, b[2], 0);
            else
                move_free(free, {b[0], b[1], b[2]}, {0, 0, 0}, {b[3], b[4], b[5], b[6]}, {0, 0, 0, 0});
            GiNaC::exmap apart = values;
            CHECK(gram(equations_of(joint, &first, free, 1), b, apart) > 1e-4);
            // Its velocity is the rate of its place.
            if (type == Joint::Type::ball) continue;
            const Vector v = hung.velocity_in_space();
            GiNaC::exmap rates;
            for (std::size_t i = 0; i < (plane ? 2 : 3); ++i) {
                ex rate = hung.x[i].diff(c[0]) * c[1];
                for (std::size_t k = 0; k < 7; ++k)
                    if (!plane || k < 3) rate += hung.x[i].diff(a[k]) * a[k + 7];
                CHECK(number(rate, values) == doctest::Approx(number(v[i], values)).epsilon(1e-12));
            }
        }
}

TEST_CASE("mistakes in a body are one clear error") {
    CHECK(of_body("top = { mass = 1 }") ==
          "top.toml:2:1: body top has no inertia: add its principal moments in space, [1, 1, 0.5], or one number in a "
          "plane");
    CHECK(of_body("top = { inertia = [1, 1, 1] }") == "top.toml:2:1: body top has no mass: add for example mass = 1");
    CHECK(of_body("top = { mass = 0, inertia = [1, 1, 1] }") ==
          "top.toml:2:16: the mass of top is 0; it must be positive");
    CHECK(of_body("top = { mass = 1, inertia = [1, 1] }") ==
          "top.toml:2:29: the inertia of top has 2 values; in space it has three principal moments, or six values xx, "
          "yy, zz, xy, xz, yz; in a plane it is one number");
    CHECK(of_body("top = { mass = 1, inertia = [1, 1, 2.5] }") ==
          "top.toml:2:29: no body has the inertia of top: each principal moment is at most the sum of the other two");
    CHECK(of_body("top = { mass = 1, inertia = [1, -1, 1] }") ==
          "top.toml:2:29: the inertia of top is not positive: every moment of inertia is");
    CHECK(of_body("top = { mass = 1, inertia = [1, 1, 1, 0, 0, 2] }") ==
          "top.toml:2:29: the inertia of top is not positive: every moment of inertia is");
    CHECK(of_body("top = { mass = 1, inertia = [1, 1, 2] }") == "");  // flat
    CHECK(of_body("top = { mass = 1, inertia = [1, 1, 1], position = [0, 0] }") ==
          "top.toml:2:51: the position of top is a list of 3 formulas such as [0, 0, 1], not of 2");
    CHECK(of_body("top = { mass = 1, inertia = [1, 1, 1], position = 1 }") ==
          "top.toml:2:51: the position of top is a list of 3 formulas such as [0, 0, 1], not a whole number");
    CHECK(of_body("top = { mass = 1, inertia = [1, 1, 1], orientation = [0, 0, 0, 0] }") ==
          "top.toml:2:54: the orientation of top is a quaternion of length 0; [1, 0, 0, 0] turns nothing, "
          "[\"cos(a/2)\", 0, 0, \"sin(a/2)\"] by a about z");
    CHECK(of_body("top = { mass = 1, inertia = [1, 1, 1], angle = 1 }") ==
          "top.toml:2:40: top turns in space: write orientation = [1, 0, 0, 0], a quaternion, instead of an angle");
    CHECK(of_body("arm = { mass = 1, inertia = 1, orientation = [1, 0, 0, 0] }") ==
          "top.toml:2:32: arm has one moment of inertia, so it moves in a plane: write angle = 0 instead of an "
          "orientation");
    CHECK(of_body("top = { mass = 1, inertia = [1, 1, 1], weight = 3 }").find("unknown key 'weight' in body top") !=
          std::string::npos);
    CHECK(of_body("ground = { mass = 1, inertia = [1, 1, 1] }") ==
          "top.toml:2:1: 'ground' is what does not move; give the body another name");
    CHECK(refusal("[bodies]\n") ==
          "top.toml:1:2: there is no body; add top = { mass = 1, inertia = [1, 1, 0.5], position = [0, 0, 1] }, or "
          "remove the section");
    CHECK(refusal("[parameters]\ntop = 1\n[bodies]\n" + top) ==
          "top.toml:4:1: 'top' is both a parameter and a body; rename one");
    CHECK(refusal("[coordinates]\nx = { position = 0, momentum = 0 }\n[bodies]\n" + top) ==
          "top.toml:3:2: bodies start with velocities; give those of the coordinates instead of momenta");
}

TEST_CASE("mistakes in formulas of bodies are one clear error") {
    const auto of_lagrangian = [](const std::string& formula) {
        return refusal("lagrangian = \"" + formula + "\"\n[bodies]\n" + top);
    };
    CHECK(of_lagrangian("-top.R[4,1]") == "top.toml:1:16: there is no top.R[4,1]: its first index goes from 1 to 3");
    CHECK(of_lagrangian("-top.R[1,4]") == "top.toml:1:16: there is no top.R[1,4]: its second index goes from 1 to 3");
    CHECK(of_lagrangian("-tpo.z").find("Did you mean 'top.z'?") != std::string::npos);
    CHECK(of_lagrangian("-top.z(1, 2)") == "top.toml:1:21: a point of a body is written top.z(a, b, c)");
    CHECK(of_lagrangian("-top.z'(1, 2, 3)") ==
          "top.toml:1:16: top.z(a, b, c) is a place; points have no velocity in formulas");
    CHECK(of_lagrangian("top.omega[1]'") ==
          "top.toml:1:15: top.omega holds a velocity, so its time derivative would hold an acceleration");
    CHECK(of_body("top = { mass = \"top.z\", inertia = [1, 1, 1] }").find("cannot occur in the mass of top") !=
          std::string::npos);
    CHECK(of_body("top = { mass = \"top.R[1,1]\", inertia = [1, 1, 1] }") ==
          "top.toml:2:17: top.R moves, so that the mass of top cannot hold it: write it with numbers and parameters");
}

TEST_CASE("mistakes in a joint are one clear error") {
    CHECK(of_joint("a = { bodies = [\"ground\", \"top\"] }") ==
          "top.toml:5:1: of which type is joint a? there are \"ball\", \"hinge\", \"slider\" and \"distance\"");
    CHECK(of_joint("a = { type = \"screw\" }") ==
          "top.toml:5:14: of which type is joint a? there are \"ball\", \"hinge\", \"slider\" and \"distance\"");
    CHECK(of_joint("a = { type = \"ball\", bodies = [\"ground\", \"tpo\"], point = [0, 0, 0] }") ==
          "top.toml:5:42: unknown body 'tpo' in joint a; bodies: ground, top, arm. Did you mean 'top'?");
    CHECK(of_joint("a = { type = \"ball\", bodies = [\"top\", \"ground\"], point = [0, 0, 0] }") ==
          "top.toml:5:39: the ground is the first body of a joint; exchange those of a");
    CHECK(of_joint("a = { type = \"ball\", bodies = [\"top\", \"top\"], point = [0, 0, 0] }") ==
          "top.toml:5:39: joint a joins a body to itself");
    CHECK(of_joint("a = { type = \"ball\", bodies = [\"top\"], point = [0, 0, 0] }") ==
          "top.toml:5:31: joint a joins two bodies, as in bodies = [\"ground\", \"arm\"]");
    CHECK(of_joint("a = { type = \"hinge\", bodies = [\"top\", \"arm\"], point = [0, 0, 0] }") ==
          "top.toml:5:32: joint a joins a body in a plane to one in space; give both one moment of inertia, or both "
          "three");
    CHECK(of_joint("a = { type = \"ball\", bodies = [\"ground\", \"arm\"], point = [0, 0] }") ==
          "top.toml:5:14: in a plane a ball is a hinge: write type = \"hinge\"");
    CHECK(of_joint("a = { type = \"hinge\", bodies = [\"ground\", \"arm\"], point = [0, 0], axis = [0, 1] }") ==
          "top.toml:5:67: in a plane every hinge turns about z; leave out the axis");
    CHECK(of_joint("a = { type = \"hinge\", bodies = [\"ground\", \"top\"], point = [0, 0, 0] }") ==
          "top.toml:5:1: hinge a has no axis: add axis = [0, 0, 1]");
    CHECK(of_joint("a = { type = \"slider\", bodies = [\"ground\", \"top\"], axis = [0, 0, 0] }") ==
          "top.toml:5:59: the axis of joint a has length 0");
    CHECK(of_joint("a = { type = \"ball\", bodies = [\"ground\", \"top\"], point = [0, 0, 0], axis = [0, 0, 1] }")
              .find("unknown key 'axis' in ball a") != std::string::npos);
    CHECK(refusal("[bodies]\ntop = { mass = 1, inertia = [1, 1, 1], angular_velocity = [0, 0, 1] }\n[joints]\n"
                  "a = { type = \"hinge\", bodies = [\"ground\", \"top\"], point = [0, 0, 0], axis = [0, 0, 1] }\n") ==
          "top.toml:2:40: top hangs on joint a, which tells its angular velocity: leave it out, and give a a velocity");
    CHECK(of_joint("a = { type = \"hinge\", bodies = [\"ground\", \"arm\"], point = [0, 0] }\n"
                   "b = { type = \"hinge\", bodies = [\"ground\", \"arm\"], point = [2, 0], angle = 1 }") ==
          "top.toml:6:67: joint b closes a loop, so that the other joints tell its start; leave out angle");
    CHECK(
        of_joint(
            "a = { type = \"hinge\", bodies = [\"ground\", \"arm\"], point = [0, 0], constraint = true, angle = 1 }") ==
        "top.toml:5:86: joint a is a constraint, so that its bodies tell its start in [bodies]; leave out angle");
    CHECK(refusal("[joints]\na = { type = \"ball\" }\n[coordinates]\nx = { position = 0, velocity = 0 }\n") ==
          "top.toml:1:2: joints hold bodies together; add [bodies] with lines such as top = { mass = 1, inertia = "
          "[1, 1, 0.5], position = [0, 0, 1] }");
}

TEST_CASE("joints that leave nothing that could move are refused where the last of them stands") {
    CHECK(refusal("lagrangian = \"0\"\n[bodies]\na = { mass = 1, inertia = 1, position = [0, 0] }\n"
                  "b = { mass = 1, inertia = 1, position = [1, 1] }\n[joints]\n"
                  "left = { type = \"hinge\", bodies = [\"ground\", \"a\"], point = [0, 0] }\n"
                  "apex = { type = \"hinge\", bodies = [\"a\", \"b\"], point = [1, 1] }\n"
                  "right = { type = \"hinge\", bodies = [\"ground\", \"b\"], point = [2, 0] }\n") ==
          "top.toml:8:1: 2 constraints on 2 coordinates up to here: nothing is left that could move, or they depend "
          "on one another, as those of a third parallel crank do: leave out a joint that the others keep");
    // In space equations of joints may depend on one another.
    CHECK(
        refusal("lagrangian = \"0\"\n[bodies]\na = { mass = 1, inertia = [1, 1, 1], position = [0, 0, 0] }\n"
                "[joints]\nfirst = { type = \"hinge\", bodies = [\"ground\", \"a\"], point = [0, 0, 0], axis = [0, 0, "
                "1] }\n"
                "second = { type = \"hinge\", bodies = [\"ground\", \"a\"], point = [0, 0, 1], axis = [0, 0, 1] }\n") ==
        "top.toml:6:1: 5 constraints on 1 coordinate up to here: nothing is left that could move, or they depend on "
        "one another, as those of hinges with parallel axes do; write plane bodies, or leave out a joint");
}
