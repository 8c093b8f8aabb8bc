// SPDX-License-Identifier: GPL-2.0-or-later
// Random values that depend on a seed, a name and the number of a row, and on nothing else: not on what was drawn
// before, nor on the machine.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "analysis/sweep/axis.hpp"

namespace lobatto {

// A counter and a key become random bits: Philox4x32 with 10 rounds (Salmon et al., "Parallel random numbers: as easy
// as 1, 2, 3", 2011). Equal counters and keys give equal bits.
std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key);

// z with P(a standard normal number < z) = p, for 0 < p < 1; to 16 digits (Wichura, algorithm AS 241, 1988). Sums,
// products, quotients and a square root alone: the same bits from every compiler and library.
double normal_quantile(double p);

// A name that is drawn for each row.
struct Draw {
    enum class Distribution { uniform, normal };
    VariedName of;
    std::string written;  // normal(0, 0.1)
    Distribution distribution = Distribution::uniform;
    double first = 0, second = 1;  // uniform: from, to (left out); normal: mean, standard deviation

    // Of row `row` >= 0. Rows of different names are independent of one another.
    double value(std::uint64_t seed, std::int64_t row) const;
};

// `argument` of --draw: "NAME ~ normal(MEAN, SD)" or "NAME ~ uniform(FROM, TO)". Throws InputError with the place in
// the argument.
Draw read_draw(const Scene& scene, const std::string& argument);

}  // namespace lobatto
