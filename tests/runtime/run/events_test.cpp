// SPDX-License-Identifier: GPL-2.0-or-later
// Events of whole runs: of the order of the steps by every method, and none lost near a tangent, beside a place where
// the event's function is not defined, or on the end of a step.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/support.hpp"
#include "tests/trajectory_table.hpp"

using namespace lobatto;

namespace {

struct Motion {
    std::string lagrangian, start, method;
    double step, until;
    std::string more = "";  // tables of the scene
};

// The times of each event of the list, in the order of the motion.
std::vector<std::vector<double>> times_of(const Motion& motion, const std::vector<std::string>& events,
                                          const std::string& option = "--quiet") {
    const test::TemporaryFolder folder;
    std::string list;
    for (const std::string& event : events) list += fmt::format("\"{}\", ", event);
    test::write_text(
        folder / "scene.toml",
        fmt::format("time = \"t\"\nlagrangian = \"{}\"\n[coordinates]\nx = {{ {} }}\n[method]\n{}\n"
                    "[run]\nstep = {}\nuntil = {}\n[output]\nevents = [{}]\n{}",
                    motion.lagrangian, motion.start, motion.method, motion.step, motion.until, list, motion.more));
    const test::Finished done = test::run(
        {LOBATTO_PROGRAM, "run", folder / "scene.toml", "-o", folder / "run.csv", "--beyond-horizon", option});
    INFO(done.err);
    REQUIRE(done.exit_code == 0);
    std::vector<std::vector<double>> times(events.size());
    double before = -1;
    for (const std::vector<double>& row : test::read_trajectory(folder / "run.events.csv").rows) {
        CHECK(row[1] >= before);
        before = row[1];
        const auto event = static_cast<std::size_t>(row[0]) - 1;
        if (event < times.size()) times[event].push_back(row[1]);  // impacts are the last
    }
    return times;
}

// The times until the end at which cos t is the value.
std::vector<double> times_of_cosine(double value, double until) {
    std::vector<double> times;
    for (int k = 0; k < until; ++k)
        for (const int side : {-1, 1}) {
            const double t = 2 * std::numbers::pi * k + side * std::acos(value);
            if (t > 0 && t < until) times.push_back(t);
        }
    return times;
}

}  // namespace

TEST_CASE("events have the order of the steps, on positions and on velocities, by every method" *
          doctest::test_suite("slow")) {
    struct Row {
        std::string method, option;
        int order;
        double step;
    };
    const double quarter = std::comp_ellint_1(std::sin(1.0));
    for (const Row& row : {Row{"points = 3", "--quiet", 4, 0.2}, Row{"points = 4", "--quiet", 6, 0.4},
                           Row{"points = 4", "--general", 6, 0.4}, Row{"points = 6", "--general", 10, 1.2},
                           Row{"family = \"gauss\"\nstages = 2", "--quiet", 4, 0.2},
                           Row{"family = \"gauss\"\nstages = 3", "--general", 6, 0.4},
                           Row{"family = \"splitting\"\nstages = 11", "--quiet", 6, 0.3}}) {
        double errors[2][2]{};
        for (const int halving : {0, 1}) {
            const auto times =
                times_of({"x'^2/2 + cos(x)", "position = 2, velocity = 0", row.method, row.step / (1 + halving), 30},
                         {"x = 0", "x' = 0"}, row.option);
            REQUIRE(times[0].size() >= 6);
            REQUIRE(times[1].size() >= 3);
            errors[0][halving] = std::fabs(times[0].back() - (2 * static_cast<double>(times[0].size()) - 1) * quarter);
            errors[1][halving] = std::fabs(times[1].back() - 2 * static_cast<double>(times[1].size()) * quarter);
        }
        for (const auto& error : errors) {
            INFO(row.method << " " << row.option << ": " << error[0] << ", " << error[1]);
            CHECK(error[0] < 1e-4);
            CHECK(std::log2(error[0] / error[1]) > row.order - 1);
        }
    }
}

