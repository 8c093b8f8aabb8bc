// SPDX-License-Identifier: GPL-2.0-or-later
// Starts from which no motion can begin: each is refused, in words tested here.
#include "generator/mechanics/start.hpp"

#include <doctest/doctest.h>

#include <chrono>

#include "generator/pipeline.hpp"

using namespace lobatto;

namespace {

// The first line of the refusal; the Lagrangian stands at 2:15, the first coordinate in line 4.
std::string refusal(const std::string& lagrangian, const std::string& coordinates, const std::string& parameters = "",
                    const std::string& forces = "") {
    try {
        derive(read_scene(Source(
            "scene.toml", "title = \"test\"\nlagrangian = \"" + lagrangian + "\"\n[coordinates]\n" + coordinates +
                              (parameters.empty() ? "" : "[parameters]\n" + parameters) +
                              (forces.empty() ? "" : "[forces]\n" + forces) + "[run]\nstep = 0.1\nuntil = 1\n")));
    } catch (const InputError& error) {
        const std::string text = error.what();
        return text.substr(0, text.find('\n'));
    }
    return "accepted";
}

const std::string at_origin = "x = { position = 0, velocity = 0 }\n";

}  // namespace

TEST_CASE("a start at a singularity is refused with the term, the place and the reason") {
    CHECK(
        refusal("(x'^2 + y'^2)/2 + k/sqrt(x^2 + y^2)", at_origin + "y = { position = 0, velocity = 1 }\n", "k = 1\n") ==
        "scene.toml:2:15: the Lagrangian has no value because of its term k/sqrt(x^2 + y^2) at the start, x = 0, y = "
        "0: division by zero; start elsewhere, or mend the formula");
    CHECK(refusal("x'^2/2 - log(x)", at_origin) ==
          "scene.toml:2:15: the Lagrangian has no value because of its term -log(x) at the start, x = 0: logarithm of "
          "a number that is not positive; start elsewhere, or mend the formula");
    CHECK(refusal("-sqrt(1 - x'^2)", "x = { position = 0, velocity = 1 }\n") ==
          "scene.toml:2:15: the derivative dL/dx' = x'/sqrt(1 - x'^2) has no value at the start, x' = 1: division by "
          "zero; start elsewhere, or mend the formula");
    // Finite itself, but not its derivatives.
    CHECK(refusal("x'^2/2 - sqrt(x)", at_origin) ==
          "scene.toml:2:15: the derivative dL/dx = -1/(2*sqrt(x)) has no value at the start, x = 0: division by zero; "
          "start elsewhere, or mend the formula");
    CHECK(refusal("x'^2/2 - x*sqrt(x)", at_origin) ==
          "scene.toml:2:15: the second derivative d2L/dxdx = -3/(4*sqrt(x)) has no value at the start, x = 0: division "
          "by zero; start elsewhere, or mend the formula");
    CHECK(refusal("x'^2/2 - x^2", at_origin, "", "x = \"-x'/sqrt(x)\"\n") ==
          "scene.toml:6:5: the force on x has no value at the start, x = 0, x' = 0: division by zero; start elsewhere, "
          "or mend the formula");
    CHECK(refusal("x'^2/2 - x^2", at_origin, "", "x = \"-sqrt(x')\"\n") ==
          "scene.toml:6:5: the force on x has no derivative in x' at the start, x' = 0: division by zero; start "
          "elsewhere, or mend the formula: for sqrt(u) write sqrt(u + 1e-20)");
    CHECK(refusal("x'^2/2 - sqrt(x)", "x = { position = 1e-30, velocity = 0 }\n") == "accepted");
}

TEST_CASE("a start where the mass matrix is singular is refused with the direction") {
    const std::string sphere = "(theta'^2 + sin(theta)^2*phi'^2)/2 - cos(theta)";
    const auto angles = [](const std::string& theta) {
        return "theta = { position = \"" + theta + "\", velocity = 1 }\nphi = { position = 0, velocity = 0 }\n";
    };
    const auto pole = [](const std::string& theta) {
        return "scene.toml:2:15: the mass matrix is singular at the start, theta = " + theta +
               ": no kinetic energy opposes the direction phi' = 1 there; start elsewhere, or choose coordinates that "
               "are regular there (x and y instead of an angle at its pole)";
    };
    CHECK(refusal(sphere, angles("0")) == pole("0"));
    CHECK(refusal(sphere, angles("pi")) == pole("3.14159"));
    CHECK(refusal(sphere, angles("1/1000000")) == "accepted");
    CHECK(refusal("m*x'^2/2 - x^2", at_origin, "m = 0\n") ==
          "scene.toml:2:15: the mass matrix is singular at the start, m = 0: no kinetic energy opposes the direction "
          "x' = 1; give it mass, or remove a coordinate");
    CHECK(
        refusal("m*x'^2/2 + x^2*y'^2/2 - x^2",
                "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }\n", "m = 0\n") ==
        "scene.toml:2:15: the mass matrix is singular at the start, x = 1: no kinetic energy opposes the direction x' "
        "= 1 there; start elsewhere, choose coordinates that are regular there (x and y instead of an angle at its "
        "pole), or give a value other than 0 to m");
}

