// SPDX-License-Identifier: GPL-2.0-or-later
// The solvers of runtime/kernel/base/dense.hpp and grouped.hpp against Eigen: dense, banded, and in groups of either
// kind.
#include <doctest/doctest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

#include "runtime/kernel/base/grouped.hpp"

using namespace lobatto;

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::mt19937_64 generator(7);

double entry() {
    return std::uniform_real_distribution<double>(-1, 1)(generator);
}

// At most this many roundings times the condition; 4.2 measured.
void check_solution(const MatrixXd& A, const VectorXd& x, const VectorXd& b) {
    const VectorXd expected = A.fullPivLu().solve(b);
    const double condition = A.norm() * A.inverse().norm();
    CHECK((x - expected).norm() <= 16 * std::numeric_limits<double>::epsilon() * condition * expected.norm());
}

// Five coordinates in an order of their own, in groups of 1, 3 and 1; the second is a chain.
struct Groups {
    static constexpr int position[5] = {3, 0, 2, 4, 1};
    static constexpr int group_count = 3, group_first[4] = {0, 1, 4, 5}, group_bandwidth[3] = {0, 1, 0};
};
// Forty in a chain, every other one backwards.
struct Chain {
    static constexpr int position[40] = {1,  0,  3,  2,  5,  4,  7,  6,  9,  8,  11, 10, 13, 12,
                                         15, 14, 17, 16, 19, 18, 21, 20, 23, 22, 25, 24, 27, 26,
                                         29, 28, 31, 30, 33, 32, 35, 34, 37, 36, 39, 38};
    static constexpr int group_count = 1, group_first[2] = {0, 40}, group_bandwidth[1] = {2};
};
// Two chains of twenty.
struct TwoChains : Chain {
    static constexpr int group_count = 2, group_first[3] = {0, 20, 40}, group_bandwidth[2] = {2, 1};
};
// Three in a chain, which is dense enough.
struct Full {
    static constexpr int position[3] = {2, 0, 1};
    static constexpr int group_count = 1, group_first[2] = {0, 3}, group_bandwidth[1] = {1};
};

template <class Tables, int blocks, int per, int extra = 0>
void check_grouped() {
    using Layout = LayoutOf<Tables, blocks, per, extra>;
    for (int trial = 0; trial < 50; ++trial) {
        typename Layout::template Matrix<double> matrix;
        matrix.clear();
        MatrixXd A = MatrixXd::Zero(Layout::size, Layout::size);
        const auto group_of = [](int place) {
            int g = 0;
            while (place >= Tables::group_first[g + 1]) ++g;
            return g;
        };
        for (int u = 0; u < blocks + extra; ++u)
            for (int v = 0; v < blocks + extra; ++v) {
                if (u < blocks && v < blocks && extra == 0) {
                    const int a = Tables::position[u], b = Tables::position[v];
                    if (group_of(a) != group_of(b) || std::abs(a - b) > Tables::group_bandwidth[group_of(a)]) continue;
                }
                for (int j = 0; j < (u < blocks ? per : 1); ++j)
                    for (int k = 0; k < (v < blocks ? per : 1); ++k) {
                        const double value = u == v && j == k ? 1e-9 * entry() : entry();  // so that rows are exchanged
                        matrix(u, j, v, k) += value;
                        A(Layout::index(u, j), Layout::index(v, k)) += value;
                    }
            }
        const VectorXd b = VectorXd::NullaryExpr(Layout::size, [] { return entry(); });
        if (!A.fullPivLu().isInvertible() || A.fullPivLu().rcond() < 1e-10) continue;
        VectorXd x = b;
        REQUIRE(matrix.factor());
        matrix.solve(x.data());
        check_solution(A, x, b);
    }
}

}  // namespace

TEST_CASE("dense systems with exchanges of rows are solved to rounding") {
    for (const int size : {1, 2, 3, 7, 20}) {
        for (int trial = 0; trial < 50; ++trial) {
            MatrixXd A = MatrixXd::NullaryExpr(size, size, [] { return entry(); });
            if (size > 1) A.diagonal().setZero();
            if (!A.fullPivLu().isInvertible() || A.fullPivLu().rcond() < 1e-10) continue;
            const VectorXd b = VectorXd::NullaryExpr(size, [] { return entry(); });
            std::vector<double> work(static_cast<std::size_t>(size * size));
            for (int i = 0; i < size; ++i)
                for (int j = 0; j < size; ++j) work[static_cast<std::size_t>(i * size + j)] = A(i, j);
            std::vector<std::int32_t> pivots(static_cast<std::size_t>(size));
            VectorXd x = b;
            REQUIRE(factor_dense(work.data(), pivots.data(), size));
            solve_dense(work.data(), pivots.data(), x.data(), size);
            check_solution(A, x, b);
        }
    }
}

TEST_CASE("banded systems with exchanges of rows are solved to rounding") {
    for (const int size : {1, 2, 5, 30})
        for (const int band : {0, 1, 2, 5}) {
            const int width = 3 * band + 1;
            for (int trial = 0; trial < 50; ++trial) {
                MatrixXd A = MatrixXd::Zero(size, size);
                std::vector<double> work(static_cast<std::size_t>(size * width));
                for (int i = 0; i < size; ++i)
                    for (int j = std::max(0, i - band); j < std::min(size, i + band + 1); ++j) {
                        A(i, j) = i == j && band > 0 ? 1e-9 * entry() : entry();
                        work[static_cast<std::size_t>(i * width + j - i + band)] = A(i, j);
                    }
                if (!A.fullPivLu().isInvertible() || A.fullPivLu().rcond() < 1e-10) continue;
                const VectorXd b = VectorXd::NullaryExpr(size, [] { return entry(); });
                std::vector<std::int32_t> pivots(static_cast<std::size_t>(size));
                VectorXd x = b;
                REQUIRE(factor_band(work.data(), pivots.data(), size, band));
                solve_band(work.data(), pivots.data(), x.data(), size, band);
                check_solution(A, x, b);
            }
        }
}

TEST_CASE("a matrix is dense or banded as its groups are, in the kernel's order" * doctest::test_suite("slow")) {
    CHECK(Grouped<Groups, 5, 2>::dense(1));
    CHECK_FALSE(Grouped<Chain, 40, 3>::dense(0));
    CHECK(places<Grouped<Chain, 40, 3>>.offset[1] == 120 * (3 * 8 + 1));
    CHECK(std::is_same_v<LayoutOf<Full, 3, 2>, Dense<Full, 3, 2, 0>>);
    check_grouped<Groups, 5, 2>();
    check_grouped<Chain, 40, 3>();
    check_grouped<TwoChains, 40, 2>();
    check_grouped<Full, 3, 2>();
    check_grouped<Groups, 5, 2, 3>();  // single unknowns last: dense
}

TEST_CASE("a singular matrix is refused") {
    double dependent[4] = {1, 2, 2, 4}, unknown[1] = {std::numeric_limits<double>::quiet_NaN()};
    std::int32_t pivots[2];
    CHECK_FALSE(factor_dense(dependent, pivots, 2));
    CHECK_FALSE(factor_dense(unknown, pivots, 1));
    double tridiagonal[12] = {0, 1, 1, 0, 1, 2, 1, 0, 1, 1, 0, 0};  // rows (1 1 0), (1 2 1), (0 1 1)
    std::int32_t three[3];
    CHECK_FALSE(factor_band(tridiagonal, three, 3, 1));
}
