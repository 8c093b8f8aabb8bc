// SPDX-License-Identifier: GPL-2.0-or-later
// Inputs: values that a program sets between steps, in every form of a step, against motions known otherwise.
#include <doctest/doctest.h>

#include <lobatto/lobatto.h>
#include <lobatto/lobatto.hpp>

#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <string>

#include "tests/support.hpp"

namespace {

namespace lob = lobatto::api;
namespace test = lobatto::test;

// A scene of one coordinate q that starts at 1 with momentum 0, with the input u = 0.5.
std::string scene_of(const std::string& lagrangian, const std::string& more, const std::string& step = "0.05") {
    return "lagrangian = \"" + lagrangian +
           "\"\n[coordinates]\nq = { position = 1, momentum = 0 }\n[inputs]\nu = 0.5\n[run]\nstep = " + step +
           "\nuntil = 1\n" + more;
}
lob::Stepper stepper_of(const std::string& text) {
    return lob::Stepper(lob::compile(lob::Scene::from_text(text, "inputs.toml")));
}
std::string error_of(const std::string& text) {
    try {
        static_cast<void>(stepper_of(text));
    } catch (const lob::InputError& error) {
        const std::string message = error.what();
        return message.substr(0, message.find('\n'));
    }
    return "nothing was thrown";
}
double input_at(int step) {
    return 1.5 + std::sin(0.7 * step);
}

// q'' = f(q, u) with u as in input_at, by 400 steps of Runge and Kutta's method of order 4 to a step.
struct Reference {
    double q = 1, v = 0;
    void step(double h, double u, const std::function<double(double, double)>& f) {
        const double s = h / 400;
        for (int i = 0; i < 400; ++i) {
            const double k1 = f(q, u), k2 = f(q + s / 2 * v, u), k3 = f(q + s / 2 * v + s * s / 4 * k1, u),
                         k4 = f(q + s * v + s * s / 2 * k2, u);
            q += s * v + s * s / 6 * (k1 + k2 + k3);
            v += s / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        }
    }
};

// The largest error of positions and momenta in 60 steps with changing inputs, of a mass 1.
double error_with(lob::Stepper stepper, const std::function<double(double, double)>& f) {
    Reference reference;
    double worst = 0;
    for (int i = 0; i < 60; ++i) {
        stepper.set("u", input_at(i));
        stepper.step();
        reference.step(stepper.step_size(), input_at(i), f);
        worst = std::fmax(worst,
                          std::fmax(std::fabs(stepper.q()[0] - reference.q), std::fabs(stepper.p()[0] - reference.v)));
    }
    CHECK(stepper.t() == doctest::Approx(60 * stepper.step_size()).epsilon(1e-14));
    return worst;
}

// What a program prints that includes the emitted kernel of a scene, "NAME.hpp".
std::string printed_by(const std::string& name, const std::string& scene, const std::string& program) {
    const lobatto::test::TemporaryFolder folder;
    const std::string file = folder / (name + ".toml");
    lobatto::test::write_text(file, scene);
    const lobatto::test::Finished emitted =
        lobatto::test::run({LOBATTO_PROGRAM, "emit", file, "--standalone", "-o", folder.string()});
    REQUIRE_MESSAGE(emitted.exit_code == 0, emitted.err);
    lobatto::test::write_text(folder / "program.cpp", program);
    const lobatto::test::Finished compiled =
        lobatto::test::run({"g++", "-std=c++17", "-O2", "-march=native", "-ffp-contract=off", "-Wall", "-Wextra",
                            "-Wpedantic", "-Werror", "-o", folder / "program", folder / "program.cpp"});
    REQUIRE_MESSAGE(compiled.exit_code == 0, compiled.err);
    const lobatto::test::Finished ran = lobatto::test::run({folder / "program"});
    REQUIRE(ran.exit_code == 0);
    return ran.out;
}

}  // namespace

TEST_CASE("a pendulum with a torque that changes before each step moves as an independent integrator says") {
    const std::string pendulum = "q'^2/2 + cos(q) + u*q";
    const auto f = [](double q, double u) { return u - std::sin(q); };
    for (const char* method : {"points = 6", "points = 2", "family = \"gauss\"\nstages = 4", "arithmetic = \"clean\"",
                               "family = \"splitting\"\nstages = 17"}) {
        CAPTURE(method);
        const bool is_rough = std::string(method) == "points = 2";  // of order 2: 9e-4; the others: 2e-11 at most
        const double error = error_with(stepper_of(scene_of(pendulum, std::string("[method]\n") + method)), f);
        CHECK(error < (is_rough ? 2e-3 : 1e-10));
        CHECK(error > 0);
    }
}

TEST_CASE("a linear system with an input is exact piece by piece, though its matrix is factored once") {
    for (const char* method : {"points = 9", "family = \"gauss\"\nstages = 8"}) {
        CAPTURE(method);
        lob::Stepper stepper = stepper_of(scene_of("q'^2/2 - q^2/2 + u*q", std::string("[method]\n") + method, "0.3"));
        double q = 1, p = 0;
        for (int i = 0; i < 100; ++i) {
            const double u = input_at(i), c = std::cos(0.3), s = std::sin(0.3), distance = q - u;
            stepper.set_inputs(&u);
            stepper.step();
            q = u + distance * c + p * s;
            p = p * c - distance * s;
        }
        CHECK(std::fabs(stepper.q()[0] - q) < 1e-12);
        CHECK(std::fabs(stepper.p()[0] - p) < 1e-12);
    }
}

