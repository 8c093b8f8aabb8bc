// SPDX-License-Identifier: GPL-2.0-or-later
// Lagrangians that jump at a place: refraction and reflection, against Snell's law and geometry (D67).
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "generator/check/check.hpp"
#include "generator/pipeline.hpp"
#include "generator/programs/programs.hpp"
#include "runtime/run/trajectory.hpp"
#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;

namespace {

Scene scene_of(const std::string& lagrangian, const std::string& coordinates, double until,
               const std::string& rest = "", double step = 0.07) {
    return read_scene(Source("refraction.toml", "lagrangian = \"" + lagrangian + "\"\ntime = \"t\"\n[coordinates]\n" +
                                                    coordinates + rest +
                                                    fmt::format("[run]\nstep = {}\nuntil = {}\n", step, until)));
}

TrajectoryResult run(const Scene& scene) {
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    const TrajectoryResult result = integrate(kernel, request_of(scene, steps_of(scene, {}).count, stepper));
    CHECK(result.status == LOBATTO_OK);
    return result;
}

const std::string in_plane =
    "x = {{ position = {:.17g}, velocity = {:.17g} }}\ny = {{ position = {:.17g}, velocity = {:.17g} }}\n";

struct Particle {
    double x, y, vx, vy;

    void move(double time) { x += vx * time, y += vy * time; }
    // On a circle about the origin whose inside has the potential `rise` above here: whether it enters.
    bool meet_circle(double rise) {
        const double r = std::hypot(x, y), normal = (vx * x + vy * y) / r, left = normal * normal - 2 * rise;
        const double after = left > 0 ? std::copysign(std::sqrt(left), normal) : -normal;
        vx += (after - normal) * x / r;
        vy += (after - normal) * y / r;
        return left > 0;
    }
};

// From (-3, b) with speed 1 at a disc of radius 1 and potential U.
Particle after_disc(double b, double U, double time) {
    Particle one{-3, b, 1, 0};
    const double first = 3 - std::sqrt(1 - b * b);
    one.move(first);
    if (!one.meet_circle(U)) {
        one.move(time - first);
        return one;
    }
    const double second = -2 * (one.x * one.vx + one.y * one.vy) / (one.vx * one.vx + one.vy * one.vy);
    one.move(second);
    one.meet_circle(-U);
    one.move(time - first - second);
    return one;
}

}  // namespace

TEST_CASE("a particle is refracted and thrown back by a disc, to rounding, by every method") {
    for (const std::string method :
         {"", "[method]\npoints = 2\n", "[method]\nfamily = \"gauss\"\nstages = 3\n",
          "[method]\nfamily = \"splitting\"\nstages = 11\n", "[method]\narithmetic = \"clean\"\n"})
        for (const double U : {0.2, 0.7, -3.0})
            for (const double b : {0.0, 0.5, -0.77}) {
                CAPTURE(method);
                CAPTURE(U);
                CAPTURE(b);
                const TrajectoryResult result =
                    run(scene_of(fmt::format("(x'^2 + y'^2)/2 - if(x^2 + y^2 < 1, {}, 0)", U),
                                 fmt::format(fmt::runtime(in_plane), -3.0, 1.0, b, 0.0), 6.3, method));
                const Particle exact = after_disc(b, U, result.time);
                CHECK(std::fabs(result.q[0] - exact.x) < 1e-12);
                CHECK(std::fabs(result.q[1] - exact.y) < 1e-12);
                CHECK(std::fabs(result.p[0] - exact.vx) < 1e-12);
            }
}

TEST_CASE("a ray in two layers keeps n cos of its angle to them, or is reflected as a whole") {
    for (const double angle : {0.5, 0.7, 1.0, 1.4})
        for (const auto& [n1, n2] : {std::pair{1.5, 1.0}, {1.0, 1.5}, {1.0, 3.0}}) {
            CAPTURE(angle);
            const TrajectoryResult ray = run(
                scene_of(fmt::format("if(y > 0, {}, {})*sqrt(1 + y'^2)", n2, n1),
                         fmt::format("y = {{ position = -1, velocity = {:.17g} }}\n", std::tan(angle)), 6, "", 0.05));
            const double met = 1 / std::tan(angle), cosine = n1 * std::cos(angle) / n2,
                         slope = cosine < 1 ? std::tan(std::acos(cosine)) : -std::tan(angle);
            CHECK(std::fabs(ray.q[0] - (6 - met) * slope) < 1e-12 * (1 + std::fabs(6 * slope)));
        }
}

