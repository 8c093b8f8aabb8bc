// SPDX-License-Identifier: GPL-2.0-or-later
// Formulas of pieces: contact laws with broken powers, and all that is computed of a motion on the side where it is.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <lobatto/lobatto.hpp>

#include <cmath>
#include <string>

#include "generator/scene/scene.hpp"
#include "tests/support.hpp"

namespace {

namespace lob = lobatto::api;

lob::Scene scene_of(const std::string& text) {
    return lob::Scene::from_text(text, "switches.toml");
}

// A mass that flies to x = 0 with velocity -2, and what `contact` is the potential of.
std::string collision(const std::string& contact, const std::string& more = "", double step = 0.002) {
    return fmt::format(
        "lagrangian = \"m/2*x'^2 - ({})\"\n[parameters]\nm = 3\n[coordinates]\nx = {{ position = 1, velocity = -2 }}\n"
        "[method]\npoints = 5\n[run]\nstep = {}\nuntil = 1.5\n{}",
        contact, step, more);
}

// The time that Hertz's law k x^(5/2) 2/5 holds a mass: x_m^(5/2) = 5 m v^2 / (4 k), and the integral of
// 2 / sqrt(1 - x^(5/2)) from 0 to 1 times x_m / v.
double time_of_contact(double m, double v, double k) {
    const double deepest = std::pow(5 * m * v * v / (4 * k), 0.4);
    return 2 * std::sqrt(std::acos(-1.0)) * std::tgamma(0.4) / (2.5 * std::tgamma(0.9)) * deepest / v;
}

std::string failure_of(const lob::Scene& scene) {
    try {
        lob::run(scene);
    } catch (const lob::RunFailure& failure) {
        return failure.what();
    }
    return "";
}

}  // namespace

TEST_CASE("Hertz's law of contact, in each form that people write it in") {
    const double exact = 2 * (1.5 - 0.5 - time_of_contact(3, 2, 500));
    for (const std::string contact : {"200*max(-x, 0)^(5/2)", "200*max(0, -x)^2.5", "200*(-min(x, 0))^2.5",
                                      "200*if(x < 0, -x, 0)^(5/2)", "200*4^2.5*(max(-x, 0)/4)^2.5"}) {
        CAPTURE(contact);
        const lob::Trajectory run = lob::run(scene_of(collision(contact)));
        CHECK(std::fabs(run.q.back() - exact) < 2e-8);  // 2.6e-9; the form ((sqrt(x^2 + 1e-12) - x)/2)^2.5 has 1.6e-3
        CHECK(run.error.value() < 1e-6);
    }
    // Its exponent and its length as parameters, the length in a definition; in the numbers of every kind.
    const std::string adjustable =
        collision("k*R^n*depth^n", "").insert(0, "definitions = { depth = \"max(-x, 0)/R\" }\n");
    const std::string text = adjustable.substr(0, adjustable.find("m = 3")) + "m = 3\nk = 200\nR = 0.5\nn = 2.5\n" +
                             adjustable.substr(adjustable.find("[coordinates]"));
    for (const std::string numbers : {"double", "long double", "double-double", "quadruple", "40 digits"}) {
        CAPTURE(numbers);
        lob::RunOptions options;
        options.numbers = numbers;
        const lob::Trajectory run = lob::run(scene_of(text), options);
        CHECK(std::fabs(run.q.back() - exact) < 2e-8);
    }
    lob::SweepOptions options;
    const lob::Sweep sweep = lob::sweep(scene_of(text), {2, {{"k", {200, 300}}}}, options);
    CHECK(std::fabs(sweep.q[0] - exact) < 2e-8);
    CHECK(std::fabs(sweep.q[1] - 2 * (1 - time_of_contact(3, 2, 750))) < 2e-8);
}

TEST_CASE("a force may have a broken power above 1, and a potential one of 2 or more") {
    // Hunt and Crossley's law.
    const std::string damped = collision("0*x", "[forces]\nx = \"500*max(-x, 0)^1.5*(1 - 0.2*x')\"\n");
    const lob::Trajectory run = lob::run(scene_of(damped));
    // m v dv/dx = f(x) (1 - c v): the integral of f dx is 0 over a contact, so v + log(1 - c v)/c ends as it began.
    const double c = 0.2, out = run.p.back() / 3, kept = (-2) + std::log(1 + 2 * c) / c;
    CHECK(std::fabs(out + std::log(1 - c * out) / c - kept) < 1e-6);
    CHECK(lobatto::test::contains(failure_of(scene_of(collision("200*abs(x)^1.5"))),
                                  "its second derivative is not finite there. Write an exponent of at least 2"));
}

