// SPDX-License-Identifier: GPL-2.0-or-later
// Splitting methods: their coefficients, and their steps against hand-written ones.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "analysis/gradients.hpp"
#include "analysis/stability/limit.hpp"
#include "analysis/tradeoff/candidate.hpp"
#include "bench/peers/splitting.hpp"
#include "generator/check/check.hpp"
#include "generator/method/propagation.hpp"
#include "generator/method/splitting.hpp"
#include "generator/method/splitting_order.hpp"
#include "generator/method/splitting_stability.hpp"
#include "generator/method/stability.hpp"
#include "runtime/measure/diagnostics.hpp"
#include "runtime/measure/measured_order.hpp"
#include "tests/built_and_run.hpp"
#include "tests/motions.hpp"
#include "tests/support.hpp"

using namespace lobatto;
using namespace lobatto::test;
using TestMotion = lobatto::test::Motion;

namespace {

std::string splitting(int stages) {
    return "family = \"splitting\"\nstages = " + std::to_string(stages);
}

Kernel compiled(const Derivation& derivation) {
    return kernel_in_own_cache(derivation, Precision::double_);
}

double number(const GiNaC::numeric& value) {
    return value.to_double();
}

bool holds(const std::vector<Check>& checks, const std::string& claim) {
    for (const Check& check : checks)
        if (check.claim == claim) return check.holds;
    FAIL("no claim " << claim);
    return false;
}

struct State {
    std::vector<double> q, p;
};

State after(const Kernel& kernel, const TestMotion& motion, double h, std::int64_t steps) {
    LoadedStepper<double> stepper(kernel);
    REQUIRE(stepper.prepare(motion.parameters, h) == LOBATTO_OK);
    REQUIRE(stepper.start(0, motion.q, stepper.momentum(0, motion.q, motion.v)) == LOBATTO_OK);
    lobatto_advance call{};
    call.steps = steps;
    REQUIRE(stepper.advance(call) == LOBATTO_OK);
    State state{std::vector<double>(motion.q.size()), std::vector<double>(motion.q.size())};
    double time = 0;
    stepper.state(time, state.q, state.p);
    CHECK(time == doctest::Approx(h * static_cast<double>(steps)));
    return state;
}

double distance(const State& a, const State& b) {
    double most = 0;
    for (std::size_t k = 0; k < a.q.size(); ++k)
        most = std::fmax(most, std::fmax(std::fabs(a.q[k] - b.q[k]), std::fabs(a.p[k] - b.p[k])));
    return most;
}

// The hand-written methods of the race, on the race's problems.
template <const auto& table, class Problem>
State by_hand(const TestMotion& motion, double h, long steps) {
    constexpr int n = Problem::coordinates;
    bench::State<double, n> state;
    for (int k = 0; k < n; ++k) {
        state.q[k] = motion.q[static_cast<std::size_t>(k)];
        state.p[k] = motion.v[static_cast<std::size_t>(k)];
    }
    bench::integrate_splitting<table, Problem>(state, h, steps);
    return {{state.q.begin(), state.q.end()}, {state.p.begin(), state.p.end()}};
}

// Composition of steps kick, drift, kick: what the race writes as drift, kick, drift.
constexpr auto kahan_li_kick_first = [] {
    bench::SplittingTable<17> table = bench::kahan_li_8;
    table.kick_first = true;
    return table;
}();

TestMotion fput(int masses) {
    const std::string n = std::to_string(masses);
    TestMotion chain{"lagrangian = \"\"\"sum(i = 1 .. " + n + ", x[i]'^2/2) - sum(i = 2 .. " + n +
                         ", spring[i]) - x[1]^2/2 - 0.3*x[1]^4/4 - x[" + n + "]^2/2 - 0.3*x[" + n +
                         "]^4/4\"\"\"\n[definitions]\n\"spring[i]\" = \"(x[i] - x[i-1])^2/2 + 0.3*(x[i] - "
                         "x[i-1])^4/4\"\n[coordinates]\nx = { count = " +
                         n + ", position = \"i/40\", velocity = 0 }\n",
                     {},
                     {},
                     {},
                     0.5};
    for (int i = 1; i <= masses; ++i) {
        chain.q.push_back(std::sin(M_PI * i / (masses + 1)));
        chain.v.push_back(0.2 * std::cos(i));
    }
    return chain;
}

}  // namespace

