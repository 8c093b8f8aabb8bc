// SPDX-License-Identifier: GPL-2.0-or-later
// Clean kernels: the motions of plain ones to rounding, which grows by Brouwer's law.
#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "analysis/accuracy/roundoff_growth.hpp"
#include "runtime/build/library.hpp"
#include "runtime/error.hpp"
#include "tests/motions.hpp"
#include "tests/support.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

const char* const untangent = "tangent = false";

// Its mass matrix is constant, but not diagonal.
const Motion coupled_masses{
    "lagrangian = \"x'^2 + x'*y' + y'^2 - (x^4/4 + y^2/2 + x*y^2/2)\"\n[coordinates]\nx = { position = 0.75, velocity "
    "= 0 }\n"
    "y = { position = 0.25, velocity = 0.5 }\n",
    {},
    {0.75, 0.25},
    {0, 0.5},
    0.1};

template <class real>
constexpr real epsilon = std::numeric_limits<real>::epsilon();
template <>
inline constexpr __float128 epsilon<__float128> = __float128(0x1p-56) * __float128(0x1p-56);

template <class real>
struct State {
    std::vector<real> q, p;
};

template <class real>
State<real> after(LoadedStepper<real>& stepper, std::int64_t steps) {
    lobatto_advance call{};
    call.steps = steps;
    CHECK(stepper.advance(call) == LOBATTO_OK);
    State<real> state;
    real time = 0;
    stepper.state(time, state.q, state.p);
    return state;
}

// In units of epsilon of the largest position or momentum.
template <class real>
double distance(const State<real>& a, const State<real>& b) {
    real most = 0, size = 0;
    for (const auto values : {&State<real>::q, &State<real>::p})
        for (std::size_t i = 0; i < (a.*values).size(); ++i) {
            const real difference = (a.*values)[i] - (b.*values)[i], value = (b.*values)[i];
            if (!(difference - difference == 0)) return std::numeric_limits<double>::infinity();
            most = std::max(most, difference < 0 ? -difference : difference);
            size = std::max(size, value < 0 ? -value : value);
        }
    return static_cast<double>(most / size / epsilon<real>);
}

std::string clean(const std::string& method) {
    return method + "\narithmetic = \"clean\"";
}

template <class real>
double difference(const Motion& motion, const std::string& method, Precision precision, std::int64_t steps,
                  double step) {
    auto plain = started<real>(kernel_in_own_cache(derivation_of(motion, method, untangent), precision), motion, step);
    auto other =
        started<real>(kernel_in_own_cache(derivation_of(motion, clean(method), untangent), precision), motion, step);
    return distance(after(other, steps), after(plain, steps));
}

Scene kepler_scene(const std::string& method) {
    Scene scene = read_scene(Source("kepler.toml", "title = \"Kepler\"\n" + kepler.body + "[method]\n" + method +
                                                       "\n[run]\nstep = 0.05\nuntil = 1\n"));
    return scene;
}

}  // namespace

TEST_CASE("clean steps are plain ones to rounding, of every member and of every kind of scene") {
    for (const auto& subject : std::vector<std::pair<Motion, std::string>>{{pendulum, "points = 2"},
                                                                           {pendulum, "family = \"gauss\"\nstages = 3"},
                                                                           {driven_pendulum, "points = 5"},
                                                                           {chain(), "points = 4"},
                                                                           {coupled_masses, "points = 5"},
                                                                           {lattice(), "points = 6"}}) {
        const Motion& motion = subject.first;
        const std::string& method = subject.second;
        INFO(motion.body << method);
        const double distance = difference<double>(motion, method, Precision::double_, 200, motion.step);
        CHECK(distance < 500);  // 1.6 ... 80 measured
        CHECK(distance > 0);
    }
}

