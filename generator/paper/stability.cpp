// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's section 4, middle: truncation error, characteristic polynomial, interval of stability.
#include <fmt/format.h>

#include "generator/paper/oscillator.hpp"
#include "generator/paper/symbols.hpp"

namespace lobatto::paper {

using GiNaC::ex;
using GiNaC::exmap;
using GiNaC::numeric;
using GiNaC::pow;

namespace {

std::vector<ex> root_pair() {
    return {42 - 6 * GiNaC::sqrt(ex(29)), 42 + 6 * GiNaC::sqrt(ex(29))};
}

// r^2 + 1 and r of the characteristic polynomial: {coefficient of q_{j-1} and q_{j+1}, of q_j}, in the paper's
// normalisation.
std::pair<ex, ex> border_coefficients() {
    const ex scaled = (-oscillator().determinant / (300 * m() * h()) * oscillator().border).normal();
    return {scaled.diff(GiNaC::ex_to<GiNaC::symbol>(symbol("q_jm"))).normal(),
            scaled.diff(GiNaC::ex_to<GiNaC::symbol>(symbol("q_j"))).normal()};
}

// Residual of the exact solution cos(omega t): T_h(q_j)/q_j as a series in h up to h^6; {lower orders, coefficient of
// h^6}.
std::pair<ex, ex> truncation() {
    const auto [outer, centre] = border_coefficients();
    const GiNaC::symbol step = GiNaC::ex_to<GiNaC::symbol>(symbol("h"));
    const ex product = (pow(h(), 2) * (2 * outer * GiNaC::cos(omega() * h()) + centre)).expand();
    const ex polynomial = GiNaC::series_to_poly(product.series(step == 0, 9)).expand();
    ex lower = 0;
    for (int k = polynomial.ldegree(step); k < 8; ++k) lower += polynomial.coeff(step, k) * pow(h(), k);
    return {lower, polynomial.coeff(step, 8)};
}

std::string truncation_numbers() {
    const auto [outer, centre] = border_coefficients();
    std::string text = "T_h(q_j)/(ω⁸h⁶q_j) of the exact solution cos(ωt), ω = 1:";
    for (int divisor : {5, 10, 20}) {
        const exmap values{{h(), numeric(1, divisor)}, {omega(), 1}, {m(), 1}};
        const ex residual = (2 * outer * GiNaC::cos(omega() * h()) + centre) / pow(h(), 6);
        text += fmt::format(" {} (h = {});", decimal(at(residual, values), 6), decimal(numeric(1, divisor)));
    }
    return text + fmt::format(
                      " 1/302400 = {}, printed −1/21600 = {}. The printed number is what remains when q_{{j±1}} is "
                      "expanded to h⁶ only: the term "
                      "h⁸q⁽⁸⁾/40320 divided by h² contributes at the same order. The order, six, is right",
                      decimal(numeric(1, 302400), 6), decimal(numeric(-1, 21600), 6));
}

}  // namespace

bool keeps_sign(const ex& polynomial, const ex& leading, const std::vector<ex>& roots, const ex& begin, const ex& end,
                int sign) {
    const ex y = symbol("r");
    ex product = leading;
    for (const ex& root : roots) {
        product *= y - root;
        if (at(root - begin, {}) > 0 && at(end - root, {}) > 0) return false;
    }
    const numeric middle = at(polynomial.subs(y == (begin + end) / 2), {});
    return (polynomial - product).expand().is_zero() && (sign > 0 ? middle > 0 : middle < 0);
}

namespace {

void truncation_error(std::vector<Statement>& list) {
    const ex s = h();
    ex forward = symbol("q_j"), backward = symbol("q_j");
    for (int k = 1; k <= 6; ++k) {
        const ex term = pow(s, k) / GiNaC::factorial(ex(k)) * symbol("q" + std::to_string(k));
        forward += term;
        backward += k % 2 == 0 ? term : -term;
    }
    list.push_back(
        {.label = "after eq:discreteCenterEL: Taylor",
         .section = "4",
         .what = "the expansions of q_{j±1}, up to O(h⁷)",
         .parts = {{.text = "q_jp = q_j + h*q1 + h^2/2*q2 + h^3/6*q3 + h^4/24*q4 + h^5/120*q5 + h^6/720*q6",
                    .derived = forward},
                   {.text = "q_jm = q_j - h*q1 + h^2/2*q2 - h^3/6*q3 + h^4/24*q4 - h^5/120*q5 + h^6/720*q6",
                    .derived = backward}},
         .route = "Taylor's formula; right as they stand, but the truncation error needs the terms up to h⁸"});
    const auto [lower, coefficient] = truncation();
    list.push_back({.label = "after eq:discreteCenterEL: T_h",
                    .section = "4",
                    .what = "the truncation error",
                    .parts = {{.text = "T_h = -1/21600*omega^8*h^6*q_j",
                               .derived = coefficient * pow(h(), 6) * symbol("q_j"),
                               .corrected = "T_h = 1/302400*omega^8*h^6*q_j"}},
                    .route = "",
                    .demonstration = truncation_numbers,
                    .sentence = "up to O(h⁸):"});
    list.push_back(
        {.label = "after eq:discreteCenterEL: order",
         .section = "4",
         .what = "sixth order",
         .parts = {},
         .route =
             "T_h of the exact solution, expanded: every term below h⁶ cancels, the coefficient of h⁶ does not vanish",
         .sentence = "sixth-order accurate on truncation error",
         .holds = [] {
             const auto [below, leading] = truncation();
             return below.expand().is_zero() && !leading.is_zero();
         }});
}

void characteristic_polynomial(std::vector<Statement>& list) {
    const auto [outer, centre] = border_coefficients();
    const ex r = symbol("r");
    list.push_back(
        {.label = "after eq:discreteCenterEL: characteristic polynomial",
         .section = "4",
         .what = "the equation of the multiplier r",
         .parts = {{.text = "1/h^2*(1-2*r+r^2) + omega^2/30*(1+28*r+r^2) + omega^4*h^2/1800*(1-92*r+r^2) + "
                            "omega^6*h^4/1800*r = 0",
                    .derived = outer * (1 + r * r) + centre * r,
                    .kind = Kind::equation}},
         .route = "q_{j−1}, q_j, q_{j+1} = 1, r, r² in the derived equation, normalised as eq:discreteCenterEL"});
    list.push_back(
        {.label = "after eq:discreteCenterEL: discriminant",
         .section = "4",
         .what = "its discriminant",
         .parts =
             {{.text =
                   "Delta = "
                   "omega^2/h^2*(h^2*omega^2-10)*(h^2*omega^2-30)*(h^2*omega^2-60)*(h^4*omega^4-84*h^2*omega^2+720)",
               .derived = pow(centre, 2) - 4 * pow(outer, 2),
               .factor = "3240000"}},
         .route =
             "B² − 4A² of A(1 + r²) + Br; the paper's is that of 1800 times the polynomial; only the sign matters"});
}

void stability_interval(std::vector<Statement>& list) {
    list.push_back({.label = "before eq:stabilityCondition2: roots",
                    .section = "4",
                    .what = "two real roots in h²ω²",
                    .parts = {},
                    .route = "h²ω² = 42 ± 6√29 annul it exactly",
                    .sentence = "h⁴ω⁴ − 84h²ω² + 720 has two real roots in h²ω²",
                    .holds = [] {
                        for (const ex& root : root_pair())
                            if (!(pow(root, 2) - 84 * root + 720).expand().is_zero()) return false;
                        return true;
                    }});
    list.push_back({.label = "eq:stabilityCondition2",
                    .section = "4",
                    .what = "the interval of stability",
                    .parts = {},
                    .route = "factors without a root inside, sign at the middle. (Δ < 0 again for √10 < hω < √30; "
                             "between the two the scheme is unstable)",
                    .sentence = "Δ < 0 when 0 < hω < √(42 − 6√29)",
                    .holds = [] {
                        const ex y = symbol("r");
                        const ex polynomial = (y * (y - 10) * (y - 30) * (y - 60) * (y * y - 84 * y + 720)).expand();
                        std::vector<ex> roots{0, 10, 30, 60};
                        for (const ex& root : root_pair()) roots.push_back(root);
                        return keeps_sign(polynomial, 1, roots, 0, root_pair()[0], -1) &&
                               keeps_sign(polynomial, 1, roots, root_pair()[0], 10, 1) &&
                               keeps_sign(polynomial, 1, roots, 10, 30, -1);
                    }});
    list.push_back({.label = "after eq:stabilityCondition2: supersedes",
                    .section = "4",
                    .what = "the second condition implies the first",
                    .parts = {},
                    .route = "42 − 6√29 = 9.689… < 10",
                    .sentence = "This restriction supersedes the previous stability condition",
                    .holds = [] { return at(10 - root_pair()[0], {}) > 0; }});
    list.push_back({.label = "after eq:stabilityCondition2: roots r",
                    .section = "4",
                    .what = "complex conjugate roots of modulus one",
                    .parts = {},
                    .route = "Δ < 0 with real coefficients; leading and constant coefficients are equal, so |r|² = 1",
                    .sentence = "two complex conjugate roots of unit module",
                    .holds = [] {
                        const ex border = oscillator().border;
                        return equal(border.diff(GiNaC::ex_to<GiNaC::symbol>(symbol("q_jm"))),
                                     border.diff(GiNaC::ex_to<GiNaC::symbol>(symbol("q_jp"))));
                    }});
    const double bound = at(GiNaC::sqrt(root_pair()[0]), {}).to_double();
    list.push_back(
        {.label = "after eq:stabilityCondition2: ≈ π",
         .section = "4",
         .what = "about π: h < T/2, a little more than two points a period",
         .parts = {},
         .route = fmt::format(
             "√(42 − 6√29) = {:.7f}, {:.2f} % below π; h < {:.4f} T, that is more than {:.4f} points a period", bound,
             100 * (1 - bound / 3.14159265358979), bound / 6.28318530717959, 6.28318530717959 / bound),
         .sentence = "√(42 − 6√29) ≈ π. As such, h < T/2 when ω = 2π/T … a little more than two points per period",
         .holds = [] {
             const ex gap = 1 - GiNaC::sqrt(root_pair()[0]) / GiNaC::Pi;
             return at(gap, {}) > 0 && at(gap - ex(1) / 100, {}) < 0;
         }});
}

}  // namespace

void truncation_and_stability(std::vector<Statement>& list) {
    truncation_error(list);
    characteristic_polynomial(list);
    stability_interval(list);
}

}  // namespace lobatto::paper