TEST_CASE("coefficients are those of the papers, as the race has them") {
    const Splitting eleven = splitting_of(11), fourteen = splitting_of(14), kahan_li = splitting_of(17),
                    sofroniou = splitting_of(35);
    for (std::size_t i = 0; i <= 11; ++i)
        CHECK(std::fabs(number(eleven.kicks[i]) - double(bench::blanes_moan_11.outer[i])) < 1e-16);
    for (std::size_t i = 0; i < 11; ++i)
        CHECK(std::fabs(number(eleven.drifts[i]) - double(bench::blanes_moan_11.inner[i])) < 1e-16);
    for (std::size_t i = 0; i < 14; ++i)
        CHECK(std::fabs(number(fourteen.kicks[i + 1]) - double(bench::blanes_moan_14.inner[i])) < 1e-16);
    CHECK(fourteen.kicks.front().is_zero());
    for (std::size_t i = 0; i < 17; ++i)
        CHECK(std::fabs(number(kahan_li.drifts[i]) - double(bench::kahan_li_8.inner[i])) < 1e-16);
    for (std::size_t i = 0; i < 35; ++i)
        CHECK(std::fabs(number(sofroniou.drifts[i]) - double(bench::sofroniou_spaletta_10.inner[i])) < 1e-16);
    CHECK(splitting_stages() == std::vector{6, 11, 14, 17, 35});
    CHECK_THROWS_WITH(splitting_of(12), "Splitting, 12 stages: there are 6, 11, 14, 17, 35");
}

TEST_CASE("tables of splitting methods satisfy what they must, and their orders hold") {
    for (const int stages : splitting_stages()) {
        const Quadrature rule = quadrature_of({Family::splitting, stages});
        INFO(stages << " stages, order " << rule.order() << ": " << splitting_defect(rule, rule.order()) << ", beyond "
                    << splitting_defect(rule, rule.order() + 1));
        CHECK(rule.exact);
        const std::vector<Check> checks = check_quadrature(rule);
        CHECK(checks.size() == 8);
        for (const Check& check : checks) {
            INFO(check.claim << ": " << check.measured << " of at most " << check.bound);
            CHECK(check.holds);
        }
    }
}

TEST_CASE("a wrong coefficient is found out") {
    Quadrature wrong = quadrature_of({Family::splitting, 11});
    const GiNaC::numeric tiny(1, 1000000);
    wrong.b[1] += tiny;  // a palindrome still, of sum 1
    wrong.b[10] += tiny;
    wrong.b[5] -= tiny;
    wrong.b[6] -= tiny;
    CHECK(holds(check_quadrature(wrong), "a step backwards undoes a step"));
    CHECK(!holds(check_quadrature(wrong), "steps are those of the motion to h^6"));
    CHECK(!holds(check_quadrature(wrong), "each node follows from those before it"));
    wrong = quadrature_of({Family::splitting, 11});
    wrong.A(3, 7) = tiny;
    CHECK(!holds(check_quadrature(wrong), "each node follows from those before it"));
    wrong = quadrature_of({Family::splitting, 11});
    wrong.G(3, 7) += tiny;
    CHECK(!holds(check_quadrature(wrong), "G inverts the interior of K"));
    wrong = quadrature_of({Family::splitting, 11});
    wrong.K(3, 4) += tiny;
    CHECK(!holds(check_quadrature(wrong), "K is that of paths straight from node to node"));
}

