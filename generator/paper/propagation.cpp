// SPDX-License-Identifier: GPL-2.0-or-later
// The paper's section 4, second half: momenta, the propagation matrix, its determinant and its invariant.
#include "generator/paper/oscillator.hpp"
#include "generator/paper/symbols.hpp"

namespace lobatto::paper {

using GiNaC::ex;
using GiNaC::exmap;
using GiNaC::pow;

namespace {

// Phi of (p, q)_{j+1} = Phi (p, q)_j, from p_j = -dL_r/dq_l and p_{j+1} = dL_r/dq_r, entries pp, pq, qp, qq.
struct Propagation {
    ex pp, pq, qp, qq;
};

Propagation propagation() {
    const GiNaC::symbol l = GiNaC::ex_to<GiNaC::symbol>(symbol("q_l")), r = GiNaC::ex_to<GiNaC::symbol>(symbol("q_r"));
    const Oscillator& system = oscillator();
    const ex left_l = system.left_momentum.diff(l).normal(), left_r = system.left_momentum.diff(r).normal();
    const ex right_l = system.right_momentum.diff(l).normal(), right_r = system.right_momentum.diff(r).normal();
    // p_j = left_l q_j + left_r q_{j+1};  p_{j+1} = right_l q_j + right_r q_{j+1}
    return {(right_r / left_r).normal(), (right_l - right_r * left_l / left_r).normal(), (1 / left_r).normal(),
            (-left_l / left_r).normal()};
}

// (h omega)^2
ex squared_angle() {
    return pow(symbol("h") * symbol("omega"), 2);
}

// a, b, c and the common denominator of Phi, which is 1 at h = 0.
exmap propagation_coefficients() {
    const Propagation Phi = propagation();
    const ex x = squared_angle(), common = (1 + x / 30 + x * x / 1800).expand();
    return {{symbol("a"), (Phi.pp * common).normal()},
            {symbol("b"), (Phi.pq * common).normal()},
            {symbol("c"), (Phi.qp * common).normal()},
            {symbol("delta_tilde"), common}};
}

void momenta_at_both_ends(std::vector<Statement>& list) {
    const Oscillator& system = oscillator();
    const exmap delta{{symbol("delta"), system.determinant}};
    const GiNaC::lst step{symbol("q_l") == symbol("q_j"), symbol("q_r") == symbol("q_jp")};
    const exmap momenta{{symbol("p_j"), system.left_momentum.subs(step)},
                        {symbol("p_jp"), system.right_momentum.subs(step)}};
    list.push_back({.label = "eq:rightMomentum",
                    .section = "4",
                    .what = "the momentum at the right end",
                    .parts = {},
                    .route = "definition",
                    .sentence = "p_r = ∂L_r/∂q_r (q_ℓ, q_r)",
                    .introduces = true});
    list.push_back({.label = "after eq:rightMomentum: p_r",
                    .section = "4",
                    .what = "the same for the oscillator",
                    .parts = {{.text = "p_r = m*(q_r-q_l)/h + m/(6*delta)*(-300*h*omega^2*(q_l+2*q_r) + "
                                       "5*h^3*omega^4*(q_l+8*q_r) - 1/2*h^5*omega^6*q_r)",
                               .derived = system.right_momentum,
                               .values = delta}},
                    .route = "L_r differentiated"});
    list.push_back({.label = "before eq:discreteSystem: p_j",
                    .section = "4",
                    .what = "the momentum at the left end",
                    .parts = {},
                    .route = "eq:centerEL says that ∂L_r/∂q_r of the last step minus this is zero",
                    .sentence = "p_j = ∂L_r(q_{j−1}, q_j)/∂q_r, so p_j = −∂L_r(q_j, q_{j+1})/∂q_ℓ",
                    .holds = [] {
                        const Oscillator& o = oscillator();
                        const ex before = o.right_momentum.subs(
                            GiNaC::lst{symbol("q_l") == symbol("q_jm"), symbol("q_r") == symbol("q_j")});
                        const ex after = o.left_momentum.subs(
                            GiNaC::lst{symbol("q_l") == symbol("q_j"), symbol("q_r") == symbol("q_jp")});
                        return equal(before - after, o.border);
                    }});
    list.push_back(
        {.label = "eq:discreteSystem",
         .section = "4",
         .what = "one step in momentum and state",
         .parts = {{.text = "(p_jp-p_j)/h = -m*omega^2*(h^2*omega^2-60)/(12*(h^2*omega^2-10))*(q_j+q_jp)",
                    .derived = 0,
                    .kind = Kind::equation,
                    .values = momenta},
                   {.text = "(q_jp-q_j)/h = 24*(30-h^2*omega^2)/(h^4*omega^4-84*h^2*omega^2+720)*(p_j+p_jp)/(2*m)",
                    .derived = 0,
                    .kind = Kind::equation,
                    .values = momenta}},
         .route = "both sides with p_j = −∂L_r/∂q_ℓ and p_{j+1} = ∂L_r/∂q_r"});
}

void propagation_matrix(std::vector<Statement>& list) {
    const Propagation Phi = propagation();
    const exmap coefficients = propagation_coefficients();
    list.push_back({.label = "eq:symplecticSystem",
                    .section = "4",
                    .what = "the propagation matrix has equal diagonal entries",
                    .parts = {},
                    .route = "p_j = −∂L_r/∂q_ℓ, p_{j+1} = ∂L_r/∂q_r solved for (p, q)_{j+1}",
                    .sentence = "(p_{j+1}, q_{j+1})ᵗ = Φ (p_j, q_j)ᵗ, Φ = (1/δ̃) [[a, b], [c, a]]",
                    .holds = [=] { return equal(Phi.pp, Phi.qq); }});
    list.push_back({.label = "eq:symplecticCoeffs",
                    .section = "4",
                    .what = "its coefficients",
                    .parts = {{.text = "delta_tilde = 1 + h^2*omega^2/30 + h^4*omega^4/1800",
                               .derived = coefficients.at(symbol("delta_tilde"))},
                              {.text = "a = 1 - 7/15*h^2*omega^2 + 23/900*h^4*omega^4 - 1/3600*h^6*omega^6",
                               .derived = coefficients.at(symbol("a"))},
                              {.text = "b = m*h*omega^2/43200*(h^2*omega^2-60)*(h^4*omega^4-84*h^2*omega^2+720)",
                               .derived = coefficients.at(symbol("b"))},
                              {.text = "c = h/m*(1 - 2/15*h^2*omega^2 + 1/300*h^4*omega^4)",
                               .derived = coefficients.at(symbol("c"))}},
                    .route = "entries of Φ times δ̃, the common denominator with δ̃(h = 0) = 1"});
    list.push_back({.label = "after eq:symplecticCoeffs: det Φ",
                    .section = "4",
                    .what = "det Φ = 1: symplectic",
                    .parts = {{.text = "det = (a^2 - b*c)/delta_tilde^2", .derived = 1, .values = coefficients}},
                    .route = "the derived coefficients"});
}

void discrete_energy(std::vector<Statement>& list) {
    const ex h = symbol("h"), m = symbol("m"), omega = symbol("omega"), p = symbol("p"), q = symbol("q");
    const Propagation Phi = propagation();
    const exmap coefficients = propagation_coefficients();
    list.push_back({.label = "after eq:symplecticCoeffs: H",
                    .section = "4",
                    .what = "the exact flow preserves H",
                    .parts = {},
                    .route = "dH/dt = (∂H/∂q)(∂H/∂p) − (∂H/∂p)(∂H/∂q), with q′ = p/m and p′ = −mω²q",
                    .sentence = "H(p, q) = p²/(2m) + (mω²/2)q²",
                    .holds = [=] {
                        const ex H = p * p / (2 * m) + m * omega * omega / 2 * q * q;
                        const ex rate = H.diff(GiNaC::ex_to<GiNaC::symbol>(q)) * p / m -
                                        H.diff(GiNaC::ex_to<GiNaC::symbol>(p)) * m * omega * omega * q;
                        return equal(rate, 0);
                    }});
    const ex invariant = (Phi.qp * p * p + (Phi.qq - Phi.pp) * p * q - Phi.pq * q * q) / 2;
    list.push_back({.label = "eq:discreteEnergy",
                    .section = "4",
                    .what = "the discrete energy",
                    .parts = {{.text = "H_d = c/(2*delta_tilde)*p^2 - b/(2*delta_tilde)*q^2",
                               .derived = invariant,
                               .values = coefficients}},
                    .route = "½(Φ₂₁p² + (Φ₂₂−Φ₁₁)pq − Φ₁₂q²), the form every matrix of determinant 1 preserves; "
                             "checked by substitution. It approximates h·H, not H",
                    .holds = [=] {
                        const ex moved =
                            invariant.subs(GiNaC::lst{p == Phi.pp * p + Phi.pq * q, q == Phi.qp * p + Phi.qq * q},
                                           GiNaC::subs_options::no_pattern);
                        return equal(moved, invariant);
                    }});
    list.push_back(
        {.label = "after eq:discreteEnergy: −b > 0",
         .section = "4",
         .what = "the discrete energy is positive definite",
         .parts = {},
         .route = "b = mhω²/43200·(y−60)(y²−84y+720), y = h²ω²: no root below y = 42 − 6√29, negative at "
                  "the middle; likewise c > 0 below y = 10",
         .sentence = "under eq:stabilityCondition2, −b > 0",
         .holds = [=] {
             const ex x = squared_angle(), bound = 42 - 6 * GiNaC::sqrt(ex(29)), b = coefficients.at(symbol("b"));
             const exmap middle{{m, 1}, {h, 1}, {omega, GiNaC::sqrt(bound / 2)}};
             const ex factored = m * h * pow(omega, 2) / 43200 * (x - 60) * (x - bound) * (x - 84 + bound);
             return equal(b, factored) && at(b, middle) < 0 && at(60 - bound, {}) > 0 && at(84 - 2 * bound, {}) > 0;
         }});
}

}  // namespace

void symplectic_structure(std::vector<Statement>& list) {
    momenta_at_both_ends(list);
    propagation_matrix(list);
    discrete_energy(list);
}

}  // namespace lobatto::paper
