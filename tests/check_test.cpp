// SPDX-License-Identifier: GPL-2.0-or-later
// The checks hold for what is right and fail for what is not.
#include "generator/check.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "tests/scenes.hpp"

using namespace lobatto;

namespace {

std::vector<std::string> failures(const std::vector<Check>& checks) {
    std::vector<std::string> claims;
    for (const Check& check : checks)
        if (!check.holds) claims.push_back(check.claim);
    return claims;
}

Programs optimised(const Derivation& derivation) {
    Programs programs = build_programs(derivation);
    optimise(programs);
    return programs;
}

using Claims = std::vector<std::string>;

}  // namespace

TEST_CASE("every check holds for one and two coordinates and 2 to 5 points") {
    for (int points = 2; points <= 5; ++points)
        for (const Scene& scene : {test::pendulum_scene(points), test::coupled_scene(points)}) {
            const Derivation derivation = derive(scene);
            const auto quadrature = check_quadrature(derivation.quadrature);
            CHECK(quadrature.size() == 10);
            CHECK(failures(quadrature) == Claims{});
            CHECK(failures(check_equations(derivation)) == Claims{});
            const auto programs = check_programs(derivation, optimised(derivation));
            CHECK(programs.size() >= 3);
            CHECK(failures(programs) == Claims{});
        }
}

TEST_CASE("a linear system of one coordinate is checked in closed form, forces that are constant included") {
    const Derivation derivation =
        derive(test::scene_of("m*q'^2/2 - k*q^2/2 + q", "q = { position = 1, velocity = 0 }", 4, "m = 2\nk = 3"));
    const auto checks = check_programs(derivation, optimised(derivation));
    REQUIRE(checks.size() == 2);
    CHECK(checks[1].claim == "emitted propagation in closed form");
    CHECK(failures(checks) == Claims{});
}

TEST_CASE("what expansion cannot show is measured at 60 digits") {
    const Derivation derivation =
        derive(test::scene_of("(x'^2 + y'^2)/2 - sqrt(1 + x^2 + y^2)^3*exp(x*y)",
                              "x = { position = 0.5, velocity = 0 }\ny = { position = 1, velocity = 0 }", 4));
    const auto checks = check_equations(derivation);
    CHECK(failures(checks) == Claims{});
    const auto differences = std::find_if(checks.begin(), checks.end(), [](const Check& check) {
        return check.claim == "dF_L against central differences";
    });
    REQUIRE(differences != checks.end());
    CHECK(differences->measured > 0);      // or nothing was measured
    CHECK(differences->measured < 1e-36);  // measured 1e-40: the truncation of a step of 1e-20
}

TEST_CASE("checks near the start find its real values: no log of a negative number") {
    const Derivation derivation =
        derive(test::scene_of("x'^2/2 - (x - 5)^2/2 + log(x - 3)", "x = { position = 5, velocity = 0 }", 4));
    CHECK(failures(check_equations(derivation)) == Claims{});
    CHECK(failures(check_programs(derivation, optimised(derivation))) == Claims{});
}

TEST_CASE("a wrong weight, stage matrix or basis fails its checks") {
    Quadrature wrong = quadrature_of({Family::lobatto, 4});
    wrong.b[1] += GiNaC::pow(GiNaC::ex(10), -30);
    auto failed = failures(check_quadrature(wrong));
    CHECK(std::count(failed.begin(), failed.end(), "its weights sum to 1") == 1);
    CHECK(std::count(failed.begin(), failed.end(), "the quadrature is exact to degree 5") == 1);
    wrong = quadrature_of({Family::lobatto, 4});
    std::swap(wrong.A(0, 1), wrong.A(1, 0));
    failed = failures(check_quadrature(wrong));
    CHECK(failed == Claims{"forces bend paths as they must", "the stage matrix is symplectic"});
    wrong = quadrature_of({Family::lobatto, 3});
    wrong.K(0, 2) = -wrong.K(0, 2);
    failed = failures(check_quadrature(wrong));
    CHECK(failed == Claims{"K integrates products of slopes"});
}

TEST_CASE("a wrong equation fails the checks that rederive it") {
    const Derivation right = derive(test::coupled_scene(4));
    const auto failed_after = [&](const auto& spoil) {
        Derivation wrong = right;
        Discretisation equations = right.discretisation();
        spoil(equations);
        wrong.put(equations);
        return failures(check_equations(wrong));
    };
    CHECK(failed_after([](Discretisation& d) { d.interior[1][0] *= 2; }) ==
          Claims{"interior equations are dL_d/dQ = 0"});
    CHECK(failed_after([](Discretisation& d) { d.border[1] = -d.border[1]; }) ==
          Claims{"border equations are dL_d/dq = 0"});
    CHECK(failed_after([](Discretisation& d) { std::swap(d.left_momentum, d.right_momentum); }) ==
          Claims{"momenta are slopes of L_d"});
    CHECK(failed_after([](Discretisation& d) { d.full_jacobian(0, 1) += d.h / 1000; }) ==
          Claims{"dF_L is the derivative of F_L", "dF_L against central differences"});
    CHECK(failed_after([](Discretisation& d) { d.reduced_jacobian = d.reduced_jacobian.transpose(); }) ==
          Claims{"and so is the reduced Jacobian", "reduced Jacobian against differences"});
    CHECK(failed_after([](Discretisation& d) { d.arrival_momentum[0] += d.h * d.Q[1][0] / 1000; }) ==
          Claims{"reduced system combines these"});
}

TEST_CASE("a wrong program fails the check of what is emitted") {
    const Derivation derivation = derive(test::coupled_scene(4));
    const auto failed_after = [&](const std::string& name) {
        Programs programs = optimised(derivation);
        for (Program& program : programs.programs)
            if (program.name == name)
                program.outputs[0].value =
                    programs.graph.raw(Op::add, {program.outputs[0].value, programs.graph.number(1, 1000)});
        return failures(check_programs(derivation, programs));
    };
    CHECK(failed_after("energy") == Claims{"emitted energy, momentum, forces"});
    CHECK(failed_after("residual") == Claims{"emitted stage equations"});
    CHECK(failed_after("jacobian") == Claims{"emitted Jacobian"});
    CHECK(failed_after("correction") == Claims{"emitted Newton correction"});
    CHECK(failed_after("carry") == Claims{"emitted Newton correction"});
    CHECK(failed_after("simple_start") == Claims{"emitted start values"});
    CHECK(failed_after("extrapolated_start") == Claims{"emitted start values"});
    CHECK(failed_after("arrive") == Claims{"emitted arrival"});
    CHECK(failed_after("finish") == Claims{"emitted arrival"});
}