TEST_CASE("a momentum that no velocity has is refused where it is given") {
    const auto start = [](const std::string& momentum) {
        return "x = { position = 0, momentum = " + momentum + " }\n";
    };
    CHECK(refusal("sqrt(1 + x'^2) - x^2", start("2")) ==
          "scene.toml:4:32: no velocity has this momentum: p_x = dL/dx' = x'/sqrt(x'^2 + 1) comes no nearer to 2 than "
          "1; give a momentum that a velocity has, or the velocity itself");
    CHECK(refusal("sqrt(1 + x'^2) - x^2", start("0.999")) == "accepted");
    // A relativistic particle takes any momentum, from velocities below that of light.
    CHECK(refusal("-sqrt(1 - x'^2) - x^2", start("-1000")) == "accepted");
    // At rest it has no mass; at the velocity of this momentum it has.
    for (const char* momentum : {"8", "-0.001", "1000"})
        CHECK(refusal("x'^4/4 - x^2/2", start(momentum)) == "accepted");
    CHECK(refusal("x'^4/4 - x^2/2", start("0")).find("the mass matrix is singular at the start") != std::string::npos);
    // Two coordinates: the one in the way is named.
    CHECK(refusal("x'^2*(1 + x^2)/2 + sqrt(1 + y'^2)", start("5") + "y = { position = 0, momentum = -3 }\n")
              .starts_with("scene.toml:5:32: no velocity has this momentum: p_y = dL/dy' = y'/sqrt(y'^2 + 1) comes no "
                           "nearer to -3 than -"));
}

TEST_CASE("what has no value where it stands is an error, also where the rest of the formula cancels it") {
    const std::string one = "x = { position = 1, velocity = 0.5 }\n", mk = "m = 1\nk = 1\n";
    const auto begins_at = [&](const std::string& position) {
        return refusal("m*x'^2/2 - k*x^2/2", "x = { position = \"" + position + "\", velocity = 0 }\n", mk);
    };
    CHECK(begins_at("sqrt(m-2)^2") ==
          "scene.toml:4:19: a square root has no value at the start: it is of m - 2 = -1, "
          "with m = 1; start elsewhere, or mend the formula");
    CHECK(begins_at("(m-k)/(m-k)").find("a division has no value at the start: it is of m - k = 0") !=
          std::string::npos);
    CHECK(begins_at("0*log(m-k)").find("a logarithm has no value") != std::string::npos);
    CHECK(begins_at("((m-3)^0.5)^2").find("a broken power has no value") != std::string::npos);
    CHECK(begins_at("sin(asin(m+k))").find("an asin has no value") != std::string::npos);
    CHECK(begins_at("(m-k)^(-2)*(m-k)^2").find("has no value") != std::string::npos);
    CHECK(
        begins_at("tan(pi*m/2)/tan(pi*m/2)").find("a tangent, which has a pole where its cosine is 0, has no value") !=
        std::string::npos);
    CHECK(begins_at("sin(pi*m)/sin(pi*m)").find("a division has no value at the start: it is of sin(pi*m) = 0") !=
          std::string::npos);
    CHECK(begins_at("sqrt(m)^2 + log(k) + m/k + tan(m)/tan(m)") == "accepted");
    for (const char* lagrangian : {"m*x'^2/2 - k*(sqrt(x-3))^2", "m*x'^2/2 - k*exp(log(x-3))",
                                   "m*x'^2/2 - k*cos(acos(x*3))", "m*x'^2/2 - k*x*(x-1)/(x-1)"})
        CHECK_MESSAGE(refusal(lagrangian, one, mk).find("has no value at the start") != std::string::npos, lagrangian);
    for (const char* lagrangian :
         {"m*x'^2/2 - k*sqrt(x^2)", "m*x'^2/2 - k*(sqrt(x))^2", "m*x'^2/2 - k*x/x", "m*x'^2/2 - k*exp(log(x))"})
        CHECK_MESSAGE(refusal(lagrangian, one, mk) == "accepted", lagrangian);
}

