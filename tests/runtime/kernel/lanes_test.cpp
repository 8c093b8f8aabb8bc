// SPDX-License-Identifier: GPL-2.0-or-later
// Trajectories side by side in the lanes of emitted kernels: each as if it were alone, whatever its neighbours do.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "runtime/run/ensemble/ensemble.hpp"
#include "runtime/run/trajectory.hpp"
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

Starts around(const TestMotion& motion) {
    return [&motion](std::int64_t index, EnsembleStart& start) {
        start = start_around(motion.parameters, motion.q, motion.v, index, 0.05, 0.05);
    };
}

// Of t, q, p: of states alone.
double distance(const std::vector<double>& a, const std::vector<double>& b) {
    return distance_in_epsilon(a, b, 1);
}

struct InLanes {
    const TestMotion& motion;
    double bound;
    std::string method = "points = 4";
};
const std::string splitting = "family = \"splitting\"\nstages = ";
// Measured over 200 steps: 110, 359, 7, 0, 0, 13, 128, 24, 172, 0, 0, 0 epsilon. Lanes solve the same equations in
// other steps; a linear system has none. Explicit steps have the same order in both, and other sines.
const InLanes all[] = {{pendulum, 2000},
                       {henon_heiles, 2500},
                       {double_pendulum, 100},
                       {harmonic_oscillator, 0},
                       {coupled_oscillators, 0},
                       {driven_pendulum, 250},
                       {kepler, 1500},
                       {spherical_pendulum, 50},
                       {pendulum, 2000, "points = 2"},
                       {pendulum, 2000, splitting + "11"},
                       {henon_heiles, 0, splitting + "6"},
                       {driven_pendulum, 250, splitting + "14"}};

const Kernel& kernel_for(const InLanes& in) {
    static std::vector<std::pair<const InLanes*, Kernel>> made;
    for (const auto& [of, kernel] : made)
        if (of == &in) return kernel;
    made.reserve(std::size(all));
    return made.emplace_back(&in, ensemble_kernel_in_own_cache(derivation_of(in.motion, in.method))).second;
}
// What `lobatto run` steps with.
Kernel kernel_alone(const TestMotion& motion, const std::string& method) {
    return kernel_in_own_cache(derivation_of(motion, method), Precision::double_);
}

}  // namespace

// What computes here are kernels, which no sanitiser looks into.
TEST_SUITE_BEGIN("slow");

TEST_CASE("a trajectory in a lane is the trajectory that runs alone") {
    for (const InLanes& in : all) {
        const Kernel& kernel = kernel_for(in);
        INFO(in.motion.body);
        CHECK(kernel->lanes > 1);
        const Starts starts = around(in.motion);
        const auto kept = together(kernel, in.motion, 17, 200, starts);
        const Kernel one = kernel_alone(in.motion, in.method);
        REQUIRE(kept.size() == 17);
        double worst = 0;
        for (std::size_t i = 0; i < kept.size(); ++i) {
            EnsembleStart start;
            starts(static_cast<std::int64_t>(i), start);
            CHECK(kept[i].status == LOBATTO_OK);
            CHECK(kept[i].steps_done == 200);
            const double d = distance(kept[i].last, alone(one, in.motion, 200, start));
            if (!(d <= worst)) worst = d;
        }
        CHECK(worst <= in.bound);
    }
}

