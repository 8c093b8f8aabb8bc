// SPDX-License-Identifier: GPL-2.0-or-later
// Exact arithmetic in the quadratic field Q(sqrt d): the numbers a + b sqrt(d) of Lobatto rules with up to 5 points.
#pragma once

#include <ginac/ginac.h>

#include <stdexcept>
#include <utility>
#include <vector>

namespace lobatto {

// a + b sqrt(d), a and b rational. Operands of one operation share d, or have b = 0.
struct Surd {
    GiNaC::numeric a = 0;
    GiNaC::numeric b = 0;
    int d = 1;

    Surd() = default;
    Surd(GiNaC::numeric rational) : a(std::move(rational)) {}
    Surd(int integer) : a(integer) {}
    Surd(GiNaC::numeric rational, GiNaC::numeric irrational, int radicand)
        : a(std::move(rational)), b(std::move(irrational)), d(radicand) {}

    bool is_zero() const { return a.is_zero() && b.is_zero(); }
    GiNaC::ex expression() const { return b.is_zero() ? GiNaC::ex(a) : a + b * GiNaC::sqrt(GiNaC::ex(d)); }

    friend Surd operator+(const Surd& x, const Surd& y) { return {x.a + y.a, x.b + y.b, common(x, y)}; }
    friend Surd operator-(const Surd& x, const Surd& y) { return {x.a - y.a, x.b - y.b, common(x, y)}; }
    friend Surd operator*(const Surd& x, const Surd& y) {
        const int radicand = common(x, y);
        return {x.a * y.a + x.b * y.b * radicand, x.a * y.b + x.b * y.a, radicand};
    }
    friend Surd operator/(const Surd& x, const Surd& y) {
        const int radicand = common(x, y);
        const GiNaC::numeric norm = y.a * y.a - y.b * y.b * radicand;  // zero only for y = 0: the radicand is no square
        return x * Surd(y.a / norm, -y.b / norm, radicand);
    }

private:
    static int common(const Surd& x, const Surd& y) { return x.b.is_zero() ? y.d : x.d; }
};

using SurdMatrix = std::vector<std::vector<Surd>>;

// The inverse of a square matrix by Gauss-Jordan elimination.
inline SurdMatrix inverse(SurdMatrix matrix) {
    const std::size_t n = matrix.size();
    SurdMatrix result(n, std::vector<Surd>(n));
    for (std::size_t i = 0; i < n; ++i) result[i][i] = Surd(1);
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t pivot = k;
        while (pivot < n && matrix[pivot][k].is_zero()) ++pivot;
        if (pivot == n) throw std::logic_error("inverse of a singular matrix");
        std::swap(matrix[k], matrix[pivot]);
        std::swap(result[k], result[pivot]);
        const Surd divisor = matrix[k][k];
        for (std::size_t j = 0; j < n; ++j) {
            matrix[k][j] = matrix[k][j] / divisor;
            result[k][j] = result[k][j] / divisor;
        }
        for (std::size_t i = 0; i < n; ++i) {
            if (i == k || matrix[i][k].is_zero()) continue;
            const Surd factor = matrix[i][k];
            for (std::size_t j = 0; j < n; ++j) {
                matrix[i][j] = matrix[i][j] - factor * matrix[k][j];
                result[i][j] = result[i][j] - factor * result[k][j];
            }
        }
    }
    return result;
}

}  // namespace lobatto
