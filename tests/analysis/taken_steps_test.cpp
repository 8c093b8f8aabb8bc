// SPDX-License-Identifier: GPL-2.0-or-later
// The steps that kernels take solve the equations that they were derived from, and those of no other system.
#include "analysis/accuracy/taken_steps.hpp"

#include <doctest/doctest.h>

#include "analysis/exact_start.hpp"
#include "tests/scenes/scenes.hpp"

using namespace lobatto;

namespace {

// What the steps of `taken` leave in the equations of `derived`, as one trajectory and as a lane.
std::pair<double, double> left(const Derivation& derived, const Derivation& taken) {
    const Kernel kernel = test::kernel_in_own_cache(taken, Precision::double_);
    const Kernel ensemble = ensemble_kernel_of(emit(taken), Precision::double_, 64);
    REQUIRE(ensemble->lanes > 0);
    const StartIn<double> start = start_in<double>(ExactStart(taken.scene), kernel, 0.1);
    return {trajectory_leaves<double>(derived, kernel, start.parameters, start.q, start.p, 0.1),
            lane_leaves(derived, kernel, ensemble, start.parameters, start.q, start.p, 0.1)};
}

// The same of one trajectory, in steps of another length.
double left_alone(const Derivation& derived, const Derivation& taken, double step) {
    const Kernel kernel = test::kernel_in_own_cache(taken, Precision::double_);
    const StartIn<double> start = start_in<double>(ExactStart(taken.scene), kernel, step);
    return trajectory_leaves<double>(derived, kernel, start.parameters, start.q, start.p, step);
}

Scene with_method(Scene scene, const Method& method) {
    scene.method = method;
    return scene;
}

}  // namespace

TEST_CASE("steps of every form leave rounding in their equations" * doctest::test_suite("slow")) {
    const Scene pendulum = test::pendulum_scene(4);
    const Scene rod = test::scene_of("(1 + q^2)*q'^2/2 + cos(q)", "q = { position = 1, velocity = 0.3 }", 4);
    const Scene linear = test::scene_of("x'^2/2 + y'^2/2 - x^2 - x*y - y^2",
                                        "x = { position = 1, velocity = 0.3 }\ny = { position = 0, velocity = 1 }", 5);
    for (const Scene& scene : {pendulum, with_method(pendulum, {Family::gauss, 3}),
                               with_method(pendulum, {Family::splitting, 6}), rod, linear, test::coupled_scene(3)}) {
        INFO(scene.lagrangian_text << ", " << scene.method.name());
        const Derivation derivation = derive(scene);
        const auto [trajectory, lane] = left(derivation, derivation);
        CHECK(trajectory < 4);  // roundings; at most 1.2 measured
        CHECK(lane < 4);
        CHECK(trajectory > 0);
    }
}

TEST_CASE("steps on constraints leave rounding, and those of another length of the rod leave more") {
    const auto rod = [](const std::string& length) {
        const std::string text =
            "lagrangian = \"(x'^2 + y'^2 + z'^2)/2 - y\"\n[coordinates]\n"
            "x = { position = 0.6, velocity = 0.4 }\ny = { position = -0.8, velocity = 0.3 }\n"
            "z = { position = 0, velocity = 0 }\n[constraints]\nrod = \"x^2 + y^2 = " +
            length + "\"\nplane = \"z = 0\"\n[method]\npoints = 4\n[run]\nstep = 0.1\nuntil = 1\nassemble = true\n";
        return derive(read_scene(Source("rod.toml", text)));
    };
    CHECK(left_alone(rod("1"), rod("1"), 0.1) < 8);
    CHECK(left_alone(rod("1 + 1e-9*x"), rod("1"), 0.1) > 1e4);
}

TEST_CASE("the far end of a chain that hardly moves is as exact as the rest, and no better") {
    const auto chain = [](const std::string& strength) {
        return derive(read_scene(Source(
            "chain.toml", "lagrangian = \"sum(i = 1 .. 24, x[i]'^2)/2 - sum(i = 1 .. 23, (x[i+1] - x[i])^2/2 + " +
                              strength +
                              "*(x[i+1] - x[i])^4/4) - x[1]^2/2\"\n[coordinates]\n"
                              "x = { count = 24, position = \"exp(-(i - 3)^2/3)\", velocity = 0 }\n"
                              "[method]\npoints = 4\n[run]\nstep = 0.2\nuntil = 1\n")));
    };
    CHECK(left_alone(chain("1"), chain("1"), 0.2) < 8);
    CHECK(left_alone(chain("1.00000001"), chain("1"), 0.2) > 1e4);
}

TEST_CASE("steps of another system, or of another method, leave more") {
    const Derivation pendulum = derive(test::pendulum_scene(4));
    const Derivation heavier =
        derive(test::scene_of("m*q'^2/2 - m*omega^2*(1 - cos(q)) - q^4/1e8", "q = { position = 1.5, velocity = 0.25 }",
                              4, "m = 2\nomega = 1.5"));
    const auto [trajectory, lane] = left(pendulum, heavier);
    CHECK(trajectory > 1e4);
    CHECK(lane > 1e4);
    const auto [other, other_lane] = left(derive(with_method(test::pendulum_scene(4), {Family::lobatto, 3})), pendulum);
    CHECK(other > 1e4);
    CHECK(other_lane > 1e4);
}