TEST_CASE("the equations of straight paths are those of their action, written out or not") {
    for (const int stages : {6, 14}) {
        const Derivation one = derivation_of(pendulum, splitting(stages)),
                         chain = derivation_of(fput(40), splitting(stages));
        CHECK(is_written_out(one.system, one.quadrature));
        CHECK(!is_written_out(chain.system, chain.quadrature));
        for (const Derivation& derivation : {one, chain}) {
            const std::vector<Check> checks = check_equations(derivation);
            CHECK(checks.size() >= 4);
            for (const Check& check : checks) {
                INFO(stages << ", " << check.claim << ": " << check.measured << " of at most " << check.bound);
                CHECK(check.holds);
            }
        }
    }
}

TEST_CASE("what a step costs is counted, and nothing is iterated") {
    for (const int stages : {11, 14}) {
        const Kernel kernel = compiled(derivation_of(henon_heiles, splitting(stages)));
        CHECK(gradients_of(kernel.table(), 0, 10) == 10 * stages);
        CHECK_FALSE(heeds_tolerance({Family::splitting, stages}, false, true));
    }
    CHECK(gradients_of(compiled(derivation_of(henon_heiles, "points = 4")).table(), 30, 10) == 70);
    CHECK(gradients_of(compiled(derivation_of(henon_heiles, "family = \"gauss\"\nstages = 2")).table(), 30, 10) == 120);
    Method gauss{Family::gauss, 3};
    CHECK(heeds_tolerance(gauss, false, true));
    CHECK_FALSE(heeds_tolerance(gauss, true, true));  // a linear system
    gauss.numbers = Precision::double_double;
    CHECK(heeds_tolerance(gauss, false, false));
    CHECK_FALSE(heeds_tolerance(gauss, false, true));
    CHECK(family_in(Precision::double_, true).size() == family_in(Precision::double_, false).size() + 5);
}

TEST_CASE("sums of rows are fused, whatever the kernel is called") {
    CHECK(emit(derivation_of(fput(40), "points = 4")).header.find("lobatto::fused_sum(0.3, ") != std::string::npos);
}

TEST_CASE("the step of an oscillator is a product of kicks and drifts, stable as Sturm's theorem says") {
    for (const int stages : splitting_stages()) {
        const Propagation step = propagation(quadrature_of({Family::splitting, stages}));
        CHECK((step.a * step.a - step.b * step.c - 1).expand().is_zero());  // (D20), delta = 1
    }
    const Quadrature rule = quadrature_of({Family::splitting, 6});
    const Stability exact = stability(rule);
    const std::vector<UnstableSteps> unstable = unstable_steps(rule);
    REQUIRE(unstable.size() == 3);
    REQUIRE(exact.limits.size() == 5);
    for (std::size_t i = 0; i < 5; ++i) {
        const UnstableSteps& steps = unstable[i / 2];
        CHECK(std::fabs((i % 2 == 0 ? steps.from : steps.to) -
                        std::sqrt(exact.limits[i].approximation(20).to_double())) < 1e-10);
    }
    CHECK(std::isinf(unstable[2].to));
    CHECK(unstable[0].rate == doctest::Approx(exact.intervals[1].rate).epsilon(1e-2));
    CHECK(stability_limit(rule) == unstable[0].from);
}

TEST_SUITE_BEGIN("slow");

