// SPDX-License-Identifier: MIT
// Linear equations whose unknowns all depend on each other. Others: grouped.hpp.
#ifndef LOBATTO_KERNEL_DENSE_HPP
#define LOBATTO_KERNEL_DENSE_HPP

#include <cstdint>
#include <type_traits>

#include "numbers.hpp"

namespace lobatto {

// Of a pivot, or of a determinant: neither it nor its reciprocal is zero, infinite or not a number.
template <class real>
inline bool is_reciprocal(real inverse) {
    return is_finite(inverse) && inverse != real(0);
}

// A X = B with A of size x size and B of size x columns, both row-major and overwritten; X ends in B. Gaussian
// elimination with partial pivoting. False when a pivot is zero or not finite.
template <int size, int columns, class real>
inline bool solve(real* A, real* B) {
    for (int k = 0; k < size; ++k) {
        int pivot = k;
        for (int i = k + 1; i < size; ++i) {
            if (fabs(A[i * size + k]) > fabs(A[pivot * size + k])) pivot = i;
        }
        if (pivot != k) {
            for (int j = k; j < size; ++j) {
                const real swapped = A[k * size + j];
                A[k * size + j] = A[pivot * size + j];
                A[pivot * size + j] = swapped;
            }
            for (int j = 0; j < columns; ++j) {
                const real swapped = B[k * columns + j];
                B[k * columns + j] = B[pivot * columns + j];
                B[pivot * columns + j] = swapped;
            }
        }
        const real inverse = real(1) / A[k * size + k];
        if (!is_reciprocal(inverse)) return false;
        for (int i = k + 1; i < size; ++i) {
            const real factor = A[i * size + k] * inverse;
            if (factor == real(0)) continue;
            for (int j = k + 1; j < size; ++j) A[i * size + j] -= factor * A[k * size + j];
            for (int j = 0; j < columns; ++j) B[i * columns + j] -= factor * B[k * columns + j];
        }
    }
    for (int k = size - 1; k >= 0; --k) {
        for (int j = 0; j < columns; ++j) {
            real sum = B[k * columns + j];
            for (int i = k + 1; i < size; ++i) sum -= A[k * size + i] * B[i * columns + j];
            B[k * columns + j] = sum / A[k * size + k];
        }
    }
    return true;
}

// LU factors with partial pivoting, in place, A row-major. The inverses of the pivots stand on the diagonal, the
// multipliers where elimination left them, rows are exchanged from the pivot's column on. False when a pivot is zero or
// not finite. `size` is an integer, or a std::integral_constant where the compiler may unroll.
template <class real, class Size>
inline bool factor_dense(real* A, std::int32_t* pivots, Size size) {
    for (int k = 0; k < size; ++k) {
        int pivot = k;
        real largest = fabs(A[k * size + k]);
        for (int i = k + 1; i < size; ++i) {
            const real candidate = fabs(A[i * size + k]);
            if (candidate > largest) {
                largest = candidate;
                pivot = i;
            }
        }
        pivots[k] = pivot;
        if (pivot != k) {
            for (int j = k; j < size; ++j) {
                const real swapped = A[k * size + j];
                A[k * size + j] = A[pivot * size + j];
                A[pivot * size + j] = swapped;
            }
        }
        const real inverse = real(1) / A[k * size + k];
        if (!is_reciprocal(inverse)) return false;
        A[k * size + k] = inverse;
        for (int i = k + 1; i < size; ++i) {
            const real factor = A[i * size + k] * inverse;
            A[i * size + k] = factor;
            for (int j = k + 1; j < size; ++j) A[i * size + j] -= factor * A[k * size + j];
        }
    }
    return true;
}

template <class real, class Size>
inline void solve_dense(const real* LU, const std::int32_t* pivots, real* x, Size size) {
    for (int k = 0; k < size; ++k) {
        const real head = x[pivots[k]];
        x[pivots[k]] = x[k];
        x[k] = head;
        for (int i = k + 1; i < size; ++i) x[i] -= LU[i * size + k] * head;
    }
    for (int k = size - 1; k >= 0; --k) {
        x[k] *= LU[k * size + k];
        for (int i = 0; i < k; ++i) x[i] -= LU[i * size + k] * x[k];
    }
}

// A matrix whose unknowns lie as Layout says, then its factors.
template <class real, class Layout>
struct DenseMatrix {
    static constexpr int size = Layout::size;
    real values[size * size];
    std::int32_t pivots[size];

    void clear() {
        for (int i = 0; i < size * size; ++i) values[i] = real(0);
    }
    // Row: unknown j of block u; column: unknown k of block v.
    real& operator()(int u, int j, int v, int k) { return values[Layout::index(u, j) * size + Layout::index(v, k)]; }

    LOBATTO_APART bool factor() { return factor_dense(values, pivots, std::integral_constant<int, size>{}); }
    // x becomes the solution.
    LOBATTO_APART void solve(real* x) const { solve_dense(values, pivots, x, std::integral_constant<int, size>{}); }
};

// `size` unknowns, each a block of one.
template <int size_>
struct Single {
    static constexpr int size = size_;
    static constexpr int index(int u, int) { return u; }
    template <class real>
    using Matrix = DenseMatrix<real, Single>;
};

// How the unknowns of the stages lie: `per` of each block (an active coordinate) side by side, the blocks in the
// kernel's order position[a], and `extra` single ones last, blocks of one that couple to all.
template <class K, int blocks, int per, int extra>
struct Dense {
    static constexpr int size = blocks * per + extra;
    static constexpr int index(int u, int j) {
        return (u < blocks ? K::position[u] * per : blocks * (per - 1) + u) + j;
    }
    template <class real>
    using Matrix = DenseMatrix<real, Dense>;
};

// The same in the kernel's independent groups, or within a band (grouped.hpp).
template <class K, int blocks, int per>
struct Grouped;

// Whether a group of `count` blocks, the places of coupled ones at most `bandwidth` apart, is solved as dense.
constexpr bool is_dense(int bandwidth, int count) {
    return 3 * (bandwidth + 1) >= count;
}
template <class K>
constexpr bool is_one_dense_group = K::group_count == 1 && is_dense(K::group_bandwidth[0], K::group_first[1]);

template <class K, int blocks, int per, int extra = 0>
using LayoutOf =
    std::conditional_t<(extra > 0 || is_one_dense_group<K>), Dense<K, blocks, per, extra>, Grouped<K, blocks, per>>;

}  // namespace lobatto

#endif