TEST_CASE("refraction of moving steps, of fast particles, with constraints and with coupled masses") {
    // A step that moves with the speed w: in its frame as one at rest.
    for (const auto& [U, w] : {std::pair{0.1, 0.3}, {2.0, 0.3}, {-0.1, -0.4}, {0.6, -0.4}}) {
        const TrajectoryResult result = run(scene_of(fmt::format("x'^2/2 - if(x > 1 + {}*t, {}, 0)", w, U),
                                                     "x = { position = 0, velocity = 1 }\n", 4, "", 0.1));
        const double u = 1 - w, left = u * u - 2 * U, met = 1 / u, after = w + (left > 0 ? std::sqrt(left) : -u);
        CHECK(std::fabs(result.q[0] - (met + after * (4 - met))) < 1e-13);
    }
    const TrajectoryResult fast = run(scene_of("-sqrt(1 - x'^2 - y'^2) - if(x > 1, 0.05, 0)",
                                               fmt::format(fmt::runtime(in_plane), 0.0, 0.6, 0.0, 0.3), 5, "", 0.1));
    const double gamma = 1 / std::sqrt(1 - 0.45), energy = gamma - 0.05, along = 0.3 * gamma,
                 across = std::sqrt(energy * energy - 1 - along * along);
    CHECK(std::fabs(fast.p[0] - across) < 1e-14);
    CHECK(std::fabs(fast.p[1] - along) < 1e-14);
    CHECK(std::fabs(fast.q[0] - (1 + across / energy * (5 - 1 / 0.6))) < 1e-13);
    // On a ring, whose upper part is higher: the time to pi from 0 at two speeds.
    const TrajectoryResult ring =
        run(scene_of("(x'^2 + y'^2)/2 - if(y > 0.2, 0.3, 0)", fmt::format(fmt::runtime(in_plane), 1.0, 0.0, 0.0, 1.0),
                     5, "[constraints]\nrod = \"x^2 + y^2 = 1\"\n", 0.05));
    const double low = std::asin(0.2), slow = std::sqrt(0.4);
    CHECK(std::fabs(ring.q[0] - std::cos(std::acos(-1.0) - low + 5 - low - (std::acos(-1.0) - 2 * low) / slow)) <
          1e-11);
    // dV of a coupled pair: its energy stays, and so does the momentum along the step.
    const Scene coupled = scene_of("(x'^2 + y'^2)/2 + 0.4*x'*y' - if(x + 2*y > 1, 0.2, 0)",
                                   fmt::format(fmt::runtime(in_plane), 0.0, 1.0, 0.0, 0.2), 3, "", 0.05);
    const TrajectoryResult pair = run(coupled);
    const double p = 1 + 0.4 * 0.2, q = 0.2 + 0.4;
    CHECK(std::fabs(2 * pair.p[0] - pair.p[1] - (2 * p - q)) < 1e-14);
    const auto kinetic = [](double a, double b) { return (a * a + b * b - 0.8 * a * b) / (2 * (1 - 0.16)); };
    CHECK(std::fabs(kinetic(pair.p[0], pair.p[1]) + 0.2 - kinetic(p, q)) < 1e-14);
    const Derivation derivation = derive(coupled);
    bool is_checked = false;
    for (const Check& check : check_programs(derivation, optimised_programs(derivation).programs)) {
        CHECK_MESSAGE(check.holds, check.claim);
        is_checked = is_checked || check.claim == "emitted refractions";
    }
    CHECK(is_checked);
}

TEST_CASE("switches that vanish along one surface change together: no layer between them throws the motion back") {
    const auto end = [](const std::string& lagrangian, const std::string& start, double until) {
        return run(scene_of(lagrangian, start, until, "", 0.1)).q[0];
    };
    const std::string fast = "x = { position = -1, velocity = 2 }\n";
    CHECK(std::fabs(end("x'^2/2 - if(x > 0, 10, 0) - if(x < 0, 10, 0)", fast, 2) - 3) < 1e-13);
    CHECK(std::fabs(end("x'^2/2 - 5*sign(x) + 5*sign(x^3 + x)", fast, 2) - 3) < 1e-13);
    const std::string enters = "x = { position = -1, velocity = \"sqrt(6)\" }\n";
    CHECK(std::fabs(end("x'^2/2 - if(x > 1, 2.2, 0) - if(x > 0, if(x < 1, 2, 0), 0)", enters, 2) -
                    end("x'^2/2 - if(x > 0, if(x < 1, 2, 2.2), 0)", enters, 2)) < 1e-13);
    // A surface that is only touched there: x^2 = 0 and x = 0.
    CHECK(std::fabs(end("x'^2/2 - if(x > 0, 1, 0) - if(x^2 > 0, 3, 0)", fast, 2) - 1.4142135623730951 * 1.5) < 1e-12);
    const std::string ray = "y = { position = 0.5, velocity = 0.7 }\n";
    CHECK(std::fabs(
              end("(1 + if(y > 0, if(y < 1, 0.5, 0), 0) + if(y > 1, if(y < 2, 0.3, 0), 0))*sqrt(1 + y'^2)", ray, 1.5) -
              end("if(y > 1, if(y > 2, 1, 1.3), if(y > 0, 1.5, 1))*sqrt(1 + y'^2)", ray, 1.5)) < 1e-13);
}

