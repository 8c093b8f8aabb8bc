// SPDX-License-Identifier: GPL-2.0-or-later
// Trajectories with a clock in lanes: each is what it is alone, whoever stands beside it.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "analysis/kernel/kernel_of.hpp"
#include "generator/pipeline.hpp"
#include "runtime/run/ensemble/ensemble.hpp"
#include "tests/motions.hpp"

using namespace lobatto;

namespace {

struct Clocked {
    std::string body, method;
    std::vector<double> parameters, q, v;
    double step, until;
    double bound;  // of the distance to the trajectory alone, in units of epsilon
};

const std::string kepler =
    "lagrangian = \"(x'^2 + y'^2)/2 + m/sqrt(x^2 + y^2)\"\n[parameters]\nm = 1\n[coordinates]\n"
    "x = { position = 0.2, velocity = 0 }\ny = { position = 0, velocity = 3 }\n";
const std::string three_bodies =
    "lagrangian = \"sum(i = 1 .. 3, m[i]*(x[i]'^2 + y[i]'^2)/2) + sum(i = 1 .. 2, sum(j = i + 1 .. 3, "
    "m[i]*m[j]/sqrt((x[i] - x[j])^2 + (y[i] - y[j])^2)))\"\n[parameters]\nm = [3, 4, 5]\n[coordinates]\n"
    "x = { position = [1, -2, 1], velocity = 0 }\ny = { position = [3, -1, -1], velocity = 0 }\n";
// Masses that are full and depend on the position; a cyclic coordinate; an angle.
const std::string double_pendulum =
    "lagrangian = \"a'^2 + b'^2/2 + a'*b'*cos(a - b) + g*(2*cos(a) + cos(b))\"\n[parameters]\ng = 1.5\n[coordinates]\n"
    "a = { position = 1, velocity = 0 }\nb = { position = 1.4, velocity = 0 }\n";
const std::string rolling =
    "lagrangian = \"(1 + x^2)*x'^2/2 + (2 + x^2)*f'^2/2 - k*x^2\"\n[parameters]\nk = 2\n[coordinates]\n"
    "x = { position = 0.7, velocity = 0.2 }\nf = { position = 0, velocity = 1 }\n";

// Measured: 292, 484, 290, 12266, 10, 12, 5 epsilon. Some orbits of the second are so eccentric that they fail, as
// alone.
const Clocked all[] = {
    {kepler, "points = 9\nclock = \"auto\"", {1}, {0.2, 0}, {0, 3}, 0.1, 30, 1500},
    {kepler, "family = \"gauss\"\nstages = 8\nclock = \"auto\"", {1}, {0.2, 0}, {0, 3}, -0.09, 30, 2500},
    {kepler, "points = 4\nclock = \"sqrt(x^2 + y^2)\"", {1}, {0.2, 0}, {0, 3}, 0.05, 10, 1500},
    {three_bodies, "points = 12\nclock = \"auto\"", {3, 4, 5}, {1, -2, 1, 3, -1, -1}, {0, 0, 0, 0, 0, 0}, 0.2, 5, 6e4},
    {double_pendulum, "points = 5\nclock = \"2 + cos(a - b)\"", {1.5}, {1, 1.4}, {0, 0}, 0.1, 10, 50},
    {double_pendulum,
     "family = \"gauss\"\nstages = 3\nclock = \"2 + cos(a - b)\"",
     {1.5},
     {1, 1.4},
     {0, 0},
     0.1,
     10,
     60},
    {rolling, "points = 5\nclock = \"1/(1 + x^2)\"", {2}, {0.7, 0}, {0.2, 1}, 0.15, 10, 30}};

Derivation derivation_of(const Clocked& motion) {
    return derive(read_scene(Source("motion.toml", "title = \"Motion\"\n" + motion.body + "[method]\n" + motion.method +
                                                       "\n[run]\nstep = 0.1\nuntil = 1\n")));
}
Kernel alone(const Clocked& motion) {
    return kernel_of(emit(derivation_of(motion)), Precision::double_);
}
Kernel in_lanes(const Clocked& motion) {
    return ensemble_kernel_of(emit(derivation_of(motion)), Precision::double_, 32);
}

EnsembleStart start_of(const Clocked& motion, std::int64_t index) {
    return test::start_around(motion.parameters, motion.q, motion.v, index, 0.03, 0.05);
}

EnsembleRequest request_of(const Clocked& motion, std::int64_t first, std::int64_t count, std::int64_t steps,
                           std::int64_t every) {
    EnsembleRequest request;
    request.first = first;
    request.count = count;
    request.start = [&motion](std::int64_t index, EnsembleStart& start) { start = start_of(motion, index); };
    request.from_velocities = true;
    request.time = 0.5;
    request.step = motion.step;
    const double direction = motion.step > 0 ? 1 : -1;
    request.arrivals.end = 0.5 + direction * motion.until;
    request.arrivals.interval = direction * motion.until / (static_cast<double>(steps) - 0.4);  // the last is shorter
    request.steps = steps;
    request.every = every;
    request.threads = 1;
    return request;
}

struct Shown {
    lobatto_status status;
    std::int64_t steps_done;
    std::vector<double> rows, energies;
    bool operator==(const Shown&) const = default;
};
std::vector<Shown> shown(const Kernel& kernel, EnsembleRequest request) {
    std::vector<Shown> found;
    request.sink = [&](const EnsembleTrajectory& t) {
        CHECK(t.index == request.first + std::ssize(found));
        found.push_back({t.status,
                         t.steps_done,
                         {t.kept.rows, t.kept.rows + t.kept.count * t.kept.columns},
                         {t.kept.energy, t.kept.energy + t.kept.count}});
    };
    integrate(kernel, request);
    return found;
}

}  // namespace

