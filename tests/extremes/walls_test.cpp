// SPDX-License-Identifier: GPL-2.0-or-later
// Walls and stops at the edge: 10^5 impacts, impacts that graze or accumulate, several at once, at the start and at the
// end of a step; against closed forms.
#include <numbers>

#include "tests/extremes/extremes.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

using Numbers = std::vector<double>;
constexpr double pi = std::numbers::pi;

// Parameters g, e.
const std::string ball =
    "lagrangian = \"y'^2/2 - g*y\"\n[parameters]\ng = 2\ne = 1\n[coordinates]\ny = { position = 1, velocity = 0 }\n"
    "[impacts]\nfloor = { when = \"y = 0 falling\", restitution = \"e\" }\n";
// Parameter u: where the wall is.
const std::string spring =
    "lagrangian = \"x'^2/2 - x^2/2\"\n[parameters]\nu = 1\n[coordinates]\nx = { position = -1, velocity = 0 }\n"
    "[impacts]\nwall = { when = \"x = u rising\" }\n";

State<double> fall(double e, double y, double v, double h, std::int64_t steps) {
    return travel<double>(kernel_for(ball), {2, e}, {y}, {v}, h, steps);
}

// From x = -1 at rest, x = -cos t until the wall at 1 - d is met at pi - a; each impact takes 2 a from the phase.
double grazing_error(double d, double h, std::int64_t steps) {
    const double a = 2 * std::asin(std::sqrt(d / 2)), until = h * static_cast<double>(steps);
    const State<double> end = travel<double>(kernel_for(spring, "points = 8"), {1 - d}, {-1}, {0}, h, steps);
    const double impacts = std::floor((until + pi - a) / (2 * pi - 2 * a));
    return end.status == LOBATTO_OK ? std::fabs(end.q[0] + std::cos(until + 2 * a * impacts)) : HUGE_VAL;
}

// Which stop ended the motion, and when: -1 none.
struct Ended {
    lobatto_status status;
    int stop = -1;
    double time = 0, y = 0;
};
Ended until_stop(const std::string& body, const std::string& stop, double y, double v, double h, std::int64_t steps) {
    const std::string text = body + "[run]\nstop = [\"" + stop + "\"]\nstep = 0.1\nuntil = 1\n";
    const Kernel kernel = kernel_of(emit(derive(read_scene(Source("stop.toml", text)))), Precision::double_);
    LoadedStepper<double> stepper(kernel);
    REQUIRE(stepper.prepare({2, 1}, h) == LOBATTO_OK);
    REQUIRE(stepper.start(0, {y}, {v}) == LOBATTO_OK);
    Numbers rows(static_cast<std::size_t>(4 * (kernel->events_of_step + 64)));
    lobatto_advance call{};
    call.steps = steps;
    call.events = rows.data();
    call.event_capacity = kernel->events_of_step + 64;
    Ended ended{stepper.advance(call)};
    if (ended.status == LOBATTO_STOPPED) {
        const double* const row = rows.data() + 4 * (call.events_written - 1);
        ended = {ended.status, static_cast<int>(row[0]), row[1], row[2]};
    }
    return ended;
}

Extreme accumulates(const std::string& claim, const std::function<State<double>()>& end, double before,
                    double within = 1e-12) {
    return says("stop: impacts accumulate, at the end of the step before", claim, [=] {
        const State<double> found = end();
        return found.status == LOBATTO_IMPACTS_ACCUMULATE && std::fabs(found.time - before) <= within;
    });
}

const std::string corner =
    "lagrangian = \"(x'^2 + y'^2 + z'^2)/2\"\n[coordinates]\nx = { position = 1, velocity = 0 }\n"
    "y = { position = 1, velocity = 0 }\nz = { position = 1, velocity = 0 }\n[impacts]\na = { when = \"x = 0 falling\" "
    "}\n"
    "b = { when = \"y = 0 falling\" }\nc = { when = \"z = 0 falling\" }\n";