TEST_CASE("what is kept of a trajectory is on the side where the motion is") {
    // Defect once: max(-x, 0) stayed on the side of the start, 0.
    const std::string output = "[output]\nkeep = [\"max(max(-x, 0))\", \"max(-x)\", \"last(abs(x) + H)\"]\n";
    for (const std::string contact : {"200*max(-x, 0)^3", "m*(x^2 + 0.3*x^4)/2"}) {
        CAPTURE(contact);
        const lob::Scene scene = scene_of(collision(contact, output));
        const lob::Sweep sweep = lob::sweep(scene, {1, {}}, {});
        CHECK(sweep.kept[0] == sweep.kept[1]);
        CHECK(sweep.kept[0] > 0.1);
        const double energy = contact.front() == '2' ? 6 : 6 + 1.5 * 1.3;
        CHECK(sweep.kept[2] == doctest::Approx(std::fabs(sweep.q[0]) + energy).epsilon(1e-9));
    }
    // Velocities and H that stand in conditions alone; and a piece that a factor 0 takes out of the kernel.
    const lob::Sweep there_and_back = lob::sweep(
        scene_of(collision("200*max(-x, 0)^3 + 0*max(x, 0)^2.5",
                           "[output]\nkeep = [\"max(sign(x'))\", \"min(sign(x'))\", \"mean(if(H > 5, 2, 3))\"]\n")),
        {1, {}}, {});
    CHECK(there_and_back.kept == std::vector<double>{1, -1, 2});
    // And no kernel looks for what only these formulas hold.
    const lobatto::Scene smooth =
        lobatto::read_scene(lobatto::Source("smooth.toml", collision("m*(x^2 + 0.3*x^4)/2", output)));
    CHECK(smooth.switches.empty());
    CHECK(smooth.seen_switches.size() == 2);
}

TEST_CASE("multipliers and conditions of formulas are on the side where the motion is") {
    // Defect once: a rod's multiplier lacked the force of a spring that pushes for x > 0 alone.
    const lob::Trajectory run =
        lob::run(scene_of("lagrangian = \"(x'^2 + y'^2)/2 - 9.81*y - 5/2*max(x, 0)^2\"\n[coordinates]\n"
                          "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 0 }\n[constraints]\n"
                          "rod = \"x^2 + y^2 = 1\"\n[run]\nstep = 0.02\nuntil = 3\n[output]\nmultipliers = true\n"));
    int above = 0, below = 0;
    for (std::size_t row = 0; row < run.count; ++row) {
        const double x = run.q[2 * row], y = run.q[2 * row + 1], px = run.p[2 * row], py = run.p[2 * row + 1];
        // d^2/dt^2 of the equation, with x'' = -5 max(x, 0) + 2 lambda x, y'' = -9.81 + 2 lambda y
        const double lambda = (5 * std::fmax(x, 0) * x + 9.81 * y - px * px - py * py) / 2;
        CHECK(std::fabs(run.columns[row] - lambda) < 1e-12);
        ++(x > 0 ? above : below);
    }
    CHECK(above > 20);
    CHECK(below > 20);

    // Defect once: "the run left the domain of the Lagrangian", where 1 + 3 x of the first side was negative.
    CHECK(failure_of(scene_of("lagrangian = \"x'^2/2 - sqrt(1 + 3*abs(x))^2\"\n[coordinates]\n"
                              "x = { position = 2, velocity = 0 }\n[run]\nstep = 0.02\nuntil = 10\n"))
              .empty());
}

TEST_CASE("where both sides are equal a condition does not hold, and sign is 0") {
    // Defect once: i > 2 held for i = 2, and a switched-off brake was on.
    const auto end_of = [&](const std::string& force, const std::string& more = "") {
        return lob::run(
                   scene_of("lagrangian = \"x'^2/2 - x^2/2\"\n[parameters]\nnone = 0\n[coordinates]\nx = { position "
                            "= 1, velocity = 0 }\n[forces]\nx = \"" +
                            force + " + none\"\n" + more + "[run]\nstep = 0.05\nuntil = 10\n"))
            .q.back();
    };
    const double free = std::cos(10.0);
    CHECK(end_of("-if(none > 0, 0.5, 0)*x'") == doctest::Approx(free).epsilon(1e-10));
    CHECK(end_of("-if(none < 0, 0.5, 0)*x'") == doctest::Approx(free).epsilon(1e-10));
    CHECK(end_of("sum(i = 1 .. 3, if(i > 3, 1, 0) + if(i < 1, 1, 0) + sign(i - 2))") ==
          doctest::Approx(free).epsilon(1e-10));
    CHECK(end_of("sign(none)") == doctest::Approx(free).epsilon(1e-10));
    CHECK(end_of("sign(u)", "[inputs]\nu = 0\n") == doctest::Approx(free).epsilon(1e-10));
    CHECK(std::fabs(end_of("sign(u)", "[inputs]\nu = 0.1\n") - 1) < 1e-12);  // x = 1 is at rest under a force of 1
    CHECK(std::fabs(end_of("sign(u)", "[inputs]\nu = -2\n") - (2 * free - 1)) < 1e-9);
    // What is neither true nor false over stretches is refused.
    for (const std::string force :
         {"if(max(x, 0) > 0, 1, 0)", "sign(min(x, 0))", "if(abs(x) > x, 1, 0)", "if(if(x > 0, 1, 0) > 0, 1, 0)"}) {
        CAPTURE(force);
        CHECK(lobatto::test::contains(lobatto::test::message_of<lob::InputError>([&] { end_of(force); }),
                                      "over whole stretches of the motion, where this formula is undecided"));
    }
    CHECK(end_of("if(max(none, 0) > 0, 1, 0)") == doctest::Approx(free).epsilon(1e-10));  // of what does not move
    CHECK(end_of("if(if(x > 0, 1, 0) > 0.5, 0.3, 0)") != doctest::Approx(free).epsilon(1e-3));
}

