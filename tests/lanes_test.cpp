// SPDX-License-Identifier: GPL-2.0-or-later
// Trajectories side by side in the lanes of emitted kernels: each as if it were alone, whatever its neighbours do.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "runtime/ensemble.hpp"
#include "runtime/trajectory.hpp"
#include "tests/motions.hpp"

using namespace lobatto;
using namespace lobatto::test;
using TestMotion = lobatto::test::Motion;

namespace {

struct Kept {
    lobatto_status status;
    std::int64_t steps_done, iterations;
    std::vector<double> last;  // t, q, p
    bool operator==(const Kept&) const = default;
};

using Starts = std::function<void(std::int64_t index, EnsembleStart& start)>;

// From velocities, with the motion's step.
std::vector<Kept> together(const Kernel& kernel, const TestMotion& motion, std::int64_t count, std::int64_t steps,
                           const Starts& starts, int threads = 1) {
    EnsembleRequest request;
    request.count = count;
    request.start = starts;
    request.from_velocities = true;
    request.step = motion.step;
    request.steps = steps;
    request.threads = threads;
    std::vector<Kept> kept;
    request.sink = [&](const EnsembleTrajectory& t) {
        const double* const row = t.kept.rows + (t.kept.count - 1) * t.kept.columns;
        kept.push_back({t.status, t.steps_done, t.iterations, {row, row + t.kept.columns}});
    };
    integrate(kernel, request);
    return kept;
}

// The same by itself: t, q, p.
std::vector<double> alone(const Kernel& kernel, const TestMotion& motion, std::int64_t steps,
                          const EnsembleStart& start) {
    LoadedStepper<double> stepper(kernel);
    REQUIRE(stepper.prepare(start.parameters, motion.step) == LOBATTO_OK);
    REQUIRE(stepper.start(0, start.q, stepper.momentum(0, start.q, start.rate)) == LOBATTO_OK);
    lobatto_advance call{};
    call.steps = steps;
    REQUIRE(stepper.advance(call) == LOBATTO_OK);
    std::vector<double> q(start.q.size()), p(start.q.size());
    double time = 0;
    stepper.state(time, q, p);
    std::vector<double> all{time};
    all.insert(all.end(), q.begin(), q.end());
    all.insert(all.end(), p.begin(), p.end());
    return all;
}

// Starts around the motion's own; parameters too, each a little different.
Starts around(const TestMotion& motion) {
    return [&motion](std::int64_t index, EnsembleStart& start) {
        const auto i = static_cast<double>(index);
        start = {motion.parameters, motion.q, motion.v};
        for (std::size_t k = 0; k < start.parameters.size(); ++k)
            start.parameters[k] *= 1 + 0.02 * std::sin(i + double(k));
        for (std::size_t k = 0; k < start.q.size(); ++k) start.q[k] += 0.05 * std::cos(3 * i + double(k));
        for (std::size_t k = 0; k < start.q.size(); ++k) start.rate[k] += 0.05 * std::sin(2 * i + double(k));
    };
}

// The largest difference relative to the largest number, in units of epsilon.
double distance(const std::vector<double>& a, const std::vector<double>& b) {
    REQUIRE(a.size() == b.size());
    double most = 0, size = 0;
    for (std::size_t i = 1; i < a.size(); ++i) {
        if (!(std::fabs(a[i] - b[i]) <= most)) most = std::fabs(a[i] - b[i]);
        size = std::fmax(size, std::fabs(b[i]));
    }
    return most / size / 2.220446049250313e-16;
}

struct InLanes {
    const TestMotion& motion;
    double bound;
};
// Measured over 200 steps: 212, 280, 7, 0, 0, 25, 128 epsilon. One text serves both layouts, but sums over nodes are
// taken in another order; a linear system has no such sums.
const InLanes all[] = {
    {pendulum, 2000},         {henon_heiles, 2500},   {double_pendulum, 100}, {harmonic_oscillator, 0},
    {coupled_oscillators, 0}, {driven_pendulum, 250}, {kepler, 1500}};

const Kernel& kernel_for(const TestMotion& motion) {
    static std::vector<std::pair<const TestMotion*, Kernel>> made;
    for (const auto& [of, kernel] : made)
        if (of == &motion) return kernel;
    made.reserve(std::size(all));
    return made.emplace_back(&motion, ensemble_kernel_in_own_cache(derivation_of(motion, "points = 4"))).second;
}

}  // namespace

