// SPDX-License-Identifier: MIT
// entry_row and entry_column of a kernel (contract.hpp) whose matrix has no zeros and is too large for tables.
#ifndef LOBATTO_KERNEL_FULL_MATRIX_HPP
#define LOBATTO_KERNEL_FULL_MATRIX_HPP

#include "numbers.hpp"

namespace lobatto {

// Entries row by row.
template <int columns>
struct RowOfFull {
    constexpr int operator[](int entry) const { return entry / columns; }
};

template <int columns>
struct ColumnOfFull {
    constexpr int operator[](int entry) const { return entry % columns; }
};

}  // namespace lobatto

#endif
