// SPDX-License-Identifier: GPL-2.0-or-later
// Lagrangians taken apart: what is found, what is refused and in which words.
#include "generator/mechanics/system/system.hpp"

#include <doctest/doctest.h>

#include "generator/formula/real.hpp"
#include "generator/graph/notation.hpp"
#include "generator/mechanics/structure/structure.hpp"
#include "generator/pipeline.hpp"

using namespace lobatto;

namespace {

Scene scene_of(const std::string& lagrangian, const std::string& coordinates, const std::string& parameters = "") {
    return read_scene(Source("scene.toml", "title = \"test\"\nlagrangian = \"" + lagrangian + "\"\n[coordinates]\n" +
                                               coordinates + (parameters.empty() ? "" : "[parameters]\n" + parameters) +
                                               "[run]\nstep = 0.1\nuntil = 1\n"));
}

std::pair<Structure, std::vector<Finding>> structure_of(const Scene& scene) {
    return find_structure(scene, build_system(scene), quadrature_of(scene.method));
}

const std::string one = "q = { position = 1, velocity = 0 }\n";
const std::string two = "a = { position = 1, velocity = 0 }\nb = { position = 0, velocity = 0 }\n";

std::string refusal(const std::string& lagrangian, const std::string& coordinates, const std::string& parameters = "") {
    try {
        build_system(scene_of(lagrangian, coordinates, parameters));
    } catch (const InputError& error) {
        const std::string text = error.what();
        return text.substr(0, text.find('\n'));
    }
    return "accepted";
}

const Finding& finding(const std::vector<Finding>& findings, const std::string& name) {
    for (const Finding& f : findings)
        if (f.name == name) return f;
    throw std::runtime_error("no finding " + name);
}

}  // namespace

TEST_CASE("the mass matrix and the potential are read off a Lagrangian with inertial coupling") {
    const Scene scene = scene_of("m*(a' + b')^2/2 + 3*b'^2/2 - a^2*b - cos(b)", two, "m = 2\n");
    const System system = build_system(scene);
    const GiNaC::ex m = system.parameters[0], a = system.q[0], b = system.q[1];
    CHECK(system.mass(0, 0).is_equal(m));
    CHECK(system.mass(0, 1).is_equal(m));
    CHECK((system.mass(1, 1) - m - 3).expand().is_zero());
    CHECK((system.potential - GiNaC::pow(a, 2) * b - GiNaC::cos(b)).expand().is_zero());
    CHECK((system.gradient[0] - 2 * a * b).expand().is_zero());
    CHECK((system.gradient[1] - GiNaC::pow(a, 2) + GiNaC::sin(b)).expand().is_zero());
    CHECK((system.hessian(0, 1) - 2 * a).expand().is_zero());
    CHECK((system.hessian(1, 1) + GiNaC::cos(b)).expand().is_zero());
}

TEST_CASE("Lagrangians with other than constant mass are general, and the term in the way is named") {
    const auto reason = [](const std::string& lagrangian, const std::string& coordinates,
                           const std::string& parameters = "") {
        const System system = build_system(scene_of(lagrangian, coordinates, parameters));
        CHECK_FALSE(system.separable);
        return system.not_separable;
    };
    CHECK(reason("q^2*q'^2/2", one) == "dp_q/dq' = q^2 depends on the position");
    CHECK(reason("q'^2/2 - q'^4/8 - q^2", one) == "dp_q/dq' = 1 - 3*q'^2/2 depends on the velocity");
    CHECK(reason("(a'^2 + b'^2)/2 + w*(a*b' - b*a')", two, "w = 1\n") ==
          "dp_a/db = -w: the momentum depends on the position");
}

TEST_CASE("a force that mentions velocities and does not depend on them is written without them") {
    // A point turned about an axis askew: the kinetic energy does not depend on q, but GiNaC does not see that.
    const Scene scene =
        read_scene(Source("scene.toml",
                          "lagrangian = \"(x'^2 + y'^2 + z'^2)/2 - z\"\n[definitions]\n"
                          "x = \"cos(q) + 16/81*(1 - cos(q))\"\ny = \"16/81*(1 - cos(q)) + 7/9*sin(q)\"\n"
                          "z = \"28/81*(1 - cos(q)) - 4/9*sin(q)\"\n[coordinates]\n" +
                              one + "[run]\nstep = 0.1\nuntil = 1\n"));
    const System system = build_system(scene);
    REQUIRE(system.separable);
    CHECK(system.force[0].has(system.v[0]));
    CHECK(!system.gradient[0].has(system.v[0]));
    CHECK(!system.hessian(0, 0).has(system.v[0]));
    CHECK(!emit(derive(scene)).header.empty());  // a logic_error before
}

