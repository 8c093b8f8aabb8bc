// SPDX-License-Identifier: GPL-2.0-or-later
// The positive zeros of a polynomial over the rationals, each in an interval of its own: Sturm's theorem.
#pragma once

#include <ginac/ginac.h>

#include <optional>
#include <string>
#include <vector>

namespace lobatto {

// A polynomial in one variable over Q: coefficients, the lowest degree first, the last one not zero; empty: zero.
using RationalPolynomial = std::vector<GiNaC::numeric>;

// std::invalid_argument when it is no polynomial in z with rational coefficients.
RationalPolynomial rational_polynomial(const GiNaC::ex& polynomial, const GiNaC::symbol& z);
GiNaC::numeric value(const RationalPolynomial& f, const GiNaC::numeric& x);
RationalPolynomial derivative(const RationalPolynomial& f);
// The multiple with coprime integer coefficients, the last one positive.
RationalPolynomial primitive(const RationalPolynomial& f);

// "3600 - 1680*z + 92*z^2 - z^3".
std::string text_of(const RationalPolynomial& f, const std::string& variable);

// f, f', and then the negative of each remainder of the two before. For f without multiple zeros the number of changes
// of sign along the chain falls by one at each real zero as x passes it, and nowhere else.
class SturmChain {
public:
    explicit SturmChain(const RationalPolynomial& f);
    const std::vector<RationalPolynomial>& polynomials() const { return chain_; }
    // Signs along the chain, -1, 0 or 1: at x, and for x towards infinity.
    std::vector<int> signs(const GiNaC::numeric& x) const;
    std::vector<int> signs_at_infinity() const;
    // The number of zeros in (low, high], and in (low, infinity).
    int zeros(const GiNaC::numeric& low, const GiNaC::numeric& high) const;
    int zeros_beyond(const GiNaC::numeric& low) const;

private:
    std::vector<RationalPolynomial> chain_;
};
int changes_of_sign(const std::vector<int>& signs);  // zeros left out

// One real zero: of an irreducible polynomial, and of no other of that polynomial's between low and high.
struct RealRoot {
    RationalPolynomial polynomial;  // irreducible over Q, primitive
    int multiplicity = 1;           // of that factor
    GiNaC::numeric low, high;       // rationals, low <= zero <= high; equal when the zero is rational

    // Narrows the interval to a width of at most `width`.
    void refine(const GiNaC::numeric& width);
    // Within 10^-digits, relative.
    GiNaC::numeric approximation(int digits) const;
    // A number or a + b sqrt(d), where the polynomial is of degree two at most.
    std::optional<GiNaC::ex> exact() const;
};

// All zeros z > 0, ascending, the intervals disjoint. Multiplicities are those in the polynomial.
std::vector<RealRoot> positive_roots(const GiNaC::ex& polynomial, const GiNaC::symbol& z);

// "39 + sqrt(849)" and "sqrt(39 + sqrt(849))": the zero and its square root where there are radicals, else "".
std::string radicals_of(const RealRoot& root);
std::string radicals_of_square_root(const RealRoot& root);

// The zero, or its square root, correctly rounded to this many significant digits.
std::string decimal_of(const RealRoot& root, int digits);
std::string decimal_of_square_root(const RealRoot& root, int digits);

}  // namespace lobatto