TEST_CASE("emitted steps are those of the hand-written methods") {
    const TestMotion star{henon_heiles.body, {1}, henon_heiles.q, henon_heiles.v, 0.25};
    const auto emitted = [&](int stages) {
        return after(compiled(derivation_of(star, splitting(stages))), star, 0.25, 400);
    };
    CHECK(distance(emitted(11), by_hand<bench::blanes_moan_11, bench::HenonHeiles>(star, 0.25, 400)) < 1e-12);
    CHECK(distance(emitted(14), by_hand<bench::blanes_moan_14, bench::HenonHeiles>(star, 0.25, 400)) < 1e-12);
    CHECK(distance(emitted(17), by_hand<kahan_li_kick_first, bench::HenonHeiles>(star, 0.25, 400)) < 1e-12);
    // 32 masses, whose neighbours lie in lanes; 40 and 90, which are not whole registers.
    const TestMotion chain = fput(32);
    for (const int stages : {11, 14}) {
        const Derivation derivation = derivation_of(chain, splitting(stages));
        CHECK(derivation.structure.neighbours());
        const State state = after(compiled(derivation), chain, 0.5, 200);
        CHECK(distance(state, stages == 11 ? by_hand<bench::blanes_moan_11, bench::Chain>(chain, 0.5, 200)
                                           : by_hand<bench::blanes_moan_14, bench::Chain>(chain, 0.5, 200)) < 1e-12);
    }
}

TEST_CASE("each method has its order, with forces and time too") {
    struct Case {
        int stages;
        const TestMotion& motion;
        double h;
        std::int64_t steps;
    };
    for (const Case& of :
         {Case{6, henon_heiles, 0.25, 16}, Case{11, henon_heiles, 0.5, 8}, Case{14, henon_heiles, 0.8, 5},
          Case{17, henon_heiles, 0.8, 5}, Case{35, henon_heiles, 1, 4}, Case{6, driven_pendulum, 0.25, 16},
          Case{14, driven_pendulum, 0.8, 6}, Case{17, kepler, 0.1, 10}}) {
        const Kernel kernel = compiled(derivation_of(of.motion, splitting(of.stages)));
        const Kernel fine = compiled(derivation_of(of.motion, "points = 12"));
        const State exact = after(fine, of.motion, of.h / 10, 10 * of.steps);
        const double coarse = distance(after(kernel, of.motion, of.h, of.steps), exact),
                     half = distance(after(kernel, of.motion, of.h / 2, 2 * of.steps), exact);
        const double order = std::log2(coarse / half);
        INFO(of.motion.body << of.stages << " stages: errors " << coarse << " and " << half << ", order " << order);
        CHECK(coarse > 1e-11);
        CHECK(half > 1e-13);
        CHECK(order > kernel->order - 0.8);
        CHECK(order < kernel->order + 2.5);  // with 14 stages the h^8 term leads for long: 8.3 measured
    }
}

TEST_CASE("steps are symplectic, go back the way they came, and keep the energy") {
    for (const int stages : splitting_stages())
        for (const TestMotion* motion : {&pendulum, &henon_heiles, &kepler}) {
            INFO(stages << " stages, " << motion->body);
            const Kernel kernel = compiled(derivation_of(*motion, splitting(stages)));
            LoadedStepper<double> stepper(kernel);
            const std::size_t n = motion->q.size();
            REQUIRE(stepper.prepare(motion->parameters, motion->step) == LOBATTO_OK);
            const std::vector<double> p = stepper.momentum(0, motion->q, motion->v);
            std::vector<double> q1, p1, T;
            REQUIRE(stepper.tangent(0, motion->q, p, q1, p1, T) == LOBATTO_OK);
            CHECK(symplectic_defect(stepper, motion->q, p) < 1e-14);
            // The tangent map against differences of steps.
            const double d = 1e-6;
            for (std::size_t c = 0; c < 2 * n; ++c) {
                const auto moved = [&](double by) {
                    std::vector<double> x = motion->q, y = p;
                    (c < n ? x[c] : y[c - n]) += by;
                    std::vector<double> x1, y1, ignored;
                    REQUIRE(stepper.tangent(0, x, y, x1, y1, ignored) == LOBATTO_OK);
                    x1.insert(x1.end(), y1.begin(), y1.end());
                    return x1;
                };
                const std::vector<double> up = moved(d), down = moved(-d);
                for (std::size_t r = 0; r < 2 * n; ++r)
                    CHECK(std::fabs((up[r] - down[r]) / (2 * d) - T[r * 2 * n + c]) < 1e-7);
            }
            // There and back.
            const State there = after(kernel, *motion, motion->step, 50);
            REQUIRE(stepper.prepare(motion->parameters, -motion->step) == LOBATTO_OK);
            REQUIRE(stepper.start(50 * motion->step, there.q, there.p) == LOBATTO_OK);
            lobatto_advance call{};
            call.steps = 50;
            REQUIRE(stepper.advance(call) == LOBATTO_OK);
            State back{std::vector<double>(n), std::vector<double>(n)};
            double time = 0;
            stepper.state(time, back.q, back.p);
            CHECK(distance(back, {motion->q, p}) < 1e-12);
            // Energy, on and on.
            REQUIRE(stepper.prepare(motion->parameters, motion->step) == LOBATTO_OK);
            double before = 0, largest[2] = {0, 0};
            REQUIRE(stepper.energy(0, motion->q, p, before) == LOBATTO_OK);
            REQUIRE(stepper.start(0, motion->q, p) == LOBATTO_OK);
            for (int half = 0; half < 2; ++half)
                for (int look = 0; look < 200; ++look) {
                    call = {};
                    call.steps = 101;
                    REQUIRE(stepper.advance(call) == LOBATTO_OK);
                    double energy = 0;
                    stepper.state(time, back.q, back.p);
                    REQUIRE(stepper.energy(time, back.q, back.p, energy) == LOBATTO_OK);
                    largest[half] = std::fmax(largest[half], std::fabs(energy / before - 1));
                }
            CHECK(largest[1] < 2 * largest[0] + 1e-13);
        }
}

