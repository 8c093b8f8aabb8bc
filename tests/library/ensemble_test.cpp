// SPDX-License-Identifier: GPL-2.0-or-later
// Many trajectories that a program takes forward together.
#include <doctest/doctest.h>

#include <lobatto/lobatto.hpp>

#include <cmath>

#include "tests/support.hpp"

namespace {

namespace lob = lobatto::api;

const std::string scenes = LOBATTO_SOURCE_DIR "/scenes/";

template <class Work>
std::string input_error_of(const Work& work) {
    try {
        work();
    } catch (const lob::InputError& error) {
        return error.what();
    }
    return "nothing was thrown";
}

}  // namespace

TEST_CASE("an ensemble is at each of its steps where a sweep to that step ends, and has the sweep's bits") {
    const lob::Scene scene(scenes + "double_pendulum.toml");
    const std::string name = scene.coordinates()[0].name;
    lob::Starts starts;
    starts.count = 21;  // no whole number of lanes
    for (std::size_t i = 0; i < starts.count; ++i) starts.columns[name].push_back(0.1 + 0.05 * static_cast<double>(i));
    lob::Ensemble ensemble(scene, starts);
    REQUIRE(ensemble.count() == 21);
    REQUIRE(ensemble.coordinates() == 2);
    const double* const q = ensemble.q();
    CHECK(q[2 * 20] == starts.columns[name][20]);
    lob::SweepOptions options;
    options.measure = false;
    for (const int steps : {1, 10, 39}) {
        ensemble.advance(steps);
        options.steps = options.steps.value_or(0) + steps;
        const lob::Sweep sweep = lob::sweep(scene, starts, options);
        CAPTURE(steps);
        CHECK(ensemble.t() == doctest::Approx(sweep.t[0]).epsilon(1e-14));
        for (std::size_t k = 0; k < 42; ++k) {
            CHECK(q[k] == sweep.q[k]);
            CHECK(ensemble.p()[k] == sweep.p[k]);
        }
    }
    CHECK(ensemble.status() == std::vector<int>(21, 0));
}

TEST_CASE("a parameter that is set for each trajectory acts from the next step on, as in a stepper") {
    const lob::Scene scene(scenes + "pendulum.toml");
    const lob::Starts starts{3, {{"q", {0.5, 1, 1.5}}}};
    const double omega[] = {5, 6, 7};
    lob::Ensemble ensemble(scene, starts);
    ensemble.advance(7);
    ensemble.set("omega", omega);
    ensemble.advance(5);
    for (std::size_t i = 0; i < 3; ++i) {
        lob::Stepper stepper(lob::compile(scene));
        const double rest = 0;
        stepper.start(0, &starts.columns.at("q")[i], &rest);
        stepper.advance(7);
        stepper.set("omega", omega[i]);
        stepper.advance(5);
        CHECK(ensemble.t() == doctest::Approx(stepper.t()));
        CHECK(ensemble.q()[i] == doctest::Approx(stepper.q()[0]).epsilon(1e-11));
    }
    CHECK(input_error_of([&] { ensemble.set("omga", omega); }) ==
          "unknown parameter 'omga'; declared: m, omega. Did you mean 'omega'?");
    CHECK(input_error_of([&] { ensemble.advance(-1); }) == "advance: -1 is no number of steps");
    const double wrong[] = {9, std::nan(""), 9};
    CHECK(input_error_of([&] { ensemble.set("omega", wrong); }) ==
          "nan is no value of a parameter: it must be 0, or of a size between 1e-300 and 1e300");
    lob::Ensemble balls(lob::Scene(scenes + "bouncing_ball.toml"), {2, {{"y", {1, 2}}}});
    const double bouncy[] = {0.5, -1};
    CHECK(input_error_of([&] { balls.set("e", bouncy); }).find("is not within 0 to 1") != std::string::npos);
    // What was refused has changed nothing: the motion goes on as one that was never asked.
    lob::Ensemble twin(scene, starts);
    twin.advance(7);
    twin.set("omega", omega);
    twin.advance(5);
    for (lob::Ensemble* const one : {&ensemble, &twin}) one->advance(5);
    for (std::size_t i = 0; i < 3; ++i) CHECK(ensemble.q()[i] == twin.q()[i]);
}

TEST_CASE("a trajectory that fails stays where it was, and its neighbours go on") {
    const lob::Scene scene(scenes + "pendulum.toml");
    lob::Settings settings;
    settings.step = "2.9";
    lob::Starts starts{2, {{"q", {2.5, 0}}}};
    lob::Ensemble ensemble(scene, starts, settings);
    ensemble.advance(40);
    REQUIRE(ensemble.status()[0] != 0);
    CHECK(ensemble.status()[1] == 0);
    const double stopped = ensemble.q()[0];
    CHECK(std::isfinite(stopped));
    ensemble.advance(3);
    CHECK(ensemble.q()[0] == stopped);
    CHECK(ensemble.q()[1] == 0);
    CHECK(ensemble.t() == doctest::Approx(43 * 2.9));
}

TEST_CASE("walls are met by each trajectory alone; what an ensemble cannot do is refused") {
    const lob::Scene ball(scenes + "bouncing_ball.toml");
    const std::string height = ball.coordinates()[0].name;
    const lob::Starts starts{2, {{height, {1, 1.5}}}};
    lob::Ensemble ensemble(ball, starts);
    ensemble.advance(50);
    lob::SweepOptions options;
    options.steps = 50;
    options.measure = false;
    const lob::Sweep sweep = lob::sweep(ball, starts, options);
    CHECK(ensemble.q()[0] == sweep.q[0]);
    CHECK(ensemble.q()[1] == sweep.q[1]);
    const lob::Scene pendulum(scenes + "pendulum.toml");
    lob::Settings settings;
    settings.numbers = "quadruple";
    CHECK(input_error_of([&] {
              lob::Ensemble(pendulum, {1, {{"q", {1}}}}, settings);
          }).ends_with("ensembles are computed in double; leave `numbers` out, or take sweep()"));
    CHECK(input_error_of([&] { lob::Ensemble(pendulum, {}); }).find("there are 0 starts") != std::string::npos);
    const lob::Scene kepler(scenes + "kepler.toml");
    const lob::Scene comet = lob::Scene::from_text(
        "lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
        "y = { position = 0, velocity = 1 }\n[method]\nclock = \"auto\"\n[run]\nstep = 0.5\nuntil = 6\n",
        "comet.toml");
    lob::Settings automatic, none;
    automatic.clock = "auto";
    none.clock = "none";
    const std::string end = "; leave it out, or take sweep()", all = "all at one time, but ";
    CHECK(input_error_of([&] {
              lob::Ensemble(kepler, {1, {{"x", {1}}}}, automatic);
          }).ends_with(all + "the settings ask for a clock" + end));
    CHECK(input_error_of([&] {
              lob::Ensemble(comet, {1, {{"x", {1}}}});
          }).ends_with(all + "the scene has a clock" + end));
    none.step = "0.001";
    lob::Ensemble equal(comet, {1, {{"x", {1}}}}, none);
    equal.advance(3);
    CHECK(equal.t() == doctest::Approx(0.003));
}
