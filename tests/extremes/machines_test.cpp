// SPDX-License-Identifier: GPL-2.0-or-later
// Every precision, every member of the family, every compiler and instruction set: the same right answer.
#include <array>

#include "runtime/measure/extrapolation.hpp"
#include "runtime/measure/reference.hpp"
#include "tests/extremes/extremes.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

using Numbers = std::vector<double>;

// q'' = -sin q from (q, v) by the Taylor series of degree 30 in steps of 1/32, s = sin q, c = cos q, s' = c v, c' = -s
// v.
template <class real>
real taylor_pendulum(real q0, real v0, int steps) {
    constexpr int degree = 30;
    const real h = real(1) / 32;
    for (int step = 0; step < steps; ++step) {
        std::array<real, degree + 2> q{}, v{}, s{}, c{};
        q[0] = q0;
        v[0] = v0;
        // The sine and cosine of the start by their own series, so that no library is trusted.
        real term = 1, sine = 0, cosine = 0;
        for (int k = 0; k < 60; ++k) {
            (k % 2 == 0 ? cosine : sine) += k % 4 < 2 ? term : -term;
            term *= q0 / real(k + 1);
        }
        s[0] = sine;
        c[0] = cosine;
        for (int k = 0; k <= degree; ++k) {
            const auto i = static_cast<std::size_t>(k);
            real up = 0, down = 0;
            for (std::size_t j = 0; j <= i; ++j) {
                up += c[j] * v[i - j];
                down -= s[j] * v[i - j];
            }
            q[i + 1] = v[i] / real(k + 1);
            v[i + 1] = -s[i] / real(k + 1);
            s[i + 1] = up / real(k + 1);
            c[i + 1] = down / real(k + 1);
        }
        q0 = v0 = 0;
        for (int k = degree + 1; k >= 0; --k) {
            q0 = q0 * h + q[static_cast<std::size_t>(k)];
            v0 = v0 * h + v[static_cast<std::size_t>(k)];
        }
    }
    return q0;
}

// The pendulum, m = omega = 1, from (1.5, 0.25) to t = 2.
template <class real>
double pendulum_error(Precision precision, const std::string& method, int steps) {
    static const __float128 exact = taylor_pendulum<__float128>(1.5, 0.25, 64);
    const State<real> end = travel<real>(kernel_for(pendulum.body, method, precision), {real(1), real(1)}, {real(1.5)},
                                         {real(0.25)}, real(2) / real(steps), steps);
    if (end.status != LOBATTO_OK) return HUGE_VAL;
    return std::fabs(static_cast<double>(static_cast<__float128>(end.q[0]) - exact));
}

// The double pendulum, to t = 2, against an explicit extrapolation in a wider type: relative to 1 rad.
template <class real, class wide>
double double_pendulum_error(Precision precision, Precision wider, wide tolerance) {
    const auto values = []<class number>(number) {
        return std::array<std::vector<number>, 3>{
            std::vector<number>{number(2), number(1)}, {number(0.5), number(0.75)}, {number(0), number(0.25)}};
    };
    const auto [parameters, q, v] = values(real());
    const State<real> end =
        travel(kernel_for(double_pendulum.body, "points = 8", precision), parameters, q, v, real(1) / real(16), 32);
    const auto [wide_parameters, wide_q, wide_v] = values(wide());
    const Kernel& kernel = kernel_for(double_pendulum.body, "points = 8", wider);
    const State<wide> start = begin(kernel, wide_parameters, wide_q, wide_v, wide(1));
    LoadedStepper<wide> stepper(kernel);
    if (end.status != LOBATTO_OK || stepper.prepare(wide_parameters, wide(1)) != LOBATTO_OK) return HUGE_VAL;
    Extrapolation<wide> other(stepper, std::vector<wide>(4, wide(1)), tolerance);
    other.start(wide(0), start.q, start.p);
    if (!other.advance_to(wide(2))) return HUGE_VAL;
    return distance_of(std::vector<wide>{wide(end.q[0]), wide(end.q[1])}, {other.state()[0], other.state()[1]});
}

// Coupled oscillators, one matrix, k = 1.5: 1000 steps there and 1000 back, relative to 1.
template <class real>
double map_error(Precision precision) {
    const Kernel& kernel = kernel_for(coupled_oscillators.body, "points = 4", precision);
    const std::vector<real> parameters{real(1.5)}, q{real(1), real(0), real(-0.5)}, v{real(0), real(0.5), real(0.25)};
    const State<real> start = begin(kernel, parameters, q, v, real(0.125));
    const State<real> there = follow(kernel, parameters, start, real(0.125), 1000);
    const State<real> back = follow(kernel, parameters, there, real(-0.125), 1000);
    if (back.status != LOBATTO_OK || !(distance_of(there.q, start.q) > 0.01)) return HUGE_VAL;
    return distance_of(back.q, start.q);
}

// The largest error of the members of a family, each with a step for its order.
double family_error(bool gauss) {
    double largest = 0;
    for (int s = gauss ? 1 : 2; s <= (gauss ? 10 : 12); ++s) {
        const int order = gauss ? 2 * s : 2 * s - 2;
        const int steps = order == 2 ? 100000 : order == 4 ? 1000 : order == 6 ? 128 : 64;
        const std::string method =
            gauss ? "family = \"gauss\"\nstages = " + std::to_string(s) : "points = " + std::to_string(s);
        largest = std::fmax(largest, pendulum_error<double>(Precision::double_, method, steps));
    }
    return largest;
}