TEST_CASE("between two steps goes the polynomial of degree 5 through both ends") {
    for (const TestMotion& motion : {henon_heiles, fput(24)}) {
        const Kernel kernel = compiled(derivation_of(motion, splitting(17), "dense = 3"));
        const Kernel exact = compiled(derivation_of(motion, "points = 12"));
        const std::size_t n = motion.q.size();
        const auto error = [&](double h) {
            LoadedStepper<double> stepper(kernel);
            REQUIRE(stepper.prepare(motion.parameters, h) == LOBATTO_OK);
            REQUIRE(stepper.start(0, motion.q, stepper.momentum(0, motion.q, motion.v)) == LOBATTO_OK);
            std::vector<double> rows(8 * (1 + 2 * n));
            lobatto_advance call{};
            call.steps = 2;
            call.record_every = 1;
            call.dense = 3;
            call.records = rows.data();
            call.capacity = 8;
            REQUIRE(stepper.advance(call) == LOBATTO_OK);
            double most = 0;
            for (std::size_t i = 0; i < 8; ++i) {
                const auto row = rows.begin() + static_cast<std::ptrdiff_t>(i * (1 + 2 * n));
                CHECK(row[0] == doctest::Approx(h / 4 * static_cast<double>(i + 1)));
                const auto middle = row + 1 + static_cast<std::ptrdiff_t>(n);
                most = std::fmax(most, distance({{row + 1, middle}, {middle, middle + static_cast<std::ptrdiff_t>(n)}},
                                                after(exact, motion, h / 4, static_cast<std::int64_t>(i) + 1)));
            }
            return most;
        };
        const double coarse = error(0.4), fine = error(0.2);
        INFO("errors " << coarse << " and " << fine);
        CHECK(std::log2(coarse / fine) > 4.5);  // of velocities 5, of positions 6
        CHECK(std::log2(coarse / fine) < 6.5);
    }
}

TEST_CASE("a linear system is one matrix, of few coordinates or of one") {
    for (const TestMotion* motion : {&harmonic_oscillator, &coupled_oscillators})
        for (const int stages : {6, 14}) {
            const Derivation derivation = derivation_of(*motion, splitting(stages));
            CHECK(derivation.structure.form() == StepForm::linear_map);
            const Derivation composition = derivation_of(*motion, splitting(stages), "dense = 1");
            CHECK(composition.structure.form() == StepForm::separable);
            CHECK(distance(after(compiled(derivation), *motion, 0.3, 100),
                           after(compiled(composition), *motion, 0.3, 100)) < 1e-12);
        }
}

