// SPDX-License-Identifier: GPL-2.0-or-later
// Trajectories in lanes that are refilled: stopped, failed or looked at after every step, each is what it is alone.
#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "runtime/run/ensemble/ensemble.hpp"
#include "tests/motions.hpp"

using namespace lobatto;
using namespace lobatto::test;
using TestMotion = lobatto::test::Motion;

namespace {

// Everything that it is shown.
class Recorder : public Reducer {
public:
    explicit Recorder(std::int64_t n) : columns_(1 + 2 * n) {}
    void begin(const LoadedStepper<double>&, const EnsembleStart&) override { states_.clear(), events_.clear(); }
    void observe(const double* rows, std::int64_t count) override {
        states_.insert(states_.end(), rows, rows + count * columns_);
    }
    void observe_events(const double* rows, std::int64_t count) override {
        events_.insert(events_.end(), rows, rows + count * (1 + columns_));
    }
    std::vector<double> values() const override {
        std::vector<double> all = states_;
        all.insert(all.end(), events_.begin(), events_.end());
        return all;
    }

private:
    std::int64_t columns_;
    std::vector<double> states_, events_;
};

struct Shown {
    lobatto_status status;
    std::int64_t steps_done;
    int stop;
    std::vector<double> rows, energies, recorded;
    bool operator==(const Shown&) const = default;
};

struct Watched {
    TestMotion motion;
    std::string method, stops, events;
    double kick;  // how much velocities differ
    std::int64_t steps;
    double bound;  // of the distance to the trajectory alone, in units of epsilon
};

Derivation derivation_of(const Watched& watched) {
    return derive(
        read_scene(Source("motion.toml", "title = \"Motion\"\n" + watched.motion.body + "[method]\n" + watched.method +
                                             "\n[run]\nstep = 0.1\nuntil = 1\nstop = [" + watched.stops +
                                             "]\n[output]\nenergy = true\nevents = [" + watched.events + "]\n")));
}

EnsembleStart start_of(const Watched& watched, std::int64_t index) {
    const TestMotion& motion = watched.motion;
    return start_around(motion.parameters, motion.q, motion.v, index, 0.1, watched.kick);
}

EnsembleRequest request_of(const Watched& watched, std::int64_t first, std::int64_t count, std::int64_t every = 0) {
    EnsembleRequest request;
    request.first = first;
    request.count = count;
    request.start = [&watched](std::int64_t index, EnsembleStart& start) { start = start_of(watched, index); };
    request.from_velocities = true;
    request.time = 0.5;
    request.step = watched.motion.step;
    request.steps = watched.steps;
    request.every = every;
    request.stops = true;
    request.threads = 1;
    const auto n = std::ssize(watched.motion.q);
    request.reducer = [n] { return std::make_unique<Recorder>(n); };
    return request;
}

std::vector<Shown> shown(const Kernel& kernel, EnsembleRequest request) {
    std::vector<Shown> all;
    request.sink = [&](const EnsembleTrajectory& t) {
        CHECK(t.index == request.first + std::ssize(all));
        all.push_back({t.status,
                       t.steps_done,
                       t.stop,
                       {t.kept.rows, t.kept.rows + t.kept.count * t.kept.columns},
                       {t.kept.energy, t.kept.energy + t.kept.count},
                       *t.reduced});
    };
    integrate(kernel, request);
    return all;
}

const std::string turns = "\"q = 3\", \"q = -3\"", splitting = "family = \"splitting\"\nstages = ";
// Measured: 50, 319, 30, 0.7, 19, 0, 154, 75, 23, 0, 478, 24, 0, 0 epsilon.
const Watched all[] = {
    {pendulum, "points = 4", turns, "\"q = 0.5\", \"q' = 0 rising\"", 3, 80, 200},
    {pendulum, "points = 2", turns, "\"q' = 0.2\"", 3, 80, 1300},
    {pendulum, "family = \"gauss\"\nstages = 3", turns, "\"q' = 0.2\"", 3, 80, 120},
    {pendulum, splitting + "11", turns, "\"q = 0.5\", \"q'*q = 0.3\"", 3, 80, 3},
    {henon_heiles, "points = 5", "\"x = 0.3\", \"y = -0.3\"", "\"x*y' - y*x' = 0\", \"x = 0 falling\"", 0.1, 60, 80},
    {henon_heiles, splitting + "6", "\"x = 0.3\"", "\"x = 0\"", 0.1, 60, 0},
    {double_pendulum, "points = 5", "\"a = 1.2\", \"b' = 2.5\"", "\"a' = 0\", \"a - b = 0\", \"b = 0 rising\"", 1.5, 80,
     600},
    {double_pendulum, "family = \"gauss\"\nstages = 4", "\"a = 1.2\"", "\"a' = 0\"", 1.5, 80, 300},
    {driven_pendulum, "points = 4", turns, "\"q = 0.5*cos(t)\", \"q' = 0\"", 2.5, 100, 100},
    {driven_pendulum, splitting + "14", turns, "\"q = 0.5*cos(t)\"", 2.5, 100, 0},
    {spherical_pendulum, "points = 4", "\"f = 6.8\"", "\"f' = 1\", \"cos(f) = 0\"", 0.15, 60, 2000},
    {harmonic_oscillator, "points = 4", "\"q = 1.5\"", "\"q = 0\"", 2, 80, 100},
    {harmonic_oscillator, "points = 4", "", "", 2, 80, 0},
    {coupled_oscillators, splitting + "6", "", "", 2, 80, 0}};

Kernel alone(const Watched& watched) {
    return kernel_of(emit(derivation_of(watched)), Precision::double_);
}
Kernel refilled(const Watched& watched, std::int64_t together = 32) {
    return ensemble_kernel_of(emit(derivation_of(watched)), Precision::double_, together, nullptr, true);
}

}  // namespace