TEST_CASE("an input may change stiffness and mass: the momentum goes on through the change") {
    lob::Stepper stiff = stepper_of(scene_of("q'^2/2 - u*q^2/2", "[method]\npoints = 9", "0.3"));
    lob::Stepper heavy = stepper_of(scene_of("u*q'^2/2 - q^2/2", "[method]\npoints = 9", "0.3"));
    double q[2] = {1, 1}, p[2] = {0, 0};
    for (int i = 0; i < 50; ++i) {
        const double u = input_at(i), stiffness[2] = {u, 1}, mass[2] = {1, u};
        stiff.set("u", u);
        heavy.set("u", u);
        stiff.step();
        heavy.step();
        for (int k = 0; k < 2; ++k) {
            const double w = std::sqrt(stiffness[k] / mass[k]), c = std::cos(0.3 * w), s = std::sin(0.3 * w),
                         from = q[k];
            q[k] = from * c + p[k] * s / (mass[k] * w);
            p[k] = p[k] * c - mass[k] * w * from * s;
        }
    }
    CHECK(std::fabs(stiff.q()[0] - q[0]) < 1e-12);
    CHECK(std::fabs(heavy.q()[0] - q[1]) < 1e-12);
    CHECK(std::fabs(heavy.p()[0] - p[1]) < 1e-12);
}

TEST_CASE("a wall that an input moves past the motion changes the side of its switch at once") {
    const auto f = [](double q, double u) { return -q - (q > u - 1.2 ? 20 * (q - u + 1.2) : 0.0); };
    const double error =
        error_with(stepper_of(scene_of("q'^2/2 - q^2/2 - 10*max(q - u + 1.2, 0)^2", "[method]\npoints = 8", "0.1")), f);
    CHECK(error < 1e-6);  // 4e-8, of the reference, which does not stop at the wall
}

TEST_CASE("a rod is as long as the input says at the end of every step") {
    const std::string text =
        "lagrangian = \"(x'^2 + y'^2)/2 - 9.81*y\"\n[coordinates]\nx = { position = 0.6, velocity = 0 }\n"
        "y = { position = -0.8, velocity = 0 }\n[constraints]\nrod = \"x^2 + y^2 = l^2\"\n";
    lob::Stepper winch = stepper_of(text + "[inputs]\nl = 1\n[run]\nstep = 0.001\nuntil = 1\n");
    // The same with a length that grows evenly.
    std::string even = "time = \"t\"\n" + text + "[run]\nstep = 0.001\nuntil = 1\n";
    even.replace(even.find("= l^2"), 5, "= (1 + t/5)^2");
    even.replace(even.find("position = 0.6, velocity = 0"), 28, "position = 0.6, velocity = 0.12");
    even.replace(even.find("position = -0.8, velocity = 0"), 29, "position = -0.8, velocity = -0.16");
    lob::Stepper grown = stepper_of(even);
    for (int i = 1; i <= 1000; ++i) {
        const double l = 1 + 0.0002 * i;
        winch.set("l", l);
        winch.step();
        grown.step();
        CHECK(std::fabs(std::hypot(winch.q()[0], winch.q()[1]) - l) < 1e-14);
    }
    CHECK(std::fabs(winch.q()[0] - grown.q()[0]) < 2e-4);  // 5e-5, of first order in the step
    CHECK(std::fabs(winch.q()[0] - 0.6) > 0.5);
}

