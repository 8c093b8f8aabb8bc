// SPDX-License-Identifier: GPL-2.0-or-later
// The separable form with loops, for many coordinates: a chain, by Newton's iteration, with its quadratic part
// absorbed, and linear.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/handwritten/chain.hpp"
#include "tests/handwritten/pendulum.hpp"

using namespace lobatto;

namespace {

template <int n, Chain chain, class Tables = SeparableLobattoFour<double>>
using K = HandwrittenChain<double, Tables, n, chain>;

// The first mode of the chain, at rest.
template <class Kernel>
std::unique_ptr<Stepper<Kernel>> in_first_mode(double h, double amplitude, double beta = 0.3) {
    constexpr int n = Kernel::coordinates;
    auto stepper = std::make_unique<Stepper<Kernel>>();
    std::vector<double> q(n), p(n);
    for (int i = 0; i < n; ++i) q[i] = amplitude * std::sin(M_PI * (i + 1) / (n + 1));
    REQUIRE(stepper->prepare({beta}, h) == Status::ok);
    REQUIRE(stepper->start(0, q.data(), p.data()) == Status::ok);
    return stepper;
}

constexpr int spring_ends[] = {0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9, 10, 10, 11};  // of 11 springs
constexpr int spring_runs[] = {0, 11};

}  // namespace

TEST_CASE("the stage equations of the headers are those written by hand") {
    using H = HandwrittenPendulum;
    constexpr double h = 0.17;
    const StageEquations<H> loops(h);
    H::Coefficients k{};
    REQUIRE(H::prepare({0.7, 1.9}, h, k) == Status::ok);
    const double q[] = {0.8}, u[] = {0.4}, W0[] = {1.7}, W1[] = {-0.6};
    const double base[] = {0.9, 1.3, 1.6}, Q[] = {0.85, 1.21}, W[] = {2.3, -1.9}, S[] = {3.1, -2.2};
    const double history[] = {0.3, -0.7, 1.1, 1.9};
    std::vector<double> ours, by_hand;
    const auto collect = [](std::vector<double>& all, const auto& values) {
        all.insert(all.end(), std::begin(values), std::end(values));
    };
    double one[1], two[2], three[3], four[4], carried[2];
    loops.drift(q, u, W0, one, three), collect(ours, one), collect(ours, three);
    H::drift(k, q, u, W0, one, three), collect(by_hand, one), collect(by_hand, three);
    loops.simple_start(base, W0, two), collect(ours, two);
    H::simple_start(k, base, W0, two), collect(by_hand, two);
    loops.extrapolated_start(base, history, two), collect(ours, two);
    H::extrapolated_start(k, base, history, two), collect(by_hand, two);
    loops.residual(base, Q, W, two), collect(ours, two);
    H::residual(k, base, Q, W, two), collect(by_hand, two);
    loops.jacobian(S, four), collect(ours, four);
    H::jacobian(k, S, four), collect(by_hand, four);
    StageEquations<H>::Matrix matrix;
    REQUIRE(loops.factor(S, 1, matrix));
    loops.solve(base, Q, W, matrix, two, four), collect(ours, two);
    REQUIRE(H::correction(k, base, Q, W, S, two));
    collect(by_hand, two);
    std::copy(W, W + 2, carried);
    loops.carry(S, 1, two, carried), collect(ours, carried);
    std::copy(W, W + 2, carried);
    H::carry(k, S, two, carried), collect(by_hand, carried);
    loops.arrive(base, W, one), collect(ours, one);
    H::arrive(k, base, W, one), collect(by_hand, one);
    loops.finish(u, W, W1, one), collect(ours, one);
    H::finish(k, u, W, W1, one), collect(by_hand, one);
    REQUIRE(ours.size() == 20);
    REQUIRE(by_hand.size() == 20);
    for (std::size_t i = 0; i < ours.size(); ++i) {
        INFO("value " << i << ": " << ours[i] << ", by hand " << by_hand[i]);
        CHECK(std::fabs(ours[i] - by_hand[i]) <= 1e-14 * std::fabs(by_hand[i]));
        CHECK(ours[i] != 0);
    }
}