// After 200 steps, from the kernel of a compiler and an instruction set of its own, by a script in place of the
// compiler.
State<double> state_by(const std::string& compiler, const std::string& flags, const lobatto::test::Motion& motion,
                       const std::string& words_of_user = "") {
    const TemporaryFolder folder;
    write_script(folder / compiler, "exec /usr/bin/" + compiler + " \"$@\" " + flags + "\n");
    const EnvironmentVariable program("CXX", (folder / compiler).string() + words_of_user);
    const EnvironmentVariable cache("LOBATTO_CACHE_DIR", (folder / "cache").string());
    const Kernel kernel = kernel_in_own_cache(derivation_of(motion, "points = 4"), Precision::double_);
    return travel(kernel, motion.parameters, motion.q, motion.v, motion.step, 200);
}

// All instructions of this machine, none fused (AVX-512 has its own), plain x86-64 (the last of several -march counts):
// by g++ and clang++.
using Pair = std::pair<State<double>, State<double>>;
const std::vector<Pair>& machines(const lobatto::test::Motion& motion) {
    static std::map<const lobatto::test::Motion*, std::vector<Pair>> made;
    std::vector<Pair>& all = made[&motion];
    if (all.empty())
        for (const std::string flags : {"", "-mno-fma -mno-avx512f", "-march=x86-64"})
            all.emplace_back(state_by("g++", flags, motion), state_by("clang++", flags, motion));
    return all;
}

double largest_difference(const lobatto::test::Motion& motion) {
    const State<double>& first = machines(motion).front().first;
    double largest = 0;
    for (const auto& [gcc, clang] : machines(motion))
        for (const State<double>* other : {&gcc, &clang}) {
            if (other->status != LOBATTO_OK) return HUGE_VAL;
            largest = std::fmax(largest, std::fmax(distance_of(first.q, other->q), distance_of(first.p, other->p)));
        }
    return largest;
}

bool compilers_agree(const lobatto::test::Motion& motion) {
    return std::all_of(machines(motion).begin(), machines(motion).end(), [](const Pair& pair) {
        return pair.first.status == LOBATTO_OK && pair.first.q == pair.second.q && pair.first.p == pair.second.p;
    });
}

const Extremes table(
    8, "Precisions",
    {
        right_to(2e-6, "rad", "pendulum in float, 6 points, h = 1/16",
                 [] { return pendulum_error<float>(Precision::single, "points = 6", 32); }),
        right_to(2e-15, "rad", "pendulum in double, 10 points, h = 1/16",
                 [] { return pendulum_error<double>(Precision::double_, "points = 10", 32); }),
        right_to(3e-18, "rad", "pendulum in long double, 10 points, h = 1/16",
                 [] { return pendulum_error<long double>(Precision::extended, "points = 10", 32); }),
        right_to(2e-33, "rad", "pendulum in __float128, 10 points, h = 1/32",
                 [] { return pendulum_error<__float128>(Precision::quadruple, "points = 10", 64); }),
        right_to(2e-6, "rad", "double pendulum in float, 8 points, h = 1/16",
                 [] { return double_pendulum_error<float>(Precision::single, Precision::double_, 1e-13); }),
        right_to(1e-14, "rad", "double pendulum in double, likewise",
                 [] { return double_pendulum_error<double>(Precision::double_, Precision::extended, 1e-17L); }),
        right_to(5e-18, "rad", "double pendulum in long double, likewise",
                 [] {
                     return double_pendulum_error<long double>(Precision::extended, Precision::quadruple,
                                                               __float128(1e-25));
                 }),
        right_to(2e-5, "of the start", "coupled oscillators in float, 1000 steps there and back",
                 [] { return map_error<float>(Precision::single); }),
        right_to(2e-14, "of the start", "coupled oscillators in double, likewise",
                 [] { return map_error<double>(Precision::double_); }),
        right_to(5e-17, "of the start", "coupled oscillators in long double, likewise",
                 [] { return map_error<long double>(Precision::extended); }),
        right_to(1e-32, "of the start", "coupled oscillators in __float128, likewise",
                 [] { return map_error<__float128>(Precision::quadruple); }),
    });

const Extremes long_table(
    9, "Members, compilers, instruction sets",
    {
        right_to(1e-9, "rad", "pendulum by Lobatto, 2 to 12 points, each with a step for its order",
                 [] { return family_error(false); }),
        right_to(1e-9, "rad", "pendulum by Gauss, 1 to 10 stages, likewise", [] { return family_error(true); }),
        right_to(1e-12, "rad", "pendulum: g++ and clang++, all instructions of this machine, none fused, plain x86-64",
                 [] { return largest_difference(pendulum); }),
        right_to(1e-11, "rad", "double pendulum: the same six", [] { return largest_difference(double_pendulum); }),
        says("the same bits", "pendulum and double pendulum from g++ and clang++, for one instruction set",
             [] { return compilers_agree(pendulum) && compilers_agree(double_pendulum); }),
    });

}  // namespace

TEST_CASE("every precision ends in its own right answer") {
    table.check();
}

TEST_CASE("every member, compiler and instruction set ends in the right answer" * doctest::test_suite("slowest")) {
    long_table.check();
}

TEST_CASE("kernels compiled with -Og, as some tests do, have the bits of those that users have") {
    for (const lobatto::test::Motion* motion :
         {&lobatto::test::pendulum, &lobatto::test::henon_heiles, &lobatto::test::spherical_pendulum,
          &lobatto::test::double_pendulum, &lobatto::test::driven_pendulum}) {
        const State<double> usual = state_by("g++", "", *motion), quick = state_by("g++", "", *motion, " -Og");
        CHECK(usual.status == LOBATTO_OK);
        CHECK(usual.q == quick.q);
        CHECK(usual.p == quick.p);
    }
}