TEST_CASE("clean steps are plain ones to rounding in every precision") {
    CHECK(difference<float>(henon_heiles, "points = 6", Precision::single, 100, 0.2) < 300);          // 21 measured
    CHECK(difference<__float128>(henon_heiles, "points = 6", Precision::quadruple, 100, 0.2) < 300);  // 14 measured
}

TEST_CASE("where the fixed-point iteration does not contract clean steps are found by Newton's iteration") {
    // h omega = 8: an iteration with Gauss's three stages enlarges errors threefold.
    const double step = 8 / std::sqrt(1.5);
    const std::string method = "family = \"gauss\"\nstages = 3";
    CHECK(difference<double>(harmonic_oscillator, method, Precision::double_, 50, step) < 500);
    CHECK(difference<double>(pendulum, "points = 4", Precision::double_, 50, 1.5) < 5000);
}

TEST_CASE("iterations that alternate, or that begin at rest, are not taken for solved") {
    // h omega = 2 with the midpoint rule: each iteration turns the error round, X = a - X, for ever.
    Motion oscillator = harmonic_oscillator;
    oscillator.parameters = {1, 1};
    CHECK(difference<double>(oscillator, "family = \"gauss\"\nstages = 1", Precision::double_, 50, 2) < 1000);
    // The same beside a coordinate 1e18 times as large.
    Motion both{
        "lagrangian = \"(a'^2 + b'^2)/2 - a^2/8 - 2*b^2\"\n[coordinates]\na = { position = 1e18, velocity = 0 }\nb = { "
        "position = 1, velocity = 0 }\n",
        {},
        {1e18, 1},
        {0, 0},
        1};
    const std::string midpoint = "family = \"gauss\"\nstages = 1";
    auto beside = started<double>(
        kernel_in_own_cache(derivation_of(both, clean(midpoint), untangent), Precision::double_), both, 1);
    CHECK(std::fabs(after(beside, 50).q[1]) < 1.5);  // -1 or 0 or 1
    // Nothing moves yet, so nothing is small beside the motion; iterations enlarge errors threefold.
    const Motion stiff{
        "time = \"t\"\nlagrangian = \"q'^2/2 - 32*(q - sin(t))^2\"\n[coordinates]\nq = { position = 0, "
        "velocity = 0 }\n",
        {},
        {0},
        {0},
        1};
    CHECK(difference<double>(stiff, "family = \"gauss\"\nstages = 3", Precision::double_, 5, 1) < 1000);
}

TEST_CASE("a coordinate is solved to its own rounding beside one that moves 1e13 times as far") {
    // Sweeps leave 0.4 of the error of b, each.
    Motion both{
        "lagrangian = \"(a'^2 + b'^2)/2 - a^2/2 - 8.5*b^2/2\"\n[coordinates]\na = { position = 1e13, velocity = 0 }\n"
        "b = { position = 1, velocity = 0 }\n",
        {},
        {1e13, 1},
        {0, 0},
        1};
    const std::string method = "family = \"gauss\"\nstages = 3";
    auto plain =
        started<double>(kernel_in_own_cache(derivation_of(both, method, untangent), Precision::double_), both, 1);
    auto other = started<double>(kernel_in_own_cache(derivation_of(both, clean(method), untangent), Precision::double_),
                                 both, 1);
    CHECK(std::fabs(after(other, 50).q[1] - after(plain, 50).q[1]) < 1e-12);
}

TEST_CASE("clean steps forward and backward return to rounding") {
    const Kernel kernel =
        kernel_in_own_cache(derivation_of(kepler, clean("points = 6"), untangent), Precision::double_);
    auto forth = started<double>(kernel, kepler, 0.05);
    const State<double> there = after(forth, 1000);
    LoadedStepper<double> back(kernel);
    REQUIRE(back.prepare(kepler.parameters, -0.05) == LOBATTO_OK);
    REQUIRE(back.start(0, there.q, there.p) == LOBATTO_OK);
    const State<double> here = after(back, 1000);
    auto start = started<double>(kernel, kepler, 0.05);
    CHECK(distance(here, after(start, 0)) < 5000);  // 60 measured
}