TEST_CASE("the chain's energy stays, with Lobatto's points and Gauss's") {
    const auto check = [](auto kernel, double bound) {
        using Kernel = decltype(kernel);
        const auto stepper = in_first_mode<Kernel>(0.2, 2);
        std::vector<double> p(Kernel::coordinates);
        double before = 0, now = 0, worst = 0;
        stepper->momentum(p.data());
        REQUIRE(stepper->energy(0, stepper->q, p.data(), &before) == Status::ok);
        for (int i = 0; i < 500; ++i) {
            REQUIRE(stepper->step() == Status::ok);
            stepper->momentum(p.data());
            REQUIRE(stepper->energy(0, stepper->q, p.data(), &now) == Status::ok);
            worst = std::max(worst, std::fabs(now - before) / before);
        }
        CHECK(worst > 0);
        CHECK(worst < bound);
    };
    check(K<32, Chain::newton>(), 1e-13);                             // 2.4e-15 measured: rounding
    check(K<32, Chain::newton, SeparableGaussTwo<double>>(), 1e-10);  // 6.7e-12 measured
}

TEST_CASE("with its quadratic part absorbed the chain takes Newton's steps to rounding, and factors nothing") {
    const auto newton = in_first_mode<K<32, Chain::newton>>(0.2, 2);
    const auto absorbed = in_first_mode<K<32, Chain::absorbed>>(0.2, 2);
    long iterations = 0;
    K<32, Chain::absorbed>::nodes_evaluated = 0;
    double worst = 0;
    for (int i = 0; i < 500; ++i) {
        REQUIRE(newton->step() == Status::ok);
        REQUIRE(absorbed->step() == Status::ok);
        iterations += absorbed->iterations;
        for (int k = 0; k < 32; ++k) worst = std::max(worst, std::fabs(newton->q[k] - absorbed->q[k]));
    }
    CHECK(K<32, Chain::absorbed>::nodes_evaluated == 0);
    CHECK(worst < 1e-13);  // 5.3e-15 measured
    CHECK(iterations > 500);
    CHECK(iterations <= 1100);  // 2 a step measured
}

TEST_CASE("where the absorbed part is not most of the force, Newton's iteration takes over within the step") {
    const auto newton = in_first_mode<K<8, Chain::newton>>(0.5, 12, 1);
    const auto absorbed = in_first_mode<K<8, Chain::absorbed>>(0.5, 12, 1);
    K<8, Chain::absorbed>::nodes_evaluated = 0;
    for (int i = 0; i < 5; ++i) {
        REQUIRE(newton->step() == Status::ok);
        REQUIRE(absorbed->step() == Status::ok);
        for (int k = 0; k < 8; ++k) CHECK(std::fabs(newton->q[k] - absorbed->q[k]) < 1e-13);  // 3.6e-15
    }
    CHECK(K<8, Chain::absorbed>::nodes_evaluated > 0);
}

TEST_CASE("the linear chain takes one correction a step, and Newton's steps") {
    const auto newton = in_first_mode<K<32, Chain::newton>>(0.2, 2, 0);
    const auto linear = in_first_mode<K<32, Chain::linear>>(0.2, 2, 0);
    const long evaluated = K<32, Chain::linear>::nodes_evaluated;  // once, in prepare
    for (int i = 0; i < 500; ++i) {
        REQUIRE(newton->step() == Status::ok);
        REQUIRE(linear->step() == Status::ok);
        CHECK(linear->iterations == 1);
        for (int k = 0; k < 32; ++k) CHECK(std::fabs(newton->q[k] - linear->q[k]) < 1e-13);
    }
    CHECK(K<32, Chain::linear>::nodes_evaluated == evaluated);
}

TEST_CASE("the tangent map of the chain agrees with differences") {
    using Kernel = K<4, Chain::absorbed>;
    const auto stepper = in_first_mode<Kernel>(0.3, 1);
    double q[4] = {0.3, 0.8, -0.4, 0.9}, p[4] = {0.1, 0.2, -0.7, 0.4}, q1[4], p1[4], T[64], none[64];
    REQUIRE(stepper->tangent(0, q, p, q1, p1, T) == Status::ok);
    const double d = 1e-5;
    for (int c = 0; c < 8; ++c) {
        double& moved = c < 4 ? q[c] : p[c - 4];
        const double kept = moved;
        double q_plus[4], p_plus[4], q_minus[4], p_minus[4];
        moved = kept + d;
        REQUIRE(stepper->tangent(0, q, p, q_plus, p_plus, none) == Status::ok);
        moved = kept - d;
        REQUIRE(stepper->tangent(0, q, p, q_minus, p_minus, none) == Status::ok);
        moved = kept;
        for (int r = 0; r < 8; ++r) {
            const double slope = r < 4 ? q_plus[r] - q_minus[r] : p_plus[r - 4] - p_minus[r - 4];
            CHECK(std::fabs(T[r * 8 + c] - slope / (2 * d)) < 1e-9);  // 1.6e-11 measured
        }
    }
    using Long = K<32, Chain::newton>;
    std::vector<double> many(32), T_long(64 * 64);
    CHECK(in_first_mode<Long>(0.3, 1)->tangent(0, many.data(), many.data(), many.data(), many.data(), T_long.data()) ==
          Status::unsupported);
}

