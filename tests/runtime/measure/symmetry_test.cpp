// SPDX-License-Identifier: GPL-2.0-or-later
// Symmetries are found where there are some, and nowhere else; their momenta are conserved, others are not.
#include "runtime/measure/symmetry.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "tests/scenes/scenes.hpp"

using namespace lobatto;

namespace {

Kernel planar(const std::string& potential, const std::string& kinetic = "(x'^2 + y'^2)/2") {
    return test::kernel_in_own_cache(
        derive(test::scene_of(kinetic + " - (" + potential + ")",
                              "x = { position = 1, velocity = 0 }\ny = { position = 0.5, velocity = 1 }", 4)),
        Precision::double_);
}

std::vector<Symmetry> symmetries(const Kernel& kernel) {
    return find_symmetries(kernel, {}, {1, 0.5}, 0.1, {"x", "y"});
}

MomentumVariation variation(const Kernel& kernel, const Symmetry& symmetry) {
    return momentum_variation(kernel, symmetry, {}, {1, 0.5}, {0.25, 1}, 0.1, 1000);
}

}  // namespace

TEST_CASE("two masses that feel only their distance move together: p_x + p_y is conserved") {
    const Kernel kernel = planar("cos(x - y) + (x - y)^4", "x'^2 + 3*y'^2/2");
    const auto found = symmetries(kernel);
    REQUIRE(found.size() == 1);
    CHECK(found[0].kind == "translation");
    CHECK(found[0].momentum == "p_x + p_y");
    const auto [steps, change, by_motion] = variation(kernel, found[0]);
    CHECK(steps == 1000);
    CHECK(change > 0);
    CHECK(change < 1e-13);  // measured 2e-15
    CHECK(by_motion < 1e-13);
}

TEST_CASE("a central force turns in the plane: x*p_y - y*p_x is conserved") {
    const Kernel kernel = planar("-1/sqrt(x^2 + y^2)");
    const auto found = symmetries(kernel);
    REQUIRE(found.size() == 1);
    CHECK(found[0].kind == "rotation in the (x, y) plane");
    CHECK(found[0].momentum == "x*p_y - y*p_x");
    CHECK(variation(kernel, found[0]).variation < 1e-13);
}

TEST_CASE("a centre elsewhere is found with the rotation") {
    const auto found = symmetries(planar("((x - 2)^2 + (y + 1)^2)^2"));
    REQUIRE(found.size() == 1);
    CHECK(found[0].kind == "rotation in the (x, y) plane");
    CHECK(found[0].momentum == "-p_x - 2*p_y + x*p_y - y*p_x");
}

TEST_CASE("unequal masses turn an ellipse: q1 and q2 scale with the roots of their masses") {
    // In x and 2 y the mass and the potential are both round.
    const Kernel kernel = planar("(x^2 + 4*y^2)^2", "(x'^2 + 4*y'^2)/2");
    const auto found = symmetries(kernel);
    REQUIRE(found.size() == 1);
    CHECK(found[0].kind == "rotation");
    CHECK(found[0].momentum == "0.25*x*p_y - y*p_x");
    CHECK(variation(kernel, found[0]).variation < 1e-13);
}

TEST_CASE("a mass matrix that is not diagonal has its symmetry too") {
    const Kernel kernel = planar("(x - 2*y)^4", "x'^2 + x'*y' + y'^2");
    const auto found = symmetries(kernel);
    REQUIRE(found.size() == 1);
    CHECK(found[0].momentum == "p_x + 0.5*p_y");
    CHECK(variation(kernel, found[0]).variation < 1e-13);
}

TEST_CASE("free motion has all symmetries, Henon and Heiles' potential none") {
    CHECK(symmetries(planar("0")).size() == 3);
    CHECK(symmetries(planar("(x^2 + y^2)/2 + x^2*y - y^3/3")).empty());
    CHECK(symmetries(planar("x^2 + y^2 + x^2*y^2/1000")).empty());  // a small break is a break
}

TEST_CASE("a weak force beside a strong one is no symmetry, however small the units") {
    CHECK(symmetries(planar("1000000000000*x^2/2 + y^2/2 + y^4/4")).empty());
    const Kernel kernel = test::kernel_in_own_cache(
        derive(test::scene_of("m*q'^2/2 - k*(1 - cos(q))", "q = { position = 0.1, velocity = 0 }", 4,
                              "m = 1e-200\nk = 1e-200")),
        Precision::double_);
    CHECK(find_symmetries(kernel, {1e-200, 1e-200}, {0.1}, 0.01, {"q"}).empty());
    // Beside them a symmetry is still found.
    const auto found = symmetries(planar("(1000000*x - y)^4"));
    REQUIRE(found.size() == 1);
    CHECK(found[0].momentum == "p_x + 1e+06*p_y");
}

TEST_CASE("where the motion leaves the region of the samples, its own slopes tell what is no symmetry") {
    const Kernel wall = planar("2*exp(-((x - 5)/0.1)^2)");
    Symmetry along_x;
    along_x.B.assign(4, 0.0);
    along_x.d = {1, 0};
    const MomentumVariation thrown = momentum_variation(wall, along_x, {}, {1, 0.5}, {1, 1}, 0.01, 1000);
    CHECK(thrown.variation > 1);
    CHECK(thrown.by_motion > 0.5 * thrown.variation);
    const MomentumVariation kept = variation(planar("cos(y)"), along_x);
    CHECK(kept.variation == 0);
    CHECK(kept.by_motion == 0);
}

TEST_CASE("what is no symmetry is not conserved") {
    Symmetry wrong;
    wrong.B.assign(4, 0.0);
    wrong.d = {1, 0};
    CHECK(variation(planar("-1/sqrt(x^2 + y^2)"), wrong).variation > 0.1);
}
