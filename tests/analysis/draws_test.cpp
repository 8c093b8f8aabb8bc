// SPDX-License-Identifier: GPL-2.0-or-later
// Random draws: the generator against its published values, the distributions, what a draw depends on; sums over them.
#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "analysis/sweep/draw.hpp"
#include "analysis/sweep/tally.hpp"
#include "tests/support.hpp"

using namespace lobatto;

namespace {

Scene pendulum_scene() {
    return read_scene(std::string(LOBATTO_SOURCE_DIR "/scenes/pendulum.toml"));
}

}  // namespace

TEST_CASE("the generator gives the published values of Philox4x32-10") {
    using Bits = std::array<std::uint32_t, 4>;
    // Random123's kat_vectors.
    CHECK(philox({0, 0, 0, 0}, {0, 0}) == Bits{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
    CHECK(philox({0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}) ==
          Bits{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
    CHECK(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}) ==
          Bits{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
}

TEST_CASE(
    "the quantile of the normal distribution is the inverse of its integral, to 15 digits and far into the tails") {
    CHECK(normal_quantile(0.5) == 0);
    for (double p = 1e-300; p < 0.4; p *= 7.3) {
        const double z = normal_quantile(p);
        // dp = density dz: what a relative error of 2e-15 of z means for p. Measured at most 1.1e-15 of z.
        const double density = std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
        CHECK(std::fabs(std::erfc(-z / std::numbers::sqrt2) / 2 - p) <
              4e-15 * std::fabs(z) * density + 4e-16 * p * (1 + z * z));
        if (p > 1e-10) CHECK(std::fabs(normal_quantile(1 - p) + z) < 1e-16 / density + 4e-15 * std::fabs(z));
    }
}

TEST_CASE("a draw depends on the seed, the name and the number of the row, and has its distribution") {
    const Scene scene = pendulum_scene();
    const Draw q = read_draw(scene, "q ~ uniform(-1, pi)"), v = read_draw(scene, "q'~normal(2, 0.5)");
    CHECK(q.written == "uniform(-1, pi)");
    // The same on every machine: these numbers were drawn once and for all.
    CHECK(q.value(7, 0) == 2.820471926513687);
    CHECK(v.value(7, 123456789012) == 2.0040585222527616);
    CHECK(q.value(7, 0) != q.value(8, 0));
    CHECK(q.value(7, 0) != q.value(7, 1));
    CHECK(q.value(7, 1) != q.value(7, std::int64_t{1} << 32 | 1));
    Sums of_q, of_v;
    double product = 0;
    constexpr int count = 100000;
    for (int row = 0; row < count; ++row) {
        of_q.add(q.value(1, row));
        of_v.add(v.value(1, row));
        product += (q.value(1, row) - (std::numbers::pi - 1) / 2) * (v.value(1, row) - 2);
    }
    // Five standard deviations of each mean.
    const double range = std::numbers::pi + 1, root = std::sqrt(count);
    CHECK(of_q.spread().least >= -1);
    CHECK(of_q.spread().largest < std::numbers::pi);
    CHECK(std::fabs(of_q.spread().mean - (std::numbers::pi - 1) / 2) < 5 * range / std::sqrt(12) / root);
    CHECK(std::fabs(of_v.spread().mean - 2) < 5 * 0.5 / root);
    const double variance = of_v.spread().rms * of_v.spread().rms - of_v.spread().mean * of_v.spread().mean;
    CHECK(std::fabs(variance - 0.25) < 5 * 0.25 * std::numbers::sqrt2 / root);
    CHECK(std::fabs(product / count) < 5 * 0.5 * range / std::sqrt(12) / root);
}

TEST_CASE("a draw that makes no sense is refused where it stands") {
    const Scene scene = pendulum_scene();
    const auto refusal = [&](const std::string& text) {
        return test::message_of<InputError>([&] { read_draw(scene, text); });
    };
    CHECK(refusal("q") ==
          "--draw:1:1: expected NAME ~ normal(MEAN, SD) or NAME ~ uniform(FROM, TO), such as \"q ~ normal(0, 0.1)\"\n"
          "  1 | q\n    | ^");
    CHECK(refusal("r ~ normal(0, 1)").starts_with("--draw:1:1: unknown name 'r'; what can be varied: m, omega, q, q'"));
    CHECK(refusal("step ~ normal(0, 1)").starts_with("--draw:1:1: 'step' is a setting of the method"));
    CHECK(refusal("q ~ cauchy(0, 1)")
              .starts_with("--draw:1:5: 'cauchy' is no distribution; there are normal and uniform"));
    CHECK(refusal("q ~ normal").starts_with("--draw:1:5: expected two numbers in parentheses, such as normal(0, 1)"));
    CHECK(refusal("q ~ normal(0)").starts_with("--draw:1:11: expected two numbers, such as normal(0, 1)"));
    CHECK(refusal("q ~ normal(0, -1)").starts_with("--draw:1:14: the standard deviation is -1; it must be positive"));
    CHECK(refusal("q ~ uniform(2, 1)").starts_with("--draw:1:15: uniform(2, 1) has nothing between its ends"));
    CHECK(refusal("q ~ normal(k, 1)").starts_with("--draw:1:12: unknown name 'k' in the mean of q"));
}

TEST_CASE("a tally counts what failed, and what is said of numbers is of those that succeeded") {
    SweepTally tally(1, 3);
    const double states[][2] = {{1, 0}, {-2, 1}, {5, 5}, {4, 3}, {0.5, 4}};
    for (std::int64_t i = 0; i < 5; ++i)
        tally.add({i, i == 2 ? LOBATTO_NOT_FINITE : LOBATTO_OK, 10, 1.0, 0.1 * static_cast<double>(i), 0.0,
                   static_cast<double>(i)},
                  states[i]);
    CHECK(tally.trajectories() == 5);
    CHECK(tally.failed() == 1);
    CHECK(tally.first_failures().front().index == 2);
    CHECK(tally.q(0).spread().least == -2);
    CHECK(tally.q(0).spread().largest == 4);
    CHECK(tally.q(0).spread().mean == 3.5 / 4);
    CHECK(tally.q(0).spread().rms == std::sqrt(21.25 / 4));
    CHECK(tally.p(0).spread().mean == 2);
    CHECK(tally.energy_error().spread().rms == 0);
    REQUIRE(tally.settings().size() == 2);
    CHECK(tally.settings()[0].failed == 1);
    CHECK(tally.settings()[0].energy_error.index == 1);
    CHECK(tally.settings()[1].steps_done == 20);
    CHECK(tally.worst_error().index == 4);
    CHECK(std::isnan(SweepTally(1, 1).q(0).spread().mean));
}