TEST_CASE("switches of what grows all the time are passed for ever") {
    // Defect once: "impacts accumulate" after 130, where rounding of the sine's argument hid that it was passed.
    const lob::Trajectory driven = lob::run(
        scene_of("time = \"t\"\nlagrangian = \"x'^2/2\"\n[coordinates]\nx = { position = 0, velocity = 0 }\n[forces]\n"
                 "x = \"sign(sin(pi*t))\"\n[run]\nstep = 0.07\nuntil = 1400\n"));
    CHECK(driven.t.back() == doctest::Approx(1400));
    CHECK(driven.q.back() == doctest::Approx(700).epsilon(1e-11));  // 1/2 in each unit of time, by turns up and down
    const lob::Trajectory turning = lob::run(
        scene_of("lagrangian = \"a'^2/2 - 0.1*abs(sin(a))\"\n[coordinates]\na = { position = 0.5, velocity = 3 }\n"
                 "[run]\nstep = 0.05\nuntil = 500\n"));
    CHECK(turning.q.back() > 1400);
    CHECK(std::fabs(turning.energy.back() - turning.energy.front()) < 1e-10);
    const lob::Trajectory wall = lob::run(scene_of(
        "time = \"t\"\nlagrangian = \"y'^2/2 - y^2/2\"\n[coordinates]\ny = { position = 1, velocity = 0 }\n[impacts]\n"
        "w = { when = \"y = -0.5 + 0.05*sin(3*t) falling\", restitution = 1 }\n[run]\nstep = 0.05\nuntil = 2500\n"));
    CHECK(wall.t.back() == doctest::Approx(2500));
}

TEST_CASE("a motion that starts late, where a switch of the time is largest, passes it") {
    for (const double start : {2.0, 200.0, 1782.0, 200000.0})
        for (const double step : {2.25, 1.6, 0.45, 0.17307692307692307}) {
            CAPTURE(start);
            CAPTURE(step);
            lob::Settings settings;
            settings.step = fmt::format("{:.17g}", step);
            lob::Stepper stepper(lob::compile(
                scene_of("time = \"t\"\nlagrangian = \"x'^2/2 - if(cos(pi*t) > 0.809, 1, 0)*x\"\n[coordinates]\n"
                         "x = { position = 0, velocity = 0 }\n[run]\nstep = 1\nuntil = 1\n"),
                settings));
            const double q = 0, p = 1;
            stepper.start(start, &q, &p);
            REQUIRE(stepper.advance(12));
            // The force is -1 where |t| < w modulo 2.
            const double w = std::acos(0.809) / std::acos(-1.0), end = 12 * step, whole = std::floor((end + w) / 2),
                         rest = end - 2 * whole;
            const double on = 2 * w * whole - w + (rest < w ? rest + w : 2 * w);
            CHECK(stepper.p()[0] == doctest::Approx(1 - on).epsilon(1e-9));
        }
}

TEST_CASE("the sides of switches are no parameters that others set") {
    const lob::Scene scene = scene_of(collision("4*max(0, -x)^2"));
    CHECK(scene.parameters().size() == 1);
    lob::Stepper stepper(lob::compile(scene));
    CHECK_THROWS_WITH_AS(stepper.set("side_1", -1), "unknown parameter 'side_1'; declared: m.", lob::InputError);
    lob::Settings settings;
    settings.set = {{"side_1", "-1"}};
    CHECK_THROWS_WITH_AS(lob::compile(scene, settings),
                         doctest::Contains("unknown parameter 'side_1'; declared: m; of the start: "), lob::InputError);
}

