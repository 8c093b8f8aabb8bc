// SPDX-License-Identifier: MIT
// The order of convergence of a kernel on a given motion, measured in quadruple precision on a ladder of steps.
#pragma once

#include <string>
#include <vector>

#include "runtime/build/library.hpp"

namespace lobatto {

// A start, in quadruple precision: parameters in scene order, q and p of n each.
struct QuadrupleStart {
    std::vector<__float128> parameters, q, p;
};

struct OrderRow {
    double step = 0;
    double error = 0;  // the largest at eight times; against a step 1/8 of the smallest of the ladder; positions
                       // relative to the farthest that one moves, momenta likewise
    double order = 0;  // of the errors and steps, this row against the one before; 0 in the first row
};

struct MeasuredOrder {
    std::vector<OrderRow> rows;   // five steps, each half of the one before, or closer for orders beyond 12
    double duration = 0;          // time units over which they were compared
    double order = 0;             // of the last row
    bool settled = false;         // the last two orders agree: the ladder is fine enough
    bool below_rounding = false;  // not settled, and finer ladders drown in rounding: nothing can be said
    bool exact = false;           // nothing to measure: the largest step has no error but rounding
};

// Over eight of the given steps; the ladder begins at this step, below while the orders have not settled, above
// while errors are no more than rounding, or than `least`: what the coefficients of the kernel err by leads no further.
// ComputationError when no step of the ladder can be taken.
MeasuredOrder measure_order(const Kernel& kernel, const QuadrupleStart& start, double step, double least = 0);

// Whether the measurement bears out an order: within 0.3, of high orders within a thirtieth below and a fifteenth
// above; for a linear system at least (some super-converge); or cannot tell. Beyond order 12 also where the orders
// still rise towards it, less and less, or are those of a nearly linear motion, two higher.
bool bears_out(const MeasuredOrder& convergence, int order, bool linear);

}  // namespace lobatto