// A pendulum of length 1 whose pivot goes 0.3 (1 - cos 6t): a'' = -g sin a - pivot'' cos a, by Runge and Kutta's
// method.
TEST_CASE("constraints and definitions that move with an input need its speed") {
    const auto pivot = [](double t) { return 0.3 * (1 - std::cos(6 * t)); };
    const auto bend = [](double t, double a) { return -9.81 * std::sin(a) - 10.8 * std::cos(6 * t) * std::cos(a); };
    double a = std::acos(-1.0) / 4, v = 0;
    const double s = 1e-4;
    for (int i = 0; i < 10000; ++i) {
        const double t = i * s, k1 = bend(t, a), k2 = bend(t + s / 2, a + s / 2 * v),
                     k3 = bend(t + s / 2, a + s / 2 * v + s * s / 4 * k1), k4 = bend(t + s, a + s * v + s * s / 2 * k2);
        a += s * v + s * s / 6 * (k1 + k2 + k3);
        v += s / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    const double place = pivot(1) + std::sin(a);
    const std::string
        run = "[inputs]\nu = 0\nw = 0\nt0 = 0\n[run]\nuntil = 1\nstep = ",
        plane =
            "time = \"t\"\nlagrangian = \"(x'^2 + y'^2)/2 - 9.81*y\"\n[coordinates]\n"
            "x = { position = \"sqrt(1/2)\", velocity = 0 }\ny = { position = \"-sqrt(1/2)\", velocity = 0 }\n",
        rod = plane + "[constraints]\nrod = \"(x - u - w*(t - t0))^2 + y^2 = 1\"\n" + run,
        jumps = plane + "[constraints]\nrod = \"(x - u + 0*w*t0)^2 + y^2 = 1\"\n" + run,
        angle =
            "time = \"t\"\nlagrangian = \"(x'^2 + y'^2)/2 - 9.81*y\"\n[coordinates]\n"
            "a = { position = \"pi/4\", velocity = 0 }\n[definitions]\nx = \"u + w*(t - t0) + sin(a)\"\n"
            "y = \"-cos(a)\"\n" +
            run;
    const auto error = [&](const std::string& text, int steps, bool is_angle) {
        const double h = 1.0 / steps;
        lob::Stepper stepper = stepper_of(text + std::to_string(h) + "\n");
        for (int i = 0; i < steps; ++i) {
            const double values[] = {pivot(i * h + (text == jumps ? h : 0)), (pivot(i * h + h) - pivot(i * h)) / h,
                                     i * h};
            stepper.set_inputs(values);
            stepper.step();
        }
        const double q = stepper.q()[0];
        return std::fabs((is_angle ? pivot(1) + std::sin(q) : q) - place);
    };
    for (const bool is_angle : {false, true}) {
        const std::string& text = is_angle ? angle : rod;
        CHECK(error(text, 200, is_angle) < 3e-5);
        CHECK(error(text, 100, is_angle) / error(text, 200, is_angle) == doctest::Approx(4).epsilon(0.05));  // order 2
    }
    CHECK(error(jumps, 200, false) > 0.01);  // whatever the step
    CHECK(error(jumps, 1000, false) > 0.01);
    std::string shifted = angle;
    shifted.replace(shifted.find(" + w*(t - t0)"), 13, "");
    shifted.replace(shifted.find("- 9.81*y"), 8, "- 9.81*y + 0*w*t0");
    const std::string found = lob::Scene::from_text(shifted + "0.01\n", "inputs.toml").check_json();
    CHECK(lobatto::test::contains(found, "u in x': an input jumps between steps"));
    const auto tells = [&](const std::string& text) {
        return lobatto::test::contains(lob::Scene::from_text(text + "0.01\n", "inputs.toml").check_json(),
                                       "jumps between steps");
    };
    CHECK(tells(jumps));
    CHECK(!tells(rod));
    CHECK(!tells(angle));
}

TEST_CASE("an input that is set acts as a parameter does, for which the kernel is prepared anew") {
    const std::string arm = LOBATTO_SOURCE_DIR "/examples/cmake/arm.toml";
    const lob::Scene scene(arm);
    REQUIRE(scene.inputs().size() == 1);
    CHECK(scene.inputs()[0].name == "torque");
    CHECK(scene.inputs()[0].unit == "N m");
    CHECK(scene.parameters().back().name == "torque");
    std::string text = scene.text();
    text.erase(text.find("[inputs]\n"), 9);
    lob::Stepper with_input{lob::compile(scene)}, with_parameter = stepper_of(text);
    for (int i = 0; i < 100; ++i) {
        for (lob::Stepper* stepper : {&with_input, &with_parameter}) {
            stepper->set("torque", -2 * stepper->velocity()[0]);
            stepper->step();
        }
        for (int k = 0; k < 2; ++k) CHECK(std::fabs(with_input.q()[k] - with_parameter.q()[k]) < 1e-13);
    }
    CHECK(with_input.parameter("torque") == doctest::Approx(with_parameter.parameter("torque")).epsilon(1e-10));
    CHECK(with_input.parameter("torque") != 0);
    // Copies go on alike.
    lob::Stepper copy = with_input;
    copy.step();
    with_input.step();
    CHECK(copy.q()[0] == with_input.q()[0]);
}

TEST_CASE("an input that leads nowhere is refused, and the motion goes on with the one before") {
    lob::Stepper stepper = stepper_of(scene_of("q'^2/2 + cos(q) + u*q", "")), same = stepper;
    stepper.step();
    same.step();
    CHECK_THROWS_AS(stepper.set("u", std::numeric_limits<double>::infinity()), lob::InputError);
    CHECK(stepper.parameter("u") == 0.5);
    stepper.step();
    same.step();
    CHECK(stepper.q()[0] == doctest::Approx(same.q()[0]).epsilon(1e-14));
}

TEST_CASE("runs hold the value of the scene, and --set gives them another") {
    const lob::Scene scene = lob::Scene::from_text(scene_of("q'^2/2 - q^2/2 + u*q", "[method]\npoints = 9"));
    lob::RunOptions options;
    options.set = {{"u", "1"}};  // then q = 1 stays
    const lob::Trajectory held = lob::run(scene), other = lob::run(scene, options);
    CHECK(held.q.back() == doctest::Approx(0.5 + 0.5 * std::cos(1.0)).epsilon(1e-13));
    CHECK(other.q.back() == doctest::Approx(1).epsilon(1e-13));
}

TEST_CASE("a state and the inputs that move its walls are taken together") {
    lob::Stepper stepper = stepper_of(
        "lagrangian = \"(1 + hi)*q'^2/2\"\n[coordinates]\nq = { position = 0.5, velocity = 0.25 }\n[inputs]\nlo = 0\n"
        "hi = 1\n[impacts]\nfloor = { when = \"q = lo falling\" }\nceiling = { when = \"q = hi rising\" }\n[run]\n"
        "step = 0.01\nuntil = 1\n");
    const double q = 2.5, p = 1, v = 0.25, inputs[] = {2, 3}, wrong[] = {2, 2.25};
    CHECK_THROWS_AS(stepper.set_inputs(inputs), lob::ComputationError);
    CHECK_THROWS_AS(stepper.start(7, &q, &p), lob::ComputationError);
    CHECK_THROWS_AS(stepper.start(7, &q, &p, wrong), lob::ComputationError);
    CHECK(stepper.t() == 0);
    CHECK(stepper.q()[0] == 0.5);
    CHECK(stepper.parameter("hi") == 1);
    stepper.start(7, &q, &p, inputs);
    CHECK(stepper.t() == 7);
    CHECK(stepper.q()[0] == 2.5);
    CHECK(stepper.velocity()[0] == 0.25);
    CHECK(stepper.parameter("hi") == 3);
    stepper.start(0, &q, &p, inputs);
    stepper.start_from_velocity(0, &q, &v, inputs);
    CHECK(stepper.p()[0] == 1);  // of the mass that the new inputs make
    stepper.step();
    CHECK(stepper.q()[0] == doctest::Approx(2.5025).epsilon(1e-14));
}

TEST_CASE("C sets all inputs at once") {
    const std::string text = scene_of("q'^2/2 - q^2/2 + u*q", "[method]\npoints = 9");
    lobatto_scene* const scene = lobatto_scene_from_text(text.c_str(), "inputs.toml");
    REQUIRE(lobatto_scene_inputs(scene) == 1);
    CHECK(std::string(lobatto_scene_input_name(scene, 0)) == "u");
    CHECK(lobatto_scene_input_name(scene, 1) == nullptr);
    lobatto_integrator* const motion = lobatto_integrator_new(scene, nullptr);
    const double one = 1;
    CHECK(lobatto_integrator_set_inputs(motion, &one) == 0);
    CHECK(lobatto_integrator_set_inputs(motion, nullptr) == 2);
    CHECK(std::string(lobatto_integrator_message(motion)).find("NULL was given") != std::string::npos);
    CHECK(lobatto_integrator_advance(motion, 20) == 0);
    CHECK(lobatto_integrator_q(motion)[0] == doctest::Approx(1).epsilon(1e-13));
    const double q = 2, p = 0, two = 2;
    CHECK(lobatto_integrator_start_with_inputs(motion, 0, &q, &p, &two) == 0);
    CHECK(lobatto_integrator_start_with_inputs(motion, 0, &q, &p, nullptr) == 2);
    CHECK(lobatto_integrator_advance(motion, 20) == 0);
    CHECK(lobatto_integrator_q(motion)[0] == doctest::Approx(2).epsilon(1e-13));
    lobatto_integrator_free(motion);
    lobatto_scene_free(scene);
}

TEST_CASE("C tells of NULL where a number, a name or a place for one is to come") {
    const std::string text = scene_of("q'^2/2 - q^2/2 + u*q", "");
    lobatto_scene* scene = lobatto_scene_from_text(text.c_str(), "inputs.toml");
    lobatto_integrator* integrator = lobatto_integrator_new(scene, nullptr);
    const double one = 1;
    double place;
    size_t count;
    const lobatto_event* events;
    const auto refused = [&](int status, const char* name) {
        CHECK(status == 2);
        CHECK(std::string(lobatto_integrator_message(integrator)) == std::string(name) + ": NULL was given");
    };
    refused(lobatto_integrator_start(integrator, 0, nullptr, &one), "q");
    refused(lobatto_integrator_start(integrator, 0, &one, nullptr), "p");
    refused(lobatto_integrator_start_from_velocity(integrator, 0, &one, nullptr), "velocity");
    refused(lobatto_integrator_set(integrator, nullptr, 1), "parameter");
    refused(lobatto_integrator_parameter(integrator, "u", nullptr), "value");
    refused(lobatto_integrator_velocity(integrator, nullptr), "velocity");
    refused(lobatto_integrator_at(integrator, 0, &place, nullptr), "velocity");
    refused(lobatto_integrator_tangent(integrator, nullptr), "tangent");
    refused(lobatto_integrator_take_events(integrator, nullptr, &count), "events");
    refused(lobatto_integrator_take_events(integrator, &events, nullptr), "count");
    refused(lobatto_integrator_multipliers(integrator, nullptr, &count), "multipliers");
    lobatto_sweep* sweep = lobatto_sweep_run(scene, nullptr, 1, 1, nullptr, nullptr);
    CHECK(lobatto_sweep_status(sweep) == 2);
    CHECK(std::string(lobatto_sweep_message(sweep)) == "names: NULL was given");
    lobatto_sweep_free(sweep);
    CHECK(lobatto_integrator_advance(integrator, 1) == 0);
    lobatto_integrator_free(integrator);
    lobatto_scene_free(scene);
}

TEST_CASE("inputs stand where formulas of the motion are, and errors say where not") {
    const std::string scene = scene_of("q'^2/2 - q^2/2 + u*q", "");
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string text = scene;
        text.replace(text.find(from), from.size(), to);
        return error_of(text);
    };
    CHECK(with("step = 0.05", "step = \"u/10\"") ==
          "inputs.toml:7:9: the input u cannot occur in the step: write it with numbers and parameters");
    CHECK(with("position = 1", "position = \"u\"") ==
          "inputs.toml:3:19: the input u cannot occur in the initial position of q: write it with numbers and "
          "parameters");
    CHECK(with("step = 0.05", "step = \"v/10\"") ==
          "inputs.toml:7:9: unknown name 'v' in the step: only numbers, pi and functions of them may stand here; "
          "formulas of other names stand under [definitions]");
    CHECK(with("u*q", "u'*q") == "inputs.toml:1:32: u is an input and has no velocity; only coordinates have one");
    CHECK(with("+ u*q", "") == "inputs.toml:5:1: input u occurs in no formula; use it or remove it");
    CHECK(with("u = 0.5", "u = { value = 0.5, constant = true }").starts_with("inputs.toml:5:20: unknown key"));
    CHECK(error_of(scene_of("q'^2/2 - q^2/2 + u*q", "[method]\nclock = \"1 + q^2\"")) ==
          "inputs.toml:10:9: a clock knows no inputs, which change the energy between steps; remove the clock, or "
          "declare the inputs under [parameters]");
    CHECK(error_of("lagrangian = \"q'^2/2 + d*q\"\n[definitions]\nd = \"2*u\"\n[coordinates]\nq = { position = \"d\", "
                   "velocity = 0 }\n[inputs]\nu = 0\n[run]\nstep = 1\nuntil = 1\n") ==
          "inputs.toml:5:19: the definition d holds an input, which cannot occur in the initial position of q: write "
          "it with numbers and parameters");
}

