// SPDX-License-Identifier: GPL-2.0-or-later
// The checks hold for what is right and fail for what is not.
#include "generator/check/check.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "tests/scenes/scenes.hpp"

using namespace lobatto;

namespace {

std::vector<std::string> failures(const std::vector<Check>& checks) {
    std::vector<std::string> claims;
    for (const Check& check : checks)
        if (!check.holds) claims.push_back(check.claim);
    return claims;
}

Programs optimised(const Derivation& derivation) {
    return optimised_programs(derivation).programs;
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
            CHECK(programs.size() >= 1);
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

namespace {

// Lagrangian and coordinates of a scene, with what may follow them, for a method.
Scene scene_with(const std::string& top, const std::string& coordinates, const std::string& rest,
                 const std::string& method) {
    return read_scene(Source("test.toml", "title = \"Test\"\n" + top + "\n[coordinates]\n" + coordinates + "\n" + rest +
                                              "\n[method]\n" + method + "\n[run]\nstep = 0.1\nuntil = 1\n"));
}

const std::vector<std::string> methods = {"family = \"lobatto\"\npoints = 2", "family = \"lobatto\"\npoints = 4",
                                          "family = \"lobatto\"\npoints = 7", "family = \"gauss\"\nstages = 1",
                                          "family = \"gauss\"\nstages = 2",   "family = \"gauss\"\nstages = 5"};

// A top: two cyclic coordinates, a mass matrix that depends on the third.
const std::string top =
    "lagrangian = \"(theta'^2 + sin(theta)^2*phi'^2)/2 + (psi' + cos(theta)*phi')^2/4 - cos(theta)\"";
const std::string top_coordinates =
    "theta = { position = 1, velocity = 0.25 }\nphi = { position = 0, velocity = 1 }\n"
    "psi = { position = 0.5, velocity = 2 }";

Derivation driven(const std::string& method) {
    return derive(scene_with("time = \"t\"\nlagrangian = \"x'^2*(1 + y^2)/2 + y'^2/2 + x*y' - cos(x - t)*y^2\"",
                             "x = { position = 1, velocity = 0.5 }\ny = { position = 0.5, velocity = 1 }",
                             "[forces]\nx = \"-x'*y'^2 + sin(t)\"\n", method));
}

std::string claims_of(const std::vector<Check>& checks) {
    std::string text;
    for (const Check& check : checks) text += check.claim + "\n";
    return text;
}

}  // namespace

TEST_CASE("the equations of any Lagrangian hold for every method: forces, time, velocities, cyclic coordinates" *
          doctest::test_suite("slow")) {
    for (const std::string& method : methods) {
        INFO(method);
        const Derivation relativistic = derive(scene_with("lagrangian = \"-sqrt(1 - x'^2) - x^2/2\"",
                                                          "x = { position = 0.5, velocity = 0.25 }", "", method));
        const Derivation spinning = derive(scene_with(top, top_coordinates, "", method));
        REQUIRE(spinning.structure.routhian().cyclic == std::vector<int>{1, 2});
        for (const Derivation& derivation : {relativistic, spinning, driven(method)}) {
            const auto checks = check_equations(derivation);
            INFO(claims_of(checks));
            CHECK(derivation.structure.form() == StepForm::general);
            CHECK(checks.size() >= 7);
            CHECK(failures(checks) == Claims{});
        }
        const Derivation shaken = derive(
            scene_with("time = \"t\"\nlagrangian = \"x'^2/2 + y'^2 + x'*y'/2 - (1 + cos(3*t))*(1 - cos(x - y)) - y^4\"",
                       "x = { position = 1, velocity = 0.5 }\ny = { position = 0.5, velocity = 1 }",
                       "[forces]\ny = \"x^2*cos(t)\"\n", method));
        REQUIRE(shaken.system.separable);
        CHECK(failures(check_equations(shaken)) == Claims{});
    }
}

TEST_CASE("with structure off the equations are those of the general form, and hold") {
    const Derivation derivation = derive(test::coupled_scene(4), Shortcuts::none);
    const auto checks = check_equations(derivation);
    CHECK(failures(checks) == Claims{});
    CHECK(claims_of(checks).find("Jacobian of the step against differences\n") != std::string::npos);
}

TEST_CASE("a chain too long to be written out is checked by the action's slopes") {
    for (const std::string& method : methods) {
        const Derivation chain =
            derive(scene_with("lagrangian = \"sum(i = 1 .. 40, x[i]'^2/2) - sum(i = 2 .. 40, (x[i] - x[i-1])^4/4)\"",
                              "x = { count = 40, position = \"sin(i)\", velocity = 0 }", "", method));
        CHECK(!is_written_out(chain.system, chain.quadrature));
        const auto checks = check_equations(chain);
        CHECK(failures(checks) == Claims{});
        CHECK(claims_of(checks) ==
              "momentum and force are derivatives of L\nsecond derivatives against differences\n"
              "the residual is the derivative of the action\nthe stage equations combine these\n");
    }
}

TEST_CASE("a wrong force, second derivative, Routhian or stage matrix fails the checks by numbers") {
    const auto failed_after = [&](const Derivation& right, const auto& spoil) {
        Derivation derivation = right;
        spoil(derivation);
        return failures(check_action(derivation));
    };
    const GiNaC::ex tiny = GiNaC::pow(GiNaC::ex(10), -12);
    const Derivation right = driven("family = \"lobatto\"\npoints = 4");
    CHECK(failed_after(right, [](Derivation&) {}) == Claims{});
    CHECK(failed_after(right, [&](Derivation& d) { d.system.force[1] += tiny; }) ==
          Claims{"momentum and force are derivatives of L", "the residual is the derivative of the action"});
    CHECK(failed_after(right, [&](Derivation& d) {
              std::get<GeneralForm>(d.structure.of_form).routhian.second.put(3, 0, tiny);
          }) == Claims{"second derivatives against differences", "Jacobian of the step against differences"});
    const Derivation spinning = derive(scene_with(top, top_coordinates, "", "points = 5"));
    CHECK(failed_after(spinning, [&](Derivation& d) {
              std::get<GeneralForm>(d.structure.of_form).routhian.gradient[3] += tiny;
          }) == Claims{"cyclic coordinates follow from their momenta"});
    CHECK(failed_after(spinning, [&](Derivation& d) { d.quadrature.legendre[1] += tiny; }) ==
          Claims{"cyclic coordinates follow from their momenta"});
    const Derivation coupled = derive(test::coupled_scene(4));
    CHECK(failed_after(coupled, [&](Derivation& d) { d.quadrature.A(0, 1) += tiny; }) ==
          Claims{"the stage equations combine these"});
    CHECK(failed_after(coupled, [&](Derivation& d) { d.system.hessian.put(0, 1, tiny); }) ==
          Claims{"second derivatives against differences"});
}

TEST_CASE("a wrong weight, stage matrix or basis fails its checks") {
    Quadrature wrong = quadrature_of({Family::lobatto, 4});
    wrong.b[1] += GiNaC::pow(GiNaC::ex(10), -30);
    auto failed = failures(check_quadrature(wrong));
    CHECK(std::count(failed.begin(), failed.end(), "the weights sum to 1") == 1);
    CHECK(std::count(failed.begin(), failed.end(), "the quadrature is exact to degree 5") == 1);
    wrong = quadrature_of({Family::lobatto, 4});
    std::swap(wrong.A(0, 1), wrong.A(1, 0));
    failed = failures(check_quadrature(wrong));
    CHECK(failed == Claims{"the stage matrix A integrates accelerations", "the stage matrix is symplectic"});
    wrong = quadrature_of({Family::lobatto, 3});
    wrong.K(0, 2) = -wrong.K(0, 2);
    failed = failures(check_quadrature(wrong));
    CHECK(failed == Claims{"K is the integral of products of basis derivatives"});
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
          Claims{"equations at the ends are dL_d/dq = 0"});
    CHECK(failed_after([](Discretisation& d) { std::swap(d.left_momentum, d.right_momentum); }) ==
          Claims{"momenta are derivatives of L_d"});
    CHECK(failed_after([](Discretisation& d) { d.full_jacobian(0, 1) += d.h / 1000; }) ==
          Claims{"dF_L is the derivative of F_L", "dF_L against central differences"});
    CHECK(failed_after([](Discretisation& d) { d.reduced_jacobian = d.reduced_jacobian.transpose(); }) ==
          Claims{"the reduced Jacobian is the derivative", "reduced Jacobian against differences"});
    CHECK(failed_after([](Discretisation& d) { d.arrival_momentum[0] += d.h * d.Q[1][0] / 1000; }) ==
          Claims{"the reduced system combines these"});
}

TEST_CASE("a wrong program fails the check of what is emitted") {
    const auto failed_after = [](const Derivation& derivation, const std::string& name) {
        Programs programs = optimised(derivation);
        for (Program& program : programs.programs)
            if (program.name == name)
                program.outputs[0].value =
                    programs.graph.raw(Op::add, {program.outputs[0].value, programs.graph.number(1, 1000)});
        return failures(check_programs(derivation, programs));
    };
    const Derivation coupled = derive(test::coupled_scene(4)),
                     with_quadratic_part = derive(read_scene(LOBATTO_SOURCE_DIR "/scenes/henon_heiles.toml"));
    const Claims forces{"emitted energy, momentum, forces"};
    for (const char* name : {"energy", "node", "minus_acceleration", "momentum"})
        CHECK(failed_after(coupled, name) == forces);
    CHECK(failed_after(with_quadratic_part, "quadratic_part") == forces);
    CHECK(failed_after(with_quadratic_part, "").empty());
}
