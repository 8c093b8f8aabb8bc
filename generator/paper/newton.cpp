// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's sections 5 and 6: the Jacobian of the four equations, Newton's iteration with it, the claims about the
// experiments.
#include <fmt/format.h>

#include "generator/paper/pendulum.hpp"
#include "generator/paper/symbols.hpp"

namespace lobatto::paper {

using GiNaC::ex;
using GiNaC::exmap;
using GiNaC::numeric;
using GiNaC::pow;

namespace {

const char* const printed_jacobian =
    "dF_L = {{1-h^2/(15*m)*ddV_xi, -h^2/(30*m)*ddV_1xi, 0, (-5+sqrt(5))/10}, {-h^2/(30*m)*ddV_1xi, "
    "1-h^2/(15*m)*ddV_1xi, 0, -(5+sqrt(5))/10}, "
    "{5*h/12*ddV_xi, 5*h/12*ddV_1xi, 1, h/12*ddV}, {sqrt(5)*h^2/(24*m)*ddV_xi, -sqrt(5)*h^2/(24*m)*ddV_1xi, -h/(2*m), "
    "1-h^2/(24*m)*ddV}}";
const char* const corrected_jacobian =
    "dF_L = {{1-h^2/(15*m)*ddV_xi, -h^2/(30*m)*ddV_1xi, 0, (-5+sqrt(5))/10}, {-h^2/(30*m)*ddV_xi, "
    "1-h^2/(15*m)*ddV_1xi, 0, -(5+sqrt(5))/10}, "
    "{5*h/12*ddV_xi, 5*h/12*ddV_1xi, 1, h/12*ddV}, {sqrt(5)*h^2/(24*m)*ddV_xi, -sqrt(5)*h^2/(24*m)*ddV_1xi, -h/(2*m), "
    "1-h^2/(24*m)*ddV}}";

// Newton on the paper's four unknowns with a given Jacobian: pendulum, m = 1, omega = 2 pi, from p_j = 1 and q_j =
// pi/2, all states starting at q_j; 40 digits. The largest residual after each iteration.
std::vector<double> newton_residuals(const std::vector<ex>& jacobian, const numeric& step, int iterations) {
    const std::vector<ex> unknowns{symbol("q_xi"), symbol("q_1xi"), symbol("p_jp"), symbol("q_r")};
    const ex stiffness = 4 * pow(GiNaC::Pi, 2);
    const numeric start = at(GiNaC::Pi / 2, {}, 40);
    std::vector<ex> value{start, start, 1, start};
    std::vector<double> residuals;
    for (int k = 0; k <= iterations; ++k) {
        exmap point{{symbol("h"), step},
                    {symbol("m"), 1},
                    {symbol("q_l"), start},
                    {symbol("p_j"), 1},
                    {symbol("dV_l"), stiffness * GiNaC::sin(start)}};
        for (int i = 0; i < 4; ++i) {
            point[unknowns[i]] = value[i];
            if (i == 2) continue;
            const std::string x = i == 3 ? "r" : i == 0 ? "xi" : "1xi";
            point[symbol("dV_" + x)] = stiffness * GiNaC::sin(value[i]);
            point[symbol(i == 3 ? std::string("ddV") : "ddV_" + x)] = stiffness * GiNaC::cos(value[i]);
        }
        GiNaC::matrix J(4, 4), F(4, 1);
        double largest = 0;
        for (int i = 0; i < 4; ++i) {
            F(i, 0) = at(integrator().full[i], point, 40);
            largest = std::max(largest, std::abs(GiNaC::ex_to<numeric>(F(i, 0)).to_double()));
            for (int j = 0; j < 4; ++j) J(i, j) = at(jacobian[4 * i + j], point, 40);
        }
        if (k > 0) residuals.push_back(largest);
        const GiNaC::matrix change = J.inverse().mul(F);
        for (int i = 0; i < 4; ++i) value[i] = at(value[i] - change(i, 0), {}, 40);
    }
    return residuals;
}

std::string sequence(const std::vector<double>& values) {
    std::string text;
    for (double value : values)
        text += (text.empty() ? "" : ", ") + (value < 1e-35 ? std::string("< 1e-35") : fmt::format("{:.1e}", value));
    return text;
}

std::string jacobian_numbers() {
    const std::string formula = std::string(printed_jacobian).substr(7);
    const numeric step(1, 10);
    return fmt::format(
        "Newton's largest residual after each iteration (pendulum, h = 0.1, 40 digits), printed "
        "matrix: {}; corrected: {}. The printed "
        "matrix still converges, but only linearly",
        sequence(newton_residuals(elements(read(formula)), step, 6)),
        sequence(newton_residuals(elements(GiNaC::ex(integrator().jacobian)), step, 6)));
}

std::string determinant_numbers() {
    const ex derived = integrator().jacobian.determinant().expand();
    const ex printed = read("1 + h^2/(60*m)*(ddV_xi+ddV_1xi) + h^4/(1800*m)*ddV_xi*ddV_1xi");
    const exmap values{{symbol("m"), 2}, {symbol("h"), 1}, {symbol("ddV_xi"), 30}, {symbol("ddV_1xi"), 60}};
    return fmt::format(
        "m = 2, h = 1, V″_ξ = 30, V″_{{1−ξ}} = 60: determinant of the matrix {}, printed formula {} (for m = 1 they "
        "agree). In units, h⁴V″V″/m² is a "
        "pure number, h⁴V″V″/m is not",
        decimal(at(derived, values)), decimal(at(printed, values)));
}

}  // namespace

void newton(std::vector<Statement>& list) {
    const Integrator& scheme = integrator();
    list.push_back({.label = "after eq:discreteDynamics: dF_L",
                    .section = "5",
                    .what = "the Jacobian of the four equations",
                    .parts = {{.text = printed_jacobian, .derived = scheme.jacobian, .corrected = corrected_jacobian}},
                    .route = "",
                    .demonstration = jacobian_numbers});
    list.push_back({.label = "after eq:discreteDynamics: det dF_L",
                    .section = "5",
                    .what = "its determinant",
                    .parts = {{.text = "det = 1 + h^2/(60*m)*(ddV_xi+ddV_1xi) + h^4/(1800*m)*ddV_xi*ddV_1xi",
                               .derived = scheme.jacobian.determinant().expand(),
                               .corrected = "det = 1 + h^2/(60*m)*(ddV_xi+ddV_1xi) + h^4/(1800*m^2)*ddV_xi*ddV_1xi"}},
                    .route = "",
                    .demonstration = determinant_numbers});
    list.push_back(
        {.label = "after eq:discreteDynamics: limit",
         .section = "5",
         .what = "det dF_L → 1 as h → 0",
         .parts = {},
         .route = "the derived determinant at h = 0",
         .sentence = "tends to 1 as h diminishes",
         .holds = [] { return equal(integrator().jacobian.determinant().expand().subs(symbol("h") == 0), 1); }});
    list.push_back({.label = "after eq:discreteDynamics: F_L = 0",
                    .section = "5",
                    .what = "the four-equation system",
                    .parts = {},
                    .route = "definition: eq:internesNL and eq:discreteDynamics as residuals",
                    .sentence = "F_L(q_{j+ξ}, q_{j+1−ξ}, p_{j+1}, q_{j+1}) = 0",
                    .introduces = true});
    const std::vector<double> residuals = newton_residuals(elements(GiNaC::ex(scheme.jacobian)), numeric(1, 10), 5);
    list.push_back({.label = "after eq:discreteDynamics: Newton",
                    .section = "5",
                    .what = "machine precision by the fifth iteration",
                    .parts = {},
                    .route = "largest residual after each iteration with the derived matrix (pendulum, h = 0.1, all "
                             "states started at q_j): " +
                             sequence(residuals),
                    .sentence = "machine precision convergence at the fifth iteration",
                    .holds = [=] { return residuals.back() < 2.2e-16; }});
}

void section_6(std::vector<Statement>& list) {
    const GiNaC::symbol t("t");
    const ex m = symbol("m"), omega = symbol("omega");
    const ex q = GiNaC::Pi / 2 * GiNaC::cos(omega * t), p = -GiNaC::Pi / 2 * m * omega * GiNaC::sin(omega * t);
    list.push_back({.label = "before fig:simulations: exact solution",
                    .section = "6",
                    .what = "the oscillator's exact solution",
                    .parts = {},
                    .route = "q′ = p/m and p′ = −mω²q; its period is T = 1 for ω = 2π",
                    .sentence = "q(t) = (π/2) cos(ωt), p(t) = −(π/2) mω sin(ωt)",
                    .holds = [=] {
                        return (q.diff(t) - p / m).expand().is_zero() &&
                               (p.diff(t) + m * omega * omega * q).expand().is_zero();
                    }});
    list.push_back({.label = "fig:errorEvolution",
                    .section = "6",
                    .what = "growth of the oscillator's energy error over 1e5 periods",
                    .parts = {},
                    .route = "the rate is the least-squares slope, per period, of the running maximum of |H − H(0)|; "
                             "the arithmetic is not said",
                    .sentence = "growth rate 2.50e−11 when h = 0.1, 5.45e−14 when h = 0.05, 1.35e−13 when h = 0.025",
                    .instead = "2.50e−11 is reproduced for h = 0.1; the other two rates are rounding, see figure 2",
                    .contradicts = true});
    list.push_back({.label = "fig:errorEvolutionNL: periods",
                    .section = "6",
                    .what = "how long the pendulum ran",
                    .parts = {},
                    .route = "the text and the caption of the same figure",
                    .sentence = "the text says 1e5 periods, the caption 5e3",
                    .instead = "5e3 periods are shown in figure 4 here",
                    .contradicts = true});
    list.push_back({.label = "fig:errorEvolutionNL",
                    .section = "6",
                    .what = "growth of the pendulum's energy error over 5e3 periods",
                    .parts = {},
                    .route = "not monotone in h: the rate printed for h = 0.05 is above that for h = 0.1",
                    .sentence = "growth rate 7.99e−13 when h = 0.1, 5.39e−11 when h = 0.05, 5.33e−15 when h = 0.025",
                    .instead = "not reproduced, see figure 4; with the first two exchanged the rates would fall with h",
                    .contradicts = true});
    list.push_back({.label = "heading of the conclusions",
                    .section = "7",
                    .what = "the number of the last section",
                    .parts = {},
                    .route = "section 5 is the pendulum, section 6 the experiments",
                    .sentence = "5) Conclusions",
                    .instead = "7) Conclusions",
                    .contradicts = true});
}

}  // namespace lobatto::paper