TEST_CASE("an event at the end of a step is not lost where an input changes that it does not depend on") {
    // 100 * 4.35 is 434.99999999999994 in double: t = 435 falls into step 101, by rounding alone.
    const std::string head =
                          "lagrangian = \"q'^2/2 - (q - u)^2/2e4\"\ntime = \"t\"\n[coordinates]\n"
                          "q = { position = 1, momentum = 0 }\n[inputs]\nu = 0.5\n[run]\nstep = 4.35\nuntil = 1000\n",
                      watched = "[output]\nevents = [\"t = 435\", \"q = u + 100\", \"t = 400 + 0*u\"]\n";
    for (const char* more : {"", "[method]\npoints = 4\n", "[method]\nfamily = \"splitting\"\nstages = 11\n"}) {
        CAPTURE(more);
        lob::Stepper stepper = stepper_of(head + watched + more);
        int at_435 = 0;
        for (int i = 0; i < 200; ++i) {
            stepper.set("u", i % 2);
            stepper.step();
            for (const lob::EventHit& hit : stepper.take_events()) at_435 += hit.kind == 0;
        }
        CHECK(at_435 == 1);
    }
}

TEST_CASE("an event that an input jumps over is none, and one that begins where it is set is none either") {
    lob::Stepper stepper = stepper_of(
        "lagrangian = \"q'^2/2\"\n[coordinates]\nq = { position = 0, momentum = 1 }\n[inputs]\nu = 0.5\n"
        "[run]\nstep = 0.25\nuntil = 10\n[output]\nevents = [\"q = u\"]\n");
    std::vector<double> times;
    const auto go = [&](double u) {
        stepper.set("u", u);
        stepper.step();
        for (const lob::EventHit& hit : stepper.take_events()) times.push_back(hit.t);
    };
    go(0.1);                                  // q reaches 0.25: met at 0.1
    go(0.9);                                  // jumped over q, which goes to 0.5
    go(0.5);                                  // set where q is, which goes away from it
    go(0.3);                                  // behind it
    go(std::nextafter(stepper.q()[0], 2.0));  // set where q is, to rounding
    go(1.35);                                 // met at 1.35
    REQUIRE(times.size() == 2);
    CHECK(times[0] == doctest::Approx(0.1));
    CHECK(times[1] == doctest::Approx(1.35));
}

