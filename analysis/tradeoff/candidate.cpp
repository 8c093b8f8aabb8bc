// SPDX-License-Identifier: GPL-2.0-or-later
#include "analysis/tradeoff/candidate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace lobatto {

namespace {

constexpr std::int64_t often = 36;  // times that are compared

}  // namespace

std::vector<Member> family_in(Precision precision, bool is_separable) {
    std::vector<Member> members;
    for (const Family family : {Family::lobatto, Family::gauss, Family::splitting}) {
        if (family == Family::splitting && !is_separable) continue;
        for (const int points : sizes_of(family)) members.push_back({family, points, precision});
    }
    return members;
}

const char* word_of(StepClock clock) {
    return clock == StepClock::none ? "none" : clock == StepClock::automatic ? "auto" : "scene";
}

StepClock step_clock_of(const std::string& word) {
    for (const StepClock clock : {StepClock::none, StepClock::automatic, StepClock::of_scene})
        if (word == word_of(clock)) return clock;
    throw std::invalid_argument("no such clock");
}

std::string Candidate::name() const {
    return fmt::format("{} {}{}{}",
                       member.family == Family::lobatto ? "Lobatto"
                       : member.family == Family::gauss ? "Gauss"
                                                        : "Splitting",
                       member.points, member.arithmetic == StepArithmetic::clean ? " clean" : "",
                       member.clock == StepClock::none        ? ""
                       : member.clock == StepClock::automatic ? " clock auto"
                                                              : " clock");
}

bool StepLadder::good(std::int64_t steps) const {
    return std::gcd(steps, std::int64_t(samples_)) >= std::min({steps, often, std::int64_t(samples_)});
}

std::int64_t StepLadder::at_least(double steps) const {
    std::int64_t count = std::max<std::int64_t>(1, static_cast<std::int64_t>(std::ceil(steps)));
    while (!good(count)) ++count;
    // Nearby ones may be compared more often.
    std::int64_t best = count;
    const auto near = static_cast<std::int64_t>(static_cast<double>(count) * (1 + (ratio_ - 1) / 4));
    for (std::int64_t other = count + 1; other <= near && other - count < samples_; ++other)
        if (std::gcd(other, std::int64_t(samples_)) > std::gcd(best, std::int64_t(samples_))) best = other;
    return best;
}

std::int64_t StepLadder::at_most(double steps) const {
    std::int64_t count = std::max<std::int64_t>(1, static_cast<std::int64_t>(std::floor(steps)));
    while (!good(count)) --count;
    return count;
}

}  // namespace lobatto