TEST_CASE("a power with a parameter in it asks of its base what the value of the parameter asks") {
    const auto begins_at = [](const std::string& x, const std::string& n, const std::string& potential) {
        return refusal("x'^2/2 - k*" + potential, "x = { position = " + x + ", velocity = 0.5 }\n",
                       "n = " + n + "\nk = 1\n");
    };
    for (const char* n : {"4", "3", "1", "-2", "-3"}) CHECK(begins_at("-1", n, "x^n") == "accepted");
    for (const char* n : {"2.5", "-0.5"}) {
        CHECK(begins_at("1", n, "x^n") == "accepted");
        CHECK(begins_at("-1", n, "x^n").find("real power of a number that is not positive") != std::string::npos);
    }
    // x^n/x, as in its derivative, is x^(n - 1).
    for (const char* n : {"4", "2", "2.5"}) CHECK(begins_at("0", n, "x^n") == "accepted");
    CHECK(begins_at("0", "1.5", "x^n").find("the second derivative") != std::string::npos);
    for (const char* power : {"(x/k)^n", "(k*x)^n", "(-x)^n", "abs(x + 1e-30)^n", "(x^2)^n", "(2*x)^n", "(x + x*k)^n"})
        CHECK_MESSAGE(begins_at("0", "4", power) == "accepted", power);
    for (const char* power : {"(1 - x)^n", "(2*x - 2)^n", "(k - x)^n", "((x - 1)*k)^n"})
        CHECK_MESSAGE(begins_at("1", "4", power) == "accepted", power);
    for (const char* n : {"-2", "-0.5"}) CHECK(begins_at("0", n, "x^n").find("has no value") != std::string::npos);
    CHECK(begins_at("-1", "2", "x^(2*n)") == "accepted");
    CHECK(begins_at("-1", "2", "x^(n + x)") != "accepted");
    // Where the formula cancels it, what is written decides alone.
    const auto is_told = [&](const std::string& x, const std::string& n) {
        const std::string told = begins_at(x, n, "x*x^n/x^n");
        return told.find("a power has no value at the start: it is of x = " + x + ", with") != std::string::npos;
    };
    CHECK(is_told("-1", "2.5"));
    CHECK(is_told("0", "-3"));
    CHECK(begins_at("-1", "3", "x*x^n/x^n") == "accepted");
}

TEST_CASE("a start is moved to the nearest that keeps the constraints, to all digits, also where they curve sharply") {
    // On an ellipse, from inside its evolute, from outside it, from far away and from almost on the line.
    for (const auto& [x0, y0] : {std::pair{"1.45", "0.01"},
                                 {"1.4", "0.001"},
                                 {"0", "0.01"},
                                 {"6", "1"},
                                 {"0.3", "0.95"},
                                 {"1e-9", "3"},
                                 {"-2.0000001", "1e-7"},
                                 {"0.3", "1e-6"},
                                 {"1.6", "0.1"}}) {
        const std::string tried = std::string(x0) + ", " + y0;  // bindings cannot be captured
        CAPTURE(tried);
        const Scene scene = read_scene(
            Source("scene.toml", std::string("lagrangian = \"(x'^2 + 3*y'^2)/2\"\n[coordinates]\nx = { position = ") +
                                     x0 + ", velocity = 0 }\ny = { position = " + y0 +
                                     ", velocity = 0.2 }\n[constraints]\nc = \"x^2/4 + y^2 = 1\"\n[run]\nstep = 0.1\n"
                                     "until = 1\nassemble = true\n"));
        const StartOnConstraints start = start_on_constraints(scene, build_system(scene));
        const cln::cl_R x = start.q[0], y = start.q[1];
        const auto given = [&](std::size_t k) {
            return cln::the<cln::cl_R>(scene.evaluate(scene.initial_position[k], "").to_cl_N());
        };
        const cln::cl_R off = x * x / 4 + y * y - 1, along = (x - given(0)) * 2 * y - 3 * (y - given(1)) * x / 2;
        CHECK(cln::double_approx(cln::abs(off)) < 1e-50);
        CHECK(cln::double_approx(cln::abs(along)) < 1e-28 * (1 + cln::double_approx(cln::abs(given(0)))));
        const double a = cln::double_approx(given(0)), b = cln::double_approx(given(1));
        const auto distance = [&](double to_x, double to_y) {
            return (to_x - a) * (to_x - a) + 3 * (to_y - b) * (to_y - b);
        };
        double least = 1e9;
        for (int i = 0; i < 10000; ++i) {
            const double angle = i * 2 * M_PI / 10000;
            least = std::fmin(least, distance(2 * std::cos(angle), std::sin(angle)));
        }
        CHECK(distance(cln::double_approx(x), cln::double_approx(y)) <= least * (1 + 1e-12));
    }
}

TEST_CASE("a velocity that the constraints take away wholly is 0") {
    const Scene scene = read_scene(
        Source("scene.toml",
               "lagrangian = \"(x'^2 + y'^2 + z'^2)/2 - y\"\n[coordinates]\nx = { position = 3, velocity = 3 }\ny = { "
               "position = 1, velocity = 0 }\nz = { position = 0.5, velocity = 0 }\n[constraints]\na = \"x^2 + y^2 + "
               "z^2 = 1\"\nb = \"(x - 0.5)^2 + y^2 + z^2 = 1\"\n[run]\nstep = 0.02\nuntil = 2\nassemble = true\n"));
    const StartOnConstraints start = start_on_constraints(scene, build_system(scene));
    for (const cln::cl_R& v : start.v) CHECK(cln::zerop(v));
}
