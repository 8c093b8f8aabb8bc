// SPDX-License-Identifier: GPL-2.0-or-later
// Steps of chains and rings with neighbouring coordinates in lanes: solved in registers or in memory, the same bits.
#include <doctest/doctest.h>

#include <string>

#include "tests/built_and_run.hpp"
#include "tests/motions.hpp"
#include "tests/support.hpp"

using namespace lobatto;
using namespace lobatto::test;

namespace {

// Its formulas in all ways, and steps of a kernel in both (or twice in memory, of which address sanitisers know);
// prints what differs, then how many steps and evaluations there were.
const char* const program = R"(
#include <cmath>
#include <cstdio>
#include <cstring>
#include "kernel.hpp"
#include "motion.hpp"
using namespace lobatto;
using K = kernels::motion;
static NeighbourFixedPoint<K, IN_REGISTERS> within;
static NeighbourFixedPoint<K, false> through;
template <class FixedPoint> void begin(FixedPoint& fixed_point, const K::Coefficients& k, double h, double tolerance,
                                   bool prepares = true) {
    double q[K::coordinates], u[K::coordinates], W[K::coordinates];
    for (int i = 0; i < K::coordinates; ++i) q[i] = std::sin(0.3 * i), u[i] = 0.1 * std::cos(i);
    Formulas<K>::minus_acceleration(k, 0.0, static_cast<const double*>(q), +W);
    if (prepares) fixed_point.prepare(k, h);
    fixed_point.tolerance = tolerance;
    fixed_point.begin(q, u, W);
}
// W in three ways against W beside the second derivatives, which is computed row by row without any of these.
template <class How, class Position, class Slope> void accelerate(const K::Coefficients& k, Position q, Slope W) {
    if constexpr (K::autonomous)
        K::minus_acceleration<How>(k, q, W);
    else
        K::minus_acceleration<How>(k, 0.25, q, W);
}
static void compare_formulas() {
    constexpr int n = K::coordinates, width = native_lanes<double>, parts = (n + width - 1) / width;
    using V = Pack<double, width>;
    K::Coefficients k;
    K::prepare(K::Parameters(), 0.1, k);
    double q[n], exact[n], second[K::entries], one[n];
    alignas(V) double room[room_of<K>] = {}, side[room_of<K>] = {};
    for (int i = 0; i < n; ++i) room[i] = q[i] = std::sin(0.3 * i) + 0.01 * i;
    Formulas<K>::node(k, 0.25, static_cast<const double*>(q), +exact, +second);
    accelerate<OneByOne>(k, static_cast<const double*>(q), +one);
    accelerate<SideBySide>(k, static_cast<const double*>(room), +side);
    V position[parts], slope[parts];
    for (int i = 0; i < parts; ++i) position[i] = V::load(room + i * width);
    accelerate<WrittenOut>(k, Registers<V, parts>{position}, Registers<V, parts>{slope});
    for (int i = 0; i < n; ++i) {
        const double written = slope[i / width][i % width];
        for (const double W : {one[i], side[i], written})
            if (!(std::fabs(W - exact[i]) < 1e-13)) std::printf("W of %d: %g for %g\n", i, W, exact[i]);
    }
}
static bool same(const double* a, const double* b) { return std::memcmp(a, b, sizeof(double) * K::coordinates) == 0; }
// What a motion before has measured must not show.
static void begin_again() {
    K::Coefficients k;
    K::prepare(K::Parameters(), 0.2, k);
    double end[2][K::coordinates];
    for (int run = 0; run < 2; ++run) {
        begin(through, k, 0.2, 1e-9, run == 0);
        for (int i = 0; i < 47; ++i)
            if (!through.step(k, i * 0.2)) std::printf("step %d failed\n", i);
        for (int c = 0; c < K::coordinates; ++c) end[run][c] = through.q[through.now][c];
    }
    if (!same(end[0], end[1])) std::printf("a second run differs\n");
}
// A blow that runs into a chain at rest: each step against the same step iterated to rounding with a look at every
// iteration, in units of the largest displacement. What the first hundred steps, to 1e-2, have measured must not serve.
static void follow_a_blow(double h, double tolerance, double bound) {
    static NeighbourFixedPoint<K, IN_REGISTERS> fixed_point, looking;
    double q[K::coordinates] = {}, u[K::coordinates] = {}, W[K::coordinates];
    u[3] = 1.5;
    K::Coefficients k;
    K::prepare(K::Parameters(), h, k);
    Formulas<K>::minus_acceleration(k, 0.0, static_cast<const double*>(q), +W);
    fixed_point.prepare(k, h);
    fixed_point.begin(q, u, W);
    double worst = 0;
    int quick = 0;
    const int loose = 100, count = 500;
    for (int i = 0; i < count; ++i) {
        fixed_point.tolerance = i < loose ? 1e-2 : tolerance;
        looking = fixed_point;
        looking.tolerance = 0;
        looking.expected = 0;
        const int before = fixed_point.until_measured;
        if (!looking.step(k, i * h) || !fixed_point.step(k, i * h)) std::printf("step %d of a blow failed\n", i);
        if (fixed_point.until_measured == before - 1) ++quick;
        double difference = 0, displacement = 0;
        for (int c = 0; c < K::coordinates; ++c) {
            difference = std::fmax(difference, std::fabs(fixed_point.q[fixed_point.now][c] - looking.q[looking.now][c]));
            difference = std::fmax(difference, h * std::fabs(fixed_point.u[fixed_point.now][c] - looking.u[looking.now][c]));
            displacement = std::fmax(displacement, std::fabs(looking.q[looking.now][c] - looking.q[looking.then][c]));
        }
        if (i >= loose) worst = std::fmax(worst, difference / displacement);
    }
    if (!(worst < bound)) std::printf("a blow, h = %g, to %g: off by %g\n", h, tolerance, worst);
    if (!(quick > count / 2)) std::printf("a blow, h = %g, to %g: %d of %d steps are quick\n", h, tolerance, quick, count);
}
int main() {
    compare_formulas();
    begin_again();
    for (const double h : {0.02, 0.1}) {
        follow_a_blow(h, 0, 1e-13);
        follow_a_blow(h, 1e-9, 4e-9);
        follow_a_blow(h, 1e-5, 4e-5);
    }
    follow_a_blow(0.19, 1e-9, 2e-8);  // at most 9e-9; 5e-5 of a chain between walls, when what 1e-2 measured served
    int steps = 0, evaluations = 0, failed = 0;
    for (const double h : {0.05, 0.2, 40.0})
        for (const double tolerance : {0.0, 1e-9}) {
            K::Coefficients k;
            K::prepare(K::Parameters(), h, k);
            begin(within, k, h, tolerance);
            begin(through, k, h, tolerance);
            for (int i = 0; i < 60; ++i) {
                const bool good = within.step(k, i * h), other = through.step(k, i * h);
                if (good != other || within.evaluations != through.evaluations) std::printf("step %d differs\n", i);
                if (!good) ++failed;
                if (!good) break;
                if (!same(within.q[within.now], through.q[through.now])) std::printf("q differs in step %d\n", i);
                if (!same(within.u[within.now], through.u[through.now])) std::printf("u differs in step %d\n", i);
                for (int node = 0; node < K::points; ++node)
                    for (int c = 0; c < K::coordinates; ++c)
                        if (within.minus_acceleration(node, c) != through.minus_acceleration(node, c))
                            std::printf("W differs in step %d\n", i);
                ++steps;
                evaluations += within.evaluations;
            }
        }
    std::printf("%d steps, %d failed, %s\n", steps, failed, evaluations > steps ? "solved" : "not solved");
}
)";

