// SPDX-License-Identifier: MIT
// The order of convergence of a kernel on a given motion, measured in quadruple precision on a ladder of steps.
#include "runtime/measure/measured_order.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "runtime/error.hpp"
#include "runtime/measure/extent.hpp"

namespace lobatto {

namespace {

using Quadruple = __float128;
using States = std::vector<Quadruple>;  // q, p at the eight times, one after the other

constexpr int coarse_steps = 8;  // where errors are compared
// How many steps each of these is divided into. Of a high order two halvings lead from too coarse a step to rounding.
constexpr std::array<int, 5> halvings = {1, 2, 4, 8, 16}, near_ones = {2, 3, 4, 6, 8};
constexpr int high_order = 12;
constexpr int finest_ratio = 8;    // the reference against the smallest step of the ladder
constexpr int most_attempts = 14;  // ladders, each half of the one before, or three or four times it below rounding
constexpr double roundings = 64;   // of a step, all the same way; measured: 5 on the linear oscillator
constexpr double least_error = 1e-29;
constexpr double flat_order = 0.1, flat_error = 1e-20;  // errors that do not depend on the step are rounding, if small

Quadruple size(Quadruple x) {
    return x < 0 ? -x : x;
}

// The states at the eight times with `ratio` steps in each; nothing when a step fails.
std::optional<States> states_with(LoadedStepper<Quadruple>& stepper, const QuadrupleStart& start, Quadruple coarse,
                                  int ratio) {
    const std::size_t columns = 1 + 2 * start.q.size();
    std::vector<Quadruple> rows(coarse_steps * columns);
    lobatto_advance call{};
    call.steps = std::int64_t(coarse_steps) * ratio;
    call.record_every = ratio;
    call.records = rows.data();
    call.capacity = coarse_steps;
    if (stepper.prepare(start.parameters, coarse / ratio) != LOBATTO_OK ||
        stepper.start(0, start.q, start.p) != LOBATTO_OK || stepper.advance(call) != LOBATTO_OK)
        return std::nullopt;
    States states;
    for (int i = 0; i < coarse_steps; ++i)
        states.insert(states.end(), rows.begin() + static_cast<std::ptrdiff_t>(i * columns + 1),
                      rows.begin() + static_cast<std::ptrdiff_t>((i + 1) * columns));
    return states;
}

Extent<Quadruple> extent_of(const States& states, const QuadrupleStart& start) {
    const std::size_t n = start.q.size();
    Extent<Quadruple> extent(n);
    for (std::size_t i = 0; i < states.size(); ++i) {
        const std::size_t k = i % (2 * n);
        extent.take(k, k < n ? start.q[k] : start.p[k - n], states[i]);
    }
    return extent;
}

Quadruple most(const States& values, std::size_t block) {
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(block);
    return *std::max_element(begin, begin + std::ssize(values) / 2);
}

// The largest error of the positions relative to the farthest that one moves, or of the momenta likewise.
double error_of(const States& states, const States& reference, const QuadrupleStart& start) {
    const std::size_t n = start.q.size();
    const Extent<Quadruple> extent = extent_of(reference, start);
    double worst = 0;
    for (const std::size_t block : {std::size_t(0), n}) {
        if (!extent.moves(block)) continue;
        Quadruple error = 0;
        for (std::size_t i = 0; i < states.size(); ++i)
            if (i / n % 2 == block / n) error = std::max(error, size(states[i] - reference[i]));
        worst = std::max(worst, static_cast<double>(error / most(extent.range, block)));
    }
    return worst;
}

// What rounding alone may put into error_of: that of the reference's steps, relative to the farthest moved.
double rounding_error(const States& reference, const QuadrupleStart& start, int reference_ratio) {
    const Extent<Quadruple> extent = extent_of(reference, start);
    const int steps = coarse_steps * reference_ratio;
    double worst = least_error;
    for (const std::size_t block : {std::size_t(0), start.q.size()})
        if (extent.moves(block))
            worst = std::max(worst, std::ldexp(roundings * steps, -113) *
                                        static_cast<double>(most(extent.largest, block) / most(extent.range, block)));
    return worst;
}

}  // namespace

MeasuredOrder measure_order(const Kernel& kernel, const QuadrupleStart& start, double step, double least) {
    LoadedStepper<Quadruple> stepper(kernel);
    const auto& ladder = kernel->order > high_order ? near_ones : halvings;
    const int reference_ratio = ladder.back() * finest_ratio;
    MeasuredOrder best;
    bool below_rounding = false;
    double least_change = std::numeric_limits<double>::infinity();  // between the last two orders of a ladder
    Quadruple coarse = step;
    for (int attempt = 0; attempt < most_attempts && !best.settled; ++attempt) {
        const std::optional<States> reference = states_with(stepper, start, coarse, reference_ratio);
        if (!reference) {
            coarse /= 2;
            continue;
        }
        const double rounding = std::fmax(least, rounding_error(*reference, start, reference_ratio));
        MeasuredOrder measured;
        measured.duration = static_cast<double>(coarse_steps * coarse);
        bool too_coarse = false;
        for (const int ratio : ladder) {
            const std::optional<States> states = states_with(stepper, start, coarse, ratio);
            if (!states) {
                too_coarse = true;
                continue;
            }
            OrderRow row{static_cast<double>(coarse) / ratio, error_of(*states, *reference, start), 0};
            if (row.error < rounding) break;
            if (!measured.rows.empty())
                row.order =
                    std::log(measured.rows.back().error / row.error) / std::log(measured.rows.back().step / row.step);
            measured.rows.push_back(row);
        }
        const std::size_t count = measured.rows.size();
        if (count < 3 && too_coarse) {
            coarse /= 2;
            continue;
        }
        if (count < 3) {  // below rounding too soon
            below_rounding = true;
            if (best.rows.empty()) best.exact = count == 0;
            coarse *= kernel->order > high_order ? 3 : 4;  // 3 / 2: other steps than those tried
            continue;
        }
        measured.order = measured.rows.back().order;
        const double change = std::fabs(measured.order - measured.rows[count - 2].order);
        measured.settled = change < std::fmax(0.1, measured.order / 30);
        const auto is_flat = [](const OrderRow& row) {
            return row.error < flat_error && std::fabs(row.order) < flat_order;
        };
        measured.exact = std::all_of(measured.rows.begin(), measured.rows.end(), is_flat);
        if (best.rows.empty() || change < least_change) best = measured;
        least_change = std::fmin(least_change, change);
        coarse /= 2;
    }
    best.below_rounding = below_rounding && !best.settled && !best.exact;
    if (best.rows.empty() && !best.exact && !best.below_rounding)
        throw ComputationError("the order cannot be measured: the steps fail from this start, however short");
    return best;
}

namespace {

// By how much the orders of a ladder may still rise: by as much as they last did, where that is a high order's and less
// than before.
double still_to_come(const std::vector<OrderRow>& rows, int order) {
    if (order <= high_order || rows.size() < 4) return 0;  // the first row has no order
    const auto from_end = [&](std::size_t i) { return rows[rows.size() - i].order; };
    const double change = from_end(1) - from_end(2), before = from_end(2) - from_end(3);
    return change > 0 && change < before ? change : 0;
}

}  // namespace

bool bears_out(const MeasuredOrder& convergence, int order, bool linear) {
    if (convergence.exact || convergence.below_rounding) return true;
    const double below = std::fmax(0.3, order / 30.0) + still_to_come(convergence.rows, order),
                 above = std::fmax(0.3, order / 15.0);
    // Nearly linear motions seem to converge as linear ones do, two orders faster: of high orders little room is left
    // above rounding for the rest to show.
    const bool is_nearly_linear = order > high_order && std::fabs(convergence.order - order - 2) < 0.5;
    return convergence.settled && convergence.order > order - below &&
           (linear || is_nearly_linear || convergence.order < order + above);
}

}  // namespace lobatto
