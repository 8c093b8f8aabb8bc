// SPDX-License-Identifier: GPL-2.0-or-later
// What errors are measured by: the amplitude of each coordinate, in whatever unit, and what is no motion but rounding.
#include <cmath>
#include <string>
#include <vector>

#include "tests/analysis/measured_scene.hpp"

using namespace lobatto;
using test::absolute_error, test::MeasuredScene, test::timed_scene;

namespace {

const std::string four = "points = 4";

}  // namespace

TEST_CASE("the unit of a coordinate changes nothing: each is measured by its own amplitude") {
    const std::string lagrangian = "a'^2/2 - a^2/2*1e-4 + b'^2/2 + 25*cos(b)";
    const MeasuredScene without(timed_scene(
        lagrangian, "a = { position = 1e6, velocity = 0 }\nb = { position = 1, velocity = 0 }", four, 0.2, 100)),
        with(timed_scene(lagrangian,
                         "a = { position = 1e6, velocity = 0, unit = \"m\" }\nb = { position = 1, velocity = 0, unit = "
                         "\"rad\" }",
                         four, 0.2, 100));
    const test::Finished plain = without.run(), united = with.run();
    CHECK(absolute_error(plain.out) == absolute_error(united.out));
    CHECK(plain.out.find(" in b)") != std::string::npos);
    CHECK(absolute_error(plain.out) > 1e-5);
}

// The companion goes on beyond the stop, where the motion grows without end.
TEST_CASE("what a motion would do beyond its stop is no part of its amplitude") {
    const MeasuredScene place(timed_scene("x'^2/2 + x^2/2 + 0.001*x^3", "x = { position = 0.1, velocity = 0.1 }",
                                          "points = 2", 0.3, 9.6, "stop = \"x = 10\"\n"));
    const auto relative = [](const std::string& table) {
        return std::strtod(table.c_str() + table.find("measured error") + 14, nullptr);
    };
    const std::string late = place.run().out, soon = place.run({"--until", "5"}).out;
    CHECK(relative(late) > 0.01);
    CHECK(relative(late) == doctest::Approx(relative(soon)).epsilon(0.1));
}

TEST_CASE("a small motion far from 0 is measured by its own amplitude, in numbers of every kind") {
    // 2,000 roundings of the place: the error of the step is a third of the amplitude, or all of it.
    const MeasuredScene place(
        "lagrangian = \"x'^2/2 - (x - 4000)^2/2\"\n[coordinates]\n"
        "x = { position = \"4000 + 1e-9\", velocity = 0 }\n[method]\npoints = 2\n"
        "[run]\nstep = 0.3\nuntil = 90\n");
    for (const std::vector<std::string>& options :
         {std::vector<std::string>{}, {"--numbers", "quadruple"}, {"--companion", "double-double"}}) {
        const test::Finished done = place.run(options);
        INFO(done.out << done.err);
        CHECK(absolute_error(done.out) == doctest::Approx(3.4e-10).epsilon(0.1));
        CHECK(test::contains(done.err, "warning: the error is 0.3"));
    }
    CHECK(place.run({"--step", "0.9"}).exit_code == 3);
}

TEST_CASE("a coordinate in a far larger unit is lost where it is lost in any other") {
    // y in units of 1/U: h omega = 2 is far too long a step for it, from the beginning.
    const MeasuredScene place(
        "lagrangian = \"x'^2/2 - x^2/2 - x^4/4 + U^2*(y'^2/2 - 200*y^2) - U^4*y^4/4\"\n[coordinates]\n"
        "x = { position = 1, velocity = 0 }\ny = { position = \"1/U\", velocity = 0 }\n"
        "[parameters]\nU = 1\n[method]\npoints = 3\n[run]\nstep = 0.1\nuntil = 100\n");
    for (const char* unit : {"U=1", "U=1e11", "U=1e-11"}) {
        const test::Finished done = place.run({"--set", unit});
        INFO(done.out << done.err);
        CHECK(done.exit_code == 3);
        CHECK(test::contains(done.out, "as large as the motion itself from t = "));
    }
    // A start of 1e-13 is meant, also where nothing else tells its unit.
    const MeasuredScene tiny(
        "lagrangian = \"x'^2/2 - x^2/2 + y'^2/2 - 225*y^2/2\"\n[coordinates]\n"
        "x = { position = 1, velocity = 0 }\ny = { position = 1e-13, velocity = 0 }\n"
        "[method]\npoints = 2\n[run]\nstep = 0.1\nuntil = 20\n");
    CHECK(tiny.run().exit_code == 3);
    // What rounding alone moves is none, however heavy.
    const MeasuredScene heavy(
        "lagrangian = \"x'^2/2 - x^2/2 + M*(y'^2/2 - y*(0.3*cos(x)^2 + 0.3*sin(x)^2 - 0.3))\"\n"
        "[coordinates]\nx = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 0 }\n"
        "[parameters]\nM = 1\n[method]\npoints = 5\n[run]\nstep = 0.1\nuntil = 100\n");
    for (const char* mass : {"M=1", "M=1e24", "M=1e-24"}) CHECK(heavy.run({"--set", mass}).exit_code == 0);
}