TEST_CASE("a start elsewhere is on the sides of all switches there, of those within others too") {
    const auto slab = [](double x, double velocity) {
        return run(scene_of("x'^2/2 - if(abs(x) < 1, -0.1, 0)",
                            fmt::format("x = {{ position = {}, velocity = {} }}\n", x, velocity), 1.95, "", 0.13));
    };
    const Kernel kernel = kernel_of(emit(derive(scene_of("x'^2/2 - if(abs(x) < 1, -0.1, 0)",
                                                         "x = { position = -2, velocity = 1 }\n", 1.95, "", 0.13))),
                                    Precision::double_);
    for (const auto& [x, velocity] : {std::pair{3.0, 1.0}, {2.0, -1.0}, {0.5, 1.0}, {-3.0, -1.0}}) {
        const Scene scene =
            scene_of("x'^2/2 - if(abs(x) < 1, -0.1, 0)", "x = { position = -2, velocity = 1 }\n", 1.95, "", 0.13);
        LoadedStepper<double> stepper(kernel);
        TrajectoryRequest request = request_of(scene, steps_of(scene, {}).count, stepper);
        request.q = {x};
        request.p = {velocity};
        const TrajectoryResult result = integrate(kernel, request), exact = slab(x, velocity);
        CHECK(result.q[0] == doctest::Approx(exact.q[0]).epsilon(1e-13));
        CHECK(result.p[0] == doctest::Approx(exact.p[0]).epsilon(1e-13));
    }
}

TEST_CASE("a state kept right at a step, or at a stop there, is the one before it, and so is its energy") {
    for (const std::string start : {"-0.7", "-1", "-0.9", "-0.35"}) {
        const test::TemporaryFolder folder;
        test::write_text(folder / "step.toml",
                         "lagrangian = \"x'^2/2 - if(x > 0, 5, 0)\"\n[coordinates]\nx = { position = " + start +
                             ", velocity = 1 }\n[run]\nstep = 0.05\nuntil = 3\n");
        const test::Finished done = test::run({LOBATTO_PROGRAM, "run", folder / "step.toml", "-o", folder / "a.csv"});
        CHECK_MESSAGE(done.exit_code == 0, done.err);
        for (const auto& row : test::read_trajectory(folder / "a.csv").rows) CHECK(std::fabs(row[3] - 0.5) < 1e-13);
    }
    const test::TemporaryFolder folder;
    test::write_text(folder / "start.toml",
                     "lagrangian = \"x'^2/2 - if(x > 0, 5, 0)\"\n[coordinates]\n"
                     "x = { position = 0, velocity = 1 }\n[run]\nstep = 0.05\nuntil = 1\n");
    const test::Finished begun = test::run({LOBATTO_PROGRAM, "run", folder / "start.toml", "-o", folder / "a.csv"});
    CHECK(begun.exit_code == 0);
    CHECK(begun.err.find("the start lies right where the Lagrangian jumps, at if in the Lagrangian (line 1") !=
          std::string::npos);
    CHECK(std::fabs(test::read_trajectory(folder / "a.csv").rows.back()[1] + 1) < 1e-13);  // thrown back
    test::write_text(folder / "stop.toml",
                     "lagrangian = \"x'^2/2 - if(x > 1, 0.3, 0)\"\n[coordinates]\nx = { position = 0, velocity = 1 }\n"
                     "[run]\nstep = 0.13\nuntil = 3\nstop = \"x = 1\"\n");
    const test::Finished done = test::run({LOBATTO_PROGRAM, "run", folder / "stop.toml", "-o", folder / "a.csv"});
    CHECK_MESSAGE(done.exit_code == 0, done.err);
    const std::vector<double> last = test::read_trajectory(folder / "a.csv").rows.back();
    CHECK(std::fabs(last[2] - 1) < 1e-13);
    CHECK(std::fabs(last[3] - 0.5) < 1e-13);
}

TEST_CASE("pieces that meet change no momentum, whatever rounding says of their values") {
    const std::string start = "x = { position = 1, velocity = 0 }\n";
    const TrajectoryResult by_if = run(scene_of("x'^2/2 - if(x > 0.3, x^2, 4*x^2 - 0.27) + 1e6", start, 40, "", 0.05)),
                           by_max = run(
                               scene_of("x'^2/2 - 4*x^2 + 0.27 + 3*max(x - 0.3, 0)*(x + 0.3)", start, 40, "", 0.05));
    CHECK(std::fabs(by_if.q[0] - by_max.q[0]) < 1e-11);
    CHECK(std::fabs(by_if.p[0] - by_max.p[0]) < 1e-11);
}
