// SPDX-License-Identifier: MIT
// Linear equations: small dense ones, and those of the stages, in independent groups, each banded or dense.
#ifndef LOBATTO_KERNEL_SOLVE_HPP
#define LOBATTO_KERNEL_SOLVE_HPP

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

// The same for a matrix with `band` diagonals on either side. Row i holds the columns i - band ... i + 2 band, the last
// `band` of them for what exchanges of rows bring in; entries outside the matrix are not touched.
template <class real, class Size, class Band>
inline bool factor_band(real* A, std::int32_t* pivots, Size size, Band band) {
    const int width = 3 * band + 1;
    int reach = 0;  // the last column that row k has entries in
    for (int k = 0; k < size; ++k) {
        const int last = k + band < size ? k + band : size - 1;
        real* const row = A + k * width + band - k;  // row[j] is A_kj
        int pivot = k;
        real largest = fabs(row[k]);
        for (int i = k + 1; i <= last; ++i) {
            const real candidate = fabs(A[i * width + k - i + band]);
            if (candidate > largest) {
                largest = candidate;
                pivot = i;
            }
        }
        pivots[k] = pivot;
        if (pivot + band > reach) reach = pivot + band < size ? pivot + band : size - 1;
        if (pivot != k) {
            real* const other = A + pivot * width + band - pivot;
            for (int j = k; j <= reach; ++j) {
                const real swapped = row[j];
                row[j] = other[j];
                other[j] = swapped;
            }
        }
        const real inverse = real(1) / row[k];
        if (!is_reciprocal(inverse)) return false;
        row[k] = inverse;
        for (int i = k + 1; i <= last; ++i) {
            real* const below = A + i * width + band - i;
            const real factor = below[k] * inverse;
            below[k] = factor;
            if (factor == real(0)) continue;
            for (int j = k + 1; j <= reach; ++j) below[j] -= factor * row[j];
        }
    }
    return true;
}

template <class real, class Size, class Band>
inline void solve_band(const real* LU, const std::int32_t* pivots, real* x, Size size, Band band) {
    const int width = 3 * band + 1;
    for (int k = 0; k < size; ++k) {
        const int last = k + band < size ? k + band : size - 1;
        const real head = x[pivots[k]];
        x[pivots[k]] = x[k];
        x[k] = head;
        for (int i = k + 1; i <= last; ++i) x[i] -= LU[i * width + k - i + band] * head;
    }
    for (int k = size - 1; k >= 0; --k) {
        const int last = k + 2 * band < size ? k + 2 * band : size - 1;
        const real* const row = LU + k * width + band - k;
        real sum = x[k];
        for (int j = k + 1; j <= last; ++j) sum -= row[j] * x[j];
        x[k] = sum * row[k];
    }
}

// How the unknowns of the stages lie: `per` of each block (an active coordinate) side by side, the blocks in the
// kernel's order, and `extra` single ones last, which couple to all and make it one dense group. The kernel's tables:
//   position[a]           place of coordinate a in the order
//   group_count, group_first[group_count + 1]   independent groups, as ranges of places
//   group_bandwidth[g]    the largest distance between the places of two coupled coordinates
template <class K, int blocks_, int per_, int extra>
struct Grouped {
    static constexpr int blocks = blocks_, per = per_, size = blocks * per + extra;
    static constexpr int groups = extra > 0 ? 1 : K::group_count;
    static constexpr int first(int group) { return extra > 0 ? 0 : K::group_first[group] * per; }
    static constexpr int count(int group) {
        return extra > 0 ? size : (K::group_first[group + 1] - K::group_first[group]) * per;
    }
    static constexpr int band(int group) { return extra > 0 ? size : K::group_bandwidth[group] * per + per - 1; }
    // The unknown j of block u; the extra ones are blocks of one.
    static constexpr int index(int u, int j) {
        return (u < blocks ? K::position[u] * per : blocks * (per - 1) + u) + j;
    }
};