TEST_CASE("inputs that are refused lose no event") {
    for (const bool refuses : {false, true}) {
        lob::Stepper stepper(lob::compile(lob::Scene::from_text(
            "lagrangian = \"x'^2/2 + 0*f*x\"\n[coordinates]\nx = { position = 0, velocity = 1 }\n[inputs]\nf = 0.5\n"
            "w = 10\n[impacts]\nwall = { when = \"x = w rising\" }\n[output]\nevents = [\"x = f\"]\n[run]\n"
            "step = 0.25\nuntil = 2\n")));
        stepper.advance(2);  // x = f is zero there, and told by the next step
        const double behind[] = {0.75, 0.1};
        if (refuses) CHECK_THROWS_AS(stepper.set_inputs(behind), lob::Error);
        stepper.advance(2);
        const std::vector<lob::EventHit> hits = stepper.take_events();
        REQUIRE(hits.size() == 1);
        CHECK(hits[0].t == doctest::Approx(0.5));
    }
}

TEST_CASE("an emitted kernel goes on as it was after inputs that it refuses, and a step that it does not take" *
          doctest::test_suite("slow")) {
    const std::string printed = printed_by(
        "ball",
        "lagrangian = \"y'^2/2 - y\"\n[coordinates]\ny = { position = 1, velocity = 0 }\n[inputs]\nf = 0\n"
        "[impacts]\nfloor = { when = \"y = f falling\", restitution = 0.5 }\n[run]\nstep = 0.1\nuntil = 10\n",
        "#include \"ball.hpp\"\n#include <cstdio>\n"
        "using Ball = lobatto::HybridStepper<lobatto::kernels::ball>;\n"
        "int main() {\n"
        "    Ball one, other;\n"
        "    lobatto::kernels::ball::Parameters values;\n"
        "    const double q[] = {1}, p[] = {0};\n"
        "    for (Ball* ball : {&one, &other}) {\n"
        "        if (ball->prepare(values, 0.1) != lobatto::Status::ok) return 1;\n"
        "        if (ball->start(0, q, p) != lobatto::Status::ok) return 2;\n    }\n"
        "    lobatto::Status status = lobatto::Status::ok;\n"
        "    for (int i = 0; status == lobatto::Status::ok && i < 100; ++i) {\n"
        "        values.f = 2;\n"
        "        if (i == 5 && one.set_inputs(values) != lobatto::Status::off_constraints) return 3;\n"
        "        status = one.step();\n"
        "        if (other.step() != status || one.q()[0] != other.q()[0]) return 4;\n    }\n"
        "    std::printf(\"%d %g %d\\n\", int(status), one.time(), int(one.events()));\n}\n");
    CHECK(printed == "12 4.2 0\n");  // sqrt(2) (1 + e)/(1 - e) = 4.24
}