TEST_CASE("so is one whose formula has no value at rest") {
    const Scene scene = read_scene(
        Source("scene.toml",
               "lagrangian = \"(x'^2 + y'^2)/2\"\n[coordinates]\nx = { position = 0.5, velocity = 0.2 }\n"
               "y = { position = 0.1, velocity = 0.4 }\n[forces]\n"
               "x = \"(x'^2 - y'^2)/(x' - y')*x - (x' + y')*x - x^3\"\ny = \"exp(log(y'^2) - 2*log(y'))*y\"\n"
               "[run]\nstep = 0.1\nuntil = 1\n"));
    const System system = build_system(scene);
    REQUIRE(system.separable);
    const auto value = [&](const GiNaC::ex& formula) {
        return real_value(formula, {{system.q[0], GiNaC::numeric(1, 2)}, {system.q[1], GiNaC::numeric(3)}}).to_double();
    };
    CHECK(value(system.gradient[0]) == doctest::Approx(0.125).epsilon(1e-15));
    CHECK(value(system.gradient[1]) == doctest::Approx(-3).epsilon(1e-15));
}

TEST_CASE("a degenerate Lagrangian is refused with the direction that no kinetic energy opposes") {
    CHECK(refusal("m*(a' + b')^2/2 - a^2 - b^2", two, "m = 1\n") ==
          "scene.toml:2:15: the Lagrangian is degenerate: its second derivatives in the velocities form a singular "
          "matrix, so velocities do not "
          "follow from momenta. No kinetic energy opposes the direction a' = -1, b' = 1; add the missing mass, or "
          "remove a coordinate");
}

TEST_CASE("a quadratic potential makes a linear system, any other does not") {
    CHECK(structure_of((scene_of("q'^2/2 - 3*q^2 + q", one))).first.linear);
    const auto [quartic, findings] = structure_of((scene_of("q'^2/2 - q^4", one)));
    CHECK_FALSE(quartic.linear);
    CHECK(finding(findings, "linear system").reason == "d2V/dqdq = 12*q^2 depends on the position");
    CHECK(structure_of((scene_of("q'^2/2 - (1 + q)^2 + (q - 1)*(q + 2)", one))).first.linear);
}

TEST_CASE("closed solutions are recognised, and only where they hold") {
    const auto closed = [](const std::string& lagrangian, const std::string& parameters = "") {
        return structure_of((scene_of(lagrangian, one, parameters))).first.closed_solution;
    };
    const auto pendulum = closed("m*l^2*q'^2/2 + m*g*l*cos(q)", "m = 2\nl = 3\ng = 9\n");
    REQUIRE(pendulum.has_value());
    CHECK(pendulum->kind == ClosedSolution::Kind::pendulum);
    CHECK(canonical_text(pendulum->omega_squared) == "g/l");
    const auto spring = closed("m*q'^2/2 - k*q^2/2", "m = 2\nk = 3\n");
    REQUIRE(spring.has_value());
    CHECK(spring->kind == ClosedSolution::Kind::harmonic);
    CHECK(canonical_text(spring->omega_squared) == "k/m");
    CHECK_FALSE(closed("q'^2/2 + cos(2*q)").has_value());
    CHECK_FALSE(closed("q'^2/2 - q^2 + q").has_value());
    CHECK_FALSE(closed("q'^2/2 + cos(q) - q^2").has_value());
}

TEST_CASE("only second derivatives that are not identically zero become entries") {
    const auto entries = [](const std::string& lagrangian) {
        return structure_of((scene_of(lagrangian, two))).first.constant_mass().entries;
    };
    using Entries = std::vector<std::pair<int, int>>;
    CHECK(entries("(a'^2 + b'^2)/2 - a^4 - cos(b)") == Entries{{0, 0}, {1, 1}});
    CHECK(entries("(a'^2 + b'^2)/2 - a*b") == Entries{{0, 1}, {1, 0}});
    CHECK(entries("(a'^2 + b'^2)/2 - b^4") == Entries{{1, 1}});
    // A mass matrix that couples spreads each column of V'' over all rows.
    CHECK(entries("(a'^2 + a'*b' + b'^2)/2 - b^4") == Entries{{0, 1}, {1, 1}});
}