TEST_CASE("events within a step are found however near to a tangent, and where their function ends") {
    const std::vector<double> values{0.9, 0.9999, 0.999999999, -0.99999, 0.49, std::exp(-3) - 0.9};
    for (const double step : {0.3, 1.0, 2.5, 3.1}) {
        const double until = step * std::floor(200 / step);
        const auto times = times_of({"x'^2/2 - x^2/2", "position = 1, velocity = 0", "points = 12", step, until},
                                    {"x = 0.9", "x = 0.9999", "x = 0.999999999", "x = -0.99999", "sqrt(0.5 - x) = 0.1",
                                     "log(x + 0.9) = -3", "x = 1.0001", "1/(x - 0.3) = 0"});
        for (std::size_t e = 0; e < values.size(); ++e) {
            const std::vector<double> expected = times_of_cosine(values[e], until);
            INFO("h = " << step << ", event " << e + 1);
            REQUIRE(times[e].size() == expected.size());
            // Near a tangent a rounding of x moves the time by its square root.
            const double bound = 1e-11 / std::sqrt(1 - values[e] * values[e]);
            for (std::size_t i = 0; i < expected.size(); ++i) CHECK(std::fabs(times[e][i] - expected[i]) < bound);
        }
        CHECK(times[6].empty());
        CHECK(times[7].empty());
    }
}

TEST_CASE("a touch of zero is no event, also on the end of a step; a passage there is one") {
    // x = t/2 - 1, exactly, which is 0 at t = 2, 1 at t = 4.
    const auto times = times_of({"x'^2/2", "position = -1, velocity = 0.5", "points = 3", 0.25, 6},
                                {"x^2 = 0", "-x^2 = 0", "x^3 = 0", "sqrt(x^2) = 0 rising", "x = 0 falling",
                                 "x*(x - 1) = 0", "x^2*(x - 1) = 0 rising"});
    CHECK(times[0].empty());
    CHECK(times[1].empty());
    CHECK(times[2] == std::vector<double>{2});
    CHECK(times[3].empty());
    CHECK(times[4].empty());
    CHECK(times[5] == std::vector<double>{2, 4});
    CHECK(times[6] == std::vector<double>{4});
}

// Before, rounding took g across zero and back: of 12 points with h = 2.5 it made 30 events, at times 7e-14 to 7e-8
// apart.
TEST_CASE("a touch of zero is no event where rounding takes the function across" * doctest::test_suite("slow")) {
    for (const char* method : {"points = 12", "family = \"gauss\"\nstages = 6"})
        for (const double step : {0.1, 0.3, 2.5}) {
            const auto times = times_of({"x'^2/2 - x^2/2", "position = 1, velocity = 0", method, step, 20},
                                        {"x^2 = 1", "x = 1", "x = -1", "x'^2 = 1", "x^4 + 1 = 2*x^2", "x^3 = 0"});
            INFO(std::string(method) << ", h = " << step);
            for (std::size_t e = 0; e + 1 < times.size(); ++e) CHECK(times[e].empty());
            CHECK(times.back().size() == 6);
        }
}

TEST_CASE("what is constant along the motion, but for rounding, makes no events") {
    const test::TemporaryFolder folder;
    test::write_text(folder / "circle.toml",
                     "lagrangian = \"(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)\"\n[coordinates]\n"
                     "x = { position = 1, velocity = 0 }\ny = { position = 0, velocity = 1 }\n[method]\npoints = 8\n"
                     "[run]\nstep = 0.1\nuntil = 100\n[output]\n"
                     "events = [\"x*x' + y*y' = 0\", \"x*y' - y*x' = 1\", \"y = 0 rising\"]\n");
    const test::Finished done =
        test::run({LOBATTO_PROGRAM, "run", folder / "circle.toml", "-o", folder / "run.csv", "--quiet"});
    REQUIRE(done.exit_code == 0);
    const auto events = test::read_trajectory(folder / "run.events.csv").rows;
    CHECK(events.size() == 15);
    for (const auto& row : events) CHECK(row[0] == 3);
}