// One dense group without an order.
template <int size_>
struct Whole {
    static constexpr int blocks = size_, per = 1, size = size_, groups = 1;
    static constexpr int first(int) { return 0; }
    static constexpr int count(int) { return size; }
    static constexpr int band(int) { return size; }
    static constexpr int index(int u, int) { return u; }
};

template <class Layout>
constexpr bool group_is_dense(int group) {
    return 3 * Layout::band(group) >= Layout::count(group);
}

// Where the block rows begin in memory: entry (u, j; column) at corner[u] + j * stride[u] + column.
template <class Layout>
struct Places {
    int corner[Layout::blocks > 0 ? Layout::blocks : 1]{}, stride[Layout::blocks > 0 ? Layout::blocks : 1]{};
    int offset[Layout::groups + 1]{};  // of the groups' storage
    constexpr Places() {
        for (int g = 0; g < Layout::groups; ++g)
            offset[g + 1] =
                offset[g] + Layout::count(g) * (group_is_dense<Layout>(g) ? Layout::count(g) : 3 * Layout::band(g) + 1);
        for (int u = 0; u < Layout::blocks; ++u) {
            const int row = Layout::index(u, 0);
            int g = 0, beyond = Layout::groups;
            while (beyond - g > 1) {
                const int middle = (g + beyond) / 2;
                (Layout::first(middle) <= row ? g : beyond) = middle;
            }
            const int first = Layout::first(g), band = Layout::band(g);
            stride[u] = group_is_dense<Layout>(g) ? Layout::count(g) : 3 * band;
            corner[u] = offset[g] + (group_is_dense<Layout>(g) ? 0 : band) + (row - first) * stride[u] - first;
        }
    }
};
template <class Layout>
constexpr Places<Layout> places{};

// A matrix of such unknowns, then its factors.
template <class real, class Layout>
struct GroupedMatrix {
    static constexpr int size = Layout::size;
    static constexpr int storage = places<Layout>.offset[Layout::groups];
    real values[storage];
    std::int32_t pivots[size];

    void clear() {
        for (int i = 0; i < storage; ++i) values[i] = real(0);
    }
    // Row: unknown j of block u; column: unknown k of block v.
    real& operator()(int u, int j, int v, int k) {
        if constexpr (Layout::groups == 1 && group_is_dense<Layout>(0))
            return values[Layout::index(u, j) * size + Layout::index(v, k)];
        else
            return values[places<Layout>.corner[u] + j * places<Layout>.stride[u] + Layout::index(v, k)];
    }

    bool factor() {
        if constexpr (Layout::groups == 1) {
            constexpr std::integral_constant<int, size> all{};
            if constexpr (group_is_dense<Layout>(0))
                return factor_dense(values, pivots, all);
            else
                return factor_band(values, pivots, all, std::integral_constant<int, Layout::band(0)>{});
        } else {
            for (int g = 0; g < Layout::groups; ++g) {
                real* const A = values + places<Layout>.offset[g];
                std::int32_t* const exchanged = pivots + Layout::first(g);
                if (!(group_is_dense<Layout>(g) ? factor_dense(A, exchanged, Layout::count(g))
                                                : factor_band(A, exchanged, Layout::count(g), Layout::band(g))))
                    return false;
            }
            return true;
        }
    }

    // x becomes the solution.
    void solve(real* x) const {
        if constexpr (Layout::groups == 1) {
            constexpr std::integral_constant<int, size> all{};
            if constexpr (group_is_dense<Layout>(0))
                solve_dense(values, pivots, x, all);
            else
                solve_band(values, pivots, x, all, std::integral_constant<int, Layout::band(0)>{});
        } else {
            for (int g = 0; g < Layout::groups; ++g) {
                const real* const LU = values + places<Layout>.offset[g];
                const std::int32_t* const exchanged = pivots + Layout::first(g);
                if (group_is_dense<Layout>(g))
                    solve_dense(LU, exchanged, x + Layout::first(g), Layout::count(g));
                else
                    solve_band(LU, exchanged, x + Layout::first(g), Layout::count(g), Layout::band(g));
            }
        }
    }
};

}  // namespace lobatto

#endif
