// SPDX-License-Identifier: GPL-2.0-or-later
// Exact arithmetic in the quadratic field Q(sqrt d): the numbers a + b sqrt(d) of rules with few points.
#pragma once

#include <ginac/ginac.h>

#include <utility>

namespace lobatto {

// a + b sqrt(d), a and b rational, d without square factors. Operands of one operation share d, or have b = 0.
struct Surd {
    GiNaC::numeric a = 0;
    GiNaC::numeric b = 0;
    int d = 1;

    Surd() = default;
    Surd(GiNaC::numeric rational) : a(std::move(rational)) {}
    Surd(int integer) : a(integer) {}
    Surd(GiNaC::numeric rational, GiNaC::numeric irrational, int radicand)
        : a(std::move(rational)), b(std::move(irrational)), d(radicand) {}

    static constexpr bool exact = true;
    bool is_zero() const { return a.is_zero() && b.is_zero(); }
    int radicand() const { return b.is_zero() ? 1 : d; }
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

// The root of a positive rational: sqrt(n/m) = sqrt(n m)/m, square factors of n m taken out.
inline Surd root(const Surd& square) {
    const GiNaC::numeric denominator = square.a.denom();
    int radicand = (square.a.numer() * denominator).to_int(), outside = 1;
    for (int factor = 2; factor * factor <= radicand; ++factor)
        for (; radicand % (factor * factor) == 0; radicand /= factor * factor) outside *= factor;
    const GiNaC::numeric scale = GiNaC::numeric(outside) / denominator;
    return radicand == 1 ? Surd(scale) : Surd(0, scale, radicand);
}

}  // namespace lobatto