// A chain between walls, with masses of their own, pulled on by a force that depends on time.
const char* const driven_chain =
    "time = \"t\"\nlagrangian = \"\"\"sum(i = 1 .. 21, (1 + i/8)*x[i]'^2/2 + a*cos(t)*x[i])\n"
    "  - sum(i = 2 .. 21, spring[i]) - x[1]^2/2 - x[21]^2/2 - x[21]^4/8\"\"\"\n"
    "[definitions]\n\"spring[i]\" = \"(x[i] - x[i-1])^2/2 + b*(x[i] - x[i-1])^4/4\"\n"
    "[coordinates]\nx = { count = 21, position = \"i/40\", velocity = 0 }\n[parameters]\na = 0.25\nb = 0.5\n";
// A closed one, whose last row is no neighbour's; with sines beside the springs, and springs to the second next.
const char* const closed_chain =
    "lagrangian = \"\"\"sum(i = 1 .. 24, x[i]'^2/2 + cos(x[i]))\n"
    "  - sum(i = 1 .. 24, (x[mod(i, 24) + 1] - x[i])^4/4) - sum(i = 1 .. 22, (x[i+2] - x[i])^2/16)\"\"\"\n"
    "[coordinates]\nx = { count = 24, position = \"i/40\", velocity = 0 }\n";