TEST_CASE("a condition that jumps, or has a pole, cuts steps there too") {
    const auto spring = [](const std::string& condition, double step) {
        return lob::run(
            scene_of(fmt::format("lagrangian = \"(x'^2 + y'^2)/2 - (x^2 + y^2)/2\"\n[coordinates]\n"
                                 "x = {{ position = 1, velocity = 0 }}\ny = {{ position = 0, velocity = "
                                 "0.8 }}\n[forces]\nx = \"{}\"\n[run]\nstep = {}\nuntil = 20\n",
                                 condition, step)));
    };
    // Two ways to write one sector. atan2 jumps at x < 0, y = 0; the other condition does not.
    const lob::Trajectory smooth = spring("if(y > 0, if(cos(1)*y > sin(1)*x, 0.1, 0), 0)", 0.05);
    for (const double step : {0.2, 0.1, 0.05}) {
        CAPTURE(step);
        const lob::Trajectory sector = spring("if(atan2(y, x) > 1, 0.1, 0)", step);
        const double difference = std::fabs(sector.q[sector.q.size() - 2] - smooth.q[smooth.q.size() - 2]);
        CHECK(difference < 2e-10 * std::pow(step / 0.05, 6));  // 1.7e-11 at 0.05; 6.5e-3 where the jump is not met
        CHECK(difference < 4 * sector.error.value() + 1e-13);
    }
    const lob::Trajectory ratio = spring("if(y/x > 1, 0.1, 0)", 0.05),
                          product = spring("if((y - x)*x > 0, 0.1, 0)", 0.05);
    CHECK(std::fabs(ratio.q[ratio.q.size() - 2] - product.q[product.q.size() - 2]) < 1e-13);

    // Poles within functions and of many denominators, and a jump that is small beside what the condition changes by.
    const double beyond = [&] {
        const lob::Trajectory run = spring("if(x > 0, 0.1, 0)", 0.05);
        return run.q[run.q.size() - 2];
    }();
    for (const char* condition : {"exp(1/x) > 2", "1/x > 0", "sinh(1/x) > 0", "1/x^3 + atan2(x, 1) > 0"}) {
        CAPTURE(condition);
        const lob::Trajectory run = spring(fmt::format("if({}, 0.1, 0)", condition), 0.05);
        // exp(1/x) > 2 holds for 0 < x < 1/log 2 = 1.44, which the motion does not leave.
        CHECK(std::fabs(run.q[run.q.size() - 2] - beyond) < 1e-11);
    }
    const std::string fractions =
        "if(1/(x - 0.1) + 2/(x - 0.3) + 3/(x - 0.45) + 4/(x + 0.2) + 5/(x + 0.7) > 0, 0.1, 0)";
    const lob::Trajectory summed = spring(fractions, 0.05), finer = spring(fractions, 0.025);
    CHECK(std::fabs(summed.q[summed.q.size() - 2] - finer.q[finer.q.size() - 2]) < 1e-10);
    CHECK(summed.error.value() < 1e-9);
    for (const char* small : {"1e-6", "1e-8", "1e-10"})
        for (const double step : {0.05, 0.1, 0.2}) {
            CAPTURE(small);
            CHECK_NOTHROW(spring(fmt::format("if(y + {}*atan2(y, x) > 0, 0.1, 0)", small), step));
        }

    // Sawtooth carriers: x'' is 1 in a part of each period, from a to b, and x(10) the sum of what each part leads to.
    const double pi = std::acos(-1.0);
    struct Carrier {
        const char* condition;
        double a, b;
    };
    for (const Carrier& carrier :
         {Carrier{"atan2(sin(2*pi*t), cos(2*pi*t)) > 0.5", 0.25 / pi, 0.5}, Carrier{"tan(pi*t) > 1", 0.25, 0.5}}) {
        CAPTURE(carrier.condition);
        const double width = carrier.b - carrier.a;
        double exact = 0;
        for (int k = 0; k < 10; ++k) exact += width * (10 - k - (carrier.a + carrier.b) / 2);
        for (const double step : {0.07, 0.1}) {
            const lob::Trajectory run = lob::run(scene_of(fmt::format(
                "time = \"t\"\nlagrangian = \"x'^2/2\"\n[coordinates]\nx = {{ position = 0, velocity = 0 }}\n"
                "[forces]\nx = \"if({}, 1, 0)\"\n[run]\nstep = {}\nuntil = \"10\"\n",
                carrier.condition, step)));
            const double t = run.t.back();  // in steps of 0.07 a little before 10, where the force is 0
            CHECK(std::fabs(run.q.back() + 10 * width * (10 - t) - exact) < 1e-11);
        }
    }
}
