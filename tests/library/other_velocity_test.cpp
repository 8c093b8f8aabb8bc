// SPDX-License-Identifier: GPL-2.0-or-later
// Momenta that belong to several velocities: a start with a velocity that no step would begin with is refused.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <lobatto/lobatto.hpp>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/support.hpp"

namespace {

namespace lob = lobatto::api;

lob::Scene scene_of(const std::string& lagrangian, const std::string& start, double step = 0.02) {
    return lob::Scene::from_text(
        fmt::format("lagrangian = \"{}\"\n[coordinates]\n{}\n[run]\nstep = {}\nuntil = 1\n", lagrangian, start, step),
        "velocity.toml");
}

std::string start_at(double x, const std::string& velocity) {
    return fmt::format("x = {{ position = {}, velocity = {} }}", x, velocity);
}

std::string refusal_of(const std::function<void()>& action) {
    return lobatto::test::message_of<lob::ComputationError>(action);
}

}  // namespace

TEST_CASE("a start whose momentum belongs to another velocity, too, is refused with both") {
    // p = x' - x'^3/6 is 2/3 for x' = 2 and for sqrt(3) - 1; x'^3/3 has the momentum of -x'; x'^4/4 - x'^2/2 that of 0.
    struct Start {
        const char *lagrangian, *velocity, *says;
    };
    for (const Start& start : {Start{"x'^2/2 - x'^4/24 - x^2/2", "2", "would begin with (0.732051) instead of (2)"},
                               Start{"x'^3/3 - x", "-2", "would begin with (2) instead of (-2)"},
                               Start{"x'^4/4 - x'^2/2 - x^2/2", "1", "would begin with (0) instead of (1)"},
                               Start{"1e-40*(x'^4/4 - x'^2/2 - x^2/2)", "1", "would begin with (0) instead of (1)"}}) {
        CAPTURE(start.lagrangian);
        const lob::Scene scene = scene_of(start.lagrangian, start_at(0, start.velocity));
        CHECK(lobatto::test::contains(refusal_of([&] { lob::run(scene); }), start.says));
        CHECK(lobatto::test::contains(refusal_of([&] { lob::verify(scene); }), start.says));
    }
    const lob::Scene scene = scene_of("x'^2/2 - x'^4/24 - x^2/2", start_at(0, "0.5"));
    lob::Stepper stepper(lob::compile(scene));
    const double x = 0, slow = 0.5, fast = 2;
    CHECK(lobatto::test::contains(refusal_of([&] { stepper.start_from_velocity(0, &x, &fast); }), "(0.732051)"));
    stepper.start_from_velocity(0, &x, &slow);
    CHECK(stepper.advance(10));
}

TEST_CASE("in sweeps and ensembles such a start ends alone") {
    for (const char* numbers : {"double", "", "float", "double-double"}) {
        CAPTURE(numbers);
        lob::SweepOptions options;
        options.numbers = numbers;
        options.measure = false;
        if (options.numbers == "double") options.keep = {"max(x)"};  // lanes that are refilled
        lob::Starts starts;
        starts.columns["x'"] = {0.5, 1, 1.5, 2, 3};
        starts.count = 5;
        const lob::Scene scene = scene_of("x'^2/2 - x'^4/24 - x^2/2", start_at(0, "0.5"));
        CHECK(lob::sweep(scene, starts, options).status == std::vector<int>{0, 0, 4, 4, 0});
        if (options.numbers != "double") continue;
        lob::Ensemble ensemble(scene, starts);
        ensemble.advance(1);
        CHECK(ensemble.status() == std::vector<int>{0, 0, 4, 4, 0});
    }
}

TEST_CASE("velocities that their momenta determine are kept, however badly") {
    struct Start {
        const char *lagrangian, *coordinates;
    };
    const std::string fast = start_at(0, "0.999999"), faster = start_at(0, "0.9999999999"), slow = start_at(0, "1e-6"),
                      at_rest = start_at(0.5, "0");
    for (const Start& start :
         {Start{"-sqrt(1 - x'^2) - x^2/2", fast.c_str()}, Start{"-sqrt(1 - x'^2) - x^2/2", faster.c_str()},
          Start{"x'^4/4 - x^2/2", slow.c_str()}, Start{"exp(x'^2) + 3e8*x*x' - x^2/2", at_rest.c_str()},
          Start{"-sqrt(1 - x'^2 - y'^2) + 5*x*y' - y^2",
                "x = { position = 2, velocity = 0.6 }\ny = { position = 1, velocity = 0 }"},
          Start{"1e-31*(r'^2 + r^2*f'^2)/2 + 1e20*(u'^2 + u^2*w'^2)/2",
                "r = { position = 1e-10, velocity = 0 }\nf = { position = 0, velocity = 1e-16 }\n"
                "u = { position = 1e10, velocity = 1 }\nw = { position = 0, velocity = 1 }"}}) {
        CAPTURE(start.lagrangian);
        CHECK_NOTHROW(lob::Stepper(lob::compile(scene_of(start.lagrangian, start.coordinates, 1e-4))));
    }
}

// From the momentum the kernel finds a velocity within 1e-8 of 1; H is its sqrt(1 + p^2).
TEST_CASE("near the speed of light the velocity of a momentum is found to its last digits") {
    for (const double p : {100.0, 7071.0678, 22360.679}) {
        const lob::Scene scene =
            scene_of("-sqrt(1 - x'^2) - x^2/2", fmt::format("x = {{ position = 0, momentum = {} }}", p), 1e-9);
        lob::Stepper stepper(lob::compile(scene));
        CHECK(stepper.energy() == doctest::Approx(std::sqrt(1 + p * p)).epsilon(1e-6));
    }
}
