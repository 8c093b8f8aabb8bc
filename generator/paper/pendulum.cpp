// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's section 5: the integrator for any potential V(q), its equations and symplectic structure.
#include <fmt/format.h>

#include "generator/paper/pendulum.hpp"
#include "generator/paper/symbols.hpp"

namespace lobatto::paper {

using GiNaC::ex;
using GiNaC::exmap;
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

const char* const border_text =
    "1/h^2*(q_jm-2*q_j+q_jp) + 1/(24*m)*((5-sqrt(5))*dV_jmxi + (5+sqrt(5))*dV_jm1xi "
    "+ 4*dV_j + (5+sqrt(5))*dV_jxi + (5-sqrt(5))*dV_j1xi)";

void internal_equations(std::vector<Statement>& list) {
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
}

void border_equations(std::vector<Statement>& list) {
    const Integrator& scheme = integrator();
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
                    .parts = {{.text = std::string(border_text) + " = 0",
                               .derived = scheme.right.subs(backward_step()) + scheme.left.subs(forward_step()),
                               .kind = Kind::equation,
                               .factor = "-1/(m*h)"}},
                    .route = "∂L_d/∂q_r + ∂L_d/∂q_ℓ with the inner states of eq:internesNL, times the factor"});
    list.push_back({.label = "after the border equations: p_r",
                    .section = "5",
                    .what = "the momentum at the right end",
                    .parts = {},
                    .route = "definition",
                    .sentence = "p_r = ∂L_d/∂q_r (q_ℓ, q_ξ, q_{1−ξ}, q_r)",
                    .introduces = true});
    list.push_back({.label = "after the border equations: p_{j+1}",
                    .section = "5",
                    .what = "the same at the end of a step",
                    .parts = {},
                    .route = "definition",
                    .sentence = "p_{j+1} = ∂L_d/∂q_r (q_j, q_{j+ξ}, q_{j+1−ξ}, q_{j+1})",
                    .introduces = true});
    list.push_back({.label = "after the border equations: p_j",
                    .section = "5",
                    .what = "the momentum at the left end",
                    .parts = {},
                    .route = "∂L_d/∂q_r of the step before minus this is −mh times the border equation above",
                    .sentence = "p_j = −∂L_d/∂q_ℓ (q_j, q_{j+ξ}, q_{j+1−ξ}, q_{j+1})",
                    .holds = [] {
                        const ex before = integrator().right.subs(backward_step()),
                                 after = -integrator().left.subs(forward_step());
                        return equal(before - after, -symbol("m") * symbol("h") * read(border_text));
                    }});
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

const Integrator& integrator() {
    static const Integrator result = derive();
    return result;
}

void section_5(std::vector<Statement>& list) {
    internal_equations(list);
    border_equations(list);
    newton(list);
    symplecticity(list);
}

}  // namespace lobatto::paper
