// SPDX-License-Identifier: GPL-2.0-or-later
// Contacts that begin and end within a step: run and companion would take them in the same piece of a step.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <lobatto/lobatto.hpp>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "tests/analysis/measured_scene.hpp"
#include "tests/support.hpp"

using namespace lobatto;
using test::absolute_error, test::MeasuredScene;

namespace {

constexpr double g = 9.81;

// A ball that falls from 1 onto a floor with the potential k y^2/2 below 0.
std::string on_springs(double k, double step, double until, const std::string& method = "points = 4") {
    return fmt::format(
        "lagrangian = \"y'^2/2 - 9.81*y - k/2*max(-y, 0)^2\"\n[coordinates]\ny = {{ position = 1, velocity = 0 }}\n"
        "[parameters]\nk = {}\n[method]\n{}\n[run]\nstep = {}\nuntil = {}\n",
        k, method, step, until);
}

// Where it is: y = g/k (cos w s - 1) - v/w sin w s in a contact that begins with the velocity -v at s = 0.
double true_place(double k, double time) {
    const double v = std::sqrt(2 * g), w = std::sqrt(k), flight = 2 * v / g,
                 contact = 2 * (std::acos(-1.0) - std::atan(v * w / g)) / w;
    const double s = std::fmod(time - flight / 2, contact + flight);
    if (s < 0) return 1 - g * time * time / 2;
    if (s < contact) return g / k * (std::cos(w * s) - 1) - v / w * std::sin(w * s);
    return v * (s - contact) - g * (s - contact) * (s - contact) / 2;
}

}  // namespace

TEST_CASE("a ball between walls that is at one place after each step has an amplitude") {
    for (const char* step : {"0.004", "0.002", "0.0199"}) {
        INFO(step);
        const test::MeasuredScene scene(
            fmt::format("lagrangian = \"x'^2/2\"\n[coordinates]\nx = {{ position = 0.003, velocity = 10 }}\n[impacts]\n"
                        "left = {{ when = \"x = 0 falling\" }}\nright = {{ when = \"x = 0.01 rising\" }}\n"
                        "[method]\npoints = 3\n[run]\nstep = {}\nuntil = 0.995\n",
                        step));
        const test::Finished finished = scene.run();
        INFO(finished.err);
        CHECK(finished.exit_code == 0);
        CHECK(test::absolute_error(finished.out) < 1e-12);
    }
}

TEST_CASE("a contact that is shorter than a step is measured, wherever in the steps it lies") {
    struct Case {
        double k, step, until;
    };
    for (const Case& one : {Case{1e4, 0.2, 5}, Case{1e3, 0.5, 5}, Case{4e5, 1.0 / 60, 2}, Case{1e5, 0.05, 3},
                            Case{1e4, 0.0301, 2}, Case{1e7, 0.002, 1}, Case{1e4, 0.5, 0.5}}) {
        CAPTURE(one.k);
        CAPTURE(one.step);
        const MeasuredScene scene(on_springs(one.k, one.step, one.until));
        const test::Finished finished = scene.run();
        INFO(finished.err);
        REQUIRE(finished.exit_code == 0);
        const double error = std::fabs(scene.end()[1] - true_place(one.k, one.until)),
                     printed = absolute_error(finished.out);
        CAPTURE(error);
        CHECK(printed > 0.6 * error);
        CHECK(printed < 1.7 * error);
    }
}

TEST_CASE("a contact that begins before a step ends and ends in the next one is measured") {
    // The same ball, with the contact around the end of the step at which steps and halves of them end.
    const double k = 4e4, w = std::sqrt(k), v = std::sqrt(2 * g),
                 middle = v / g + (std::acos(-1.0) - std::atan(v * w / g)) / w, step = middle / 5;
    const MeasuredScene scene(on_springs(k, step, 10 * step));
    const test::Finished finished = scene.run();
    REQUIRE(finished.exit_code == 0);
    const double error = std::fabs(scene.end()[1] - true_place(k, 10 * step)), printed = absolute_error(finished.out);
    CAPTURE(error);
    CHECK(printed > 0.6 * error);
    CHECK(printed < 1.7 * error);
}

