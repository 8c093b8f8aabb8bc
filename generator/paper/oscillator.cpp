// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's section 4, harmonic oscillator, beginning: discrete Lagrangian, elimination, Euler-Lagrange equation.
#include <fmt/format.h>

#include "generator/paper/oscillator.hpp"
#include "generator/paper/symbols.hpp"

namespace lobatto::paper {

using GiNaC::ex;
using GiNaC::exmap;
using GiNaC::pow;

namespace {

ex x() {
    return pow(h() * omega(), 2);
}

std::vector<ex> states() {
    return {symbol("q_l"), symbol("q_xi"), symbol("q_1xi"), symbol("q_r")};
}

// q(theta) on one step.
ex interpolant() {
    ex q = 0;
    for (int j = 0; j < 4; ++j) q += states()[j] * lagrange_basis()[j];
    return q;
}

void mean_kinetic_energy(std::vector<Statement>& list) {
    const ex theta = symbol("theta"), q = interpolant(), slope = q.diff(GiNaC::ex_to<GiNaC::symbol>(theta));
    const ex mean_kinetic = (m() / (2 * pow(h(), 2)) * integrate_polynomial(pow(slope, 2))).expand();
    exmap slopes{{symbol("alpha"), ex(1) / 12}, {symbol("beta"), ex(5) / 12}};
    GiNaC::lst stiffness;
    for (int i = 0; i < 4; ++i) {
        slopes[symbol("a" + std::to_string(i))] = slope.subs(theta == nodes()[i]).expand();
        GiNaC::lst row;
        for (int j = 0; j < 4; ++j) {
            const GiNaC::symbol t = GiNaC::ex_to<GiNaC::symbol>(theta);
            row.append(integrate_polynomial((lagrange_basis()[i].diff(t) * lagrange_basis()[j].diff(t)).expand()));
        }
        stiffness.append(row);
    }
    list.push_back({.label = "eq:continuousAction",
                    .section = "4",
                    .what = "the action",
                    .parts = {},
                    .route = "definition",
                    .sentence = "S_c = ∫₀ᵀ L(dq/dt, q) dt,  L = ½m(dq/dt)² − V(q)",
                    .introduces = true});
    list.push_back({.label = "after eq:continuousAction: K_d",
                    .section = "4",
                    .what = "the mean kinetic energy, in t and in θ",
                    .parts = {},
                    .route = "both integrals of the interpolant, with θ = t/h",
                    .sentence = "K_d = (1/h) ∫₀ʰ ½m(dq/dt)² dt = ½m ∫₀¹ ((1/h)dq/dθ)² dθ",
                    .holds = [=] {
                        // ∫_0^h f(t/h) dt: t^k/h^k integrates to h/(k + 1)
                        const GiNaC::symbol t("t");
                        const ex integrand = (m() / 2 * pow(q.subs(theta == t / h()).diff(t), 2)).expand();
                        ex integral = 0;
                        for (int k = 0; k <= integrand.degree(t); ++k)
                            integral += integrand.coeff(t, k) * pow(h(), k + 1) / (k + 1);
                        return equal(integral / h(), mean_kinetic);
                    }});
    list.push_back({.label = "eq:discreteKE",
                    .section = "4",
                    .what = "the mean kinetic energy by quadrature",
                    .parts = {{.text = "K_d = m/(2*h^2)*(alpha*(a0^2+a3^2) + beta*(a1^2+a2^2))",
                               .derived = mean_kinetic,
                               .values = slopes}},
                    .route = "f_i = dq/dθ(c_i); equal to the exact integral, since (dq/dθ)² has degree 4"});
    list.push_back({.label = "eq:rigidityKE",
                    .section = "4",
                    .what = "the matrix of the quadratic form K_d",
                    .parts = {{.text = "K = {{13/3, -5*sqrt(5)/4-25/12, 5*sqrt(5)/4-25/12, -1/6}, {-5*sqrt(5)/4-25/12, "
                                       "25/3, -25/6, 5*sqrt(5)/4-25/12}, "
                                       "{5*sqrt(5)/4-25/12, -25/6, 25/3, -5*sqrt(5)/4-25/12}, {-1/6, "
                                       "5*sqrt(5)/4-25/12, -5*sqrt(5)/4-25/12, 13/3}}",
                               .derived = stiffness}},
                    .route = "K_ij = ∫ φ′_i φ′_j dθ, integrated exactly; the form equals the mean kinetic energy",
                    .sentence = "K_d ≡ m/(2h²) qᵗ K q, q = (q_0, q_ξ, q_{1−ξ}, q_1)ᵗ:",
                    .holds = [=] {
                        ex form = 0;
                        for (int i = 0; i < 4; ++i)
                            for (int j = 0; j < 4; ++j) form += states()[i] * stiffness.op(i).op(j) * states()[j];
                        return equal(m() / (2 * pow(h(), 2)) * form, mean_kinetic);
                    }});
}

void mean_potential_energy(std::vector<Statement>& list) {
    list.push_back(
        {.label = "eq:discretePE",
         .section = "4",
         .what = "the mean potential energy by quadrature",
         .parts = {},
         .route = "",
         .demonstration =
             [] {
                 const ex exact = ex(1) / 7, third = pow(node(), 6) + pow(1 - node(), 6);
                 const ex approximate = (ex(1) / 12 + ex(5) / 12 * third).expand();
                 return fmt::format(
                     "V = q² along the cubic q = θ³: integral {}, quadrature {}, difference 1/{}. The square of a "
                     "cubic has degree 6. The paper "
                     "uses the quadrature throughout, so nothing that follows depends on this sign",
                     decimal(at(exact, {})), decimal(at(approximate, {})), decimal(at(1 / (approximate - exact), {})));
             },
         .sentence =
             "V(q) polynomial of degree ≤ 5: U ≡ (1/h) ∫₀ʰ V(q(t)) dt = α[V(q_0)+V(q_1)] + β[V(q_ξ)+V(q_{1−ξ})]",
         .holds =
             [] {
                 const ex theta = symbol("theta");
                 for (int degree = 1; degree <= 5; ++degree) {  // q = theta^3 is one of the interpolants
                     ex quadrature = 0;
                     for (int i = 0; i < 4; ++i) quadrature += weights()[i] * pow(nodes()[i], 3 * degree);
                     if (!equal(quadrature, integrate_polynomial(pow(theta, 3 * degree)))) return false;
                 }
                 return true;
             },
         .instead = "(1/h) ∫₀ʰ V(q(t)) dt ≈ U = α[V(q_0)+V(q_1)] + β[V(q_ξ)+V(q_{1−ξ})], with equality when V(q(t)) "
                    "has degree ≤ 5 in t: for a "
                    "cubic q, when V is of degree 1"});
}

void discrete_lagrangian(std::vector<Statement>& list) {
    list.push_back(
        {.label = "eq:discreteLagrangian",
         .section = "4",
         .what = "the discrete Lagrangian of the oscillator",
         .parts = {{.text =
                        "L_d = m/(12*h)*(26*(q_l^2+q_r^2) - 2*q_l*q_r + 50*(q_xi^2-q_xi*q_1xi+q_1xi^2) - "
                        "25*(q_l+q_r)*(q_xi+q_1xi) "
                        "- 15*sqrt(5)*(q_l-q_r)*(q_xi-q_1xi)) - m*h*omega^2/24*(q_l^2 + q_r^2 + 5*(q_xi^2+q_1xi^2))",
                    .derived = oscillator().discrete}},
         .route = "h(K_d − U): K_d integrated, U by the quadrature"});
}

void elimination(std::vector<Statement>& list) {
    const Oscillator& system = oscillator();
    const exmap known{{symbol("delta"), system.determinant}};
    list.push_back({.label = "after eq:discreteLagrangian: stationarity",
                    .section = "4",
                    .what = "the inner discrete Euler–Lagrange equations",
                    .parts = {},
                    .route = "definition; solved in the next display",
                    .sentence = "∂L_d/∂q_ξ = 0,  ∂L_d/∂q_{1−ξ} = 0",
                    .introduces = true});
    list.push_back(
        {.label = "eq:qxiq1mxi",
         .section = "4",
         .what = "the inner states",
         .parts = {{.text = "q_xi = 1/delta*(-5*(h^2*omega^2-30)*(q_r+q_l) + 3*sqrt(5)*(h^2*omega^2-10)*(q_r-q_l))",
                    .derived = system.inner[0],
                    .values = known},
                   {.text = "q_1xi = 1/delta*(-5*(h^2*omega^2-30)*(q_r+q_l) - 3*sqrt(5)*(h^2*omega^2-10)*(q_r-q_l))",
                    .derived = system.inner[1],
                    .values = known}},
         .route = "the two linear equations ∂L_d/∂q_ξ = ∂L_d/∂q_{1−ξ} = 0 solved by Cramer's rule"});
    list.push_back(
        {.label = "eq:stabilityCondition",
         .section = "4",
         .what = "the determinant δ and its sign",
         .parts = {{.text = "delta = (h^2*omega^2-30)*(h^2*omega^2-10)",
                    .derived = system.hessian_determinant,
                    .factor = "144*h^2/(25*m^2)"}},
         .route = "determinant of ∂²L_d/∂(q_ξ, q_{1−ξ})²; positive for 0 < h²ω² < 10, where both factors are negative",
         .sentence = "δ > 0 for 0 < hω < √10:",
         .holds = [] {
             const ex y = symbol("r");
             return keeps_sign(((y - 30) * (y - 10)).expand(), 1, {10, 30}, 0, 10, 1);
         }});
    list.push_back(
        {.label = "after eq:stabilityCondition: L_r",
         .section = "4",
         .what = "the reduced Lagrangian",
         .parts =
             {{.text =
                   "L_r = 1/(6*h*delta)*(m/4*(-h^6*omega^6 + 92*h^4*omega^4 - 1680*h^2*omega^2 + 3600)*(q_l^2+q_r^2) "
                   "- m*(h^4*omega^4 + 60*h^2*omega^2 + 1800)*q_l*q_r)",
               .derived = system.reduced,
               .values = known}},
         .route = "the inner states substituted into L_d"});
    list.push_back({.label = "after eq:stabilityCondition: S_d",
                    .section = "4",
                    .what = "the discrete action",
                    .parts = {},
                    .route = "definition",
                    .sentence = "S_d = Σ_j L_r(q_j, q_{j+1})",
                    .introduces = true});
    list.push_back({.label = "eq:centerEL",
                    .section = "4",
                    .what = "the discrete Euler–Lagrange equation at q_j",
                    .parts = {},
                    .route = "∂S_d/∂q_j of two neighbouring terms of S_d equals the printed sum",
                    .sentence = "∂/∂q_r L_r(q_{j−1}, q_j) + ∂/∂q_ℓ L_r(q_j, q_{j+1}) = 0",
                    .holds = [] {
                        const Oscillator& o = oscillator();
                        const ex l = symbol("q_l"), r = symbol("q_r"), middle = symbol("q_j");
                        const ex action = o.reduced.subs(GiNaC::lst{l == symbol("q_jm"), r == middle}) +
                                          o.reduced.subs(GiNaC::lst{l == middle, r == symbol("q_jp")});
                        return equal(action.diff(GiNaC::ex_to<GiNaC::symbol>(middle)), o.border);
                    }});
    list.push_back(
        {.label = "eq:discreteCenterEL",
         .section = "4",
         .what = "the same, explicitly",
         .parts = {{.text = "1/h^2*(q_jm-2*q_j+q_jp) + omega^2/30*(q_jm+28*q_j+q_jp) + "
                            "omega^4*h^2/1800*(q_jm-92*q_j+q_jp) + omega^6*h^4/1800*q_j = 0",
                    .derived = system.border,
                    .kind = Kind::equation,
                    .factor = "-(h^2*omega^2-30)*(h^2*omega^2-10)/(300*m*h)"}},
         .route =
             "eq:centerEL with L_r differentiated; the printed line is that times the factor, δ = (h²ω²−30)(h²ω²−10)"});
}

Oscillator derive_oscillator() {
    Oscillator system;
    const ex slope = interpolant().diff(GiNaC::ex_to<GiNaC::symbol>(symbol("theta")));
    ex potential = 0;
    for (int i = 0; i < 4; ++i) potential += weights()[i] * m() * pow(omega(), 2) / 2 * pow(states()[i], 2);
    system.discrete = (m() / (2 * h()) * integrate_polynomial(pow(slope, 2)) - h() * potential).expand();

    const GiNaC::symbol u = GiNaC::ex_to<GiNaC::symbol>(symbol("q_xi")),
                        v = GiNaC::ex_to<GiNaC::symbol>(symbol("q_1xi"));
    const ex f = system.discrete.diff(u), g = system.discrete.diff(v);
    const ex fu = f.diff(u), fv = f.diff(v), gv = g.diff(v), f0 = f.subs(GiNaC::lst{u == 0, v == 0}),
             g0 = g.subs(GiNaC::lst{u == 0, v == 0});
    system.hessian_determinant = (fu * gv - fv * fv).expand();
    system.inner = {((g0 * fv - f0 * gv).expand() / system.hessian_determinant).normal(),
                    ((f0 * fv - g0 * fu).expand() / system.hessian_determinant).normal()};
    system.determinant = ((x() - 30) * (x() - 10)).expand();

    // L_d at its stationary inner point; the numerator is reduced over Q(sqrt 5) by hand, since normal() takes sqrt(5)
    // for a variable.
    const ex D = system.hessian_determinant, top_u = (g0 * fv - f0 * gv).expand(), top_v = (f0 * fv - g0 * fu).expand();
    const ex outer = system.discrete.subs(GiNaC::lst{u == 0, v == 0});
    const ex numerator =
        (outer * D + (f0 * top_u + g0 * top_v) / 2).expand();  // quadratic: L(stationary) = L(0) + gradient . point / 2
    system.reduced = (numerator / D).normal();

    const GiNaC::symbol l = GiNaC::ex_to<GiNaC::symbol>(symbol("q_l")), r = GiNaC::ex_to<GiNaC::symbol>(symbol("q_r"));
    system.right_momentum = system.reduced.diff(r).normal();
    system.left_momentum = (-system.reduced.diff(l)).normal();
    system.border = (system.right_momentum.subs(GiNaC::lst{l == symbol("q_jm"), r == symbol("q_j")}) -
                     system.left_momentum.subs(GiNaC::lst{l == symbol("q_j"), r == symbol("q_jp")}))
                        .normal();
    return system;
}

}  // namespace

const Oscillator& oscillator() {
    static const Oscillator system = derive_oscillator();
    return system;
}

void section_4(std::vector<Statement>& list) {
    mean_kinetic_energy(list);
    mean_potential_energy(list);
    discrete_lagrangian(list);
    elimination(list);
    truncation_and_stability(list);
    symplectic_structure(list);
}

}  // namespace lobatto::paper