// What computes here are kernels, which no sanitiser looks into.
TEST_SUITE_BEGIN("slow");

TEST_CASE("a trajectory in a refilled lane meets what it meets alone, when and where it meets it alone" *
          doctest::test_suite("slowest")) {
    for (const Watched& watched : all) {
        CAPTURE(watched.motion.body);
        CAPTURE(watched.method);
        const Kernel one = alone(watched), lanes = refilled(watched);
        CHECK(lanes->lanes > 1);
        const bool is_refilled = lanes->refilled_advance != nullptr;
        CHECK(is_refilled);
        const auto reference = shown(one, request_of(watched, 0, 50, 7)),
                   found = shown(lanes, request_of(watched, 0, 50, 7));
        REQUIRE(found.size() == 50);
        int stopped = 0;
        double worst = 0;
        for (std::size_t i = 0; i < 50; ++i) {
            CAPTURE(i);
            CHECK(found[i].status == LOBATTO_OK);
            CHECK(found[i].steps_done == reference[i].steps_done);
            CHECK(found[i].stop == reference[i].stop);
            stopped += found[i].stop >= 0 ? 1 : 0;
            for (const auto part : {&Shown::rows, &Shown::energies, &Shown::recorded}) {
                REQUIRE((found[i].*part).size() == (reference[i].*part).size());
                worst = std::fmax(worst, distance_in_epsilon(found[i].*part, reference[i].*part));
            }
        }
        CHECK(worst <= watched.bound);
        if (!watched.stops.empty()) {
            CHECK(stopped > 3);
            CHECK(stopped < 47);
        }
    }
}

TEST_CASE("what a trajectory is does not depend on the lanes, on what they held before, nor on the threads" *
          doctest::test_suite("slowest")) {
    for (const Watched& watched : all) {
        CAPTURE(watched.motion.body);
        CAPTURE(watched.method);
        const Kernel lanes = refilled(watched), few = refilled(watched, 1);
        EnsembleRequest request = request_of(watched, 0, 150, 7);
        const auto reference = shown(lanes, request);
        request.threads = 3;
        CHECK(shown(lanes, request) == reference);
        CHECK(shown(few, request) == reference);
        for (const std::int64_t count : {1, 3, 7, 9, 17})
            for (const std::int64_t first : {0, 20}) {
                const auto some = shown(lanes, request_of(watched, first, count, 7));
                REQUIRE(std::ssize(some) == count);
                CHECK(std::equal(some.begin(), some.end(), reference.begin() + first));
            }
    }
}

// Of Henon and Heiles' stars some escape, and have no step beyond a certain time.
TEST_CASE("a trajectory that fails stands beside others that are stopped, and changes none of them") {
    const Watched watched{henon_heiles, "points = 5", "\"x = 0.9\", \"y = -0.8\"", "\"x = 0\"", 1.5, 60, 0};
    const Kernel one = alone(watched), lanes = refilled(watched);
    EnsembleRequest request = request_of(watched, 0, 60);
    request.start = [&](std::int64_t index, EnsembleStart& start) {
        start = start_of(watched, index);
        if (index == 5) start.q[0] = std::nan("");
        if (index == 9) start.rate[1] = std::numeric_limits<double>::infinity();
    };
    const auto found = shown(lanes, request), single = shown(one, request);
    int failed = 0, stopped = 0;
    for (std::size_t i = 0; i < 60; ++i) {
        CAPTURE(i);
        CHECK(found[i].status == single[i].status);
        CHECK(found[i].stop == single[i].stop);
        stopped += found[i].stop >= 0 ? 1 : 0;
        if (found[i].status != LOBATTO_OK) {
            ++failed;
            REQUIRE(found[i].rows.size() == 5);
            CHECK(found[i].rows[0] == 0.5 + static_cast<double>(found[i].steps_done) * watched.motion.step);
        }
        if (i == 5 || i == 9) {
            CHECK(found[i].status == LOBATTO_NOT_FINITE);
            CHECK(std::isnan(found[i].energies[0]));
            CHECK(found[i].recorded.empty());
            continue;
        }
        request.first = static_cast<std::int64_t>(i);
        request.count = 1;
        CHECK(shown(lanes, request)[0] == found[i]);
    }
    CHECK(failed > 5);
    CHECK(stopped > 5);
    CHECK(std::count_if(found.begin(), found.end(), [](const Shown& s) { return s.status == LOBATTO_NOT_CONVERGED; }) >
          3);
}

TEST_CASE("turns that hardly reach an event, or hardly miss it, are told apart in lanes as alone") {
    // A pendulum let go at 1: cos q = cos 1 at each turn, from below.
    const Watched turning{pendulum, "points = 4", "", "\"q = 1\", \"cos(q) = cos(1)\"", 0, 150, 0};
    for (const double h : {0.05, 0.3}) {
        EnsembleRequest request = request_of(turning, 0, 60);
        request.step = h;
        request.start = [&](std::int64_t index, EnsembleStart& start) {
            const double beyond = std::pow(10.0, -static_cast<double>(index / 6)) * static_cast<double>(index % 6 - 3);
            start = {{2, 1.5}, {-1 - 0.1 * beyond}, {0}};
        };
        const auto reference = shown(alone(turning), request), found = shown(refilled(turning), request);
        std::size_t events = 0;
        for (std::size_t i = 0; i < 60; ++i) {
            CAPTURE(i);
            CHECK(found[i].recorded.size() == reference[i].recorded.size());
            events += found[i].recorded.size() - 151 * 3;
        }
        CHECK(events > 200 * 4);
    }
}

TEST_SUITE_END();