TEST_CASE("an emitted kernel with inputs, a wall and an event takes the steps of the library, to the same bits" *
          doctest::test_suite("slow")) {
    const std::string text = scene_of("q'^2/2 - q^2/2 - 10*max(q - u + 1.2, 0)^2",
                                      "[output]\nevents = [\"q = 0.1\"]\n[method]\npoints = 5\n", "0.1");
    // Inputs that are set begin the iteration anew, also to the same value; the library leaves that out.
    const std::string printed = printed_by(
        "driven", text,
        "#include \"driven.hpp\"\n#include <cstdio>\nint main() {\n"
        "    lobatto::HybridStepper<lobatto::kernels::driven> stepper;\n"
        "    lobatto::kernels::driven::Parameters values;\n"
        "    const double q[] = {1}, p[] = {0};\n"
        "    if (stepper.prepare(values, 0.1) != lobatto::Status::ok) return 1;\n"
        "    if (stepper.start(0, q, p) != lobatto::Status::ok) return 2;\n"
        "    long met = 0;\n"
        "    lobatto::HybridStepper<lobatto::kernels::driven> saved;\n"
        "    const auto go_on = [&](int first) {\n"
        "        for (int i = first; i < 80; ++i) {\n"
        "            values.u = i % 16 < 8 ? 1.5 : 0.75;\n"
        "            if (i % 8 == 0 && stepper.set_inputs(values) != lobatto::Status::ok) return 3;\n"
        "            if (first == 0 && i == 37) saved = stepper;\n"  // within a contact
        "            if (stepper.step() != lobatto::Status::ok) return 4;\n"
        "            if (first == 0) met += stepper.events();\n        }\n        return 0;\n    };\n"
        "    if (const int failed = go_on(0)) return failed;\n"
        "    const double end = stepper.q()[0];\n"
        "    lobatto::HybridStepper<lobatto::kernels::driven> again(saved);\n"
        "    if (again.time() != saved.time() || again.events() != saved.events()) return 7;\n"
        "    stepper = again;\n"
        "    if (const int failed = go_on(37)) return failed;\n"
        "    if (stepper.q()[0] != end) return 8;\n"
        "    double momentum, velocity, H;\n    stepper.momentum(&momentum);\n"
        "    if (stepper.velocity(&velocity) != lobatto::Status::ok) return 5;\n"
        "    if (stepper.energy(&H) != lobatto::Status::ok) return 6;\n"
        "    std::printf(\"%.17g %.17g %ld %.17g %.17g\\n\", stepper.q()[0], momentum, met, velocity, H);\n}\n");
    lob::Stepper stepper = stepper_of(text);
    long met = 0;
    for (int i = 0; i < 80; ++i) {
        stepper.set("u", i % 16 < 8 ? 1.5 : 0.75);
        stepper.step();
        met += static_cast<long>(stepper.take_events().size());
    }
    double q = 0, p = 0, velocity = 0, energy = 0;
    long emitted_met = 0;
    REQUIRE(std::sscanf(printed.c_str(), "%lf %lf %ld %lf %lf", &q, &p, &emitted_met, &velocity, &energy) == 5);
    CHECK(velocity == stepper.velocity()[0]);
    CHECK(energy == stepper.energy());
    CHECK(q == stepper.q()[0]);
    CHECK(p == stepper.p()[0]);
    CHECK(emitted_met == met);
    CHECK(met > 0);
}