TEST_CASE("a Lagrangian in SI units is not degenerate because its mass is small") {
    const System system =
        build_system(scene_of("-m*c^2*sqrt(1 - (a'^2 + b'^2)/c^2)",
                              "a = { position = 0, velocity = 1e8 }\nb = { position = 0, velocity = 0 }\n",
                              "m = 9.1093837e-31\nc = 299792458\n"));
    CHECK(system.momentum_v.entries().size() == 4);
    CHECK_FALSE(system.separable);
}

// Found by the fuzz target derivation: the energy of the first asked for a time that no function was given.
TEST_CASE("a time that changes nothing is left out, also where formulas mention it") {
    const auto system_of = [](const std::string& potential, const std::string& forces) {
        return build_system(
            read_scene(Source("time.toml", "time = \"t\"\nlagrangian = \"q'^2/2 - " + potential +
                                               "\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n" + forces +
                                               "[run]\nstep = 0.1\nuntil = 1\n")));
    };
    for (const char* potential : {"q^4 + 2*t", "q^4 - 1/t", "q^4*(sin(t)^2 + cos(t)^2)", "q^4 + log(t)*(q - q)"}) {
        CAPTURE(potential);
        const System system = system_of(potential, "");
        CHECK(system.autonomous);
        CHECK_FALSE(system.lagrangian.has(system.t));
        CHECK_FALSE(system.potential.has(system.t));
    }
    CHECK(system_of("q^4", "[forces]\nq = \"-q'*(sin(t)^2 + cos(t)^2)\"\n").autonomous);
    CHECK_FALSE(system_of("q^4 + t*q", "").autonomous);
    CHECK_FALSE(system_of("q^4", "[forces]\nq = \"cos(t)\"\n").autonomous);
}

TEST_CASE("what is lost in rounding at the start of a scene is kept: runs from elsewhere have the same kernel") {
    const auto from = [](const std::string& position) { return "q = { position = " + position + ", velocity = 0 }\n"; };
    CHECK_FALSE(build_system(scene_of("q'^2/2 - q^2/2 - eps*q^4/4", one, "eps = 1e-50\n")).linear);
    CHECK_FALSE(build_system(scene_of("q'^2/2 - q^2/2 - 1e-50*q^4/4", one)).linear);
    CHECK_FALSE(build_system(scene_of("q'^2/2 + eps*q'^4 - q^2/2", one, "eps = 1e-60\n")).separable);
    for (const char* position : {"1e-60", "1e60", "1e-300", "1e150"}) {
        CAPTURE(position);
        const System system = build_system(scene_of("q'^2/2 + cos(q)", from(position)));
        CHECK_FALSE(system.linear);
        CHECK(system.hessian.entries().size() == 1);
    }
    CHECK_FALSE(build_system(scene_of("q'^2/2 - q^2/2 - exp(-q)", from("200"))).linear);
    const Scene pumped = read_scene(
        Source("scene.toml", "time = \"t\"\nlagrangian = \"q'^2/2 - q^2/2*(1 + eps*cos(2*t))\"\n[coordinates]\n" + one +
                                 "[parameters]\neps = 1e-50\n[run]\nstep = 0.1\nuntil = 1\n"));
    CHECK_FALSE(build_system(pumped).autonomous);
    const System pole = build_system(scene_of("q'^2/2 - q^2/2 + 1e-90/q'", "q = { position = 1, velocity = 1 }\n"));
    CHECK_FALSE(pole.separable);
    CHECK(build_system(scene_of("q'^2/2 - q^2/2*(sin(w)^2 + cos(w)^2)", one, "w = 1e-50\n")).linear);
}

TEST_CASE("powers of sums of any height are taken apart without writing them out") {
    for (const char* potential : {"((q + 1)^20 + 1)^20", "((q + 1)^30 + 1)^40", "(((q^64 + q)^64 + q)^64 + q)^64"}) {
        CAPTURE(potential);
        const Structure structure = structure_of(scene_of(std::string("q'^2/2 - ") + potential, one)).first;
        CHECK_FALSE(structure.closed_solution);
    }
}