TEST_CASE("a motion that leaves all numbers stops with its status and its last good state") {
    const TestMotion falls{
        "lagrangian = \"q'^2/2 + q^6/6\"\n[coordinates]\nq = { position = 1, velocity = 1 }\n", {}, {1}, {1}, 0.5};
    const Kernel kernel = compiled(derivation_of(falls, splitting(11)));
    LoadedStepper<double> stepper(kernel);
    REQUIRE(stepper.prepare({}, 0.5) == LOBATTO_OK);
    REQUIRE(stepper.start(0, falls.q, falls.v) == LOBATTO_OK);
    lobatto_advance call{};
    call.steps = 1000;
    CHECK(stepper.advance(call) == LOBATTO_NOT_FINITE);
    CHECK(call.steps_done < 1000);
    double time = 0;
    std::vector<double> q(1), p(1);
    stepper.state(time, q, p);
    CHECK(std::isfinite(q[0]));
    CHECK(time == 0.5 * static_cast<double>(call.steps_done));
}

TEST_CASE("neighbours in registers and in memory give the same bits") {
    const TemporaryFolder folder;
    write_text(folder / "both.cpp", R"(
#include <cmath>
#include <cstdio>
#include <cstring>
#include "kernel.hpp"
#include "motion.hpp"
using namespace lobatto;
using K = kernels::motion;
static NeighbourComposition<K, IN_REGISTERS> within;
static NeighbourComposition<K, false> through;
int main() {
    K::Coefficients k;
    Composition<K> composition;
    const double h = 0.3;
    K::prepare(K::Parameters(), h, k);
    composition.prepare(h);
    double q[K::coordinates], u[K::coordinates], W[K::coordinates], one_q[K::coordinates], one_u[K::coordinates];
    for (int i = 0; i < K::coordinates; ++i) one_q[i] = q[i] = std::sin(0.3 * i), one_u[i] = u[i] = 0.1 * std::cos(i);
    Formulas<K>::minus_acceleration(k, 0.0, static_cast<const double*>(q), +W);
    within.begin(q, u, W);
    through.begin(q, u, W);
    double far = 0;
    for (int i = 0; i < 60; ++i) {
        if (!within.step(composition, k, i * h, h) || !through.step(composition, k, i * h, h)) std::printf("step %d fails\n", i);
        kick_and_drift<K>(composition, k, i * h, h, +one_q, +one_u, +W);
        if (std::memcmp(within.q[within.now], through.q[through.now], sizeof q) != 0 ||
            std::memcmp(within.u[within.now], through.u[through.now], sizeof u) != 0)
            std::printf("step %d differs\n", i);
        for (int c = 0; c < K::coordinates; ++c) far = std::fmax(far, std::fabs(one_q[c] - within.q[within.now][c]));
    }
    if (!(far < 1e-12)) std::printf("%g apart from single coordinates\n", far);
    std::printf("done\n");
}
)");
    const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    const bool has_avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
    TestMotion driven = fput(21);
    driven.body = "time = \"t\"\n" + driven.body;
    driven.body.replace(driven.body.find("x[i]'^2/2"), 9, "(1 + i/8)*x[i]'^2/2 + cos(t)*x[i]/4");
    for (const TestMotion& motion : {driven, fput(40)})
        for (const int stages : {6, 14}) {
            const Derivation derivation = derivation_of(motion, splitting(stages), "energy = false\ntangent = false");
            REQUIRE(derivation.structure.neighbours());
            write_text(folder / "motion.hpp", emit(derivation).header);
            const auto check = [&](const std::vector<std::string>& target, bool runs_here) {
                INFO(target.front());
                const std::optional<Finished> both = built_and_run(folder, "both", target, runs_here);
                if (!both) return;
                CHECK(both->out == "done\n");
                CHECK(both->err == "");
            };
            check({"-march=x86-64", "-O0", "-DIN_REGISTERS=false", "-fsanitize=address"}, true);
            check({"-march=haswell", "-O1", "-DIN_REGISTERS=true"}, has_avx2);
            check({"-march=x86-64-v4", "-O1", "-DIN_REGISTERS=true"}, has_avx512);
        }
}