TEST_CASE("the derivative of a step by an input is that of the step written by hand, and of the exact motion") {
    // Leapfrog of q'' = -u^2 q, differentiated by hand.
    lob::Stepper leapfrog = stepper_of(scene_of("q'^2/2 - u^2*q^2/2", "[method]\npoints = 2\n", "0.1"));
    leapfrog.step();
    leapfrog.set("u", 1.7);
    const double h = 0.1, u = 1.7, q = leapfrog.q()[0], p = leapfrog.p()[0], q1 = q + h * (p - h / 2 * u * u * q),
                 dq = -h * h * u * q, dp = -h * u * (q + q1) - h / 2 * u * u * dq;
    const std::vector<double> by_u = leapfrog.sensitivity("u");
    CHECK(std::fabs(by_u[0] - dq) < 1e-12);
    CHECK(std::fabs(by_u[1] - dp) < 1e-12);
    CHECK(leapfrog.q()[0] == q);
    CHECK(leapfrog.parameter("u") == 1.7);

    // q'' = -4 q + u, whose step of order 8 is the motion to rounding: what a force that is held does in it.
    const lob::Stepper held = stepper_of(scene_of("q'^2/2 - 2*q^2 + u*q", "[method]\npoints = 6\n"));
    const std::vector<double> force = held.sensitivity("u");
    CHECK(std::fabs(force[0] - (1 - std::cos(2 * 0.05)) / 4) < 1e-13);
    CHECK(std::fabs(force[1] - std::sin(2 * 0.05) / 2) < 1e-12);

    // A mass that is no input; the wall of a ball whose impact an input moves.
    const std::string ball =
        "lagrangian = \"m*q'^2/2 - m*k*q^2/2\"\n[coordinates]\nq = { position = 1, momentum = 3 }\n[parameters]\n"
        "m = 1.5\nk = 2\n[run]\nstep = 0.05\nuntil = 1\n[method]\npoints = 6\n";
    const std::vector<double> by_mass = stepper_of(ball).sensitivity("m");  // q = cos + p/(m w) sin
    const double w = std::sqrt(2.0);
    CHECK(std::fabs(by_mass[0] + 3 / (1.5 * 1.5 * w) * std::sin(w * 0.05)) < 1e-12);
    CHECK(std::fabs(by_mass[1] + w * std::sin(w * 0.05)) < 1e-12);
    // It flies from 1 at rest with the acceleration u = -50, and comes back from the wall at 0.98: q1 = 0.98 +
    // 0.8 (v t - ...) by hand, with t_hit = sqrt(0.04/50).
    lob::Stepper bouncing =
        stepper_of(scene_of("q'^2/2 + u*q", "[impacts]\nfloor = { when = \"q = 0.98 falling\", restitution = 0.8 }\n"));
    bouncing.set("u", -50);
    const auto bounced = [](double a) {  // its momentum after 0.05
        const double hit = std::sqrt(0.04 / a);
        return 0.8 * a * hit - a * (0.05 - hit);
    };
    const double slope = -(bounced(50.001) - bounced(49.999)) / 0.002;
    CHECK(std::fabs(bouncing.sensitivity("u")[1] - slope) < 1e-7);
}

TEST_CASE(
    "derivatives by an input are those beside its value, whatever its size and however formulas go on elsewhere") {
    struct Row {
        std::string force;  // of u
        double u, slope;
    };
    for (const Row& row :
         {Row{"exp(-u^2)", 0.5, -std::exp(-0.25)}, Row{"exp(-((u - 3)/0.1)^2)", 3.05, -10 * std::exp(-0.25)},
          Row{"1/(1 + u^2)", 0.5, -0.64}, Row{"sqrt(u)", 1e-9, 0.5 / std::sqrt(1e-9)},
          Row{"sin(1e6*u)", 0.3, 1e6 * std::cos(3e5)}, Row{"cos(u)", 0, 0}, Row{"1e6*u", 0, 1e6}, Row{"u^3", 0, 0},
          Row{"1e-7*u", 0, 1e-7}, Row{"max(u, 0)", 1e-3, 1}}) {
        CAPTURE(row.force);
        lob::Stepper stepper = stepper_of(scene_of("q'^2/2 + q*" + row.force, "", "0.05"));
        stepper.set("u", row.u);
        const std::vector<double> by_u = stepper.sensitivity("u");  // q1 = 1 + h^2/2 f, p1 = h f
        CHECK(std::fabs(by_u[0] - 0.00125 * row.slope) <= 1e-6 * std::fabs(0.00125 * row.slope) + 1e-12);
        CHECK(std::fabs(by_u[1] - 0.05 * row.slope) <= 1e-8 * std::fabs(0.05 * row.slope) + 1e-13);
    }
}

TEST_CASE("steps with constraints or a clock have derivatives by parameters, where they have none by their start") {
    for (const std::string text :
         {"lagrangian = \"(x'^2 + y'^2)/2 - k*y\"\n[constraints]\nrod = \"x^2 + y^2 = 1\"\n[parameters]\nk = 9.81\n"
          "[coordinates]\nx = { position = 0.6, velocity = 0 }\ny = { position = -0.8, velocity = 0 }\n[run]\nstep = "
          "0.05\nuntil = 1\n",
          "lagrangian = \"(x'^2 + y'^2)/2 + k/sqrt(x^2 + y^2)\"\n[parameters]\nk = 1\n[coordinates]\nx = { position = "
          "1, "
          "velocity = 0 }\ny = { position = 0, velocity = 1.1 }\n[method]\npoints = 7\nclock = \"auto\"\n[run]\nstep = "
          "0.1\nuntil = 2\n"}) {
        lob::Stepper stepper = stepper_of(text);
        const double k = stepper.parameter("k"), d = 1e-4 * k;
        const std::vector<double> derivative = stepper.sensitivity("k");
        lob::Stepper above = stepper, below = stepper;
        above.set("k", k + d);
        below.set("k", k - d);
        above.step();
        below.step();
        for (std::size_t c = 0; c < 2; ++c) {
            CHECK(std::fabs((above.q()[c] - below.q()[c]) / (2 * d) - derivative[c]) < 1e-8);
            CHECK(std::fabs((above.p()[c] - below.p()[c]) / (2 * d) - derivative[2 + c]) < 1e-8);
        }
        CHECK_THROWS_AS(static_cast<void>(stepper.tangent()), lob::InputError);
    }
}

