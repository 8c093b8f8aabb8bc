// SPDX-License-Identifier: MIT
// Linear equations of the stages in independent groups, each dense or within a band.
#ifndef LOBATTO_KERNEL_GROUPED_HPP
#define LOBATTO_KERNEL_GROUPED_HPP

#include <cstdint>
#include <type_traits>

#include "dense.hpp"
#include "numbers.hpp"

namespace lobatto {

// As factor_dense and solve_dense, for a matrix with `band` diagonals on either side. Row i holds the columns i - band
// ... i + 2 band, the last `band` of them for what exchanges of rows bring in; entries outside the matrix are not
// touched.
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

template <class real, class Layout>
struct GroupedMatrix;

// As Dense; the kernel's tables:
//   group_count, group_first[group_count + 1]   independent groups, as ranges of places
//   group_bandwidth[g]    the largest distance between the places of two coupled coordinates
template <class K, int blocks_, int per_>
struct Grouped {
    static constexpr int blocks = blocks_, per = per_, size = blocks * per, groups = K::group_count;
    static constexpr int first(int group) { return K::group_first[group] * per; }
    static constexpr int count(int group) { return (K::group_first[group + 1] - K::group_first[group]) * per; }
    static constexpr int band(int group) { return K::group_bandwidth[group] * per + per - 1; }
    static constexpr bool dense(int group) {
        return is_dense(K::group_bandwidth[group], K::group_first[group + 1] - K::group_first[group]);
    }
    static constexpr int index(int u, int j) { return K::position[u] * per + j; }
    template <class real>
    using Matrix = GroupedMatrix<real, Grouped>;
};

// Where the block rows begin in memory: entry (u, j; column) at corner[u] + j * stride[u] + column.
template <class Layout>
struct Places {
    int corner[Layout::blocks]{}, stride[Layout::blocks]{};
    int offset[Layout::groups + 1]{};  // of the groups' storage
    constexpr Places() {
        for (int g = 0; g < Layout::groups; ++g)
            offset[g + 1] =
                offset[g] + Layout::count(g) * (Layout::dense(g) ? Layout::count(g) : 3 * Layout::band(g) + 1);
        for (int u = 0; u < Layout::blocks; ++u) {
            const int row = Layout::index(u, 0);
            int g = 0, beyond = Layout::groups;
            while (beyond - g > 1) {
                const int middle = (g + beyond) / 2;
                (Layout::first(middle) <= row ? g : beyond) = middle;
            }
            const int first = Layout::first(g), band = Layout::band(g);
            stride[u] = Layout::dense(g) ? Layout::count(g) : 3 * band;
            corner[u] = offset[g] + (Layout::dense(g) ? 0 : band) + (row - first) * stride[u] - first;
        }
    }
};
template <class Layout>
constexpr Places<Layout> places{};

// As DenseMatrix.
template <class real, class Layout>
struct GroupedMatrix {
    static constexpr int size = Layout::size;
    static constexpr int storage = places<Layout>.offset[Layout::groups];
    real values[storage];
    std::int32_t pivots[size];

    void clear() {
        for (int i = 0; i < storage; ++i) values[i] = real(0);
    }
    real& operator()(int u, int j, int v, int k) {
        return values[places<Layout>.corner[u] + j * places<Layout>.stride[u] + Layout::index(v, k)];
    }

    bool factor() {
        if constexpr (Layout::groups == 1) {
            return factor_band(values, pivots, std::integral_constant<int, size>{},
                               std::integral_constant<int, Layout::band(0)>{});
        } else {
            for (int g = 0; g < Layout::groups; ++g) {
                real* const A = values + places<Layout>.offset[g];
                std::int32_t* const exchanged = pivots + Layout::first(g);
                if (!(Layout::dense(g) ? factor_dense(A, exchanged, Layout::count(g))
                                       : factor_band(A, exchanged, Layout::count(g), Layout::band(g))))
                    return false;
            }
            return true;
        }
    }

    void solve(real* x) const {
        if constexpr (Layout::groups == 1) {
            solve_band(values, pivots, x, std::integral_constant<int, size>{},
                       std::integral_constant<int, Layout::band(0)>{});
        } else {
            for (int g = 0; g < Layout::groups; ++g) {
                const real* const LU = values + places<Layout>.offset[g];
                const std::int32_t* const exchanged = pivots + Layout::first(g);
                if (Layout::dense(g))
                    solve_dense(LU, exchanged, x + Layout::first(g), Layout::count(g));
                else
                    solve_band(LU, exchanged, x + Layout::first(g), Layout::count(g), Layout::band(g));
            }
        }
    }
};

}  // namespace lobatto

#endif