constexpr const char* side_by_side_program = R"(
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include "kernel.hpp"
#include "motion.hpp"
using namespace lobatto;
using K = kernels::motion;
constexpr int n = K::coordinates, lanes = 4, steps = 60;
static_assert(K::immediate == IMMEDIATE);
static_assert(ensemble_lanes<K>(8) == (IMMEDIATE ? native_lanes<double> : 0) && ensemble_lanes<K>(1) == 0);
static Ensemble<K, lanes> together;
static Stepper<K> alone[lanes];
// Immediate updates add in the order of neighbours in lanes; others need not.
static bool agree(const double* a, const double* b) {
    if (IMMEDIATE) return std::memcmp(a, b, n * sizeof *a) == 0;
    double most = 0;
    for (int i = 0; i < n; ++i) most = std::fmax(most, std::fabs(a[i] - b[i]));
    return most < 1e-12;
}
int main() {
    const double h = 0.3;
    double parameters[lanes * (K::parameter_count + 1)], q[lanes * n], p[lanes * n];
    for (int l = 0; l < lanes; ++l) {
        K::Parameters given;
        for (int i = 0; i < K::parameter_count; ++i)
            parameters[l * K::parameter_count + i] = K::parameter(given, i) * (1 + 0.1 * l);
        for (int i = 0; i < n; ++i) q[l * n + i] = std::sin(0.3 * i + l), p[l * n + i] = 0.1 * std::cos(i);
    }
    q[2 * n + 5] = 1e200;  // its cube is no number: the first step fails
    p[1 * n + 3] = 1e20;   // a later one does
    Status status[lanes];
    std::int64_t done[lanes], iterations[lanes];
    together.prepare(parameters, h, status);
    together.start(0.5, q, p, status);
    together.advance(steps, 0, status, done, iterations);
    double q1[lanes * n], p1[lanes * n], momentum[n];
    together.state(q1, p1);
    for (int l = 0; l < lanes; ++l) {
        K::Parameters given;
        for (int i = 0; i < K::parameter_count; ++i)
            K::parameter(given, i) = parameters[l * K::parameter_count + i];
        Status one = alone[l].prepare(given, h);
        if (one == Status::ok) one = alone[l].start(0.5, q + l * n, p + l * n);
        std::int64_t taken = 0;
        while (one == Status::ok && taken < steps && (one = alone[l].step()) == Status::ok) ++taken;
        alone[l].momentum(momentum);
        if (one != status[l] || taken != done[l] ||
            (one == Status::ok && !(agree(alone[l].q, q1 + l * n) && agree(momentum, p1 + l * n))))
            std::printf("lane %d: status %d and %d, %d and %d steps\n", l, int(one), int(status[l]), int(taken),
                        int(done[l]));
    }
    if (status[0] != Status::ok || status[2] != Status::not_finite || status[3] != Status::ok || done[2] != 0)
        std::printf("one that ends stops others, or goes on\n");
    // A lane that takes over what a stepper has done goes on as that does.
    alone[0].step();
    together.motion.follow(alone[0], 3);
    together.coefficients_of[3] = together.coefficients_of[0];
    set_coefficients<K>(together.coefficients, 3, alone[0].coefficients);
    together.advance(1, 0, status, done, iterations);
    together.state(q1, p1);
    if (K::autonomous) {
        alone[0].step();
        alone[0].momentum(momentum);
        if (!agree(alone[0].q, q1 + 3 * n) || !agree(momentum, p1 + 3 * n)) std::printf("one that follows differs\n");
    }
    std::printf("done\n");
}
)";