TEST_CASE("where a step has no derivative by an input, that is said") {
    const auto complaint = [](const std::string& more, double u) {
        lob::Stepper stepper = stepper_of(scene_of("q'^2/2 + u*q", more));
        stepper.set("u", u);
        return test::message_of<lob::ComputationError>([&] { static_cast<void>(stepper.sensitivity("u")); });
    };
    // The step ends at a stop.
    CHECK(
        complaint("stop = \"q = 0.99\"\n", -50).starts_with("sensitivity: the step from here has no derivative by u"));
    // With more of the force the motion just reaches a wall, with less it does not.
    const std::string wall = "[impacts]\nfloor = { when = \"q = 0.9375 falling\" }\n";
    CHECK(complaint(wall, -50).starts_with("sensitivity: the step from here has no derivative by u"));
    CHECK(complaint(wall, -40).empty());
    for (const std::string corner : {"max(u, 0)", "abs(u)"}) {
        lob::Stepper pusher = stepper_of(scene_of("q'^2/2 + q*" + corner, ""));
        pusher.set("u", 0);
        CHECK_THROWS_AS(static_cast<void>(pusher.sensitivity("u")), lob::ComputationError);
    }
    CHECK(test::message_of<lob::InputError>([&] {
              static_cast<void>(stepper_of(scene_of("q'^2/2 + u*q", "")).sensitivity("w"));
          }).starts_with("unknown parameter 'w'; declared: u."));
}

TEST_CASE("an input that a control loop brings below the least number is 0, a parameter is refused") {
    lob::Stepper stepper =
        stepper_of(scene_of("q'^2/2 + u*q", "[parameters]\nm = 1\n[output]\nkeep = [\"max(m*q)\"]\n"));
    stepper.set("u", 1e-305);
    CHECK(stepper.parameter("u") == 0);
    CHECK_THROWS_AS(stepper.set("u", std::nan("")), lob::InputError);
    CHECK_THROWS_AS(stepper.set("m", 1e-305), lob::InputError);
}

TEST_CASE("a value that no step can be taken with leaves the one before, and says so") {
    lob::Stepper stepper = stepper_of(scene_of("(2 - u)*q'^2/2 - q^2/2", ""));
    stepper.step();
    const double q = stepper.q()[0];
    const std::string text = test::message_of<lob::ComputationError>([&] { stepper.set("u", 2); });
    CHECK(text.starts_with("the new value is not taken, the one before stays: "));
    CHECK(stepper.parameter("u") == 0.5);
    CHECK(stepper.step());
    CHECK(stepper.q()[0] != q);
}

TEST_CASE("what follows from the coordinates stands beside them, as in a run") {
    const std::string arm =
        "lagrangian = \"-9.81*arm.y\"\n[bodies]\narm = { mass = 1, inertia = 0.1, position = [0.5, 0] }\n[joints]\n"
        "hinge = { type = \"hinge\", bodies = [\"ground\", \"arm\"], point = [0, 0], angle = 0.4 }\n[run]\nstep = "
        "0.01\nuntil = 0.1\n";
    lob::Stepper stepper = stepper_of(arm);
    CHECK(stepper.column_names() == std::vector<std::string>{"arm_x", "arm_y", "arm_angle", "arm_omega"});
    for (int i = 0; i < 10; ++i) stepper.step();
    const lob::Trajectory run = lob::run(lob::Scene::from_text(arm, "inputs.toml"));
    REQUIRE(run.column_names == stepper.column_names());
    const std::vector<double> columns = stepper.columns();
    for (std::size_t k = 0; k < 4; ++k) CHECK(columns[k] == run.columns[10 * 4 + k]);
    CHECK(std::fabs(columns[0] - 0.5 * std::cos(stepper.q()[0])) < 1e-15);
    CHECK(columns[3] == stepper.velocity()[0]);
    // A name of the scene's own stays its own.
    const lob::Stepper named =
        stepper_of("definitions = { arm_x = \"2*arm.x\" }\n" + arm + "[output]\nkeep = [\"max(arm_x)\"]\n");
    CHECK(named.column_names().front() == "arm_x_");
}

TEST_CASE("a motion that rests on a wall ends a loop over its steps") {
    lob::Stepper ball = stepper_of(
        "lagrangian = \"y'^2/2 - 10*y\"\n[coordinates]\ny = { position = 5, velocity = 0 }\n[impacts]\n"
        "floor = { when = \"y = 0 falling\", restitution = 0, rest = 0.01 }\n[run]\nstep = 0.03\nuntil = 2\n");
    int steps = 0;
    while (ball.step()) ++steps;
    CHECK(steps == 33);
    CHECK(std::fabs(ball.t() - 1) < 1e-14);
    CHECK(test::message_of<lob::ComputationError>([&] {
              ball.step();
          }).find("the motion came to rest on 'floor: y = 0 falling', and a step leads nowhere") != std::string::npos);
    CHECK(std::fabs(ball.t() - 1) < 1e-14);
    // In a step of another length too; a start elsewhere moves it again.
    const double up = 5, still = 0;
    ball.start(0, &up, &still);
    CHECK(ball.advance_to(0.985));
    CHECK(!ball.advance_to(1.01));
    CHECK(std::fabs(ball.t() - 1) < 1e-14);
    ball.start(0, &up, &still);
    CHECK(ball.advance_to(0.5));
    CHECK(std::fabs(ball.q()[0] - 3.75) < 1e-13);
}