TEST_CASE("a clean kernel tells positions and velocities in two numbers each, a plain one does not") {
    const Derivation derivation = derivation_of(kepler, clean("points = 6"), untangent);
    auto stepper = started<double>(kernel_in_own_cache(derivation, Precision::double_), kepler, 0.05);
    const State<double> state = after(stepper, 10);
    std::vector<double> q, q_rest, v, v_rest;
    REQUIRE(stepper.two_fold_state(q, q_rest, v, v_rest));
    CHECK(q == state.q);
    double largest = 0;
    for (std::size_t k = 0; k < 2; ++k) {
        CHECK(q[k] + q_rest[k] == q[k]);
        CHECK(v[k] + v_rest[k] == v[k]);
        largest = std::max({largest, std::fabs(q_rest[k]), std::fabs(v_rest[k])});
    }
    CHECK(largest > 1e-19);
    auto plain = started<double>(
        kernel_in_own_cache(derivation_of(kepler, "points = 6", untangent), Precision::double_), kepler, 0.05);
    CHECK(!plain.two_fold_state(q, q_rest, v, v_rest));
}

TEST_CASE("rounding grows by Brouwer's law in clean arithmetic, and is below 1e-15 where plain is not") {
    const volatile int interrupted = 0;
    const RoundoffResult result = roundoff_growth(kepler_scene("points = 6"), 20000, 16, true, &interrupted);
    const RoundoffRow &plain = result.plain.rows.back(), &clean = result.clean.rows.back();
    REQUIRE(clean.steps == 20000);
    CHECK(clean.energy_rms < 8e-16);                 // 4.5e-16 measured; 9.5e-16 after 100000
    CHECK(plain.energy_rms > 8 * clean.energy_rms);  // 1.5e-14
    CHECK(std::fabs(clean.energy_mean) < clean.energy_rms);
    CHECK(result.clean.energy_exponent > 0.2);
    CHECK(result.clean.energy_exponent < 0.8);  // 0.5 is the law
    CHECK(result.clean.position_exponent > 0.9);
    CHECK(result.clean.position_exponent < 1.9);  // 1.5
}

TEST_CASE("without steps in long double energies are compared with the first, and positions with nothing") {
    const volatile int interrupted = 0;
    const Scene scene = kepler_scene("points = 10");  // whose own error of H is far below rounding
    const RoundoffResult with = roundoff_growth(scene, 2000, 4, true, &interrupted),
                         without = roundoff_growth(scene, 2000, 4, false, &interrupted);
    CHECK(without.clean.rows.back().energy_rms == doctest::Approx(with.clean.rows.back().energy_rms).epsilon(0.05));
    CHECK(without.plain.rows.back().energy_rms == doctest::Approx(with.plain.rows.back().energy_rms).epsilon(0.05));
    CHECK(std::isnan(without.clean.rows.back().position_rms));
    CHECK(std::isnan(without.clean.position_exponent));
}

TEST_CASE("steps that visit the same phases again and again gain no energy steadily") {
    // Ten steps a period; with h b_2 = 1/24 rounded before it is multiplied the mean was 8e-14 after 200000.
    Scene scene = read_scene(Source(
        "oscillator.toml",
        "title = \"Oscillator\"\nlagrangian = \"q'^2/2 - omega^2*q^2/2\"\n[coordinates]\nq = { position = "
        "\"pi/2\", velocity = 0 }\n[parameters]\nomega = \"2*pi\"\n[method]\npoints = 4\n[run]\nstep = 0.1\nuntil = "
        "1\n"));
    const volatile int interrupted = 0;
    const RoundoffResult result = roundoff_growth(scene, 100000, 8, true, &interrupted);
    CHECK(std::fabs(result.clean.rows.back().energy_mean) < 1e-14);  // 1.1e-15 measured
}