TEST_CASE("two impacts within a step do not hide the error of the flight between them") {
    // On a pendulum's circle between two walls that are near to one another, against many times shorter steps.
    const auto text = [](double step) {
        return fmt::format(
            "lagrangian = \"a'^2/2 + 4*cos(3*a)\"\n[coordinates]\na = {{ position = 0.1, velocity = 9 }}\n[impacts]\n"
            "right = {{ when = \"a = 0.4 rising\", restitution = 1 }}\n"
            "left = {{ when = \"a = -0.3 falling\", restitution = 1 }}\n[method]\npoints = 3\n[run]\nstep = {}\n"
            "until = 0.9\n",
            step);
    };
    const MeasuredScene coarse(text(0.18)), fine(text(0.18 / 64));
    const test::Finished finished = coarse.run();
    REQUIRE(finished.exit_code == 0);
    REQUIRE(fine.run().exit_code == 0);
    const double error = std::fabs(coarse.end()[1] - fine.end()[1]), printed = absolute_error(finished.out);
    CAPTURE(error);
    CHECK(printed > 0.8 * error);
    CHECK(printed < 1.3 * error);
}

TEST_CASE("switches that change little do not make the printed error larger, over many of them") {
    const auto text = [](double step) {
        return fmt::format(
            "lagrangian = \"\"\"x'^2/2 + y'^2/2 - x^2/2 - 1.3*y^2/2 - 0.2*max(x - 0.3, 0)^2 - 0.3*max(y - 0.31, 0)^2\n"
            "- 0.1*max(x + y, 0)^2\"\"\"\n[coordinates]\nx = {{ position = 1, velocity = 0 }}\n"
            "y = {{ position = 0.7, velocity = 0.4 }}\n[method]\npoints = 4\n[run]\nstep = {}\nuntil = 9000\n",
            step);
    };
    const MeasuredScene coarse(text(0.3)), fine(text(0.3 / 16));
    const test::Finished finished = coarse.run();
    REQUIRE(finished.exit_code == 0);
    REQUIRE(fine.run({"--unmeasured"}).exit_code == 0);
    const std::vector<double> end = coarse.end(), truth = fine.end();
    const double error = std::fmax(std::fabs(end[1] - truth[1]), std::fabs(end[2] - truth[2])),
                 printed = absolute_error(finished.out);
    CAPTURE(error);
    CHECK(printed > 0.5 * error);
    CHECK(printed < 2 * error);
}

TEST_CASE("where parts of steps cannot start on a wall, whole ones measure the motion") {
    const MeasuredScene box(
        "lagrangian = \"x'^2/2 + y'^2/2\"\n[coordinates]\nx = { position = 1, velocity = -1 }\n"
        "y = { position = 1.000001, velocity = -1 }\n[impacts]\n"
        "a = { when = \"x = 0 falling\", restitution = 1 }\nb = { when = \"y = 0 falling\", restitution = 1 }\n"
        "c = { when = \"x = 2 rising\", restitution = 1 }\nd = { when = \"y = 2 rising\", restitution = 1 }\n"
        "[method]\npoints = 3\n[run]\nstep = 0.07\nuntil = 50\n");
    const test::Finished finished = box.run();
    CHECK_MESSAGE(finished.exit_code == 0, finished.err);
    CHECK(absolute_error(finished.out) < 1e-10);
}