// Chains on walls: both, with masses of their own; or one, beside other forces and before them.
const char* const hung_chain =
    "lagrangian = \"\"\"sum(i = 1 .. 21, (1 + i/8)*x[i]'^2/2) - sum(i = 2 .. 21, spring[i])\n"
    "  - x[1]^2/2 - x[1]^4/8 - x[21]^2/2 - x[21]^4/8\"\"\"\n"
    "[definitions]\n\"spring[i]\" = \"(x[i] - x[i-1])^2/2 + (x[i] - x[i-1])^4/8\"\n"
    "[coordinates]\nx = { count = 21, position = \"i/40\", velocity = 0 }\n";
const char* const half_hung_chain =
    "lagrangian = \"\"\"sum(i = 1 .. 16, x[i]'^2/2 - x[i]^4/4) - sum(i = 1 .. 15, (x[i+1] - x[i])^6/6) - x[16]^6/6\n"
    "  - (x[3] - x[9])^2/2\"\"\"\n[coordinates]\nx = { count = 16, position = \"i/40\", velocity = 0 }\n";

}  // namespace

// What computes here are kernels, which no sanitiser of ours looks into.
TEST_SUITE_BEGIN("slow");

TEST_CASE("a step along neighbours has the same bits in registers and in memory, and stays within its arrays" *
          doctest::test_suite("slowest")) {
    const TemporaryFolder folder;
    write_text(folder / "both.cpp", program);
    const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    const bool has_avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
    for (const char* const body : {driven_chain, closed_chain, hung_chain, half_hung_chain})
        for (const char* const method : {"points = 5", "family = \"gauss\"\nstages = 2"}) {
            INFO(body << method);
            const Derivation derivation =
                derivation_of(Motion{body, {}, {}, {}, 0.1}, method, "energy = false\ntangent = false");
            REQUIRE(derivation.structure.neighbours());
            const std::string header = emit(derivation).header;
            CHECK((header.find("_run, lobatto::fixed_") != std::string::npos) ==
                  (body == hung_chain || body == half_hung_chain));
            write_text(folder / "motion.hpp", header);
            const auto check = [&](const std::vector<std::string>& target, bool runs_here) {
                INFO(target.front());
                const std::optional<Finished> both = built_and_run(folder, "both", target, runs_here);
                if (!both) return;
                CHECK(both->out == "240 steps, 2 failed, solved\n");
                CHECK(both->err == "");
            };
            check({"-march=x86-64", "-O0", "-DIN_REGISTERS=false", "-fsanitize=address"}, true);
            check({"-march=haswell", "-O1", "-DIN_REGISTERS=true"}, has_avx2);
            check({"-march=x86-64-v4", "-O1", "-DIN_REGISTERS=true"}, has_avx512);
        }
}

TEST_SUITE_END();