// What computes here are kernels, which no sanitiser looks into.
TEST_SUITE_BEGIN("slow");

TEST_CASE("a trajectory with a clock in a lane arrives at the times at which it arrives alone, in the same states" *
          doctest::test_suite("slowest")) {
    for (const Clocked& motion : all) {
        CAPTURE(motion.body);
        CAPTURE(motion.method);
        const Kernel one = alone(motion), lanes = in_lanes(motion);
        CHECK(one->lanes == 0);
        CHECK(lanes->lanes > 1);
        double worst = 0;
        // Arrivals after several steps, and several in each step; more of them than there is room for in a call.
        for (const auto& asked : {std::pair{5, 0}, {61, 13}, {700, 1}}) {
            const int steps = asked.first, every = asked.second;
            CAPTURE(steps);
            const auto reference = shown(one, request_of(motion, 0, 21, steps, every)),
                       found = shown(lanes, request_of(motion, 0, 21, steps, every));
            REQUIRE(found.size() == 21);
            const std::size_t columns = 1 + 2 * motion.q.size();
            for (std::size_t i = 0; i < found.size(); ++i) {
                CAPTURE(i);
                CHECK(found[i].status == reference[i].status);
                CHECK(found[i].steps_done == reference[i].steps_done);
                REQUIRE(found[i].rows.size() == reference[i].rows.size());
                for (std::size_t row = 0; row < found[i].rows.size(); row += columns)
                    CHECK(found[i].rows[row] == reference[i].rows[row]);
                worst = std::fmax(worst, test::distance_in_epsilon(found[i].rows, reference[i].rows));
                worst = std::fmax(worst, test::distance_in_epsilon(found[i].energies, reference[i].energies));
            }
        }
        CHECK(worst <= motion.bound);
    }
}

TEST_CASE("what a trajectory with a clock is does not depend on the lanes beside it, nor on the threads") {
    for (const Clocked& motion : all) {
        CAPTURE(motion.body);
        CAPTURE(motion.method);
        const Kernel lanes = in_lanes(motion);
        EnsembleRequest request = request_of(motion, 0, 60, 61, 13);
        const auto reference = shown(lanes, request);
        request.threads = 3;
        CHECK(shown(lanes, request) == reference);
        for (const std::int64_t count : {1, 3, 9, 17})
            for (const std::int64_t first : {0, 20}) {
                const auto some = shown(lanes, request_of(motion, first, count, 61, 13));
                REQUIRE(std::ssize(some) == count);
                CHECK(std::equal(some.begin(), some.end(), reference.begin() + first));
            }
    }
}

