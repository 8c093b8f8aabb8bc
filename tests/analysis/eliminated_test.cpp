// SPDX-License-Identifier: GPL-2.0-or-later
// Coordinates that follow from others: they are eliminated, move as with their constraints, and stay visible.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "analysis/columns.hpp"
#include "analysis/kernel/kernel_of.hpp"
#include "analysis/motion.hpp"
#include "analysis/overrides.hpp"
#include "generator/mechanics/start.hpp"
#include "generator/pipeline.hpp"
#include "runtime/run/trajectory.hpp"

using namespace lobatto;

namespace {

Scene follower_scene(const std::string& text, const std::string& output = "") {
    return read_scene(Source("follower.toml", text + (output.empty() ? "" : "[output]\n" + output + "\n")));
}

bool says(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

std::string refusal_of(const std::string& text) {
    try {
        emit(derive(follower_scene(text)));
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

struct Followed {
    TrajectoryResult result;
    std::vector<std::vector<double>> rows, beside;
    std::size_t events = 0;
};

Followed follow(const Scene& scene) {
    const Kernel kernel = kernel_of(emit(derive(scene)), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    TrajectoryRequest request = request_of(scene, steps_of(scene, {}).count, stepper);
    request.formulas = columns_of(scene, request);
    const std::size_t beside = request.columns_beside();
    Followed followed;
    request.sink = [&](const Records& records) {
        for (std::int64_t i = 0; i < records.count; ++i) {
            followed.rows.emplace_back(records.rows + i * records.columns, records.rows + (i + 1) * records.columns);
            const double* const row = records.beside + static_cast<std::size_t>(i) * beside;
            followed.beside.emplace_back(row, row + beside);
        }
    };
    request.events = [&](const EventRecords& records) { followed.events += static_cast<std::size_t>(records.count); };
    followed.result = integrate(kernel, request);
    REQUIRE(followed.result.status == LOBATTO_OK);
    return followed;
}

// A disc that swings on a shaken pivot, drags a mass and is braked by its height.
const std::string swing =
    "time = \"t\"\nlagrangian = \"m*(x'^2 + y'^2)/2 + J*a'^2/2 + z'^2/4 - m*g*y - k*z^2/2\"\n[parameters]\nm = 2\n"
    "J = 0.3\ng = 9.81\nk = 3\nl = 1.5\n[coordinates]\nx = { position = \"l*sin(1)\", velocity = \"0.2*l*cos(1) + "
    "0.3\" }\n"
    "a = { position = 1, velocity = 0.2 }\ny = {}\nz = { unit = \"m\" }\n[constraints]\n"
    "pivot = \"x = l*sin(a) + 0.1*sin(3*t)\"\nheight = \"-l*cos(a) = y\"\ndragged = \"z = x^2 + y\"\n[forces]\n"
    "x = \"-0.1*x'\"\nz = \"0.2*y\"\n";
const std::string swing_run = "[method]\npoints = 8\n[run]\nstep = 0.02\nuntil = 4\n";

}  // namespace

TEST_CASE("a coordinate with an equation is eliminated, and moves as one that its constraint holds") {
    const Scene free = follower_scene(swing + swing_run),
                kept = follower_scene(swing + swing_run, "multipliers = true");
    REQUIRE(free.coordinates.size() == 1);
    CHECK(free.coordinates[0].written == "a");
    CHECK(free.constraints.empty());
    REQUIRE(free.eliminated.size() == 3);
    REQUIRE(kept.coordinates.size() == 4);
    const Followed one = follow(free), other = follow(kept);
    REQUIRE(one.rows.size() == other.rows.size());
    double angle = 0, places = 0;
    for (std::size_t i = 0; i < one.rows.size(); ++i) {
        angle = std::fmax(angle, std::fabs(one.rows[i][1] - other.rows[i][2]));
        // Columns x, x', y, y', z, z'; of the other t, x, a, y, z.
        for (const auto& [column, coordinate] : {std::pair{0, 1}, {2, 3}, {4, 4}})
            places = std::fmax(places, std::fabs(one.beside[i][static_cast<std::size_t>(column)] -
                                                 other.rows[i][static_cast<std::size_t>(coordinate)]));
        // p_x = m x'; p_a of the one is p_a + p_x dx/da + ... of the other, by (dx/da, dy/da, dz/da).
        CHECK(std::fabs(2 * one.beside[i][1] - other.rows[i][5]) < 1e-10);
        const double a = one.rows[i][1], xa = 1.5 * std::cos(a), ya = 1.5 * std::sin(a),
                     za = 2 * one.beside[i][0] * xa + ya,
                     p = other.rows[i][6] + other.rows[i][5] * xa + other.rows[i][7] * ya + other.rows[i][8] * za;
        CHECK(std::fabs(one.rows[i][2] - p) < 1e-10);
    }
    CHECK(angle < 1e-11);
    CHECK(places < 1e-11);
}

TEST_CASE("what is eliminated may stand in walls, events and what is kept, and other methods take the scene") {
    std::string pendulum =
        "lagrangian = \"(x'^2 + y'^2)/2 - y\"\n[coordinates]\nx = {}\ny = {}\nq = { position = 1, velocity = 0.3 }\n"
        "[constraints]\nc_x = \"x = sin(q)\"\nc_y = \"y = -cos(q)\"\n[impacts]\nwall = { when = \"x = -0.4 falling\", "
        "restitution = 0.8 }\n[run]\nstep = 0.05\nuntil = 12\nstop = \"x = 3*y\"\n[output]\nevents = [\"y' = 0\"]\n"
        "[method]\npoints = 8\n";
    const std::string by_hand =
        "lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 1, velocity = 0.3 }\n[impacts]\n"
        "wall = { when = \"sin(q) = -0.4 falling\", restitution = 0.8 }\n[run]\nstep = 0.05\nuntil = 12\n"
        "stop = \"sin(q) = -3*cos(q)\"\n[output]\nevents = [\"sin(q)*q' = 0\"]\n[method]\npoints = 8\n";
    const Followed one = follow(follower_scene(pendulum)), other = follow(follower_scene(by_hand));
    CHECK(one.events > 4);
    CHECK(one.events == other.events);
    CHECK(std::fabs(one.result.q[0] - other.result.q[0]) < 1e-12);
    CHECK(std::fabs(one.result.time - other.result.time) < 1e-12);
    pendulum.replace(pendulum.find("points = 8"), 10, "family = \"gauss\"\nstages = 6");
    CHECK(std::fabs(follow(follower_scene(pendulum)).result.q[0] - other.result.q[0]) < 1e-9);
}

TEST_CASE("starts of eliminated coordinates agree with their equations, or are left out") {
    const std::string
        head =
            "lagrangian = \"(x'^2 + y'^2)/2 - y\"\n[parameters]\nl = 2\n[coordinates]\na = { position = 1, velocity = "
            "0.5 "
            "}\n",
        tail = "[constraints]\ncx = \"x = l*sin(a)\"\ncy = \"y = -l*cos(a)\"\n[run]\nstep = 0.1\nuntil = 1\n";
    CHECK(refusal_of(head + "x = {}\ny = { position = \"-l*cos(1)\", velocity = \"l*sin(1)/2\" }\n" + tail).empty());
    const std::string off = head + "x = { position = 1.7, velocity = 0.5 }\ny = {}\n" + tail;
    CHECK(says(refusal_of(off),
               "9:6: the start does not keep the constraint cx (x = l*sin(a)): the position of x is "
               "1.7, but the other coordinates ask for 1.682941969615793: write that, leave the start "
               "of x out, or add assemble = true to [run]"));
    CHECK(refusal_of(off + "assemble = true\n").empty());
    CHECK(says(refusal_of(head + "x = { position = \"l*sin(1)\", velocity = 0.5 }\ny = {}\n" + tail),
               "the velocity of x is 0.5, but"));
    CHECK(says(refusal_of(head + "x = { position = 1 }\ny = {}\n" + tail), "has no initial velocity or momentum"));
    CHECK(says(refusal_of(head + "x = {}\ny = {}\nz = {}\n" + tail),
               "z has no start: add position = 1 and velocity = 0, or a constraint that tells it, as in \"z = ...\""));
    // So far out that the position is below all doubles.
    for (const char* start : {"{}", "{ position = 0, velocity = 0 }"})
        CHECK(refusal_of(std::string("lagrangian = \"(x'^2 + y'^2)/2 - y\"\n[coordinates]\n"
                                     "x = { position = 0, velocity = 3 }\ny = ") +
                         start + "\n[constraints]\nwire = \"y = exp(-1000*(x - 2)^2)\"\n[run]\nstep = 0.1\nuntil = 1\n")
                  .empty());
    // Also with values that are set after the derivation.
    const auto with_length = [](const std::string& start) {
        Scene scene = follower_scene(
            "lagrangian = \"x'^2/2 + y'^2/2 - x^2/2\"\n[parameters]\nl = 1\n[coordinates]\n"
            "x = { position = 1, velocity = 0 }\ny = " +
            start + "\n[constraints]\nc = \"y = l*x\"\n[run]\nstep = 0.1\nuntil = 1\n");
        apply({{"l=2"}, "", "", std::nullopt}, scene);
        return scene;
    };
    CHECK_NOTHROW(check_values(with_length("{}")));
    CHECK_THROWS_WITH_AS(check_values(with_length("{ position = 1, velocity = 0 }")),
                         doctest::Contains("the position of y is 1, but the other coordinates ask for 2"), InputError);
    // One that stays may be left out too.
    std::string heavy = head;
    heavy.replace(heavy.find(" - y"), 4, " - y + a'^2");
    const Scene kept = follower_scene(heavy + "x = {}\ny = {}\n" + tail, "multipliers = true");
    CHECK(kept.coordinates.size() == 3);
    CHECK(kept.initial_position[1].is_equal(kept.parameters[0].symbol * GiNaC::sin(GiNaC::ex(1))));
}

TEST_CASE("momenta of eliminated coordinates are those of the Lagrangian as it is written") {
    const Scene scene = read_scene(
        Source("kept.toml",
               "lagrangian = \"3*x'^2/2 + a'^2/2\"\n[coordinates]\nx = {}\na = { position = 1, velocity = 0.5 }\n"
               "[constraints]\nc = \"x = a^2\"\n[run]\nstep = 0.1\nuntil = 1\n"
               "[output]\nkeep = [\"max(p_x)\"]\n"));
    REQUIRE(scene.eliminated.size() == 1);
    const Coordinate& a = scene.coordinates[0];
    CHECK((scene.outputs.kept[0].value - 6 * a.position * a.velocity).expand().is_zero());
}

TEST_CASE("where a coordinate with an equation stays is said") {
    const auto reason = [](const std::string& equations, const std::string& more = "") {
        const Scene scene =
            read_scene(Source("kept.toml",
                              "time = \"t\"\nlagrangian = \"(x'^2 + y'^2 + z'^2)/2\"\n[inputs]\nu = 0\n[coordinates]\n"
                              "x = { position = 0, velocity = 0 }\ny = { position = 0, velocity = 0 }\n"
                              "z = { position = 0, velocity = 0 }\n[forces]\nz = \"u\"\n[constraints]\n" +
                                  equations + "[run]\nstep = 0.1\nuntil = 1\n" + more));
        CHECK(scene.eliminated.size() + scene.not_eliminated.size() >= 1);
        return scene.not_eliminated.empty() ? "" : scene.not_eliminated.front();
    };
    CHECK(reason("a = \"x = y*z\"\n") == "");
    CHECK(reason("a = \"x = 0\"\n") == "");
    CHECK(reason("a = \"x = y\"\nb = \"y = z\"\n") == "");
    CHECK(reason("a = \"x = y*x\"\n") == "x: its equation holds it on both sides");
    CHECK(reason("a = \"x = y\"\nb = \"y = x\"\n") == "y: its equation holds it on both sides");
    CHECK(reason("a = \"x = y\"\nb = \"x = z\"\n") == "x: it has several equations");
    CHECK(reason("a = \"x = abs(y)\"\n") == "x: its equation holds abs in the constraint a");
    CHECK(reason("a = \"x = y + u\"\n") == "x: its equation holds an input");
    CHECK(reason("a = \"x = atan2(y, 1)\"\n") == "x: its equation holds atan2");
    CHECK(reason("a = \"x = y\"\n", "[output]\nmultipliers = true\n") == "x: its multiplier is asked for");
    CHECK(reason("a = \"x = y\"\n", "[output]\nkeep = [\"max(p_x)\"]\n") == "");
    CHECK(reason("a = \"x = y\"\n", "[impacts]\nw = { when = \"z = 1 rising\", reset = { \"z'\" = 0 } }\n") ==
          "x: an impact resets coordinates");
}

TEST_CASE("a chain of equations keeps neighbours beside one another" * doctest::test_suite("slow")) {
    // x[9] and x[17] would follow from nine angles each.
    const Scene chain = follower_scene(
        "lagrangian = \"sum(i = 1 .. n, (x[i]'^2 + y[i]'^2 + a[i]'^2/12)/2 - y[i])\"\n[parameters]\nn = { value = 20, "
        "constant = "
        "true }\n[coordinates]\na = { count = \"n\", position = \"i/10\", velocity = 0 }\nx = { count = \"n\" }\n"
        "y = { count = \"n\" }\n[constraints]\nhook_x = \"x[1] = sin(a[1])\"\nhook_y = \"y[1] = -cos(a[1])\"\n"
        "\"across[i]\" = { equation = \"x[i+1] = x[i] + sin(a[i+1])\", count = \"n - 1\" }\n"
        "\"down[i]\" = { equation = \"y[i+1] = y[i] - cos(a[i+1])\", count = \"n - 1\" }\n[run]\nstep = 0.01\n"
        "until = 0.1\n");
    CHECK(chain.eliminated.size() == 36);
    REQUIRE(chain.not_eliminated.size() == 4);
    CHECK(chain.not_eliminated.front() == "x[9]: it follows from more than 8 coordinates");
    const Followed moved = follow(chain);
    CHECK(moved.result.energy_error_largest < 1e-10);
    // Angles without a mass of their own cannot stay behind.
    const Scene light = follower_scene(
        "lagrangian = \"sum(i = 1 .. 9, (x[i]'^2)/2 - x[i])\"\n[coordinates]\na = { count = 9, position = \"i/10\", "
        "velocity = 0 }\nx = { count = 9 }\n[constraints]\nhook_x = \"x[1] = sin(a[1])\"\n"
        "\"across[i]\" = { equation = \"x[i+1] = x[i] + sin(a[i+1])\", count = 8 }\n[run]\nstep = 0.01\nuntil = 0.1\n");
    CHECK(light.eliminated.size() == 9);
}

TEST_CASE("coordinates of bodies are eliminated too") {
    const Scene block = follower_scene(
        "lagrangian = \"-block.x^2/2\"\n[bodies]\nblock = { mass = 2, inertia = 0.5, position = [1, 0.5], velocity = "
        "[0, 0] }\n[constraints]\nrail = \"block.y = 0.5\"\nupright = \"block.angle = 0\"\n[method]\npoints = "
        "6\n[run]\n"
        "step = 0.1\nuntil = 2\n");
    REQUIRE(block.coordinates.size() == 1);
    const Followed moved = follow(block);
    CHECK(std::fabs(moved.result.q[0] - std::cos(2 / std::sqrt(2.0))) < 1e-9);
    // block_y, block_y', block_angle, block_angle', block_omega
    CHECK(moved.beside.back() == std::vector<double>{0.5, 0, 0, 0, 0});
}

TEST_CASE("clocks take scenes whose constraints are all eliminated") {
    const Followed orbit = follow(follower_scene(
        "lagrangian = \"(x'^2 + y'^2)/2 + 1/r\"\n[coordinates]\nr = { position = 1, velocity = 0.1 }\n"
        "f = { position = 0, velocity = 0.8 }\nx = { position = 1, velocity = 0.1 }\ny = {}\n[constraints]\n"
        "across = \"x = r*cos(f)\"\nup = \"y = r*sin(f)\"\n[method]\npoints = 6\nclock = \"2*r^(3/2)\"\n[run]\n"
        "step = 0.05\nuntil = 2\n[output]\nevery = 0.5\n"));
    for (std::size_t i = 0; i < orbit.rows.size(); ++i) {
        const double r = orbit.rows[i][1], f = orbit.rows[i][2], p_r = orbit.rows[i][3], p_f = orbit.rows[i][4];
        CHECK(std::fabs(orbit.beside[i][0] - r * std::cos(f)) < 1e-14);
        CHECK(std::fabs(orbit.beside[i][1] - (p_r * std::cos(f) - p_f / r * std::sin(f))) < 1e-14);  // x' in time
    }
}