TEST_CASE("a trajectory in a lane is the trajectory that runs alone") {
    for (const InLanes& in : all) {
        const Kernel& kernel = kernel_for(in.motion);
        INFO(in.motion.body);
        CHECK(kernel->lanes > 1);
        const Starts starts = around(in.motion);
        const auto kept = together(kernel, in.motion, 17, 200, starts);
        REQUIRE(kept.size() == 17);
        double worst = 0;
        for (std::size_t i = 0; i < kept.size(); ++i) {
            EnsembleStart start;
            starts(static_cast<std::int64_t>(i), start);
            CHECK(kept[i].status == LOBATTO_OK);
            CHECK(kept[i].steps_done == 200);
            const double d = distance(kept[i].last, alone(kernel, in.motion, 200, start));
            if (!(d <= worst)) worst = d;
        }
        CHECK(worst <= in.bound);
    }
}

TEST_CASE("any number of trajectories and of threads gives the same bits") {
    for (const InLanes& in : all) {
        INFO(in.motion.body);
        const Kernel& kernel = kernel_for(in.motion);
        const Starts starts = around(in.motion);
        const auto most = together(kernel, in.motion, 200, 20, starts);
        CHECK(together(kernel, in.motion, 200, 20, starts, 3) == most);
        for (const std::int64_t count : {1, 3, 7, 9, 17}) {
            const auto some = together(kernel, in.motion, count, 20, starts);
            REQUIRE(std::ssize(some) == count);
            CHECK(std::equal(some.begin(), some.end(), most.begin()));
        }
    }
}

TEST_CASE("the bits of a lane do not depend on its neighbours, nor on which lane it is") {
    for (const InLanes& in : all) {
        INFO(in.motion.body);
        const Kernel& kernel = kernel_for(in.motion);
        const Starts starts = around(in.motion);
        const auto reference = together(kernel, in.motion, 1, 100, starts);
        for (std::int64_t place = 0; place < kernel->lanes; ++place) {
            const auto kept =
                together(kernel, in.motion, kernel->lanes, 100, [&](std::int64_t index, EnsembleStart& start) {
                    starts(index == place ? 0 : 20 + 7 * index + place, start);
                });
            CHECK(kept[static_cast<std::size_t>(place)] == reference[0]);
        }
    }
}

TEST_CASE("a start that is not a number stops its own trajectory alone") {
    for (const InLanes& in : all) {
        INFO(in.motion.body);
        const Kernel& kernel = kernel_for(in.motion);
        const Starts starts = around(in.motion);
        const auto good = together(kernel, in.motion, 9, 50, starts);
        for (const bool of_position : {true, false}) {
            const auto kept = together(kernel, in.motion, 9, 50, [&](std::int64_t index, EnsembleStart& start) {
                starts(index, start);
                if (index == 2) (of_position ? start.q : start.rate)[0] = std::nan("");
            });
            REQUIRE(kept.size() == 9);
            for (std::size_t i = 0; i < 9; ++i)
                if (i != 2) CHECK(kept[i] == good[i]);
            CHECK(kept[2].status == LOBATTO_NOT_FINITE);
            CHECK(kept[2].steps_done == 0);
        }
    }
}

TEST_CASE("a trajectory whose step cannot be solved stops alone, with its last good state") {
    TestMotion coarse = kepler;
    coarse.step = 0.25;
    const Kernel& kernel = kernel_for(kepler);
    const Starts starts = around(kepler);
    const auto good = together(kernel, coarse, 9, 100, starts);
    const auto kept = together(kernel, coarse, 9, 100, [&](std::int64_t index, EnsembleStart& start) {
        starts(index, start);
        if (index == 4) start = {{1}, {0.5, 0}, {0, 0}};  // straight into the centre
    });
    for (std::size_t i = 0; i < 9; ++i)
        if (i != 4) {
            CHECK(good[i].status == LOBATTO_OK);
            CHECK(kept[i] == good[i]);
        }
    CHECK(kept[4].status == LOBATTO_NOT_CONVERGED);
    CHECK(kept[4].steps_done == 1);
    CHECK(kept[4].last[0] == coarse.step * static_cast<double>(kept[4].steps_done));
    for (const double x : kept[4].last) CHECK(std::isfinite(x));
}

TEST_CASE("a lane whose sweeps cannot contract is led on by Newton's iteration, the others unchanged") {
    const Kernel& kernel = kernel_for(pendulum);
    TestMotion wide = pendulum;
    wide.step = 0.5;
    const auto starts = [&](double omega) {
        return [omega](std::int64_t index, EnsembleStart& start) {
            start = {{2, index == 3 ? omega : 1 + 0.01 * static_cast<double>(index)}, {1}, {0.25}};
        };
    };
    const auto calm = together(kernel, wide, 9, 20, starts(1)), stiff = together(kernel, wide, 9, 20, starts(5.8));
    for (std::size_t i = 0; i < 9; ++i)
        if (i != 3) CHECK(stiff[i] == calm[i]);
    CHECK(stiff[3].status == LOBATTO_OK);
    CHECK(stiff[3].steps_done == 20);
    EnsembleStart start;
    starts(5.8)(3, start);
    CHECK(distance(stiff[3].last, alone(kernel, wide, 20, start)) < 1000);  // 93
}