TEST_CASE("rows side by side are those one by one, and read no coefficient that is not there") {
    const std::vector<double> stiffness = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};  // on the heap: sanitisers see its end
    const auto springs = [&](auto& rows) {
        const auto force = rows.of(stiffness.data()) * (rows.x[1] - rows.x[0]);
        rows.result[0] = force;
        rows.result[1] = -force;
    };
    constexpr int room = 12 + 2 * native_lanes<double>;
    double q[room]{}, side_by_side[room]{}, one_by_one[room]{};
    for (int i = 0; i < 12; ++i) q[i] = i * i;
    SideBySide::add_rows<12, 2, spring_ends, spring_runs>(q, side_by_side, springs);
    OneByOne::add_rows<12, 2, spring_ends, spring_runs>(q, one_by_one, springs);
    for (int i = 0; i < room; ++i) CHECK(side_by_side[i] == one_by_one[i]);
    CHECK(one_by_one[11] == -11.0 * (121 - 100));
}

namespace {

// Rows of neighbours with as many walls as there can be, against their formula by hand. The second variable is the
// lower one where rows are `reversed`.
template <int count, int fixed_ends, const auto& ends, const auto& runs, bool reversed>
void check_fixed_ends() {
    INFO("fixed_ends " << fixed_ends << " of " << count << (reversed ? ", reversed" : ""));
    const auto springs = [](auto& rows) {
        const auto d = rows.x[reversed ? 0 : 1] - rows.x[reversed ? 1 : 0];
        const auto force = d + 0.5 * (d * d * d);
        rows.result[0] = rows.result[1] = force;
        rows.takes[reversed ? 1 : 0] = true;
    };
    constexpr int room = (count / native_lanes<double> + 3) * native_lanes<double>;
    double q[room]{}, exact[room]{};
    for (int i = 0; i < count; ++i) q[i] = i % 3 - 0.25 * i;
    const auto tension = [&](double d) { return d + 0.5 * (d * d * d); };
    for (int i = 0; i <= count; ++i) {
        if ((i == 0 && (fixed_ends & fixed_before) == 0) || (i == count && (fixed_ends & fixed_behind) == 0)) continue;
        const double pull = tension((i < count ? q[i] : 0) - (i > 0 ? q[i - 1] : 0));
        if (i < count) exact[i] += pull;
        if (i > 0) exact[i - 1] -= pull;
    }
    for (const bool adds : {false, true}) {
        double one_by_one[room]{}, side_by_side[room]{};
        for (int i = 0; adds && i < count; ++i) one_by_one[i] = side_by_side[i] = i;
        if (adds) {
            OneByOne::add_rows<count, 2, ends, runs, fixed_ends>(q, one_by_one, springs);
            SideBySide::add_rows<count, 2, ends, runs, fixed_ends>(q, side_by_side, springs);
        } else {
            OneByOne::set_rows<count, 2, ends, runs, fixed_ends>(q, one_by_one, springs);
            SideBySide::set_rows<count, 2, ends, runs, fixed_ends>(q, side_by_side, springs);
        }
        for (int i = 0; i < room; ++i) {
            const double expected = exact[i] + (adds && i < count ? i : 0);
            CHECK(std::fabs(one_by_one[i] - expected) < 1e-12);
            CHECK(std::fabs(side_by_side[i] - expected) < 1e-12);  // zeros, too, beyond the last
        }
    }
}
template <const auto& ends, const auto& runs, int count, bool reversed>
void check_all_fixed_ends() {
    check_fixed_ends<count, free_ends, ends, runs, reversed>();
    check_fixed_ends<count, fixed_before, ends, runs, reversed>();
    check_fixed_ends<count, fixed_behind, ends, runs, reversed>();
    check_fixed_ends<count, fixed_before | fixed_behind, ends, runs, reversed>();
}
constexpr int eleven_reversed[20] = {1, 0, 2, 1, 3, 2, 4, 3, 5, 4, 6, 5, 7, 6, 8, 7, 9, 8, 10, 9};
constexpr int ten_runs[2] = {0, 10};

}  // namespace

TEST_CASE("a chain with fixed ends: their rows go along with the others") {
    check_all_fixed_ends<spring_ends, spring_runs, 12, false>();
    check_all_fixed_ends<eleven_reversed, ten_runs, 11, true>();
}
