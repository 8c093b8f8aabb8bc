// SPDX-License-Identifier: MIT
// How well phi(q, t) is known: its terms may be far larger than q, as cos(q) - 1 at q = 0. What follows from phi = 0 is
// no better, however small it is.
#ifndef LOBATTO_KERNEL_CONSTRAINT_ROUNDING_HPP
#define LOBATTO_KERNEL_CONSTRAINT_ROUNDING_HPP

#include "../base/contract.hpp"
#include "../base/numbers.hpp"

namespace lobatto {

// Raises size[c], for each constraint c, to half of the sizes of its summands, so that epsilon times size is at least
// what phi is rounded by.
template <class K, class Coefficients, class real>
LOBATTO_APART void raise_to_summands(const Coefficients& k, const real& time, const real* q, real* size) {
    real T[K::constraint_summand_count], all[K::constraints] = {};
    Formulas<K>::constraint_summands(k, time, q, +T);
    for (int e = 0; e < K::constraint_summand_count; ++e) all[K::constraint_summand_row[e]] += fabs(T[e]);
    for (int c = 0; c < K::constraints; ++c) size[c] = maximum(size[c], real(0.5) * all[c]);
}

}  // namespace lobatto

#endif
