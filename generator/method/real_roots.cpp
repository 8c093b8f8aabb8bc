// SPDX-License-Identifier: GPL-2.0-or-later
// The positive zeros of a polynomial over the rationals, each in an interval of its own: Sturm's theorem.
#include "generator/method/real_roots.hpp"

#include <algorithm>
#include <stdexcept>

#include "generator/graph/notation.hpp"

namespace lobatto {

namespace {

using GiNaC::ex;
using GiNaC::numeric;

int sign(const numeric& x) {
    return x.is_zero() ? 0 : x.is_positive() ? 1 : -1;
}

void drop_leading_zeros(RationalPolynomial& f) {
    while (!f.empty() && f.back().is_zero()) f.pop_back();
}

RationalPolynomial remainder(RationalPolynomial f, const RationalPolynomial& g) {
    while (f.size() >= g.size()) {
        const numeric factor = f.back() / g.back();
        const std::size_t shift = f.size() - g.size();
        for (std::size_t k = 0; k < g.size(); ++k) f[shift + k] -= factor * g[k];
        f.back() = 0;
        drop_leading_zeros(f);
    }
    return f;
}

// By a positive number: signs stay.
RationalPolynomial shortened(const RationalPolynomial& f) {
    RationalPolynomial g = primitive(f);
    if (!f.empty() && f.back().is_negative())
        for (numeric& coefficient : g) coefficient = -coefficient;
    return g;
}

// A power of two above all zeros: Cauchy's 1 + max |f_k / f_n|.
numeric bound_of_zeros(const RationalPolynomial& f) {
    numeric bound = 1, power = 2;
    for (const numeric& coefficient : f) bound = std::max(bound, 1 + abs(coefficient / f.back()));
    while (power <= bound) power *= 2;
    return power;
}

// Halves (low, high] until each half holds one zero.
void isolate(const SturmChain& chain, const numeric& low, const numeric& high, std::vector<RealRoot>& roots) {
    const int count = chain.zeros(low, high);
    if (count == 0) return;
    if (count == 1) {
        roots.push_back({chain.polynomials().front(), 1, low, high});
        return;
    }
    const numeric middle = (low + high) / 2;
    isolate(chain, low, middle, roots);
    isolate(chain, middle, high, roots);
}

// The irreducible factors of a polynomial that depend on z, with their multiplicities.
std::vector<std::pair<RationalPolynomial, int>> factors(const ex& polynomial, const GiNaC::symbol& z) {
    const ex product = GiNaC::factor(polynomial);
    std::vector<std::pair<RationalPolynomial, int>> result;
    const auto add = [&](const ex& factor) {
        const bool power = GiNaC::is_a<GiNaC::power>(factor);
        const ex base = power ? factor.op(0) : factor;
        if (base.has(z))
            result.emplace_back(primitive(rational_polynomial(base, z)),
                                power ? GiNaC::ex_to<numeric>(factor.op(1)).to_int() : 1);
    };
    if (GiNaC::is_a<GiNaC::mul>(product))
        for (std::size_t i = 0; i < product.nops(); ++i) add(product.op(i));
    else
        add(product);
    return result;
}

numeric ten_to_minus(int digits) {
    return numeric(10).power(-digits);
}

// The first `digits` significant digits of both ends, once they agree.
template <class Map>
std::string agreed_digits(RealRoot root, int digits, const Map& map) {
    for (int more = 4;; more += 8) {
        root.refine(root.high * ten_to_minus(digits + more));
        const std::string low = map(root.low, digits, digits + more + 10),
                          high = map(root.high, digits, digits + more + 10);
        // Two numbers on different sides of a half differ in the last digit, however near they are; a zero that is
        // irrational is on one side.
        if (low == high || root.low == root.high) return high;
    }
}

// sqrt(x) of a rational x > 0 as a sqrt(d), d an integer without square factors (but of very large primes).
ex square_root(const numeric& x) {
    numeric radicand = x.numer() * x.denom(), outside = 1 / x.denom();
    for (int factor = 2; factor < 10000 && numeric(factor) * factor <= radicand; ++factor)
        for (const numeric square = numeric(factor) * factor; mod(radicand, square).is_zero(); outside *= factor)
            radicand /= square;
    return outside * GiNaC::sqrt(ex(radicand));
}

cln::cl_R real_of(const numeric& x, int digits) {
    return cln::cl_float(cln::the<cln::cl_R>(x.to_cl_N()), cln::float_format(static_cast<unsigned>(digits)));
}

}  // namespace

RationalPolynomial rational_polynomial(const ex& polynomial, const GiNaC::symbol& z) {
    const ex expanded = polynomial.expand();
    if (!expanded.info(GiNaC::info_flags::rational_polynomial))
        throw std::invalid_argument("a polynomial over the rationals is needed");
    RationalPolynomial f;
    for (int k = 0; k <= expanded.degree(z); ++k) {
        const ex coefficient = expanded.coeff(z, k);
        if (!GiNaC::is_a<numeric>(coefficient)) throw std::invalid_argument("a polynomial in one variable is needed");
        f.push_back(GiNaC::ex_to<numeric>(coefficient));
    }
    drop_leading_zeros(f);
    return f;
}

numeric value(const RationalPolynomial& f, const numeric& x) {
    numeric sum = 0;
    for (std::size_t k = f.size(); k-- > 0;) sum = sum * x + f[k];
    return sum;
}

RationalPolynomial derivative(const RationalPolynomial& f) {
    RationalPolynomial slope;
    for (std::size_t k = 1; k < f.size(); ++k) slope.push_back(f[k] * static_cast<long>(k));
    return slope;
}

RationalPolynomial primitive(const RationalPolynomial& f) {
    if (f.empty()) return f;
    numeric denominators = 1, content = 0;
    for (const numeric& coefficient : f) denominators = lcm(denominators, coefficient.denom());
    for (const numeric& coefficient : f) content = gcd(content, coefficient * denominators);
    numeric scale = denominators / content;
    if (f.back().is_negative()) scale = -scale;
    RationalPolynomial result;
    for (const numeric& coefficient : f) result.push_back(coefficient * scale);
    return result;
}

std::string text_of(const RationalPolynomial& f, const std::string& variable) {
    std::string text;
    for (std::size_t k = 0; k < f.size(); ++k) {
        if (f[k].is_zero()) continue;
        const numeric size = abs(f[k]);
        const std::string power = k == 0 ? "" : k == 1 ? variable : variable + "^" + std::to_string(k);
        text += text.empty() ? (f[k].is_negative() ? "-" : "") : f[k].is_negative() ? " - " : " + ";
        if (k == 0 || !size.numer().is_equal(1)) text += canonical_text(size.numer()) + (k == 0 ? "" : "*");
        text += power;
        if (!size.is_integer()) text += "/" + canonical_text(size.denom());
    }
    return text.empty() ? "0" : text;
}

SturmChain::SturmChain(const RationalPolynomial& f) {
    chain_.push_back(shortened(f));
    for (RationalPolynomial next = derivative(f); !next.empty();) {
        chain_.push_back(shortened(next));
        next = remainder(chain_[chain_.size() - 2], chain_.back());
        for (numeric& coefficient : next) coefficient = -coefficient;
    }
}

std::vector<int> SturmChain::signs(const numeric& x) const {
    std::vector<int> result;
    for (const RationalPolynomial& f : chain_) result.push_back(sign(value(f, x)));
    return result;
}

std::vector<int> SturmChain::signs_at_infinity() const {
    std::vector<int> result;
    for (const RationalPolynomial& f : chain_) result.push_back(f.empty() ? 0 : sign(f.back()));
    return result;
}

int changes_of_sign(const std::vector<int>& signs) {
    int changes = 0, before = 0;
    for (const int now : signs) {
        if (now != 0 && before != 0 && now != before) ++changes;
        if (now != 0) before = now;
    }
    return changes;
}

int SturmChain::zeros(const numeric& low, const numeric& high) const {
    return changes_of_sign(signs(low)) - changes_of_sign(signs(high));
}

int SturmChain::zeros_beyond(const numeric& low) const {
    return changes_of_sign(signs(low)) - changes_of_sign(signs_at_infinity());
}

void RealRoot::refine(const numeric& width) {
    // The polynomial has one zero between the ends, a simple one, and none at the lower end but where both are equal.
    const int above = sign(value(polynomial, high));
    if (above == 0) low = high;
    while (high - low > width) {
        const numeric middle = (low + high) / 2;
        const int at_middle = sign(value(polynomial, middle));
        if (at_middle == 0)
            low = high = middle;
        else
            (at_middle == above ? high : low) = middle;
    }
}

numeric RealRoot::approximation(int digits) const {
    RealRoot finer = *this;
    finer.refine(finer.high * ten_to_minus(digits + 2) / 2);
    finer.refine(finer.low * ten_to_minus(digits + 2));
    return (finer.low + finer.high) / 2;
}

std::optional<ex> RealRoot::exact() const {
    if (low == high) return ex(low);
    if (polynomial.size() != 3) return std::nullopt;
    const numeric &c = polynomial[0], &b = polynomial[1], &a = polynomial[2];
    const ex root = square_root(b * b - 4 * a * c) / (2 * a);  // a > 0
    const numeric centre = -b / (2 * a);
    return high > centre && low >= centre ? centre + root : centre - root;
}

std::vector<RealRoot> positive_roots(const ex& polynomial, const GiNaC::symbol& z) {
    std::vector<RealRoot> roots;
    if (polynomial.expand().is_zero()) throw std::invalid_argument("zero vanishes everywhere");
    for (const auto& [factor, multiplicity] : factors(polynomial.expand(), z)) {
        const std::size_t before = roots.size();
        isolate(SturmChain(factor), 0, bound_of_zeros(factor), roots);
        for (std::size_t i = before; i < roots.size(); ++i) {
            RealRoot& root = roots[i];
            root.multiplicity = multiplicity;
            root.polynomial = factor;
            if (factor.size() == 2) root.low = root.high = -factor[0] / factor[1];
            // Away from zero, and to one side of the vertex of a parabola.
            while (root.low < root.high &&
                   (root.low.is_zero() || (factor.size() == 3 && root.low < -factor[1] / (2 * factor[2]) &&
                                           root.high > -factor[1] / (2 * factor[2]))))
                root.refine((root.high - root.low) / 2);
        }
    }
    // Zeros of different irreducible factors differ: their intervals part when they are narrow enough.
    for (bool apart = false; !apart;) {
        apart = true;
        std::sort(roots.begin(), roots.end(), [](const RealRoot& x, const RealRoot& y) { return x.low < y.low; });
        for (std::size_t i = 1; i < roots.size(); ++i) {
            RealRoot &x = roots[i - 1], &y = roots[i];
            if (x.high < y.low) continue;
            apart = false;
            for (RealRoot* root : {&x, &y}) root->refine((root->high - root->low) / 2);
        }
    }
    return roots;
}

std::string radicals_of(const RealRoot& root) {
    const auto exact = root.exact();
    if (!exact) return "";
    if (root.low == root.high || root.polynomial[1].is_zero()) return canonical_text(*exact);
    const numeric centre = -root.polynomial[1] / (2 * root.polynomial[2]);
    const bool above = root.low >= centre;
    return canonical_text(centre) + (above ? " + " : " - ") + canonical_text(above ? *exact - centre : centre - *exact);
}

std::string radicals_of_square_root(const RealRoot& root) {
    if (root.low == root.high) return canonical_text(GiNaC::sqrt(ex(root.low)));
    const std::string radicals = radicals_of(root);
    return radicals.empty() ? "" : "sqrt(" + radicals + ")";
}

std::string decimal_of(const RealRoot& root, int digits) {
    return agreed_digits(root, digits,
                         [](const numeric& x, int shown, int working) { return decimal(real_of(x, working), shown); });
}

std::string decimal_of_square_root(const RealRoot& root, int digits) {
    return agreed_digits(root, digits, [](const numeric& x, int shown, int working) {
        return decimal(cln::sqrt(real_of(x, working)), shown);
    });
}

}  // namespace lobatto
