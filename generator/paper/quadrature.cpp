// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's sections 1 to 3: the quadrature from its moment conditions, the basis from its interpolation conditions.
#include <fmt/format.h>

#include "generator/paper/symbols.hpp"

namespace lobatto::paper {

using GiNaC::ex;
using GiNaC::pow;

namespace {

// Quadrature of t^k minus its integral: alpha (0^k + 1) + beta (xi^k + (1 - xi)^k) - 1/(k + 1).
ex moment(int k) {
    const ex xi = symbol("xi"), ends = k == 0 ? ex(2) : ex(1);
    return symbol("alpha") * ends + symbol("beta") * (pow(xi, k) + pow(1 - xi, k)) - ex(1) / (k + 1);
}

// The quadrature with the derived nodes and weights, of t^k.
ex defect(int k) {
    ex sum = -ex(1) / (k + 1);
    for (int i = 0; i < 4; ++i) sum += weights()[i] * (k == 0 ? ex(1) : pow(nodes()[i], k));
    return sum.expand();
}

// The cubic through (c_i, q_i), by Neville's scheme, with divisions by c_i - c_j made exact.
ex neville(std::vector<ex> column) {
    const std::vector<ex> c = nodes();
    const ex theta = symbol("theta"), root = GiNaC::sqrt(ex(5));
    for (size_t width = 1; width < c.size(); ++width)
        for (size_t i = 0; i + width < c.size(); ++i) {
            const ex gap = (c[i + width] - c[i]).expand(), conjugate = gap.subs(root == -root);
            const ex inverse = conjugate / (gap * conjugate).expand();
            column[i] = (((theta - c[i]) * column[i + 1] - (theta - c[i + width]) * column[i]) * inverse).expand();
        }
    return column[0];
}

// Newmark's average acceleration and the implicit midpoint rule for q'' = -omega^2 q: the same step (q, v) -> (q1, v1)?
bool midpoint_is_newmark() {
    const ex h = symbol("h"), w = pow(symbol("omega"), 2), q0 = symbol("q_l"), v0 = symbol("p_j"), q1 = symbol("q_r"),
             v1 = symbol("p_jp");
    const GiNaC::lst unknowns{q1, v1};
    const ex newmark = GiNaC::lsolve(
        GiNaC::lst{q1 == q0 + h * v0 - pow(h, 2) / 4 * w * (q0 + q1), v1 == v0 - h / 2 * w * (q0 + q1)}, unknowns);
    const ex midpoint =
        GiNaC::lsolve(GiNaC::lst{q1 == q0 + h * (v0 + v1) / 2, v1 == v0 - h * w * (q0 + q1) / 2}, unknowns);
    return equal(q1.subs(newmark), q1.subs(midpoint)) && equal(v1.subs(newmark), v1.subs(midpoint));
}

void form_of_quadrature(std::vector<Statement>& list) {
    const ex alpha = symbol("alpha"), beta = symbol("beta"), xi = symbol("xi"), half = ex(1) / 2;
    list.push_back({.label = "in the text: midpoint and Newmark",
                    .section = "1",
                    .what = "the implicit midpoint rule is Newmark's average acceleration on linear systems",
                    .parts = {},
                    .route = "both steps solved for the new state and compared",
                    .sentence = "implicit midpoint scheme that coincides with the average constant acceleration "
                                "Newmark variant for linear systems",
                    .holds = midpoint_is_newmark});
    list.push_back({.label = "eq:lobattoQuad4points",
                    .section = "2",
                    .what = "the form of the quadrature",
                    .parts = {},
                    .route = "symmetric form with four nodes; determines α, β, ξ through the moment conditions below",
                    .sentence = "∫₀¹ f(t) dt ≈ α·(f(0)+f(1)) + β·(f(ξ)+f(1−ξ))",
                    .introduces = true});
    list.push_back({.label = "after eq:lobattoQuad4points: Simpson",
                    .section = "2",
                    .what = "ξ = 1/2 gives Simpson's quadrature",
                    .parts = {},
                    .route = "moments 0 and 2 solved at ξ = 1/2: weights 1/6, 4/6, 1/6",
                    .sentence = "If ξ = 1/2, Simpson's quadrature is found",
                    .holds = [=] {
                        const GiNaC::lst conditions{moment(0).subs(xi == half) == 0, moment(2).subs(xi == half) == 0};
                        const ex solved = GiNaC::lsolve(conditions, GiNaC::lst{alpha, beta});
                        return equal(alpha.subs(solved), ex(1) / 6) && equal(2 * beta.subs(solved), ex(4) / 6);
                    }});
}

void moment_conditions(std::vector<Statement>& list) {
    const ex alpha = symbol("alpha"), beta = symbol("beta"), xi = symbol("xi"), half = ex(1) / 2;
    const ex without_alpha_2 = moment(2).subs(alpha == half - beta),
             without_alpha_4 = moment(4).subs(alpha == half - beta);
    list.push_back({.label = "after eq:lobattoQuad4points: f = 1 and f = t",
                    .section = "2",
                    .what = "the condition of degrees 0 and 1",
                    .parts = {{.text = "alpha + beta = 1/2", .derived = moment(0) / 2, .kind = Kind::equation},
                              {.text = "alpha + beta = 1/2", .derived = moment(1), .kind = Kind::equation}},
                    .route = "moments 0 (halved) and 1"});
    list.push_back(
        {.label = "after eq:lobattoQuad4points: f = t²",
         .section = "2",
         .what = "the condition of degree 2",
         .parts = {{.text = "alpha + beta*(1-2*xi+2*xi^2) = 1/3", .derived = moment(2), .kind = Kind::equation}},
         .route = "moment 2"});
    list.push_back(
        {.label = "after eq:lobattoQuad4points: f = t², so",
         .section = "2",
         .what = "the condition of degree 2 without α",
         .parts = {{.text = "beta*xi*(1-xi) = 1/12", .derived = -without_alpha_2 / 2, .kind = Kind::equation}},
         .route = "moment 2 with α = 1/2 − β"});
    list.push_back({.label = "after eq:lobattoQuad4points: f = t⁴",
                    .section = "2",
                    .what = "the condition of degree 4",
                    .parts = {{.text = "beta*xi*(1-xi)*(xi^2-xi+2) = 3/10",
                               .derived = -without_alpha_4 / 2,
                               .kind = Kind::equation,
                               .corrected = "beta*xi*(1-xi)*(xi^2-xi+2) = 3/20"}},
                    .route = "moment 4 with α = 1/2 − β",
                    .demonstration = [] {
                        const GiNaC::exmap values{{symbol("xi"), node()}, {symbol("beta"), weights()[1]}};
                        const std::string left = decimal(at(read("beta*xi*(1-xi)*(xi^2-xi+2)"), values));
                        const std::string product = decimal(at(2 - 12 * read("3/10"), {}));
                        return fmt::format(
                            "with the paper's own ξ and β the left side is {} = 3/20; with 3/10 one would get ξ(1−ξ) = "
                            "{}, no node in (0, 1/2). "
                            "The paper goes on with the right value, ξ(1−ξ) = 1/5",
                            left, product);
                    }});
    list.push_back({.label = "after eq:lobattoQuad4points: ξ(1−ξ)",
                    .section = "2",
                    .what = "the equation of the inner node",
                    .parts = {{.text = "xi*(1-xi) = 1/5",
                               .derived = 6 * without_alpha_4.subs(beta == 1 / (12 * xi * (1 - xi))),
                               .kind = Kind::equation}},
                    .route = "moment 4 with α and β eliminated through moments 0 and 2"});
}

void nodes_and_weights(std::vector<Statement>& list) {
    list.push_back(
        {.label = "after eq:lobattoQuad4points: ξ, α, β",
         .section = "2",
         .what = "node and weights",
         .parts = {{.text = "xi = 1/2 - sqrt(5)/10", .derived = (1 - GiNaC::sqrt(1 - 4 * ex(1) / 5)) / 2},
                   {.text = "alpha = 1/12", .derived = weights()[0]},
                   {.text = "beta = 5/12", .derived = weights()[1]}},
         .route = "ξ as the smaller root of ξ(1−ξ) = 1/5; α, β as the integrals of the Lagrange polynomials"});
    ex sum = 0;
    for (int i = 0; i < 4; ++i) sum += weights()[i] * symbol("a" + std::to_string(i));
    list.push_back({.label = "eq:lobattoQuad",
                    .section = "2",
                    .what = "Lobatto's quadrature with four nodes",
                    .parts = {{.text = "integral = 1/12*(a0+a3) + 5/12*(a1+a2)", .derived = sum},
                              {.text = "xi = 1/2 - sqrt(5)/10", .derived = node()}},
                    .route = "Σ f(c_i) ∫ φ_i; f_i = f(c_i)"});
    list.push_back({.label = "after eq:lobattoQuad: degree",
                    .section = "2",
                    .what = "exact up to degree 2n − 3 = 5",
                    .parts = {},
                    .route = "moments 0 to 5 vanish, moment 6 is 1/2100",
                    .sentence = "accurate for polynomials up to degree 2n − 3 … exact for the integration of "
                                "polynomials up to degree five",
                    .holds = [] {
                        for (int k = 0; k <= 5; ++k)
                            if (!equal(defect(k), 0)) return false;
                        return equal(defect(6), ex(1) / 2100);
                    }});
}

void section_2(std::vector<Statement>& list) {
    form_of_quadrature(list);
    moment_conditions(list);
    nodes_and_weights(list);
}

void section_3(std::vector<Statement>& list) {
    const GiNaC::exmap inner{{symbol("xi"), node()}};
    const std::vector<ex> basis = lagrange_basis();
    const std::vector<std::string> printed{"5*(theta-xi)*(theta-(1-xi))*(1-theta)",
                                           "-5*sqrt(5)*theta*(1-theta)*(theta-(1-xi))",
                                           "5*sqrt(5)*theta*(1-theta)*(theta-xi)", "5*theta*(theta-xi)*(theta-(1-xi))"};
    const std::vector<std::string> index{"0", "xi", "1xi", "1"}, value{"q_l", "q_xi", "q_1xi", "q_r"};

    Statement functions{.label = "eq:basisFunctions",
                        .section = "3",
                        .what = "the four cubic basis functions",
                        .parts = {},
                        .route = "Lagrange's product formula at 0, ξ, 1−ξ, 1"};
    GiNaC::exmap polynomials;
    std::vector<ex> values;
    ex derivative = 0;
    for (int j = 0; j < 4; ++j) {
        functions.parts.push_back(
            {.text = "phi_" + index[j] + " = " + printed[j], .derived = basis[j], .values = inner});
        polynomials[symbol("phi_" + index[j])] = basis[j];
        values.push_back(symbol(value[j]));
        derivative += symbol(value[j]) * symbol("dphi_" + index[j]) / symbol("h");
    }
    list.push_back(functions);
    list.push_back(
        {.label = "after eq:basisFunctions: values",
         .section = "3",
         .what = "each function is 1 at its own node, 0 at the others",
         .parts = {},
         .route = "the printed functions evaluated at the four nodes",
         .sentence =
             "evaluate to 1 when the control point is the same as the index and 0 at the other integration points",
         .holds = [=] {
             for (int j = 0; j < 4; ++j)
                 for (int i = 0; i < 4; ++i)
                     if (!equal(read(printed[j]).subs(inner).subs(symbol("theta") == nodes()[i]), i == j ? 1 : 0))
                         return false;
             return true;
         }});
    list.push_back({.label = "after eq:basisFunctions: q(t)",
                    .section = "3",
                    .what = "the interpolant on one step",
                    .parts = {{.text = "q = q_l*phi_0 + q_xi*phi_xi + q_1xi*phi_1xi + q_r*phi_1",
                               .derived = neville(values),
                               .values = polynomials}},
                    .route = "the cubic through the four values, by Neville's scheme"});
    list.push_back({.label = "after eq:basisFunctions: inner times",
                    .section = "3",
                    .what = "the instants of q_ξ and q_{1−ξ}",
                    .parts = {{.text = "t = h/2 - sqrt(5)*h/10", .derived = symbol("h") * nodes()[1]},
                              {.text = "t = h/2 + sqrt(5)*h/10", .derived = symbol("h") * nodes()[2]}},
                    .route = "h c_i"});
    list.push_back(
        {.label = "after eq:basisFunctions: dq/dt",
         .section = "3",
         .what = "the velocity on one step",
         .parts = {{.text = "dq = (q_l*dphi_0 + q_xi*dphi_xi + q_1xi*dphi_1xi + q_r*dphi_r)/h",
                    .derived = derivative,
                    .corrected = "dq = (q_l*dphi_0 + q_xi*dphi_xi + q_1xi*dphi_1xi + q_r*dphi_1)/h"}},
         .route = "the interpolant differentiated, dθ/dt = 1/h",
         .demonstration = [] {
             return "an index only: the last basis function is called φ_1 in eq:basisFunctions, and no φ_r is defined";
         }});
}

}  // namespace

void sections_2_and_3(std::vector<Statement>& list) {
    section_2(list);
    section_3(list);
}

}  // namespace lobatto::paper