TEST_CASE("roundoff has nothing to compare where masses change, and says so") {
    const Finished refused = run({LOBATTO_PROGRAM, "roundoff", LOBATTO_SOURCE_DIR "/scenes/double_pendulum.toml"});
    CHECK(refused.exit_code == 2);
    CHECK(refused.err.find("depends on the position: there is nothing to compare") != std::string::npos);
}

TEST_CASE("roundoff has nothing to compare for splitting methods, and says so") {
    const TemporaryFolder folder;
    write_text(folder / "swing.toml",
               "lagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = 1, velocity = 0 }\n[method]\n"
               "family = \"splitting\"\n[run]\nstep = 0.1\nuntil = 1\n");
    const Finished refused = run({LOBATTO_PROGRAM, "roundoff", folder / "swing.toml", "-o", folder / "out"});
    CHECK(refused.exit_code == 2);
    CHECK(refused.err == (folder / "swing.toml").string() +
                             std::string(": `lobatto roundoff` compares plain arithmetic with clean, which splitting "
                                         "methods do not have; choose Lobatto (--points 8) or Gauss (--stages 4)\n"));
}

TEST_CASE(
    "the table of roundoff appears as a whole, and a folder that refuses it is named before anything is measured") {
    const TemporaryFolder folder;
    const auto measure = [](const std::string& where) {
        return run({LOBATTO_PROGRAM, "roundoff", LOBATTO_SOURCE_DIR "/scenes/pendulum.toml", "--steps", "100",
                    "--trajectories", "2", "--no-reference", "--no-picture", "-o", where});
    };
    const std::string of_before = "steps,plain mean of H, of before\n";
    write_text(folder / "roundoff.csv", of_before);
    std::filesystem::create_hard_link(folder / "roundoff.csv", folder / "before");
    const Finished done = measure(folder.string());
    CHECK_MESSAGE(done.exit_code == 0, done.err);
    CHECK(read_file(folder / "roundoff.csv").starts_with("steps,plain mean of H,"));
    CHECK(read_file(folder / "before") == of_before);

    const Finished refused = measure(folder / "before");
    CHECK(refused.exit_code == 4);
    CHECK(refused.out == "");
    CHECK(refused.err == "lobatto: cannot create the folder " + (folder / "before").string() +
                             ": Not a directory. Choose another place with -o\n");
}

TEST_CASE("a measurement that is interrupted tells what it has") {
    const Scene scene = kepler_scene("points = 6");
    volatile int interrupted = 1;  // before it begins
    const RoundoffResult nothing = roundoff_growth(scene, 1000, 4, false, &interrupted);
    CHECK(nothing.interrupted);
    CHECK(nothing.plain.rows.empty());
    RoundoffResult some;
    for (int wait = 500; some.clean.rows.empty() && wait < 100000; wait *= 4) {  // until it has begun
        interrupted = 0;
        std::thread signal([&interrupted, wait] {
            std::this_thread::sleep_for(std::chrono::milliseconds(wait));
            interrupted = 1;
        });
        some = roundoff_growth(scene, 1000000000, 4, false, &interrupted);
        signal.join();
    }
    CHECK(some.interrupted);
    CHECK(some.trajectories > 0);
    REQUIRE(!some.clean.rows.empty());
    CHECK(some.steps == some.clean.rows.back().steps);
    CHECK(some.clean.rows.back().energy_rms > 0);
    CHECK(some.clean.nanoseconds > 0);
}

TEST_CASE("energies that a motion does not conserve are not compared with the first") {
    const volatile int interrupted = 0;
    const Scene driven = read_scene(Source("driven.toml", "title = \"Driven\"\n" + driven_pendulum.body +
                                                              "[method]\npoints = 4\n[run]\nstep = 0.1\nuntil = 1\n"));
    CHECK_THROWS_AS(roundoff_growth(driven, 100, 2, false, &interrupted), InputError);
    CHECK(roundoff_growth(driven, 100, 2, true, &interrupted).clean.rows.back().energy_rms < 1e-13);
}