// Whatever the step: events at the place where a step is cut, and touches there.
TEST_CASE("an event where the motion goes through a switch is met once, and a touch there is none") {
    for (const double step : {0.1, 0.25, 0.07, 0.01}) {
        CAPTURE(step);
        const auto crossed =
            times_of({"x'^2/2 - max(x, 0)^2/2", "position = -1, velocity = 1", "", step, 3},
                     {"sin(x) = 0", "x^3 = 0", "x*abs(x) = 0", "x = 0", "x = 0 rising"}, "--unmeasured");
        for (const std::vector<double>& times : crossed) {
            REQUIRE(times.size() == 1);
            CHECK(std::fabs(times[0] - 1) < 1e-12);
        }
        // The velocity turns with the friction, at pi, 2 pi and 3 pi.
        const auto turned = times_of(
            {"x'^2/2 - x^2/2", "position = 3.05, velocity = 0", "", step, 9.6, "[forces]\nx = \"-0.3*sign(x')\"\n"},
            {"x' = 0", "x' = 0 falling"}, "--unmeasured");
        REQUIRE(turned[0].size() == 3);
        for (std::size_t i = 0; i < 3; ++i)
            CHECK(std::fabs(turned[0][i] - static_cast<double>(i + 1) * std::numbers::pi) < 1e-5 * step);
        CHECK(turned[1].size() == 1);
        // A velocity between 0 and 1/2, which it touches where the force jumps.
        const auto touched = times_of({"x'^2/2 + sign(sin(2*pi*t))*x", "position = 0, velocity = 0", "", step, 3.2},
                                      {"x' = 0", "x' = 0.5"}, "--unmeasured");
        CHECK(touched[0].empty());
        CHECK(touched[1].empty());
    }
}

TEST_CASE("an event where a wall is happens at each impact") {
    for (const double step : {0.1, 0.3, 0.25, 0.07, 0.01, 0.125}) {
        CAPTURE(step);
        const auto met =
            times_of({"x'^2/2 - 10*x", "position = 5, velocity = 0", "", step, step * std::ceil(2.6 / step),
                      "[impacts]\nfloor = { when = \"x = 0 falling\", restitution = 0.5 }\n"},
                     {"x = 0", "x = 0 falling"}, "--unmeasured");
        // Falls of 1 s, then there and back in 2/2 s, then in 2/4 s.
        for (const std::vector<double>& times : {met[0], met[1]}) {
            REQUIRE(times.size() == 3);
            CHECK(std::fabs(times[0] - 1) < 1e-12);
            CHECK(std::fabs(times[1] - 2) < 1e-12);
            CHECK(std::fabs(times[2] - 2.5) < 1e-12);
        }
    }
}

TEST_CASE("a change of sign in a jump or through infinity is no event, also where a switch cuts the step") {
    for (const double step : {0.03, 0.1, 0.2, 0.31}) {
        CAPTURE(step);
        const Motion circle{"x'^2/2 - x^2/2", "position = 1, velocity = 0", "points = 6", step, 100};  // the angle is t
        const auto turns = times_of(circle, {"atan2(-x', x) = 1 falling", "atan2(-x', x) = 1 rising"});
        CHECK(turns[0].empty());
        REQUIRE(turns[1].size() == 16);
        for (std::size_t i = 0; i < 16; ++i)
            CHECK(turns[1][i] == doctest::Approx(1 + 2 * std::numbers::pi * static_cast<double>(i)).epsilon(1e-8));
        const auto slopes = times_of(circle, {"-x'/x = 1", "abs(x) = 0.5", "1/x = 0", "sign(x)*atan2(-x', x) = 3"});
        CHECK(slopes[0].size() == 32);  // at pi/4 + k pi
        CHECK(slopes[1].size() == 64);
        CHECK(slopes[2].empty());
        CHECK(slopes[3].size() == 16);  // at -3 + 2 k pi: beyond pi it is pi - ..., which jumps, too
    }
}