TEST_CASE("any number of trajectories and of threads gives the same bits") {
    for (const InLanes& in : all) {
        INFO(in.motion.body);
        const Kernel& kernel = kernel_for(in);
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

TEST_CASE("few trajectories take one register, many two where there is room, with the same bits") {
    const Derivation derivation = derivation_of(pendulum, "points = 4");
    const Kernel few = ensemble_kernel_in_own_cache(derivation, 1), many = ensemble_kernel_in_own_cache(derivation, 99);
    CHECK(few->lanes > 1);
    CHECK(many->lanes == 2 * few->lanes);
    const Starts starts = around(pendulum);
    CHECK(together(few, pendulum, 17, 200, starts) == together(many, pendulum, 17, 200, starts));
    // A step of a long chain fills the lanes with masses.
    Motion masses = chain();
    masses.body.replace(masses.body.find("value = 12"), 10, "value = 40");
    CHECK(ensemble_kernel_in_own_cache(derivation_of(masses, "points = 4"))->lanes == 0);
}

TEST_CASE("a lane that did not start has its own parameters when it does") {
    const Kernel kernel = ensemble_kernel_in_own_cache(derivation_of(pendulum, "points = 4"));
    const auto lanes = static_cast<std::size_t>(kernel->lanes);
    std::vector<double> parameters, q(lanes), p(lanes, 0.5), energy(lanes);
    for (std::size_t lane = 0; lane < lanes; ++lane) {
        parameters.insert(parameters.end(), {2 + 0.1 * static_cast<double>(lane), 1.5});
        q[lane] = 0.1 * static_cast<double>(lane);
    }
    // `starts`: a status of the last lane for each start.
    const auto last_after = [&](const std::vector<std::int32_t>& starts) {
        std::vector<std::byte> memory(static_cast<std::size_t>(kernel->ensemble_bytes + kernel->ensemble_alignment));
        void* place = memory.data();
        std::size_t room = memory.size();
        REQUIRE(std::align(static_cast<std::size_t>(kernel->ensemble_alignment),
                           static_cast<std::size_t>(kernel->ensemble_bytes), place, room) != nullptr);
        std::vector<std::int32_t> status(lanes);
        std::vector<std::int64_t> done(lanes), iterations(lanes);
        std::vector<double> q_now(lanes), p_now(lanes);
        const double h = 0.1, time = 0;
        kernel->ensemble_prepare(place, parameters.data(), &h, status.data());
        for (const std::int32_t last : starts) {
            status.assign(lanes, LOBATTO_OK);
            status.back() = last;
            kernel->ensemble_start(place, &time, q.data(), p.data(), status.data());
        }
        kernel->ensemble_advance(place, 50, 0, status.data(), done.data(), iterations.data());
        kernel->ensemble_state(place, q_now.data(), p_now.data());
        CHECK(done.back() == 50);
        return std::pair(q_now.back(), p_now.back());
    };
    CHECK(last_after({LOBATTO_UNSUPPORTED, LOBATTO_OK}) == last_after({LOBATTO_OK}));
}

TEST_CASE("the bits of a lane do not depend on its neighbours, nor on which lane it is") {
    for (const InLanes& in : all) {
        INFO(in.motion.body);
        const Kernel& kernel = kernel_for(in);
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

// Stiff in x, so that its quadratic part is taken into the stage map; neighbours of very different amplitude need other
// numbers of fixed-point iterations.
TEST_CASE("the bits of a lane do not depend on how many iterations its neighbours take") {
    const TestMotion stiff{
        "lagrangian = \"x'^2/2 + z'^2/2 - 150*x^2 - 20*(1 - cos(x)) - z^2*x/5 - z^2/2 - 20*z^4\"\n"
        "[coordinates]\nx = { position = 1, velocity = 0 }\nz = { position = 0.3, velocity = 0 }\n",
        {},
        {0.1, 0.3},
        {0, 0},
        0.02};
    const Derivation derivation = derivation_of(stiff, "points = 5");
    REQUIRE(derivation.structure.diagonal_part());
    const Kernel kernel = ensemble_kernel_in_own_cache(derivation);
    const auto among = [&](double amplitude) {
        return together(kernel, stiff, kernel->lanes, 5000, [&](std::int64_t index, EnsembleStart& start) {
            start = {stiff.parameters, stiff.q, stiff.v};
            if (index > 0) start.q[0] = amplitude * static_cast<double>(index);
        })[0];
    };
    const Kept reference = among(0.1);
    CHECK(among(0.7) == reference);
    CHECK(among(1e-9) == reference);
}

TEST_CASE("a coordinate that a force moves out of rest at zero is solved for, not taken for solved") {
    const TestMotion pushed{
        "lagrangian = \"q'^2/2 - k*q^4/4 + q*t\"\ntime = \"t\"\n[coordinates]\nq = { position = 0, velocity = 0 }\n"
        "[parameters]\nk = 1\n",
        {1},
        {0},
        {0},
        2.5};
    const Kernel kernel = ensemble_kernel_in_own_cache(derivation_of(pushed, "points = 6"));
    const Starts starts = [&](std::int64_t, EnsembleStart& start) { start = {pushed.parameters, pushed.q, pushed.v}; };
    EnsembleStart start;
    starts(0, start);
    const Kernel one = kernel_alone(pushed, "points = 6");
    CHECK(distance(together(kernel, pushed, 1, 1, starts)[0].last, alone(one, pushed, 1, start)) < 100);
}

TEST_CASE("steps back in time are measured and taken in lanes as those forward") {
    for (const InLanes& in : {all[0], all[1], all[6]}) {
        TestMotion back = in.motion;
        back.step = -back.step;
        const Kernel &kernel = kernel_for(in), one = kernel_alone(in.motion, in.method);
        const Starts starts = around(back);
        const auto kept = together(kernel, back, 9, 100, starts);
        const auto forward = together(kernel, in.motion, 9, 100, starts);
        for (std::size_t i = 0; i < kept.size(); ++i) {
            EnsembleStart start;
            starts(static_cast<std::int64_t>(i), start);
            CHECK(distance(kept[i].last, alone(one, back, 100, start)) <= in.bound);
            CHECK(std::abs(kept[i].iterations - forward[i].iterations) < 40);
        }
    }
}

TEST_CASE("a start that is not a number stops its own trajectory alone") {
    for (const InLanes& in : all) {
        INFO(in.motion.body);
        const Kernel& kernel = kernel_for(in);
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
    const Kernel& kernel = kernel_for(all[6]);
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

TEST_CASE(
    "a lane whose fixed-point iteration cannot contract is continued by Newton's iteration, the others unchanged") {
    // A force without a function is iterated without second derivatives.
    const TestMotion quartic{
        "lagrangian = \"q'^2/2 - k*q^4/4\"\n[coordinates]\nq = { position = 1, velocity = 0.25 }\n"
        "[parameters]\nk = 1\n",
        {1},
        {1},
        {0.25},
        0.5};
    const Derivation derivation = derivation_of(quartic, "points = 4");
    const Kernel kernel = ensemble_kernel_in_own_cache(derivation);
    const auto starts = [&](double k) {
        return [&quartic, k](std::int64_t index, EnsembleStart& start) {
            start = {{index == 3 ? k : 1 + 0.01 * static_cast<double>(index)}, quartic.q, quartic.v};
        };
    };
    const auto calm = together(kernel, quartic, 9, 20, starts(1)), stiff = together(kernel, quartic, 9, 20, starts(20));
    for (std::size_t i = 0; i < 9; ++i)
        if (i != 3) CHECK(stiff[i] == calm[i]);
    CHECK(stiff[3].status == LOBATTO_OK);
    CHECK(stiff[3].steps_done == 20);
    EnsembleStart first;
    starts(20)(3, first);  // its first step is Newton's, to the bit
    const Kernel newton = newton_kernel(derivation, Precision::double_);
    CHECK(together(kernel, quartic, 9, 1, starts(20))[3].last == alone(newton, quartic, 1, first));
    CHECK(together(kernel, quartic, 9, 1, starts(1))[3].last != alone(newton, quartic, 1, first));
    CHECK(distance(stiff[3].last, alone(kernel_alone(quartic, "points = 4"), quartic, 20, first)) < 5000);
}

TEST_CASE("with second derivatives a lane is solved where one trajectory's fixed-point iteration no longer contracts") {
    const Kernel& kernel = kernel_for(all[0]);
    TestMotion wide = pendulum;
    wide.step = 0.5;
    const auto starts = [](double omega) {
        return [omega](std::int64_t index, EnsembleStart& start) {
            start = {{2, index == 3 ? omega : 1 + 0.01 * static_cast<double>(index)}, {1}, {0.25}};
        };
    };
    const auto calm = together(kernel, wide, 9, 20, starts(1)), stiff = together(kernel, wide, 9, 20, starts(6.5));
    for (std::size_t i = 0; i < 9; ++i)
        if (i != 3) CHECK(stiff[i] == calm[i]);
    CHECK(stiff[3].status == LOBATTO_OK);
    EnsembleStart first;
    starts(6.5)(3, first);
    const Kernel newton = newton_kernel(derivation_of(pendulum, "points = 4"), Precision::double_);
    CHECK(together(kernel, wide, 9, 1, starts(6.5))[3].last != alone(newton, wide, 1, first));
    CHECK(distance(stiff[3].last, alone(newton, wide, 20, first)) < 5000);
}

TEST_CASE("a lane whose nodes are far from the angles at the start of the step leaves the bits of the others") {
    const Kernel& kernel = kernel_for(all[2]);
    const auto starts = [](double rate) {
        return [rate](std::int64_t index, EnsembleStart& start) {
            around(double_pendulum)(index, start);
            if (index == 3) start.rate = {rate, rate};
        };
    };
    const double fast = 9;
    REQUIRE(fast * double_pendulum.step > 0.8);  // the end of a step is beyond pi/4
    const auto calm = together(kernel, double_pendulum, 9, 20, starts(0)),
               mixed = together(kernel, double_pendulum, 9, 20, starts(fast));
    for (std::size_t i = 0; i < 9; ++i)
        if (i != 3) CHECK(mixed[i] == calm[i]);
    CHECK(mixed[3].status == LOBATTO_OK);
    CHECK(mixed[3].steps_done == 20);
    // Nor do they change its own.
    const auto same =
        together(kernel, double_pendulum, 9, 20, [&](std::int64_t, EnsembleStart& start) { starts(fast)(3, start); });
    CHECK(same[0] == mixed[3]);
    EnsembleStart start;
    starts(fast)(3, start);
    const Kernel newton = newton_kernel(derivation_of(double_pendulum, "points = 4"), Precision::double_);
    const Kernel one = kernel_alone(double_pendulum, "points = 4");
    CHECK(distance(mixed[3].last, alone(one, double_pendulum, 20, start)) < 5000);
    CHECK(distance(mixed[3].last, alone(newton, double_pendulum, 20, start)) < 5000);
}

TEST_CASE("a pendulum whose nodes move far in an iteration takes the steps of Newton's iteration") {
    TestMotion wide = pendulum;
    wide.step = 1.2;
    const Derivation derivation = derivation_of(pendulum, "points = 9");
    const Kernel kernel = kernel_in_own_cache(derivation, Precision::double_),
                 newton = newton_kernel(derivation, Precision::double_),
                 of_lanes = ensemble_kernel_in_own_cache(derivation);
    EnsembleStart start;
    for (int i = 0; i < 5; ++i) {
        around(wide)(i, start);
        start.rate[0] += i;
        const auto solved = alone(newton, wide, 20, start);
        CHECK(distance(alone(kernel, wide, 20, start), solved) < 5000);
        CHECK(alone(kernel, wide, 20, start) != solved);
        CHECK(alone(of_lanes, wide, 20, start) == solved);  // there only lanes have fixed-point iterations
    }
}

TEST_CASE("a lane that is iterated once more from the start of its step leaves the bits of the others") {
    // Some steps of lane 3 are not solved by fixed-point iterations that begin with the step before; fixed-point
    // iterations that begin anew solve most.
    TestMotion coarse = double_pendulum;
    coarse.step = 0.2;
    const Kernel& kernel = kernel_for(all[2]);
    const auto starts = [](double rate) {
        return [rate](std::int64_t index, EnsembleStart& start) {
            around(double_pendulum)(index, start);
            if (index == 3) start.rate = {rate, -rate};
        };
    };
    const auto calm = together(kernel, coarse, 9, 60, starts(0)), mixed = together(kernel, coarse, 9, 60, starts(5));
    for (std::size_t i = 0; i < 9; ++i)
        if (i != 3) CHECK(mixed[i] == calm[i]);
    CHECK(mixed[3].status == LOBATTO_OK);
    const auto same = together(kernel, coarse, 9, 60, [&](std::int64_t, EnsembleStart& start) { starts(5)(3, start); });
    CHECK(same[0] == mixed[3]);
}

namespace {

// Sixteen trajectories of 50 steps in lanes of four widths; the bits of each.
const char* const widths_program = R"(
#include <cstdio>
#include <cstring>
#include <memory>
#include "kernel.hpp"
#include "motion.hpp"
using namespace lobatto;
using K = kernels::motion;
template <int width> void print() {
    const auto lanes = std::make_unique<Ensemble<K, width>>();
    for (int first = 0; first < 16; first += width) {
        double parameters[2 * width], q[width], p[width];
        Status status[width];
        std::int64_t done[width], iterations[width];
        for (int l = 0; l < width; ++l) {
            parameters[2 * l] = 1 + 0.125 * (first + l);
            parameters[2 * l + 1] = first + l == 11 ? 14 : 1 + 0.0625 * (first + l);  // 11: beyond what fixed-point iterations solve
            q[l] = first + l == 5 ? 0.0 / 0.0 : 0.25 * (first + l) - 2;
            p[l] = 0.5;
        }
        lanes->prepare(parameters, 0.2, status);
        lanes->start(0, q, p, status);
        lanes->advance(50, 0, status, done, iterations);
        lanes->state(q, p);
        for (int l = 0; l < width; ++l) {
            unsigned long long bits[2];
            std::memcpy(bits, q + l, 8);
            std::memcpy(bits + 1, p + l, 8);
            if (first + l == 5) bits[0] = bits[1] = 0;
            std::printf("%d:%d:%lld:%llx:%llx ", first + l, static_cast<int>(status[l]), static_cast<long long>(done[l]),
                        bits[0], bits[1]);
        }
    }
    std::printf("\n");
}
int main() {
    print<2>();
    print<4>();
    print<8>();
    print<16>();
}
)";

}  // namespace

TEST_CASE("lanes give the same bits in any width, on every instruction set, from every compiler" *
          doctest::test_suite("slowest")) {
    const TemporaryFolder folder;
    const KernelSource source = emit(derivation_of(pendulum, "points = 4"));
    write_text(folder / "motion.hpp", source.header);
    write_text(folder / "widths.cpp", widths_program);
    const auto compiled = [&](const std::string& compiler, const std::string& target) {
        const Finished built =
            run({compiler, "-std=c++17", "-O1", "-ffp-contract=off", "-march=" + target, "-I",
                 LOBATTO_SOURCE_DIR "/runtime/kernel", folder / "widths.cpp", "-o", folder / "widths"});
        INFO(built.err);
        REQUIRE(built.exit_code == 0);
    };
    const auto output = [&](const std::string& compiler, const std::string& target) {
        compiled(compiler, target);
        return run({(folder / "widths").string()}).out;
    };
    const auto check_widths = [](const std::string& text) {
        const std::size_t length = text.find('\n') + 1;
        REQUIRE(length > 16 * 30);
        REQUIRE(text.size() == 4 * length);
        for (std::size_t line = 1; line < 4; ++line)
            CHECK(text.substr(line * length, length) == text.substr(0, length));
        CHECK(text.find(" 4:0:50:") != std::string::npos);
        CHECK(text.find(" 5:2:0:0:0 ") != std::string::npos);  // not finite
    };
    const std::string plain = output("g++", "x86-64");
    check_widths(plain);
    const bool has_clang = run({"clang++", "--version"}).exit_code == 0;
    if (has_clang) CHECK(output("clang++", "x86-64") == plain);
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
        const std::string fused = output("g++", "haswell");
        check_widths(fused);
        CHECK(fused != plain);  // fused operations round once
        if (has_clang) CHECK(output("clang++", "haswell") == fused);
    }
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq"))
        check_widths(output("g++", "x86-64-v4"));
    else
        compiled("g++", "x86-64-v4");
}

TEST_SUITE_END();
