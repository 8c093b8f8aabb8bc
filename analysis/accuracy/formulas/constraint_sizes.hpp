// SPDX-License-Identifier: GPL-2.0-or-later
// What rounding in constraints moves positions by. Their terms may be far larger than the positions that they hold, as
// in 3 cos(q) = 3 at q = 0: rounding moves q there, and q tells nothing.
#pragma once

#include <vector>

#include "analysis/tape.hpp"
#include "generator/mechanics/system/system.hpp"

namespace lobatto {

class ConstraintSizes {
public:
    explicit ConstraintSizes(const SystemOutline& system);
    bool empty() const { return rows_.empty(); }

    // Takes a state into `sizes`, n of positions and n of momenta, by which the rounding of each is measured: of a
    // position S w |G_k| / sum_j w_j G_j^2, with S the sizes of the summands of phi, G = dphi/dq and w one over masses.
    void widen(std::vector<double>& sizes, double time, const double* q, const std::vector<double>& parameters) const;

private:
    struct Slope {
        std::size_t coordinate;
        Tape value;
    };
    struct Row {
        std::vector<Tape> summands;
        std::vector<Slope> slopes;
    };

    std::size_t n_;
    std::vector<Row> rows_;
    std::vector<std::optional<Tape>> masses_;  // n: the diagonal of dp/dv
};

}  // namespace lobatto