const Extremes table(
    12, "Walls and stops",
    {
        right_to(1e-10, "of the height", "ball that bounces 100,000 times, e = 1, h = 0.4",
                 [] {
                     const State<double> end = fall(1, 1, 0, 0.4, 500000);
                     return end.status == LOBATTO_OK ? std::fabs(end.q[0] - 1) : HUGE_VAL;
                 }),
        right_to(1e-10, "of the height", "the same with 50 impacts in each step, 50,000 impacts",
                 [] {
                     const State<double> end = fall(1, 1, 0, 100, 1000);
                     return end.status == LOBATTO_OK ? std::fabs(end.q[0] - 1) : HUGE_VAL;
                 }),
        right_to(1e-13, "of the height", "impacts at the ends of steps, h = 0.25",
                 [] {
                     const State<double> end = fall(1, 1, 0, 0.25, 800);
                     return end.status == LOBATTO_OK ? std::fabs(end.q[0] - 1) : HUGE_VAL;
                 }),
        right_to(1e-10, "of the amplitude", "oscillator that meets a wall 1e-4 below its amplitude, 100 impacts",
                 [] { return grazing_error(1e-4, 0.1, 6200); }),
        right_to(2e-7, "of the amplitude", "the same, 1e-10 below: it grazes, where rounding is 1e5 times as large",
                 [] { return grazing_error(1e-10, 0.1, 6200); }),
        right_to(1e-12, "of the amplitude", "the same, at its amplitude: it touches, which is no impact",
                 [] {
                     const State<double> end =
                         travel<double>(kernel_for(spring, "points = 8"), {1}, {-1}, {0}, 0.1, 6200);
                     return end.status == LOBATTO_OK ? std::fabs(end.q[0] + std::cos(620.0)) : HUGE_VAL;
                 }),
        accumulates(
            "ball, e = 0.9: its impacts accumulate at 19", [] { return fall(0.9, 1, 0, 0.125, 200); }, 18.875),
        accumulates(
            "ball, e = 0.999: at 1999, and 2.5 before that more than 100 in a step of 0.25",
            [] { return fall(0.999, 1, 0, 0.25, 10000); }, 1996.5, 0.25),
        accumulates(
            "ball, e = 0", [] { return fall(0, 1, 0, 0.3, 10); }, 0.9),
        accumulates(
            "ball at rest on the floor from the start", [] { return fall(1, 0, 0, 0.1, 10); }, 0),
        right_to(1e-15, "of the way", "ball on the floor that starts downwards: thrown back at once",
                 [] {
                     const State<double> end = fall(0.5, 0, -2, 0.1, 5);
                     return end.status == LOBATTO_OK ? std::fabs(end.q[0] - 0.25) : HUGE_VAL;
                 }),
        stops(LOBATTO_OFF_CONSTRAINTS, "ball that starts 1e-9 below the floor",
              [] { return fall(1, -1e-9, 0, 0.1, 10).status; }),
        says("thrown back by all, to the last bit", "three walls met at once, in the corner of a room",
             [] {
                 const State<double> end = travel<double>(kernel_for(corner), {}, {1, 1, 1}, {-1, -2, -1}, 0.25, 8);
                 const State<double> all = travel<double>(kernel_for(corner), {}, {1, 1, 1}, {-1, -1, -1}, 0.3, 6);
                 return end.status == LOBATTO_OK && end.p == Numbers{1, 2, 1} && all.p == Numbers{1, 1, 1};
             }),
        says("goes on to the next time, right to 1e-14", "a stop where the motion starts",
             [] {
                 const Ended ended =
                     until_stop(ball, "y = 1 falling", 1, 1, 0.1, 100);  // at 1 again and down after a time of 1
                 return ended.stop == 0 && std::fabs(ended.time - 1) < 1e-14;
             }),
        says("stops there, before the impact", "a stop at the wall itself",
             [] {
                 const Ended ended = until_stop(ball, "y = 0 falling", 1, 0, 0.3, 100);
                 return ended.stop == 0 && std::fabs(ended.time - 1) < 1e-14 && std::fabs(ended.y) < 1e-14;
             }),
    });

}  // namespace

TEST_CASE("walls and stops at the edge end in the right answer or in a stop") {
    table.check();
}