TEST_CASE("in sweeps such a trajectory is measured by a companion of its own") {
    namespace lob = lobatto::api;
    for (const char* numbers : {"", "double-double"}) {
        CAPTURE(numbers);
        lob::SweepOptions options;
        options.numbers = numbers;
        lob::Starts starts;
        starts.columns["k"] = {1e3, 1e4, 2e4, 1e5};
        starts.count = 4;
        const lob::Sweep result =
            lob::sweep(lob::Scene::from_text(on_springs(1, 0.1, 2), "springs.toml"), starts, options);
        for (std::size_t i = 0; i < 4; ++i) {
            CAPTURE(i);
            const double k = starts.columns["k"][i], error = std::fabs(result.q[i] - true_place(k, 2)) / 0.5;
            CAPTURE(error);
            CHECK(result.error[i] > 0.5 * error);
            CHECK(result.error[i] < 2 * error);
        }
        // The end of the run cuts the contact off.
        starts.columns["k"] = {1e3, 2e3, 3e3, 4e3};
        const lob::Sweep cut_off =
            lob::sweep(lob::Scene::from_text(on_springs(1, 0.1, 0.5), "springs.toml"), starts, options);
        for (std::size_t i = 0; i < 4; ++i) {
            CAPTURE(i);
            CHECK(cut_off.error[i] > 0.5 * std::fabs(cut_off.q[i] - true_place(starts.columns["k"][i], 0.5)) / 0.5);
        }
    }
}

// A FODO cell of length 2 has quadrupoles of length 0.4 around s = 0 and 1, and nothing between. Its matrix is that of
// textbooks (E. D. Courant and H. S. Snyder 1958). Here each step is cut, none is whole.
TEST_CASE("the error in a lattice of hard edges is measured over thousands of cells, in steps that fit it or do not") {
    using Matrix = std::array<long double, 4>;
    const auto times = [](const Matrix& a, const Matrix& b) {
        return Matrix{a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2],
                      a[2] * b[1] + a[3] * b[3]};
    };
    const long double w = std::sqrt(3.0L), c = std::cos(w / 5), s = std::sin(w / 5), C = std::cosh(w * 2 / 5),
                      S = std::sinh(w * 2 / 5);
    const Matrix focus{c, s / w, -s * w, c}, drift{1, 0.6L, 0, 1}, defocus{C, S / w, S * w, C};
    Matrix cells = times(focus, times(drift, times(defocus, times(drift, focus))));
    for (int doublings = 0; doublings < 11; ++doublings) cells = times(cells, cells);  // 2048 of them
    for (const double step : {1.0, 2.0, 0.1}) {
        CAPTURE(step);
        const MeasuredScene scene(fmt::format(
            "time = \"s\"\nlagrangian = \"x'^2/2 - K*(if(cos(pi*s) > edge, 1, 0) - if(cos(pi*s) < -edge, 1, "
            "0))*x^2/2\"\n[coordinates]\nx = {{ position = 1, velocity = 0 }}\n[parameters]\nK = 3\nedge = "
            "\"cos(pi/5)\"\n[run]\nstep = {}\nuntil = 4096\n[output]\nevery = {}\n",
            step, std::lround(16 / step)));
        const test::Finished finished = scene.run();
        INFO(finished.err);
        REQUIRE(finished.exit_code == 0);
        const double error = std::fabs(scene.end()[1] - static_cast<double>(cells[0])),
                     printed = absolute_error(finished.out);
        CHECK(printed > error / 2);
        CHECK(printed < error * 2);
    }
}

TEST_CASE("an impact that follows soon after the end of a run is no part of it") {
    // Rods of one mass hand their velocities on: the motion is exact, whatever the steps.
    const test::MeasuredScene rods(
        "lagrangian = \"sum(i=1..n, x[i]'^2/2)\"\n[coordinates]\n"
        "x = { count = \"n\", position = \"i - 0.5 + 0.2*sin(5*i)\", velocity = \"2*sin(3*i*i)\" }\n"
        "[parameters]\nn = { value = 11, constant = true }\n[impacts]\n"
        "\"hit[i]\" = { when = \"x[i+1] - x[i] = 0 falling\", count = \"n-1\" }\n"
        "lo = { when = \"x[1] = 0 falling\" }\nhi = { when = \"x[n] = n rising\" }\n"
        "[method]\npoints = 2\n[run]\nstep = 0.1\nuntil = 5\n");
    for (const char* until : {"5", "13", "17"}) {
        INFO(until);
        const test::Finished finished = rods.run({"--until", until});
        CHECK_MESSAGE(finished.exit_code == 0, finished.err);
        CHECK(absolute_error(finished.out) < 1e-12);
    }
}