// The clock is 0 at x = -c: a motion comes near, and not beyond.
TEST_CASE("a trajectory whose clock stands still fails as alone, with its last good state, and changes no other") {
    const Clocked motion{
        "lagrangian = \"(x'^2 - w*x^2)/2\"\n[parameters]\nw = 1\nc = 0\n[coordinates]\n"
        "x = { position = 1, velocity = 0 }\n",
        "points = 6\nclock = \"x + c\"",
        {1, 0},
        {1},
        {0},
        0.1,
        10,
        1000};
    const Kernel one = alone(motion), lanes = in_lanes(motion);
    CHECK(lanes->lanes > 1);
    EnsembleRequest request = request_of(motion, 0, 40, 61, 4);
    request.arrivals.interval = 0.1;
    request.arrivals.end = 0.5 + 6.1;
    request.start = [&](std::int64_t index, EnsembleStart& start) {
        start = start_of(motion, index);
        start.parameters[1] = index % 3 == 0 ? 2 : 0;
        if (index == 5) start.q[0] = std::nan("");
        if (index == 7) start.rate[0] = std::numeric_limits<double>::infinity();
    };
    const auto found = shown(lanes, request), single = shown(one, request);
    int failed = 0;
    for (std::size_t i = 0; i < 40; ++i) {
        CAPTURE(i);
        CHECK(found[i].status == single[i].status);
        CHECK(found[i].steps_done == single[i].steps_done);
        REQUIRE(found[i].rows.size() == single[i].rows.size());
        if (i == 5 || i == 7) {
            CHECK(found[i].status == LOBATTO_NOT_FINITE);
            continue;
        }
        failed += found[i].status != LOBATTO_OK ? 1 : 0;
        CHECK(test::distance_in_epsilon(found[i].rows, single[i].rows) <= motion.bound);
        request.first = static_cast<std::int64_t>(i);
        request.count = 1;
        CHECK(shown(lanes, request)[0] == found[i]);
    }
    CHECK(failed > 20);
    CHECK(failed < 30);
}

TEST_CASE("lanes whose iterations fail take their steps alone, with the energy of their start") {
    // 3 radians of the fast oscillation in a step: iterations over velocities do not contract, and Newton's takes most.
    const Clocked motion{
        "lagrangian = \"(x'^2 + y'^2)/2 - w*x^2/2 - y^2/2 + x*y/5\"\n[parameters]\nw = 400\n"
        "[coordinates]\nx = { position = 0.1, velocity = 0 }\ny = { position = 1, velocity = 0 }\n",
        "points = 4\nclock = \"2 + cos(y)\"",
        {400},
        {0.1, 1},
        {0, 0},
        0.05,
        5,
        800};
    const auto reference = shown(alone(motion), request_of(motion, 0, 24, 20, 1)),
               found = shown(in_lanes(motion), request_of(motion, 0, 24, 20, 1));
    double worst = 0;
    for (std::size_t i = 0; i < 24; ++i) {
        CAPTURE(i);
        CHECK(found[i].status == LOBATTO_OK);
        worst = std::fmax(worst, test::distance_in_epsilon(found[i].rows, reference[i].rows));
    }
    CHECK(worst <= motion.bound);
}

TEST_CASE("a call returns, however many arrivals nobody asks for there are, and the next one goes on") {
    const Clocked& motion = all[0];
    const Kernel kernel = in_lanes(motion);
    const std::unique_ptr<void, void (*)(void*)> lanes(
        std::aligned_alloc(static_cast<std::size_t>(kernel->ensemble_alignment),
                           static_cast<std::size_t>(kernel->ensemble_bytes)),
        std::free);
    const std::vector<double> p =
        test::started<double>(alone(motion), {motion.body, motion.parameters, motion.q, motion.v, motion.step},
                              motion.step)
            .momentum(0, motion.q, motion.v);
    const auto end_of = [&](std::int64_t arrivals, int& calls) {
        const auto width = static_cast<std::size_t>(kernel->lanes);
        std::vector<double> rows(width * 5);
        std::vector<std::int32_t> status(width, LOBATTO_UNSUPPORTED);
        std::vector<std::int64_t> done(width), iterations(width), written(width);
        lobatto_refilled_advance call{};
        call.steps = arrivals;
        call.end = motion.until;
        call.interval = motion.until / static_cast<double>(arrivals);
        call.records = rows.data();
        call.capacity = 1;
        call.status = status.data();
        call.steps_done = done.data();
        call.iterations = iterations.data();
        call.records_written = written.data();
        const double time = 0;
        kernel->refilled_prepare(lanes.get(), &motion.step);
        status[0] = kernel->refilled_fill(lanes.get(), 0, motion.parameters.data(), &time, motion.q.data(), p.data());
        std::int64_t arrived = 0;
        for (calls = 0; arrived < arrivals && status[0] == LOBATTO_OK; ++calls) {
            kernel->refilled_advance(lanes.get(), &call);
            arrived += done[0];
        }
        CHECK(status[0] == LOBATTO_OK);
        CHECK(arrived == arrivals);
        CHECK(written[0] == 1);
        return std::vector<double>(rows.begin(), rows.begin() + 5);
    };
    int few = 0, many = 0;
    CHECK(end_of(1'000'000, many) == end_of(1, few));
    CHECK(few == 1);
    CHECK(many > 10);
}

TEST_SUITE_END();
