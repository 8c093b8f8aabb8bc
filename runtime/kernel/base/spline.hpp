// SPDX-License-Identifier: MIT
// Measured values: cubic polynomials between the knots of a table. Table has points, x[points], and c[4 * (points -
// 1)], the coefficients of 1, d, d^2, d^3 with d = u - x[i] on each piece, written by the generator.
#ifndef LOBATTO_KERNEL_SPLINE_HPP
#define LOBATTO_KERNEL_SPLINE_HPP

#include <limits>

#include "numbers.hpp"
#include "pack.hpp"

namespace lobatto {

// The piece that holds u; -1: none. A little beyond the ends is rounding of times and places. `real` may have fewer
// digits than the table.
template <class Table, class real>
inline int piece_of(const real& u) {
    constexpr int last = Table::points - 1;
    const real first = real(Table::x[0]), end = real(Table::x[last]);
    const real beyond = real(1e-9) * (end - first) + real(8) * Limits<real>::epsilon * (fabs(first) + fabs(end));
    if (!(u >= first - beyond && u <= end + beyond)) return -1;
    int low = 0, high = last;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        (u < real(Table::x[middle]) ? high : low) = middle;
    }
    return low;
}

// The derivative of this order, 0 to 3, at u; not a number outside the table.
template <class Table, int order, class T>
inline T spline(const T& u) {
    using real = real_of<T>;
    T d = T(real(0)), c[4] = {d, d, d, d};
    for (int lane = 0; lane < lanes_of<T>; ++lane) {
        const real at = lane_of(u, lane);
        const int piece = piece_of<Table>(at);
        set_lane(d, lane, piece < 0 ? real(std::numeric_limits<double>::quiet_NaN()) : at - real(Table::x[piece]));
        for (int k = 0; k < 4; ++k) set_lane(c[k], lane, real(Table::c[4 * (piece < 0 ? 0 : piece) + k]));
    }
    if constexpr (order == 0)
        return ((c[3] * d + c[2]) * d + c[1]) * d + c[0];
    else if constexpr (order == 1)
        return (real(3) * c[3] * d + real(2) * c[2]) * d + c[1];
    else if constexpr (order == 2)
        return real(6) * c[3] * d + real(2) * c[2];
    else
        return real(6) * c[3] + real(0) * d;
}

}  // namespace lobatto

#endif