TEST_CASE("clean steps have the same bits in units that are powers of two apart, whatever their size") {
    const Kernel kernel =
        kernel_in_own_cache(derivation_of(harmonic_oscillator, clean("points = 5"), untangent), Precision::double_);
    const auto run = [&](int length, int time) {
        LoadedStepper<double> stepper(kernel);
        // m = 2, k = 3 / T^2, h = 0.1 T; q = L, v = L / 2 T
        REQUIRE(stepper.prepare({2, std::ldexp(3, -2 * time)}, std::ldexp(0.1, time)) == LOBATTO_OK);
        REQUIRE(stepper.start(0, {std::ldexp(1, length)}, {std::ldexp(1, length - time)}) == LOBATTO_OK);
        const State<double> state = after(stepper, 1000);
        return std::pair(std::ldexp(state.q[0], -length), std::ldexp(state.p[0], time - length));
    };
    const auto expected = run(0, 0);
    for (const auto& units : {std::pair(900, 0), std::pair(-990, 0), std::pair(0, 400), std::pair(0, -400),
                              std::pair(300, -300), std::pair(-300, 300)}) {
        const int length = units.first, time = units.second;
        INFO(length << ' ' << time);
        CHECK(run(length, time) == expected);
    }
}

TEST_CASE("clean steps from rest, driven, and past coordinates that hardly move are plain ones") {
    const Motion driven{
        "time = \"t\"\nlagrangian = \"q'^2/2 - (q - sin(t))^2/2\"\n[coordinates]\nq = { position = 0, velocity = 0 "
        "}\n",
        {},
        {0},
        {0},
        0.5};
    CHECK(difference<double>(driven, "points = 6", Precision::double_, 1, 0.5) < 100);
    // A mode with a node at the middle mass, which is moved by its neighbours' rounding alone.
    Motion symmetric{
        "lagrangian = \"sum(i = 1 .. 7, x[i]'^2/2) - sum(i = 2 .. 7, s[i]) - x[1]^2/2 - x[7]^2/2\"\n[definitions]\n"
        "\"s[i]\" = \"(x[i] - x[i-1])^2/2 + 0.3*(x[i] - x[i-1])^4/4\"\n[coordinates]\nx = { count = 7, "
        "position = \"i\", velocity = 0 }\n",
        {},
        {0.7071067811865476, 1, 0.7071067811865476, 1e-17, -0.7071067811865476, -1, -0.7071067811865476},
        std::vector<double>(7, 0.0),
        0.3};
    CHECK(difference<double>(symmetric, "points = 6", Precision::double_, 1000, 0.3) < 1e5);
}

TEST_CASE(
    "round-off is measured in units of the motion's energy, also where H(0) is nothing, and what is none is told") {
    Scene scene =
        read_scene(Source("scene.toml",
                          "title = \"P\"\nlagrangian = \"q'^2/2 + cos(q)\"\n[coordinates]\nq = { position = "
                          "\"pi/2\", velocity = 0 }\n[method]\npoints = 6\narithmetic = \"clean\"\n[run]\nstep "
                          "= 0.1\nuntil = 10\n"));
    volatile int interrupted = 0;
    const RoundoffResult small = roundoff_growth(scene, 1000, 4, true, &interrupted);
    CHECK_FALSE(small.lost);
    CHECK(small.clean.rows.back().energy_rms < 1e-14);
    CHECK(small.plain.rows.back().energy_rms < 1e-13);
    scene =
        read_scene(Source("scene.toml",
                          "title = \"O\"\nlagrangian = \"q'^2/2 - q^2/2\"\n[coordinates]\nq = { position = 1, velocity "
                          "= 0 }\n[method]\npoints = 2\narithmetic = \"clean\"\n[run]\nstep = 2.05\nuntil = 10\n"));
    CHECK(roundoff_growth(scene, 100, 4, false, &interrupted).lost);
}
