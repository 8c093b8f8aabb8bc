// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's sections 5 and 6: the integrator for any potential V(q), its Jacobian and symplectic structure; claims
// about the experiments.
#include <fmt/format.h>

#include <stdexcept>

#include "generator/paper_symbols.hpp"

namespace lobatto::paper {

using GiNaC::ex;
using GiNaC::exmap;
using GiNaC::numeric;
using GiNaC::pow;

namespace {

const std::vector<std::string> node_name{"l", "xi", "1xi", "r"};

// d/dq at one node of an expression in q_x, V_x = V(q_x), V'_x, V''_x.
ex along(const ex& expression, const std::string& x) {
    const auto by = [&](const std::string& name) { return expression.diff(GiNaC::ex_to<GiNaC::symbol>(symbol(name))); };
    ex total = by("q_" + x) + by("V_" + x) * symbol("dV_" + x);
    if (x == "r")
        total += by("dV_r") * symbol("ddV");
    else if (x != "l")
        total += by("dV_" + x) * symbol("ddV_" + x);
    else
        total += by("dV_l") * symbol("ddV_j");
    return total.expand();
}

struct Integrator {
    ex discrete;            // L_d
    std::vector<ex> inner;  // 2 dL_d/dq_xi + dL_d/dq_1xi and its mirror image
    GiNaC::lst solved;  // q_xi, q_1xi == linear part + (h^2/30m)(V' terms): the inner equations, used as substitutions
    ex left, right;     // dL_d/dq_l, dL_d/dq_r with `solved` injected
    std::vector<ex> full;          // F_L, four residuals in (q_xi, q_1xi, p_jp, q_r)
    GiNaC::matrix jacobian{4, 4};  // dF_L
};

Integrator derive() {
    Integrator result;
    const ex h = symbol("h"), m = symbol("m");
    ex position = 0, potential = 0;
    for (int i = 0; i < 4; ++i) {
        position += lagrange_basis()[i] * symbol("q_" + node_name[i]);
        potential += weights()[i] * symbol("V_" + node_name[i]);
    }
    const ex slope = position.diff(GiNaC::ex_to<GiNaC::symbol>(symbol("theta")));
    result.discrete = (m / (2 * h) * integrate_polynomial(pow(slope, 2)) - h * potential).expand();

    const ex first = along(result.discrete, "xi"), second = along(result.discrete, "1xi");
    result.inner = {(2 * first + second).expand(), (first + 2 * second).expand()};
    for (int i = 0; i < 2; ++i) {
        const ex q = symbol(i == 0 ? "q_xi" : "q_1xi");
        const ex coefficient = result.inner[i].coeff(q, 1);
        result.solved.append(q == (q - result.inner[i] / coefficient).expand());
    }
    result.left = along(result.discrete, "l").subs(result.solved).expand();
    result.right = along(result.discrete, "r").subs(result.solved).expand();

    const ex before = symbol("p_j"), after = symbol("p_jp");
    for (int i = 0; i < 2; ++i) result.full.push_back((result.solved.op(i).lhs() - result.solved.op(i).rhs()).expand());
    result.full.push_back((after - before - result.right - result.left).expand());
    result.full.push_back((h / (2 * m) * (result.right - result.left - after - before)).expand());
    for (int i = 0; i < 4; ++i) {
        result.jacobian(i, 0) = along(result.full[i], "xi");
        result.jacobian(i, 1) = along(result.full[i], "1xi");
        result.jacobian(i, 2) = result.full[i].diff(GiNaC::ex_to<GiNaC::symbol>(after));
        result.jacobian(i, 3) = along(result.full[i], "r");
    }
    return result;
}

const Integrator& integrator() {
    static const Integrator result = derive();
    return result;
}

// From q_l, q_xi, q_1xi, q_r to q_j, q_{j+xi}, q_{j+1-xi}, q_{j+1}, and V' and V'' with them.
exmap forward_step() {
    exmap names;
    const std::vector<std::string> later{"j", "jxi", "j1xi", "jp"};
    for (int i = 0; i < 4; ++i) {
        names[symbol("q_" + node_name[i])] = symbol("q_" + later[i]);
        names[symbol("dV_" + node_name[i])] = symbol("dV_" + later[i]);
    }
    names[symbol("ddV_xi")] = symbol("ddV_jxi");
    names[symbol("ddV_1xi")] = symbol("ddV_j1xi");
    names[symbol("ddV")] = symbol("ddV_jp");
    return names;
}

exmap backward_step() {
    exmap names;
    const std::vector<std::string> earlier{"jm", "jmxi", "jm1xi", "j"};
    for (int i = 0; i < 4; ++i) names[symbol("q_" + node_name[i])] = symbol("q_" + earlier[i]);
    for (int i = 1; i < 4; ++i) names[symbol("dV_" + node_name[i])] = symbol("dV_" + earlier[i]);
    return names;
}

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
            const std::string x = i == 3 ? "r" : node_name[i + 1];
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
    for (double value : values) text += (text.empty() ? "" : ", ") + fmt::format("{:.1e}", value);
    return text;
}

std::string jacobian_numbers() {
    const std::string formula = std::string(printed_jacobian).substr(7);
    const numeric step(1, 10);
    return fmt::format(
        "element (2, 1). Newton's largest residual after each iteration (pendulum, h = 0.1, 40 digits), printed "
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

void equations(std::vector<Statement>& list) {
    const Integrator& scheme = integrator();
    const ex m = symbol("m"), omega = symbol("omega"), q = symbol("q");
    const ex potential = m * omega * omega * (1 - GiNaC::cos(q));
    list.push_back({.label = "before eq:discreteLagrangianNL: the pendulum",
                    .section = "5",
                    .what = "the equation of motion",
                    .parts = {{.text = "q2 + omega^2*sin(q) = 0",
                               .derived = symbol("q2") + potential.diff(GiNaC::ex_to<GiNaC::symbol>(q)) / m,
                               .kind = Kind::equation}},
                    .route = "q″ = −V′(q)/m with V = mω²(1 − cos q)"});
    list.push_back({.label = "eq:discreteLagrangianNL",
                    .section = "5",
                    .what = "the discrete Lagrangian for any V",
                    .parts = {{.text = "L_d = m/(12*h)*(26*(q_l^2+q_r^2) - 2*q_l*q_r + 50*(q_xi^2-q_xi*q_1xi+q_1xi^2) "
                                       "- 25*(q_l+q_r)*(q_xi+q_1xi) "
                                       "- 15*sqrt(5)*(q_l-q_r)*(q_xi-q_1xi)) - h/12*(V_l + 5*(V_xi+V_1xi) + V_r)",
                               .derived = scheme.discrete}},
                    .route = "h(K_d − U): K_d integrated, U by the quadrature"});
    list.push_back({.label = "eq:ELinternalNL",
                    .section = "5",
                    .what = "the inner discrete Euler–Lagrange equations",
                    .parts = {},
                    .route = "definition; explicit in the next display",
                    .sentence = "∂L_d/∂q_ξ = 0; ∂L_d/∂q_{1−ξ} = 0",
                    .introduces = true});
    list.push_back(
        {.label = "eq:internesNL",
         .section = "5",
         .what = "the same, explicitly",
         .parts = {{.text = "q_xi - h^2/(30*m)*(dV_1xi+2*dV_xi) = (5+sqrt(5))/10*q_l + (5-sqrt(5))/10*q_r",
                    .derived = scheme.inner[0],
                    .kind = Kind::equation,
                    .factor = "2*h/(25*m)"},
                   {.text = "q_1xi - h^2/(30*m)*(2*dV_1xi+dV_xi) = (5-sqrt(5))/10*q_l + (5+sqrt(5))/10*q_r",
                    .derived = scheme.inner[1],
                    .kind = Kind::equation,
                    .factor = "2*h/(25*m)"}},
         .route =
             "the sums 2∂L_d/∂q_ξ + ∂L_d/∂q_{1−ξ} and ∂L_d/∂q_ξ + 2∂L_d/∂q_{1−ξ} named before it, times the factor"});
    list.push_back(
        {.label = "eq:ELequationsNL",
         .section = "5",
         .what = "the discrete Euler–Lagrange equations at q_j",
         .parts = {},
         .route = "definition: ∂S_d/∂q_j = 0",
         .sentence = "∂L_d/∂q_r (q_{j−1}, q_{j−1+ξ}, q_{j−ξ}, q_j) + ∂L_d/∂q_ℓ (q_j, q_{j+ξ}, q_{j+1−ξ}, q_{j+1}) = 0",
         .introduces = true});
    list.push_back({.label = "after eq:ELequationsNL: border equations",
                    .section = "5",
                    .what = "the same, explicitly",
                    .parts = {{.text = "1/h^2*(q_jm-2*q_j+q_jp) + 1/(24*m)*((5-sqrt(5))*dV_jmxi + (5+sqrt(5))*dV_jm1xi "
                                       "+ 4*dV_j + (5+sqrt(5))*dV_jxi + (5-sqrt(5))*dV_j1xi) = 0",
                               .derived = scheme.right.subs(backward_step()) + scheme.left.subs(forward_step()),
                               .kind = Kind::equation,
                               .factor = "-1/(m*h)"}},
                    .route = "∂L_d/∂q_r + ∂L_d/∂q_ℓ with the inner states of eq:internesNL, times the factor"});
    list.push_back({.label = "after the border equations: p_r, p_{j+1}, p_j",
                    .section = "5",
                    .what = "momenta at both ends",
                    .parts = {},
                    .route = "definitions; eq:ELequationsNL makes the two of one instant equal, since ∂L_d/∂q_r − "
                             "(−∂L_d/∂q_ℓ) is its left side",
                    .sentence = "p_r = ∂L_d/∂q_r; p_{j+1} = ∂L_d/∂q_r (q_j, q_{j+ξ}, q_{j+1−ξ}, q_{j+1}); p_j = "
                                "−∂L_d/∂q_ℓ (q_j, q_{j+ξ}, q_{j+1−ξ}, q_{j+1})",
                    .introduces = true});
    const exmap momenta{{symbol("p_jp"), scheme.right.subs(forward_step())},
                        {symbol("p_j"), -scheme.left.subs(forward_step())}};
    list.push_back(
        {.label = "eq:discreteDynamics",
         .section = "5",
         .what = "one step in momentum and state",
         .parts = {{.text = "p_jp - p_j + h/12*(dV_j + 5*(dV_jxi+dV_j1xi) + dV_jp) = 0",
                    .derived = 0,
                    .kind = Kind::equation,
                    .values = momenta},
                   {.text =
                        "q_jp - q_j - h^2/(24*m)*(dV_jp + sqrt(5)*(dV_j1xi-dV_jxi) - dV_j) - h/(2*m)*(p_jp+p_j) = 0",
                    .derived = 0,
                    .kind = Kind::equation,
                    .values = momenta}},
         .route = "both lines with p_{j+1} = ∂L_d/∂q_r and p_j = −∂L_d/∂q_ℓ, inner states of eq:internesNL"});
}

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

void symplecticity(std::vector<Statement>& list) {
    const Integrator& scheme = integrator();
    const exmap later = forward_step();
    GiNaC::matrix block(2, 2);  // d(inner equations)/d(q_xi, q_1xi)
    for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j) block(i, j) = scheme.jacobian(i, j).subs(later);
    const ex determinant = block.determinant().expand();
    // block (dq_xi, dq_1xi) = -d(inner equations)/dq_l dq_j - d(inner equations)/dq_r dq_{j+1}, by Cramer's rule
    ex forcing[2], from_left[2], from_right[2];
    for (int i = 0; i < 2; ++i) {
        from_left[i] = -along(scheme.full[i], "l").subs(later);
        from_right[i] = -scheme.jacobian(i, 3).subs(later);
        forcing[i] = from_left[i] * symbol("delta_q_j") + from_right[i] * symbol("delta_q_jp");
    }
    const auto cramer = [&](const ex(&side)[2], int i) {
        const int other = 1 - i;
        const ex numerator = side[i] * block(other, other) - side[other] * block(i, other);
        return (numerator.expand() / determinant).normal();
    };
    const ex m = symbol("m");
    const ex Delta = (300 * m * m * determinant).expand();
    const exmap known{{symbol("Delta"), Delta}};
    list.push_back(
        {.label = "after \"Symplectic Structure\": δq",
         .section = "5",
         .what = "variations of the inner states, and Δ",
         .parts = {{.text = "q_jxi_d = 1/Delta*(30*m^2*((5+sqrt(5))*delta_q_j - (-5+sqrt(5))*delta_q_jp) - "
                            "m*h^2*ddV_j1xi*((5+3*sqrt(5))*delta_q_j + (5-3*sqrt(5))*delta_q_jp))",
                    .derived = cramer(forcing, 0),
                    .values = known},
                   {.text = "q_j1xi_d = 1/Delta*(-30*m^2*((-5+sqrt(5))*delta_q_j - (5+sqrt(5))*delta_q_jp) - "
                            "m*h^2*ddV_jxi*((5-3*sqrt(5))*delta_q_j + (5+3*sqrt(5))*delta_q_jp))",
                    .derived = cramer(forcing, 1),
                    .values = known},
                   {.text = "Delta = 300*m^2 - 20*m*h^2*(ddV_jxi+ddV_j1xi) + h^4*ddV_jxi*ddV_j1xi", .derived = Delta}},
         .route = "eq:internesNL differentiated, solved by Cramer's rule; Δ is 300m² times the determinant"});

    // A (dp, dq)_{j+1} = B (dp, dq)_j: eq:discreteDynamics differentiated, inner variations eliminated.
    GiNaC::matrix A(2, 2), B(2, 2);
    const GiNaC::symbol before = GiNaC::ex_to<GiNaC::symbol>(symbol("p_j"));
    for (int i = 0; i < 2; ++i) {
        const ex by_xi = scheme.jacobian(i + 2, 0).subs(later), by_1xi = scheme.jacobian(i + 2, 1).subs(later);
        A(i, 0) = scheme.jacobian(i + 2, 2);
        A(i, 1) =
            scheme.jacobian(i + 2, 3).subs(later) + by_xi * cramer(from_right, 0) + by_1xi * cramer(from_right, 1);
        B(i, 0) = -scheme.full[i + 2].diff(before);
        B(i, 1) =
            -along(scheme.full[i + 2], "l").subs(later) - by_xi * cramer(from_left, 0) - by_1xi * cramer(from_left, 1);
    }
    const ex det_A = A(0, 0) * A(1, 1) - A(0, 1) * A(1, 0), det_B = B(0, 0) * B(1, 1) - B(0, 1) * B(1, 0);
    const std::string printed = "1/(6*Delta)*(1800*m^2 + 30*m*h^2*(ddV_jxi+ddV_j1xi) + h^4*ddV_jxi*ddV_j1xi)";
    list.push_back({.label = "eq:symplecticSystemNL",
                    .section = "5",
                    .what = "the linearised step, det A = det B",
                    .parts = {{.text = "det_A = " + printed, .derived = det_A, .values = known},
                              {.text = "det_B = " + printed, .derived = det_B, .values = known}},
                    .route = "eq:discreteDynamics differentiated, the variations of the inner states eliminated",
                    .sentence = "A (δp, δq)_{j+1} = B (δp, δq)_j:"});
    list.push_back({.label = "after eq:symplecticSystemNL: symplectic",
                    .section = "5",
                    .what = "the tangent map has determinant 1",
                    .parts = {},
                    .route = "det(A⁻¹B) = det B / det A",
                    .sentence = "(∂p_{j+1}/∂p_j)(∂q_{j+1}/∂q_j) − (∂p_{j+1}/∂q_j)(∂q_{j+1}/∂p_j) = 1",
                    .holds = [=] { return equal(det_B / det_A, 1); }});
}

}  // namespace

void section_5(std::vector<Statement>& list) {
    equations(list);
    newton(list);
    symplecticity(list);
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
                    .route = "what is divided by what, and in which arithmetic, is not said",
                    .sentence = "growth rate 2.50e−11 when h = 0.1, 5.45e−14 when h = 0.05, 1.35e−13 when h = 0.025",
                    .instead = "measured: see figure 2",
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
                    .instead = "measured: see figure 4",
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