TEST_CASE("chains side by side move as each does alone, to the same bits, and one that ends leaves the others be" *
          doctest::test_suite("slowest")) {
    const TemporaryFolder folder;
    write_text(folder / "side.cpp", side_by_side_program);
    const bool has_avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
    const auto replaced = [](std::string text, const std::string& from, const std::string& by) {
        for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + by.size()))
            text.replace(at, from.size(), by);
        return text;
    };
    TestMotion driven = fput(21), hung = fput(17), ring = fput(24), free = fput(19);
    driven.body = "time = \"t\"\n" +
                  replaced(replaced(driven.body, "x[i]'^2/2", "(1 + i/8)*mass*x[i]'^2/2"), "0.3*",
                           "inverse_mass*(1 + cos(t)/8)*") +
                  "[parameters]\nmass = 2\ninverse_mass = 0.3\n";
    hung.body = replaced(hung.body, "- x[17]^2/2 - 0.3*x[17]^4/4", "");
    free.body = replaced(replaced(free.body, "- x[19]^2/2 - 0.3*x[19]^4/4", ""), "- x[1]^2/2 - 0.3*x[1]^4/4", "");
    ring.body = replaced(ring.body, "- x[1]^2/2 - 0.3*x[1]^4/4", "- (x[1] - x[24])^4");
    for (const auto& [motion, immediate] : {std::pair{driven, true}, {hung, true}, {free, true}, {ring, false}})
        for (const int stages : {6, 14}) {
            const Derivation derivation = derivation_of(motion, splitting(stages), "energy = false\ntangent = false");
            REQUIRE(derivation.structure.neighbours());
            write_text(folder / "motion.hpp", emit(derivation).header);
            const std::string passing = immediate ? "-DIMMEDIATE=true" : "-DIMMEDIATE=false";
            const auto check = [&](const std::vector<std::string>& target) {
                const std::optional<Finished> side = built_and_run(folder, "side", target);
                REQUIRE(side);
                CHECK(side->out == "done\n");
                CHECK(side->err == "");
            };
            check({passing, "-march=x86-64", "-O0", "-fsanitize=address,undefined"});
            if (has_avx512) check({passing, "-march=x86-64-v4", "-O1"});
        }
}

TEST_CASE("a sweep of a chain has lanes, and the same table for any number of threads") {
    const TemporaryFolder folder;
    write_text(folder / "chain.toml", "title = \"Chain\"\n" + fput(12).body + "[method]\n" + splitting(6) +
                                          "\n[run]\nstep = 0.25\nuntil = 5\n");
    const auto swept = [&](const std::string& threads) {
        const std::string table = (folder / ("of_" + threads + ".csv")).string();
        const Finished result = run({LOBATTO_PROGRAM, "sweep", (folder / "chain.toml").string(), "--vary",
                                     "x[3]=0:1:16", "--threads", threads, "-o", table});
        INFO(result.err);
        REQUIRE(result.exit_code == 0);
        CHECK(result.out.find("lanes each") != std::string::npos);
        return read_file(table);
    };
    CHECK(swept("1") == swept("3"));
}

TEST_CASE("scenes may bear the names of what chains alone have") {
    const TemporaryFolder folder;
    for (const std::string name : {"row_reach", "unit_masses", "immediate"}) {
        write_text(folder / (name + ".toml"), "title = \"Chain\"\n" + fput(12).body + "[method]\n" + splitting(6) +
                                                  "\n[run]\nstep = 0.25\nuntil = 5\n");
        const Finished result =
            run({LOBATTO_PROGRAM, "run", (folder / (name + ".toml")).string(), "-o", (folder / "states.csv").string()});
        INFO(result.err);
        CHECK(result.exit_code == 0);
    }
}

TEST_SUITE_END();
